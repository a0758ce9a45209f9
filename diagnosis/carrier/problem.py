"""The kind "carrier" as a comparison problem of the diagnosis.

Its library, and everything else as algebra on sums over the records.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache, cached_property, lru_cache, partial
from typing import Any, Self

import numpy as np

from carrierflex.diagnosis.carrier.classes.answer import (
    DERIVATIVE_STD,
    CarrierTable,
    carrier_class_answer,
    carrier_class_table,
)
from carrierflex.diagnosis.carrier.classes.measured_laws import beyond_visited, effects_of_laws
from carrierflex.diagnosis.carrier.gap_findings import CarrierGap
from carrierflex.diagnosis.carrier.library import card_of, carrier_library, carrier_rig
from carrierflex.diagnosis.carrier.misread import CarrierReading
from carrierflex.diagnosis.carrier.model import CarrierModel, Choice, WeightTable
from carrierflex.diagnosis.carrier.off_order_lines import OffOrders, off_orders
from carrierflex.diagnosis.carrier.pictures import (
    mean_turns,
    model_overlays,
    pins_passing,
    polar_pictures,
)
from carrierflex.diagnosis.carrier.records.columns import (
    SAME_CONDITION,
    SAMPLES_A_TURN,
    ColumnSource,
    largest_load,
    mean_load,
    typical_speed,
)
from carrierflex.diagnosis.carrier.records.sums import (
    CarrierSums,
    accumulated_sums,
    normal_sums,
    segment_squares,
)
from carrierflex.diagnosis.carrier.wiring import LinearBaseline
from carrierflex.diagnosis.classes.gram_table import GramTable
from carrierflex.diagnosis.classes.results import ClassAnswer
from carrierflex.diagnosis.comparison.effect_cards import EffectCard
from carrierflex.diagnosis.comparison.known_physics import KnownPhysics, Misreading, known_physics
from carrierflex.diagnosis.comparison.overlay import Overlay, Picture
from carrierflex.diagnosis.comparison.problem import (
    BoolArray,
    ComplexArray,
    Effects,
    FloatArray,
    IntArray,
    Parameter,
    Segment,
    SegmentSums,
    bounds_of,
)
from carrierflex.diagnosis.gap.findings import OffOrderMotion
from carrierflex.diagnosis.inference.effect_fit import parameter_key
from carrierflex.diagnosis.inference.planning.results import RigLimits
from carrierflex.diagnosis.kind.comparison_problem import CandidateExperiment, ComparisonProblem
from carrierflex.diagnosis.wiring.refits import WiringChecks
from carrierflex.fe.curve_files import PIN_FIT, axial_of_fit
from carrierflex.fe.deflection_curves import DeflectionCurve, amplitudes_along
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import CURVES, TOLERANCES, Channel, KnownValue
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning, key_of
from carrierflex.identification.estimation.gauss_newton import Bounds, CostSums, bounded_step
from carrierflex.identification.estimation.several_starts import costs_more
from carrierflex.simulation.carrier.effect import Effect
from carrierflex.simulation.carrier.effects.deflection import FLEXIBLE_PINS, STIFF_PINS
from carrierflex.simulation.carrier.effects.drawing import (
    BOND,
    CURVE_ERROR,
    body_of_effect,
    bond_effect,
    curve_error_effect,
    drawing_effects,
    pin_fit_effect,
)
from carrierflex.simulation.carrier.effects.inside_stage import RESPONSE, RESPONSE_STD
from carrierflex.simulation.carrier.effects.library import RADIAL_MOTION
from carrierflex.simulation.carrier.effects.misalignment import AXIAL_OFFSET
from carrierflex.simulation.carrier.run_cases import RADIAL
from carrierflex.simulation.laws import Law

#: rho_s over rho_f for a rigid fit of the pins, and the error of a curve by its mesh.
_RIGID_FIT, _MESH_ERROR = 0.69, 0.06
#: Standard deviation of an order of a computed curve, over the curve's RMS, where none is stated.
_CURVES_STD = 0.01
#: Steps of the fits that choose a channel or a threshold.
_QUICK_STEPS = 4
#: Share of every column's square on the diagonal: keeps columns that are alike from large values of
#: opposite sign.
_RIDGE = 1e-9
#: Revolutions of a run of an experiment that was not made.
_REVOLUTIONS = 4
_Load = tuple[float, float, float]
_LOADS = ("torque", "ntl_y", "ntl_z")
#: Comparison problem that measured what a model predicts under the inputs of another campaign.
_Under = Callable[[Campaign, Effects, FloatArray], ComparisonProblem]


@dataclass(frozen=True, eq=False)
class CarrierProblem(ComparisonProblem):
    """Rim sensors of a planet carrier."""

    campaign: Campaign  # Records
    model: CarrierModel  # Parameters and weights
    records: CarrierSums  # Sums over the records
    noise: FloatArray  # Variance of the noise of every channel [m²], shape (n_channels,)
    motion: OffOrders  # Lines and bands off the orders; `campaign` and `records` are without them
    unit = "m"

    def __getstate__(self) -> dict[str, Any]:
        """What it is made of; another process computes again what is kept of earlier steps."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    def baseline_findings(
        self, values: Mapping[tuple[str, str], float]
    ) -> Sequence[CampaignWarning]:
        """Orders read too seldom, and a carrier more flexible than drawn with whatever pin fit."""
        findings = [
            CampaignWarning(
                "aliased_order",
                ", ".join(motion.channels),
                f"order {motion.label.removesuffix('X')} of the shaft, up to "
                f"{motion.band_hz[1]:.3g} Hz, is above half the sampling rate and read as a "
                "slower motion",
                "filter before sampling, or sample faster: as tooth mesh it is of the gearbox and "
                "not of the carrier",
                motion.band_hz[1],
                key_of("[[channels]]", motion.channels[0]),
                "wiring/aliased_order",
            )
            for motion in self.motion.motions
            if motion.is_aliased
        ]
        rho_s = values.get(("stiff_pins", "rho_s"), 0.0)
        rho_f = values.get(("flexible_pins", "rho_f"), 0.0)
        size = flexibility(rho_s, rho_f)
        if CURVE_ERROR not in self.model.contained and size > 1.0 + _MESH_ERROR:
            findings.append(
                CampaignWarning(
                    "drawing",
                    "carrier",
                    f"the carrier is {size - 1.0:.0%} more flexible than drawn: rho_f {rho_f:.3f} "
                    f"and rho_s {rho_s:.3f} are beyond what its drawing allows for any pin fit",
                    "check dimensions, modulus and deflection curves of the carrier, and the "
                    "calibration of the torque; with [rig.tolerances] a dimension may be the cause",
                    size,
                    key_of("[rig]", "deflection_curves"),
                )
            )
        return findings

    def combinations(
        self, effects: Effects, theta: FloatArray, covariance: FloatArray
    ) -> Mapping[str, Mapping[str, tuple[float, float]]]:
        """By how much each order of the rim under torque is larger than drawn, of its RMS.

        ``c_n = sum_p change_p (d c_n(delta_f)/dp + w d c_n(d)/dp)`` in the drawn curve's phase.
        """
        parameters = self.parameters(effects)
        changes = [k for k, p in enumerate(parameters) if body_of_effect(p.effect)]
        if not changes:
            return {}
        curves = self.model.source.rig.curves
        w = next((theta[k] for k, p in enumerate(parameters) if p.effect == PIN_FIT), 0.0)
        n = curves["delta_f"].axial.size
        orders = list(curves["delta_f"].main_orders(int(self.campaign.rig["n_planets"])))
        drawn = axial_of_fit(curves, w, n)
        causes = [parameters[k].effect.partition("/")[2] for k in changes]
        derivatives = [axial_of_fit(curves, w, n, cause=cause) for cause in causes]
        J = np.array([amplitudes_along(one, drawn)[orders] for one in derivatives]).T
        J /= np.sqrt(np.mean(drawn**2))
        larger = J @ theta[changes]
        std = np.sqrt(np.diag(J @ covariance[np.ix_(changes, changes)] @ J.T))
        body = body_of_effect(parameters[changes[0]].effect)
        rows = zip(orders, larger.tolist(), std.tolist(), strict=True)
        return {f"model/{body}": {f"order_{n}": (value, error) for n, value, error in rows}}

    def experiment_between(self, classes: Sequence[Effects]) -> str:
        """A sensor off the even spacing, where waves of both frames are one at the sensors.

        At N evenly spaced sensors m lobes are m - N lobes: waves that turn with the carrier are
        waves of the housing.
        """
        frames = [{name.split("/")[0] for name in names} for names in classes]
        if all(one == frames[0] for one in frames):
            return ""
        angles = np.rad2deg([channel.angle or 0.0 for channel in self.campaign.channels])
        angles = np.sort(angles % 360.0)
        gaps = np.diff([*angles, angles[0] + 360.0])
        first = int(np.argmax(gaps))
        between = (angles[first] + 0.5 * gaps[first]) % 360.0
        return (
            f"to distinguish waves that turn with the carrier from those of the housing, add a "
            f"sensor at {between:.0f} degrees, off the even spacing of the others"
        )

    def with_laws(self, laws: Sequence[Law], library: Effects | None = None) -> "CarrierProblem":
        """Problem with measured laws among its cards; sums of the columns in use are made anew."""
        used = {*self.model.contained, *(self.model.effects if library is None else library)}
        effects = {name: one for name, one in self.model.effects.items() if name in used}
        effects |= {one.id: one for one in effects_of_laws(laws, self.campaign)}
        source = replace(self.model.source, effects=effects)
        records = accumulated_sums(self.campaign, source, like=self.records)
        classes = {law.name: law.effect_class for law in laws}
        model = replace(self.model, source=source, index=records.index, class_of_measured=classes)
        return replace(self, model=model, records=records)

    @cached_property
    def cards(self) -> Mapping[str, EffectCard]:
        """Candidates by id."""
        baseline = self.campaign.baseline
        excluded = {*self.model.contained, *baseline.effects, *baseline.impossible}
        return {
            name: card_of(effect)
            for name, effect in self.model.effects.items()
            if name not in excluded
        }

    @property
    def segments(self) -> tuple[Segment, ...]:
        """Blocks of revolutions."""
        return self.records.segments

    @property
    def cell_counts(self) -> FloatArray:
        """Samples by segment and channel."""
        return self.records.counts.astype(np.float64)

    @property
    def noise_square(self) -> FloatArray:
        """Sum of squares of the noise by segment and channel."""
        return self.records.counts * self.noise

    def parameters(self, effects: Effects) -> tuple[Parameter, ...]:
        """Unknowns of a set; effects of one sensor name the channel they fit best."""
        return self.model.parameters(effects, self._choice(effects))

    @property
    def of_chosen_channel(self) -> frozenset[str]:
        """Errors of one sensor."""
        effects = self.model.effects.values()
        return frozenset(effect.id for effect in effects if effect.is_of_one_channel)

    def starts(
        self, effects: Effects, known: Mapping[tuple[str, str], float]
    ) -> Sequence[FloatArray]:
        """What is known of a smaller set, and the best closed-form fit over the thresholds."""
        quick = self._quick_theta(effects)
        warm = quick.copy()
        for k, parameter in enumerate(self.parameters(effects)):
            warm[k] = known.get(parameter_key(parameter), quick[k] if parameter.shape else 0.0)
        return [np.clip(warm, *bounds_of(self.parameters(effects))), quick]

    def sums(
        self, effects: Effects, theta: FloatArray, chosen: BoolArray, free: BoolArray | None = None
    ) -> SegmentSums:
        """Gauss-Newton sums from the products of the columns."""
        of_slices = []
        for table, run, some, gram in self._slices(effects, theta, chosen):
            of_segment = table.unknowns[run]
            matrix = np.zeros((len(of_segment), *2 * of_segment.shape[1:]))
            right_side, square = np.zeros(of_segment.shape), np.zeros(run.size)
            residual, slopes = table.residual[run[some]], table.slopes[run[some]]
            matrix[some], right_side[some] = normal_sums(slopes, gram, residual)
            square[some] = segment_squares(residual, gram).sum(axis=1)
            of_slices.append((matrix, right_side, square, of_segment))
        matrix, right_side, square, unknowns = map(np.concatenate, zip(*of_slices, strict=True))
        return SegmentSums(matrix, right_side, square, unknowns, theta.size)

    def squares(self, effects: Effects, theta: FloatArray, chosen: BoolArray) -> FloatArray:
        """Squared residuals by segment and channel."""
        result = np.zeros(self.records.counts.shape)
        result[chosen] = np.concatenate(
            [
                segment_squares(table.residual[run[some]], gram)
                for table, run, some, gram in self._slices(effects, theta, chosen)
            ]
        )
        return result

    def _slices(
        self, effects: Effects, theta: FloatArray, chosen: BoolArray
    ) -> Iterator[tuple[WeightTable, IntArray, IntArray, FloatArray]]:
        """Weights, run of each segment, numbers and products of the chosen ones, by slice."""
        for runs in self.records.slices:
            table = self._weights(effects, tuple(theta.tolist()), runs.start, runs.stop)
            some = np.flatnonzero(chosen[self.records.segments_of(runs)])
            gram = self.records.gram_of_slice(table.columns, runs)[some]
            yield table, self.records.run_in_slice(runs), some, gram

    @cached_property
    def _weights(self) -> Callable[[Effects, tuple[float, ...], int, int], WeightTable]:
        """Weights of a set in some runs: a search sums up what it has just looked at."""
        model, choice = self.model, self._choice
        return lru_cache(1)(
            lambda effects, theta, first, end: model.weights(
                effects, choice(effects), np.array(theta), slice(first, end)
            )
        )

    def off_order_motions(self) -> tuple[OffOrderMotion, ...]:
        """Lines and bands off the orders."""
        return self.motion.motions

    @property
    def brought(self) -> Effects:
        """Laws of the library that came from files."""
        return tuple(self.model.class_of_measured)

    def class_answer(self) -> ClassAnswer | None:
        """Class of what the baseline lacks; None where the records are too short."""
        table = self._class_table()
        if table is None:
            return None
        return carrier_class_answer(self.model, table, tuple(self.cards))

    def gram_table(self) -> GramTable | None:
        """Products of classes and laws; None where the records are too short."""
        table = self._class_table()
        return None if table is None else table.table

    def _class_table(self) -> CarrierTable | None:
        """Made anew each time: products of hundreds of runs are not kept beside the fits."""
        of_problem = (self.model, self.campaign, self.records, self.noise)
        return carrier_class_table(*of_problem, tuple(self.cards), self._quick_theta(()))

    def pictures(self, effects: Effects, theta: FloatArray) -> tuple[Picture, ...]:
        """Polar plots for the report."""
        residual = gap = self._orders_left(effects, tuple(theta.tolist()))
        if effects:
            sizes = [p.effect in effects and not p.shape for p in self.parameters(effects)]
            # Nothing else asks for these.
            gap = self._made_orders(effects, np.where(sizes, 0.0, theta))
        runs, n_planets = self.model.runs, self.model.source.rig.n_planets
        return polar_pictures(
            self._turns(gap),
            self._turns(gap - residual),
            effects,
            runs=runs,
            channels=self.model.channels,
            passing=[pins_passing(one.angle or 0.0, n_planets) for one in self.campaign.channels],
            highest=gap.shape[-1] - 1,
        )

    def overlays(self, effects: Effects, theta: FloatArray) -> Sequence[Overlay]:
        """Mean turn of every sensor as measured and as a model has it."""
        gaps = self._turns(self._orders_left(effects, tuple(theta.tolist())))
        return model_overlays(self._measured_turns, gaps, self.model.runs, self.model.channels)

    @cached_property
    def _measured_turns(self) -> FloatArray:
        """Measured signals over one turn; the overlays of two models share them."""
        return self._turns(self.records.orders)

    def _turns(self, orders: ComplexArray) -> FloatArray:
        return mean_turns(orders, self.records.run_of_revolution, len(self.model.runs))

    def for_laws(self, laws: Effects) -> Self:
        """The same with the effects of some laws: experiments hold no columns of the others."""
        return replace(self, model=self.model.of_set(laws))

    def candidate_experiments(self) -> Sequence[CandidateExperiment]:
        """Loads that were not applied, and a radial sensor where the carrier is as drawn."""
        return _experiments(self.campaign, self.model.source, self.under)

    def misreading(self, effects: Effects, theta: FloatArray) -> Misreading:
        """What the declared errors of channels and inputs do to a fit."""
        fitted = (effects, theta, self._choice(effects))
        return CarrierReading(self.campaign, self.model, *fitted).misread()

    def model_moves(self, effects: Effects, theta: FloatArray) -> FloatArray:
        """What a first derivative misses of a change of the drawing, each by itself."""
        of_drawing = [bool(body_of_effect(p.effect)) for p in self.parameters(effects)]
        return DERIVATIVE_STD * np.diag(theta)[of_drawing]

    def beyond_visited(self, law: Law) -> tuple[CampaignWarning, ...]:
        """Warnings where records leave the loads at which a law of a file was measured."""
        return beyond_visited(law, self.records, self.model.runs)

    def wiring(self, campaign: Campaign) -> WiringChecks:
        """What can be tried of the wiring of its campaign, without lines off the orders."""
        return LinearBaseline(self.model, self.campaign).checks()

    def under(self, campaign: Campaign, effects: Effects, theta: FloatArray) -> "CarrierProblem":
        """Problem that measured what a model predicts under the inputs of another campaign.

        Parameters of a run are those of the first run; a channel more has the mean noise.
        """
        records = accumulated_sums(campaign, self.model.source)
        channels = tuple(channel.name for channel in campaign.channels)
        runs = tuple(run.name for run in campaign.runs)
        model = replace(self.model, runs=runs, channels=channels, index=records.index)
        noise = np.full(len(channels), self.noise.mean())
        noise[: self.noise.size] = self.noise
        value = {
            (p.effect, p.name): float(theta[k])
            for k, p in reversed(list(enumerate(self.parameters(effects))))
        }
        choice = self._choice(effects)
        under = np.array([value[p.effect, p.name] for p in model.parameters(effects, choice)])
        table = model.weights(effects, choice, under)
        simulated = records.with_target(table.columns, table.values)
        return replace(self, campaign=campaign, model=model, records=simulated, noise=noise)

    def gap(self, effects: Effects, theta: FloatArray) -> CarrierGap:
        """Gap by run, pattern and order; tilts, eccentricity and peak to peak."""
        orders = self._orders_left(effects, tuple(theta.tolist()))
        fitted = (*self.model.contained, *effects)
        return CarrierGap(self.campaign, self.records, self.noise, orders, self.motion, fitted)

    @cached_property
    def _orders_left(self) -> Callable[[Effects, tuple[float, ...]], ComplexArray]:
        """Order amplitudes of what a model leaves, shape (R, C, n + 1); NaN where too sparse.

        The last two are cached: map, findings, scalars and overlays are of two models.
        """
        return lru_cache(2)(lambda effects, theta: self._made_orders(effects, np.array(theta)))

    def _made_orders(self, effects: Effects, theta: FloatArray) -> ComplexArray:
        """The same, not cached: of 500 runs 66 MB."""
        result = np.empty_like(self.records.orders)
        model, choice = self.model.of_set(effects), self._choice(effects)
        for c, block, (table,) in model.blocks(self.campaign, effects, choice, theta):
            signal = table.residual[0, c] @ block.rows[table.columns]
            result[block.turns, c] = block.orders(signal, result.shape[-1] - 1)[0]
        return result

    @cached_property
    def _choice(self) -> Callable[[Effects], Choice]:
        """Channel of every effect of one sensor, kept once it is found."""
        return cache(self._searched_channels)

    @cached_property
    def _quick_theta(self) -> Callable[[Effects], FloatArray]:
        """Closed-form fit of a set, each effect on its own channel, kept once it is found."""
        return cache(lambda effects: self._best_of(effects, self._choice(effects))[0])

    def _searched_channels(self, effects: Effects) -> Choice:
        """Channel of every effect of one sensor, one after the other; the contained ones first."""
        choice: dict[str, int] = {}
        fitted = (*self.model.contained, *effects)
        of_one = [name for name in fitted if self.model.effects[name].is_of_one_channel]
        for effect in of_one:
            tried = tuple(
                name for name in effects if name not in of_one or name in choice or name == effect
            )
            channels = range(self.noise.size)
            costs = [self._best_of(tried, {**choice, effect: one})[1] for one in channels]
            choice[effect] = int(np.argmin(costs))
        return choice

    def _closed_fit(
        self, effects: Effects, choice: Choice, start: FloatArray
    ) -> tuple[FloatArray, float]:
        """Gauss-Newton steps, thresholds fixed, within bounds; and the squares that are left."""
        theta = start.copy()
        parameters = self.model.parameters(effects, choice)
        bounds = Bounds(*bounds_of(parameters))
        free = np.array([not parameter.shape for parameter in parameters], dtype=bool)
        fitted = (self.model.effects[name] for name in (*self.model.contained, *effects))
        is_bilinear = any(effect.measurement is not None or effect.weighed_by for effect in fitted)
        for _ in range(_QUICK_STEPS if is_bilinear else 1):
            sums = self._with_drawing(self._sums_of_runs(effects, choice, theta), parameters, theta)
            theta = bounded_step(sums, theta, bounds=bounds, free=free, damping=_RIDGE)
        return theta, self._sums_of_runs(effects, choice, theta).cost

    def _with_drawing(
        self, sums: CostSums[None], parameters: Sequence[Parameter], theta: FloatArray
    ) -> CostSums[None]:
        """Sums with what the drawing says of the curves, whose orders the fit alone cannot tell."""
        if CURVE_ERROR not in self.model.contained:
            return sums
        std = np.array([p.prior_std for p in parameters])
        weight = float(self.noise.mean()) / std**2
        mean = np.array([p.prior_mean for p in parameters])
        matrix = sums.matrix + np.diag(weight)
        return replace(sums, matrix=matrix, slope=sums.slope - weight * (theta - mean))

    def _sums_of_runs(self, effects: Effects, choice: Choice, theta: FloatArray) -> CostSums[None]:
        """``J.T J``, ``J.T r`` and ``r.T r`` over all runs and channels."""
        matrix, right = np.zeros((theta.size, theta.size)), np.zeros(theta.size)
        square = 0.0
        for runs in self.records.slices:
            table = self.model.weights(effects, choice, theta, runs)
            gram = self.records.gram_of_runs(table.columns, runs)
            residual, unknowns = table.residual, table.unknowns
            of_runs, right_of_runs = normal_sums(table.slopes, gram, residual)
            np.add.at(matrix, (unknowns[:, :, None], unknowns[:, None, :]), of_runs)
            np.add.at(right, unknowns, right_of_runs)
            square += float(((gram @ residual[..., None])[..., 0] * residual).sum())
        return CostSums(square, matrix, right, None)

    def _best_of(self, effects: Effects, choice: Choice) -> tuple[FloatArray, float]:
        """Best fit to all segments over the nodes of the shapes, those of one effect at a time."""
        parameters = self.model.parameters(effects, choice)
        start = np.array([0.5 * (p.lower + p.upper) if p.shape else 0.0 for p in parameters])
        best = self._closed_fit(effects, choice, start)
        for effect in dict.fromkeys(p.effect for p in parameters if p.shape):
            shapes = [k for k, p in enumerate(parameters) if p.shape and p.effect == effect]
            for variant in self.model.variants(effect):
                start = best[0].copy()
                start[shapes] = variant
                fit = self._closed_fit(effects, choice, start)
                # Thresholds between which no load lies leave the same but for rounding, which must
                # not choose: from the last of them a fit finds no load that it could part.
                if costs_more(best[1], fit[1]):
                    best = fit
        return best


