"""``cf.reduced_body``, ``cf.given_body``: bodies of few coordinates, and what tells their worth."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from carrierflex.fe.structural_model import StructuralModel
from carrierflex.files.versions import provenance
from carrierflex.geometry.parameter_files import StageParameters
from carrierflex.geometry.parameters import DEFAULT_SIZE
from carrierflex.reduction.body_files import write_body
from carrierflex.reduction.certificate import Certificate, certify
from carrierflex.reduction.craig_bampton import craig_bampton, freedom_record
from carrierflex.reduction.held_structure import Grounded, grounded
from carrierflex.reduction.mechanisms import sound_grounding
from carrierflex.reduction.mode_count import chosen_modes, response_of_body, wanted_frequency
from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.workflows.fe.bodies import body_name, body_structure
from carrierflex.workflows.in_python.curves import stage_of
from carrierflex.workflows.in_python.notebook import shown_in_notebook
from carrierflex.workflows.reduction.half_sector_bodies import certified_half_sector
from carrierflex.workflows.reduction.reduce_matrices import MatrixFiles

if TYPE_CHECKING:
    from pandas import DataFrame

    from carrierflex.reduction.state_space import StateSpace


@dataclass(frozen=True, eq=False, repr=False)
class Body:
    """A Craig-Bampton body and its certificate.

    Parameters
    ----------
    model : ReducedModel
        K, M, D, pilots, sensor rows, mass.
    certificate : Certificate
        Checks, wanted beside reached.
    omega : ndarray, shape (n_modes,)
        Frequencies of the kept fixed-interface modes [rad/s].
    """

    model: ReducedModel
    certificate: Certificate
    omega: np.ndarray

    def to_dataframe(self) -> "DataFrame":
        """Checks of the certificate: name, reached, limit, met."""
        import pandas as pd

        return pd.DataFrame([vars(check) for check in self.certificate.checks])

    def write(self, path: Path | str) -> Path:
        """Write the body file (.h5) that ``export`` and ``simulate`` read; the file's path."""
        write_body(self.model, Path(path), self.certificate)
        return Path(path)

    def state_space(self) -> "StateSpace":
        """A, B, C, D with names and units: loads at the pilots in, pilots and sensors out.

        ``state_space().to_control()`` is an object of python-control.
        """
        from carrierflex.reduction.state_space import body_state_space

        return body_state_space(self.model)

    def _rows(self) -> list[tuple[str, str]]:
        first, last = self.omega[[0, -1]] / (2.0 * np.pi) if self.omega.size else (0.0, 0.0)
        return [
            ("coordinates", str(self.model.n_coordinates)),
            ("pilots", ", ".join(self.model.pilots)),
            ("modes", f"{self.omega.size}, {first:.0f} to {last:.0f} Hz with the pilots held"),
            ("certificate", "met" if self.certificate.met else "not met"),
        ]

    def __repr__(self) -> str:
        """Size and certificate in one line."""
        inside = "; ".join(f"{name}: {text}" for name, text in self._rows())
        return f"Body({inside})"

    def _repr_html_(self) -> str:
        return shown_in_notebook("Craig-Bampton body", self._rows())


def reduced_body(
    body: Literal["carrier", "pin", "main_shaft"] = "carrier",
    *,
    variant: Literal["stiff", "flexible"] = "flexible",
    parameters: StageParameters | Path | str | None = None,
    size: float = DEFAULT_SIZE,
    up_to: float | None = None,
    modes: int | None = None,
) -> Body:
    """Reduce a body to its pilots and fixed-interface modes, and certify it.

    Parameters
    ----------
    body : str
        carrier, pin or main_shaft.
    variant : str
        Of the carrier; stiff: pins bonded; flexible: no pins.
    parameters : StageParameters, path or None
        Dimensions [m], or a TOML file of them; default: the default carrier.
    size : float
        Element edge length [m].
    up_to : float, optional
        Frequency [Hz] up to which the body is to be used (750 where no number is given).
    modes : int, optional
        Number of modes instead; a group of equal frequency is kept whole.

    Returns
    -------
    Body
        The body; ``certificate.met`` tells whether it keeps what it must.

    Raises
    ------
    ValueError
        Where both `up_to` and `modes` are given, or dimensions contradict one another.
    """
    options = _options_of_modes(up_to, modes)
    stage = stage_of(parameters)
    name = body_name(body, variant)
    inputs = {"parameters": stage, "size": size, "body": body, "variant": variant}
    if body == "carrier":
        reduction, checks = certified_half_sector(name, stage, size, options)
        omega = reduction.basis.omega
        record = provenance(**inputs, modes=len(omega), by_symmetry=True)
        return Body(replace(reduction.model, provenance=record), checks, omega)
    _, structure = body_structure(name, stage, size)
    return _certified(structure, grounded(structure), inputs, options)


def given_body(
    stiffness: Path | str,
    mass: Path | str,
    interfaces: Path | str,
    *,
    up_to: float | None = None,
    modes: int | None = None,
) -> Body:
    """Reduce the body of another program's matrices, and certify it.

    Parameters
    ----------
    stiffness, mass : path
        Matrix files; may be one file.
    interfaces : path
        TOML file of units, nodes, pilots and sensors (docs/matrices.md).
    up_to, modes
        As in :func:`reduced_body`.

    Returns
    -------
    Body
        The body; what may be a mistake stands under ``warnings`` in ``model.provenance``.

    Raises
    ------
    FileNotFoundError, ValueError
        Where a file is missing or damaged, or they do not make one body.
    """
    options = _options_of_modes(up_to, modes)
    files = MatrixFiles(Path(stiffness), Path(mass), Path(interfaces))
    body = files.body()
    return _certified(body.structure, sound_grounding(body), files.inputs(body), options)


def _options_of_modes(up_to: float | None, modes: int | None) -> dict[str, Any]:
    """Options of ``carrierflex reduce`` that count modes; refused before any work."""
    if up_to is not None and modes is not None:
        raise ValueError(f"up_to is {up_to:g} and modes is {modes}; expected one of them")
    others = dict.fromkeys(("modes_below", "frf_tolerance"))
    return {**others, "interface": "fixed", "up_to": up_to, "modes": modes}


def _certified(
    structure: StructuralModel,
    body: Grounded,
    inputs: Mapping[str, object],
    options: Mapping[str, Any],
) -> Body:
    rule = chosen_modes(response_of_body(structure, body), options)
    reduction = craig_bampton(structure, rule, body=body)
    record = provenance(**inputs, modes=len(reduction.modes.omega)) | freedom_record(structure)
    reduction = replace(reduction, model=replace(reduction.model, provenance=record))
    checks = certify(structure, reduction, cut_off_hz=wanted_frequency(options))
    return Body(reduction.model, checks, reduction.modes.omega)
