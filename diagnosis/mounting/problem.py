"""The kind "mounting" as a comparison problem of the diagnosis: records, library, sums."""

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from carrierflex.diagnosis.classes.gram_table import GramTable
from carrierflex.diagnosis.classes.results import ClassAnswer
from carrierflex.diagnosis.comparison.effect_cards import EffectCard, force_library
from carrierflex.diagnosis.comparison.finite_differences import (
    DifferencedResiduals,
    step_halving_error,
)
from carrierflex.diagnosis.comparison.known_physics import (
    DeclaredError,
    Misreading,
    declared_errors,
    known_physics,
)
from carrierflex.diagnosis.comparison.overlay import Overlay, Picture, signal_overlay
from carrierflex.diagnosis.comparison.problem import (
    BoolArray,
    Effects,
    FloatArray,
    GapCell,
    Parameter,
    Segment,
    SegmentSums,
    Signatures,
)
from carrierflex.diagnosis.gap.findings import GapFindings, Scalar
from carrierflex.diagnosis.gap.gap_map import block_powers
from carrierflex.diagnosis.inference.effect_fit import Prior, minimised
from carrierflex.diagnosis.kind.comparison_problem import CandidateExperiment, ComparisonProblem
from carrierflex.diagnosis.mounting.classes.answer import answer_of_table
from carrierflex.diagnosis.mounting.classes.shapes import beyond_visited, law_cards
from carrierflex.diagnosis.mounting.classes.table import mounting_table
from carrierflex.diagnosis.mounting.experiments import mounting_experiments
from carrierflex.diagnosis.mounting.gap import (
    map_edges_hz,
    mounting_findings,
    mounting_gap_cells,
    mounting_pictures,
    mounting_scalars,
    score_cells,
)
from carrierflex.diagnosis.mounting.model import (
    KIND,
    MOUNTING_CARDS,
    ONE_CHANNEL,
    Choice,
    MountingModel,
    mounting_scale,
)
from carrierflex.diagnosis.mounting.records import MountingRecord, mounting_records
from carrierflex.diagnosis.mounting.signatures import (
    Column,
    Solution,
    mounting_signatures,
    solutions,
    values_array,
)
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning
from carrierflex.simulation.laws import Law
from carrierflex.simulation.measurement import Measurement
from carrierflex.simulation.mounting.effects import SENSOR_DELAY
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.rig import MountingRig

#: Step of the derivatives by differences, relative to a parameter or a tenth of its scale.
_DIFFERENCE = 1e-4


