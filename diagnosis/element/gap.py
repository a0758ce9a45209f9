"""The gap of an element: its map, findings about it, and loops for the report.

Where it lies, by block in time, what does not repeat from period to period, how the unexplained
force grows with the deflection, scalars; the force that the baseline leaves along the motion.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import chi2
from scipy.stats import f as fisher_f
from scipy.stats import t as student_t

from carrierflex.diagnosis.comparison.effect_names import set_name
from carrierflex.diagnosis.comparison.overlay import Picture, drawn_runs, is_function, loop_panel
from carrierflex.diagnosis.comparison.problem import BASELINE, Effects, FloatArray, GapCell
from carrierflex.diagnosis.element.model import ElementModel, values_by_effect
from carrierflex.diagnosis.element.records import ElementRecord
from carrierflex.diagnosis.element.signatures import (
    Column,
    base_columns,
    column_values,
    known_force,
)
from carrierflex.diagnosis.gap.findings import (
    BAND,
    CLEAR,
    EVEN,
    LINES,
    NO_ODD_DRIVE,
    NO_PERIODIC_DRIVE,
    ODD,
    ODD_AND_EVEN,
    Exponent,
    Finding,
    GapFindings,
    PartGrowth,
    Scalar,
    exponents,
    undetermined,
)
from carrierflex.diagnosis.gap.gap_map import (
    CellTable,
    band_amplitudes,
    band_edges_hz,
    block_powers,
    drawn_counts,
    gap_cells,
    largest_cells,
    significant,
)
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
from carrierflex.identification.estimation.scaled_least_squares import design_solution

_SCATTER_BANDS = 12
#: Even (or odd) lines count as not driven below this share of the drive's power.
_NOT_DRIVEN = 0.01
#: The gap counts as odd, or even, from this share on lines of that parity.
_PURE = 0.9
DEFLECTION, SPEED = "deflection", "speed"
#: Share of the blocks, those of the lowest amplitude, that the linear element is fitted to.
_LOW_AMPLITUDE = 1.0 / 8.0
#: Growth is determined where the deflection of the blocks spans at least this factor.
_SPAN = 2.0
_FEWEST_POINTS = 5
#: Exponents that the search starts from, and their bounds.
_STARTS = (0.3, 1.5, 2.5, 4.0)
_LOW = -1.0
_HIGH = 8.0
_NOISE_SEED = 5
_MAP_BANDS = 24


@dataclass(frozen=True, eq=False)
class _BlockForces:
    """RMS by block of all records."""

    deflection: FloatArray
    speed: FloatArray
    residual: FloatArray
    noise: FloatArray
    low_deflection: float
    n_low: int  # Blocks of low amplitude, to which the baseline is fitted


@dataclass(frozen=True, eq=False)
class ElementGap:
    """Gap of a model of an element: its map, findings and scalars."""

    model: ElementModel  # Parameters and simulator
    records: Sequence[ElementRecord]  # Runs
    residuals: Sequence[FloatArray]  # Gap of every run, shape (n,)
    #: Whether the noise is declared: that of repeats says nothing of their scatter
    is_declared: bool

    @property
    def channel(self) -> str:
        """Name of the channel."""
        return self.model.channels[0]

    @cached_property
    def cells(self) -> Sequence[GapCell]:
        """Gap map, largest cell first.

        Periodic drive with two periods or more: by line k, with the amplitudes ``E_r`` of R periods
        and their scatter s², coherent part ``|mean|²/2 - s²/2R``, test
        ``R |mean|²/s² ~ F(2, 2R - 2)``. Otherwise by band of frequency against the noise floor,
        ``power / noise ~ chi²``.
        """
        tables = []
        for record, residual in zip(self.records, self.residuals, strict=True):
            periods = record.by_period(residual)
            if periods is None:
                tables.append(_band_table(record, residual, self.channel))
            else:
                tables.append(_line_table(record, periods, self.channel))
        return gap_cells(tables)

    def findings(self) -> GapFindings:
        """Where the gap lies, in time, what does not repeat, growth and parity of an element."""
        trends: list[DriftTable] = []
        scattered: list[ScatterTable] = []
        for record, residual in zip(self.records, self.residuals, strict=True):
            trends.append(_drifts(record, residual, self.channel))
            of_channel = record.noise if self.is_declared else float("nan")
            scattered += _scatter(record, residual, self.channel, of_channel)
        rows = significant_non_synchronous(scattered)
        blocks = _block_forces(self.model, self.records)
        exponent = _growth_exponent(blocks)
        # With speed at equal deflection, where the blocks tell the two apart.
        is_clear = blocks.residual > CLEAR * blocks.noise
        size = np.sqrt(np.maximum(blocks.residual**2 - blocks.noise**2, 0.0))[is_clear]
        motion = {DEFLECTION: blocks.deflection[is_clear], SPEED: blocks.speed[is_clear]}
        of_speed = exponents(size, blocks.noise[is_clear], motion)[SPEED]
        return GapFindings(
            where=_where(self.cells, "deflection" if self.model.by_force else "force", exponent),
            numbered_by=LINES,
            in_time=block_rms(self.records, self.residuals),
            drifts=significant_drifts(trends),
            non_synchronous=rows,
            repeatability=repeatability(rows, sum(cell.coherent for cell in self.cells), "period"),
            growth=(
                PartGrowth(self.channel, float("nan"), "", {DEFLECTION: exponent, SPEED: of_speed}),
            ),
            parity=_parity(self.cells, self.records),
        )

    def scalars(self) -> tuple[Scalar, ...]:
        """Peak to peak and RMS of the channel by block, measured and predicted."""
        blocks = [
            [signal[record.block == block] for signal in (record.response, record.response - gap)]
            for record, gap in zip(self.records, self.residuals, strict=True)
            for block in range(record.n_blocks)
        ]
        measured, predicted = zip(*blocks, strict=True)
        return tuple(
            Scalar(
                name,
                self.model.response_unit,
                np.array([size(block) for block in measured]),
                np.array([size(block) for block in predicted]),
            )
            for name, size in (
                ("peak to peak", np.ptp),
                ("RMS", lambda block: np.sqrt(np.mean(block**2))),
            )
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


def _parity(cells: Sequence[GapCell], records: Sequence[ElementRecord]) -> str:
    """Parity of the missing law, or why the lines do not tell it."""
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


def _drifts(record: ElementRecord, residual: FloatArray, channel: str) -> DriftTable:
    """Trends of the lines over the periods."""
    periods = record.by_period(residual)
    if periods is not None:
        amplitudes = _line_amplitudes(periods)
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
    )


def _scatter(
    record: ElementRecord, residual: FloatArray, channel: str, variance: float
) -> list[ScatterTable]:
    """Scatter of the lines over the periods, by band of lines."""
    periods = record.by_period(residual)
    measured = record.by_period(record.response)
    if periods is None or measured is None:
        return []
    n, size = periods.shape
    n_lines = (size + 1) // 2 - 1
    edges = np.unique(np.geomspace(1, n_lines + 1, _SCATTER_BANDS + 1).round().astype(int))
    counts = np.diff(edges)

    def scatter(signals: FloatArray) -> FloatArray:
        """Power of the scatter between periods, by band, shape (1, n_bands)."""
        by_line = 0.5 * _line_amplitudes(signals).var(axis=0, ddof=1)
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


def _growth_exponent(blocks: _BlockForces) -> Exponent:
    """Exponent p of ``unexplained force ~ deflection^p`` over the blocks.

    The baseline is fitted to the low-amplitude blocks, of deflection g. It takes up what a linear
    element can of the law there, so that the residual of a block of deflection q is ``r² =
    f² + c² (s q^2p + (1 - s)(q^p - g^(p-1) q)²)``: a floor f between the noise and the residual of
    the low-amplitude blocks, the share s that no linear element takes up, and what the linear share
    has grown since. c, s, p and f are fitted to log r.
    """
    n = len(blocks.residual)
    if np.count_nonzero(blocks.residual > CLEAR * blocks.noise) < _FEWEST_POINTS:
        return undetermined(n, "no unexplained force is above the noise")
    if np.ptp(np.log(blocks.deflection)) < np.log(_SPAN):
        return undetermined(n, "deflection does not vary")
    q = blocks.deflection / blocks.low_deflection
    size = float(np.median(blocks.residual))
    noise = (blocks.noise / size) ** 2
    target = np.log(np.maximum(blocks.residual / size, 1e-12))
    lowest = (np.sort(blocks.residual)[: blocks.n_low].max() / size) ** 2
    highest_floor = max(lowest - float(noise.min()), 0.0)

    def squares(unknown: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Squares of the law by amplitude, and their derivatives by the unknowns, (4, n)."""
        log_c, share, p, raised = unknown
        power, linear = q**p, q**p - q
        factor = np.exp(2.0 * log_c)
        law = factor * (share * power**2 + (1.0 - share) * linear**2)
        by_share = factor * (power**2 - linear**2)
        by_p = 2.0 * factor * np.log(q) * power * (share * power + (1.0 - share) * linear)
        by_floor = np.full(n, highest_floor)
        square = noise + raised * highest_floor + law + 1e-12
        return square, np.array([2.0 * law, by_share, by_p, by_floor])

    def misfit(unknown: FloatArray) -> FloatArray:
        """Logarithm of the law over the measured gap, by amplitude."""
        return np.asarray(0.5 * np.log(squares(unknown)[0]) - target)

    def derivatives(unknown: FloatArray) -> FloatArray:
        """Those of the misfit by the unknowns, shape (n, 4)."""
        square, by_unknown = squares(unknown)
        return np.asarray((0.5 * by_unknown / square).T)

    bounds = ([-40.0, 1e-4, _LOW, 0.0], [40.0, 1.0, _HIGH, 1.0])
    fits = []
    for p in _STARTS:
        level = float(np.median(target) - p * np.log(np.median(q)))
        start = [np.clip(level, -39.0, 39.0), 0.4, p, 0.1]
        fits.append(least_squares(misfit, start, derivatives, bounds, loss="soft_l1", f_scale=0.2))
    best = min(fits, key=lambda fit: float(fit.cost))
    covariance = np.linalg.pinv(best.jac.T @ best.jac)
    degrees = n - best.x.size
    std = float(np.sqrt(covariance[2, 2] * np.sum(misfit(best.x) ** 2) / degrees))
    value = float(best.x[2])
    half = float(student_t(degrees).ppf(0.975)) * std
    p_value = float(2.0 * student_t(degrees).sf(abs(value) / std)) if std > 0.0 else 0.0
    return Exponent(value, (value - half, value + half), p_value, n)


