"""Identification of the carrier's motion.

Models M1 and M2 fitted run by run or jointly, in closed form.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as fisher_f
from scipy.stats import t as student_t

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.revolutions import whole_revolutions
from carrierflex.identification.carrier.models import CarrierModel
from carrierflex.identification.carrier.parameter_estimate import SHARED, ParameterEstimate
from carrierflex.identification.carrier.robust_loss import huber_equations
from carrierflex.identification.estimation.least_squares import (
    FEWEST_REVOLUTIONS,
    JointFit,
    joint_fit,
    unseen_in_words,
)
from carrierflex.identification.estimation.normal_equations import NormalEquations, normal_equations
from carrierflex.identification.estimation.polar_pair import polar_values
from carrierflex.identification.estimation.resampling import circular_block_counts
from carrierflex.simulation.carrier.effect import Effect
from carrierflex.simulation.carrier.run_cases import AXIAL, RADIAL

#: With fewer samples a covariance is itself uncertain by more than ten percent.
_FEWEST_SAMPLES = 50
#: Runs that agree look this different once in a thousand campaigns.
_DISAGREEMENT = 1e-3
SCATTER_OF_RUNS = (
    "shared parameters: jackknife over runs, which disagree; others: jackknife over revolutions"
)


def axial_channels(campaign: Campaign) -> tuple[Channel, ...]:
    """Axial rim sensors of a carrier campaign.

    Raises
    ------
    ValueError
        Where the campaign is of another kind or has no axial channel.
    """
    if campaign.kind != "carrier":
        raise ValueError(
            f"campaign '{campaign.name}' is of kind {campaign.kind}; models m1 and m2 are for "
            "kind carrier only"
        )
    channels = campaign.channels_of(AXIAL)
    if not channels:
        raise ValueError(
            f"campaign '{campaign.name}' has no channel of quantity {AXIAL}; expected at least one"
        )
    return channels


def rim_channels(campaign: Campaign) -> tuple[Channel, ...]:
    """Axial and radial rim sensors of a carrier campaign.

    Refuses what :func:`axial_channels` refuses.
    """
    return (*axial_channels(campaign), *campaign.channels_of(RADIAL))


@dataclass(frozen=True)
class FitOptions:
    """How a model is fitted.

    Parameters
    ----------
    radial : bool
        Fit the radial sensors too; the model then needs their motion
        (:func:`~carrierflex.identification.carrier.models.with_radial_motion`).
    huber : bool
        Huber's loss instead of squares: outliers count linearly.
    bootstrap : int
        Samples of the block bootstrap over revolutions that gives the covariance; 0: the jackknife.
    seed : int
        Of the bootstrap.

    Raises
    ------
    ValueError
        Where the number of samples is negative, or too small for a covariance.
    """

    radial: bool = False
    huber: bool = False
    bootstrap: int = 0
    seed: int = 0

    def __post_init__(self) -> None:
        if self.bootstrap < 0 or 0 < self.bootstrap < _FEWEST_SAMPLES:
            raise ValueError(
                f"bootstrap is {self.bootstrap} samples; expected 0 (none) or at least "
                f"{_FEWEST_SAMPLES}"
            )


#: Axial sensors, squared residuals, jackknife: the papers' way.
LEAST_SQUARES = FitOptions()


def identify_jointly(
    campaign: Campaign, model: CarrierModel, options: FitOptions = LEAST_SQUARES
) -> ParameterEstimate:
    """Fit one model to all runs at once; shared parameters get one value.

    Parameters
    ----------
    campaign : Campaign
        Campaign of kind ``carrier``.
    model : CarrierModel
        :func:`~carrierflex.identification.carrier.models.rigid_model`, ``flexible_model`` or
        another list of effects.
    options : FitOptions
        Sensors, loss and source of the covariance.

    Returns
    -------
    ParameterEstimate
        Shared parameters and those of every run.

    Raises
    ------
    ValueError
        Where the campaign is of another kind, or a run is shorter than one revolution.

    References
    ----------
    .. [1] 2012 paper, section 2.3. Its five parameters need no search: equations (1) and (7) are
       linear in d_x, the two components of each tilt, rho_s and rho_f.
    """
    runs = campaign.within_use().runs
    return _identify(runs, fitted_channels(campaign, options), model, options)


def identify_each_run(
    campaign: Campaign,
    model: CarrierModel,
    options: FitOptions = LEAST_SQUARES,
) -> dict[str, ParameterEstimate]:
    """Fit one model to every run by itself, the way of the papers.

    Parameters
    ----------
    campaign : Campaign
        Campaign of kind ``carrier``.
    model : CarrierModel
        Model; every parameter becomes one of the run.
    options : FitOptions
        Sensors, loss and source of the covariance.

    Returns
    -------
    dict of str to ParameterEstimate
        Estimate by run name.

    Raises
    ------
    ValueError
        As :func:`identify_jointly`.
    """
    each_run = model.each_run()
    channels = fitted_channels(campaign, options)
    runs = campaign.within_use().runs
    return {run.name: _identify((run,), channels, each_run, options) for run in runs}


def identify_from_sums(
    equations: Sequence[NormalEquations],
    model: CarrierModel,
    options: FitOptions = LEAST_SQUARES,
) -> ParameterEstimate:
    """Solve a model from the sums of its runs, as a long record that is read in pieces leaves them.

    Parameters
    ----------
    equations : sequence of NormalEquations
        One for each run, of `model`.
    model : CarrierModel
        Model.
    options : FitOptions
        Source of the covariance; sensors and loss were decided with the sums.

    Returns
    -------
    ParameterEstimate
        Shared parameters and those of every run.
    """
    if options.bootstrap:
        rng = np.random.default_rng(options.seed)
        fit = _with_bootstrap(joint_fit(equations, model.shared), equations, options.bootstrap, rng)
    else:
        fit = _with_scatter_of_runs(joint_fit(equations, model.shared), equations, model.shared)
    return _parameter_estimate(model, equations, fit)


def fitted_channels(campaign: Campaign, options: FitOptions) -> tuple[Channel, ...]:
    """Sensors that the options ask for; refuses what :func:`axial_channels` refuses."""
    return rim_channels(campaign) if options.radial else axial_channels(campaign)


def fitted_equations(
    campaign: Campaign, model: CarrierModel, options: FitOptions
) -> list[NormalEquations]:
    """Sums of every run for the sensors and the loss that the options ask for."""
    runs = campaign.within_use().runs
    return _equations(runs, fitted_channels(campaign, options), model, options)


def _equations(
    runs: Sequence[Run], channels: Sequence[Channel], model: CarrierModel, options: FitOptions
) -> list[NormalEquations]:
    if options.huber:
        return huber_equations(runs, channels, model)
    return [normal_equations(run, channels, model) for run in runs]


def _identify(
    runs: Sequence[Run], channels: Sequence[Channel], model: CarrierModel, options: FitOptions
) -> ParameterEstimate:
    estimate = identify_from_sums(_equations(runs, channels, model, options), model, options)
    if not options.huber:
        return estimate
    # The RMS is that of all samples, outliers included, whatever weight they had in the fit.
    return _with_residuals_of(estimate, [normal_equations(run, channels, model) for run in runs])


def fitted_signal(
    run: Run, channel: Channel, model: CarrierModel, estimate: ParameterEstimate
) -> NDArray[np.float64]:
    """Signal of one channel by the identified model.

    Parameters
    ----------
    run : Run
        Record that drives the model.
    channel : Channel
        Axial channel.
    model : CarrierModel
        Model.
    estimate : ParameterEstimate
        Its parameters.

    Returns
    -------
    ndarray, shape (n,)
        Displacement [m] over the whole record.
    """
    return model.design(run.inputs, channel) @ estimate.run_coefficients[run.name]


def residual_signal(
    run: Run, channel: Channel, model: CarrierModel, estimate: ParameterEstimate
) -> NDArray[np.float64]:
    """Measurement minus identified model [m], shape (n,); NaN where the sample is missing."""
    return run.signals[channel.name] - fitted_signal(run, channel, model, estimate)


def two_revolutions(run: Run) -> NDArray[np.int64]:
    """Sample numbers of the first two whole revolutions, or of the only one."""
    return np.sort(np.concatenate(whole_revolutions(run).samples[:2]))


def _parameter_estimate(
    model: CarrierModel, equations: Sequence[NormalEquations], fit: JointFit
) -> ParameterEstimate:
    """Turn a least-squares solution into parameters, with errors by the delta method.

    ``phi = |(a, b)|``, ``theta = atan2(b, a)`` of a polar pair, and ``C_parameters = J C J.T`` with
    the derivatives J of the parameters by the coefficients.
    """
    runs = tuple(run.run for run in equations)
    named, jacobian = _parameters(model, runs, fit)
    covariance = jacobian @ fit.covariance @ jacobian.T
    blind = (np.abs(jacobian) > 0.0) @ fit.undetermined
    values = np.where(blind, np.nan, [value for *_, value in named])
    covariance[blind, :] = covariance[:, blind] = 0.0
    covariance[blind, blind] = np.inf
    coefficients = {name: fit.run_coefficients(k) for k, name in enumerate(runs)}
    estimate = ParameterEstimate(
        model=model.name,
        names=tuple(name for name, *_ in named),
        scopes=tuple(scope for _, scope, *_ in named),
        units=tuple(unit for *_, unit, _ in named),
        values=values,
        covariance=covariance,
        covariance_source=fit.covariance_source,
        confidence_factor=np.where(jacobian != 0.0, fit.confidence_factor, 0.0).max(axis=1),
        rms=np.nan,
        rms_by_run={},
        rms_by_channel={},
        condition_number=fit.condition_number,
        undetermined=unseen_in_words(fit, _labels(model, runs, fit)),
        n_samples=0,
        n_revolutions={run.run: run.n_revolutions for run in equations},
        run_coefficients=coefficients,
    )
    return _with_residuals_of(_with_directionless_tilts(estimate), equations)


def _with_residuals_of(
    estimate: ParameterEstimate, equations: Sequence[NormalEquations]
) -> ParameterEstimate:
    """Copy with the RMS of the residuals that the estimate leaves in the given sums."""
    squared = {run.run: run.squared_error(estimate.run_coefficients[run.run]) for run in equations}
    n_samples = {run.run: run.n_samples for run in equations}
    return replace(
        estimate,
        rms=_rms(np.concatenate(list(squared.values())), np.concatenate(list(n_samples.values()))),
        rms_by_run={name: _rms(squared[name], n_samples[name]) for name in squared},
        rms_by_channel={
            run.run: {
                channel: _rms(squared[run.run][:, c], n_samples[run.run][:, c])
                for c, channel in enumerate(run.channels)
            }
            for run in equations
        },
        n_samples=sum(int(count.sum()) for count in n_samples.values()),
    )


def _parameters(
    model: CarrierModel, runs: Sequence[str], fit: JointFit
) -> tuple[list[tuple[str, str, str, float]], NDArray[np.float64]]:
    """Name, scope, unit and value of every parameter, and their derivatives by the unknowns."""
    named: list[tuple[str, str, str, float]] = []
    rows: list[NDArray[np.float64]] = []
    for run_number, scope in [(None, SHARED), *enumerate(runs)]:
        first = 0
        for effect in model.effects:
            last = first + len(effect.parameters)
            if effect.per_run == (run_number is not None):
                where = fit.positions[run_number or 0, first:last]
                values, derivatives = _published(
                    effect, fit.unknowns[where], fit.covariance[np.ix_(where, where)]
                )
                for (name, unit), value, derivative in zip(
                    effect.published, values, derivatives, strict=True
                ):
                    row = np.zeros(fit.unknowns.size)
                    row[where] = derivative
                    named.append((name, scope, unit, float(value)))
                    rows.append(row)
            first = last
    return named, np.array(rows)


def _published(
    effect: Effect, coefficients: NDArray[np.float64], covariance: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Parameters of one effect and their derivatives by its coefficients."""
    if effect.pair:
        return polar_values(coefficients, covariance)
    return coefficients, np.eye(coefficients.size)


