"""The kind "mounting" as a plant of the diagnosis: records, library, sums by block of a run."""

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property, partial

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
from carrierflex.diagnosis.gap.findings import GapFindings, Scalar
from carrierflex.diagnosis.inference.bounded_fit import minimised
from carrierflex.diagnosis.mounting.cards import (
    KIND,
    MOUNTING_CARDS,
    NEGATIVE_CONTROLS,
    ONE_CHANNEL,
)
from carrierflex.diagnosis.mounting.experiments import mounting_experiments
from carrierflex.diagnosis.mounting.gap_findings import mounting_findings, mounting_scalars
from carrierflex.diagnosis.mounting.gap_map import (
    band_edges_hz,
    block_powers,
    mounting_gap_cells,
    score_cells,
)
from carrierflex.diagnosis.mounting.gap_words import mounting_where_text
from carrierflex.diagnosis.mounting.model import Choice, MountingModel, mounting_scale
from carrierflex.diagnosis.mounting.pictures import mounting_pictures
from carrierflex.diagnosis.mounting.records import MountingRecord, mounting_records
from carrierflex.diagnosis.mounting.signatures import (
    Column,
    Solution,
    mounting_signatures,
    solutions,
    values_array,
)
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.simulation.mounting.rig import MountingRig

#: Step of the derivatives by differences, relative to a parameter or a tenth of its scale.
_DIFFERENCE = 1e-4


