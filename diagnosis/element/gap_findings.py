"""Findings about the gap of an element.

Where it lies, by block in time, what does not repeat from period to period, growth, scalars.
"""

from collections.abc import Sequence

import numpy as np

from carrierflex.diagnosis.comparison.problem import FloatArray, GapCell
from carrierflex.diagnosis.element.gap_map import line_amplitudes, whole_periods
from carrierflex.diagnosis.element.growth import block_forces, growth_exponent
from carrierflex.diagnosis.element.model import ElementModel
from carrierflex.diagnosis.element.records import ElementRecord
from carrierflex.diagnosis.gap.findings import (
    BAND,
    EVEN,
    LINES,
    NO_ODD_DRIVE,
    NO_PERIODIC_DRIVE,
    ODD,
    ODD_AND_EVEN,
    Exponent,
    Finding,
    GapFindings,
    GapMoment,
    PartGrowth,
    Scalar,
    exponents,
)
from carrierflex.diagnosis.gap.gap_map import largest_cells, significant
from carrierflex.diagnosis.gap.in_time import (
    DriftTable,
    ScatterTable,
    block_rms,
    repeatability,
    scatter_p_values,
    significant_drifts,
    significant_non_synchronous,
    trend,
)

_BANDS = 12
#: Unexplained force in blocks where it is this many times the noise shows its growth with speed.
_CLEAR = 2.0
#: Even (or odd) lines count as not driven below this share of the drive's power.
_NOT_DRIVEN = 0.01
#: The gap counts as odd, or even, from this share on lines of that parity.
_PURE = 0.9
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
    """Where the gap lies, in time, what does not repeat, growth and parity of an element.

    Parameters
    ----------
    model : ElementModel
        Baseline.
    records : sequence of ElementRecord
        Runs.
    residuals : sequence of ndarray, shape (n,)
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
        All of it.
    """
    moments: list[GapMoment] = []
    trends: list[DriftTable] = []
    scattered: list[ScatterTable] = []
    for record, residual, variance in zip(records, residuals, noise, strict=True):
        time = record.step * np.arange(residual.size, dtype=np.float64)
        is_measured = np.ones((residual.size, 1), dtype=bool)
        moments += block_rms(record.name, time, record.block, residual[:, None], is_measured)
        trends.append(_drifts(record, residual, channel))
        scattered += _scatter(
            record, residual, channel, float(variance) if is_declared else float("nan")
        )
    rows = significant_non_synchronous(scattered)
    exponent = growth_exponent(model, records, noise)
    conditions = {DEFLECTION: exponent, SPEED: _speed_exponent(model, records, noise)}
    return GapFindings(
        where=_where(cells, "deflection" if model.by_force else "force", exponent),
        numbered_by=LINES,
        in_time=tuple(moments),
        drifts=significant_drifts(trends),
        non_synchronous=rows,
        repeatability=repeatability(rows, sum(cell.coherent for cell in cells), "period"),
        growth=(PartGrowth(channel, float("nan"), "", conditions),),
        parity=parity(cells, records),
    )


def _where(cells: Sequence[GapCell], quantity: str, growth: Exponent) -> tuple[Finding, ...]:
    """Band and runs that hold most of the gap; empty where no cell is significant."""
    largest = largest_cells(significant(cells))
    if not largest:
        return ()
    bands_hz = [cell.frequency_hz for cell in largest if cell.frequency_hz]
    runs = {cell.run for cell in largest}
    finding = Finding(
        kind=BAND,
        patterns=(quantity,),
        share=sum(cell.share for cell in largest),
        runs=tuple(sorted(runs)),
        is_in_every_run=runs == {cell.run for cell in cells},
        band_hz=(min(low for low, _ in bands_hz), max(high for _, high in bands_hz)),
        exponents={DEFLECTION: growth},
    )
    return (finding,)


def parity(cells: Sequence[GapCell], records: Sequence[ElementRecord]) -> str:
    """Parity of the missing law, or why the lines do not tell it.

    Parameters
    ----------
    cells : sequence of GapCell
        Gap map.
    records : sequence of ElementRecord
        Runs.
    """
    if not all(record.period for record in records):
        return NO_PERIODIC_DRIVE
    beyond = significant(cells)
    first = int(np.argmax(records[0].counts))
    period = records[0].drive[first : first + records[0].period]
    power = np.abs(np.fft.rfft(period)[1:]) ** 2
    is_odd_drive = power[0::2].sum() / power.sum() >= 1.0 - _NOT_DRIVEN
    if not beyond or not is_odd_drive:
        return NO_ODD_DRIVE
    odd = sum(cell.coherent for cell in beyond if cell.order >= 1 and int(cell.order) % 2)
    every = sum(cell.coherent for cell in beyond if cell.order >= 1)
    share = odd / max(every, np.finfo(float).tiny)
    if share >= _PURE:
        return ODD
    return EVEN if share <= 1.0 - _PURE else ODD_AND_EVEN


