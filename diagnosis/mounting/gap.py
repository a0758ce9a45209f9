"""The gap of a mounting: map by motion and band, findings, scalars, picture."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from scipy.stats import chi2

from carrierflex.diagnosis.comparison.effect_names import set_name
from carrierflex.diagnosis.comparison.overlay import Picture, drawn_runs, loop_panel
from carrierflex.diagnosis.comparison.problem import Effects, FloatArray, GapCell
from carrierflex.diagnosis.gap.findings import (
    CHANNEL,
    CLEAR,
    MOTION,
    MOTION_BANDS,
    NO_PERIODIC_LOADS,
    Finding,
    FollowedLoad,
    GapFindings,
    PartGrowth,
    Scalar,
    exponents,
)
from carrierflex.diagnosis.gap.gap_map import (
    CellTable,
    block_counts,
    block_powers,
    drawn_counts,
    gap_cells,
    largest_cells,
    significant,
)
from carrierflex.diagnosis.gap.in_time import (
    ScatterTable,
    block_rms,
    repeatability,
    scatter_p_values,
    significant_non_synchronous,
)
from carrierflex.diagnosis.kind.problem_in_time import edges_of_bands_hz
from carrierflex.diagnosis.mounting.model import Choice, MountingModel
from carrierflex.diagnosis.mounting.records import MountingRecord
from carrierflex.simulation.mounting.rig import SENSORS

_BANDS = 6
_ROOT = float(np.sqrt(0.5))
#: Orthonormal patterns of the six sensors (so that mean squares add up), in the order of
#: ``SENSORS``.
_PATTERNS: dict[str, tuple[float, ...]] = {
    "roll": (0.0, 0.0, _ROOT, -_ROOT, 0.0, 0.0),
    "vertical": (0.0, 0.0, _ROOT, _ROOT, 0.0, 0.0),
    "yaw": (-_ROOT, _ROOT, 0.0, 0.0, 0.0, 0.0),
    "fore-aft at the side": (_ROOT, _ROOT, 0.0, 0.0, 0.0, 0.0),
    "sideways": (0.0, 0.0, 0.0, 0.0, 1.0, 0.0),
    "fore-aft below": (0.0, 0.0, 0.0, 0.0, 0.0, 1.0),
}
_TORQUE = "torque"
_RADIAL_LOAD = "radial load"
_DEFLECTION = "deflection"
_SPEED = "speed"
#: Runs of one condition are repeats where their loads differ by no more than this share of their
#: size.
_SAME_LOADS = 0.02
#: Correlation with a load from which the gap counts as following it.
_FOLLOWS = 0.8
#: Loads that a gap may follow, by the names of the inputs.
_LOADS = ("torque", "ntl_z", "ntl_y")


def map_edges_hz(records: Sequence[MountingRecord]) -> FloatArray:
    """Ends of the bands of the map [Hz], shape (n_bands + 1,)."""
    return edges_of_bands_hz(records, _BANDS)


@dataclass(frozen=True, eq=False)
class MountingGap:
    """Gap of a model of a mounting: its map, findings and scalars."""

    model: MountingModel  # Parameters and simulator
    records: Sequence[MountingRecord]  # Runs
    #: Gap of every run, zero where nothing was measured, shape (n, n_channels)
    residuals: Sequence[FloatArray]

    @cached_property
    def patterns(self) -> tuple[tuple[str, ...], FloatArray]:
        """Names of the motions, and their matrix over the channels."""
        return _pattern_matrix(self.model.sensors, self.model.channels)

    @cached_property
    def cells(self) -> Sequence[GapCell]:
        """Gap map, largest cell first."""
        names, matrix = self.patterns
        edges_hz = map_edges_hz(self.records)
        n_samples = sum(residual.size for residual in self.residuals)
        powers = []
        expected = []
        counts = []
        draws = []
        for record, residual in zip(self.records, self.residuals, strict=True):
            by_block = block_powers(residual @ matrix.T, record.block, record.step, edges_hz)
            n_lines = _line_counts(record, edges_hz)
            noise = np.multiply.outer(matrix**2 @ record.noise, n_lines)
            # The zero's error is constant over a run: it lies in the lowest band.
            noise[:, 0] += matrix**2 @ record.zero_noise * len(residual)
            weights = drawn_counts(record.n_blocks)
            powers.append(by_block.sum(axis=0))
            expected.append(noise)
            counts.append(np.broadcast_to(np.maximum(n_lines, 1.0), noise.shape))
            draws.append(np.tensordot(weights, by_block, axes=1) - noise)
        power = np.array(powers)
        noise_power = np.array(expected)
        degrees = np.array(counts)
        ratio = power * degrees / np.maximum(noise_power, np.finfo(float).tiny)
        table = CellTable(
            runs=tuple(record.name for record in self.records),
            patterns=names,
            orders=(edges_hz[:-1] + edges_hz[1:]) / edges_hz[1],
            mean_square=power / n_samples,
            coherent=(power - noise_power) / n_samples,
            p_value=chi2.sf(ratio, degrees),
            draws=lambda: np.stack(draws, axis=1) / n_samples,
            bands_hz=np.column_stack([edges_hz[:-1], edges_hz[1:]]),
        )
        return gap_cells([table])

    def findings(self) -> GapFindings:
        """Findings but for trends in time, which loads that change in time make too."""
        pairs = combinations(range(len(self.records)), 2)
        rows = significant_non_synchronous(
            [
                self._difference(one, two)
                for one, two in pairs
                if _are_repeats(self.records[one], self.records[two])
            ]
        )
        return GapFindings(
            where=self._where(),
            numbered_by=MOTION_BANDS,
            in_time=block_rms(self.records, self.residuals),
            non_synchronous=rows,
            repeatability=repeatability(rows, sum(cell.coherent for cell in self.cells), "repeat"),
            growth=self._growth(),
            parity=NO_PERIODIC_LOADS,
        )

    def scalars(self) -> tuple[Scalar, ...]:
        """Mean and peak to peak of every motion by block, measured and predicted [m]."""
        names, matrix = self.patterns
        measured: list[FloatArray] = []
        predicted: list[FloatArray] = []
        for record, residual in zip(self.records, self.residuals, strict=True):
            is_complete = np.asarray(record.is_measured.all(axis=1))
            motion = np.where(is_complete[:, None], record.measured, 0.0) @ matrix.T
            for block in range(record.n_blocks):
                samples = is_complete & (record.block == block)
                if samples.sum() > 1:
                    measured.append(motion[samples])
                    predicted.append(motion[samples] - residual[samples] @ matrix.T)
        if not measured:
            return ()
        scalars = []
        for k, name in enumerate(names):
            for words, size in (("mean", np.mean), ("peak to peak", np.ptp)):
                sizes = np.array([size(block[:, k]) for block in measured])
                predicted_sizes = np.array([size(block[:, k]) for block in predicted])
                scalars.append(Scalar(f"{name}, {words}", "m", sizes, predicted_sizes))
        return tuple(scalars)

    def _where(self) -> tuple[Finding, ...]:
        """Motion with the largest significant gap; empty where no cell is significant."""
        names, matrix = self.patterns
        beyond = significant(self.cells)
        if not beyond:
            return ()
        shares: dict[str, float] = {}
        for cell in beyond:
            shares[cell.channel_pattern] = shares.get(cell.channel_pattern, 0.0) + cell.share
        largest = max(shares, key=lambda name: shares[name])
        most = largest_cells([cell for cell in beyond if cell.channel_pattern == largest])
        bands_hz = [cell.frequency_hz for cell in most if cell.frequency_hz]
        runs = {cell.run for cell in most}
        row = matrix[names.index(largest)]
        finding = Finding(
            kind=MOTION if largest in _PATTERNS else CHANNEL,
            patterns=(largest,),
            share=shares[largest],
            runs=tuple(sorted(runs)),
            is_in_every_run=len(runs) == len(self.records),
            band_hz=(min(low for low, _ in bands_hz), max(high for _, high in bands_hz)),
            follows=_followed_load(self.records, [residual @ row for residual in self.residuals]),
        )
        return (finding,)

    def _difference(self, first: int, second: int) -> ScatterTable:
        """Half of the squared difference of two repeats by motion and band, and its noise."""
        names, matrix = self.patterns
        one, two = self.records[first], self.records[second]
        is_in_both = one.is_measured & two.is_measured
        edges_hz = map_edges_hz(self.records)

        def half_square(difference: FloatArray) -> FloatArray:
            """Half the power of a difference of two runs, by band, per sample."""
            motion = np.where(is_in_both, difference, 0.0) @ matrix.T
            powers = block_powers(motion, one.block, one.step, edges_hz)
            return np.asarray(0.5 * powers.sum(axis=0) / is_in_both.size, dtype=np.float64)

        measured = one.measured - two.measured
        gap = self.residuals[first] - self.residuals[second]
        n_lines = _line_counts(one, edges_hz)
        noise = np.multiply.outer(matrix**2 @ (one.noise + two.noise) / 2.0, n_lines)
        zero_noise = matrix**2 @ (one.zero_noise + two.zero_noise) / 2.0
        # The zero's error is constant over a run: it lies in the lowest band.
        noise[:, 0] += zero_noise * is_in_both.all(axis=1).sum()
        noise /= is_in_both.size
        gap_square = half_square(gap)
        degrees = np.broadcast_to(np.maximum(n_lines, 1.0), noise.shape)
        return ScatterTable(
            run=f"{one.name} and {two.name}",
            patterns=names,
            orders=(edges_hz[:-1] + edges_hz[1:]) / edges_hz[1],
            measured=half_square(measured),
            simulated=half_square(measured - gap),
            gap=gap_square,
            noise=noise,
            p_value=scatter_p_values(gap_square, noise, degrees),
        )

    def _growth(self) -> tuple[PartGrowth, ...]:
        """Exponents of every motion's gap over the blocks, largest gap first."""
        names, matrix = self.patterns
        blocks = []
        for record, residual in zip(self.records, self.residuals, strict=True):
            motion = np.where(np.isfinite(record.measured), record.measured, 0.0) @ matrix.T
            speed_of_run = np.gradient(motion, record.step, axis=0)
            noise_of_run = np.sqrt(matrix**2 @ record.noise)
            sizes = [
                _block_rms(record, signals)
                for signals in (residual @ matrix.T, motion, speed_of_run, record.inputs.loads)
            ]
            blocks.append([*sizes, np.broadcast_to(noise_of_run, sizes[0].shape)])
        gap, deflection, speed, loads, noise = map(np.concatenate, zip(*blocks, strict=True))
        radial_load = np.hypot(loads[:, 1], loads[:, 2])
        growths = []
        for k in np.argsort(-np.sum(gap**2, axis=0), kind="stable"):
            is_clear = gap[:, k] > CLEAR * noise[:, k]
            if not is_clear.any():
                continue
            error = noise[is_clear, k]
            size = np.sqrt(np.maximum(gap[is_clear, k] ** 2 - error**2, 0.0))
            of_loads = {_TORQUE: loads[is_clear, 0], _RADIAL_LOAD: radial_load[is_clear]}
            of_motion = {_DEFLECTION: deflection[is_clear, k], _SPEED: speed[is_clear, k]}
            both = exponents(size, error, of_loads) | exponents(size, error, of_motion)
            growths.append(PartGrowth(names[k], float("nan"), "housing", both))
        return tuple(growths)


