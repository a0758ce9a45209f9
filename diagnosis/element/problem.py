"""The kind "element" as a comparison problem of the diagnosis.

Both drives, its library, sums by block and band; trial drives; another simulator as its baseline.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.gram_table import GramTable, discrepancy_shift
from carrierflex.diagnosis.classes.results import ClassAnswer
from carrierflex.diagnosis.comparison.effect_cards import EffectCard, card_of_force, force_library
from carrierflex.diagnosis.comparison.known_physics import DeclaredGains, known_physics
from carrierflex.diagnosis.comparison.overlay import Picture
from carrierflex.diagnosis.comparison.problem import Effects, FloatArray, Signatures
from carrierflex.diagnosis.element.answer import answer_of_table
from carrierflex.diagnosis.element.columns import force_derivatives, holds_shapes
from carrierflex.diagnosis.element.force_records import has_one_frequency, while_moving
from carrierflex.diagnosis.element.gap import ElementGap, element_loops
from carrierflex.diagnosis.element.model import ElementModel, ElementScale
from carrierflex.diagnosis.element.motion import with_likely_start
from carrierflex.diagnosis.element.noise import (
    carried_noise,
    declared_gains,
    noise_variance,
    scatter_is_noise,
)
from carrierflex.diagnosis.element.records import (
    ElementRecord,
    element_records,
    prepared_record,
    refuse_mixed_units,
    run_in_use,
)
from carrierflex.diagnosis.element.shapes import beyond_visited, law_cards
from carrierflex.diagnosis.element.signatures import (
    Column,
    element_scale,
    element_signatures,
    element_starts,
)
from carrierflex.diagnosis.element.table import ElementTable, element_table
from carrierflex.diagnosis.element.wiring import element_clocks, element_rivals
from carrierflex.diagnosis.inference.effect_fit import fit_effects, mean_square_of
from carrierflex.diagnosis.inference.thresholds import Thresholds
from carrierflex.diagnosis.kind.comparison_problem import CandidateExperiment
from carrierflex.diagnosis.kind.problem_in_time import ProblemInTime, edges_of_bands_hz
from carrierflex.diagnosis.wiring.refits import WiringChecks
from carrierflex.files.quantities import sized
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.signals import even_time, filled
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning
from carrierflex.simulation.element.drives import BY_FORCE, FORCE, FREE_DECAY, PER_MASS
from carrierflex.simulation.element.effects import ELEMENT_EFFECTS
from carrierflex.simulation.element.law_forces import ElementLaw, element_law
from carrierflex.simulation.laws import ELEMENT, Law

ELEMENT_CARDS = tuple(card_of_force(effect, ELEMENT) for effect in ELEMENT_EFFECTS.values())
#: Bands of frequency of the score.
_BANDS = 16
#: Limits of every kind, and one more weight of the penalties, at which a curve is straight but for
#: what all records show: where one block goes further than the others, any less leaves there the
#: square of a spline's swing.
_LIMITS = ClassConstants(ridges=(*ClassConstants().ridges, 1.0))
_UNKNOWN_FLOOR = (
    "the plateau of the spectrum lies far below what no class can learn, as after a low-pass filter"
)
_NO_NOISE = (
    "what differs from period to period is far above the noise at high frequencies: something "
    "changes in time that the model does not have"
)
_FLOOR_NOTE = (
    f"the noise floor cannot be known from these records ({_UNKNOWN_FLOOR}): what no class learns "
    "is taken as the floor, and the verdict rests on shares"
)
#: Trial drives: factors on the amplitude, frequencies over the natural one, samples, cycles.
_AMPLITUDES = (0.25, 0.5, 2.0)
_FREQUENCIES = (0.1, 0.5, 1.0, 2.0)
_SAMPLES = 4096
_CYCLES = 12


@dataclass(frozen=True, eq=False)
class ElementProblem(ProblemInTime[ElementModel, ElementRecord]):
    """One element, its records and its library."""

    noise_is_measured: bool  # Whether it was declared or comes from repeats
    #: Whether the campaign declares it, so that the scatter of repeats is compared with it
    noise_is_declared: bool = False
    #: What the records cannot say of their noise; empty where the floor is known
    noise_note: str = ""
    scatter_note: str = ""  # Why what does not repeat cannot all be noise; empty where it may
    #: Table of the classes of these records, where the floor was judged by it
    table: ElementTable | None = None
    difference = 1e-5

    def __getstate__(self) -> dict[str, Any]:
        """What it is made of but for the table of the classes, which no fit asks for."""
        state = {field.name: getattr(self, field.name) for field in fields(self)}
        return {**state, "table": None}

    @property
    def unit(self) -> str:
        """Unit of the channel."""
        return self.model.response_unit

    @property
    def gains(self) -> DeclaredGains:
        """Declared errors of the gains of force and deflection."""
        return self.model.gains

    @cached_property
    def edges_hz(self) -> FloatArray:
        """Ends of the bands of the score [Hz]."""
        return edges_of_bands_hz(self.records, _BANDS)

    def simulator(self, effects: Effects) -> Callable[[ElementRecord, FloatArray, int], FloatArray]:
        """Response that a parameter set predicts for a record."""
        return lambda record, theta, refined: self.model.predicted(
            record, effects, theta, refined=refined
        )

    def starts(
        self, effects: Effects, known: Mapping[tuple[str, str], float]
    ) -> Sequence[FloatArray]:
        """Starts from force space."""
        return element_starts(self.model, self._signatures, effects, known)

    def gap(self, effects: Effects, theta: FloatArray) -> ElementGap:
        """Gap by line or band and run."""
        residuals = self.residuals(effects, theta)
        return ElementGap(self.model, self.records, residuals, self.noise_is_declared)

    def pictures(self, effects: Effects, theta: FloatArray) -> tuple[Picture, ...]:
        """Force-space loops for the report."""
        return element_loops(self.model, self.records, effects, theta)

    def candidate_experiments(self) -> Sequence[CandidateExperiment]:
        """Drives that were not applied."""
        model = self.model
        if model.states:
            # A release is repeated from another deflection by hand: no drive is to be chosen.
            return ()
        largest = max(self.records, key=lambda record: float(record.drive.std()))
        mean, size = float(largest.drive.mean()), float(largest.drive.std())
        last = largest.drive[-min(_SAMPLES, largest.drive.size) :]
        trials = [
            CandidateExperiment(
                f"the drive of run {largest.name} at {factor:g} times its amplitude",
                partial(self._trial, mean + factor * (last - mean), largest.step),
            )
            for factor in _AMPLITUDES
        ]
        unit = model.units[0 if model.by_force else 1]
        scale = model.scale
        # About the natural frequency, or the mean frequency of the motion.
        is_resonant = scale.m > 0.0 and scale.K1 > 0.0
        omega = np.sqrt(scale.K1 / scale.m) if is_resonant else scale.speed / scale.deflection
        for factor_of_frequency in _FREQUENCIES:
            frequency = float(factor_of_frequency * omega / (2.0 * np.pi))
            step = min(largest.step, 1.0 / (40.0 * frequency))
            time = step * np.arange(min(_SAMPLES, int(_CYCLES / (frequency * step))))
            for factor in (0.5, 1.0, 2.0):
                amplitude = np.sqrt(2.0) * factor * size
                drive = mean + amplitude * np.sin(2.0 * np.pi * frequency * time)
                text = f"a steady sine of {frequency:.3g} Hz and amplitude {sized(amplitude, unit)}"
                trials.append(CandidateExperiment(text, partial(self._trial, drive, step)))
        return trials

    def _trial(
        self, drive: FloatArray, step: float, effects: Effects, theta: FloatArray
    ) -> "ElementProblem | None":
        """One record under a drive, its response that of a model; its first quarter settles."""
        stepped = replace(self.model, substeps=self.model.scale.substeps(step))
        counts = np.arange(drive.size) >= drive.size // 4

        def record(response: FloatArray) -> ElementRecord:
            trial = prepared_record(
                ("trial", "trial"), step, drive, response, by_force=stepped.by_force, counts=counts
            )
            return replace(trial, noise=self.records[0].noise)

        blank = record(np.linspace(0.0, stepped.scale.deflection, drive.size))
        predicted = stepped.predicted(blank, effects, theta)
        if not np.isfinite(predicted).all():
            return None
        return replace(self, model=stepped, records=(record(predicted),), table=None)

    def class_answer(self) -> ClassAnswer | None:
        """Class of the missing effect."""
        if self.class_table is None:
            return None
        return answer_of_table(self.class_table, self.noise_note)

    def gram_table(self) -> GramTable | None:
        """Products of classes and laws; None where the records are too short."""
        return None if self.class_table is None else self.class_table.table

    @cached_property
    def class_table(self) -> ElementTable | None:
        """Table of the classes; None where the records are too short for it."""
        if self.table is not None:
            return self.table
        return element_table(self.model, self.records, _LIMITS)

    @property
    def signal_square(self) -> float:
        """Sum of squares of the response about its mean, all runs."""
        responses = [record.response[record.counts] for record in self.records]
        return float(sum(np.sum((response - response.mean()) ** 2) for response in responses))

    @property
    def unknown_floor(self) -> str:
        """Why the noise floor is not known; empty where records or declarations bound it."""
        return _UNKNOWN_FLOOR if self.noise_note else self.scatter_note

    @cached_property
    def has_one_frequency(self) -> bool:
        """Whether one and the same frequency drives all runs."""
        return has_one_frequency(self.records)

    def discrepancy_shift(self, effects: Effects, theta: FloatArray) -> FloatArray:
        """Shift of the parameters with a discrepancy of the classes; zero without their table.

        The force is taken as linear at the fit. Zero too where the table does not hold it: what its
        columns then miss would be taken for a discrepancy.
        """
        parameters, table = self.parameters(effects), self.class_table
        if table is None or not holds_shapes(table.bases.size, parameters, theta):
            return np.zeros(len(parameters))
        J = force_derivatives(self.model, table.table, table.bases.size, parameters, theta)
        # In its band the samples of a run are not all independent.
        n = sum(
            np.count_nonzero(run.counts) * min(1.0, 2.0 * run.weight.band_hz * run.step)
            for run in table.records
        )
        return discrepancy_shift(table.table, J, independent_samples=n)

    def delay_words(self, theta: FloatArray) -> str:
        """What a delay of half a sample does to the damping at one frequency.

        With ``D = K1 - m w² + i w C1``, force over deflection, and a deflection that is written tau
        late, ``x e^(-i w tau)``, ``D e^(i w tau)`` fits the records as well as D does: in first
        order ``C1' = C1 + tau (K1 - m w²)`` and ``K1' - m' w² = K1 - m w² - tau w² C1``.
        """
        if not self.has_one_frequency:
            return ""
        model = self.model
        named = zip(model.parameters(()), theta, strict=False)
        values = {"m": model.mass or 0.0} | {unknown.name: float(value) for unknown, value in named}
        speed_ratio = model.scale.speed / model.scale.deflection
        tau = 0.5 * max(record.step for record in self.records)
        change = abs(tau * (values["K1"] - values["m"] * speed_ratio**2))
        return (
            "one frequency drives all runs: a delay between force and deflection reads as damping "
            f"and shows in no record; half a sample ({1e3 * tau:.3g} ms) moves C1 by "
            f"{sized(change, model.unit_of((1, -1, 1)))}, tau (K1 - m w²)"
        )

    def cards_of(self, laws: Sequence[Law]) -> Sequence[EffectCard]:
        """Effect cards of measured laws."""
        return law_cards(laws, self.model.units)

    def simulated(self, law: Law) -> ElementLaw:
        """What the simulator takes of a measured law."""
        return element_law(law)

    def beyond_visited(self, law: Law) -> tuple[CampaignWarning, ...]:
        """Warnings where records leave the range in which a law of a file was measured."""
        return beyond_visited(law, self.records)

    def wiring(self, campaign: Campaign) -> WiringChecks:
        """Drive of the other sign, delay and drift of a baseline that is the model's."""
        if campaign.baseline.source != "model":
            return super().wiring(campaign)

        def refitted(other: Campaign, laws: Effects = (), shapes: Sequence[Law] = ()) -> float:
            """Mean square that the baseline, and laws, leave once fitted to a campaign."""
            return mean_square_of(_problem_of_records(other, shapes).for_laws(laws), laws)

        return WiringChecks(
            lambda: element_rivals(campaign, refitted),
            self.predictions,
            refitted,
            self.linear_records,
            lambda: element_clocks(self.records, by_force=self.model.by_force),
            with_laws=partial(self.wiring_beside, refitted),
        )

    @cached_property
    def _signatures(self) -> Signatures[Column]:
        return element_signatures(self.model, tuple(map(while_moving, self.records)))


