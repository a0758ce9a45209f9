"""Where the gap of an element lies.

By line of a periodic drive or by band, by run; its growth and its parity, in words.
"""

from collections.abc import Sequence

import numpy as np
from scipy.stats import chi2, false_discovery_control
from scipy.stats import f as fisher_f

from carrierflex.diagnosis.comparison.problem import FloatArray, GapCell
from carrierflex.diagnosis.element.bands import block_squares
from carrierflex.diagnosis.element.records import ElementRecord

_BANDS = 24
_DRAWS = 200
_SEED = 1
#: Cells of the sentence: significance, smallest share, and the part of the gap they hold together.
_SIGNIFICANCE = 0.01
_CORE = 0.8
#: Even (or odd) lines count as not driven below this share of the drive's power.
_NOT_DRIVEN = 0.01
_PURE = 0.9


def element_gap_cells(
    records: Sequence[ElementRecord],
    residuals: Sequence[FloatArray],
    noise: FloatArray,
    *,
    channel: str,
) -> tuple[GapCell, ...]:
    """Gap map of a residual.

    Periodic drive with two periods or more: by line k, with the amplitudes ``E_r`` of R periods and
    their scatter s², coherent part ``|mean|²/2 - s²/2R``, test ``R |mean|²/s² ~ F(2, 2R - 2)``.
    Otherwise by band of frequency against the noise floor, ``power / noise ~ chi²``.

    Parameters
    ----------
    records : sequence of ElementRecord
        Runs.
    residuals : sequence of ndarray
        Gap of every run.
    noise : ndarray, shape (n_runs,)
        Variance of the noise.
    channel : str
        Name of the channel.

    Returns
    -------
    tuple of GapCell
        Largest share first.
    """
    tables = []
    for record, residual, variance in zip(records, residuals, noise, strict=True):
        periods = whole_periods(record, residual)
        tables.append(
            _band_table(record, residual, float(variance))
            if periods is None
            else _line_table(record, periods)
        )
    p_values = np.concatenate([table[2] for table in tables])
    adjusted = false_discovery_control(np.clip(p_values, 0.0, 1.0), method="by")
    total = sum(float(table[1].sum()) for table in tables)
    cells, first = [], 0
    for record, (orders, coherent, p_value, draws, square, bands) in zip(
        records, tables, strict=True
    ):
        low, high = np.quantile(
            _drawn_shares(draws, total - coherent.sum()), (0.025, 0.975), axis=0
        )
        for k in range(orders.size):
            share = float(coherent[k] / total) if total else 0.0
            interval = (float(low[k]), float(high[k]))
            band = (float(bands[k][0]), float(bands[k][1]))
            cells.append(
                GapCell(
                    channel, float(orders[k]), record.name, float(square[k]), float(coherent[k]), share, interval,
                    float(adjusted[first + k]), band,
                )
            )  # fmt: skip
        first += p_value.size
    return tuple(sorted(cells, key=lambda cell: -cell.share))


def element_where_text(
    cells: Sequence[GapCell], records: Sequence[ElementRecord], *, by_force: bool, growth: str
) -> str:
    """Say in one sentence where the gap lies.

    Parameters
    ----------
    cells : sequence of GapCell
        Gap map of the baseline, largest share first.
    records : sequence of ElementRecord
        Runs.
    by_force : bool
        Drive.
    growth : str
        Growth of the unexplained force with deflection, in words.

    Returns
    -------
    str
        Frequencies, runs, growth with amplitude and parity.
    """
    seen = [cell for cell in cells if cell.p_value < _SIGNIFICANCE and cell.coherent > 0.0]
    if not seen:
        return "no frequency of the gap stands out from the noise"
    total = sum(cell.coherent for cell in seen)
    core: list[GapCell] = []
    for cell in seen:
        core.append(cell)
        if sum(own.coherent for own in core) >= _CORE * total:
            break
    low = min(cell.frequency_hz[0] for cell in core if cell.frequency_hz)
    high = max(cell.frequency_hz[1] for cell in core if cell.frequency_hz)
    runs = {cell.run for cell in core}
    where = "in every run" if len(runs) == len(records) else f"in {', '.join(sorted(runs))}"
    share = 100.0 * sum(cell.share for cell in core)
    place = f"at {high:.3g} Hz" if high <= 1.001 * low else f"between {low:.3g} and {high:.3g} Hz"
    signal = "deflection" if by_force else "force"
    parity = parity_text(cells, records)
    parity = f", {parity}" if parity else ""
    return f"{min(share, 100.0):.0f} % of the gap in {signal} lies {place}, {where}{growth}{parity}"


