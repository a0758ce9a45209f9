"""Signals as the report draws them: measured over simulated, and loops or polar plots."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from carrierflex.diagnosis.comparison.problem import FloatArray


@dataclass(frozen=True, eq=False)
class Overlay:
    """One channel in one run as measured and as a model has it."""

    #: run, channel: where it was measured
    run: str
    channel: str
    x: FloatArray  # Time [s], or angle of the carrier [deg] over one turn, shape (n,)
    #: x_name, x_unit: of `x`
    x_name: str
    x_unit: str
    #: measured, simulated: signals, in the problem's unit; NaN where nothing was measured, shape
    #: (n,)
    measured: FloatArray
    simulated: FloatArray

    @property
    def rms(self) -> float:
        """RMS of the difference."""
        return float(np.sqrt(np.nanmean(np.square(self.measured - self.simulated))))


def signal_overlay(
    run: str, channel: str, step: float, measured: FloatArray, residual: FloatArray
) -> Overlay:
    """Overlay of an evenly sampled signal and its residual, shape (n,) each."""
    time = step * np.arange(measured.size, dtype=np.float64)
    return Overlay(run, channel, time, "time", "s", measured, measured - residual)


@dataclass(frozen=True, eq=False)
class SignalComparison:
    """Signals of all channels before and after the effects were added."""

    before: tuple[Overlay, ...]  # With the baseline
    #: With the best supported effects, in the same order; empty where none is
    after: tuple[Overlay, ...]

    @property
    def largest(self) -> int:
        """Number of the overlay with the largest gap before."""
        return int(np.argmax([overlay.rms for overlay in self.before]))

    def by_channel(self) -> dict[str, tuple[float, float]]:
        """RMS of the gap before and after over all runs, by channel; NaN after where none is."""
        squares: dict[str, tuple[list[float], list[float]]] = {}
        for k, overlays in enumerate((self.before, self.after)):
            for one in overlays:
                squares.setdefault(one.channel, ([], []))[k].append(one.rms**2)
        return {
            name: (float(np.sqrt(np.mean(before))), float(np.sqrt(np.mean(after or [np.nan]))))
            for name, (before, after) in squares.items()
        }


#: Roles of a curve: what the baseline leaves, what the fitted effects say, what they leave.
GAP = "gap"
LAW = "law"
REMAINDER = "left"
#: Neighbours along x of a law that is a function of it differ by less than this share of its
#: standard deviation on average; those of a loop change branch half of the time. The limit leaves
#: room for the end of the trusted band.
_NEIGHBOURS = 0.3
#: Points of a cloud, enough for its shape and few enough for the file, and at each end of the
#: range, which an even choice would miss although they tell most about a law.
_MOST_POINTS, _END_POINTS = 2000, 150


@dataclass(frozen=True, eq=False)
class Trace:
    """One curve or cloud of points."""

    role: str  # GAP, LAW or REMAINDER; sets colour and stroke
    #: x, y: points, in the units of the picture; angles [rad] along x of a polar picture, shape
    #: (n,)
    x: FloatArray
    y: FloatArray
    shade: FloatArray | None = None  # A third quantity that colours the points, shape (n,)


@dataclass(frozen=True, eq=False)
class Panel:
    """Traces that share one pair of axes, with a title."""

    title: str  # What it shows
    traces: tuple[Trace, ...]  # Curves
    #: Places along x with a short text each; angles [rad] of a polar picture
    marks: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Picture:
    """A group of panels with the same axes."""

    #: title, caption: what is shown, and how to read it
    title: str
    caption: str
    #: x_name, x_unit, y_name, y_unit: quantity and unit of both axes
    x_name: str
    x_unit: str
    y_name: str
    y_unit: str
    panels: tuple[Panel, ...]  # At least one
    #: Whether x is an angle around a circle and y is drawn outwards from a zero circle
    is_polar: bool = False
    #: shade_name, shade_unit: quantity and unit of the shade; empty where no trace has one
    shade_name: str = ""
    shade_unit: str = ""


def is_function(x: FloatArray, y: FloatArray) -> bool:
    """Whether y follows x along one line: neighbours along x have nearly the same y.

    Without its straight part: a loop around a spring is a loop, however steep the spring.
    """
    bent = y - np.polyval(np.polyfit(x, y, 1), x)
    # A bend below that is rounding, and the blur of a filter.
    if bent.std() <= 0.01 * y.std():
        return True
    sorted_y = bent[np.argsort(x, kind="stable")]
    return bool(np.abs(np.diff(sorted_y)).mean() <= _NEIGHBOURS * bent.std())


def strip_means(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Means of x and y over strips along x that hold points: a law's line without its scatter."""
    n_strips = 36
    strip = np.minimum((n_strips * (x - x.min()) / np.ptp(x)).astype(int), n_strips - 1)
    counts = np.bincount(strip, minlength=n_strips)
    x_sum, y_sum = (np.bincount(strip, values, minlength=n_strips) for values in (x, y))
    used = counts > 0
    return x_sum[used] / counts[used], y_sum[used] / counts[used]


def drawn_runs(sizes: Sequence[float], conditions: Sequence[str]) -> list[int]:
    """Numbers of up to three runs, the largest of each condition, largest first."""
    largest: dict[str, int] = {}
    for number in sorted(range(len(sizes)), key=lambda k: -sizes[k]):
        largest.setdefault(conditions[number], number)
    return list(largest.values())[:3]


def loop_panel(
    run: str, motion: FloatArray, gap: FloatArray, shade: FloatArray, *, law: FloatArray | None
) -> Panel:
    """Gap of a run along a motion as a cloud, and a law.

    The cloud holds every n-th sample and those at both ends. The law is a line over all samples
    where it is a function of the motion, a cloud elsewhere.
    """
    every, by_size = np.arange(0, motion.size, -(-motion.size // _MOST_POINTS)), np.argsort(motion)
    drawn = np.unique(np.concatenate([every, by_size[:_END_POINTS], by_size[-_END_POINTS:]]))
    traces = [Trace(GAP, motion[drawn], gap[drawn], shade[drawn])]
    if law is not None:
        is_line = is_function(motion, law)
        line = strip_means(motion, law) if is_line else (motion[drawn], law[drawn])
        traces.append(Trace(LAW, *line))
    return Panel(f"run {run}", tuple(traces))