def _labels(model: CarrierModel, runs: Sequence[str], fit: JointFit) -> list[str]:
    """Names of the unknowns of a joint fit."""
    labels = [""] * fit.unknowns.size
    for k, run in enumerate(runs):
        for coefficient, (name, shared) in enumerate(
            zip(model.coefficients, model.shared, strict=True)
        ):
            labels[int(fit.positions[k, coefficient])] = name if shared else f"{name} of {run}"
    return labels


def _with_directionless_tilts(estimate: ParameterEstimate) -> ParameterEstimate:
    """Say which tilts are zero within their error: their direction theta means nothing then."""
    sentences = list(estimate.undetermined)
    for k, name in enumerate(estimate.names):
        if (
            name.startswith("phi")
            and estimate.values[k] < estimate.confidence_factor[k] * estimate.std[k]
        ):
            of_run = f" of {estimate.scopes[k]}" if estimate.scopes[k] else ""
            if np.isfinite(estimate.std[k]):
                sentences.append(
                    f"{name.replace('phi', 'theta')}{of_run}: {name} is zero within its error"
                )
    return replace(estimate, undetermined=tuple(sentences))


def _rms(squared: NDArray[np.float64], n_samples: NDArray[np.int64]) -> float:
    """Root of the mean square; NaN for a channel without samples."""
    count = int(n_samples.sum())
    return float(np.sqrt(squared.sum() / count)) if count else float("nan")


