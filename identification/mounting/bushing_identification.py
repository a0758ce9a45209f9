"""Bushing parameters from a mounting campaign.

The three models in turn, each warm-started from the simpler one.
"""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.estimation.complex_method import ComplexSearch, complex_search
from carrierflex.identification.estimation.fit_uncertainty import (
    FitUncertainty,
    fit_uncertainty,
    profile_likelihood,
)
from carrierflex.identification.estimation.nonlinear_fit import NonlinearFit, Residuals, bounded_fit
from carrierflex.identification.estimation.resampling import block_counts
from carrierflex.identification.estimation.several_starts import (
    best_of_starts,
    check_nested,
    merged_values,
)
from carrierflex.identification.estimation.single_thread import single_threaded
from carrierflex.identification.mounting.bushing_models import (
    AXIAL,
    BUSHING_MODELS,
    BushingModel,
    MountingResiduals,
    mounting_residuals,
)
from carrierflex.simulation.fit_parameter import FitParameter
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.parameter_arrays import parameter_array
from carrierflex.simulation.mounting.rig import MountingRig
from carrierflex.simulation.mounting.simulate import MountingResponse, simulate

Array = NDArray[np.float64]

#: Length of the time blocks whose residuals count as one observation [s]: some cycles of the
#: slowest mode and of the shaft; shorter where a campaign would have fewer than `_FEWEST_BLOCKS`.
_BLOCK_SECONDS = 10.0
_FEWEST_BLOCKS = 24
#: Starts that are searched from: the simpler model's solution and the best of the others.
_SEARCHED_STARTS = 4
#: Points of a likelihood profile.
_PROFILE_POINTS = 9
#: Relative change of cost and parameters at which a bootstrap refit ends: far below the scatter of
#: the refits.
_ROUGH = 1e-4
#: Starts search on every n-th sample: so many samples of a run are enough to rank them.
_SEARCH_SAMPLES = 4000


@dataclass(frozen=True, eq=False)
class BushingEstimate:
    """One model fitted to a campaign.

    Parameters
    ----------
    model : BushingModel
        Fitted model.
    fit : NonlinearFit
        Values, residuals and model runs, those of its starts included.
    uncertainty : FitUncertainty
        Covariance and what the data cannot see.
    rms : float
        RMS of measured minus simulated, all sensors [m].
    rms_by_run : mapping
        RMS by run and sensor [m].
    seconds : float
        Time of the fit [s].
    simulation_seconds : float
        Time of one simulation of all runs [s].
    """

    model: BushingModel
    fit: NonlinearFit
    uncertainty: FitUncertainty
    rms: float
    rms_by_run: Mapping[str, Mapping[str, float]]
    seconds: float
    simulation_seconds: float

    @property
    def ci95(self) -> Array:
        """Ends of the 95 % intervals within the bounds of the search, shape (p, 2)."""
        half = self.uncertainty.confidence_factor * self.uncertainty.std
        lower, upper = np.array([(one.lower, one.upper) for one in self.fit.free]).T
        ends = np.column_stack([self.fit.values - half, self.fit.values + half])
        inside = np.clip(ends, lower[:, None], upper[:, None])
        return np.where(np.isfinite(ends), inside, ends)

    def simulated(self, rig: MountingRig, inputs: MountingInputs) -> MountingResponse:
        """Response of the fitted bushings to loads."""
        values = self.model.simulator_values(self.fit.values)
        return simulate(rig, parameter_array(rig, values), inputs)

    @property
    def undetermined(self) -> tuple[str, ...]:
        """What the records do not determine, in sentences; no constant of a bushing is zero."""
        intervals = zip(self.fit.names, *self.ci95.T, strict=True)
        return self.uncertainty.undetermined + tuple(
            f"{name} is not determined: its 95 % interval, {low:.2g} to {high:.2g} "
            f"{self.model.unit(name)}, includes zero"
            for name, low, high in intervals
            if -np.inf < low <= 0.0 <= high and low < high
        )


