"""The kind "element" as a plant of the diagnosis.

Both drives, its library, sums by block and band.
"""

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.comparison.effect_cards import EffectCard, effect_library
from carrierflex.diagnosis.comparison.pictures import Picture
from carrierflex.diagnosis.comparison.problem import (
    BoolArray,
    CandidateExperiment,
    Effects,
    FloatArray,
    GapCell,
    Parameter,
    Segment,
    SegmentSums,
    Signatures,
)
from carrierflex.diagnosis.element.bands import BandTable, band_table, block_squares
from carrierflex.diagnosis.element.cards import ELEMENT_CARDS, KIND, NEGATIVE_CONTROLS
from carrierflex.diagnosis.element.experiments import element_experiments
from carrierflex.diagnosis.element.gap_findings import element_findings, element_scalars
from carrierflex.diagnosis.element.gap_map import element_gap_cells, element_where_text
from carrierflex.diagnosis.element.growth import growth_exponent, growth_words
from carrierflex.diagnosis.element.model import (
    ElementModel,
    ElementScale,
    compiled_laws,
    substeps_for,
)
from carrierflex.diagnosis.element.pictures import element_loops
from carrierflex.diagnosis.element.records import ElementRecord, element_records, noise_variance
from carrierflex.diagnosis.element.scale import element_scale
from carrierflex.diagnosis.element.signatures import Column, element_signatures, signature_columns
from carrierflex.diagnosis.element.starts import element_starts
from carrierflex.diagnosis.gap.findings import GapFindings, Scalar
from carrierflex.identification.campaign.campaign import Campaign

#: Step of the derivatives by differences, relative to a parameter or a tenth of its scale.
_DIFFERENCE = 1e-5
#: Samples of all runs from which threads are worth their start.
_THREADED = 2_000