def carrier_problem(
    campaign: Campaign, curves: Mapping[str, DeflectionCurve], measured_laws: Sequence[Law] = ()
) -> CarrierProblem:
    """ComparisonProblem of a campaign of kind ``carrier``.

    Of the curves ``g_f`` is required where uneven pin loads are to be looked for, those of the
    drawing where the campaign states tolerances: the sizes of the baseline's curves are then the
    drawing's, with a pin fit that is not known.
    """
    _refuse_silent_channels(campaign.within_use())
    motion = off_orders(campaign)
    campaign = motion.campaign
    rig = carrier_rig(campaign.rig, curves)
    known = known_physics(campaign)
    contained = tuple(campaign.baseline.effects)
    radial = tuple(RADIAL_MOTION.values()) if _has_radial(campaign) else ()
    unseen = set(contained) & RADIAL_MOTION.keys() - {effect.id for effect in radial}
    if unseen:
        raise ValueError(
            f"[baseline] effects hold {' and '.join(sorted(unseen))}, which radial sensors alone "
            f'see; expected a channel with quantity = "{RADIAL}", or leave it out'
        )
    effects = carrier_library(rig, (*effects_of_laws(measured_laws, campaign), *radial))
    if campaign.causes:
        # Sizes of causes inside the stage are those that it was solved at.
        solved = [one.id for one in campaign.causes if one.parameters[0].name == RESPONSE]
        fixed = {f"{name}.{RESPONSE}": KnownValue(1.0, RESPONSE_STD) for name in solved}
        known = replace(known, fixed={**fixed, **known.fixed})
        effects |= {cause.id: cause for cause in campaign.causes}
    if TOLERANCES in campaign.rig:
        contained, known, of_drawing = _by_drawing(campaign, curves, known)
        effects |= of_drawing
        # Between pins that are not fitted and bonded ones lies the pin fit.
        del effects[STIFF_PINS.id]
    source = ColumnSource(rig, effects, typical_speed(campaign), largest_load(campaign))
    records = accumulated_sums(campaign, source)
    if campaign.baseline.source == "columns":
        # Another simulator's prediction stands as it is; only its zero is free.
        contained = tuple(name for name in contained if name == AXIAL_OFFSET.id)
    runs = tuple(run.name for run in campaign.runs)
    channels = tuple(channel.name for channel in campaign.channels)
    classes = {law.name: law.effect_class for law in measured_laws}
    model = CarrierModel(source, records.index, contained, runs, channels, known, classes)
    noise = _channel_noise(campaign, records)
    return CarrierProblem(campaign, model, records, noise, motion)


