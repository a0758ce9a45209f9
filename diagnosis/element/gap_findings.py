"""The gap of an element beyond its map.

By block in time, what does not repeat from period to period, growth, scalars.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from carrierflex.diagnosis.comparison.problem import FloatArray, GapCell
from carrierflex.diagnosis.element.gap_map import parity_text, whole_periods
from carrierflex.diagnosis.element.growth import BlockForces, block_forces, growth_exponent
from carrierflex.diagnosis.element.model import ElementModel
from carrierflex.diagnosis.element.records import ElementRecord
from carrierflex.diagnosis.gap.findings import (
    Drift,
    GapFindings,
    GapMoment,
    NonSynchronousCell,
    PartGrowth,
    Scalar,
)
from carrierflex.diagnosis.gap.in_time import drift_words, significant_drifts, trends
from carrierflex.diagnosis.gap.non_synchronous import (
    non_synchronous_words,
    scatter_p_values,
    significant_non_synchronous,
)
from carrierflex.diagnosis.gap.power_laws import Exponent, exponents

_BANDS = 12
#: Unexplained force in blocks where it is this many times the noise shows its growth with speed.
_SEEN = 2.0
DEFLECTION, SPEED = "deflection", "speed"


def element_findings(
    model: ElementModel,
    records: Sequence[ElementRecord],
    residuals: Sequence[FloatArray],
    cells: Sequence[GapCell],
    *,
    noise: FloatArray,
    is_declared: bool,
    channel: str,
) -> GapFindings:
    """Gap in time, incoherent part, growth and parity of an element.

    Parameters
    ----------
    model : ElementModel
        Baseline.
    records : sequence of ElementRecord
        Runs.
    residuals : sequence of ndarray
        Gap of every run.
    cells : sequence of GapCell
        Its map.
    noise : ndarray, shape (n_runs,)
        Variance of the noise.
    is_declared : bool
        Whether the campaign declares the noise; noise from repeats says nothing about their
        scatter.
    channel : str
        Name of the channel.

    Returns
    -------
    GapFindings
        All of it, with words.
    """
    moments: list[GapMoment] = []
    trend_rows: list[Drift] = []
    scattered: list[NonSynchronousCell] = []
    for record, residual, variance in zip(records, residuals, noise, strict=True):
        moments += _moments(record, residual)
        trend_rows += _drifts(record, residual, channel)
        scattered += _scatter(
            record, residual, channel, float(variance) if is_declared else float("nan")
        )
    drifts, rows = significant_drifts(trend_rows), significant_non_synchronous(scattered)
    unit = model.units[1 if model.by_force else 0]
    coherent = sum(cell.coherent for cell in cells)
    words = [
        non_synchronous_words(rows, coherent, unit, "period to period", noun="line"),
        drift_words(drifts, unit, noun="line"),
    ]
    conditions = {
        DEFLECTION: growth_exponent(model, records, noise),
        SPEED: _speed_exponent(model, records, noise),
    }
    return GapFindings(
        in_time=tuple(moments),
        drifts=drifts,
        non_synchronous=rows,
        growth=(PartGrowth(channel, float("nan"), "", conditions),),
        parity=parity_text(cells, records) or _no_parity(records),
        text="; ".join(text for text in words if text),
    )


def element_scalars(
    records: Sequence[ElementRecord], residuals: Sequence[FloatArray], unit: str
) -> tuple[Scalar, ...]:
    """Peak to peak and RMS of the channel by block, measured and predicted.

    Parameters
    ----------
    records : sequence of ElementRecord
        Runs.
    residuals : sequence of ndarray
        Gap of every run.
    unit : str
        Unit of the channel.
    """
    measured, predicted = [], []
    for record, residual in zip(records, residuals, strict=True):
        for block in range(record.n_blocks):
            own = record.block == block
            measured.append(record.response[own])
            predicted.append(record.response[own] - residual[own])
    return (
        Scalar(
            "peak to peak",
            unit,
            *(np.array([np.ptp(own) for own in side]) for side in (measured, predicted)),
        ),
        Scalar(
            "RMS", unit, *(np.array([_rms(own) for own in side]) for side in (measured, predicted))
        ),
    )


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _moments(record: ElementRecord, residual: FloatArray) -> list[GapMoment]:
    """RMS by block: a block is long enough to score, and a drive's amplitude may change from one to the next."""
    blocks = [np.flatnonzero(record.block == block) for block in range(record.n_blocks)]
    return [
        GapMoment(record.name, float(own.mean() * record.step), _rms(residual[own]))
        for own in blocks
        if own.size
    ]


