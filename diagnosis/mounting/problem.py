"""The kind "mounting" as a comparison problem of the diagnosis: records, library, sums."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from carrierflex.diagnosis.classes.gram_table import GramTable
from carrierflex.diagnosis.classes.results import ClassAnswer
from carrierflex.diagnosis.comparison.effect_cards import EffectCard, force_library
from carrierflex.diagnosis.comparison.known_physics import (
    DeclaredError,
    Misreading,
    declared_errors,
    known_physics,
)
from carrierflex.diagnosis.comparison.overlay import Picture
from carrierflex.diagnosis.comparison.problem import (
    Effects,
    FloatArray,
    Signatures,
    bounds_of,
)
from carrierflex.diagnosis.inference.effect_fit import Prior, SegmentCost, mean_square_of
from carrierflex.diagnosis.kind.comparison_problem import CandidateExperiment
from carrierflex.diagnosis.kind.problem_in_time import ProblemInTime
from carrierflex.diagnosis.mounting.answer import answer_of_table
from carrierflex.diagnosis.mounting.gap import MountingGap, map_edges_hz, mounting_pictures
from carrierflex.diagnosis.mounting.model import (
    KIND,
    MOUNTING_CARDS,
    ONE_CHANNEL,
    Choice,
    MountingModel,
    mounting_scale,
)
from carrierflex.diagnosis.mounting.records import MountingRecord, mounting_records
from carrierflex.diagnosis.mounting.shapes import beyond_visited, law_cards
from carrierflex.diagnosis.mounting.signatures import (
    Column,
    Solution,
    mounting_signatures,
    solutions,
)
from carrierflex.diagnosis.mounting.table import mounting_table
from carrierflex.diagnosis.mounting.wiring import mounting_rivals
from carrierflex.diagnosis.wiring.linear_records import LinearRecord, LoadAnswer
from carrierflex.diagnosis.wiring.refits import LOADS, WiringChecks
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning
from carrierflex.simulation.laws import Law
from carrierflex.simulation.measurement import Measurement
from carrierflex.simulation.mounting.effects import SENSOR_DELAY
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.rig import MountingRig

#: Step and length of a record [s].
STEP, LENGTH = 0.05, 120.0
_FREQUENCIES = (0.05, 1.0)
_SHARES = (0.25, 1.0)
#: Limits of the rig: 400 kN m (NREL/TP-5000-66594), 200 kN (table 2 of the 2012 paper).
_TORQUE, _LOAD = 4.0e5, 2.0e5
#: Share by which a load is larger where its answer is asked.
_LARGER = 0.01
_BLOCKS = 4


@dataclass(frozen=True, eq=False)
class MountingProblem(ProblemInTime[MountingModel, MountingRecord]):
    """One mounting, its records and its library."""

    noise_is_measured: bool  # Whether the noise was declared
    unit = "m"
    difference = 1e-4

    @cached_property
    def edges_hz(self) -> FloatArray:
        """Ends of the bands of the score [Hz]."""
        return map_edges_hz(self.records)[[0, 1, 4, -1]]

    def simulator(
        self, effects: Effects
    ) -> Callable[[MountingRecord, FloatArray, int], FloatArray]:
        """Signals that a parameter set predicts for a record."""
        choice = self.choice(effects)
        return lambda record, theta, refined: self.model.predicted(
            record, effects, theta, choice, refined=refined
        )

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
        # What is not known leaves the baseline as it is.
        off = {(p.effect, p.name): p.scale if p.shape else 0.0 for p in parameters}
        bounds = bounds_of(parameters)
        return [
            np.clip([values.get(key, value) for key, value in off.items()], *bounds)
            for values in starts
        ]

    def gap(self, effects: Effects, theta: FloatArray) -> MountingGap:
        """Gap by motion, band and run."""
        return MountingGap(self.model, self.records, self.residuals(effects, theta))

    def pictures(self, effects: Effects, theta: FloatArray) -> tuple[Picture, ...]:
        """Gap along the motion that holds most of it."""
        return mounting_pictures(self.model, self.records, effects, theta, self.choice(effects))

    def candidate_experiments(self) -> Sequence[CandidateExperiment]:
        """Loads of the dynamometer that were not applied, with measured channels and noise."""

        def under(
            blank: MountingRecord, effects: Effects, theta: FloatArray
        ) -> MountingProblem | None:
            """Problem whose only record has the signals of a model."""
            predicted = self.model.predicted(blank, effects, theta, self.choice(effects))
            if not np.isfinite(predicted).all():
                return None
            return replace(self, records=(replace(blank, measured=predicted),))

        time, loads = trial_loads(_TORQUE, _LOAD, _SHARES)
        blanks = {
            text: blank_record(self.records[0], "trial", time, columns)
            for text, columns in loads.items()
        }
        return [CandidateExperiment(text, partial(under, blank)) for text, blank in blanks.items()]

    def misreading(self, effects: Effects, theta: FloatArray) -> Misreading:
        """What every declared error, and the zero of every run and channel, does to the gradient.

        The zero of a run is a mean over its first samples. The noise in it is in all blocks alike,
        so that their scatter does not show it: it is an error of every run and channel.
        """
        errors = declared_errors(self.model.known)
        scores = np.zeros((len(errors), theta.size))
        of_zeros = []
        slopes = self.slopes(effects, theta, self.records)
        for record, (_, changes) in zip(self.records, slopes, strict=True):
            by_parameter = changes.reshape(len(changes), -1)
            for e, error in enumerate(errors):
                change = self._misread(record, error, effects, theta)
                scores[e] += by_parameter @ np.where(record.is_measured, change, 0.0).ravel()
            of_channels = np.where(record.is_measured, changes, 0.0).sum(axis=1)
            of_zeros.append((of_channels * np.sqrt(record.zero_noise)).T)
        return Misreading(errors, np.concatenate([scores, *of_zeros]), "zeros")

    def _misread(
        self, record: MountingRecord, error: DeclaredError, effects: Effects, theta: FloatArray
    ) -> FloatArray:
        """Change of the residual where a signal is read one standard deviation off, (n, C)."""
        choice = self.choice(effects)
        if error.is_of_input or error.quantity is Measurement.DELAY:
            predicted = self.model.predicted(record, effects, theta, choice)
            if not error.is_of_input:
                late = (*effects, SENSOR_DELAY.id), np.append(theta, error.std)
                return self.model.predicted(record, *late, choice) - predicted
            inputs = record.inputs.columns()
            inputs[error.signal] = error.misread(inputs[error.signal])
            misread = replace(record, inputs=MountingInputs(**inputs))
            return predicted - self.model.predicted(misread, effects, theta, choice)
        change = np.zeros(record.measured.shape)
        signal = record.measured[:, error.channel]
        change[:, error.channel] = error.misread(signal) - signal
        return change

    def linear_records(self, theta: FloatArray, effects: Effects = ()) -> Iterator[LinearRecord]:
        """None of another simulator's prediction."""
        if not self.model.fixed:
            linear_records = super().linear_records(theta, effects)
            for record, linear in zip(self.records, linear_records, strict=True):
                # Where nothing was measured the prediction is not known either.
                yield replace(linear, predicted=record.measured - linear.residual)

    def load_answers(
        self, record: MountingRecord, effects: Effects, theta: FloatArray
    ) -> Sequence[LoadAnswer]:
        """Answers to torque and radial loads, those that act in the run."""
        predicted = self.simulator(effects)
        as_read = predicted(record, theta, 1)
        answers = []
        for name in LOADS:
            values = getattr(record.inputs, name)
            if values.any():
                larger = replace(record.inputs, **{name: (1.0 + _LARGER) * values})
                changed = predicted(replace(record, inputs=larger), theta, 1)
                if np.isfinite(changed).all():
                    answers.append(LoadAnswer(name, values, (changed - as_read) / _LARGER))
        return answers

    def class_answer(self) -> ClassAnswer | None:
        """Class of the missing effect."""
        table = mounting_table(self.model, self.records, self._bare[1])
        return None if table is None else answer_of_table(table)

    def gram_table(self) -> GramTable | None:
        """Products of classes and laws; None where the records are too short."""
        table = mounting_table(self.model, self.records, self._bare[1])
        return None if table is None else table.table

    def cards_of(self, laws: Sequence[Law]) -> Sequence[EffectCard]:
        """Effect cards of measured laws."""
        return law_cards(laws)

    def simulated(self, law: Law) -> Law:
        """What the simulator takes of a measured law."""
        return law

    def beyond_visited(self, law: Law) -> tuple[CampaignWarning, ...]:
        """Warning where records leave the range in which a law of a file was measured."""
        return beyond_visited(law, self.model, self.records, self._bare[1])

    def wiring(self, campaign: Campaign) -> WiringChecks:
        """Signs and gains of loads, exchanged sensors, delays and drifts of a model's baseline."""
        if campaign.baseline.source != "model":
            return super().wiring(campaign)

        def refitted(other: Campaign, laws: Effects = (), shapes: Sequence[Law] = ()) -> float:
            """Mean square that the baseline, and laws, leave once fitted to a campaign."""
            return mean_square_of(mounting_problem(other, shapes).for_laws(laws), laws)

        return WiringChecks(
            lambda: mounting_rivals(self.for_laws(()), campaign),
            self.predictions,
            refitted,
            self.linear_records,
            with_laws=partial(self.wiring_beside, refitted),
        )

    def choice(self, effects: Effects) -> Choice:
        """Channel of each effect of one sensor by least squares; contained ones by themselves."""
        wanted = {name for name in (*self.model.contained, *effects) if name in ONE_CHANNEL}
        if not wanted:
            return {}
        return {
            **{name: 0 for name in wanted},
            **(self._contained_solutions[0][1] if self._contained_solutions else {}),
            **self._solutions(effects)[0][1],
        }

    @cached_property
    def _contained_solutions(self) -> list[Solution]:
        """Linear solutions of the contained effects by themselves, best first."""
        contained = self.model.contained
        return self._bare[0]._solutions(contained) if contained else []

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
    def _signatures(self) -> Signatures[Column]:
        bare, theta = self._bare
        return mounting_signatures(self.model, self.records, bare.residuals((), theta), self._known)

    def bare_fit(self) -> FloatArray:
        """K1 and C1 of the linear bushings alone, shape (2,)."""
        if self.model.fixed:
            return np.array(self.model.fixed)
        rig = self.model.rig
        start = np.array([rig.bushing_radial_stiffness, rig.bushing_radial_damping])
        everything, free = np.ones(len(self.segments), dtype=bool), np.ones(2, dtype=bool)
        return SegmentCost(self, (), Prior.none(2), everything, free).least(start)[0]

    @cached_property
    def _known_solutions(self) -> dict[Effects, list[Solution]]:
        return {}

    def _solutions(self, effects: Effects) -> list[Solution]:
        if effects not in self._known_solutions:
            self._known_solutions[effects] = solutions(self._signatures, effects, self._known)
        return self._known_solutions[effects]