@dataclass(frozen=True, eq=False)
class MountingProblem(ComparisonProblem):
    """One mounting, its records and its library.

    See :class:`carrierflex.diagnosis.comparison.problem.ComparisonProblem`.

    Parameters
    ----------
    model : MountingModel
        Parameters and simulator.
    records : tuple of MountingRecord
        Runs.
    noise_is_measured : bool
        Whether the noise was declared.
    """

    model: MountingModel
    records: tuple[MountingRecord, ...]
    noise_is_measured: bool

    @property
    def unit(self) -> str:
        """Unit of the sensors."""
        return "m"

    @property
    def n_channels(self) -> int:
        """Signals that are compared."""
        return len(self.model.channels)

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
                int(np.isfinite(record.measured[record.block == block]).sum()),
            )
            for record in self.records
            for block in range(record.n_blocks)
        )

    @cached_property
    def _edges_hz(self) -> FloatArray:
        return map_edges_hz(self.records)[[0, 1, 4, -1]]

    @cached_property
    def _cells(self) -> tuple[FloatArray, FloatArray]:
        return score_cells(self.records, self._edges_hz)

    @property
    def cell_counts(self) -> FloatArray:
        """Degrees of freedom by segment and cell."""
        return self._cells[0]

    @property
    def noise_square(self) -> FloatArray:
        """Sum of squares of the noise by segment and cell."""
        return self._cells[1]

    def parameters(self, effects: Effects) -> tuple[Parameter, ...]:
        """Unknowns of a set."""
        return self.model.parameters(effects)

    def starts(
        self, effects: Effects, known: Mapping[tuple[str, str], float]
    ) -> Sequence[FloatArray]:
        """What is known with the new effects off, linear bushings alone, then linear solutions."""
        parameters = self.parameters(effects)
        fitted = [values for values, _ in self._solutions(effects)]
        starts = [
            {**{key: fitted[0][key] for key in self._known}, **known},
            {**self._known, **known},
        ]
        starts += [{**values, **known} for values in fitted]
        starts += [{**known, **values} for values in fitted]
        starts += [{**fitted[0], **values, **known} for values, _ in self._contained_solutions]
        lower, upper = np.array([[p.lower, p.upper] for p in parameters]).T
        return [np.clip(values_array(parameters, values), lower, upper) for values in starts]

    def sums(self, effects: Effects, theta: FloatArray, chosen: BoolArray) -> SegmentSums:
        """Gauss-Newton sums with derivatives by differences."""
        return self.differenced(effects).sums(theta, chosen)

    def squares(self, effects: Effects, theta: FloatArray, chosen: BoolArray) -> FloatArray:
        """Squared residuals by segment and cell; infinite where the motion leaves the model."""
        result = np.zeros(self.cell_counts.shape)
        for record, segments, residual in self.differenced(effects).chosen(theta, chosen):
            powers = block_powers(residual, record.block, record.step, self._edges_hz)
            result[segments] = powers.reshape(len(segments), -1)
        return result

    def gap_cells(self, effects: Effects, theta: FloatArray) -> Sequence[GapCell]:
        """Gap by motion pattern, band and run."""
        return mounting_gap_cells(
            self.records, self._residuals(effects, theta), self.model.sensors, self.model.channels
        )

    def gap_findings(self, effects: Effects, theta: FloatArray) -> GapFindings:
        """Where the gap lies, in time, between repeats, and its growth."""
        return mounting_findings(
            self.records,
            self._residuals(effects, theta),
            self.gap_cells(effects, theta),
            self.model.sensors,
            self.model.channels,
        )

    def scalars(self, effects: Effects, theta: FloatArray) -> Sequence[Scalar]:
        """Mean and peak to peak of every motion."""
        return mounting_scalars(
            self.records, self._residuals(effects, theta), self.model.sensors, self.model.channels
        )

    def pictures(self, effects: Effects, theta: FloatArray) -> tuple[Picture, ...]:
        """Gap along the motion that holds most of it."""
        return mounting_pictures(self.model, self.records, effects, theta, self.choice(effects))

    def overlays(self, effects: Effects, theta: FloatArray) -> Sequence[Overlay]:
        """Every channel of every run as measured and as a model has it."""
        return [
            signal_overlay(record.name, name, record.step, measured, residual)
            for record, residuals in zip(self.records, self._residuals(effects, theta), strict=True)
            for name, measured, residual in zip(
                self.model.channels, record.measured.T, residuals.T, strict=True
            )
        ]

    def candidate_experiments(self) -> Sequence[CandidateExperiment]:
        """Loads that were not applied."""
        return mounting_experiments(self.records[0], self._under)

    def _under(
        self, record: MountingRecord, effects: Effects, theta: FloatArray
    ) -> "MountingProblem | None":
        """ComparisonProblem whose only record has the signals of a model.

        None where the model leaves its range.
        """
        predicted = self.model.predicted(record, effects, theta, self.choice(effects))
        if not np.isfinite(predicted).all():
            return None
        return replace(self, records=(replace(record, measured=predicted),))

    def misreading(self, effects: Effects, theta: FloatArray) -> Misreading:
        """What the declared errors of sensors and loads do to a fit."""
        reading = _Reading(self.model, effects, theta, self.choice(effects))
        return reading.misread(self.records, self.differenced(effects).slopes(theta))

    def numerical_error(self, effects: Effects, theta: FloatArray) -> float:
        """RMS change of the prediction with half the step."""
        choice = self.choice(effects)
        return step_halving_error(
            self.records,
            lambda record, factor: self.model.predicted(
                record, effects, theta, choice, refined=factor
            ),
        )

    def class_answer(self) -> ClassAnswer | None:
        """Class of the missing effect."""
        table = mounting_table(self.model, self.records, self._bare[1])
        return None if table is None else answer_of_table(table)

    def gram_table(self) -> GramTable | None:
        """Products of classes and laws; None where the records are too short."""
        table = mounting_table(self.model, self.records, self._bare[1])
        return None if table is None else table.table

    def beyond_visited(self, law: Law) -> tuple[CampaignWarning, ...]:
        """Warning where records leave the range in which a law of a file was measured."""
        return beyond_visited(law, self.model, self.records, self._bare[1])

    def choice(self, effects: Effects) -> Choice:
        """Channel of each effect of one sensor, by least squares over the signatures.

        The contained ones' by themselves.
        """
        wanted = {name for name in (*self.model.contained, *effects) if name in ONE_CHANNEL}
        if not wanted:
            return {}
        return {
            **{name: 0 for name in wanted},
            **self._contained_choice,
            **self._solutions(effects)[0][1],
        }

    @cached_property
    def _contained_solutions(self) -> list[Solution]:
        """Linear solutions of the contained effects by themselves, best first."""
        if not self.model.contained:
            return []
        return replace(self, model=replace(self.model, contained=()))._solutions(
            self.model.contained
        )

    @cached_property
    def _contained_choice(self) -> Choice:
        return self._contained_solutions[0][1] if self._contained_solutions else {}

    @cached_property
    def _bare(self) -> "tuple[MountingProblem, FloatArray]":
        """ComparisonProblem with linear bushings alone as its baseline, and its fit."""
        bare = replace(self, model=replace(self.model, contained=()))
        return bare, bare.bare_fit()

    @cached_property
    def _known(self) -> dict[tuple[str, str], float]:
        bare, theta = self._bare
        parameters = bare.parameters(())
        return {(p.effect, p.name): float(v) for p, v in zip(parameters, theta, strict=True)}

    @cached_property
    def _columns(self) -> tuple[Signatures, tuple[Column, ...]]:
        bare, theta = self._bare
        return mounting_signatures(
            self.model, self.records, bare._residuals((), theta), self._known
        )

    def bare_fit(self) -> FloatArray:
        """K1 and C1 of the linear bushings alone, shape (2,)."""
        if self.model.fixed:
            return np.array(self.model.fixed)
        rig = self.model.rig
        start = np.array([rig.bushing_radial_stiffness, rig.bushing_radial_damping])
        everything, free = np.ones(len(self.segments), dtype=bool), np.ones(2, dtype=bool)
        return minimised(self, (), start, chosen=everything, free=free, prior=Prior.none(2))[0]

    @cached_property
    def _known_solutions(self) -> dict[Effects, list[Solution]]:
        return {}

    def _solutions(self, effects: Effects) -> list[Solution]:
        if effects not in self._known_solutions:
            self._known_solutions[effects] = solutions(*self._columns, effects, self._known)
        return self._known_solutions[effects]

    def differenced(self, effects: Effects) -> DifferencedResiduals[MountingRecord]:
        """Residuals of a set of effects as a function of its parameters."""
        # The channels of sensors' effects are chosen here, before any thread asks for them.
        choice = self.choice(effects)
        return DifferencedResiduals(
            self.records,
            lambda record, theta: self._residual(record, effects, theta, choice),
            self.parameters(effects),
            relative_step=_DIFFERENCE,
            n_threads=os.cpu_count() or 1,
        )

    def _residuals(self, effects: Effects, theta: FloatArray) -> list[FloatArray]:
        choice = self.choice(effects)
        return [self._residual(record, effects, theta, choice) for record in self.records]

    def _residual(
        self, record: MountingRecord, effects: Effects, theta: FloatArray, choice: Choice
    ) -> FloatArray:
        """Measured less predicted; zero where nothing was measured."""
        residual = record.measured - self.model.predicted(record, effects, theta, choice)
        return np.where(np.isfinite(record.measured), residual, 0.0)


