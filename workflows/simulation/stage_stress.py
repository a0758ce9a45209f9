"""Stress of the carrier in a stage's runs: peaks and cycles by surface, and a picture."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray
from pyyeti import cyclecount

from carrierflex.reduction.shapes.body_shapes import UNNAMED
from carrierflex.reduction.shapes.body_stresses import BodyStresses
from carrierflex.reduction.shapes.stress_measures import critical_plane
from carrierflex.reduction.view import surface_picture
from carrierflex.simulation.stage.response import StageDivergedError
from carrierflex.simulation.stage.stage_run import StageResponse
from carrierflex.simulation.stage.stress import PeakStress, StressReader, no_stress_yet
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
class Hotspot:
    """Node of largest equivalent stress on one surface, and its history."""

    surface: Annotated[str, "Name of the surface"]
    node: Annotated[int, "Number of the node"]
    peak: Annotated[float, "Largest von Mises stress [Pa]"]
    time: Annotated[float, "When it acts [s]"]
    normal: Annotated[NDArray[np.float64], "Normal of its critical plane, shape (3,)"]
    stress: Annotated[NDArray[np.float64], "Normal stress on that plane over the run [Pa]"]


@dataclass
class _Coordinates:
    """Peaks so far, and the coordinates that the hotspots' histories are made of."""

    reader: StressReader
    peaks: PeakStress
    time: list[NDArray[np.float64]] = field(default_factory=list)
    c: list[NDArray[np.float64]] = field(default_factory=list)

    def append(self, piece: StageResponse) -> None:
        """Take the next piece."""
        record = piece.record
        self.peaks = self.peaks.or_later(self.reader, record.time, record.c)
        self.time.append(record.time)
        self.c.append(record.c)


def with_stress(
    pieces: Iterable[StageResponse],
    folder: Path,
    run: str,
    reader: StressReader,
    stresses: BodyStresses,
) -> Iterator[StageResponse]:
    """Pieces of a run; what their stress comes to is written at its end.

    ``<run>_stress.csv`` has the hotspot of every surface, ``<run>_cycles.csv`` its cycles by range,
    ``<run>_stress.png`` the surface in colours of its largest von Mises stress and the hotspots
    over time. A run that diverges or is interrupted leaves those until then.

    Parameters
    ----------
    pieces : iterable of StageResponse
        The run.
    folder : Path
        Folder that exists.
    run : str
        Name of the run.
    reader : StressReader
        Stress from the stage's coordinates.
    stresses : BodyStresses
        Nodes and surfaces of its rows.
    """
    grown = _Coordinates(reader, no_stress_yet(reader))
    stopped: BaseException | None = None
    try:
        for piece in pieces:
            grown.append(piece)
            yield piece
    except (StageDivergedError, KeyboardInterrupt) as error:
        stopped = error
    if grown.c:
        time, c = np.concatenate(grown.time), np.concatenate(grown.c)
        hotspots = hotspots_of(grown.peaks, reader, stresses, c)
        save_table(folder / f"{run}_stress.csv", _PEAKS, _peak_rows(hotspots, stresses))
        save_table(folder / f"{run}_cycles.csv", _CYCLES, cycle_rows(hotspots))
        figure = stress_figure(run, grown.peaks, stresses, time, hotspots)
        save_figure(folder / f"{run}_stress.png", figure)
    if stopped is not None:
        raise stopped


def hotspots_of(
    peaks: PeakStress, reader: StressReader, stresses: BodyStresses, c: NDArray[np.float64]
) -> list[Hotspot]:
    """Hotspot of every surface, the largest first; nodes at re-entrant edges are left out."""
    surfaces = dict(enumerate(stresses.surface_names)) | {UNNAMED: "without a name"}
    hotspots = []
    for number, name in surfaces.items():
        nodes = np.flatnonzero((stresses.surface_of == number) & ~stresses.singular)
        if len(nodes):
            node = int(nodes[peaks.von_mises[nodes].argmax()])
            peak, time = float(peaks.von_mises[node]), float(peaks.time[node])
            plane = critical_plane(reader.stress(np.array([node]), c)[0])
            hotspots.append(Hotspot(name, node, peak, time, *plane))
    return sorted(hotspots, key=lambda hotspot: -hotspot.peak)


def cycle_rows(hotspots: Iterable[Hotspot]) -> list[list[str | float]]:
    """Rainflow cycles of each hotspot by range: surface, range from, to, mean, number.

    References
    ----------
    ASTM E1049-85 (2017), section 5.4.4.
    """
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


def _peak_rows(hotspots: Iterable[Hotspot], stresses: BodyStresses) -> list[list[str | float]]:
    return [
        [
            hotspot.surface,
            *(float(x) for x in stresses.points[hotspot.node]),
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
    figure.suptitle(f"{run}: stress of the carrier")
    return figure