def _block_forces(model: ElementModel, records: Sequence[ElementRecord]) -> _BlockForces:
    """Unexplained force of every block."""
    blocks = [
        (r, record.block == b) for r, record in enumerate(records) for b in range(record.n_blocks)
    ]
    columns = [record.where_flat(base_columns(model, record)) for record in records]
    force = [record.where_flat(known_force(model, record)) for record in records]
    deflection = np.array([records[r].motion[0][samples].std() for r, samples in blocks])
    speed = np.array([records[r].motion[1][samples].std() for r, samples in blocks])
    n_low = max(2, round(_LOW_AMPLITUDE * len(blocks)))
    low = np.argsort(deflection)[:n_low]
    design = np.concatenate([columns[blocks[k][0]][:, blocks[k][1]] for k in low], axis=1)
    target = np.concatenate([force[blocks[k][0]][blocks[k][1]] for k in low])
    law = design_solution(design.T, target)
    residuals = [f - law @ rows for f, rows in zip(force, columns, strict=True)]
    floor = [_force_noise(model, record, law) for record in records]
    return _BlockForces(
        deflection=deflection,
        speed=speed,
        residual=np.array([np.sqrt(np.mean(residuals[r][samples] ** 2)) for r, samples in blocks]),
        noise=np.array([floor[r] for r, _ in blocks]),
        low_deflection=float(np.sqrt(np.mean(deflection[low] ** 2))),
        n_low=n_low,
    )


