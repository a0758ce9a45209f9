"""A comparison problem whose simulator integrates in time, and its derivatives by differences.

The kinds element and mounting are such problems: records of evenly sampled signals, cut into blocks
and bands of frequency, beside the prediction of a model. The residual of a run is measured less
predicted; its derivatives are differences, taken in threads.
"""

import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial
from typing import Any, ClassVar, Generic, Protocol, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.comparison.effect_cards import EffectCard
from carrierflex.diagnosis.comparison.known_physics import (
    EXACT_GAINS,
    NOTHING_KNOWN,
    DeclaredGains,
    KnownPhysics,
)
from carrierflex.diagnosis.comparison.overlay import Overlay, signal_overlay
from carrierflex.diagnosis.comparison.problem import (
    BoolArray,
    Effects,
    FloatArray,
    Parameter,
    Segment,
    SegmentSums,
)
from carrierflex.diagnosis.gap.gap_map import band_edges_hz, block_counts, block_powers
from carrierflex.diagnosis.kind.comparison_problem import ComparisonProblem
from carrierflex.diagnosis.wiring.linear_records import LinearRecord, LoadAnswer
from carrierflex.diagnosis.wiring.refits import PredictedRecord, WiringChecks
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.simulation.effect_parameters import EffectParameter
from carrierflex.simulation.force_effect import ForceEffect
from carrierflex.simulation.force_laws import Force
from carrierflex.simulation.laws import Law
from carrierflex.simulation.measurement import Measurement

#: A difference is taken over a share of a parameter, or of this part of its scale if that is more.
_LEAST_SHARE = 0.1
#: Prior standard deviation of an effect's parameter, in its scale.
_PRIOR = 10.0
#: Samples of all runs from which threads are worth their start.
_THREADED = 100_000
#: Predictions that are asked for at once.
_TOGETHER = 32


class _TimeRecord(Protocol):
    """Record of evenly sampled signals: of one channel, shape (n,), or of several, shape (n, C).

    It is cut into blocks, samples of none of them where that is -1. `noise` and `zero_noise` are
    the variance of the noise of a sample and of the zero of the run, by channel.
    """

    @property
    def name(self) -> str: ...
    @property
    def condition(self) -> str: ...
    @property
    def block(self) -> NDArray[Any]: ...
    @property
    def n_blocks(self) -> int: ...
    @property
    def step(self) -> float: ...
    @property
    def time(self) -> FloatArray: ...
    @property
    def measured(self) -> FloatArray: ...
    @property
    def is_measured(self) -> BoolArray: ...
    @property
    def noise(self) -> FloatArray | float: ...
    @property
    def zero_noise(self) -> FloatArray | float: ...


@dataclass(frozen=True, eq=False)
class MotionScale:
    """Sizes of a motion and of the forces that make it."""

    force: float
    deflection: float
    time: float  # Deflection over its rate [s]

    def of(self, powers: tuple[int, int, int]) -> float:
        """Scale of a parameter with these powers of force, length and time."""
        force, length, time = powers
        return float(self.force**force * self.deflection**length * self.time**time)


