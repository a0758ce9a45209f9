"""One model's gap on a carrier.

Its map, and beyond it the gap in time, what does not repeat, growth, and scalars.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from scipy.stats import chi2
from scipy.stats import f as fisher_f

from carrierflex.diagnosis.carrier.classes.answer import CONSTANT_SHAPES
from carrierflex.diagnosis.carrier.gap_components import (
    RADIAL_LOAD,
    SMALLEST_NAMED,
    SPEED,
    TORQUE,
    GapComponents,
    components_of,
)
from carrierflex.diagnosis.carrier.off_order_lines import OffOrderLine, OffOrders
from carrierflex.diagnosis.carrier.records.columns import mean_speed
from carrierflex.diagnosis.carrier.records.sums import CarrierSums
from carrierflex.diagnosis.comparison.problem import BoolArray, Effects, GapCell, IntArray
from carrierflex.diagnosis.gap.findings import (
    LINE,
    SMALL_ORDER,
    Finding,
    GapFindings,
    GapMoment,
    NonSynchronousCell,
    Scalar,
)
from carrierflex.diagnosis.gap.findings import ORDERS as SHAFT_ORDERS
from carrierflex.diagnosis.gap.gap_map import N_DRAWS, CellTable, gap_cells, map_of
from carrierflex.diagnosis.gap.in_time import (
    DriftTable,
    ScatterTable,
    repeatability,
    scatter_p_values,
    scatter_p_values_estimated,
    significant_drifts,
    significant_non_synchronous,
    sliding_rms,
    trend,
)
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.revolutions import whole_revolutions
from carrierflex.identification.carrier.sensor_patterns import (
    RADIAL,
    ComplexArray,
    FloatArray,
    PatternSplit,
    pattern_split,
)
from carrierflex.identification.estimation.resampling import multinomial_counts
from carrierflex.simulation.carrier.measured_laws.rim_patterns import RIM_PATTERNS
from carrierflex.simulation.carrier.run_cases import AXIAL

#: Seeds of the draws of the cells, on the orders and off them.
_SEED, _SEED_OFF_ORDERS = 3, 5


@dataclass(frozen=True, eq=False)
class CarrierGap:
    """Residual of one model by revolution."""

    campaign: Campaign  # Channels and runs
    records: CarrierSums  # Orders of the measured signals, scatter off them, loads
    noise: FloatArray  # Variance of the noise of every channel [m²], shape (C,)
    residual: ComplexArray  # Order amplitudes of the residual, 0 to n, shape (R, C, n + 1)
    motion: OffOrders  # Lines and bands off the orders, which are not in `records`
    fitted: Effects = ()  # Effects whose sizes are fitted

    @cached_property
    def cells(self) -> Sequence[GapCell]:
        """Gap map, largest share first."""
        return _gap_cells(
            self.campaign.channels,
            self.residual,
            [run.name for run in self.campaign.runs],
            self.records.run_of_revolution,
            self.noise.mean() / self._samples,
            tuple(_off_order_tables(self.motion)),
        )

    @cached_property
    def conditions(self) -> dict[str, dict[str, float]]:
        """Mean torque, radial load and speed of every run, sizes."""
        sizes: dict[str, dict[str, float]] = {TORQUE: {}, RADIAL_LOAD: {}, SPEED: {}}
        for r, run in enumerate(self.campaign.runs):
            torque, y, z = self.records.mean_loads[r]
            sizes[TORQUE][run.name] = abs(float(torque))
            sizes[RADIAL_LOAD][run.name] = float(np.hypot(y, z))
            sizes[SPEED][run.name] = abs(mean_speed(run))
        return sizes

    def findings(self) -> GapFindings:
        """Where the gap lies, in time, what does not repeat, growth with the loads."""
        moments: list[GapMoment] = []
        trends: list[DriftTable] = []
        scattered: list[ScatterTable] = []
        off_orders: list[NonSynchronousCell] = []
        for r, run in enumerate(self.campaign.runs):
            revolutions = self._by_run[r]
            if not revolutions.size:
                continue
            split, measured = self._splits(revolutions)
            samples = whole_revolutions(run).samples
            first = int(np.argmax(self.records.run_of_revolution == r))
            time = np.array([run.time[samples[k - first]].mean() for k in revolutions])
            moments += sliding_rms(run.name, time, self._mean_squares(revolutions))
            trends.append(_drifts(run.name, time, split))
            if revolutions.size > 1:
                scattered.append(self._scatter(r, split, measured))
            off_orders += self._off_orders(r)
        rows = significant_non_synchronous(scattered, off_orders)
        repeated = significant_non_synchronous(self._repeats())
        coherent = sum(cell.coherent for cell in self.cells)
        components = GapComponents(
            components_of(map_of(self.cells).on_orders()),
            self.conditions,
            int(self.campaign.rig["n_planets"]),
            sorted({CONSTANT_SHAPES.get(one, "") for one in self.fitted} & set(RIM_PATTERNS)),
        )
        where = (*components.where(), *self._lines(coherent))
        return GapFindings(
            where=tuple(
                sorted(where, key=lambda finding: (finding.kind == SMALL_ORDER, -finding.share))
            ),
            numbered_by=SHAFT_ORDERS,
            in_time=tuple(moments),
            drifts=significant_drifts(trends),
            non_synchronous=(*rows, *repeated),
            repeatability=(
                *repeatability(rows, coherent, "revolution"),
                *repeatability(repeated, coherent, "repeat"),
            ),
            growth=components.growth(),
        )

    def scalars(self) -> tuple[Scalar, ...]:
        """Static tilt, tilt at 1X, radial 1X and peak to peak by revolution."""
        channels = self.campaign.channels
        target = self.records.orders
        is_complete = np.isfinite(target).all(axis=(1, 2))
        is_complete &= np.isfinite(self.residual).all(axis=(1, 2))
        if not is_complete.any():
            return ()
        both = target[is_complete], (target - self.residual)[is_complete]
        splits = [pattern_split(channels, orders) for orders in both]
        scalars = []
        for name, pattern, order, factor in (
            ("static tilt at the rim", "m=+1", 0, 2.0),
            ("1X axial", "m=+1", 1, 1.0),
            ("1X radial", RADIAL, 1, 1.0),
        ):
            if pattern in splits[0].names:
                zero = splits[0].amplitudes.shape[-1] // 2
                cell = (..., splits[0].names.index(pattern), zero + order)
                sizes = (factor * np.abs(split.amplitudes[cell]) for split in splits)
                scalars.append(Scalar(name, "m", *sizes))
        axial = [c for c, channel in enumerate(channels) if channel.quantity == AXIAL]
        if axial:
            spans = (_peak_to_peak(orders[:, axial]) for orders in both)
            scalars.append(Scalar("axial peak to peak", "m", *spans))
        return tuple(scalars)

    @cached_property
    def _samples(self) -> FloatArray:
        """Samples of a revolution, by run."""
        samples = self.records.within[..., 1].mean(axis=1) + self._n_fitted
        runs = range(len(self.campaign.runs))
        return np.array(
            [max(float(samples[self.records.run_of_revolution == r].mean()), 1.0) for r in runs]
        )

    @property
    def _n_fitted(self) -> int:
        """Unknowns of the orders of one revolution."""
        return 2 * self.residual.shape[-1] - 1

    @cached_property
    def _by_run(self) -> list[IntArray]:
        """Revolutions of every run in which every channel was measured."""
        n_runs = len(self.campaign.runs)
        return _complete_revolutions(self.residual, self.records.run_of_revolution, n_runs)

    def _splits(self, revolutions: IntArray) -> tuple[PatternSplit, PatternSplit]:
        """Patterns of the residual and of what was measured in some revolutions."""
        # Those of all runs would take four times as much as their order amplitudes.
        channels = self.campaign.channels
        return (
            pattern_split(channels, self.residual[revolutions]),
            pattern_split(channels, self.records.orders[revolutions]),
        )

    def _mean_squares(self, revolutions: IntArray) -> FloatArray:
        """Mean square over the channels by revolution, orders and what lies off them [m²]."""
        weight = np.where(np.arange(self.residual.shape[-1]) == 0, 1.0, 0.5)
        of_orders = (np.abs(self.residual[revolutions]) ** 2 * weight).sum(axis=2)
        square, degrees = np.moveaxis(self.records.within[revolutions], 2, 0)
        off_orders = square / np.maximum(degrees + self._n_fitted, 1.0)
        return np.asarray((of_orders + off_orders).mean(axis=1), dtype=np.float64)

    def _scatter(self, run: int, split: PatternSplit, measured: PatternSplit) -> ScatterTable:
        """Scatter of one run against the noise that is declared, or measured off the orders."""
        gap_amplitudes, amplitudes = split.amplitudes, measured.amplitudes
        is_declared = all(channel.noise_std is not None for channel in self.campaign.channels)
        variance, degrees_off = self._off_variance(run)
        by_channel = self.noise if is_declared else variance
        by_pattern = np.array([by_channel[list(members)].mean() for members in split.members])
        noise = split.noise * by_pattern[:, None] / self._samples[run]
        gap = split.weights * gap_amplitudes.var(axis=0, ddof=1)
        degrees = _degrees_of(gap_amplitudes) * (len(amplitudes) - 1)
        if is_declared:
            p_value = scatter_p_values(gap, noise, degrees)
        else:
            p_value = scatter_p_values_estimated(gap, noise, degrees, float(degrees_off.sum()))
        return ScatterTable(
            run=self.campaign.runs[run].name,
            patterns=split.names,
            orders=_signed_orders(split.amplitudes),
            measured=split.weights * amplitudes.var(axis=0, ddof=1),
            simulated=split.weights * (amplitudes - gap_amplitudes).var(axis=0, ddof=1),
            gap=gap,
            noise=noise,
            p_value=p_value,
            used=_single_cells(split),
        )

    def _repeats(self) -> list[ScatterTable]:
        """Runs of one condition: ``F = var(mean of a run) / mean(s² / R)``, with noise below."""
        groups: dict[str, list[int]] = {}
        for r, run in enumerate(self.campaign.runs):
            if self._by_run[r].size > 1:
                groups.setdefault(run.condition, []).append(r)
        return [self._repeats_of(runs) for runs in groups.values() if len(runs) > 1]

    def _repeats_of(self, runs: list[int]) -> ScatterTable:
        """Scatter of runs of one condition."""
        revolutions = [self._by_run[r] for r in runs]
        means: dict[str, list[ComplexArray]] = {"gap": [], "measured": [], "simulated": []}
        within, degrees_of_runs = [], []
        for rows in revolutions:
            split, measured = self._splits(rows)
            means["gap"].append(split.amplitudes.mean(axis=0))
            means["measured"].append(measured.amplitudes.mean(axis=0))
            means["simulated"].append((measured.amplitudes - split.amplitudes).mean(axis=0))
            within.append(split.amplitudes.var(axis=0, ddof=1) / rows.size)
            degrees_of_runs.append(_degrees_of(split.amplitudes))
        # Variance between the means of the runs, by cell.
        scatter = {
            name: np.asarray(split.weights * np.var(of_runs, axis=0, ddof=1), dtype=np.float64)
            for name, of_runs in means.items()
        }
        noise = split.weights * np.mean(within, axis=0)
        degrees = np.max(degrees_of_runs, axis=0)
        noise_degrees = degrees * sum(rows.size - 1 for rows in revolutions)
        return ScatterTable(
            run=" and ".join(self.campaign.runs[r].name for r in runs),
            patterns=split.names,
            orders=_signed_orders(split.amplitudes),
            **scatter,
            noise=noise,
            p_value=scatter_p_values_estimated(
                scatter["gap"], noise, degrees * (len(runs) - 1), noise_degrees
            ),
            used=_single_cells(split),
        )

    def _off_variance(self, run: int) -> tuple[FloatArray, FloatArray]:
        """Variance off the orders by channel, and its degrees of freedom."""
        square, degrees = self.records.within[self.records.run_of_revolution == run].sum(axis=0).T
        return square / np.maximum(degrees, 1.0), degrees

    def _off_orders(self, run: int) -> list[NonSynchronousCell]:
        """Mean square off the orders by channel; what the model has there is neglected."""
        variance, degrees = self._off_variance(run)
        n_channels = len(self.campaign.channels)
        cells = []
        for c, channel in enumerate(self.campaign.channels):
            is_declared = channel.noise_std is not None and degrees[c] > 0.0
            p_value = scatter_p_values(variance[c], self.noise[c], degrees[c])
            cells.append(
                NonSynchronousCell(
                    run=self.campaign.runs[run].name,
                    channel_pattern=channel.name,
                    order=None,
                    measured=float(variance[c]) / n_channels,
                    simulated=0.0,
                    gap=float(variance[c]) / n_channels,
                    noise=float(self.noise[c]) / n_channels,
                    p_value=float(p_value) if is_declared else float("nan"),
                )
            )
        return cells

    def _lines(self, coherent: float) -> Iterator[Finding]:
        """Motions off the orders that are worth naming, of a gap of so much coherent square."""
        for motion in self.motion.motions:
            share = sum(motion.mean_square.values()) / coherent if coherent > 0.0 else 0.0
            if share >= SMALLEST_NAMED:
                yield Finding(
                    kind=LINE,
                    patterns=motion.channels,
                    share=share,
                    runs=motion.runs,
                    is_in_every_run=motion.is_in_every_run
                    and len(motion.runs) == len(self.campaign.runs),
                    band_hz=motion.band_hz,
                    p_value=motion.p_value,
                    line=motion.label,
                    place=motion.place,
                )


def _single_cells(split: PatternSplit) -> BoolArray:
    """Cells that exist, the two halves of a static tilt once, shape (n_patterns, n_orders)."""
    used = split.weights > 0.0
    if "m=-1" in split.names:
        used[split.names.index("m=-1"), used.shape[1] // 2] = False
    return used


def _drifts(run: str, time: FloatArray, split: PatternSplit) -> DriftTable:
    """Trends of every cell of a run, with their share of the cell's mean square."""
    amplitudes = split.amplitudes
    over_run = trend(time, amplitudes)
    mean_square = np.mean(np.abs(amplitudes) ** 2, axis=0)
    return DriftTable(
        run=run,
        patterns=split.names,
        orders=_signed_orders(amplitudes),
        change=over_run.change,
        share=over_run.mean_square / np.where(mean_square > 0.0, mean_square, np.nan),
        p_value=over_run.p_value,
        used=_single_cells(split) & (mean_square > 0.0),
    )