def mounting_problem(campaign: Campaign, measured_laws: Sequence[Law] = ()) -> MountingProblem:
    """Problem of a campaign of kind ``mounting``; laws of files are further candidates."""
    records = mounting_records(campaign)
    added = law_cards(measured_laws)
    cards, laws = force_library(KIND, (*MOUNTING_CARDS, *added))
    cards = {name: card for name, card in cards.items() if name not in campaign.baseline.impossible}
    rig = MountingRig.from_table(campaign.rig)
    model = MountingModel(
        rig=rig,
        scale=mounting_scale(rig, records),
        cards=cards,
        laws=laws,
        contained=tuple(campaign.baseline.effects),
        known=known_physics(campaign),
        channels=tuple(channel.name for channel in campaign.channels),
        sensors=tuple(str(channel.sensor) for channel in campaign.channels),
        measured={law.name: law for law in measured_laws},
    )
    declared = all(channel.noise_std is not None for channel in campaign.channels)
    return MountingProblem(model, records, declared)


def mounting_with_prediction(problem: MountingProblem, campaign: Campaign) -> MountingProblem:
    """Problem whose baseline is the prediction in the run files, K1 and C1 those that it obeys.

    The differences that laws make are those of such bushings.
    """
    # The floor is the measurement's: a prediction has no noise to be estimated.
    channels = tuple(replace(channel, noise_std=0.0) for channel in campaign.channels)
    runs = tuple(replace(run, signals=run.predictions) for run in campaign.runs)
    simulated = mounting_records(replace(campaign, channels=channels, runs=runs))
    linear = problem.model.without_effects()
    # Of a prediction that is early or in another unit the least squares may be no bushings; the
    # difference steps stay inside the bounds too.
    physical = [
        (p.lower + MountingProblem.difference * p.scale, p.upper) for p in linear.of_baseline()
    ]
    linear_fit = np.clip(
        replace(problem, model=linear, records=simulated).bare_fit(), *np.transpose(physical)
    )
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