_Table = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]


def whole_periods(record: ElementRecord, residual: FloatArray) -> FloatArray | None:
    """Residual by period, shape (n_periods, period); None where the drive has fewer than two.

    Parameters
    ----------
    record : ElementRecord
        Run.
    residual : ndarray, shape (n,)
        Signal of that run.
    """
    first = int(np.argmax(record.counts))
    n = (residual.size - first) // record.period if record.period else 0
    return residual[first : first + n * record.period].reshape(n, record.period) if n >= 2 else None


def _line_table(record: ElementRecord, periods: FloatArray) -> _Table:
    """Order, coherent part, p-value, draws, mean square and band of every line."""
    n, size = periods.shape
    amplitude = np.fft.rfft(periods, axis=1)[:, : (size + 1) // 2] * (2.0 / size)
    amplitude[:, 0] /= np.sqrt(2.0)
    scatter = amplitude.var(axis=0, ddof=1)
    mean = amplitude.mean(axis=0)
    degrees = np.where(np.arange(mean.size) == 0, 1.0, 2.0)
    ratio = n * np.abs(mean) ** 2 / np.maximum(scatter, np.finfo(float).tiny)
    p_value = fisher_f.sf(ratio, degrees, degrees * (n - 1))
    weights = np.random.default_rng(_SEED).multinomial(n, np.full(n, 1.0 / n), _DRAWS) / n
    draws = np.abs(weights @ amplitude) ** 2 / 2.0 - scatter / (2.0 * n)
    square = np.abs(mean) ** 2 / 2.0
    line_hz = np.arange(mean.size) / (size * record.step)
    return (
        np.arange(mean.size),
        square - scatter / (2.0 * n),
        p_value,
        draws,
        square,
        np.column_stack([line_hz, line_hz]),
    )


def _band_table(record: ElementRecord, residual: FloatArray, variance: float) -> _Table:
    """The same of every band; order is the number of the band's middle in steps of the lowest."""
    length = int((record.block == 0).sum())
    edges = np.concatenate(
        [[0.0], np.geomspace(1.5 / (length * record.step), 0.5001 / record.step, _BANDS)]
    )
    squares = block_squares(record, residual, edges)
    frequency = np.fft.rfftfreq(length, record.step)
    lines = 2.0 * np.histogram(frequency, edges)[0] * record.n_blocks
    used = lines > 0
    samples = max(int((record.block >= 0).sum()), 1)
    power = squares.sum(axis=0)[used]
    noise = variance * lines[used]
    p_value = chi2.sf(power / max(variance, np.finfo(float).tiny), lines[used])
    weights = np.random.default_rng(_SEED).multinomial(
        record.n_blocks, np.full(record.n_blocks, 1 / record.n_blocks), _DRAWS
    )
    draws = (weights @ squares[:, used] - noise) / samples
    bands = np.column_stack([edges[:-1], edges[1:]])[used]
    order = bands.mean(axis=1) * length * record.step
    return order, (power - noise) / samples, p_value, draws, power / samples, bands


def _drawn_shares(draws: FloatArray, others: float) -> FloatArray:
    """Share of every cell in each draw; the other runs stay as they are."""
    total = draws.sum(axis=1, keepdims=True) + others
    return draws / np.where(total == 0.0, np.nan, total)


def parity_text(cells: Sequence[GapCell], records: Sequence[ElementRecord]) -> str:
    """Parity of the significant lines of the gap.

    Empty where the drive is not periodic or not of odd lines itself.

    Parameters
    ----------
    cells : sequence of GapCell
        Gap map.
    records : sequence of ElementRecord
        Runs.
    """
    seen = [cell for cell in cells if cell.p_value < _SIGNIFICANCE and cell.coherent > 0.0]
    if not seen:
        return ""
    record = records[0]
    if not all(own.period for own in records):
        return ""
    first = int(np.argmax(record.counts))
    power = np.abs(np.fft.rfft(record.drive[first : first + record.period])[1:]) ** 2
    odd_drive = power[0::2].sum() / power.sum()
    if odd_drive < 1.0 - _NOT_DRIVEN:
        return ""
    lines = [(int(cell.order), cell.coherent) for cell in seen if cell.order >= 1]
    odd = sum(value for line, value in lines if line % 2) / max(
        sum(value for _, value in lines), np.finfo(float).tiny
    )
    if odd >= _PURE:
        return "on odd lines: the missing law is odd"
    return (
        "on even lines: the missing law is even" if odd <= 1.0 - _PURE else "on odd and even lines"
    )
