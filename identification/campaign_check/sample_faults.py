"""Samples that no sensor gives: clipped, stuck, repeated, zeroed, far outside, on a coarse grid.

And signals without their sign, which meet zero with a bend, or of too few bits, which begin anew
at the other end of their range.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.quantities import sized
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning, sample_of
from carrierflex.identification.campaign_check.sample_statistics import (
    STUCK,
    expected_equal,
    expected_zeros,
    moving,
    neighbour_noise,
    quantisation_step,
    repeats,
    stretches,
)

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

#: Equal neighbours in a row that make a plateau at an extreme, and samples in such plateaus.
_PLATEAU, _CLIPPED = 3, 5
#: Distance of an outlier from what its neighbours say, over the median distance.
_FAR = 15.0
#: Quantisation step over the noise: its error has 0.29 of the step, from here on half a floor.
_COARSE = 1.5
#: A distance below this share of the signal's range is no outlier; of an element driven by its
#: displacement the second one counts.
_OF_RANGE, _OF_RANGE_DRIVEN = 0.03, 0.5
#: Value over the RMS of a signal, and of its steps, below which it is near zero, how often it must
#: come there, the share of these times at which it must bend, and how near it comes at a quarter of
#: them, over the RMS of its steps.
_NEAR_ZERO, _OF_STEP, _FEWEST_MEETINGS, _LEAST_BENDS, _NEAREST = 0.1, 0.7, 8, 0.5, 0.25
#: Phase [rad] of a signal's mean frequency over which a parabola follows it, and the most that it
#: leaves of a signal with its sign over what it leaves of one without.
_PHASE, _FAR_LESS = 0.5, 0.5
#: Times that a reading begins anew at least. Once it goes on beyond its range: the new range over
#: the old one, at least, and what is left of the square of its second differences, at most. Of a
#: square wave beside a slower motion, as of dry friction, as little is left over 0.48 of the range.
_FEWEST_WRAPS, _LEAST_RANGE, _SMOOTHER = 2, 0.5, 0.1


@dataclass(frozen=True, eq=False)
class _Signal:
    """A channel in one run."""

    run: Run
    channel: Channel
    values: FloatArray
    moves: BoolArray  # False where no input changes
    #: Samples at which a driven motion turns round: friction jumps there and back within one sample
    turns: BoolArray

    def warning(
        self, check: str, sample: int, figure: float, text: str, remedy: str
    ) -> CampaignWarning:
        about = self.channel.name
        line = sample_of(self.run.file, sample)
        return CampaignWarning(check, about, f"run {self.run.name}: {text}", remedy, figure, line)


def sample_faults(campaign: Campaign) -> Iterator[CampaignWarning]:
    """Findings about single samples of every channel and run.

    Parameters
    ----------
    campaign : Campaign
        Records.

    Yields
    ------
    CampaignWarning
        Checks ``clipping``, ``stuck``, ``repeated``, ``zeros``, ``outliers``, ``quantised``,
        ``rectified``, ``wrapped``.
    """
    checks: tuple[Callable[[_Signal], Iterator[CampaignWarning]], ...] = (
        _clipping,
        _stuck,
        _zeros,
        _outliers,
        _quantised,
        _rectified,
        _wrapped,
    )
    for run in campaign.runs:
        moves, turns = moving(run), _turns(run)
        for channel in campaign.channels:
            signal = _Signal(run, channel, run.signals[channel.name], moves, turns)
            if np.count_nonzero(np.isfinite(signal.values)) > 2 * STUCK:
                for check in checks:
                    yield from check(signal)


def _turns(run: Run) -> BoolArray:
    """Samples within four of a turn of a driven motion, shape (n,)."""
    turns = np.zeros(run.time.size, dtype=bool)
    drive = run.inputs.get("displacement")
    if drive is not None:
        step = np.diff(drive)
        turns[1:-1] = step[1:] * step[:-1] <= 0.0
        turns = np.convolve(turns, np.ones(9), mode="same") > 0.5
    return turns


def _clipping(signal: _Signal) -> Iterator[CampaignWarning]:
    """Plateaus at the largest or smallest value."""
    for name, extreme in (("largest", np.nanmax), ("smallest", np.nanmin)):
        value = float(extreme(signal.values))
        at = (signal.values == value) & signal.moves
        plateaus = [(a, b) for a, b in stretches(at) if b - a >= _PLATEAU]
        clipped = sum(b - a for a, b in plateaus)
        distance = np.abs(signal.values - value)
        # A coarse signal also has equal neighbours elsewhere.
        next_level = float(distance[distance > 0.0].min()) if (distance > 0.0).any() else 0.0
        n_next = int((distance <= 1.5 * next_level).sum()) - int((distance == 0.0).sum())
        if clipped >= _CLIPPED and int(at.sum()) > 3 * n_next and len(plateaus) > 1:
            yield signal.warning(
                "clipping",
                plateaus[0][0],
                float(at.sum()),
                f"{int(at.sum())} samples are at the {name} value {value:.4g} "
                f"{signal.channel.unit}, {clipped} of them in plateaus",
                "the range of sensor or amplifier ends there: record it again with a wider range, "
                "or leave the channel out",
            )


def _stuck(signal: _Signal) -> Iterator[CampaignWarning]:
    """Long stretches of one value, and samples that repeat the one before."""
    values = signal.values
    all_stretches, length = repeats(values, signal.moves)
    long = [(a, b) for a, b in all_stretches if b - a >= length]
    if long:
        a, b = max(long, key=lambda stretch: stretch[1] - stretch[0])
        share = (b - a) / values.size
        yield signal.warning(
            "stuck",
            a,
            float(b - a),
            f"{b - a + 1} samples in a row ({share:.1%} of the record) hold {values[a]:.4g} "
            f"{signal.channel.unit} while the inputs change",
            "the sensor or the logger stood still: leave the stretch empty (missing samples)",
        )
    short = [(a, b) for a, b in all_stretches if b - a < length]
    count = sum(b - a for a, b in short)
    if count > 2.0 + 4.0 * expected_equal(values):
        yield signal.warning(
            "repeated",
            short[0][0],
            float(count),
            f"{count} samples repeat the one before to the last digit",
            "dropouts filled with the last value: leave the cells empty instead",
        )


def _zeros(signal: _Signal) -> Iterator[CampaignWarning]:
    """Exact zeros in a signal that does not stand still."""
    values = signal.values
    zero = (values == 0.0) & signal.moves
    count = int(zero.sum())
    if count >= 2 and count > 1.0 + 4.0 * expected_zeros(values):
        yield signal.warning(
            "zeros",
            int(np.argmax(zero)),
            float(count),
            f"{count} samples are exactly zero",
            "dropouts written as zeros: leave the cells empty instead",
        )


def _outliers(signal: _Signal) -> Iterator[CampaignWarning]:
    """Single samples far from what both neighbours on either side say."""
    values = signal.values
    before = 2.0 * values[1:-3] - values[:-4]
    after = 2.0 * values[3:-1] - values[4:]
    middle = values[2:-2]
    between = (4.0 * (values[1:-3] + values[3:-1]) - values[:-4] - values[4:]) / 6.0
    distance = np.min(np.abs([middle - before, middle - after, middle - between]), axis=0)
    known = np.isfinite(distance) & ~signal.turns[2:-2]
    if not known.any():
        return
    scale = np.maximum(
        float(np.median(distance[known])), _local_median(np.where(known, distance, 0.0))
    )
    # Friction jumps by a part of what a driven element answers, a spike by more.
    of_range = _OF_RANGE_DRIVEN if signal.turns.any() else _OF_RANGE
    least = max(
        of_range * float(np.ptp(np.quantile(values[np.isfinite(values)], (0.01, 0.99)))),
        4.0 * (signal.channel.noise_std or 0.0),
        3.0 * quantisation_step(values),
    )
    far = known & (distance > _FAR * scale) & (distance > least)
    if far.any():
        worst = int(np.argmax(np.where(far, distance, 0.0)))
        yield signal.warning(
            "outliers",
            worst + 2,
            float(distance[worst]),
            f"{int(far.sum())} samples are isolated, the worst "
            f"{sized(float(distance[worst]), signal.channel.unit)} from its neighbours",
            "spikes of the measuring chain: leave these cells empty, or identify with --loss "
            "huber; keep them if the machine strikes there, in several channels at once",
        )


def _local_median(values: FloatArray) -> FloatArray:
    """Median over 65 samples around each, from medians of a coarser grid."""
    width = 65
    if values.size <= width:
        return np.full(values.size, float(np.median(values)))
    centres = np.arange(0, values.size, width // 4)
    first = centres - width // 2
    inside = (first >= 0) & (first + width <= values.size)
    medians = np.empty(centres.size)
    windows = np.lib.stride_tricks.sliding_window_view(values, width)
    medians[inside] = np.median(windows[first[inside]], axis=1)
    # Shorter ones at both ends.
    for k in np.flatnonzero(~inside).tolist():
        medians[k] = np.median(values[max(first[k], 0) : first[k] + width])
    return np.interp(np.arange(values.size), centres, medians)


def _quantised(signal: _Signal) -> Iterator[CampaignWarning]:
    """A quantisation step beside which the noise floor is small."""
    step = quantisation_step(signal.values)
    floor = signal.channel.noise_std or neighbour_noise(signal.values)
    if step > 0.0 and floor > 0.0 and step > _COARSE * floor:
        yield signal.warning(
            "quantised",
            0,
            step / floor,
            f"values lie on a grid of {sized(step, signal.channel.unit)}, {step / floor:.1f} "
            "times the noise floor",
            "take the amplifier's finer range, or declare a noise_std of at least 0.3 of the step",
        )


def _rectified(signal: _Signal) -> Iterator[CampaignWarning]:
    """A signal of one sign that meets zero again and again with a bend, not with a turn."""
    size = np.abs(signal.values[np.isfinite(signal.values)])
    if not (np.nanmin(signal.values) >= 0.0 or np.nanmax(signal.values) <= 0.0):
        return
    rms = float(np.sqrt(np.mean(size**2)))
    step = float(np.sqrt(np.mean(np.diff(size) ** 2)))
    near = size < max(_NEAR_ZERO * rms, _OF_STEP * step)
    inner = [(a, b) for a, b in stretches(near) if a > 0 and b < size.size]
    half = max(2, round(_PHASE * rms / max(step, np.finfo(float).tiny)))
    zeros = [a + int(np.argmin(size[a:b])) for a, b in inner]
    bends = sum(_is_bent(size, zero, half) for zero in zeros)
    if len(inner) < _FEWEST_MEETINGS:
        return
    # Samples lie anywhere about a change of sign: of four one is near it.
    comes_to_zero = np.quantile(size[zeros], 0.25) < _NEAREST * step
    if comes_to_zero and bends > _LEAST_BENDS * len(inner):
        yield signal.warning(
            "rectified",
            0,
            float(len(inner)),
            f"{signal.channel.name} keeps one sign and comes to zero {len(inner)} times as a "
            "signal does that changes its sign there",
            "record it with its sign: an amplitude or absolute value does not tell the motion",
        )


def _is_bent(size: FloatArray, zero: int, half: int) -> bool:
    """Whether a parabola fits a signal far better that changes its sign at a sample near zero."""
    window = np.arange(max(zero - half, 0), min(zero + half + 1, size.size))
    parabola = np.vander((window - zero) / half, 3)
    turning = size[window]
    crossing = np.where(window < zero, -turning, turning)
    remaining = [
        target - parabola @ np.linalg.lstsq(parabola, target, rcond=None)[0]
        for target in (crossing, turning)
    ]
    return bool(np.sum(remaining[0] ** 2) < _FAR_LESS * np.sum(remaining[1] ** 2))


def _wrapped(signal: _Signal) -> Iterator[CampaignWarning]:
    """A reading that begins anew at the other end of its range, as a counter of too few bits."""
    values = signal.values[np.isfinite(signal.values)]
    size = float(np.ptp(values))
    steps = np.diff(values)
    over = np.where(np.abs(steps) > 0.5 * size, size * np.sign(steps), 0.0)
    jumps = np.flatnonzero(over)
    new_range = float(np.ptp(values[1:] - np.cumsum(over))) if jumps.size else 0.0
    rough, smooth = (float(np.sum(np.diff(one) ** 2)) for one in (steps, steps - over))
    is_smoother = new_range >= _LEAST_RANGE * size and smooth <= _SMOOTHER * rough
    if jumps.size >= _FEWEST_WRAPS and is_smoother:
        yield signal.warning(
            "wrapped",
            int(jumps[0]) + 1,
            float(jumps.size),
            f"{jumps.size} times the reading goes on at the other end of its range of "
            f"{sized(size, signal.channel.unit)}, as a counter of too few bits does",
            "read the channel with more bits, or add the range to the samples beyond these jumps",
        )
