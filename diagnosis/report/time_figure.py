"""Figure of the report: the gap over time, run by run. Matplotlib late."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from carrierflex.diagnosis.gap.findings import GapMoment
from carrierflex.diagnosis.report.svg import BLACK, BLUE, GREEN, GREY, ORANGE, WIDTH, scaled_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Strokes of the runs; colours and dashes change together, so that neither is needed alone.
_STROKES = (
    (BLUE, "-"),
    (ORANGE, "--"),
    (GREEN, "-."),
    (BLACK, ":"),
    (GREY, "-"),
    ("#cc79a7", "--"),
)
#: Runs drawn at most: those with the largest gap.
MOST_RUNS = len(_STROKES)


def gap_in_time_figure(moments: Sequence[GapMoment], unit: str) -> "Figure":
    """RMS of the gap in windows over time.

    Parameters
    ----------
    moments : sequence of GapMoment
        Windows of every run.
    unit : str
        Unit of the channels.

    Returns
    -------
    matplotlib.figure.Figure
        One line a run, those with the largest gap.
    """
    from matplotlib.figure import Figure

    by_run: dict[str, list[GapMoment]] = {}
    for moment in moments:
        by_run.setdefault(moment.run, []).append(moment)
    sizes = {run: max(own.rms for own in windows) for run, windows in by_run.items()}
    drawn = sorted(sizes, key=lambda run: -sizes[run])[:MOST_RUNS]
    factor, shown_unit = scaled_unit(max(sizes.values()), unit)
    figure = Figure(figsize=(WIDTH, 2.9), layout="constrained")
    panel = figure.subplots()
    for run, (colour, dashes) in zip(sorted(drawn), _STROKES, strict=False):
        time, rms = np.array([(own.time, factor * own.rms) for own in by_run[run]]).T
        mark = "." if time.size < 30 else ""
        panel.plot(
            time,
            rms,
            color=colour,
            linestyle=dashes,
            marker=mark,
            linewidth=1.3,
            markersize=4,
            label=run,
        )
    panel.set_ylim(0.0, 1.1 * factor * max(sizes.values()))
    panel.set_xlabel("time [s]")
    panel.set_ylabel(f"RMS of the gap [{shown_unit}]")
    panel.grid(alpha=0.25)
    figure.legend(loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    return figure
