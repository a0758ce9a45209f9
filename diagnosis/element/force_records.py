"""What the classes see of a run: target force, motion, drive and blocks, whatever the drive was."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from carrierflex.diagnosis.classes.columns import time_splines
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.model import ElementModel
from carrierflex.diagnosis.element.motion import (
    nearest_motion,
    participation,
    speed_noise,
    with_harmonics,
)
from carrierflex.diagnosis.element.noise import NoiseWeight
from carrierflex.diagnosis.element.records import BLOCKS, ElementRecord, Motion
from carrierflex.diagnosis.element.signatures import base_columns, known_force
from carrierflex.identification.campaign.signals import band_limited
from carrierflex.identification.estimation.scaled_least_squares import design_solution

#: Periods of the band's end left out at each end of a record, where derivatives are guesses, and
#: the largest share of the record that they may take.
_EDGE_PERIODS, _LARGEST_EDGE = 15.0, 0.2
_RELEASED_PERIODS = 10.0
#: A decay counts until its speed last stands so many standard deviations above its noise: after
#: that all columns are noise, which a memory of many relaxation times fits best.
_CLEAR_SPEED = 10.0
#: A motion is narrow where its energy fills less than this share of its band; the information is
#: then in the harmonics of the force, and the force's band is not limited.
_NARROW = 0.15
_WIDEST = 0.95
#: Blocks of a sweep or decay for each of another run. A block that is held out must hold no
#: amplitude that the others do not: of 24 blocks of a sweep one holds the resonance, and its score
#: is that of an extrapolation. Elsewhere long blocks keep what is slow from being interpolated
#: between neighbours.
IN_TIME = 4
#: Times as long as the passage through rest at the RMS of the acceleration from which a mass stands
#: still rather than turns round, and samples at least.
_STANDS, _FEWEST_AT_REST = 3.0, 3
_FEWEST_IN_BLOCK = 16
#: Part of the deflection outside its band that may be left out: so many times the noise, or this
#: share of the local motion.
_ABOVE_NOISE, _OMITTED = 3.0, 0.1
#: Windows of a run over which its amplitude and frequency are followed.
_WINDOWS = 40
_FEWEST_IN_WINDOW = 4
#: Bins of a spectrum that one line takes at most, by participation, through the Hann window.
_LINE_BINS = 3.0
_SMALLEST = np.finfo(float).tiny


@dataclass(frozen=True, eq=False)
class ForceRecord:
    """One run in force space, before the common filter.

    A drive by a base or a free decay fits in: `target` is then the force that the motion needs,
    with the mass left out (a force for each unit of mass).
    """

    record: ElementRecord  # The run
    target: FloatArray  # Force to be explained, shape (n,)
    base: FloatArray  # Regressors of the baseline, shape (n_base, n)
    #: x, v, a: motion in its trusted band, shape (n,)
    x: FloatArray
    v: FloatArray
    a: FloatArray
    #: Signal of the drive side: the force applied, or that of the baseline, shape (n,)
    side: FloatArray
    #: Force as it was measured: applied, or that of a driven deflection in the band of the target,
    #: shape (n,)
    force: FloatArray
    #: Filter of all columns: the band in which forces are compared, then by the noise too
    weight: NoiseWeight
    block: np.ndarray  # Block of every sample; -1 where it does not count, shape (n,)
    #: Whether sliders and relaxing branches begin relaxed at the first sample; else where a motion
    #: like this one leaves them
    from_rest: bool = False
    speed_error: float = 0.0  # Standard deviation of the error of `v`
    #: Deflection, speed and acceleration of what was measured beside a motion that is known from
    #: its harmonics: `base` does not hold it
    noise_motion: Motion | None = None
    #: Lag over which the column of a delay takes the change of the force [s]; zero for its rate
    lag: float = 0.0

    def filtered(self, columns: FloatArray) -> FloatArray:
        """Columns through the filter, shape (n_columns, n), at the samples that count."""
        return self.weight.filtered(columns)[:, self.counts]

    @property
    def step(self) -> float:
        """Sampling interval [s]."""
        return self.record.step

    @property
    def drive(self) -> FloatArray:
        """Drive of the run."""
        return self.record.drive

    @property
    def counts(self) -> np.ndarray:
        """Samples that count."""
        return self.block >= 0


def force_records(
    model: ElementModel, records: Sequence[ElementRecord], *, finer: int = 1
) -> tuple[ForceRecord, ...]:
    """Runs in force space that hold enough samples; `finer` are the blocks for each usual one."""
    n_blocks = max(2, round(finer * BLOCKS / len(records)))
    runs = []
    for record in records:
        block = _blocks(record, n_blocks, _in_band(model, record))
        if block.max(initial=-1) >= 0:
            runs.append(_force_record(model, record, block))
    if model.by_force or not runs:
        return tuple(runs)
    # The drive side is the force that the baseline predicts for a driven deflection. At one
    # frequency mass and spring are one unknown: least squares over all runs.
    design = np.concatenate([run.base[:, run.counts] for run in runs], axis=1)
    c = design_solution(design.T, np.concatenate([run.target[run.counts] for run in runs]))
    mass = model.mass or 0.0
    return tuple(replace(run, side=mass * run.a + c @ run.base) for run in runs)


def _force_record(model: ElementModel, record: ElementRecord, block: np.ndarray) -> ForceRecord:
    """Run in force space with its blocks."""
    nearest, speed_error = nearest_motion(model, record)
    band = record.flat_hz
    if not (model.by_force or record.gap is not None):
        lines, resolution = participation(record)
        # Where the motion is narrow the force is compared in all of its band.
        if lines * resolution < _NARROW * band:
            band = _WIDEST * 0.5 / record.step
    run, nearest, noise_motion = with_harmonics(model, record, nearest)
    q, v, a = run.motion
    side = run.drive
    if not side.any():  # released: the restoring force, where nothing is applied
        side = model.scale.C1 * v + model.scale.K1 * q
    force = run.drive if model.by_force else run.response
    if band == run.flat_hz:  # in the band of the motion, as the regressors are
        force = band_limited(force, run.step, run.cutoff_hz)
    lacking = known_force(model, run) if run.gap is not None else force - (model.mass or 0.0) * a
    return ForceRecord(
        record=run,
        target=lacking,
        base=base_columns(model, run),
        x=nearest[0],
        v=nearest[1],
        a=nearest[2],
        side=side,
        force=side if model.by_force else force,
        weight=NoiseWeight(run.step, band),
        block=block,
        speed_error=speed_error,
        noise_motion=noise_motion,
    )


def with_noise_of_motion(run: ForceRecord) -> ForceRecord:
    """Run whose target holds the noise of a motion known from its harmonics as a force.

    What the classes leave is compared with the noise of the records, so that it must be in it; in
    the regressors it would make the mass too small.
    """
    if run.noise_motion is None or run.weight.element is None:
        return run
    m, C1, K1 = run.weight.element
    x, v, a = run.noise_motion
    return replace(run, target=run.target - (m * a + C1 * v + K1 * x))


def _in_band(model: ElementModel, record: ElementRecord) -> np.ndarray:
    """Samples at which the motion lies in its trusted band."""
    # Where a sweep passes the end of the band a force that is no straight line of the motion is not
    # known at all.
    window = max(int(np.ceil(1.0 / (record.flat_hz * record.step))), 3)

    def local(values: FloatArray) -> FloatArray:
        return uniform_filter1d(np.asarray(values**2), window, mode="nearest")

    q = record.motion[0]
    swing = local(q - q[record.counts].mean())
    if not model.by_force:
        outside = local(record.drive - q)
        return (outside <= 0.0) | (outside <= _OMITTED**2 * swing)
    # Under a force the motion is compared where the band is flat: a line beyond has no force.
    outside = local(record.response - record.where_flat(q))
    return (outside <= _ABOVE_NOISE * record.noise) | (outside <= _OMITTED**2 * swing)


def _blocks(record: ElementRecord, wanted: int, inside: np.ndarray) -> np.ndarray:
    """Blocks of like length of the samples that count, away from the ends."""
    n = record.counts.size
    # A decay is largest where it begins: fewer periods are given up there.
    periods = _RELEASED_PERIODS if record.is_released else _EDGE_PERIODS
    edge = min(int(np.ceil(periods / (record.flat_hz * record.step))), int(_LARGEST_EDGE * n))
    sample = np.arange(n)
    last = n - edge
    if record.is_released:
        last = min(last, _end_of_motion(record))
    counted = np.flatnonzero(record.counts & inside & (sample >= edge) & (sample < last))
    block = np.full(n, -1)
    if counted.size < 2 * _FEWEST_IN_BLOCK:
        return block
    length = counted[-1] - counted[0] + 1
    n_blocks = max(2, min(wanted, int(counted.size // _FEWEST_IN_BLOCK)))
    number = (counted - counted[0]) * n_blocks // length
    block[counted] = np.unique(number, return_inverse=True)[1]
    return block


def while_moving(record: ElementRecord) -> ElementRecord:
    """Decay without the samples after it has come to rest; any other record as it is.

    At rest columns of force are noise, and dry friction balances whatever remains.
    """
    if not record.is_released:
        return record
    moves = np.arange(record.block.size) < _end_of_motion(record)
    moves &= record.block >= 0
    if np.count_nonzero(moves) < 2 * _FEWEST_IN_BLOCK:
        return record
    return replace(record, block=np.where(moves, record.block, -1))


def _end_of_motion(record: ElementRecord) -> int:
    """Number of samples until the speed of a decay is last clear of its noise."""
    least = _CLEAR_SPEED * speed_noise(record)
    clear = np.flatnonzero((np.abs(record.motion[1]) > least) & record.counts)
    return int(clear.max(initial=-1)) + 1


def fold_of(run: ForceRecord, number: int, n_folds: int) -> np.ndarray:
    """Fold of every sample of a run: blocks in turn, shifted by one from run to run."""
    return np.where(run.counts, (run.block + number) % n_folds, -1)


def where_folds_overlap(runs: Sequence[ForceRecord], n_folds: int) -> tuple[ForceRecord, ...]:
    """Runs without the samples whose deflection or speed one fold alone visits.

    What is fitted to the other folds has not been there: its score would be that of an
    extrapolation, and one peak would decide between classes. Blocks keep their numbers.
    """
    folds = [fold_of(run, number, n_folds) for number, run in enumerate(runs)]
    inside = [run.counts for run in runs]
    for name in ("x", "v"):
        values = [getattr(run, name) for run in runs]
        ends = []
        for fold in range(n_folds):
            visited = np.concatenate(
                [value[of == fold] for value, of in zip(values, folds, strict=True)]
            )
            if visited.size:
                ends.append((float(visited.min()), float(visited.max())))
        low, high = sorted(one[0] for one in ends)[1], sorted(one[1] for one in ends)[-2]
        inside = [
            counts & (value >= low) & (value <= high)
            for counts, value in zip(inside, values, strict=True)
        ]
    return tuple(
        replace(run, block=np.where(counts, run.block, -1))
        for run, counts in zip(runs, inside, strict=True)
    )


def while_sliding(run: ForceRecord, rest_speed: float) -> ForceRecord | None:
    """Run without the samples at which the mass stands still.

    While dry friction sticks it balances whatever is applied: its force is a reaction and no
    function of the motion, so that no class can hold it. None where the mass hardly moves.
    """
    if np.abs(run.v[run.counts]).max(initial=0.0) < rest_speed:
        return None
    rate = float(np.sqrt(np.mean(run.a[run.counts] ** 2)))
    passage = 2.0 * rest_speed / max(rate * run.step, 1e-300)
    longest = max(_STANDS * passage, _FEWEST_AT_REST)
    resting = np.concatenate([[False], np.abs(run.v) < rest_speed, [False]])
    ends = np.flatnonzero(np.diff(resting.astype(int))).reshape(-1, 2)
    stands = np.zeros(run.v.size, dtype=bool)
    for first, last in ends:
        if last - first > longest:
            stands[first:last] = True
    counts = run.counts & ~stands
    if np.count_nonzero(counts) < 2 * _FEWEST_IN_BLOCK:
        return None
    block = np.full(run.block.size, -1)
    block[counts] = np.unique(run.block[counts], return_inverse=True)[1]
    return replace(run, block=block)


def is_separable_from_time(runs: Sequence[ForceRecord], highest: float) -> bool:
    """Whether neither amplitude nor frequency of the motion follows time.

    R² of the windowed log RMS of x, and of v / x, on time splines common to all runs, is at most
    `highest`.
    """
    basis = time_splines(max(run.x.size * run.step for run in runs))
    rows = []
    amplitudes = []
    frequencies = []
    for run in runs:
        counted = np.flatnonzero(run.counts)
        # A decay that soon ends has fewer samples than windows.
        windows = np.array_split(counted, min(_WINDOWS, counted.size // _FEWEST_IN_WINDOW))
        x = np.array([np.std(run.x[window]) for window in windows])
        v = np.array([np.std(run.v[window]) for window in windows])
        middle = np.array([window.mean() for window in windows]) * run.step
        level = np.log(np.maximum(x, _SMALLEST))
        rate = np.log(np.maximum(v, _SMALLEST)) - level
        amplitudes.append(level - level.mean())
        frequencies.append(rate - rate.mean())
        splines = basis(middle)
        rows.append(splines - splines.mean(axis=1, keepdims=True))
    design = np.concatenate(rows, axis=1).T
    follows = [_r_squared(design, np.concatenate(values)) for values in (amplitudes, frequencies)]
    return max(follows) <= highest


def _r_squared(design: FloatArray, target: FloatArray) -> float:
    """Adjusted R² of a least-squares fit."""
    c = np.linalg.lstsq(design, target, rcond=None)[0]
    total = float(target @ target)
    if total == 0.0:
        return 0.0
    degrees = max(target.size - np.linalg.matrix_rank(design), 1)
    remainder = float(np.sum((target - design @ c) ** 2)) / degrees
    return 1.0 - remainder / (total / target.size)


def has_one_frequency(runs: Sequence[ElementRecord] | Sequence[ForceRecord]) -> bool:
    """Whether every run is driven at one and the same frequency; False where one is not driven.

    Then the band of the motion holds one line, whose height and phase alone splines of time fit.
    A line through the Hann window takes two bins by participation (and 2.2 at most, between two
    bins); two equal lines apart take four.
    """
    lines = []
    for run in runs:
        u = run.drive[run.counts]
        power = np.abs(np.fft.rfft((u - u.mean()) * np.hanning(u.size))) ** 2
        if power.sum() ** 2 >= _LINE_BINS * np.square(power).sum():
            return False
        width = 1.0 / (u.size * run.step)
        lines.append((width * float(np.argmax(power)), width))
    low, high = min(lines), max(lines)
    return high[0] - low[0] <= low[1] + high[1]
