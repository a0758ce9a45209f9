"""What the classes see of a run: target force, motion, drive and blocks, whatever the drive was."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.classes.motion.nearest_motion import (
    Motion,
    nearest_motion,
    participation,
    speed_noise,
)
from carrierflex.diagnosis.element.classes.motion.steady_motion import with_harmonics
from carrierflex.diagnosis.element.model import ElementModel
from carrierflex.diagnosis.element.records import ElementRecord
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
#: then in the harmonics of the force, and the force's band is kept whole.
_NARROW = 0.15
_WIDEST = 0.95
#: Blocks of all runs, and of a sweep or decay for each of these. A block that is held out must hold
#: no amplitude that the others do not: of 24 blocks of a sweep one holds the resonance, and its
#: score is that of an extrapolation. Elsewhere long blocks keep what is slow from being
#: interpolated between neighbours.
_BLOCKS = 24
IN_TIME = 4
#: Times as long as the passage through rest at the RMS of the acceleration from which a mass stands
#: still rather than turns round, and samples at least.
_STANDS, _FEWEST_AT_REST = 3.0, 3
FEWEST_IN_BLOCK = 16
#: Part of the deflection outside its band that may be left out: so many times the noise, or this
#: share of the local motion.
_ABOVE_NOISE, _LEFT_OUT = 3.0, 0.1


@dataclass(frozen=True, eq=False)
class ForceRecord:
    """One run in force space, before the common filter.

    A drive by a base or a free decay fits in: `target` is then the force that the motion needs,
    with the mass left out (a force for each unit of mass).

    Parameters
    ----------
    record : ElementRecord
        The run.
    target : ndarray, shape (n,)
        Force to be explained.
    base : ndarray, shape (n_base, n)
        Regressors of the baseline.
    x, v, a : ndarray, shape (n,)
        Motion in its trusted band.
    side : ndarray, shape (n,)
        Signal of the drive side: the force applied, or the baseline's own force.
    force : ndarray, shape (n,)
        Force as it was measured: applied, or that of a driven deflection in the band of the target.
    band_hz : float
        End of the band in which forces are compared.
    block : ndarray of int, shape (n,)
        Block of every sample; -1 where it does not count.
    from_rest : bool
        Whether sliders and relaxing branches begin relaxed at the first sample; else where a motion
        like this one leaves them.
    speed_error : float
        Standard deviation of the error of `v`.
    noise_motion : tuple of ndarray, optional
        Deflection, speed and acceleration of what was measured beside a motion that is known from
        its harmonics: `base` does not hold it.
    lag : float
        Lag over which the column of a delay takes the change of the force [s]; zero for its rate.
    """

    record: ElementRecord
    target: FloatArray
    base: FloatArray
    x: FloatArray
    v: FloatArray
    a: FloatArray
    side: FloatArray
    force: FloatArray
    band_hz: float
    block: np.ndarray
    from_rest: bool = False
    speed_error: float = 0.0
    noise_motion: Motion | None = None
    lag: float = 0.0

    @property
    def step(self) -> float:
        """Sampling interval [s]."""
        return self.record.step

    @property
    def counts(self) -> np.ndarray:
        """Samples that count."""
        return self.block >= 0


def force_records(
    model: ElementModel,
    records: Sequence[ElementRecord],
    noise: FloatArray,
    *,
    finer: int = 1,
) -> tuple[ForceRecord, ...]:
    """Runs in force space.

    Parameters
    ----------
    model : ElementModel
        Baseline and its scale.
    records : sequence of ElementRecord
        Runs.
    noise : ndarray, shape (n_runs,)
        Variance of the channel's noise by run.
    finer : int
        Blocks for each of the usual ones.

    Returns
    -------
    tuple of ForceRecord
        Those that hold enough samples away from their ends.
    """
    n_blocks = max(2, round(finer * _BLOCKS / len(records)))
    found = []
    for record, variance in zip(records, noise, strict=True):
        deflection = record.response if model.by_force else record.drive
        own_noise = float(variance) if model.by_force else 0.0
        inside = _in_band(record, deflection, own_noise, by_force=model.by_force)
        block = _blocks(record, n_blocks, float(variance), inside)
        if block.max(initial=-1) < 0:
            continue
        nearest, speed_error = nearest_motion(model, record, float(variance))
        band = _band(model, record)
        own, nearest, noise_motion = with_harmonics(model, record, nearest, float(variance))
        base = base_columns(model, own)
        side = _applied(model, own)
        measured = _measured(model, own, band)
        found.append(
            ForceRecord(
                record=own,
                target=_target(model, own, measured),
                base=base,
                x=nearest[0],
                v=nearest[1],
                a=nearest[2],
                side=side,
                force=side if model.by_force else measured,
                band_hz=band,
                block=block,
                speed_error=speed_error,
                noise_motion=noise_motion,
            )
        )
    return tuple(found) if model.by_force else _with_predicted_forces(model, found)


def with_noise_of(own: ForceRecord, element: tuple[float, float, float] | None) -> ForceRecord:
    """Run whose target holds the noise of a motion known from its harmonics as a force.

    What is left is compared with the noise of the records, so that it must be in it; in the
    regressors it would make the mass too small.

    Parameters
    ----------
    own : ForceRecord
        Run.
    element : tuple of float, optional
        m [kg], C1 [N s/m], K1 [N/m] that the filter takes; None where the force is measured.
    """
    if own.noise_motion is None or element is None:
        return own
    m, C1, K1 = element
    x, v, a = own.noise_motion
    return replace(own, target=own.target - (m * a + C1 * v + K1 * x))


def _with_predicted_forces(
    model: ElementModel, own: Sequence[ForceRecord]
) -> tuple[ForceRecord, ...]:
    """Runs whose drive side is the force that the baseline predicts for a driven deflection.

    By least squares over all runs: at one frequency mass and spring are one unknown, of which the
    element's own scale keeps what lies within physical bounds, and so another force.
    """
    if not own:
        return ()
    design = np.concatenate([record.base[:, record.counts] for record in own], axis=1)
    target = np.concatenate([record.target[record.counts] for record in own])
    c = design_solution(design.T, target)
    mass = model.mass or 0.0
    return tuple(replace(record, side=mass * record.a + c @ record.base) for record in own)


def _is_narrow(record: ElementRecord) -> bool:
    """Whether the energy of a run's motion fills a small share of its band."""
    lines, resolution = participation(record)
    return lines * resolution < _NARROW * record.flat_hz


