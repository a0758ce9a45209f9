"""Loads, speeds and energies of a stage's runs: one growing CSV file and one picture a run."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, TYPE_CHECKING, Annotated

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv
from numpy.typing import NDArray

from carrierflex.files.whole_files import whole_file
from carrierflex.simulation.rexs.stage_results import RunMeans
from carrierflex.simulation.stage.load_channels import load_columns
from carrierflex.simulation.stage.response import StageDivergedError
from carrierflex.simulation.stage.stage_model import StageModel
from carrierflex.simulation.stage.stage_run import StageResponse
from carrierflex.workflows.outputs import save_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Revolutions that a picture shows.
_SHOWN_TURNS = 2.0
_BEARINGS = ("main_bearing", "bearing_A", "bearing_B")
_SHAFTS = ("carrier", "sun", "intermediate", "generator")
_ENERGIES = ("torque", "generator", "loads", "mount", "dissipated", "stored")


@dataclass
class LoadFile:
    """Columns of a run that grow piece by piece."""

    model: Annotated[StageModel, "The stage"]
    file: Annotated[IO[bytes], "CSV file"]
    means: Annotated[RunMeans | None, "Takes the columns too"] = None
    first: Annotated[
        list[dict[str, NDArray[np.float64]]], "Pieces of the first revolutions, for the picture"
    ] = field(default_factory=list)
    _begun: bool = False

    def append(self, piece: StageResponse) -> None:
        """Write the next piece."""
        columns = {
            "time": piece.record.time,
            **load_columns(self.model, piece.record, piece.loads),
        }
        if not self._begun:
            # Arrow would quote the column names.
            self.file.write((",".join(columns) + "\n").encode())
            self._begun = True
        if self.means is not None:
            self.means.append(columns)
        table = pa.table({name: pa.array(values) for name, values in columns.items()})
        pa_csv.write_csv(table, self.file, pa_csv.WriteOptions(include_header=False))
        angle = columns["carrier_angle"]
        shown = angle <= 2.0 * np.pi * _SHOWN_TURNS
        if shown.any():
            self.first.append({name: values[shown] for name, values in columns.items()})


def with_loads(
    pieces: Iterable[StageResponse],
    folder: Path,
    run: str,
    model: StageModel,
    *,
    means: RunMeans | None = None,
) -> Iterator[StageResponse]:
    """Pieces of a run, each written to ``<run>_loads.csv`` as it passes.

    The picture ``<run>_loads.png`` follows at the end. A run that diverges or is interrupted leaves
    what was written until then, as its record does.

    Parameters
    ----------
    pieces : iterable of StageResponse
        The run.
    folder : Path
        Folder that exists.
    run : str
        Name of the run.
    model : StageModel
        The stage.
    means : RunMeans, optional
        Takes the columns of every piece too.
    """
    stopped: BaseException | None = None
    with whole_file(folder / f"{run}_loads.csv") as temporary, temporary.open("wb") as file:
        grown = LoadFile(model, file, means)
        try:
            for piece in pieces:
                grown.append(piece)
                yield piece
        except (StageDivergedError, KeyboardInterrupt) as error:
            stopped = error
    if grown.first:
        columns = {
            name: np.concatenate([piece[name] for piece in grown.first]) for name in grown.first[0]
        }
        save_figure(folder / f"{run}_loads.png", loads_figure(run, columns))
    if stopped is not None:
        raise stopped


def loads_figure(run: str, columns: dict[str, NDArray[np.float64]]) -> "Figure":
    """Six panels over the first revolutions: meshes, pins, sharing, bearings, speeds, energies."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13, 7.5), layout="constrained")
    meshes, pins, sharing, bearings, speeds, energies = figure.subplots(2, 3, sharex=True).flat
    turns = columns["carrier_angle"] / (2.0 * np.pi)
    for planet in (1, 2, 3):
        for mate, style in (("sun", "-"), ("ring", "--")):
            values = columns[f"{mate}_mesh_{planet}"] / 1e3
            label = f"{mate}, planet {planet}"
            meshes.plot(turns, values, f"C{planet - 1}{style}", label=label, linewidth=0.9)
        tangential = -columns[f"pin_{planet}_force_tangential"] / 1e3
        pins.plot(turns, tangential, label=f"pin {planet}", linewidth=0.9)
        sharing.plot(turns, columns[f"share_{planet}"], label=f"planet {planet}", linewidth=0.9)
    factor = columns["load_sharing_factor"].max()
    for name in _BEARINGS:
        radial = np.hypot(columns[f"{name}_y"], columns[f"{name}_z"]) / 1e3
        bearings.plot(turns, radial, label=name.replace("_", " "), linewidth=0.9)
    for name in _SHAFTS:
        speed = columns[f"{name}_speed"]
        ripple = (speed / speed.mean() - 1.0) * 100.0
        label = f"{name}, {abs(speed.mean()) * 30.0 / np.pi:.4g} rpm"
        speeds.plot(turns, ripple, label=label, linewidth=0.9)
    for name in _ENERGIES:
        energies.plot(turns, columns[f"energy_{name}"] / 1e3, label=name, linewidth=0.9)
    imbalance = np.abs(columns["energy_imbalance"]).max()
    torque = columns["generator_torque"].mean()
    meshes.set(title="forces along the tooth normals", ylabel="kN")
    pins.set(title="tangential pin forces, against the rotation", ylabel="kN")
    sharing.set(title=f"load shares; sharing factor at most {factor:.4f}", ylabel="1")
    bearings.set(title="radial bearing loads", ylabel="kN")
    speeds.set(title=f"speeds less their means; generator torque {torque:.5g} N m", ylabel="%")
    energies.set(title=f"energies since the start; {imbalance:.1e} J left over", ylabel="kJ")
    for panel in (meshes, pins, sharing, bearings, speeds, energies):
        panel.title.set_fontsize("medium")
        panel.margins(y=0.25)
        panel.legend(fontsize="x-small", ncols=2)
        panel.grid(alpha=0.3)
    for panel in (bearings, speeds, energies):
        panel.set_xlabel("revolutions")
    figure.suptitle(run)
    return figure