def mounting_pictures(
    model: MountingModel,
    records: Sequence[MountingRecord],
    effects: Effects,
    theta: FloatArray,
    choice: Choice,
) -> tuple[Picture, ...]:
    """Measured less linear prediction over the measured motion, one run of each condition."""
    names, matrix = _pattern_matrix(model.sensors, model.channels)
    base = theta[: len(model.parameters(()))]
    rows = []
    for record in records:
        before, after = (
            model.predicted(record, *fitted, choice) for fitted in (((), base), (effects, theta))
        )
        if not (np.isfinite(before).all() and np.isfinite(after).all()):
            return ()
        complete = np.isfinite(record.measured).all(axis=1)
        rows.append(
            [
                (values @ matrix.T)[complete]
                for values in (record.measured, record.measured - before, after - before)
            ]
        )
    k = int(np.argmax(np.sum([np.square(gap).sum(axis=0) for _, gap, _ in rows], axis=0)))
    moving = [
        (record, motion[:, k], gap[:, k], law[:, k])
        for record, (motion, gap, law) in zip(records, rows, strict=True)
        if len(gap) > 1 and np.ptp(motion[:, k]) > 0.0
    ]
    sizes = [float(gap.std()) for _, _, gap, _ in moving]
    panels = []
    for number in drawn_runs(sizes, [record.condition for record, *_ in moving]):
        record, motion, gap, law = moving[number]
        speed = np.gradient(motion, record.step)
        panels.append(loop_panel(record.name, motion, gap, speed, law=law if effects else None))
    if not panels:
        return ()
    law_text = (
        f"Orange: what the fitted effects ({set_name(effects)}) add to it. "
        if effects
        else "No effect was accepted. "
    )
    name = f"{names[k]} motion" if names[k] in _PATTERNS else f"motion at {names[k]}"
    picture = Picture(
        title=f"Unexplained {name}",
        caption=(
            "Coloured points: measured less predicted by the baseline, along the measured "
            f"{name}. {law_text}A spring bends one line; friction, fluid and delay open a loop; "
            "another load than the one that moves it makes a cloud."
        ),
        x_name=name,
        x_unit="m",
        y_name="unexplained",
        y_unit="m",
        panels=tuple(panels),
        shade_name="speed",
        shade_unit="m/s",
    )
    return (picture,)