def flexibility(rho_s: float, rho_f: float) -> float:
    """How flexible a carrier is over its drawing, ``rho_f + 0.69 rho_s``, whatever its pin fit.

    From pins without stiffness to a rigid fit the shares of the drawn carrier stay below 1
    (docs/reduction.md: `rho_f` and `rho_s` from 0 and 1 to 1.26 and 0.13).
    """
    return rho_f + _RIGID_FIT * rho_s


def _by_drawing(
    campaign: Campaign, curves: Mapping[str, DeflectionCurve], known: KnownPhysics
) -> tuple[Effects, KnownPhysics, dict[str, Effect]]:
    """Effects of a baseline that is the carrier as drawn, what is known of it, effects by id."""
    # The drawn curve has its own size, and no more than the tolerance of its orders is free.
    tolerances = dict(campaign.rig[TOLERANCES])
    std = float(tolerances.pop(CURVES, _CURVES_STD))
    fixed = dict(known.fixed)
    n_planets, radial = int(campaign.rig["n_planets"]), _has_radial(campaign)
    contained = [curve_error_effect(curves["delta_f"], n_planets, std, radial=radial)]
    rho_f = f"{FLEXIBLE_PINS.id}.rho_f"
    if rho_f not in fixed:
        fixed |= {rho_f: KnownValue(1.0, 0.0), f"{PIN_FIT}.w": KnownValue(0.5, 0.5)}
        contained.append(pin_fit_effect(curves))
        if STIFF_PINS.id in campaign.baseline.effects:
            contained.append(bond_effect(curves))
            fixed[f"{BOND}.b"] = KnownValue(0.5, 0.5)
    causes = drawing_effects(curves, tolerances, n_planets)
    for effect in (contained[0], *causes):
        for parameter in effect.parameters:
            fixed[f"{effect.id}.{parameter.name}"] = KnownValue(0.0, parameter.scale)
    stated = [name for name in campaign.baseline.effects if name != STIFF_PINS.id]
    names = tuple(dict.fromkeys((*stated, FLEXIBLE_PINS.id, *(one.id for one in contained))))
    effects = {effect.id: effect for effect in (*contained, *causes)}
    return names, replace(known, fixed=fixed), effects


