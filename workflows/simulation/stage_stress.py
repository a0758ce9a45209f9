"""Stress of carrier and pins in a stage's runs: peaks and cycles by surface, and a picture.

Pins of a body file with stress rows, and pins bonded into the carrier, have the stress of their
finite elements; the default's pins that of simply supported beams under the planets' loads.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.pyyeti_modules import cyclecount
from carrierflex.geometry.parameters import PinParameters
from carrierflex.geometry.pins import pin_angles
from carrierflex.reduction.shapes.body_shapes import UNNAMED
from carrierflex.reduction.shapes.body_stresses import BodyStresses
from carrierflex.reduction.shapes.stress_measures import critical_plane
from carrierflex.reduction.view import surface_picture
from carrierflex.simulation.stage.part_loads import PartLoads
from carrierflex.simulation.stage.pin_bending import PinBeam, pin_beam
from carrierflex.simulation.stage.response import StageDivergedError
from carrierflex.simulation.stage.stage_model import StageModel
from carrierflex.simulation.stage.stage_run import StageResponse
from carrierflex.simulation.stage.stress import (
    PeakStress,
    StressReader,
    no_stress_yet,
    stress_reader,
    surface_with_pins,
)
from carrierflex.workflows.outputs import save_figure, save_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Ranges into which cycles are counted.
_BINS = 20
_PEAKS = ["surface", "x [m]", "y [m]", "z [m]", "largest von Mises stress [Pa]", "at time [s]",
          "normal x", "normal y", "normal z", "least normal stress [Pa]",
          "largest normal stress [Pa]", "mean normal stress [Pa]", "range [Pa]"]  # fmt: skip
_CYCLES = ["surface", "range from [Pa]", "range to [Pa]", "mean [Pa]", "cycles"]


@dataclass(frozen=True, eq=False)
class StageStresses:
    """Stress rows of a case's body files."""

    carrier: Annotated[BodyStresses, "Of the carrier"]
    pin: Annotated[BodyStresses | None, "Of pin 1; None where no file has it"] = None

    def surface(self, n_planets: int) -> BodyStresses:
        """Surface of all of them, in the order of the stage's rows."""
        if self.pin is None:
            return self.carrier
        return surface_with_pins(self.carrier, self.pin, n_planets)


@dataclass(frozen=True, eq=False)
class Hotspot:
    """Point of largest equivalent stress on one surface, and its history."""

    surface: Annotated[str, "Name of the surface"]
    point: Annotated[NDArray[np.float64], "Where it is [m], shape (3,)"]
    peak: Annotated[float, "Largest von Mises stress [Pa]"]
    time: Annotated[float, "When it acts [s]"]
    normal: Annotated[NDArray[np.float64], "Normal of its critical plane, shape (3,)"]
    stress: Annotated[NDArray[np.float64], "Normal stress on that plane over the run [Pa]"]


@dataclass
class _Grown:
    """Peaks so far, and what the hotspots' histories are made of."""

    reader: StressReader
    peaks: PeakStress
    beam: PinBeam | None
    time: list[NDArray[np.float64]] = field(default_factory=list)
    c: list[NDArray[np.float64]] = field(default_factory=list)
    loads: list[PartLoads] = field(default_factory=list)

    def append(self, piece: StageResponse) -> None:
        """Take the next piece."""
        record = piece.record
        self.peaks = self.peaks.or_later(self.reader, record.time, record.c)
        self.time.append(record.time)
        self.c.append(record.c)
        if self.beam is not None:
            self.loads.append(piece.loads)

    def hotspots(self, stresses: BodyStresses) -> list[Hotspot]:
        """Hotspots of surfaces and beams, the largest first."""
        hotspots = hotspots_of(self.peaks, self.reader, stresses, np.concatenate(self.c))
        if self.beam is not None:
            hotspots += _beam_hotspots(self.beam, self.loads, np.concatenate(self.time))
        return sorted(hotspots, key=lambda hotspot: -hotspot.peak)


def with_stress(
    pieces: Iterable[StageResponse],
    folder: Path,
    run: str,
    model: StageModel,
    stresses: StageStresses,
) -> Iterator[StageResponse]:
    """Pieces of a run; what their stress comes to is written at its end.

    ``<run>_stress.csv`` has the hotspot of every surface and pin, ``<run>_cycles.csv`` its cycles
    by range, ``<run>_stress.png`` the surface in colours of its largest von Mises stress and the
    hotspots over time. A run that diverges or is interrupted leaves those until then.

    Parameters
    ----------
    pieces : iterable of StageResponse
        The run.
    folder : Path
        Folder that exists.
    run : str
        Name of the run.
    model : StageModel
        The stage, whose bodies have the rows.
    stresses : StageStresses
        Nodes and surfaces of its rows.
    """
    reader, surface = stress_reader(model), stresses.surface(model.layout.n_planets)
    beam = None
    if stresses.pin is None and "pin_1_midspan" not in surface.surface_names:
        beam = pin_beam(model, PinParameters())
    grown = _Grown(reader, no_stress_yet(reader), beam)
    stopped: BaseException | None = None
    try:
        for piece in pieces:
            grown.append(piece)
            yield piece
    except (StageDivergedError, KeyboardInterrupt) as error:
        stopped = error
    if grown.c:
        hotspots = grown.hotspots(surface)
        save_table(folder / f"{run}_stress.csv", _PEAKS, _peak_rows(hotspots))
        save_table(folder / f"{run}_cycles.csv", _CYCLES, _cycle_rows(hotspots))
        time = np.concatenate(grown.time)
        figure = stress_figure(run, grown.peaks, surface, time, hotspots)
        save_figure(folder / f"{run}_stress.png", figure)
    if stopped is not None:
        raise stopped


