"""Measured against simulated, before and after, over one turn or a stretch of time."""

from typing import TYPE_CHECKING

import numpy as np

from carrierflex.diagnosis.comparison.overlay import Overlay
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.report.svg import BLACK, BLUE, GREY, ORANGE, WIDTH, scaled_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Samples of a stretch of time at most, and mean crossings of the signal in it at least.
_MOST_SAMPLES, _CROSSINGS = 400, 12
#: Letters of a channel's name beside its axis.
_MOST_LETTERS = 10


def signal_figure(before: Overlay, after: Overlay | None, unit: str) -> "Figure":
    """Signals above, what is left of the gap below.

    Parameters
    ----------
    before, after : Overlay
        One channel in one run with the baseline, and with the effects.
    unit : str
        Unit of the channel.

    Returns
    -------
    matplotlib.figure.Figure
        Two panels over one axis.
    """
    from matplotlib.figure import Figure

    part = _stretch(before)
    x = before.x[part]
    measured = before.measured[part]
    factor, shown = scaled_unit(float(np.nanmax(np.abs(measured))), unit)
    gap = before.measured[part] - before.simulated[part]
    gap_factor, gap_unit = scaled_unit(float(np.nanmax(np.abs(gap))), unit)
    figure = Figure(figsize=(WIDTH, 2.55), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    upper.plot(x, factor * measured, color=BLACK, linewidth=2.6, alpha=0.35, label="measured")
    lower.axhline(0.0, color=GREY, linewidth=0.6)
    for overlay, name, colour, dashes in (
        (before, "simulated, before", ORANGE, "--"),
        (after, "simulated, after", BLUE, "-"),
    ):
        if overlay is None:
            continue
        simulated = overlay.simulated[part]
        upper.plot(x, factor * simulated, dashes, color=colour, linewidth=1.3, label=name)
        rest = gap_factor * (overlay.measured[part] - simulated)
        lower.plot(x, rest, dashes, color=colour, linewidth=1.1)
    upper.set_ylabel(f"{_short(before.channel)} [{shown}]")
    lower.set_ylabel(f"gap [{gap_unit}]")
    lower.set_xlabel(f"{before.x_name} [{before.x_unit}]")
    if before.x_unit == "deg":
        lower.set_xticks(range(0, 361, 60))
        lower.set_xlim(0.0, 360.0)
    for panel in (upper, lower):
        panel.grid(alpha=0.25)
        panel.margins(x=0.0)
    figure.align_ylabels()
    figure.legend(loc="outside upper center", ncols=3, fontsize=8, frameon=False, handlelength=1.6)
    return figure


def _short(name: str) -> str:
    """Name that the axis has room for; the words below the figure have the whole."""
    return name if len(name) <= _MOST_LETTERS else f"{name[: _MOST_LETTERS - 1]}…"


def _stretch(overlay: Overlay) -> slice:
    """The whole turn, or a stretch of time about the largest gap."""
    if overlay.x_unit == "deg":
        return slice(None)
    n = overlay.x.size
    length = min(_MOST_SAMPLES, n)
    level = np.nan_to_num(overlay.measured - np.nanmean(overlay.measured))
    crossings = np.count_nonzero(np.diff(np.signbit(level)))
    if crossings > _CROSSINGS:
        length = int(np.clip(n * _CROSSINGS / crossings, 60, n))
    length = min(length, n)
    energy = _windowed(np.nan_to_num(overlay.measured - overlay.simulated) ** 2, length)
    first = int(np.argmax(energy))
    return slice(first, first + length)


def _windowed(values: FloatArray, length: int) -> FloatArray:
    """Sums over all windows of a length."""
    total = np.concatenate([[0.0], np.cumsum(values)])
    return total[length:] - total[:-length]