@dataclass(frozen=True, eq=False)
class MountingProblem:
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
        left_out = {*self.model.contained, *self.negative_controls}
        return {name: card for name, card in self.model.cards.items() if name not in left_out}

    @property
    def negative_controls(self) -> Effects:
        """Responses without meaning."""
        return tuple(card.id for card in NEGATIVE_CONTROLS)

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
        return band_edges_hz(self.records)[[0, 1, 4, -1]]

    @cached_property
    def _cells(self) -> tuple[FloatArray, FloatArray]:
        return score_cells(self.records, self._edges_hz)

    @property
    def cell_counts(self) -> FloatArray:
        """Degrees of freedom by piece and cell."""
        return self._cells[0]

    @property
    def noise_square(self) -> FloatArray:
        """Sum of squares of the noise by piece and cell."""
        return self._cells[1]

    def parameters(self, effects: Effects) -> tuple[Parameter, ...]:
        """Unknowns of a set."""
        return self.model.parameters(effects)

    def starts(
        self, effects: Effects, known: Mapping[tuple[str, str], float]
    ) -> Sequence[FloatArray]:
        """What is known with the new effects off, linear bushings alone, then linear solutions over the shapes."""
        parameters = self.parameters(effects)
        found = [values for values, _ in self._solutions(effects)]
        values = [
            {**{key: found[0][key] for key in self._known}, **known},
            {**self._known, **known},
        ]
        values += [{**own, **known} for own in found] + [{**known, **own} for own in found]
        values += [{**found[0], **own, **known} for own, _ in self._contained_solutions]
        lower, upper = np.array([[p.lower, p.upper] for p in parameters]).T
        return [np.clip(values_array(parameters, own), lower, upper) for own in values]

    def sums(self, effects: Effects, theta: FloatArray, chosen: BoolArray) -> SegmentSums:
        """Gauss-Newton sums with derivatives by differences, parameters in threads (the march holds no lock)."""
        p = theta.size
        matrix, right = np.zeros((len(self.segments), p, p)), np.zeros((len(self.segments), p))
        square = np.zeros(len(self.segments))
        with ThreadPoolExecutor(os.cpu_count()) as threads:
            for record, places in self._chosen_runs(chosen):
                residual = self._residual(record, effects, theta)
                if not np.isfinite(residual).all():
                    square[places] = np.inf
                    continue
                slope = partial(self._slope, record, effects, theta, residual)
                rows = np.array(list(threads.map(slope, range(p))))
                for block, place in enumerate(places):
                    own = rows[:, record.block == block].reshape(p, -1)
                    left = residual[record.block == block].ravel()
                    matrix[place], right[place], square[place] = (
                        own @ own.T,
                        own @ left,
                        left @ left,
                    )
        return SegmentSums(matrix, right, square)

    def squares(self, effects: Effects, theta: FloatArray, chosen: BoolArray) -> FloatArray:
        """Squared residuals by piece and cell; infinite where the motion leaves the model."""
        result = np.zeros(self.cell_counts.shape)
        for record, places in self._chosen_runs(chosen):
            powers, _ = block_powers(record, self._residual(record, effects, theta), self._edges_hz)
            result[places] = powers.reshape(len(places), -1)
        return result

    def signatures(self) -> Signatures:
        """Columns of the screen."""
        return self._columns[0]

    def gap_cells(self, effects: Effects, theta: FloatArray) -> tuple[GapCell, ...]:
        """Gap by motion pattern, band and run."""
        return mounting_gap_cells(
            self.records, self._residuals(effects, theta), self.model.sensors, self.model.channels
        )

    def where_text(self, effects: Effects, theta: FloatArray) -> str:
        """One sentence."""
        cells, own = self.gap_cells(effects, theta), self._residuals(effects, theta)
        return mounting_where_text(
            cells, self.records, own, self.model.sensors, self.model.channels
        )

    def gap_findings(self, effects: Effects, theta: FloatArray) -> GapFindings:
        """Gap in time, between repeats, and its growth."""
        cells, own = self.gap_cells(effects, theta), self._residuals(effects, theta)
        return mounting_findings(self.records, own, cells, self.model.sensors, self.model.channels)

    def scalars(self, effects: Effects, theta: FloatArray) -> Sequence[Scalar]:
        """Mean and peak to peak of every motion."""
        return mounting_scalars(
            self.records, self._residuals(effects, theta), self.model.sensors, self.model.channels
        )

    def pictures(self, effects: Effects, theta: FloatArray) -> tuple[Picture, ...]:
        """Gap along the motion that holds most of it."""
        return mounting_pictures(self.model, self.records, effects, theta, self.choice(effects))

    def with_signals_of(self, effects: Effects, theta: FloatArray) -> "MountingPlant":
        """ComparisonProblem that measured what a model predicts, where there was a measurement."""
        records = []
        for record in self.records:
            predicted = self.model.predicted(record, effects, theta, self.choice(effects))
            records.append(
                replace(record, measured=np.where(np.isfinite(record.measured), predicted, np.nan))
            )
        return replace(self, records=tuple(records))

    def candidate_experiments(self) -> Sequence[CandidateExperiment]:
        """Loads that were not applied."""
        return mounting_experiments(self)

    def numerical_error(self, effects: Effects, theta: FloatArray) -> float:
        """RMS change of the prediction with half the step."""
        choice = self.choice(effects)
        changes = [
            self.model.predicted(record, effects, theta, choice, refined=2)
            - self.model.predicted(record, effects, theta, choice)
            for record in self.records
        ]
        return float(np.sqrt(np.mean(np.concatenate(changes) ** 2)))

    def choice(self, effects: Effects) -> Choice:
        """Channel of each effect of one sensor, by least squares over the signatures.

        The contained ones' by themselves.
        """
        wanted = {own for own in (*self.model.contained, *effects) if own in ONE_CHANNEL}
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
    def _bare(self) -> "tuple[MountingPlant, FloatArray]":
        """ComparisonProblem with linear bushings alone as its baseline, and its fit."""
        bare = replace(self, model=replace(self.model, contained=()))
        return bare, bare.bare_fit()

    @cached_property
    def _known(self) -> dict[tuple[str, str], float]:
        own = self._bare[0].parameters(())
        return {
            (p.effect, p.name): float(value) for p, value in zip(own, self._bare[1], strict=True)
        }

    @cached_property
    def _columns(self) -> tuple[Signatures, tuple[Column, ...]]:
        bare, theta = self._bare
        return mounting_signatures(
            self.model, self.records, bare._residuals((), theta), self._known
        )

    def bare_fit(self) -> FloatArray:
        """K1 and C1 of the linear bushings alone, shape (2,)."""
        if self.model.held:
            return np.array(self.model.held)
        rig = self.model.rig
        start = np.array([rig.bushing_radial_stiffness, rig.bushing_radial_damping])
        everything, free = np.ones(len(self.segments), dtype=bool), np.ones(2, dtype=bool)
        return minimised(self, (), start, chosen=everything, free=free, prior=np.zeros(2))[0]

    @cached_property
    def _found(self) -> dict[Effects, list[Solution]]:
        return {}

    def _solutions(self, effects: Effects) -> list[Solution]:
        if effects not in self._found:
            self._found[effects] = solutions(*self._columns, effects, self._known)
        return self._found[effects]

    def _chosen_runs(self, chosen: BoolArray) -> list[tuple[MountingRecord, NDArray[np.int64]]]:
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

    def _residual(self, record: MountingRecord, effects: Effects, theta: FloatArray) -> FloatArray:
        """Measured less predicted; zero where nothing was measured."""
        gap = record.measured - self.model.predicted(record, effects, theta, self.choice(effects))
        return np.where(np.isfinite(record.measured), gap, 0.0)

    def _slope(
        self,
        record: MountingRecord,
        effects: Effects,
        theta: FloatArray,
        residual: FloatArray,
        k: int,
    ) -> FloatArray:
        """Change of the prediction by one parameter, shape (n, n_channels)."""
        parameter = self.parameters(effects)[k]
        step = _DIFFERENCE * max(abs(theta[k]), 0.1 * parameter.scale)
        step = -step if theta[k] + step > parameter.upper else step
        moved = theta.copy()
        moved[k] += step
        changed = self._residual(record, effects, moved)
        return (
            (residual - changed) / step if np.isfinite(changed).all() else np.zeros(residual.shape)
        )


def mounting_problem(campaign: Campaign) -> MountingProblem:
    """ComparisonProblem of a campaign of kind ``mounting``.

    Parameters
    ----------
    campaign : Campaign
        Measured runs and the effects the baseline contains.

    Returns
    -------
    MountingProblem
        Ready to be diagnosed.

    Raises
    ------
    ValueError
        Where a signal is missing throughout, or the loads never change.
    """
    records = mounting_records(campaign)
    rig = MountingRig.from_table(campaign.rig)
    cards = {
        **effect_library(KIND, MOUNTING_CARDS),
        **{card.id: card for card in NEGATIVE_CONTROLS},
    }
    sensors = tuple(str(channel.sensor) for channel in campaign.channels)
    names = tuple(channel.name for channel in campaign.channels)
    scale = mounting_scale(rig, records)
    model = MountingModel(rig, cards, tuple(campaign.baseline.effects), names, sensors, scale)
    declared = all(channel.noise_std is not None for channel in campaign.channels)
    return MountingProblem(model, records, declared)