def element_problem(campaign: Campaign, measured_laws: Sequence[Law] = ()) -> ElementProblem:
    """Problem of a campaign of kind ``element``; laws of files are further candidates."""
    problem = _problem_of_records(campaign, measured_laws)
    if problem.noise_is_measured:
        return problem
    return _with_believable_noise(problem)


def _problem_of_records(campaign: Campaign, measured_laws: Sequence[Law]) -> ElementProblem:
    """The same with the noise that the records show, whether it is believable or not."""
    records = element_records(campaign)
    noise, measured = noise_variance(campaign, records)
    records = _with_noise(records, noise)
    drive, mass = campaign.rig["drive"], campaign.rig.get("mass")
    channel = campaign.channels[0]
    refuse_mixed_units(campaign)
    per_mass = drive in PER_MASS and mass is None
    if drive in PER_MASS:
        units = (f"{channel.unit}/s^2" if per_mass else "N"), channel.unit
    else:
        input_unit = next(iter(campaign.input_units.values()))
        units = (input_unit, channel.unit) if drive == FORCE else (channel.unit, input_unit)
    added = law_cards(measured_laws, units)
    cards, laws = force_library(ELEMENT, (*ELEMENT_CARDS, *added))
    cards = {name: card for name, card in cards.items() if name not in campaign.baseline.impossible}
    unscaled = ElementModel(
        by_force=drive in BY_FORCE,
        # Without a mass, forces are per mass.
        mass=1.0 if per_mass else mass,
        scale=ElementScale(1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0),
        cards=cards,
        contained=tuple(campaign.baseline.effects),
        channels=(channel.name,),
        units=units,
        substeps=1,
        laws=laws,
        known=known_physics(campaign),
        states=(
            {record.name: record.measured_start for record in records}
            if drive == FREE_DECAY
            else {}
        ),
        per_mass=per_mass,
        gains=declared_gains(campaign),
        measured={law.name: element_law(law) for law in measured_laws},
    )
    scale = element_scale(unscaled, tuple(map(while_moving, records)))
    model = replace(
        unscaled, scale=scale, substeps=scale.substeps(max(record.step for record in records))
    )
    if model.by_force and not model.states:
        records = tuple(with_likely_start(model, record) for record in records)
    noise = noise + np.array([carried_noise(model, record) for record in records])
    records = _with_noise(records, noise)
    is_noise = not measured or channel.noise_std is not None or scatter_is_noise(records)
    return ElementProblem(
        model,
        records,
        measured,
        noise_is_declared=channel.noise_std is not None,
        scatter_note="" if is_noise else _NO_NOISE,
    )