def element_scalars(
    records: Sequence[ElementRecord], residuals: Sequence[FloatArray], unit: str
) -> tuple[Scalar, ...]:
    """Peak to peak and RMS of the channel by block, measured and predicted.

    Parameters
    ----------
    records : sequence of ElementRecord
        Runs.
    residuals : sequence of ndarray, shape (n,)
        Gap of every run.
    unit : str
        Unit of the channel.
    """
    measured = []
    predicted = []
    for record, residual in zip(records, residuals, strict=True):
        for block in range(record.n_blocks):
            is_inside = record.block == block
            measured.append(record.response[is_inside])
            predicted.append(record.response[is_inside] - residual[is_inside])
    scalars = []
    for name, size in (("peak to peak", np.ptp), ("RMS", _rms)):
        sizes = np.array([float(size(values)) for values in measured])
        predicted_sizes = np.array([float(size(values)) for values in predicted])
        scalars.append(Scalar(name, unit, sizes, predicted_sizes))
    return tuple(scalars)


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _drifts(record: ElementRecord, residual: FloatArray, channel: str) -> DriftTable:
    """Trends of the lines over the periods.

    Of the blocks' means (order 0) where the drive is not periodic.
    """
    periods = whole_periods(record, residual)
    if periods is not None:
        amplitudes = line_amplitudes(periods)
    else:
        means = [residual[record.block == block].mean() for block in range(record.n_blocks)]
        amplitudes = np.array(means, dtype=np.complex128)[:, None]
    over_run = trend(np.arange(len(amplitudes), dtype=np.float64), amplitudes)
    mean_square = float(np.mean(residual[record.block >= 0] ** 2))
    half = np.where(np.arange(over_run.change.size) == 0, 1.0, 0.5)
    share = half * over_run.mean_square / (mean_square or np.inf)
    return DriftTable(
        run=record.name,
        patterns=(channel,),
        orders=np.arange(over_run.change.size, dtype=np.float64),
        change=over_run.change[None],
        share=share[None],
        p_value=over_run.p_value[None],
        used=np.ones((1, over_run.change.size), dtype=bool),
    )


def _scatter(
    record: ElementRecord, residual: FloatArray, channel: str, variance: float
) -> list[ScatterTable]:
    """Scatter of the lines over the periods, by band of lines.

    The simulated signal of a settled drive repeats.
    """
    periods = whole_periods(record, residual)
    measured = whole_periods(record, record.response)
    if periods is None or measured is None:
        return []
    n, size = periods.shape
    n_lines = (size + 1) // 2 - 1
    edges = np.unique(np.geomspace(1, n_lines + 1, _BANDS + 1).round().astype(int))
    counts = np.diff(edges)

    def scatter(signals: FloatArray) -> FloatArray:
        """Power of the scatter between periods, by band, shape (1, n_bands)."""
        by_line = 0.5 * line_amplitudes(signals).var(axis=0, ddof=1)
        return np.add.reduceat(by_line[: edges[-1]], edges[:-1])[None]

    gap = scatter(periods)
    noise = (2.0 * variance / size * counts)[None]
    p_value = np.full(gap.shape, np.nan)
    if np.isfinite(variance):
        p_value = scatter_p_values(gap, noise, (2.0 * counts * (n - 1))[None])
    table = ScatterTable(
        run=record.name,
        patterns=(channel,),
        orders=0.5 * (edges[:-1] + edges[1:] - 1),
        measured=scatter(measured),
        simulated=scatter(measured - periods),
        gap=gap,
        noise=noise,
        p_value=p_value,
    )
    return [table]


def _speed_exponent(
    model: ElementModel, records: Sequence[ElementRecord], noise: FloatArray
) -> Exponent:
    """Exponent with speed at equal deflection, where the blocks tell the two apart."""
    blocks = block_forces(model, records, noise)
    is_clear = blocks.residual > _CLEAR * blocks.noise
    size = np.sqrt(np.maximum(blocks.residual**2 - blocks.noise**2, 0.0))
    conditions = {DEFLECTION: blocks.deflection[is_clear], SPEED: blocks.speed[is_clear]}
    return exponents(size[is_clear], blocks.noise[is_clear], conditions)[SPEED]
