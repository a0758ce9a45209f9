"""The kind "carrier" as a plant of the diagnosis.

Its library, and everything else as algebra on sums over the records.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.carrier.cards import CARRIER_CARDS, KIND, NEGATIVE_CONTROLS, ONE_CHANNEL
from carrierflex.diagnosis.carrier.columns import ColumnSource, all_cards
from carrierflex.diagnosis.carrier.experiments import carrier_experiments
from carrierflex.diagnosis.carrier.gap_findings import CarrierGap
from carrierflex.diagnosis.carrier.laws import CarrierRig
from carrierflex.diagnosis.carrier.loads import (
    bounds_of,
    largest_load,
    segment_squares,
    typical_speed,
    used_columns,
)
from carrierflex.diagnosis.carrier.model import CarrierModel, Choice
from carrierflex.diagnosis.carrier.noise import channel_noise, refuse_silent_channels
from carrierflex.diagnosis.carrier.pictures import carrier_pictures
from carrierflex.diagnosis.carrier.signatures import carrier_signatures
from carrierflex.diagnosis.carrier.sums import CarrierSums, accumulated_sums
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
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.simulation.carrier.effects import pin_radius_of

#: Steps of the fits that choose a channel or a threshold.
_QUICK_STEPS = 4


@dataclass(frozen=True, eq=False)
class CarrierProblem:
    """Rim sensors of a planet carrier; see :class:`carrierflex.diagnosis.comparison.problem.ComparisonProblem`.

    Parameters
    ----------
    campaign : Campaign
        Records.
    model : CarrierModel
        Parameters and weights.
    records : CarrierSums
        Sums over the records.
    noise : ndarray, shape (n_channels,)
        Variance of the noise of every channel [m²].
    """

    campaign: Campaign
    model: CarrierModel
    records: CarrierSums
    noise: FloatArray
    _choices: dict[Effects, dict[str, int]] = field(default_factory=dict)
    _quick: dict[Effects, FloatArray] = field(default_factory=dict)
    _grams: dict[bytes, FloatArray] = field(default_factory=dict)

    @property
    def unit(self) -> str:
        """Unit of the channels."""
        return "m"

    @property
    def n_channels(self) -> int:
        """Signals that are compared."""
        return len(self.noise)

    @cached_property
    def cards(self) -> Mapping[str, EffectCard]:
        """Candidates by id."""
        left_out = {*self.model.contained, *self.campaign.baseline.effects, *self.negative_controls}
        return {name: card for name, card in self.model.cards.items() if name not in left_out}

    @property
    def negative_controls(self) -> Effects:
        """Orders without meaning."""
        return tuple(card.id for card in NEGATIVE_CONTROLS)

    @property
    def segments(self) -> tuple[Segment, ...]:
        """Blocks of revolutions."""
        return self.records.segments

    @property
    def cell_counts(self) -> FloatArray:
        """Samples by piece and channel."""
        return self.records.counts.astype(np.float64)

    @property
    def noise_square(self) -> FloatArray:
        """Sum of squares of the noise by piece and channel."""
        return self.records.counts * self.noise

    def parameters(self, effects: Effects) -> tuple[Parameter, ...]:
        """Unknowns of a set; effects of one sensor name the channel they fit best."""
        return self.model.parameters(effects, self._choice(effects))

    def starts(
        self, effects: Effects, known: Mapping[tuple[str, str], float]
    ) -> Sequence[FloatArray]:
        """What is known of a smaller set, and the best closed-form fit over the thresholds."""
        quick = self._quick_theta(effects)
        warm = quick.copy()
        for k, parameter in enumerate(self.parameters(effects)):
            name = (
                parameter.name if parameter.run is None else f"{parameter.name} of {parameter.run}"
            )
            warm[k] = known.get((parameter.effect, name), quick[k] if parameter.shape else 0.0)
        return [np.clip(warm, *bounds_of(self.parameters(effects))), quick]

    def sums(self, effects: Effects, theta: FloatArray, chosen: BoolArray) -> SegmentSums:
        """Gauss-Newton sums from the products of the columns."""
        places, left, slopes = self._active(effects, theta)
        run, gram = self.records.run_of_segment[chosen], self._gram_of(places)[chosen]
        matrix = np.zeros((len(self.segments), theta.size, theta.size))
        right, square = np.zeros((len(self.segments), theta.size)), np.zeros(len(self.segments))
        own = slopes[run] @ gram
        matrix[chosen] = (own @ np.swapaxes(slopes[run], 2, 3)).sum(axis=1)
        right[chosen] = (own @ left[run][..., None])[..., 0].sum(axis=1)
        square[chosen] = segment_squares(left[run], gram).sum(axis=1)
        return SegmentSums(matrix, right, square)

    def squares(self, effects: Effects, theta: FloatArray, chosen: BoolArray) -> FloatArray:
        """Squared residuals by piece and channel."""
        places, left, _ = self._active(effects, theta)
        result = np.zeros(self.records.counts.shape)
        run = self.records.run_of_segment[chosen]
        result[chosen] = segment_squares(left[run], self._gram_of(places)[chosen])
        return result

    def signatures(self) -> Signatures:
        """Columns of the screen."""
        return carrier_signatures(
            self.model, self.records, tuple(self.cards), self._quick_theta(())
        )

    def gap_cells(self, effects: Effects, theta: FloatArray) -> tuple[GapCell, ...]:
        """Gap by run, pattern and order."""
        return self._gap(effects, theta).cells

    def where_text(self, effects: Effects, theta: FloatArray) -> str:
        """One sentence about the gap map of a model."""
        return self._gap(effects, theta).where_text

    def gap_findings(self, effects: Effects, theta: FloatArray) -> GapFindings:
        """Gap in time, incoherent part and growth."""
        return self._gap(effects, theta).findings()

    def scalars(self, effects: Effects, theta: FloatArray) -> Sequence[Scalar]:
        """Tilts, eccentricity and peak to peak of a model."""
        return self._gap(effects, theta).scalars()

    def pictures(self, effects: Effects, theta: FloatArray) -> tuple[Picture, ...]:
        """Polar plots for the report."""
        return carrier_pictures(self.model, self.records, effects, theta, self._choice(effects))

    def with_signals_of(self, effects: Effects, theta: FloatArray) -> "CarrierPlant":
        """ComparisonProblem that measured what a model predicts."""
        weights, _ = self.model.weights(effects, self._choice(effects), theta)
        return replace(
            self, records=self.records.with_target(weights), _choices={}, _quick={}, _grams={}
        )

    def candidate_experiments(self) -> Sequence[CandidateExperiment]:
        """Loads that were not applied."""
        return carrier_experiments(self)

    def numerical_error(self, effects: Effects, theta: FloatArray) -> float:
        """Zero: the signals are a closed form."""
        return 0.0

    def under(self, campaign: Campaign, effects: Effects, theta: FloatArray) -> "CarrierPlant":
        """ComparisonProblem that measured what a model predicts under the inputs of another campaign.

        Parameters of a run are those of the first run.
        """
        records = accumulated_sums(campaign, self.model.source)
        model = replace(
            self.model, runs=tuple(run.name for run in campaign.runs), book=records.book
        )
        value = {
            (p.effect, p.name): float(theta[k])
            for k, p in reversed(list(enumerate(self.parameters(effects))))
        }
        choice = self._choice(effects)
        own = np.array([value[p.effect, p.name] for p in model.parameters(effects, choice)])
        weights, _ = model.weights(effects, choice, own)
        return CarrierProblem(campaign, model, records.with_target(weights), self.noise)

    def _gap(self, effects: Effects, theta: FloatArray) -> CarrierGap:
        places, left, _ = self._active(effects, theta)
        weights = left[self.records.run_of_revolution]
        residual = np.einsum("rcnk,rck->rcn", self.records.orders[..., places], weights)
        return CarrierGap(self.campaign, self.records, self.noise, residual)

    def _gram_of(self, places: NDArray[np.int64]) -> FloatArray:
        """Products of some columns by piece and channel."""
        key = places.tobytes()
        if key not in self._grams:
            self._grams[key] = self.records.gram[:, :, places[:, None], places]
        return self._grams[key]

    def _active(
        self, effects: Effects, theta: FloatArray
    ) -> tuple[NDArray[np.int64], FloatArray, FloatArray]:
        """Columns in use, weights of the residual in them, and derivatives of the prediction."""
        W, D = self.model.weights(effects, self._choice(effects), theta)
        places = used_columns(W, D)
        left = -W[..., places]
        left[..., 0] += 1.0
        return places, left, D[..., places]

    def _choice(self, effects: Effects) -> Choice:
        """Channel of every effect of one sensor, found one after the other.

        The contained ones first.
        """
        if effects not in self._choices:
            found: dict[str, int] = {}
            for effect in (*self.model.contained, *effects):
                if effect in ONE_CHANNEL:
                    others = tuple(
                        own
                        for own in effects
                        if own not in ONE_CHANNEL or own in found or own == effect
                    )
                    costs = [
                        self._best_of(others, {**found, effect: c})[1]
                        for c in range(len(self.noise))
                    ]
                    found[effect] = int(np.argmin(costs))
            self._choices[effects] = found
        return self._choices[effects]

    def _quick_theta(self, effects: Effects) -> FloatArray:
        if effects not in self._quick:
            self._quick[effects] = self._best_of(effects, dict(self._choice(effects)))[0]
        return self._quick[effects]

    def _best_of(self, effects: Effects, choice: dict[str, int]) -> tuple[FloatArray, float]:
        """Best fit to all pieces over the nodes of the thresholds, those of one effect at a time."""
        parameters = self.model.parameters(effects, choice)
        start = np.array([0.5 * (p.lower + p.upper) if p.shape else 0.0 for p in parameters])
        best = self._closed_fit(effects, choice, parameters, start)
        for k, parameter in enumerate(parameters):
            for variant in self.model.variants(parameter.effect) if parameter.shape else ():
                experiment = best[0].copy()
                experiment[k] = variant[0]
                found = self._closed_fit(effects, choice, parameters, experiment)
                best = min(best, found, key=lambda own: own[1])
        return best

    def _closed_fit(
        self,
        effects: Effects,
        choice: dict[str, int],
        parameters: Sequence[Parameter],
        start: FloatArray,
    ) -> tuple[FloatArray, float]:
        """Gauss-Newton steps on the sums of whole runs, thresholds held; within bounds."""
        theta = start.copy()
        free = np.array([not parameter.shape for parameter in parameters], dtype=bool)
        bilinear = any(
            own in (*ONE_CHANNEL, "sensor_delay") for own in (*self.model.contained, *effects)
        )
        for _ in range(_QUICK_STEPS if bilinear else 1):
            matrix, right, _ = self._whole_sums(effects, choice, theta)
            seen = free & (np.diag(matrix) > 0.0)
            size = np.sqrt(np.diag(matrix)[seen])
            scaled = matrix[np.ix_(seen, seen)] / np.outer(size, size) + 1e-9 * np.eye(size.size)
            theta[seen] += np.linalg.lstsq(scaled, right[seen] / size, rcond=1e-12)[0] / size
            theta = np.clip(theta, *bounds_of(parameters))
        return theta, self._whole_sums(effects, choice, theta)[2]

    def _whole_sums(
        self, effects: Effects, choice: dict[str, int], theta: FloatArray
    ) -> tuple[FloatArray, FloatArray, float]:
        W, D = self.model.weights(effects, choice, theta)
        places = used_columns(W, D)
        left, slopes = -W[..., places], D[..., places]
        left[..., 0] += 1.0
        gram = self._run_gram[..., places[:, None], places]
        own = slopes @ gram
        matrix = np.einsum("rcpk,rcqk->pq", own, slopes, optimize=True)
        square = np.einsum("rck,rckl,rcl->", left, gram, left, optimize=True)
        return matrix, np.einsum("rcpk,rck->p", own, left, optimize=True), float(square)

    @cached_property
    def _run_gram(self) -> FloatArray:
        """Products of the columns by run and channel."""
        runs = range(len(self.campaign.runs))
        return np.stack(
            [self.records.gram[self.records.run_of_segment == r].sum(axis=0) for r in runs]
        )


def carrier_problem(campaign: Campaign, curves: Mapping[str, DeflectionCurve]) -> CarrierProblem:
    """ComparisonProblem of a campaign of kind ``carrier``.

    Parameters
    ----------
    campaign : Campaign
        Measured runs and the effects the baseline contains.
    curves : mapping of str to DeflectionCurve
        ``delta_s``, ``delta_f``, and ``g_f`` where uneven pin loads are to be looked for.

    Returns
    -------
    CarrierProblem
        Ready to be diagnosed.

    Raises
    ------
    ValueError
        Where a channel is missing throughout or constant, or a run has no whole revolution.
    """
    refuse_silent_channels(campaign)
    cards = all_cards(effect_library(KIND, CARRIER_CARDS))
    n_planets, pin_radius = int(campaign.rig["n_planets"]), 1.0
    if "g_f" in curves:
        pin_radius = pin_radius_of(curves["delta_f"], curves["g_f"], n_planets)
    else:
        cards = {name: card for name, card in cards.items() if "load_sharing" not in name}
    rig = CarrierRig(float(campaign.rig["nominal_torque"]), n_planets, pin_radius, curves)
    source = ColumnSource(rig, cards, typical_speed(campaign), largest_load(campaign))
    records = accumulated_sums(campaign, source)
    contained = tuple(campaign.baseline.effects)
    if campaign.baseline.source == "columns":
        # Another simulator's prediction stands as it is; only its zero is free.
        contained = tuple(own for own in contained if own == "axial_offset")
    runs, channels = (
        tuple(own.name for own in table) for table in (campaign.runs, campaign.channels)
    )
    model = CarrierModel(source, records.book, contained, runs, channels)
    return CarrierProblem(campaign, model, records, channel_noise(campaign, records))