def _force_noise(model: ElementModel, record: ElementRecord, law: FloatArray) -> float:
    """RMS of the channel's noise, brought to force space by the fitted element."""
    if not model.by_force:
        return float(np.sqrt(record.noise * min(2.0 * record.flat_hz * record.step, 1.0)))
    white = np.sqrt(record.noise) * np.random.default_rng(_NOISE_SEED).standard_normal(
        record.response.size
    )
    q, v, a = record.with_response(white).motion
    rows = [q, v] if model.mass is not None else [a, q, v]
    force = (model.mass or 0.0) * a + law[: len(rows)] @ np.array(rows)
    return float(np.std(record.where_flat(force)))


def _line_amplitudes(periods: FloatArray) -> NDArray[np.complex128]:
    """Amplitudes of the lines 0, 1, ... of every period, shape (n_periods, n_lines)."""
    size = periods.shape[1]
    amplitudes = np.fft.rfft(periods, axis=1)[:, : (size + 1) // 2] * (2.0 / size)
    amplitudes[:, 0] *= 0.5
    return amplitudes


def _line_table(record: ElementRecord, periods: FloatArray, channel: str) -> CellTable:
    """Lines of one run; the mean square of line 0 is its square, of the others half of it."""
    n = len(periods)
    amplitudes = _line_amplitudes(periods)
    amplitudes[:, 0] *= np.sqrt(2.0)
    lines = np.arange(amplitudes.shape[1])
    mean = amplitudes.mean(axis=0)
    scatter = amplitudes.var(axis=0, ddof=1)
    degrees = np.where(lines == 0, 1.0, 2.0)
    ratio = n * np.abs(mean) ** 2 / np.maximum(scatter, np.finfo(float).tiny)
    weights = drawn_counts(n) / n
    noise = scatter / (2.0 * n)
    mean_square = np.abs(mean) ** 2 / 2.0
    line_hz = lines / (record.period * record.step)
    return CellTable(
        runs=(record.name,),
        patterns=(channel,),
        orders=lines.astype(np.float64),
        mean_square=mean_square[None, None],
        coherent=(mean_square - noise)[None, None],
        p_value=fisher_f.sf(ratio, degrees, degrees * (n - 1))[None, None],
        draws=lambda: (np.abs(weights @ amplitudes) ** 2 / 2.0 - noise)[:, None, None],
        bands_hz=np.column_stack([line_hz, line_hz]),
    )


def _band_table(record: ElementRecord, residual: FloatArray, channel: str) -> CellTable:
    """Bands of one run; order is the number of the band's middle in steps of the lowest line."""
    length = int((record.block == 0).sum())
    edges_hz = band_edges_hz(length * record.step, 0.5001 / record.step, _MAP_BANDS)
    per_block = band_amplitudes(length, record.step, edges_hz)
    is_filled = per_block.any(axis=1)
    # Two amplitudes a line: the mean and half the sampling frequency count like the others.
    lines = 2.0 * (per_block > 0.0).sum(axis=1)[is_filled] * record.n_blocks
    squares = block_powers(residual[:, None], record.block, record.step, edges_hz)[:, 0][
        :, is_filled
    ]
    n_samples = max(int((record.block >= 0).sum()), 1)
    power = squares.sum(axis=0)
    noise = record.noise * lines
    counts = drawn_counts(record.n_blocks)
    bands_hz = np.column_stack([edges_hz[:-1], edges_hz[1:]])[is_filled]
    return CellTable(
        runs=(record.name,),
        patterns=(channel,),
        orders=bands_hz.mean(axis=1) * length * record.step,
        mean_square=power[None, None] / n_samples,
        coherent=(power - noise)[None, None] / n_samples,
        p_value=chi2.sf(power / max(record.noise, np.finfo(float).tiny), lines)[None, None],
        draws=lambda: ((counts @ squares - noise) / n_samples)[:, None, None],
        bands_hz=bands_hz,
    )


def element_loops(
    model: ElementModel, records: Sequence[ElementRecord], effects: Effects, theta: FloatArray
) -> tuple[Picture, ...]:
    """Unexplained force over deflection and over speed, the largest run of each condition.

    ``f_left = f_measured - (m q'' + C1 q' + K1 q + f0 + contained effects)`` along the measured
    motion, in the trusted band; the law is the force of the effects along the same motion.
    Over the speed too, unless the fitted law is a function of the deflection.
    """
    values = values_by_effect(model.parameters(effects), theta)

    base = values[BASELINE]

    def force_of(record: ElementRecord, effect: str) -> FloatArray:
        fitted = values[effect]
        if effect == "sensor_delay":
            return fitted["delay"] * column_values(model, record, Column(effect, "delay", {}, ()))
        if effect == "backlash":
            # Its column is per unit of the stiffness that is missing within the gap.
            return base["K1"] * column_values(model, record, Column(effect, "K1", fitted, ()))
        return model.signature(record, effect, fitted)

    gaps = []
    for record in records:
        q, v, a = record.motion
        # A given mass is in the known force already.
        baseline = base.get("m", 0.0) * a + base["C1"] * v + base["K1"] * q + base["f0"]
        for effect in model.contained:
            baseline = baseline + force_of(record, effect)
        gaps.append(record.where_flat(known_force(model, record) - baseline))
    sizes = [float(np.std(gap[record.counts])) for gap, record in zip(gaps, records, strict=True)]
    runs = []
    for k in drawn_runs(sizes, [record.condition for record in records]):
        forces = [force_of(records[k], effect) for effect in effects]
        runs.append((records[k], gaps[k], np.sum(forces, axis=0) if effects else None))
    pictures = [_picture(model, runs, effects, against=0)]
    if not all(law is not None and is_function(record.motion[0], law) for record, _, law in runs):
        pictures.append(_picture(model, runs, effects, against=1))
    return tuple(pictures)


def _picture(
    model: ElementModel,
    runs: Sequence[tuple[ElementRecord, FloatArray, FloatArray | None]],
    effects: Effects,
    *,
    against: int,
) -> Picture:
    """Clouds over deflection (0) or speed (1), shaded by the other of the two."""
    names = (("deflection", model.units[1]), ("speed", f"{model.units[1]}/s"))
    panels = []
    for record, lacking, law in runs:
        counts = record.counts
        x, shade = record.motion[against][counts], record.motion[1 - against][counts]
        counted = None if law is None else law[counts]
        panels.append(loop_panel(record.name, x, lacking[counts], shade, law=counted))
    law_text = (
        f"Orange: the fitted law ({set_name(effects)}). "
        if effects
        else "No effect was accepted: no law is drawn. "
    )
    return Picture(
        title=f"Unexplained force over {names[against][0]}",
        caption=(
            "Coloured points: measured force less inertia, linear spring, linear damper and "
            "constant force of the baseline "
            f"along the measured motion. {law_text}A spring law is one line over deflection, a "
            "damper law one line over speed; dry friction and relaxation open a loop."
        ),
        x_name=names[against][0],
        x_unit=names[against][1],
        y_name="unexplained force",
        y_unit=model.units[0],
        panels=tuple(panels),
        shade_name=names[1 - against][0],
        shade_unit=names[1 - against][1],
    )