def _drifts(record: ElementRecord, residual: FloatArray, channel: str) -> list[Drift]:
    """Trends of the lines over the periods.

    Of the blocks' means (order 0) where the drive is not periodic.
    """
    periods = whole_periods(record, residual)
    if periods is not None:
        amplitudes = np.fft.rfft(periods, axis=1)[:, : (periods.shape[1] + 1) // 2] * (
            2.0 / periods.shape[1]
        )
        amplitudes[:, 0] *= 0.5
    else:
        means = [residual[record.block == block].mean() for block in range(record.n_blocks)]
        amplitudes = np.array(means, dtype=np.complex128)[:, None]
    change, trend, p_value = trends(np.arange(len(amplitudes), dtype=np.float64), amplitudes)
    whole = float(np.mean(residual[record.block >= 0] ** 2))
    half = np.where(np.arange(change.size) == 0, 1.0, 0.5)
    share = half * trend / whole if whole > 0.0 else np.zeros(change.size)
    return [
        Drift(record.name, channel, float(k), float(change[k]), float(share[k]), float(p_value[k]))
        for k in range(change.size)
    ]


def _scatter(
    record: ElementRecord, residual: FloatArray, channel: str, variance: float
) -> list[NonSynchronousCell]:
    """Scatter of the lines over the periods, by band of lines.

    The simulated signal of a settled drive repeats.
    """
    periods = whole_periods(record, residual)
    if periods is None:
        return []
    n, size = periods.shape
    measured = whole_periods(record, record.response)
    assert measured is not None
    rows = []
    for values in (periods, measured, measured - periods):
        lines = np.fft.rfft(values, axis=1)[:, 1 : (size + 1) // 2] * (2.0 / size)
        rows.append(0.5 * lines.var(axis=0, ddof=1))
    edges = np.unique(np.geomspace(1, rows[0].size + 1, _BANDS + 1).round().astype(int))
    cells = []
    for first, last in pairwise(edges.tolist()):
        gap, seen, model = (float(row[first - 1 : last - 1].sum()) for row in rows)
        count = last - first
        noise = 2.0 * variance / size * count
        degrees = np.array(2.0 * count * (n - 1))
        p_value = (
            float(scatter_p_values(np.array(gap), np.array(noise), degrees))
            if np.isfinite(noise)
            else float("nan")
        )
        cells.append(
            NonSynchronousCell(
                record.name, channel, 0.5 * (first + last - 1), seen, model, gap, noise, p_value
            )
        )
    return cells


def _speed_exponent(
    model: ElementModel, records: Sequence[ElementRecord], noise: FloatArray
) -> Exponent:
    """Exponent with speed at equal deflection, where the blocks tell the two apart."""
    blocks: BlockForces = block_forces(model, records, noise)
    seen = blocks.left > _SEEN * blocks.noise
    size = np.sqrt(np.maximum(blocks.left**2 - blocks.noise**2, 0.0))
    conditions = {DEFLECTION: blocks.deflection[seen], SPEED: blocks.speed[seen]}
    return exponents(size[seen], blocks.noise[seen], conditions)[SPEED]


def _no_parity(records: Sequence[ElementRecord]) -> str:
    if not all(record.period for record in records):
        return "not determinable: the drive is not periodic"
    return "not determinable: the drive holds even lines, or no line of the gap stands out"