@dataclass(frozen=True, eq=False, kw_only=True)
class ModelInTime(ABC):
    """Parameters of a simulator in time: those of its baseline, then those of every effect."""

    effects: ClassVar[Mapping[str, ForceEffect]]  # Those that the simulator has
    scale: MotionScale  # Sizes of everything
    cards: Mapping[str, EffectCard]  # Library
    laws: Mapping[str, Force]  # Users' compiled laws by effect
    contained: Effects  # Effects of the baseline
    channels: tuple[str, ...]  # Names of the channels
    #: Values at which the parameters of the baseline are fixed; empty where they are fitted
    fixed: tuple[float, ...] = ()
    known: KnownPhysics = NOTHING_KNOWN  # Known values and declared errors of the channels
    gains: DeclaredGains = EXACT_GAINS  # Errors of the gains of force and deflection
    measured: Mapping[str, object] = field(default_factory=dict)  # Laws of files by effect

    @abstractmethod
    def of_baseline(self) -> list[Parameter]:
        """Unknowns of the baseline."""

    def measurement(self, effect: str) -> Measurement | None:
        """Part of the measurement model that an effect is."""
        known = self.effects.get(effect)
        return known.measurement if known else None

    def without_effects(self) -> Self:
        """Baseline alone: what it contains is no candidate either."""
        cards = {name: card for name, card in self.cards.items() if name not in self.contained}
        return replace(self, contained=(), cards=cards)

    def predicted_together(
        self, effects: Effects, runs: Sequence[tuple[Any, Sequence[FloatArray]]], refined: int
    ) -> list[list[FloatArray]] | None:
        """Predictions of some records, each by some sets, in one pass; None where no pass does."""
        return None

    def parameters(self, effects: Effects) -> tuple[Parameter, ...]:
        """Unknowns of the baseline, then of every effect that it contains, then of the others."""
        if effects not in self._parameters_by_set:
            self._parameters_by_set[effects] = self._parameters_of(effects)
        return self._parameters_by_set[effects]

    # Every prediction asks for them.
    @cached_property
    def _parameters_by_set(self) -> dict[Effects, tuple[Parameter, ...]]:
        return {}

    def _parameters_of(self, effects: Effects) -> tuple[Parameter, ...]:
        unknowns = self.of_baseline()
        if self.fixed:
            unknowns = [
                replace(unknown, lower=value, upper=value)
                for unknown, value in zip(unknowns, self.fixed, strict=True)
            ]
        for effect in (*self.contained, *effects):
            unknowns += [
                self._parameter(effect, parameter) for parameter in self.cards[effect].parameters
            ]
        return tuple(unknowns)

    def _parameter(self, effect: str, parameter: EffectParameter) -> Parameter:
        size = self.scale.of(parameter.powers) if parameter.powers else 1.0
        lower, upper = self._bounds(effect, parameter, size)
        scale = parameter.scale * size
        unknown = Parameter(
            parameter.name,
            self._unit(parameter),
            lower,
            upper,
            scale,
            effect=effect,
            prior_std=np.inf if parameter.shape or effect in self.contained else _PRIOR * scale,
            shape=parameter.shape,
            pair=parameter.pair,
            gain_std=self.gains.of(parameter.powers) if parameter.powers else 0.0,
        )
        unknown = self.known.sensor_prior(unknown, self.measurement(effect))
        return self.known.prior(unknown, parameter.name)

    def _bounds(self, effect: str, parameter: EffectParameter, size: float) -> tuple[float, float]:
        return parameter.lower * size, parameter.upper * size

    def _unit(self, parameter: EffectParameter) -> str:
        return parameter.unit


T = TypeVar("T", bound=_TimeRecord)
M = TypeVar("M", bound=ModelInTime)


def _runs_with_segments(
    records: Iterable[T], chosen: BoolArray
) -> list[tuple[T, NDArray[np.int64]]]:
    """Runs with a chosen segment."""
    first = 0
    runs = []
    for record in records:
        segments = np.arange(first, first + record.n_blocks)
        if chosen[segments].any():
            runs.append((record, segments))
        first += record.n_blocks
    return runs