@dataclass(frozen=True, eq=False)
class ElementProblem:
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
    """

    model: ElementModel
    records: tuple[ElementRecord, ...]
    noise: FloatArray
    noise_is_measured: bool
    channel: str
    noise_is_declared: bool = False

    @property
    def unit(self) -> str:
        """Unit of the channel."""
        return self.model.units[1 if self.model.by_force else 0]

    @property
    def n_channels(self) -> int:
        """Signals that are compared."""
        return 1

    @cached_property
    def cards(self) -> Mapping[str, EffectCard]:
        """Candidates by id."""
        left_out = {*self.model.contained, *self.negative_controls}
        return {name: card for name, card in self.model.cards.items() if name not in left_out}

    @property
    def negative_controls(self) -> Effects:
        """Forces without meaning."""
        return tuple(card.id for card in NEGATIVE_CONTROLS)

    @cached_property
    def segments(self) -> tuple[Segment, ...]:
        """Blocks of the runs."""
        return tuple(
            Segment(record.name, record.condition, block, int((record.block == block).sum()))
            for record in self.records
            for block in range(record.n_blocks)
        )

    @cached_property
    def bands(self) -> BandTable:
        """Bands of frequency of the score."""
        return band_table(self.records, self.noise)

    @property
    def cell_counts(self) -> FloatArray:
        """Degrees of freedom by piece and band."""
        return self.bands.counts

    @property
    def noise_square(self) -> FloatArray:
        """Sum of squares of the noise by piece and band."""
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
        n, p = len(self.segments), theta.size
        matrix, right, square = np.zeros((n, p, p)), np.zeros((n, p)), np.zeros(n)
        runs = self._chosen_runs(chosen)
        residuals = self._in_threads(
            lambda k: self._residual(runs[k][0], effects, theta), len(runs)
        )
        rows_of = self._derivatives([record for record, _ in runs], effects, theta, residuals)
        for (record, places), residual, rows in zip(runs, residuals, rows_of, strict=True):
            if not np.isfinite(residual).all():
                square[places] = np.inf
                continue
            for block, place in enumerate(places):
                own, left = rows[:, record.block == block], residual[record.block == block]
                matrix[place], right[place], square[place] = own @ own.T, own @ left, left @ left
        return SegmentSums(matrix, right, square)

    def squares(self, effects: Effects, theta: FloatArray, chosen: BoolArray) -> FloatArray:
        """Squared residuals by piece and band; infinite where the model runs away."""
        result = np.zeros(self.cell_counts.shape)
        runs = self._chosen_runs(chosen)
        residuals = self._in_threads(
            lambda k: self._residual(runs[k][0], effects, theta), len(runs)
        )
        for (record, places), residual in zip(runs, residuals, strict=True):
            result[places] = block_squares(record, residual, self.bands.edges_hz)
        return result

    def signatures(self) -> Signatures:
        """Columns of force space."""
        return self._signatures

    def gap_cells(self, effects: Effects, theta: FloatArray) -> tuple[GapCell, ...]:
        """Gap by line or band and run."""
        return element_gap_cells(
            self.records, self._residuals(effects, theta), self.noise, channel=self.channel
        )

    def where_text(self, effects: Effects, theta: FloatArray) -> str:
        """One sentence."""
        cells, exponent = (
            self.gap_cells(effects, theta),
            growth_exponent(self.model, self.records, self.noise),
        )
        return element_where_text(
            cells, self.records, by_force=self.model.by_force, growth=growth_words(exponent)
        )

    def gap_findings(self, effects: Effects, theta: FloatArray) -> GapFindings:
        """Gap by block, incoherent part, growth and parity."""
        own, cells, known = (
            self._residuals(effects, theta),
            self.gap_cells(effects, theta),
            self.noise_is_declared,
        )
        return element_findings(
            self.model,
            self.records,
            own,
            cells,
            noise=self.noise,
            is_declared=known,
            channel=self.channel,
        )

    def scalars(self, effects: Effects, theta: FloatArray) -> Sequence[Scalar]:
        """Peak to peak and RMS of a model."""
        return element_scalars(self.records, self._residuals(effects, theta), self.unit)

    def pictures(self, effects: Effects, theta: FloatArray) -> tuple[Picture, ...]:
        """Force-space loops for the report."""
        return element_loops(self.model, self.records, effects, theta)

    def with_signals_of(self, effects: Effects, theta: FloatArray) -> "ElementPlant":
        """ComparisonProblem that measured what a model predicts."""
        records = []
        for record in self.records:
            predicted = self.model.predicted(record, effects, theta)
            records.append(
                record.with_response(predicted)
                if self.model.by_force
                else record.with_force(predicted)
            )
        return replace(self, records=tuple(records))

    def candidate_experiments(self) -> Sequence[CandidateExperiment]:
        """Drives that were not applied."""
        return element_experiments(self)

    def numerical_error(self, effects: Effects, theta: FloatArray) -> float:
        """RMS change of the prediction with half the step."""
        if not self.model.by_force:
            return 0.0
        changes = [
            self.model.predicted(record, effects, theta, refined=2)
            - self.model.predicted(record, effects, theta)
            for record in self.records
        ]
        return float(np.sqrt(np.mean(np.concatenate(changes) ** 2)))

    @cached_property
    def _columns(self) -> tuple[Column, ...]:
        return signature_columns(self.model)

    @cached_property
    def _signatures(self) -> Signatures:
        return element_signatures(self.model, self.records)

    def _chosen_runs(self, chosen: BoolArray) -> list[tuple[ElementRecord, NDArray[np.int64]]]:
        """Runs with a chosen piece, and the numbers of all their pieces."""
        first, runs = 0, []
        for record in self.records:
            places = np.arange(first, first + record.n_blocks)
            if chosen[places].any():
                runs.append((record, places))
            first += record.n_blocks
        return runs

    def _residuals(self, effects: Effects, theta: FloatArray) -> list[FloatArray]:
        return [self._residual(record, effects, theta) for record in self.records]

    def _residual(self, record: ElementRecord, effects: Effects, theta: FloatArray) -> FloatArray:
        """Measured less predicted; zero where nothing was measured."""
        residual = record.response - self.model.predicted(record, effects, theta)
        if not np.isfinite(residual).all():  # the motion ran away
            return np.where(record.block >= 0, np.inf, 0.0)
        return np.where(record.block >= 0, residual, 0.0)

    def _derivatives(
        self,
        records: Sequence[ElementRecord],
        effects: Effects,
        theta: FloatArray,
        residuals: Sequence[FloatArray],
    ) -> list[FloatArray]:
        """Change of the prediction of every run by every parameter, shape (p, n) each."""

        def row(place: int) -> FloatArray:
            r, k = divmod(place, theta.size)
            parameter, residual = parameters[k], residuals[r]
            if not np.isfinite(residual).all():
                return np.zeros(residual.size)
            step = _DIFFERENCE * max(abs(theta[k]), 0.1 * parameter.scale)
            step = -step if theta[k] + step > parameter.upper else step
            moved = theta.copy()
            moved[k] += step
            changed = self._residual(records[r], effects, moved)
            return (
                (residual - changed) / step
                if np.isfinite(changed).all()
                else np.zeros(residual.size)
            )

        parameters = self.parameters(effects)
        rows = self._in_threads(row, len(records) * theta.size)
        return [np.array(rows[r * theta.size : (r + 1) * theta.size]) for r in range(len(records))]

    def _in_threads(self, work: Callable[[int], FloatArray], count: int) -> list[FloatArray]:
        """Results of a piece of work for every number; the compiled motion holds no lock."""
        if sum(own.response.size for own in self.records) < _THREADED:
            return list(map(work, range(count)))
        with ThreadPoolExecutor(os.cpu_count()) as threads:
            return list(threads.map(work, range(count)))


def element_problem(campaign: Campaign) -> ElementProblem:
    """ComparisonProblem of a campaign of kind ``element``.

    Parameters
    ----------
    campaign : Campaign
        Measured runs and the effects the baseline contains.

    Returns
    -------
    ElementProblem
        Ready to be diagnosed.

    Raises
    ------
    ValueError
        Where a signal is missing throughout or constant, or a record is too short.
    """
    records = element_records(campaign)
    noise, measured = noise_variance(campaign, records)
    by_force = campaign.rig["drive"] == "force"
    channel = campaign.channels[0]
    input_name, input_unit = next(iter(campaign.contract.inputs.items()))
    _refuse_mixed_units(campaign, input_name)
    input_unit = campaign.input_units.get(input_name, input_unit)
    units = (input_unit, channel.unit) if by_force else (channel.unit, input_unit)
    cards = {**effect_library(KIND, ELEMENT_CARDS), **{card.id: card for card in NEGATIVE_CONTROLS}}
    unscaled = ElementModel(
        by_force=by_force,
        mass=campaign.rig.get("mass"),
        scale=ElementScale(1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0),
        cards=cards,
        contained=tuple(campaign.baseline.effects),
        units=units,
        substeps=1,
        laws=compiled_laws(cards),
    )
    scale = element_scale(unscaled, records)
    model = replace(
        unscaled, scale=scale, substeps=substeps_for(scale, max(record.step for record in records))
    )
    return ElementProblem(
        model, records, noise, measured, channel.name, channel.noise_std is not None
    )


def _refuse_mixed_units(campaign: Campaign, input_name: str) -> None:
    """A voltage analogue declares both units.

    With one of them in SI the parameters would have none that make sense.
    """
    channel = campaign.channels[0]
    foreign = channel.unit != campaign.contract.quantities[channel.quantity]
    declared = campaign.input_units.get(input_name, campaign.contract.inputs[input_name])
    foreign_input = declared != campaign.contract.inputs[input_name]
    if foreign != foreign_input:
        raise ValueError(
            f"[[channels]]: unit of '{channel.name}' is {channel.unit} and that of the input '{input_name}' is {declared}; "
            "expected both in SI units, or both declared as an analogue"
        )