def identify_bushings(
    campaign: Campaign,
    last: BushingModel,
    executor: Executor,
    *,
    weights: Mapping[str, float] | None = None,
    axial: Sequence[str] = (),
    progress: Callable[[str], None] = lambda text: None,
) -> tuple[BushingEstimate, ...]:
    """Fit the bushing models up to `last`, from the simplest to the richest.

    Parameters
    ----------
    campaign : Campaign
        Campaign of kind ``mounting``.
    last : BushingModel
        Richest model wanted.
    executor : Executor
        Where the starts run.
    weights : mapping of str to float, optional
        Weights of the housing's motion in the objective (equation 12); without them the sensors are
        compared.
    axial : sequence of str
        Axial constants that are unknown too, of :data:`~.bushing_models.AXIAL`; the others keep the
        rig's values. :func:`identify_with_shown_axial` finds which a campaign shows.
    progress : callable
        Told what begins.

    Returns
    -------
    tuple of BushingEstimate
        One for each model.

    Raises
    ------
    ValueError
        Where the campaign is of another kind or too short.
    ArithmeticError
        Where a richer model fits worse than one it contains.

    References
    ----------
    .. [1] 2011 paper, section 5, equation (12).
    """
    estimates: list[BushingEstimate] = []
    for plain_model in BUSHING_MODELS[: BUSHING_MODELS.index(last) + 1]:
        model = plain_model.with_axial(axial) if axial else plain_model
        progress(f"{model.name}: {len(model.names)} parameters")
        begin = perf_counter()
        residuals = mounting_residuals(campaign, model, weights)
        simpler = estimates[-1] if estimates else None
        fit = _fitted(residuals, simpler, executor)
        if simpler is not None:
            check_nested(fit.cost, simpler.fit.cost, (model.name, simpler.model.name))
        estimates.append(_estimate(campaign, residuals, fit, perf_counter() - begin))
    return tuple(estimates)


def identify_with_shown_axial(
    campaign: Campaign,
    last: BushingModel,
    executor: Executor,
    *,
    weights: Mapping[str, float] | None = None,
) -> tuple[BushingEstimate, ...]:
    """Fit the bushing models up to `last`, with those axial constants unknown that are shown.

    Axial springs and dampers act on the housing's yaw, which a load to the side drives. Shown is
    what `last`, fitted with both unknown, holds away from zero by its 95 % interval; the other one
    keeps the rig's value.

    Parameters
    ----------
    campaign, last, executor, weights
        As for :func:`identify_bushings`.

    Returns
    -------
    tuple of BushingEstimate
        One for each model, all with the same axial unknowns.
    """
    every = identify_bushings(campaign, last, executor, weights=weights, axial=tuple(AXIAL))
    least = dict(zip(every[-1].fit.names, every[-1].ci95[:, 0], strict=True))
    shown = tuple(name for name in AXIAL if least[name] > 0.0)
    if len(shown) == len(AXIAL):
        return every
    return identify_bushings(campaign, last, executor, weights=weights, axial=shown)


def search_bushings(
    campaign: Campaign,
    model: BushingModel,
    *,
    weights: Mapping[str, float] | None = None,
    seed: int = 0,
    max_evaluations: int = 5000,
    tolerance: float = 1e-4,
) -> ComplexSearch:
    """Search the parameters by the complex method, as the paper did.

    Parameters
    ----------
    campaign, model, weights
        As for :func:`identify_bushings`.
    seed : int
        Of the first population.
    max_evaluations : int
        Simulations at most.
    tolerance : float
        Spread of the population at which the search ends.

    Returns
    -------
    ComplexSearch
        Best point, its cost and the number of simulations.
    """
    residuals = mounting_residuals(campaign, model, weights)
    free = model.free(residuals.rig)

    def cost(values: Array) -> float:
        """Sum of squares; infinite where the motion leaves the model."""
        try:
            return float(np.square(residuals(values)).sum())
        except ArithmeticError:  # the run left the model: as bad as can be
            return np.inf

    lower, upper = (np.array([getattr(one, end) for one in free]) for end in ("lower", "upper"))
    rng = np.random.default_rng(seed)
    with single_threaded():  # small matrices, as in bounded_fit
        return complex_search(
            cost, lower, upper, rng=rng, tolerance=tolerance, max_evaluations=max_evaluations
        )


def bootstrapped(
    campaign: Campaign,
    estimate: BushingEstimate,
    executor: Executor,
    n_samples: int,
    seed: int,
    weights: Mapping[str, float] | None = None,
) -> BushingEstimate:
    """Copy of an estimate with the covariance of full refits to resampled time blocks.

    Parameters
    ----------
    campaign, weights
        As the estimate was made with.
    estimate : BushingEstimate
        Solution.
    executor : Executor
        Where the refits run.
    n_samples, seed : int
        Refits, and the seed of their draws.

    Returns
    -------
    BushingEstimate
        Same values.
    """
    residuals = mounting_residuals(campaign, estimate.model, weights)
    rng = np.random.default_rng(seed)
    blocks = residuals.blocks(_block_seconds(residuals))
    covariance = _bootstrap_covariance(
        residuals, estimate.fit, blocks, n_samples=n_samples, rng=rng, executor=executor
    )
    refitted = replace(estimate.uncertainty, covariance=covariance)
    return replace(estimate, uncertainty=_without_shown_slip(residuals, estimate.fit, refitted))