def mounting_problem(campaign: Campaign, measured_laws: Sequence[Law] = ()) -> MountingProblem:
    """ComparisonProblem of a campaign of kind ``mounting``.

    Parameters
    ----------
    campaign : Campaign
        Measured runs and the effects the baseline contains.
    measured_laws : sequence of Law
        Laws of files, further candidates.

    Returns
    -------
    MountingProblem
        Ready to be diagnosed.

    Raises
    ------
    ValueError
        Where a signal is missing throughout, the loads never change, or a user's card is refused.
    """
    records = mounting_records(campaign)
    added = law_cards(measured_laws)
    cards, laws = force_library(KIND, (*MOUNTING_CARDS, *added))
    cards = {name: card for name, card in cards.items() if name not in campaign.baseline.impossible}
    rig = MountingRig.from_table(campaign.rig)
    sensors = tuple(str(channel.sensor) for channel in campaign.channels)
    names = tuple(channel.name for channel in campaign.channels)
    scale = mounting_scale(rig, records)
    contained = tuple(campaign.baseline.effects)
    known = known_physics(campaign)
    measured = {law.name: law for law in measured_laws}
    model = MountingModel(
        rig, cards, laws, contained, names, sensors, scale, known=known, measured=measured
    )
    declared = all(channel.noise_std is not None for channel in campaign.channels)
    return MountingProblem(model, records, declared)


