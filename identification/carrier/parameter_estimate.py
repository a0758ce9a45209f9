"""The identified parameters with their uncertainty, as one frozen result."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.carrier.models import CarrierModel, Effect
from carrierflex.identification.estimation.least_squares import JointFit, unseen_in_words
from carrierflex.identification.estimation.normal_equations import NormalEquations

#: Scope of a parameter with one value for all runs.
SHARED = ""
#: A tilt of exactly zero has no direction; this size [rad], far below anything measurable, makes
#: its error huge.
SMALLEST_TILT = 1e-12


@dataclass(frozen=True, eq=False)
class ParameterEstimate:
    """Parameters of one model, identified from one run or jointly from several.

    Parameters
    ----------
    model : str
        Name of the model.
    names, scopes, units : tuple of str, length m
        Symbol of each parameter, the run it belongs to ("" where all runs share it), and its unit.
    values : ndarray, shape (m,)
        Values; NaN where the data cannot see the parameter.
    covariance : ndarray, shape (m, m)
        Covariance; infinite variance where the data cannot see the parameter.
    covariance_source : str
        How the covariance was estimated: jackknife over revolutions, classical with few
        revolutions, or jackknife over runs where they disagree on what they share.
    confidence_factor : ndarray, shape (m,)
        Half width of every 95 % interval in standard deviations.
    rms : float
        RMS of the residual over all samples [m].
    rms_by_run : mapping of str to float
        RMS by run [m].
    rms_by_channel : mapping of str to mapping of str to float
        RMS by run and channel [m].
    condition_number : float
        Of the scaled design.
    undetermined : tuple of str
        What the data cannot see, in words.
    n_samples : int
        Samples used.
    n_revolutions : mapping of str to int
        Whole revolutions used, by run.
    run_coefficients : mapping of str to ndarray, shape (p,)
        Linear coefficients of the model by run: ``signal = model.design(...) @ coefficients``.
    """

    model: str
    names: tuple[str, ...]
    scopes: tuple[str, ...]
    units: tuple[str, ...]
    values: NDArray[np.float64]
    covariance: NDArray[np.float64]
    covariance_source: str
    confidence_factor: NDArray[np.float64]
    rms: float
    rms_by_run: Mapping[str, float]
    rms_by_channel: Mapping[str, Mapping[str, float]]
    condition_number: float
    undetermined: tuple[str, ...]
    n_samples: int
    n_revolutions: Mapping[str, int]
    run_coefficients: Mapping[str, NDArray[np.float64]]

    @property
    def std(self) -> NDArray[np.float64]:
        """Standard deviation of every parameter, shape (m,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def ci95(self) -> NDArray[np.float64]:
        """Ends of every 95 % interval, shape (m, 2)."""
        half = self.confidence_factor * self.std
        return np.column_stack([self.values - half, self.values + half])

    @property
    def correlation(self) -> NDArray[np.float64]:
        """Correlation of the parameters, shape (m, m); NaN beside what the data cannot see."""
        with np.errstate(invalid="ignore"):
            return self.covariance / np.outer(self.std, self.std)

    def index(self, name: str, run: str) -> int:
        """Place of a run's parameter: its own, or the one that all runs share.

        Raises
        ------
        ValueError
            Where the model has no such parameter.
        """
        for k, (own_name, scope) in enumerate(zip(self.names, self.scopes, strict=True)):
            if own_name == name and scope in (run, SHARED):
                return k
        raise ValueError(
            f"model {self.model} has no parameter '{name}' of run '{run}'; it has {', '.join(self.names)}"
        )


def parameter_estimate(
    model: CarrierModel, equations: Sequence[NormalEquations], fit: JointFit
) -> ParameterEstimate:
    """Turn a least-squares solution into parameters, with errors by the delta method.

    ``phi = |(a, b)|``, ``theta = atan2(b, a)`` of a polar pair, and ``C_parameters = J C J.T`` with
    the derivatives J of the parameters by the coefficients.

    Parameters
    ----------
    model : CarrierModel
        Fitted model.
    equations : sequence of NormalEquations
        Sums of every run.
    fit : JointFit
        Their solution.

    Returns
    -------
    ParameterEstimate
        Shared parameters first, then run by run.
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
    return with_residuals_of(_with_directionless_tilts(estimate), equations)


def with_residuals_of(
    estimate: ParameterEstimate, equations: Sequence[NormalEquations]
) -> ParameterEstimate:
    """Copy with the RMS of the residuals that the estimate leaves in the given sums.

    Parameters
    ----------
    estimate : ParameterEstimate
        Estimate with the coefficients of every run.
    equations : sequence of NormalEquations
        Unweighted sums of every run.

    Returns
    -------
    ParameterEstimate
        Copy with ``rms``, ``rms_by_run``, ``rms_by_channel`` and ``n_samples`` of these sums.
    """
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
    for own_run, scope in [(None, SHARED), *enumerate(runs)]:
        first = 0
        for effect in model.effects:
            last = first + len(effect.patterns)
            if effect.shared == (own_run is None):
                where = fit.positions[own_run or 0, first:last]
                values, derivatives = _published(effect, fit.unknowns[where])
                for name, unit, value, derivative in zip(
                    effect.parameters, effect.units, values, derivatives, strict=True
                ):
                    row = np.zeros(fit.unknowns.size)
                    row[where] = derivative
                    named.append((name, scope, unit, float(value)))
                    rows.append(row)
            first = last
    return named, np.array(rows)


def _published(
    effect: Effect, coefficients: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Parameters of one effect and their derivatives by its coefficients."""
    if not effect.polar:
        return coefficients, np.eye(coefficients.size)
    a, b = coefficients
    if np.hypot(a, b) < SMALLEST_TILT:
        a, b = SMALLEST_TILT, 0.0
    size = float(np.hypot(a, b))
    derivatives = np.array([[a / size, b / size], [-b / size**2, a / size**2]])
    return np.array([size, np.arctan2(b, a)]), derivatives


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