def _with_bootstrap(
    fit: JointFit, equations: Sequence[NormalEquations], n_samples: int, rng: np.random.Generator
) -> JointFit:
    """Replace the covariance of a fit by that of refits to resampled revolutions.

    Every sample draws, run by run, blocks of consecutive revolutions with replacement until the run
    is full again (circular: a block may go over the end), of the length ``R^(1/3)`` that keeps a
    correlation of neighbouring turns.

    References
    ----------
    .. [1] D. N. Politis, J. P. Romano, "A circular block-resampling procedure for stationary data"
       (1992).
    """
    lengths = [max(1, round(run.n_revolutions ** (1.0 / 3.0))) for run in equations]
    for run in equations:
        if run.n_revolutions < 3:
            raise ValueError(
                f"run {run.run}: {run.n_revolutions} revolutions; expected at least 3 for a "
                "bootstrap over revolutions"
            )
    basis = _determined_basis(fit)
    solutions = np.array(
        [_resampled(fit, equations, lengths, basis, rng) for _ in range(n_samples)]
    )
    scatter = solutions - solutions.mean(axis=0)
    blocks = min(
        run.n_revolutions // length for run, length in zip(equations, lengths, strict=True)
    )
    # Draws with replacement scatter less than the data by (blocks - 1) / blocks.
    covariance = scatter.T @ scatter / (n_samples - 1) * blocks / (blocks - 1.0)
    return replace(
        fit,
        covariance=basis @ covariance @ basis.T,
        covariance_source=f"block bootstrap over revolutions, {n_samples} samples, "
        f"blocks of {'/'.join(str(length) for length in sorted(set(lengths)))}",
        confidence_factor=np.full(fit.unknowns.size, student_t.ppf(0.975, blocks - 1)),
    )