def _experiments(
    campaign: Campaign, source: ColumnSource, under: _Under
) -> tuple[CandidateExperiment, ...]:
    """Steps of torque, of radial load along z and y, and radial loads at low torque."""
    nominal = source.rig.nominal_torque
    size = source.largest_load
    force = size if size > 1.0 else RigLimits().radial_load
    recorded = np.array([[mean_load(run, name) for name in _LOADS] for run in campaign.runs])
    recorded /= (nominal, force, force)
    shares = (-1.0, -0.5, 0.25, 0.5, 1.0)
    kilo = f"{force / 1e3:g} kN"
    both_signs = f"up to {kilo} of both signs at full torque"
    directions = ((1.0, 0.0), (0.0, 1.0), (0.0, -1.0))
    plans: dict[str, list[_Load]] = {
        "steps of 10, 25, 50, 75 and 100 % torque without radial load": [
            (s, 0.0, 0.0) for s in (0.1, 0.25, 0.5, 0.75, 1.0)
        ]
    }
    if "ntl_y" in campaign.contract.inputs:
        plans |= {
            f"five radial loads along z {both_signs}": [(1.0, 0.0, s) for s in shares],
            f"five radial loads along y {both_signs}": [(1.0, s, 0.0) for s in shares],
            f"radial loads of {kilo} along y and z at a quarter and at full torque": [
                (t, y, z) for t in (0.25, 1.0) for y, z in directions
            ],
        }
    experiments = []

    def add(text: str, shares_of_loads: Sequence[_Load], *sensors: Channel) -> None:
        loads = [(t * nominal, y * force, z * force) for t, y, z in shares_of_loads]
        runs = _steady_runs(campaign, loads, source.speed, sensors)
        experiments.append(CandidateExperiment(text, partial(under, runs)))

    for text, shares_of_loads in plans.items():
        nearest = [np.abs(recorded - load).max(axis=1).min() for load in shares_of_loads]
        if max(nearest) >= SAME_CONDITION:
            add(text, shares_of_loads)
    # A dimension moves the radial curve in other proportions than the axial one: a drawing adds a
    # radial sensor.
    if TOLERANCES in campaign.rig and not _has_radial(campaign):
        add(
            "steps of 25, 50 and 100 % torque with one radial sensor at the rim more",
            [(share, 0.0, 0.0) for share in (0.25, 0.5, 1.0)],
            replace(campaign.channels[0], name="radial", quantity=RADIAL),
        )
    return tuple(experiments)