def profiled(
    campaign: Campaign,
    estimate: BushingEstimate,
    name: str,
    weights: Mapping[str, float] | None = None,
) -> tuple[Array, Array]:
    """One parameter within three standard deviations, and cost over the least, others refitted.

    Raises
    ------
    ValueError
        Where the parameter has no finite standard deviation to step by.
    """
    k = estimate.fit.names.index(name)
    std, free = float(estimate.uncertainty.std[k]), estimate.fit.free[k]
    if not (np.isfinite(std) and std > 0.0):
        raise ValueError(
            f"profile of {name}: its standard deviation is {std}; "
            "expected a parameter that the data determine"
        )
    values = np.clip(
        estimate.fit.values[k] + std * np.linspace(-3.0, 3.0, _PROFILE_POINTS),
        free.lower,
        free.upper,
    )
    residuals = mounting_residuals(campaign, estimate.model, weights)
    cost, _ = profile_likelihood(residuals, estimate.fit, name, values.tolist())
    return values, cost / estimate.fit.cost


def _block_seconds(residuals: MountingResiduals) -> float:
    total = sum(float(inputs.time[-1] - inputs.time[0]) for inputs in residuals.inputs)
    return min(_BLOCK_SECONDS, total / _FEWEST_BLOCKS)


def _fitted(
    residuals: MountingResiduals, simpler: BushingEstimate | None, executor: Executor
) -> NonlinearFit:
    """Search a thinned record from several starts, the simpler model's too; finish on all of it."""
    free = residuals.model.free(residuals.rig)
    starts = _search_starts(
        residuals, None if simpler is None else (simpler.model, simpler.fit.values)
    )
    if simpler is None:  # nearly linear in its parameters: one start is enough
        return bounded_fit(residuals, free, starts[0])
    searched = best_of_starts(_thinned(residuals), free, starts, executor, most=_SEARCHED_STARTS)
    candidates = [searched.values, starts[0]]
    costs = [float(np.square(residuals(start)).sum()) for start in candidates]
    fit = bounded_fit(residuals, free, candidates[int(np.argmin(costs))])
    return replace(fit, model_runs=fit.model_runs + searched.model_runs + 2)


def _estimate(
    campaign: Campaign, residuals: MountingResiduals, fit: NonlinearFit, seconds: float
) -> BushingEstimate:
    uncertainty = _without_shown_slip(
        residuals, fit, fit_uncertainty(fit, residuals.blocks(_block_seconds(residuals)))
    )
    begin = perf_counter()
    plain = MountingResiduals(
        residuals.rig,
        residuals.model,
        residuals.inputs,
        residuals.signals,
        residuals.sensors,
        np.eye(len(residuals.sensors)),
    )
    gaps = plain(fit.values)
    simulation_seconds = perf_counter() - begin
    rms, by_run = _rms(campaign, plain, gaps)
    return BushingEstimate(
        residuals.model, fit, uncertainty, rms, by_run, seconds, simulation_seconds
    )


def _without_shown_slip(
    residuals: MountingResiduals, fit: NonlinearFit, uncertainty: FitUncertainty
) -> FitUncertainty:
    """Infinite errors of K1, Kp, Fy where a slider that never slips, or none, does as well."""
    # The first is a spring beside K1: the records then determine the sum alone.
    names = list(fit.names)
    if "Kp" not in names:
        return uncertainty
    K1, Kp = names.index("K1"), names.index("Kp")
    stiffness = np.array([fit.values[K1], fit.values[K1] + fit.values[Kp]])
    costs = []
    for spring in stiffness:
        values = fit.values.copy()
        values[[K1, Kp]] = spring, 0.0
        costs.append(float(np.square(residuals(values)).sum()))
    noise_square = fit.cost / (residuals.counted().sum() - len(names))
    if min(costs) - fit.cost > uncertainty.confidence_factor**2 * noise_square:
        return uncertainty
    covariance = uncertainty.covariance.copy()
    mixed = [K1, Kp, names.index("Fy")]
    covariance[mixed, :] = covariance[:, mixed] = 0.0
    covariance[mixed, mixed] = np.inf
    text = (
        "K1, Kp and Fy cannot be separated: these records do not show that the elasto-plastic "
        f"branch slips; as a spring it is within K1 + Kp = {stiffness[np.argmin(costs)]:.4g} N/m"
    )
    others = tuple(one for one in uncertainty.undetermined if one != text)
    return replace(uncertainty, covariance=covariance, undetermined=(text, *others))