def _applied(model: ElementModel, record: ElementRecord) -> FloatArray:
    """Force applied; the restoring force where the element is released and nothing is."""
    if record.drive.any():
        return record.drive
    q, v, _ = record.motion
    return model.scale.C1 * v + model.scale.K1 * q


def _measured(model: ElementModel, record: ElementRecord, band_hz: float) -> FloatArray:
    """Measured force in the band of the motion, as the regressors are.

    Over the whole band where the motion is narrow: it has nothing near the end of its own.
    """
    force = record.drive if model.by_force else record.response
    if band_hz == record.flat_hz:
        return band_limited(force, record.step, record.cutoff_hz)
    return force


def _target(model: ElementModel, record: ElementRecord, measured: FloatArray) -> FloatArray:
    """Measured force less that of a given mass; what another simulator's prediction lacks."""
    if record.gap is not None:
        return known_force(model, record)
    return measured - (model.mass or 0.0) * record.motion[2]


def _band(model: ElementModel, record: ElementRecord) -> float:
    """End of the band of the force: the motion's, or all of it where the motion is narrow."""
    if model.by_force or record.gap is not None:
        return record.flat_hz
    if _is_narrow(record):
        return _WIDEST * 0.5 / record.step
    return record.flat_hz


def _in_band(
    record: ElementRecord, deflection: FloatArray, variance: float, *, by_force: bool
) -> np.ndarray:
    """Samples at which the motion lies in its trusted band.

    Where a sweep passes the end of the band the motion is known in part alone, and a force that is
    no straight line of it is not known at all.
    """
    window = max(int(np.ceil(1.0 / (record.flat_hz * record.step))), 3)

    def local(values: FloatArray) -> FloatArray:
        return uniform_filter1d(np.asarray(values**2), window, mode="nearest")

    q = record.motion[0]
    # Under a force the motion is compared too, where the band is flat: a line beyond has no force
    # beside it.
    compared = record.where_flat(q) if by_force else q
    outside = local(deflection - compared)
    swing = local(q - q[record.counts].mean())
    return (outside <= _ABOVE_NOISE * variance) | (outside <= _LEFT_OUT**2 * swing)