def _determined_basis(fit: JointFit) -> NDArray[np.float64]:
    """Basis of what the data determine, in the unknowns."""
    unseen = fit.unseen
    projector = np.eye(fit.unknowns.size) - unseen.T @ unseen
    eigenvalues, vectors = np.linalg.eigh(projector)
    return fit.column_scale[:, None] * vectors[:, eigenvalues > 0.5]


def _resampled(
    fit: JointFit,
    equations: Sequence[NormalEquations],
    lengths: Sequence[int],
    basis: NDArray[np.float64],
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Solution of one sample, in the coordinates of `basis`."""
    matrix = np.zeros((basis.shape[1], basis.shape[1]))
    right_side = np.zeros(basis.shape[1])
    for run, where, length in zip(equations, fit.positions, lengths, strict=True):
        T = basis[where]
        counts = circular_block_counts(run.n_revolutions, length, rng)
        matrix += T.T @ np.tensordot(counts, run.matrix.sum(axis=1), axes=1) @ T
        right_side += counts @ run.right_side.sum(axis=1) @ T
    return np.asarray(np.linalg.lstsq(matrix, right_side, rcond=None)[0], dtype=np.float64)


def _with_scatter_of_runs(
    fit: JointFit, equations: Sequence[NormalEquations], shared: Sequence[bool]
) -> JointFit:
    """Widen the errors of shared parameters where the runs disagree on them.

    The scatter of revolutions inside a run knows nothing of a tilt that differs from run to run.
    Each run is fitted by itself, ``p_k`` with covariance ``C_k``, and ``Q = sum_k (p_k - p).T
    C_k^-1 (p_k - p)`` is compared with Hotelling's distribution. Where it is beyond chance the
    covariance of the shared unknowns is that of the delete-one-run jackknife, with one degree of
    freedom less than there are runs.
    """
    n_shared, n_runs = sum(shared), len(equations)
    freedom = min(run.n_revolutions for run in equations) - n_shared
    if (
        n_runs < 2
        or n_shared == 0
        or freedom < 1
        or min(r.n_revolutions for r in equations) < FEWEST_REVOLUTIONS
    ):
        return fit
    alone = [joint_fit([run], shared) for run in equations]
    if fit.undetermined.any() or any(fit_of_run.undetermined.any() for fit_of_run in alone):
        return fit
    ratio = _disagreement(fit, alone, n_shared) * freedom / (freedom + n_shared - 1)
    degrees = n_shared * (n_runs - 1)
    if fisher_f.sf(ratio / degrees, degrees, freedom) >= _DISAGREEMENT:
        return fit
    covariance = fit.covariance.copy()
    covariance[:n_shared, :] = covariance[:, :n_shared] = 0.0
    covariance[:n_shared, :n_shared] = _jackknife_over_runs(
        equations, np.asarray(shared, dtype=bool)
    )
    factor = fit.confidence_factor.copy()
    factor[:n_shared] = student_t.ppf(0.975, n_runs - 1)
    return replace(
        fit, covariance=covariance, covariance_source=SCATTER_OF_RUNS, confidence_factor=factor
    )


def _disagreement(fit: JointFit, alone: Sequence[JointFit], n_shared: int) -> float:
    """Sum over the runs of the squared distance to the joint solution."""
    total = 0.0
    for fit_of_run in alone:
        distance = fit_of_run.unknowns[:n_shared] - fit.unknowns[:n_shared]
        total += float(
            distance @ np.linalg.solve(fit_of_run.covariance[:n_shared, :n_shared], distance)
        )
    return total


def _jackknife_over_runs(
    equations: Sequence[NormalEquations], shared: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Covariance of the shared unknowns from the joint solutions without one run each."""
    reduced = [_without_run_unknowns(run, shared) for run in equations]
    matrix = sum(
        (matrix_of_run for matrix_of_run, _ in reduced), np.zeros((shared.sum(), shared.sum()))
    )
    right_side = sum((right_of_run for _, right_of_run in reduced), np.zeros(shared.sum()))
    solutions = np.array(
        [
            np.linalg.solve(matrix - matrix_of_run, right_side - right_of_run)
            for matrix_of_run, right_of_run in reduced
        ]
    )
    scatter = solutions - solutions.mean(axis=0)
    return (len(equations) - 1) / len(equations) * scatter.T @ scatter


def _without_run_unknowns(
    run: NormalEquations, shared: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Eliminate the run's own unknowns from its normal equations (Schur complement)."""
    matrix, right_side = run.matrix.sum(axis=(0, 1)), run.right_side.sum(axis=(0, 1))
    elimination = np.linalg.solve(matrix[np.ix_(~shared, ~shared)], matrix[np.ix_(~shared, shared)])
    return (
        matrix[np.ix_(shared, shared)] - matrix[np.ix_(shared, ~shared)] @ elimination,
        right_side[shared] - elimination.T @ right_side[~shared],
    )