def _peak_to_peak(orders: ComplexArray) -> FloatArray:
    """Mean over channels of largest less smallest value of each revolution, shape (R,)."""
    angle = np.linspace(0.0, 2.0 * np.pi, 128, endpoint=False)
    waves = np.exp(1j * np.outer(np.arange(orders.shape[-1]), angle))
    # One channel at a time: the turns of 64 sensors in 500 runs are 0.7 GB.
    spans = [np.ptp((of_channel @ waves).real, axis=1) for of_channel in orders.swapaxes(0, 1)]
    return np.asarray(np.mean(spans, axis=0), dtype=np.float64)


def _gap_cells(
    channels: Sequence[Channel],
    residual_orders: ComplexArray,
    runs: Sequence[str],
    run_of_revolution: IntArray,
    noise_of_mean: FloatArray,
    off_orders: Sequence[CellTable] = (),
) -> Sequence[GapCell]:
    """Gap map of a residual by run, sensor pattern and shaft order, largest cell first.

    ``coherent = w (|mean|² - s²/R)`` over the R complete revolutions of a run, test ``R |mean|²/s²
    ~ F(d, d (R - 1))``; with one revolution the noise of a channel's order stands for s:
    `noise_of_mean`, shape (n_runs,), is its variance in a mean over the channels [m²].
    """
    revolutions = _complete_revolutions(residual_orders, run_of_revolution, len(runs))
    tables = [
        _run_table(run, channels, residual_orders, rows, noise)
        for run, rows, noise in zip(runs, revolutions, noise_of_mean.tolist(), strict=True)
        if rows.size
    ]
    return gap_cells([*tables, *off_orders])


