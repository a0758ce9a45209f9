"""The kind "element" as a comparison problem of the diagnosis.

Both drives, its library, sums by block and band.
"""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from carrierflex.diagnosis.classes.gram_table import GramTable
from carrierflex.diagnosis.classes.results import ClassAnswer
from carrierflex.diagnosis.comparison.effect_cards import EffectCard, force_library
from carrierflex.diagnosis.comparison.finite_differences import (
    DifferencedResiduals,
    step_halving_error,
)
from carrierflex.diagnosis.comparison.known_physics import DeclaredGains, known_physics
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
from carrierflex.diagnosis.element.cards import ELEMENT_CARDS, KIND
from carrierflex.diagnosis.element.channel_noise import (
    carried_noise,
    declared_gains,
    noise_variance,
)
from carrierflex.diagnosis.element.classes.answer import answer_of_table
from carrierflex.diagnosis.element.classes.drive_in_time import has_one_frequency
from carrierflex.diagnosis.element.classes.fitted_force import parameter_shift
from carrierflex.diagnosis.element.classes.floor import believable_noise
from carrierflex.diagnosis.element.classes.limits import element_limits
from carrierflex.diagnosis.element.classes.measured.measured_laws import law_cards
from carrierflex.diagnosis.element.classes.measured.shapes import measured_shape
from carrierflex.diagnosis.element.classes.table import ElementTable, element_table
from carrierflex.diagnosis.element.experiments import element_experiments
from carrierflex.diagnosis.element.gap_findings import element_findings, element_scalars
from carrierflex.diagnosis.element.gap_map import element_gap_cells
from carrierflex.diagnosis.element.linear import element_scale
from carrierflex.diagnosis.element.model import ElementModel, ElementScale
from carrierflex.diagnosis.element.pictures import element_loops
from carrierflex.diagnosis.element.records import (
    ElementRecord,
    element_records,
    measured_states,
    refuse_mixed_units,
)
from carrierflex.diagnosis.element.score_cells import ScoreCells, score_cells, segment_squares
from carrierflex.diagnosis.element.signatures import Column, element_signatures, signature_columns
from carrierflex.diagnosis.element.starts import element_starts
from carrierflex.diagnosis.element.wiring.one_frequency import delay_words
from carrierflex.diagnosis.gap.findings import GapFindings, Scalar
from carrierflex.diagnosis.kind.comparison_problem import CandidateExperiment, ComparisonProblem
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.simulation.element.drives import BY_FORCE, FORCE, FREE_DECAY, PER_MASS
from carrierflex.simulation.element.law_forces import element_law
from carrierflex.simulation.laws import Law

#: Step of the derivatives by differences, relative to a parameter or a tenth of its scale.
_DIFFERENCE = 1e-5
#: Samples of all runs from which threads are worth their start.
_THREADED = 2_000


