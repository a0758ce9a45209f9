"""The kind "element" as a plant of the diagnosis: both drives, its library, sums by block and band."""

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from diagnosis.effect_cards import EffectCard, effect_library
from diagnosis.element_bands import BandTable, band_table, block_squares
from diagnosis.element_effects import ELEMENT_CARDS, KIND, PLACEBO_CARDS
from diagnosis.element_gap import element_gap_cells, element_where_text
from diagnosis.element_growth import growth_exponent
from diagnosis.element_model import ElementModel, ElementScale, compiled_laws, substeps_for
from diagnosis.element_records import ElementRecord, element_records, noise_variance
from diagnosis.element_signals import band_limited
from diagnosis.element_signatures import Column, base_columns, element_signatures, known_force, signature_columns
from diagnosis.element_starts import element_starts
from diagnosis.element_trials import element_trials
from diagnosis.plants import BoolArray, Effects, FloatArray, GapCell, Parameter, Piece, PieceSums, Signatures, Trial
from identification.campaign import Campaign

#: Step of the derivatives by differences, relative to a parameter or a tenth of its scale.
_DIFFERENCE = 1e-5
#: Samples from which the derivatives of a record are worth threads; the compiled motion holds no lock.
_THREADED = 20_000


@dataclass(frozen=True, eq=False)
class ElementPlant:
    """One element, its records and its library; see :class:`diagnosis.plants.Plant`.

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
    """

    model: ElementModel
    records: tuple[ElementRecord, ...]
    noise: FloatArray
    noise_is_measured: bool
    channel: str

    @property
    def unit(self) -> str:
        """Unit of the channel."""
        return self.model.units[1 if self.model.by_force else 0]

    @cached_property
    def cards(self) -> Mapping[str, EffectCard]:
        """Candidates by id."""
        left_out = {*self.model.contained, *self.placebos}
        return {name: card for name, card in self.model.cards.items() if name not in left_out}

    @property
    def placebos(self) -> Effects:
        """Forces without meaning."""
        return tuple(card.id for card in PLACEBO_CARDS)

    @cached_property
    def pieces(self) -> tuple[Piece, ...]:
        """Blocks of the runs."""
        return tuple(
            Piece(record.name, record.condition, block, int((record.block == block).sum()))
            for record in self.records
            for block in range(record.n_blocks)
        )

    @cached_property
    def bands(self) -> BandTable:
        """Bands of frequency of the score."""
        return band_table(self.records, self.noise, filtered=not self.model.by_force)

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

    def starts(self, effects: Effects, known: Mapping[tuple[str, str], float]) -> Sequence[FloatArray]:
        """Starts from force space."""
        return element_starts(self.model, self._signatures, self._columns, effects, known)

    def sums(self, effects: Effects, theta: FloatArray, chosen: BoolArray) -> PieceSums:
        """Gauss-Newton sums with derivatives by forward differences."""
        p = theta.size
        matrix, right = np.zeros((len(self.pieces), p, p)), np.zeros((len(self.pieces), p))
        square = np.zeros(len(self.pieces))
        for record, places in self._chosen_runs(chosen):
            residual = self._residual(record, effects, theta)
            rows = self._derivatives(record, effects, theta, residual)
            for block, place in enumerate(places):
                own, left = rows[:, record.block == block], residual[record.block == block]
                matrix[place], right[place], square[place] = own @ own.T, own @ left, left @ left
        return PieceSums(matrix, right, square)

    def squares(self, effects: Effects, theta: FloatArray, chosen: BoolArray) -> FloatArray:
        """Squared residuals by piece and band; infinite where the model runs away."""
        result = np.zeros(self.cell_counts.shape)
        for record, places in self._chosen_runs(chosen):
            residual = self._residual(record, effects, theta)
            result[places] = block_squares(record, residual, self.bands.edges_hz)
        return result

    def signatures(self) -> Signatures:
        """Columns of force space."""
        return self._signatures

    def gap_cells(self, effects: Effects, theta: FloatArray) -> tuple[GapCell, ...]:
        """Gap by line or band and run."""
        residuals = [self._residual(record, effects, theta) for record in self.records]
        return element_gap_cells(self.records, residuals, self.noise, channel=self.channel)

    def where_text(self, effects: Effects, theta: FloatArray) -> str:
        """One sentence."""
        cells = self.gap_cells(effects, theta)
        growth = growth_exponent(self.model, self.records)
        return element_where_text(cells, self.records, by_force=self.model.by_force, growth=growth)

    def with_signals_of(self, effects: Effects, theta: FloatArray) -> "ElementPlant":
        """Plant that measured what a model predicts."""
        records = []
        for record in self.records:
            predicted = self.model.predicted(record, effects, theta)
            records.append(record.with_response(predicted) if self.model.by_force else record.with_force(predicted))
        return replace(self, records=tuple(records))

    def trials(self) -> Sequence[Trial]:
        """Drives that were not applied."""
        return element_trials(self)

    def numerical_error(self, effects: Effects, theta: FloatArray) -> float:
        """RMS change of the prediction with half the step."""
        if not self.model.by_force:
            return 0.0
        changes = [
            self.model.predicted(record, effects, theta, refined=2) - self.model.predicted(record, effects, theta)
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

    def _residual(self, record: ElementRecord, effects: Effects, theta: FloatArray) -> FloatArray:
        """Measured less predicted; zero where nothing was measured."""
        residual = record.response - self.model.predicted(record, effects, theta)
        if not self.model.by_force:
            residual = band_limited(residual, record.step, record.cutoff_hz)
        return np.where(record.block >= 0, residual, 0.0)

    def _derivatives(
        self, record: ElementRecord, effects: Effects, theta: FloatArray, residual: FloatArray
    ) -> FloatArray:
        """Change of the prediction by every parameter, shape (p, n)."""

        def row(k: int) -> FloatArray:
            parameter = parameters[k]
            step = _DIFFERENCE * max(abs(theta[k]), 0.1 * parameter.scale)
            step = -step if theta[k] + step > parameter.upper else step
            moved = theta.copy()
            moved[k] += step
            change = (residual - self._residual(record, effects, moved)) / step
            return np.where(np.isfinite(change), change, 0.0)

        parameters = self.parameters(effects)
        if residual.size < _THREADED:
            return np.array([row(k) for k in range(theta.size)])
        with ThreadPoolExecutor(os.cpu_count()) as threads:
            return np.array(list(threads.map(row, range(theta.size))))


def element_plant(campaign: Campaign) -> ElementPlant:
    """Plant of a campaign of kind ``element``.

    Parameters
    ----------
    campaign : Campaign
        Measured runs and the effects the baseline contains.

    Returns
    -------
    ElementPlant
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
    cards = {**effect_library(KIND, ELEMENT_CARDS), **{card.id: card for card in PLACEBO_CARDS}}
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
    model = replace(unscaled, scale=scale, substeps=substeps_for(scale, max(record.step for record in records)))
    return ElementPlant(model, records, noise, measured, channel.name)


def _refuse_mixed_units(campaign: Campaign, input_name: str) -> None:
    """A voltage analogue declares both units: with one of them in SI the parameters would have none that make sense."""
    channel = campaign.channels[0]
    foreign = channel.unit != campaign.contract.quantities[channel.quantity]
    declared = campaign.input_units.get(input_name, campaign.contract.inputs[input_name])
    foreign_input = declared != campaign.contract.inputs[input_name]
    if foreign != foreign_input:
        raise ValueError(
            f"[[channels]]: unit of '{channel.name}' is {channel.unit} and that of the input '{input_name}' is {declared}; "
            "expected both in SI units, or both declared as an analogue"
        )


def element_scale(model: ElementModel, records: Sequence[ElementRecord]) -> ElementScale:
    """Sizes of an element from its measured motion, and its baseline by least squares in force space."""
    plain = replace(model, contained=())
    rows = [base_columns(plain, record)[:, record.block >= 0] for record in records]
    force = [known_force(model, record)[record.block >= 0] for record in records]
    design, target = np.concatenate(rows, axis=1), np.concatenate(force)
    size = np.linalg.norm(design, axis=1)
    solution = np.linalg.lstsq((design / size[:, None]).T, target, rcond=1e-10)[0] / size
    mass = model.mass if model.mass is not None else max(float(solution[0]), 0.0)
    inertia = 0.0 if model.mass is not None else solution[0] * design[0]
    K1, C1, f0 = (float(value) for value in solution[-3:])
    restoring = target - inertia
    return ElementScale(
        force=float(restoring.std()) or float(target.std()),
        deflection=float(design[-3].std()),
        speed=float(np.sqrt(np.mean(design[-2] ** 2))),
        m=mass,
        K1=max(K1, 0.0),
        C1=max(C1, 0.0),
        f0=f0,
    )