def _with_noise(
    records: Sequence[ElementRecord], noise: Iterable[float]
) -> tuple[ElementRecord, ...]:
    return tuple(
        replace(record, noise=float(variance))
        for record, variance in zip(records, noise, strict=True)
    )


def _with_believable_noise(problem: ElementProblem) -> ElementProblem:
    """Variance of the noise raised to what no class learns where the plateau is absurd."""
    table = problem.class_table
    if table is None:
        return problem
    scores, floor = table.scores, float(table.table.floor.sum())
    classes = [scores.of((name,)).total for name in table.table.classes]
    least = min(scores.ceiling().total, *classes)
    if least <= Thresholds().most_coloured * floor:
        return replace(problem, table=table)
    # After a low-pass filter the plateau of the spectrum is what the filter let through.
    raised = [record.noise * least / max(floor, 1e-300) for record in problem.records]
    return replace(problem, records=_with_noise(problem.records, raised), noise_note=_FLOOR_NOTE)


def element_with_prediction(problem: ElementProblem, campaign: Campaign) -> ElementProblem:
    """ComparisonProblem whose baseline is the prediction in the run files.

    The inside of that simulator is unknown: mass, spring, damper and constant force are fitted to
    what it predicts and fixed there. Effects act on them, and what they change is added to the
    prediction; the gap without effects is exactly measured less predicted.
    """
    by_force = problem.model.by_force
    name = campaign.channels[0].name
    runs = [run_in_use(run) for run in campaign.runs]
    predicted = [filled(run.predictions[name], run.time, even_time(run.time)) for run in runs]
    simulated = tuple(
        record.with_response(response) if by_force else replace(record, response=response, gap=None)
        for record, response in zip(problem.records, predicted, strict=True)
    )
    linear = problem.model.without_effects()
    theta = fit_effects(replace(problem, model=linear, records=simulated, table=None), ()).theta
    records = tuple(
        replace(
            record,
            response=linear.predicted(record, (), theta) + record.response - response,
            gap=record.response - response,
        )
        for record, response in zip(problem.records, predicted, strict=True)
    )
    if not all(np.isfinite(record.response).all() for record in records):
        raise ValueError(
            f"predictions of channel {name} reach {np.abs(np.concatenate(predicted)).max():.3g}, "
            "where no mass, spring and damper moves like them under this drive; expected the "
            f"channel's unit, {campaign.channels[0].unit}"
        )
    model = replace(linear, fixed=tuple(float(value) for value in theta))
    return replace(problem, model=model, records=records, table=None)
