"""The gap of a mounting beyond its map.

In time, between repeats, growth with loads and motion, scalars.
"""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from carrierflex.diagnosis.comparison.problem import FloatArray, GapCell
from carrierflex.diagnosis.gap.findings import (
    GapFindings,
    GapMoment,
    NonSynchronousCell,
    PartGrowth,
    Scalar,
)
from carrierflex.diagnosis.gap.non_synchronous import (
    non_synchronous_words,
    scatter_p_values,
    significant_non_synchronous,
)
from carrierflex.diagnosis.gap.power_laws import exponents
from carrierflex.diagnosis.mounting.gap_map import band_edges_hz, block_powers, pattern_matrix
from carrierflex.diagnosis.mounting.records import MountingRecord

TORQUE, RADIAL_LOAD, DEFLECTION, SPEED = "torque", "radial load", "deflection", "speed"
#: A pattern's gap in a block shows its growth where it is this many times the noise.
_SEEN = 2.0
#: Runs of one condition are repeats where their loads differ by no more than this share of their
#: size.
_SAME_LOADS = 0.02


def mounting_findings(
    records: Sequence[MountingRecord],
    residuals: Sequence[FloatArray],
    cells: Sequence[GapCell],
    sensors: Sequence[str],
    channels: Sequence[str],
) -> GapFindings:
    """Gap in time, what differs between repeats, and growth with the loads and the motion.

    Parameters
    ----------
    records : sequence of MountingRecord
        Runs.
    residuals : sequence of ndarray, shape (n, n_channels)
        Gap of every run, zero where nothing was measured.
    cells : sequence of GapCell
        Its map.
    sensors, channels : sequence of str
        Sensor and name of every channel.

    Returns
    -------
    GapFindings
        Trends in time are not among them: loads that change in time make them too.
    """
    names, matrix = pattern_matrix(sensors, channels)
    repeats = [
        row
        for one, two in combinations(range(len(records)), 2)
        if _are_repeats(records[one], records[two])
        for row in _difference(records, residuals, (one, two), names, matrix)
    ]
    rows = significant_non_synchronous(repeats)
    return GapFindings(
        in_time=tuple(
            m for record, own in zip(records, residuals, strict=True) for m in _moments(record, own)
        ),
        non_synchronous=rows,
        growth=_growth(records, residuals, names, matrix),
        parity="not determinable: the loads are not periodic",
        text=non_synchronous_words(
            rows, sum(cell.coherent for cell in cells), "m", "repeat to repeat", noun="line"
        ),
    )


def mounting_scalars(
    records: Sequence[MountingRecord],
    residuals: Sequence[FloatArray],
    sensors: Sequence[str],
    channels: Sequence[str],
) -> tuple[Scalar, ...]:
    """Mean and peak to peak of every motion by block, measured and predicted [m].

    Parameters
    ----------
    records, residuals, sensors, channels
        As for :func:`mounting_findings`.
    """
    names, matrix = pattern_matrix(sensors, channels)
    sides: list[list[FloatArray]] = [[], []]
    for record, residual in zip(records, residuals, strict=True):
        complete = np.asarray(np.isfinite(record.measured).all(axis=1))
        motion = np.where(complete[:, None], record.measured, 0.0) @ matrix.T
        for block in range(record.n_blocks):
            own = complete & (record.block == block)
            if own.sum() > 1:
                sides[0].append(motion[own])
                sides[1].append(motion[own] - residual[own] @ matrix.T)
    scalars = []
    for k, name in enumerate(names):
        for words, value in (("mean", np.mean), ("peak to peak", np.ptp)):
            measured, predicted = (np.array([value(own[:, k]) for own in side]) for side in sides)
            scalars.append(Scalar(f"{name}, {words}", "m", measured, predicted))
    return tuple(scalars) if sides[0] else ()


def _moments(record: MountingRecord, residual: FloatArray) -> list[GapMoment]:
    moments = []
    for block in range(record.n_blocks):
        own = record.block == block
        present = int(np.isfinite(record.measured[own]).sum())
        if present:
            rms = float(np.sqrt(np.sum(residual[own] ** 2) / present))
            moments.append(GapMoment(record.name, float(record.inputs.time[own].mean()), rms))
    return moments