@dataclass(frozen=True, eq=False)
class ElementProblem(ComparisonProblem):
    """One element, its records and its library.

    See :class:`carrierflex.diagnosis.comparison.problem.ComparisonProblem`.

    Parameters
    ----------
    model : ElementModel
        Parameters and simulator.
    records : tuple of ElementRecord
        Runs.
    noise : ndarray, shape (n_runs,)
        Variance of the channel's noise by run.
    noise_is_measured : bool
        Whether it was declared or comes from repeats.
    channel : str
        Name of the channel.
    noise_is_declared : bool
        Whether the campaign declares it, so that the scatter of repeats can be held against it.
    noise_note : str
        What the records cannot say of their noise; empty where the floor is known.
    table : ElementTable, optional
        Table of the classes of these records, where the floor was judged by it.
    """

    model: ElementModel
    records: tuple[ElementRecord, ...]
    noise: FloatArray
    noise_is_measured: bool
    channel: str
    noise_is_declared: bool = False
    noise_note: str = ""
    table: ElementTable | None = None

    @property
    def unit(self) -> str:
        """Unit of the channel."""
        return self.model.units[1 if self.model.by_force else 0]

    @property
    def n_channels(self) -> int:
        """Signals that are compared."""
        return 1

    @property
    def gains(self) -> DeclaredGains:
        """Declared errors of the gains of force and deflection."""
        return self.model.gains

    @cached_property
    def cards(self) -> Mapping[str, EffectCard]:
        """Candidates by id."""
        left_out = self.model.contained
        return {name: card for name, card in self.model.cards.items() if name not in left_out}

    @cached_property
    def segments(self) -> tuple[Segment, ...]:
        """Blocks of the runs."""
        return tuple(
            Segment(record.name, record.condition, block, int((record.block == block).sum()))
            for record in self.records
            for block in range(record.n_blocks)
        )

    @cached_property
    def bands(self) -> ScoreCells:
        """Bands of frequency of the score."""
        return score_cells(self.records, self.noise)

    @property
    def cell_counts(self) -> FloatArray:
        """Degrees of freedom by segment and band."""
        return self.bands.counts

    @property
    def noise_square(self) -> FloatArray:
        """Sum of squares of the noise by segment and band."""
        return self.bands.noise_square

    def parameters(self, effects: Effects) -> tuple[Parameter, ...]:
        """Unknowns of a set."""
        return self.model.parameters(effects)

    def starts(
        self, effects: Effects, known: Mapping[tuple[str, str], float]
    ) -> Sequence[FloatArray]:
        """Starts from force space."""
        return element_starts(self.model, self._signatures, self._columns, effects, known)

    def sums(self, effects: Effects, theta: FloatArray, chosen: BoolArray) -> SegmentSums:
        """Gauss-Newton sums with derivatives by forward differences."""
        return self.differenced(effects).sums(theta, chosen)

    def squares(self, effects: Effects, theta: FloatArray, chosen: BoolArray) -> FloatArray:
        """Squared residuals by segment and band; infinite where the motion diverges."""
        result = np.zeros(self.cell_counts.shape)
        for record, segments, residual in self.differenced(effects).chosen(theta, chosen):
            result[segments] = segment_squares(record, residual, self.bands.edges_hz)
        return result

    def gap_cells(self, effects: Effects, theta: FloatArray) -> Sequence[GapCell]:
        """Gap by line or band and run."""
        return element_gap_cells(
            self.records, self._residuals(effects, theta), self.noise, channel=self.channel
        )

    def gap_findings(self, effects: Effects, theta: FloatArray) -> GapFindings:
        """Where the gap lies, by block, run-to-run scatter, growth and parity."""
        return element_findings(
            self.model,
            self.records,
            self._residuals(effects, theta),
            self.gap_cells(effects, theta),
            noise=self.noise,
            is_declared=self.noise_is_declared,
            channel=self.channel,
        )

    def scalars(self, effects: Effects, theta: FloatArray) -> Sequence[Scalar]:
        """Peak to peak and RMS of a model."""
        return element_scalars(self.records, self._residuals(effects, theta), self.unit)

    def pictures(self, effects: Effects, theta: FloatArray) -> tuple[Picture, ...]:
        """Force-space loops for the report."""
        return element_loops(self.model, self.records, effects, theta)

    def overlays(self, effects: Effects, theta: FloatArray) -> Sequence[Overlay]:
        """Response of every run as measured and as a model has it."""
        return [
            signal_overlay(own.name, self.channel, own.step, own.response, residual)
            for own, residual in zip(self.records, self._residuals(effects, theta), strict=True)
        ]

    def candidate_experiments(self) -> Sequence[CandidateExperiment]:
        """Drives that were not applied."""
        return element_experiments(self.model, self.records, self._with_record)

    def numerical_error(self, effects: Effects, theta: FloatArray) -> float:
        """RMS change of the prediction with half the step."""
        if not self.model.by_force:
            return 0.0
        return step_halving_error(
            self.records,
            lambda record, factor: self.model.predicted(record, effects, theta, refined=factor),
        )

    def class_answer(self) -> ClassAnswer | None:
        """Class of the missing effect."""
        own = self.class_table
        if own is None:
            return None
        return answer_of_table(
            own,
            self.model,
            self.noise_note,
            lambda table: partial(measured_shape, table, self.model.units),
        )

    def gram_table(self) -> GramTable | None:
        """Products of classes and laws; None where the records are too short."""
        return None if self.class_table is None else self.class_table.table

    @cached_property
    def class_table(self) -> ElementTable | None:
        """Table of the classes; None where the records are too short for it."""
        if self.table is not None:
            return self.table
        return element_table(self.model, self.records, self.noise, element_limits())

    @property
    def signal_square(self) -> float:
        """Sum of squares of the response about its mean, all runs."""
        responses = [record.response[record.counts] for record in self.records]
        return float(sum(np.sum((own - own.mean()) ** 2) for own in responses))

    @cached_property
    def has_one_frequency(self) -> bool:
        """Whether one and the same frequency drives all runs."""
        return has_one_frequency([(own.drive[own.counts], own.step) for own in self.records])

    def discrepancy_shift(self, effects: Effects, theta: FloatArray) -> FloatArray:
        """Shift of the parameters beside a discrepancy; zero without a table of the classes."""
        parameters = self.parameters(effects)
        if self.class_table is None:
            return np.zeros(len(parameters))
        return parameter_shift(self.model, self.class_table, parameters, theta)

    def delay_words(self, theta: FloatArray) -> str:
        """What a delay of half a sample does to the damping at one frequency."""
        return delay_words(self.model, self.records, theta) if self.has_one_frequency else ""

    @cached_property
    def _columns(self) -> tuple[Column, ...]:
        return signature_columns(self.model)

    @cached_property
    def _signatures(self) -> Signatures:
        return element_signatures(self.model, self.records)

    def differenced(self, effects: Effects) -> DifferencedResiduals[ElementRecord]:
        """Residuals of a set of effects as a function of its parameters."""
        n_samples = sum(record.response.size for record in self.records)
        return DifferencedResiduals(
            self.records,
            lambda record, theta: self._residual(record, effects, theta),
            self.parameters(effects),
            relative_step=_DIFFERENCE,
            n_threads=(os.cpu_count() or 1) if n_samples >= _THREADED else 1,
        )

    def _residuals(self, effects: Effects, theta: FloatArray) -> list[FloatArray]:
        return [self._residual(record, effects, theta) for record in self.records]

    def _residual(self, record: ElementRecord, effects: Effects, theta: FloatArray) -> FloatArray:
        """Measured less predicted; zero where nothing was measured."""
        residual = record.response - self.model.predicted(record, effects, theta)
        if not np.isfinite(residual).all():  # the motion diverged
            return np.where(record.block >= 0, np.inf, 0.0)
        return np.where(record.block >= 0, residual, 0.0)

    def _with_record(self, model: ElementModel, record: ElementRecord) -> "ElementProblem":
        """ComparisonProblem that measured one other record."""
        return replace(self, model=model, records=(record,), noise=self.noise[:1], table=None)