def hotspots_of(
    peaks: PeakStress, reader: StressReader, stresses: BodyStresses, c: NDArray[np.float64]
) -> list[Hotspot]:
    """Hotspot of every surface; nodes at re-entrant edges are left out."""
    surfaces = dict(enumerate(stresses.surface_names)) | {UNNAMED: "without a name"}
    hotspots = []
    for number, name in surfaces.items():
        nodes = np.flatnonzero((stresses.surface_of == number) & ~stresses.singular)
        if len(nodes):
            node = int(nodes[peaks.von_mises[nodes].argmax()])
            peak, time = float(peaks.von_mises[node]), float(peaks.time[node])
            plane = critical_plane(reader.stress(np.array([node]), c)[0])
            hotspots.append(Hotspot(name, stresses.points[node], peak, time, *plane))
    return hotspots


def _beam_hotspots(
    beam: PinBeam, pieces: Sequence[PartLoads], time: NDArray[np.float64]
) -> list[Hotspot]:
    """Fibre of largest tension of every pin; that of the other side is as large."""
    largest = np.max([beam.stress(loads).max(axis=0) for loads in pieces], axis=0)
    hotspots = []
    for i, (of_pin, angle) in enumerate(zip(largest, pin_angles(len(largest)), strict=True)):
        station, fibre = np.unravel_index(of_pin.argmax(), of_pin.shape)
        stress = np.concatenate([beam.stress(loads)[:, i, station, fibre] for loads in pieces])
        point = beam.point(int(station), int(fibre), float(angle))
        peak, when = float(stress.max()), float(time[stress.argmax()])
        along = np.array([1.0, 0.0, 0.0])
        hotspots.append(Hotspot(f"pin_{i + 1} as beam", point, peak, when, along, stress))
    return hotspots


def _cycle_rows(hotspots: Iterable[Hotspot]) -> list[list[str | float]]:
    """Rainflow cycles of each hotspot by range: surface, range from, to, mean, number."""
    rows: list[list[str | float]] = []
    for hotspot in hotspots:
        turns = hotspot.stress[cyclecount.findap(hotspot.stress)]
        if len(turns) < 2:
            continue
        amplitude, mean, count = cyclecount.rainflow(turns, use_pandas=False).T
        size = 2.0 * amplitude
        edges = np.linspace(0.0, float(size.max()), _BINS + 1)
        bin_of = np.clip(np.searchsorted(edges, size, side="left") - 1, 0, _BINS - 1)
        for i in range(_BINS - 1, -1, -1):
            inside = bin_of == i
            if inside.any():
                middle = float(np.average(mean[inside], weights=count[inside]))
                rows.append(
                    [hotspot.surface, edges[i], edges[i + 1], middle, float(count[inside].sum())]
                )
    return rows


def _peak_rows(hotspots: Iterable[Hotspot]) -> list[list[str | float]]:
    return [
        [
            hotspot.surface,
            *(float(x) for x in hotspot.point),
            hotspot.peak,
            hotspot.time,
            *(float(n) for n in hotspot.normal),
            float(hotspot.stress.min()),
            float(hotspot.stress.max()),
            float(hotspot.stress.mean()),
            float(np.ptp(hotspot.stress)),
        ]
        for hotspot in hotspots
    ]


def stress_figure(
    run: str,
    peaks: PeakStress,
    stresses: BodyStresses,
    time: NDArray[np.float64],
    hotspots: list[Hotspot],
) -> "Figure":
    """Largest von Mises stress of the surface from both ends, and the hotspots over time."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure

    figure = Figure(figsize=(15, 5), layout="constrained")
    upwind, downwind, history = figure.subplots(1, 3, width_ratios=(1, 1, 1.2))
    drawn = np.where(stresses.singular, np.nan, peaks.von_mises / 1e6)
    top = float(np.nanmax(drawn))
    for axes, side, title in ((upwind, -1.0, "from upwind"), (downwind, 1.0, "from downwind")):
        axes.imshow(surface_picture(stresses, drawn, top, (side, 0.5, 0.4)))
        axes.set_title(title)
        axes.set_axis_off()
    colours = ScalarMappable(Normalize(0.0, top), cmap="viridis")
    label = "largest von Mises stress [MPa]; grey: re-entrant edges"
    figure.colorbar(colours, ax=downwind, label=label)
    for hotspot in hotspots[:5]:
        label = f"{hotspot.surface}, {hotspot.peak / 1e6:.3g} MPa von Mises"
        history.plot(time, hotspot.stress / 1e6, label=label, linewidth=0.9)
    title = "normal stress on the critical planes"
    history.set(title=title, xlabel="time [s]", ylabel="stress [MPa]")
    history.margins(y=0.25)
    history.legend(fontsize="x-small")
    history.grid(alpha=0.3)
    figure.suptitle(f"{run}: stress of carrier and pins")
    return figure