def _are_repeats(one: MountingRecord, two: MountingRecord) -> bool:
    """Whether two runs of one condition bear the same loads, sample by sample."""
    if one.condition != two.condition or one.inputs.time.size != two.inputs.time.size:
        return False
    difference, size = one.inputs.loads - two.inputs.loads, one.inputs.loads
    return bool(
        (np.square(difference).mean(axis=0) <= _SAME_LOADS**2 * np.square(size).mean(axis=0)).all()
    )


def _difference(
    records: Sequence[MountingRecord],
    residuals: Sequence[FloatArray],
    pair: tuple[int, int],
    names: Sequence[str],
    matrix: FloatArray,
) -> list[NonSynchronousCell]:
    """Half of the squared difference of two repeats, by motion and band, against the noise of one."""
    one, two = (records[k] for k in pair)
    both = np.isfinite(one.measured) & np.isfinite(two.measured)
    apart = [
        np.where(both, part, 0.0)
        for part in (
            residuals[pair[0]] - residuals[pair[1]],
            one.measured - two.measured,
            one.measured - residuals[pair[0]] - two.measured + residuals[pair[1]],
        )
    ]
    edges = band_edges_hz(records)
    (gap, lines), (seen, _), (model, _) = (
        block_powers(one, part @ matrix.T, edges) for part in apart
    )
    degrees = np.maximum(lines.sum(axis=0), 1.0)
    noise = np.multiply.outer(matrix**2 @ (one.noise + two.noise) / 2.0, lines.sum(axis=0))
    noise[:, 0] += matrix**2 @ (one.zero_noise + two.zero_noise) / 2.0 * both.all(axis=1).sum()
    halves = [0.5 * own.sum(axis=0) / both.size for own in (seen, model, gap)]
    noise = noise / both.size
    p_value = scatter_p_values(halves[2], noise, np.broadcast_to(degrees, noise.shape))
    return [
        NonSynchronousCell(
            f"{one.name} and {two.name}", name, float((edges[b] + edges[b + 1]) / edges[1]), float(halves[0][p, b]),
            float(halves[1][p, b]), float(halves[2][p, b]), float(noise[p, b]), float(p_value[p, b]),
        )
        for p, name in enumerate(names)
        for b in range(edges.size - 1)
    ]  # fmt: skip


def _growth(
    records: Sequence[MountingRecord],
    residuals: Sequence[FloatArray],
    names: Sequence[str],
    matrix: FloatArray,
) -> tuple[PartGrowth, ...]:
    """Exponents of every motion's gap over the blocks.

    With the loads, and with deflection and speed of that motion.
    """
    rows: list[list[FloatArray]] = [[], [], [], []]
    loads = []
    for record, residual in zip(records, residuals, strict=True):
        motion = np.where(np.isfinite(record.measured), record.measured, 0.0) @ matrix.T
        speed = np.gradient(motion, record.step, axis=0)
        noise = np.sqrt(matrix**2 @ record.noise)
        for block in range(record.n_blocks):
            own = record.block == block
            for row, values in zip(rows, (residual @ matrix.T, motion, speed), strict=False):
                row.append(np.sqrt(np.mean(values[own] ** 2, axis=0)))
            rows[3].append(noise)
            torque, y, z = np.sqrt(np.mean(record.inputs.loads[own] ** 2, axis=0))
            loads.append((torque, np.hypot(y, z)))
    left, deflection, speed, noise = (np.array(row) for row in rows)
    by_load = np.array(loads)
    parts = []
    for k, name in enumerate(names):
        seen = left[:, k] > _SEEN * noise[:, k]
        size = np.sqrt(np.maximum(left[seen, k] ** 2 - noise[seen, k] ** 2, 0.0))
        own = exponents(
            size, noise[seen, k], {TORQUE: by_load[seen, 0], RADIAL_LOAD: by_load[seen, 1]}
        )
        own |= exponents(
            size, noise[seen, k], {DEFLECTION: deflection[seen, k], SPEED: speed[seen, k]}
        )
        if seen.any():
            parts.append(
                (float(np.sum(left[:, k] ** 2)), PartGrowth(name, float("nan"), "housing", own))
            )
    return tuple(part for _, part in sorted(parts, key=lambda pair: -pair[0]))