def element_problem(campaign: Campaign, measured_laws: Sequence[Law] = ()) -> ElementProblem:
    """ComparisonProblem of a campaign of kind ``element``.

    Parameters
    ----------
    campaign : Campaign
        Measured runs and the effects the baseline contains.
    measured_laws : sequence of Law
        Laws of files, further candidates.

    Returns
    -------
    ElementProblem
        Ready to be diagnosed.

    Raises
    ------
    ValueError
        Where a signal is missing throughout or constant, a record is too short, or a law has other
        units.
    """
    records = element_records(campaign)
    noise, measured = noise_variance(campaign, records)
    drive, mass = campaign.rig["drive"], campaign.rig.get("mass")
    channel = campaign.channels[0]
    refuse_mixed_units(campaign)
    per_mass = drive in PER_MASS and mass is None
    units = _units(campaign, per_mass=per_mass)
    added = law_cards(measured_laws, units)
    cards, laws = force_library(KIND, (*ELEMENT_CARDS, *added))
    cards = {name: card for name, card in cards.items() if name not in campaign.baseline.impossible}
    unscaled = ElementModel(
        by_force=drive in BY_FORCE,
        # Without a mass, forces are per mass.
        mass=1.0 if per_mass else mass,
        scale=ElementScale(1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0),
        cards=cards,
        contained=tuple(campaign.baseline.effects),
        units=units,
        substeps=1,
        laws=laws,
        known=known_physics(campaign),
        states=measured_states(records) if drive == FREE_DECAY else {},
        per_mass=per_mass,
        gains=declared_gains(campaign),
        measured={law.name: element_law(law) for law in measured_laws},
    )
    scale = element_scale(unscaled, records)
    model = replace(
        unscaled, scale=scale, substeps=scale.substeps(max(record.step for record in records))
    )
    carried = [carried_noise(model, record) for record in records]
    noise = noise + np.array(carried)
    note, table = "", None
    if not measured:
        noise, note, table = believable_noise(model, records, noise)
    return ElementProblem(
        model,
        records,
        noise,
        measured,
        channel.name,
        noise_is_declared=channel.noise_std is not None,
        noise_note=note,
        table=table,
    )


def _units(campaign: Campaign, *, per_mass: bool) -> tuple[str, str]:
    """Units of force and deflection."""
    channel, drive = campaign.channels[0], campaign.rig["drive"]
    if drive in PER_MASS:
        return (f"{channel.unit}/s^2" if per_mass else "N"), channel.unit
    input_unit = next(iter(campaign.input_units.values()))
    return (input_unit, channel.unit) if drive == FORCE else (channel.unit, input_unit)