def _has_radial(campaign: Campaign) -> bool:
    return any(channel.quantity == RADIAL for channel in campaign.channels)


def _steady_runs(
    campaign: Campaign, loads: Sequence[_Load], speed: float, added: tuple[Channel, ...]
) -> Campaign:
    """Campaign of steady runs with some channels more; its signals are blank."""
    channels = (*campaign.channels, *added)
    angle = 2.0 * np.pi * np.arange(_REVOLUTIONS * SAMPLES_A_TURN + 1) / SAMPLES_A_TURN
    runs = []
    for k, load in enumerate(loads, start=1):
        run = steady_run(campaign, f"step {k}", f"step {k}", angle / speed, angle, load)
        blank = {channel.name: np.zeros(angle.size) for channel in channels}
        runs.append(replace(run, signals=blank))
    baseline = replace(campaign.baseline, source="model")
    return replace(campaign, channels=channels, runs=tuple(runs), baseline=baseline)


def steady_run(
    campaign: Campaign,
    name: str,
    condition: str,
    time: FloatArray,
    angle: FloatArray,
    loads: Sequence[float],
) -> Run:
    """Run under constant torque and radial load along y and z; its signals are blank."""
    columns = {one: np.full(time.size, value) for one, value in zip(_LOADS, loads, strict=True)}
    columns["carrier_angle"] = angle
    inputs = {one: columns[one] for one in campaign.contract.inputs if one in columns}
    blank = {channel.name: np.zeros(time.size) for channel in campaign.channels}
    return Run(name, f"{name}.csv", condition, time, inputs, blank)