def _rms(
    campaign: Campaign, plain: MountingResiduals, gaps: Array
) -> tuple[float, dict[str, dict[str, float]]]:
    """RMS over everything and by run and channel; missing samples do not count."""
    counted = plain.counted()
    first, by_run = 0, {}
    for run, inputs, count in zip(campaign.runs, plain.inputs, counted, strict=True):
        last = first + inputs.time.size * len(plain.sensors)
        square = np.square(gaps[first:last].reshape(-1, len(plain.sensors))).sum(axis=0)
        mean = np.divide(square, count, out=np.full_like(square, np.nan), where=count > 0.0)
        by_run[run.name] = {
            channel.name: float(np.sqrt(value))
            for channel, value in zip(campaign.channels, mean, strict=True)
        }
        first = last
    return float(np.sqrt(np.square(gaps).sum() / counted.sum())), by_run


def _bootstrap_covariance(
    residuals: Residuals,
    fit: NonlinearFit,
    blocks: NDArray[np.int64],
    *,
    n_samples: int,
    rng: np.random.Generator,
    executor: Executor,
) -> Array:
    """Covariance of full refits to resampled time blocks, shape (p, p)."""
    numbers, block = np.unique(blocks, return_inverse=True)
    futures = []
    for _ in range(n_samples):
        drawn = block_counts(numbers.size, rng)
        sample = _Drawn(residuals, np.sqrt(drawn)[block])
        futures.append(executor.submit(bounded_fit, sample, fit.free, fit.values, tolerance=_ROUGH))
    values = []
    for future in futures:
        try:
            values.append(future.result().values)
        except (ValueError, ArithmeticError):
            continue
    if len(values) < 2:
        raise ValueError(
            f"{len(values)} of {n_samples} bootstrap refits succeeded; expected at least 2"
        )
    return np.cov(np.array(values), rowvar=False) * numbers.size / (numbers.size - 1.0)


@dataclass(frozen=True, eq=False)
class _Drawn:
    """Residuals of a bootstrap sample: each multiplied by the root of how often it was drawn."""

    residuals: Residuals
    factor: Array

    def __call__(self, values: Array) -> Array:
        return self.residuals(values) * self.factor


def _search_starts(
    residuals: MountingResiduals, simpler: tuple[BushingModel, Array] | None
) -> list[Array]:
    """Starts of a model: the simpler one's solution, then one a way that added terms matter."""
    model, K = residuals.model, residuals.rig.bushing_radial_stiffness
    free = model.free(residuals.rig)
    zero = dict.fromkeys(model.names, 0.0)
    if simpler is None:
        rig = residuals.rig
        base = {
            **zero,
            "K1": K,
            "C1": rig.bushing_radial_damping,
            "K_x": rig.bushing_axial_stiffness,
            "C_x": rig.bushing_axial_damping,
        }
        guesses: list[dict[str, float]] = [{}]
    else:
        known = simpler[0].simulator_values(simpler[1])
        base = {**zero, **model.values_of(known)}
        guesses = [{}, *_guesses(model, base, free)]
    return [merged_values(free, {**base, **guess}, zero) for guess in guesses]


def _guesses(
    model: BushingModel, base: Mapping[str, float], free: Sequence[FitParameter]
) -> list[dict[str, float]]:
    scale = {one.name: one.scale for one in free}
    K1 = base["K1"]
    guesses = [{"K1": share * K1, "K3": (1.0 - share) * scale["K3"]} for share in (0.7, 1.3)]
    if "Kp" not in model.names:
        return guesses

    def slider(yielding: float) -> dict[str, float]:
        return {"K1": 0.6 * K1, "Kp": 0.4 * K1, "Fy": yielding * scale["Fy"]}

    for tau in (0.1, 1.0):
        guesses += [{**slider(share), "k": K1, "c": tau * K1} for share in (0.1, 0.4)]
    # A slider that never slips, and the fluid branch in place of the damper.
    C0 = base["C0"]
    return [*guesses, {**slider(2.0), "C0": 0.1 * C0, "k": 3.0 * K1, "c": 0.9 * C0}]


def _thinned(residuals: MountingResiduals) -> MountingResiduals:
    """Residuals of every n-th sample; the loads stay linear between the samples that are left."""
    inputs, signals = [], []
    for of_run, measured in zip(residuals.inputs, residuals.signals, strict=True):
        every = slice(None, None, max(1, of_run.time.size // _SEARCH_SAMPLES))
        inputs.append(type(of_run)(*(column[every] for column in of_run.columns().values())))
        signals.append(measured[every])
    return replace(residuals, inputs=tuple(inputs), signals=tuple(signals))
