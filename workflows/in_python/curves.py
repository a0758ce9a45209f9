"""``cf.deflection_curves``: how the rim of a carrier deflects under unit loads."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from carrierflex.fe.carrier_curves import named_curves
from carrierflex.fe.curve_files import write_curves
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.geometry.parameter_files import StageParameters, read_parameters
from carrierflex.geometry.parameters import DEFAULT_SIZE
from carrierflex.workflows.fe.carrier_variants import carrier_variant
from carrierflex.workflows.in_python.notebook import shown_in_notebook

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame


@dataclass(frozen=True, eq=False, repr=False)
class Curves:
    """Deflection curves of a carrier.

    Parameters
    ----------
    parameters : StageParameters
        Dimensions they belong to.
    size : float
        Element edge length [m].
    by_name : mapping of str to DeflectionCurve
        ``delta_s``, ``delta_f`` [m per kN m of torque], ``g_s``, ``g_f`` [m per N on pin 1].
    """

    parameters: StageParameters
    size: float
    by_name: Mapping[str, DeflectionCurve]

    def __getitem__(self, name: str) -> DeflectionCurve:
        """The curve of this name."""
        return self.by_name[name]

    def to_dataframe(self) -> "DataFrame":
        """Axial displacement by curve, over the carrier-frame angle [rad] as index."""
        import pandas as pd

        angle = self.by_name["delta_s"].angle
        columns = {name: curve.axial for name, curve in self.by_name.items()}
        return pd.DataFrame(columns, index=pd.Index(angle, name="theta"))

    def plot(self) -> "Figure":
        """Both torque curves over the carrier's angle, peaks marked."""
        from carrierflex.fe.view import curves_figure

        n_planets = self.parameters.carrier.n_planets
        return curves_figure(self.by_name["delta_s"], self.by_name["delta_f"], n_planets)

    def write(self, path: Path | str) -> Path:
        """Write the CSV that ``simulate --curves`` reads; the file's path."""
        write_curves(Path(path), self.by_name)
        return Path(path)

    def _rows(self) -> list[tuple[str, str]]:
        rows = []
        for name in ("delta_s", "delta_f"):
            curve = self.by_name[name]
            swing = 1e6 * float(np.ptp(curve.axial))
            peaks = len(curve.peak_angles())
            rows.append((name, f"{peaks} peaks, {swing:.3g} um peak to peak per kN m"))
        return rows

    def __repr__(self) -> str:
        """Size and peaks in one line."""
        inside = "; ".join(f"{name}: {text}" for name, text in self._rows())
        return f"Curves(elements of {self.size:g} m; {inside})"

    def _repr_html_(self) -> str:
        rows = [*self._rows(), ("elements", f"{self.size:g} m")]
        return shown_in_notebook("Deflection curves of the rim", rows, self.plot())


def deflection_curves(
    parameters: StageParameters | Path | str | None = None, *, size: float = DEFAULT_SIZE
) -> Curves:
    """Deflection curves of a parametric carrier by finite elements.

    Parameters
    ----------
    parameters : StageParameters, path or None
        Dimensions [m], or a TOML file of them; default: the default carrier.
    size : float
        Element edge length [m].

    Returns
    -------
    Curves
        Six peaks in delta_s, three in delta_f.

    Raises
    ------
    ValueError
        Where dimensions contradict one another, or the mesh cannot be made.
    """
    stage = stage_of(parameters)
    stiff = carrier_variant("stiff", stage, size)
    flexible = carrier_variant("flexible", stage, size)
    return Curves(stage, size, named_curves(stiff.deflection, flexible.deflection))


def stage_of(parameters: StageParameters | Path | str | None) -> StageParameters:
    """Parameters as they are, of a file, or the default ones."""
    if isinstance(parameters, StageParameters):
        return parameters
    return read_parameters(None if parameters is None else Path(parameters))