def _complete_revolutions(
    orders: ComplexArray, run_of_revolution: IntArray, n_runs: int
) -> list[IntArray]:
    """Revolutions of every run in which every channel was measured."""
    complete = np.isfinite(orders).all(axis=(1, 2))
    return [np.flatnonzero(complete & (run_of_revolution == r)) for r in range(n_runs)]


def _signed_orders(amplitudes: ComplexArray) -> FloatArray:
    """Orders -n to n of a pattern's amplitudes, shape (..., 2 n + 1)."""
    highest = amplitudes.shape[-1] // 2
    return np.arange(-highest, highest + 1, dtype=np.float64)


def _degrees_of(amplitudes: ComplexArray) -> FloatArray:
    """Degrees of freedom of complex amplitudes, shape (R, ...), along the first axis."""
    return np.where(np.abs(amplitudes.imag).max(axis=0) == 0.0, 1.0, 2.0)


def _run_table(
    run: str, channels: Sequence[Channel], orders: ComplexArray, rows: IntArray, noise: float
) -> CellTable:
    """Cells of one run with the patterns of its R revolutions."""

    def patterns() -> PatternSplit:
        # Those of all runs would take four times as much as their orders.
        return pattern_split(channels, orders[rows])

    split = patterns()
    weights, amplitudes, tiny = split.weights, split.amplitudes, np.finfo(float).tiny
    n = len(amplitudes)
    mean = amplitudes.mean(axis=0)
    degrees = _degrees_of(amplitudes)
    if n > 1:
        scatter = amplitudes.var(axis=0, ddof=1)
    else:
        scatter = noise * split.noise / np.maximum(weights, tiny)
    ratio = n * np.abs(mean) ** 2 / np.maximum(scatter, tiny)
    if n > 1:
        p_value = fisher_f.sf(ratio, degrees, degrees * (n - 1))
    else:
        p_value = chi2.sf(degrees * ratio, degrees)
    mean_square = weights * np.abs(mean) ** 2
    noise_square = weights * scatter / n

    def draws() -> FloatArray:
        """Coherent part of every draw; the amplitudes of the run are made again for it."""
        counts = multinomial_counts(n, N_DRAWS, seed=_SEED) / n
        drawn = np.einsum("dr,rmn->dmn", counts, patterns().amplitudes)
        return np.asarray(weights * np.abs(drawn) ** 2 - noise_square)[:, None]

    return CellTable(
        runs=(run,),
        patterns=split.names,
        orders=_signed_orders(amplitudes),
        mean_square=mean_square[None],
        coherent=(mean_square - noise_square)[None],
        p_value=p_value[None],
        draws=draws,
        used=weights > 0.0,
    )