def _pattern_matrix(
    sensors: Sequence[str], channels: Sequence[str]
) -> tuple[tuple[str, ...], FloatArray]:
    """Names and matrix of the patterns."""
    if sorted(sensors) != sorted(SENSORS):
        return tuple(channels), np.eye(len(channels))
    columns = [SENSORS.index(sensor) for sensor in sensors]
    return tuple(_PATTERNS), np.array(list(_PATTERNS.values()))[:, columns]


def _line_counts(record: MountingRecord, edges_hz: FloatArray) -> FloatArray:
    """Real amplitudes of one signal in every band, over all blocks of a run, shape (n_bands,)."""
    every_sample = np.ones((len(record.block), 1), dtype=bool)
    by_block = block_counts(every_sample, record.block, record.step, edges_hz)
    return np.asarray(by_block[:, 0].sum(axis=0), dtype=np.float64)


def _followed_load(
    records: Sequence[MountingRecord], gaps: Sequence[FloatArray]
) -> FollowedLoad | None:
    """Load, or rate of a load, that a gap is most correlated with; None where with none."""
    gap = np.concatenate(gaps)
    candidates = []
    for name in _LOADS:
        loads = [getattr(record.inputs, name) for record in records]
        rates = [np.gradient(load) for load in loads]
        for values, is_rate in ((loads, False), (rates, True)):
            load = np.concatenate(values)
            size = float(load.std() * gap.std())
            common = float(abs(np.mean((load - load.mean()) * (gap - gap.mean()))))
            strength = common / size if size > 0.0 else 0.0
            candidates.append(FollowedLoad(name, is_rate, strength))
    best = max(candidates, key=lambda followed: followed.correlation)
    return best if best.correlation > _FOLLOWS else None


def _are_repeats(one: MountingRecord, two: MountingRecord) -> bool:
    """Whether two runs of one condition bear the same loads, sample by sample."""
    if one.condition != two.condition or one.inputs.time.size != two.inputs.time.size:
        return False
    difference = np.square(one.inputs.loads - two.inputs.loads).mean(axis=0)
    size = np.square(one.inputs.loads).mean(axis=0)
    return bool((difference <= _SAME_LOADS**2 * size).all())


def _block_rms(record: MountingRecord, signals: FloatArray) -> FloatArray:
    """RMS of signals, shape (n, n_columns), by block, shape (n_blocks, n_columns)."""
    return np.array(
        [
            np.sqrt(np.mean(signals[record.block == block] ** 2, axis=0))
            for block in range(record.n_blocks)
        ]
    )