def _refuse_silent_channels(campaign: Campaign) -> None:
    """Refuse channels that say nothing."""
    for channel in campaign.channels:
        signals = [run.signals[channel.name] for run in campaign.runs]
        measured = [signal[np.isfinite(signal)] for signal in signals]
        if not any(signal.size for signal in measured):
            raise ValueError(
                f"channel {channel.name}: every sample of every run is missing; expected a "
                "signal, or leave the channel out"
            )
        if all(np.ptp(signal) == 0.0 for signal in measured if signal.size):
            raise ValueError(
                f"channel {channel.name}: the signal is constant in every run; expected one that "
                "moves (a sensor without power reads a constant)"
            )


def _channel_noise(campaign: Campaign, records: CarrierSums) -> FloatArray:
    """Variance of the noise of every channel [m²], shape (n_channels,)."""
    # Declared noise first. Otherwise what is left of a revolution about its own orders, and half
    # the squared change of every order from one revolution to the next: drift and slow changes of
    # the load hardly enter.
    variances = _scatter(records)
    for c, channel in enumerate(campaign.channels):
        if channel.noise_std is not None:
            variances[c] = channel.noise_std**2
        if not np.isfinite(variances[c]):
            raise ValueError(
                f"channel {channel.name}: no revolution has enough samples to separate noise from "
                "signal; give 'noise_std'"
            )
    return variances


def _scatter(records: CarrierSums) -> FloatArray:
    target = records.orders
    same_run = np.diff(records.run_of_revolution) == 0
    weight = np.where(np.arange(target.shape[2]) == 0, 1.0, 0.5)
    change = 0.5 * (np.abs(np.diff(target, axis=0)[same_run]) ** 2 * weight).sum(axis=2)
    fitted = 2.0 * target.shape[2] - 1.0
    square, degrees = records.within.sum(axis=0).T
    white = square / np.where(degrees > 0.0, degrees, np.nan)
    n = degrees / np.maximum(np.count_nonzero(records.within[..., 1], axis=0), 1) + fitted
    complete = np.isfinite(change)
    n_changes = np.count_nonzero(complete, axis=0)
    mean_change = np.where(complete, change, 0.0).sum(axis=0) / np.maximum(n_changes, 1)
    return np.where(n_changes > 0, white * (n - fitted) / n + mean_change, white)