def mounting_beside_prediction(problem: MountingProblem, campaign: Campaign) -> MountingProblem:
    """ComparisonProblem whose baseline is the prediction in the run files.

    Parameters
    ----------
    problem : MountingProblem
        ComparisonProblem of the same campaign with the model as its baseline.
    campaign : Campaign
        Campaign with predictions.

    Returns
    -------
    MountingProblem
        Same records; K1 and C1 held at what the prediction obeys.
    """
    # The floor is the measurement's: a prediction has no noise to be estimated.
    channels = tuple(replace(channel, noise_std=0.0) for channel in campaign.channels)
    runs = tuple(replace(run, signals=run.predictions) for run in campaign.runs)
    simulated = mounting_records(replace(campaign, channels=channels, runs=runs))
    # What the prediction contains already is no candidate.
    cards = {
        name: card
        for name, card in problem.model.cards.items()
        if name not in campaign.baseline.effects
    }
    linear = replace(problem.model, contained=(), cards=cards)
    linear_fit = replace(problem, model=linear, records=simulated).bare_fit()
    records = tuple(
        replace(
            record,
            measured=record.measured
            - predicted.measured
            + linear.predicted(record, (), linear_fit, {}),
        )
        for record, predicted in zip(problem.records, simulated, strict=True)
    )
    return replace(
        problem,
        model=replace(linear, fixed=tuple(float(value) for value in linear_fit)),
        records=records,
    )


@dataclass(frozen=True, eq=False)
class _Reading:
    """A fitted set of effects, whose records may be misread."""

    model: MountingModel
    effects: Effects
    theta: FloatArray
    choice: Choice

    def misread(
        self,
        records: Sequence[MountingRecord],
        slopes: Iterable[tuple[FloatArray, FloatArray]],
    ) -> Misreading:
        """What every declared error, and the zero of every run and channel, does to the gradient.

        The zero of a run is a mean over its first samples. The noise in it is in all blocks alike,
        so that their scatter does not show it: it is an error of every run and channel. `slopes`
        are residual, (n, C), and change of the prediction by every parameter, (p, n, C), run by
        run.
        """
        errors = declared_errors(self.model.known)
        scores = np.zeros((len(errors), self.theta.size))
        of_zeros = []
        for record, (_, changes) in zip(records, slopes, strict=True):
            predicted = self._predicted(record)
            by_parameter = changes.reshape(len(changes), -1)
            for e, error in enumerate(errors):
                change = self._change(record, error, predicted)
                change = np.where(np.isfinite(record.measured), change, 0.0)
                scores[e] += by_parameter @ change.ravel()
            of_channels = np.where(np.isfinite(record.measured), changes, 0.0).sum(axis=1)
            of_zeros.append((of_channels * np.sqrt(record.zero_noise)).T)
        return Misreading(errors, np.concatenate([scores, *of_zeros]))

    def _change(
        self, record: MountingRecord, error: DeclaredError, predicted: FloatArray
    ) -> FloatArray:
        """Change of the residual where a signal is read one standard deviation off, (n, C)."""
        if error.is_of_input:
            inputs = record.inputs.columns()
            inputs[error.signal] = error.misread(inputs[error.signal])
            return predicted - self._predicted(replace(record, inputs=MountingInputs(**inputs)))
        if error.part is Measurement.DELAY:
            late = replace(
                self,
                effects=(*self.effects, SENSOR_DELAY.id),
                theta=np.append(self.theta, error.std),
            )
            return late._predicted(record) - predicted
        change = np.zeros(record.measured.shape)
        signal = record.measured[:, error.channel]
        change[:, error.channel] = error.misread(signal) - signal
        return change

    def _predicted(self, record: MountingRecord) -> FloatArray:
        return self.model.predicted(record, self.effects, self.theta, self.choice)