def _off_order_tables(motion: OffOrders) -> Iterator[CellTable]:
    """Cells of every run off the orders, each motion at its strongest line; orders are turns."""
    if not motion.lines:
        return
    rng = np.random.default_rng(_SEED_OFF_ORDERS)
    names = tuple(channel.name for channel in motion.campaign.channels)
    used = np.array([[name in one.channels for one in motion.motions] for name in names])
    for number, (run, speed) in enumerate(motion.speeds.items()):
        rows = [_line_rows(lines, number, rng) for lines in motion.lines]
        mean_square, noise, draws = (np.stack(of, axis=-1) for of in zip(*rows, strict=True))
        orders = [[line.order(speed) for line in lines] for lines in motion.lines]
        yield CellTable(
            runs=(run,),
            patterns=names,
            orders=np.array([one[0] for one in orders]),
            mean_square=mean_square[None],
            coherent=(mean_square - noise)[None],
            p_value=np.broadcast_to([one.p_value for one in motion.motions], mean_square.shape)[
                None
            ],
            draws=partial(np.expand_dims, draws, 1),
            bands_hz=np.sort([(speed * min(one), speed * max(one)) for one in orders], axis=1),
            used=used,
        )


def _line_rows(
    lines: Sequence[OffOrderLine], run: int, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mean square, that of noise, and coherent draws of one motion: shapes (C,), (C,), (D, C)."""
    amplitudes = np.array([line.amplitudes[run] for line in lines])
    errors = np.array([line.errors[run] for line in lines])
    n_channels = amplitudes.shape[1]
    scatter = rng.standard_normal((2, N_DRAWS, *amplitudes.shape))
    drawn = amplitudes + errors * (scatter[0] + 1j * scatter[1])
    mean_square = (0.5 * np.abs(amplitudes) ** 2).sum(axis=0) / n_channels
    noise = (errors**2).sum(axis=0) / n_channels
    # A draw holds the noise of the estimate and its own.
    draws = (0.5 * np.abs(drawn) ** 2).sum(axis=1) / n_channels - 2.0 * noise
    return mean_square, noise, draws