def _blocks(record: ElementRecord, wanted: int, variance: float, inside: np.ndarray) -> np.ndarray:
    """Blocks of like length of the samples that count, away from the ends."""
    n = record.counts.size
    # A decay is largest where it begins: fewer periods are given up there.
    periods = _RELEASED_PERIODS if record.is_released else _EDGE_PERIODS
    edge = min(int(np.ceil(periods / (record.flat_hz * record.step))), int(_LARGEST_EDGE * n))
    place = np.arange(n)
    last = n - edge
    if record.is_released:
        least = _CLEAR_SPEED * speed_noise(variance, record.flat_hz, record.step)
        clear = np.flatnonzero(np.abs(record.motion[1]) > least)
        last = min(last, int(clear.max(initial=-1)) + 1)
    counted = np.flatnonzero(record.counts & inside & (place >= edge) & (place < last))
    block = np.full(n, -1)
    if counted.size < 2 * FEWEST_IN_BLOCK:
        return block
    length = counted[-1] - counted[0] + 1
    n_blocks = max(2, min(wanted, int(counted.size // FEWEST_IN_BLOCK)))
    number = (counted - counted[0]) * n_blocks // length
    block[counted] = np.unique(number, return_inverse=True)[1]
    return block


def fold_of(own: ForceRecord, number: int, n_folds: int) -> np.ndarray:
    """Fold of every sample of a run: blocks in turn, shifted by one from run to run."""
    return np.where(own.counts, (own.block + number) % n_folds, -1)


def where_folds_overlap(own: Sequence[ForceRecord], n_folds: int) -> tuple[ForceRecord, ...]:
    """Runs without the samples whose deflection or speed one fold alone visits.

    What is fitted to the other folds has not been there: its score would be that of an
    extrapolation, and one peak would decide between classes.

    Parameters
    ----------
    own : sequence of ForceRecord
        Runs.
    n_folds : int
        Folds of the blocks.

    Returns
    -------
    tuple of ForceRecord
        Copies in which such samples do not count; blocks keep their numbers where they can.
    """
    folds = [fold_of(record, number, n_folds) for number, record in enumerate(own)]
    inside = [record.counts for record in own]
    for name in ("x", "v"):
        values = [getattr(record, name) for record in own]
        ends = []
        for fold in range(n_folds):
            visited = np.concatenate(
                [value[of == fold] for value, of in zip(values, folds, strict=True)]
            )
            if visited.size:
                ends.append((float(visited.min()), float(visited.max())))
        low, high = sorted(one[0] for one in ends)[1], sorted(one[1] for one in ends)[-2]
        inside = [
            kept & (value >= low) & (value <= high)
            for kept, value in zip(inside, values, strict=True)
        ]
    return tuple(
        replace(record, block=np.where(kept, record.block, -1))
        for record, kept in zip(own, inside, strict=True)
    )


def while_sliding(own: ForceRecord, rest_speed: float) -> ForceRecord | None:
    """Run without the samples at which the mass stands still.

    While dry friction sticks it balances whatever is applied: its force is a reaction and no
    function of the motion, so that no class can hold it.

    Parameters
    ----------
    own : ForceRecord
        Run.
    rest_speed : float
        Speed below which the sign of the speed is uncertain.

    Returns
    -------
    ForceRecord or None
        Copy in which they do not count; None where the mass hardly moves in the whole run.
    """
    if np.abs(own.v[own.counts]).max(initial=0.0) < rest_speed:
        return None
    rate = float(np.sqrt(np.mean(own.a[own.counts] ** 2)))
    passage = 2.0 * rest_speed / max(rate * own.step, 1e-300)
    longest = max(_STANDS * passage, _FEWEST_AT_REST)
    resting = np.concatenate([[False], np.abs(own.v) < rest_speed, [False]])
    ends = np.flatnonzero(np.diff(resting.astype(int))).reshape(-1, 2)
    stands = np.zeros(own.v.size, dtype=bool)
    for first, last in ends:
        if last - first > longest:
            stands[first:last] = True
    kept = own.counts & ~stands
    if np.count_nonzero(kept) < 2 * FEWEST_IN_BLOCK:
        return None
    block = np.full(own.block.size, -1)
    block[kept] = np.unique(own.block[kept], return_inverse=True)[1]
    return replace(own, block=block)