def trial_loads(
    torque: float, radial_load: float, shares: Sequence[float]
) -> tuple[FloatArray, dict[str, Mapping[str, FloatArray]]]:
    """Time [s], and loads by their text, up to a torque [N m] and a radial load [N].

    Torque, vertical and sideways load alone as a slow and a fast sine of some shares of the limit;
    torque with a sine beside a constant load.
    """
    time = STEP * np.arange(round(LENGTH / STEP), dtype=np.float64)
    rise = np.asarray(np.clip((time - 5.0) / 10.0, 0.0, 1.0), dtype=np.float64)
    loads: dict[str, Mapping[str, FloatArray]] = {}
    for name, words, largest, unit in (
        ("torque", "torque", torque, "kN m"),
        ("ntl_z", "vertical load", radial_load, "kN"),
        ("ntl_y", "sideways load", radial_load, "kN"),
    ):
        for share in shares:
            for frequency in _FREQUENCIES:
                size = f"{share * largest / 1e3:g} {unit}"
                text = f"{words} alone, a sine of {frequency:g} Hz and {size}"
                wave = share * largest * rise * np.sin(2.0 * np.pi * frequency * time)
                loads[text] = {name: wave}
    wave = 0.5 * torque * rise * (1.0 + 0.5 * np.sin(np.pi * time))
    for name, words in (("ntl_z", "vertical"), ("ntl_y", "sideways")):
        text = (
            f"torque of {0.5 * torque / 1e3:g} kN m with a sine of 0.5 Hz and "
            f"{0.25 * torque / 1e3:g} kN m with a constant {words} load of "
            f"{radial_load / 1e3:g} kN"
        )
        loads[text] = {"torque": wave, name: radial_load * rise}
    return time, loads


def blank_record(
    record: MountingRecord, name: str, time: FloatArray, loads: Mapping[str, FloatArray]
) -> MountingRecord:
    """Record under some loads without signals."""
    names = ("torque", "speed", "carrier_angle", "ntl_y", "ntl_z")
    columns = {load: loads.get(load, np.zeros(time.size)) for load in names}
    return replace(
        record,
        name=name,
        condition=name,
        inputs=MountingInputs.from_columns(time, columns),
        measured=np.zeros((time.size, record.measured.shape[1])),
        block=np.arange(time.size) * _BLOCKS // time.size,
    )