@dataclass(frozen=True, eq=False)
class ProblemInTime(ComparisonProblem, Generic[M, T]):
    """Records of evenly sampled signals beside a model that is integrated in time."""

    model: M  # Parameters and simulator
    records: tuple[T, ...]  # Runs
    #: Step of the derivatives by differences, relative to a parameter or a tenth of its scale.
    difference: ClassVar[float]

    @property
    @abstractmethod
    def edges_hz(self) -> FloatArray:
        """Ends of the bands of the score [Hz], shape (n_bands + 1,)."""

    @abstractmethod
    def simulator(self, effects: Effects) -> Callable[[T, FloatArray, int], FloatArray]:
        """Prediction of a record by a parameter set, its steps refined by a factor.

        Infinite where the motion diverges. What all threads share is made before it is returned.
        """

    @cached_property
    def cards(self) -> Mapping[str, EffectCard]:
        """Candidates by id."""
        contained = self.model.contained
        return {name: card for name, card in self.model.cards.items() if name not in contained}

    @cached_property
    def segments(self) -> tuple[Segment, ...]:
        """Blocks of the runs."""
        return tuple(
            Segment(
                record.name,
                record.condition,
                block,
                int(record.is_measured[record.block == block].sum()),
            )
            for record in self.records
            for block in range(record.n_blocks)
        )

    @cached_property
    def _cells(self) -> tuple[FloatArray, FloatArray]:
        """Degrees of freedom and sum of squares of the noise by block, and channel and band."""
        counts = []
        noise = []
        for record in self.records:
            is_measured = _by_channel(record.is_measured)
            by_block = block_counts(is_measured, record.block, record.step, self.edges_hz)
            square = by_block * np.reshape(record.noise, (-1, 1))
            n_measured = np.array(
                [is_measured[record.block == block].sum(axis=0) for block in range(record.n_blocks)]
            )
            # The zero's error is constant over a run: it lies in the lowest band.
            square[:, :, 0] += record.zero_noise * n_measured
            counts.append(by_block.reshape(record.n_blocks, -1))
            noise.append(square.reshape(record.n_blocks, -1))
        return np.concatenate(counts), np.concatenate(noise)

    @property
    def cell_counts(self) -> FloatArray:
        """Degrees of freedom by segment and cell."""
        return self._cells[0]

    @property
    def noise_square(self) -> FloatArray:
        """Sum of squares of the noise by segment and cell."""
        return self._cells[1]

    @property
    def brought(self) -> Effects:
        """Laws of the library that came from files."""
        return tuple(self.model.measured)

    @abstractmethod
    def cards_of(self, laws: Sequence[Law]) -> Sequence[EffectCard]:
        """Effect cards of measured laws, one parameter each."""

    @abstractmethod
    def simulated(self, law: Law) -> object:
        """What the simulator takes of a measured law."""

    def with_laws(self, laws: Sequence[Law], library: Effects | None = None) -> Self:
        """Problem with measured laws among its cards."""
        narrowed = self if library is None else self.for_laws(library)
        model = narrowed.model
        cards = {card.id: card for card in self.cards_of(laws)}
        return replace(
            narrowed,
            model=replace(
                model,
                cards={**model.cards, **cards},
                measured={**model.measured, **{law.name: self.simulated(law) for law in laws}},
            ),
        )

    def for_laws(self, laws: Effects) -> Self:
        """Problem for a fit of some laws: columns of the others are made along no record."""
        cards, contained = self.model.cards, self.model.contained
        cards = {name: cards[name] for name in cards if name in (*laws, *contained)}
        return replace(self, model=replace(self.model, cards=cards))

    def parameters(self, effects: Effects) -> tuple[Parameter, ...]:
        """Unknowns of a set."""
        return self.model.parameters(effects)

    def sums(
        self, effects: Effects, theta: FloatArray, chosen: BoolArray, free: BoolArray | None = None
    ) -> SegmentSums:
        """Gauss-Newton sums of the chosen runs; infinite squares where the motion diverges."""
        n, p = chosen.size, theta.size
        matrix, right, square = np.zeros((n, p, p)), np.zeros((n, p)), np.zeros(n)
        runs = _runs_with_segments(self.records, chosen)
        slopes = self.slopes(effects, theta, [record for record, _ in runs], free)
        for (record, segments), (residual, rows) in zip(runs, slopes, strict=True):
            if not np.isfinite(residual).all():
                square[segments] = np.inf
                continue
            for block, segment in enumerate(segments):
                samples = np.flatnonzero(record.block == block)
                # A slice copies nothing.
                is_span = samples.size and samples[-1] - samples[0] + 1 == samples.size
                inside = slice(samples[0], samples[-1] + 1) if is_span else samples
                block_rows = rows[:, inside].reshape(p, -1)
                block_residual = residual[inside].ravel()
                matrix[segment] = block_rows @ block_rows.T
                right[segment] = block_rows @ block_residual
                square[segment] = block_residual @ block_residual
        return SegmentSums(matrix, right, square)

    def slopes(
        self,
        effects: Effects,
        theta: FloatArray,
        records: Sequence[T],
        free: BoolArray | None = None,
    ) -> Iterator[tuple[FloatArray, FloatArray]]:
        """Residual and change of the prediction by parameter, (p, ...); zero where it diverges."""
        together = max(1, _TOGETHER // (theta.size + 1))
        for first in range(0, len(records), together):
            group = records[first : first + together]
            steps = [self._steps(effects, theta, record, free) for record in group]
            runs = [
                (record, [theta, *(theta + step for step in of_record.values())])
                for record, of_record in zip(group, steps, strict=True)
            ]
            residuals = self._residuals(effects, runs)
            for (residual, *changed), of_record in zip(residuals, steps, strict=True):
                rows = np.zeros((theta.size, *residual.shape))
                if not np.isfinite(residual).all():
                    yield residual, rows
                    continue
                for (k, step), other in zip(of_record.items(), changed, strict=True):
                    if np.isfinite(other).all():
                        np.subtract(residual, other, out=rows[k])
                        rows[k] /= step[k]
                yield residual, rows

    def _steps(
        self, effects: Effects, theta: FloatArray, record: T, free: BoolArray | None
    ) -> dict[int, FloatArray]:
        """Differences of the parameters that a record has, by their number, shape (p,) each."""
        steps = {}
        for k, parameter in enumerate(self.parameters(effects)):
            if parameter.run in (None, record.name) and (free is None or free[k]):
                step = self.difference * max(abs(theta[k]), _LEAST_SHARE * parameter.scale)
                within = -step if theta[k] + step > parameter.upper else step
                steps[k] = float(within) * (np.arange(theta.size) == k)
        return steps

    def squares(self, effects: Effects, theta: FloatArray, chosen: BoolArray) -> FloatArray:
        """Squared residuals by segment and cell; infinite where the motion diverges."""
        result = np.zeros(self.cell_counts.shape)
        for record, segments, residual in self._chosen(effects, theta, chosen):
            powers = block_powers(_by_channel(residual), record.block, record.step, self.edges_hz)
            result[segments] = powers.reshape(len(segments), -1)
        return result

    def total_square(self, effects: Effects, theta: FloatArray, chosen: BoolArray) -> float:
        """Squared residuals of the chosen segments without bands, which take a transform each."""
        total = 0.0
        for record, segments, residual in self._chosen(effects, theta, chosen):
            # The last entry is that of samples outside all blocks.
            inside = np.append(chosen[segments], False)[record.block]
            total += float(np.sum(np.square(residual[inside])))
        return total

    def _chosen(
        self, effects: Effects, theta: FloatArray, chosen: BoolArray
    ) -> list[tuple[T, NDArray[np.int64], FloatArray]]:
        """Runs with a chosen segment: record, indices of all its segments, its residual."""
        runs = _runs_with_segments(self.records, chosen)
        residuals = self._residuals(effects, [(record, [theta]) for record, _ in runs])
        return [
            (record, segments, residual)
            for (record, segments), (residual,) in zip(runs, residuals, strict=True)
        ]

    def overlays(self, effects: Effects, theta: FloatArray) -> Sequence[Overlay]:
        """Every channel of every run as measured and as a model has it."""
        return [
            signal_overlay(record.name, name, record.step, measured, residual)
            for record, residuals in zip(self.records, self.residuals(effects, theta), strict=True)
            for name, measured, residual in zip(
                self.model.channels,
                _by_channel(record.measured).T,
                _by_channel(residuals).T,
                strict=True,
            )
        ]

    def numerical_error(self, effects: Effects, theta: FloatArray) -> float:
        """RMS change of the prediction with half the step."""
        predicted = [self._predicted(effects, theta, refined=refined) for refined in (1, 2)]
        changes = [finer - coarser for coarser, finer in zip(*predicted, strict=True)]
        return float(np.sqrt(np.mean(np.concatenate(changes) ** 2)))

    def predictions(self, theta: FloatArray) -> tuple[PredictedRecord, ...]:
        """Every run with its fitted baseline; NaN where samples do not count."""
        return tuple(
            PredictedRecord(
                record.name,
                record.time,
                _by_channel(np.where(record.is_measured, record.measured, np.nan)),
                _by_channel(predicted),
            )
            for record, predicted in zip(self.records, self._predicted((), theta), strict=True)
        )

    def linear_records(self, theta: FloatArray, effects: Effects = ()) -> Iterator[LinearRecord]:
        """Every run with its fitted model, and the slopes of that by its parameters."""
        slopes = self.slopes(effects, theta, self.records)
        predictions = self._predicted(effects, theta)
        for record, predicted, (residual, columns) in zip(
            self.records, predictions, slopes, strict=True
        ):
            yield LinearRecord(
                record.name,
                record.time,
                _by_channel(np.where(record.is_measured, residual, np.nan)),
                _by_channel(predicted),
                columns.reshape(*columns.shape[:2], -1),
                # Several faults ask for them, each of them some simulations.
                answers=cache(partial(self.load_answers, record, effects, theta)),
            )

    def load_answers(
        self, record: Any, effects: Effects, theta: FloatArray
    ) -> Sequence[LoadAnswer]:
        """Answers to each load where there are several; none of a kind that has one."""
        return ()

    def wiring_beside(
        self,
        refitted: Callable[[Campaign, Effects, Sequence[Law]], float],
        laws: Effects,
        values: Mapping[tuple[str, str], float],
        shapes: Sequence[Law],
    ) -> WiringChecks:
        """What can be tried with laws in the model; a law of a file is in no other campaign's."""
        if set(laws) & set(self.brought):
            return WiringChecks()
        return WiringChecks(
            refitted=lambda other: refitted(other, laws, shapes),
            linear=lambda theta: self.with_laws(shapes).linear_records(theta, laws),
        )

    def residuals(self, effects: Effects, theta: FloatArray) -> list[FloatArray]:
        """Residual of every run, of the shape of its signals."""
        residuals = self._residuals(effects, [(record, [theta]) for record in self.records])
        return [residual for (residual,) in residuals]

    def _residuals(
        self, effects: Effects, runs: Sequence[tuple[T, Sequence[FloatArray]]]
    ) -> list[list[FloatArray]]:
        """Measured less predicted of some records, each at some parameter sets.

        Zero where nothing was measured, infinite where the motion diverges.
        """

        def remaining(record: T, response: FloatArray) -> FloatArray:
            if not np.isfinite(response).all():
                return np.where(record.is_measured, np.inf, 0.0)
            return np.where(record.is_measured, record.measured - response, 0.0)

        responses = self._responses(effects, runs)
        return [
            [remaining(record, response) for response in of_run]
            for (record, _), of_run in zip(runs, responses, strict=True)
        ]

    def _predicted(
        self, effects: Effects, theta: FloatArray, *, refined: int = 1
    ) -> list[FloatArray]:
        """Prediction of every run."""
        responses = self._responses(
            effects, [(record, [theta]) for record in self.records], refined
        )
        return [response for (response,) in responses]

    def _responses(
        self,
        effects: Effects,
        runs: Sequence[tuple[T, Sequence[FloatArray]]],
        refined: int = 1,
    ) -> list[list[FloatArray]]:
        """Predictions of some records, each by some parameter sets: in one pass, or in threads."""
        together = self.model.predicted_together(effects, runs, refined)
        if together is not None:
            return together
        predicted = self.simulator(effects)
        calls = [(record, theta, refined) for record, sets in runs for theta in sets]
        if sum(record.measured.size for record in self.records) < _THREADED:
            responses = iter([predicted(*call) for call in calls])
        else:
            # The compiled motion runs without the interpreter's lock.
            with ThreadPoolExecutor(os.cpu_count()) as threads:
                responses = iter([*threads.map(lambda call: predicted(*call), calls)])
        return [[next(responses) for _ in sets] for _, sets in runs]


def _by_channel(signals: NDArray[Any]) -> NDArray[Any]:
    """Signals of one channel or several, shape (n, n_channels)."""
    return signals.reshape(len(signals), -1)


def edges_of_bands_hz(records: Sequence[_TimeRecord], n_bands: int) -> FloatArray:
    """Ends of bands common to all records [Hz], evenly wide on a logarithmic axis."""
    longest = max(float((record.block == 0).sum()) * record.step for record in records)
    highest_hz = max(0.5 / record.step for record in records)
    return band_edges_hz(longest, 1.001 * highest_hz, n_bands)
