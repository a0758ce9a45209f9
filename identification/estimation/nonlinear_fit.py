"""Bounded nonlinear least squares for models that are simulated, with counted model runs.

The search is the trust-region reflective one of scipy, which steps away from bounds; one that uses
up its iterations beside several bounds is ended by dog-leg steps along them. The sums-based one of
:mod:`carrierflex.identification.estimation.gauss_newton` takes half the model runs on the 520 s
record of the mounting, but stops 3e-4 above it with linear bushings and does not leave the
nonlinear bushings' solution, on whose bounds the hydro-dynamic fit starts.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from carrierflex.identification.estimation.single_thread import single_threaded
from carrierflex.simulation.fit_parameter import FitParameter

Array = NDArray[np.float64]
#: Residuals of all runs one after the other, in standard deviations; a plain object, so that
#: processes can share it.
Residuals = Callable[[Array], Array]

#: Step of the difference quotients, as a share of a parameter's scale: truncation and rounding
#: balance for residuals that are smooth to 1e-9.
_STEP = 1e-4
#: Relative change of cost and parameters at which the search ends.
_TOLERANCE = 1e-8
#: Iterations of each search at most.
_MOST_ITERATIONS = 30
#: How scipy says that a search used them up.
_OUT_OF_ITERATIONS = 0
#: A parameter this close to a bound, as a share of the distance of its bounds or of its scale, sits
#: on it.
_AT_BOUND = 1e-6


@dataclass(frozen=True, eq=False)
class NonlinearFit:
    """Least-squares solution.

    Parameters
    ----------
    free : tuple of FitParameter
        Unknowns.
    values : ndarray, shape (p,)
        Solution, SI units.
    cost : float
        Sum of the squared residuals.
    residuals : ndarray, shape (n,)
        Residuals at the solution.
    jacobian : ndarray, shape (n, p)
        Their derivatives by the parameters, each in its scale.
    at_bound : tuple of str
        Parameters that ended on a bound.
    model_runs : int
        Calls of the residual function, all starts together.
    """

    free: tuple[FitParameter, ...]
    values: Array
    cost: float
    residuals: Array
    jacobian: Array
    at_bound: tuple[str, ...]
    model_runs: int

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the unknowns."""
        return tuple(parameter.name for parameter in self.free)

    @property
    def scale(self) -> Array:
        """Scales of the unknowns, shape (p,)."""
        return np.array([parameter.scale for parameter in self.free])

    def by_name(self) -> dict[str, float]:
        """Values by name."""
        return dict(zip(self.names, self.values.tolist(), strict=True))


def bounded_fit(
    residuals: Residuals,
    free: Sequence[FitParameter],
    start: Array,
    *,
    tolerance: float = _TOLERANCE,
) -> NonlinearFit:
    """Minimise the sum of squared residuals from one start, within bounds.

    Trust-region reflective Gauss-Newton steps on one-sided difference quotients: with p unknowns an
    iteration costs p + 1 model runs. The derivatives that the errors rest on are central ones.

    Parameters
    ----------
    residuals : callable
        ``residuals(values, shape (p,)) -> ndarray, shape (n,)``.
    free : sequence of FitParameter
        Unknowns.
    start : ndarray, shape (p,)
        Where to begin; moved inside its bounds.
    tolerance : float
        Relative change of cost and parameters at which the search ends.

    Returns
    -------
    NonlinearFit
        Solution.

    Raises
    ------
    ValueError
        Where the residuals at the start are not finite.
    """
    # Matrices of a dozen rows: threads of the linear algebra would cost ten times what they
    # compute.
    with single_threaded():
        return _bounded_fit(residuals, free, start, tolerance)


def _bounded_fit(
    residuals: Residuals, free: Sequence[FitParameter], start: Array, tolerance: float
) -> NonlinearFit:
    counted = _Counted(residuals)
    scale = np.array([parameter.scale for parameter in free])
    lower = np.array([parameter.lower for parameter in free])
    upper = np.array([parameter.upper for parameter in free])
    inside = np.clip(start, lower, upper)
    if not np.isfinite(counted(inside)).all():
        raise ValueError(
            "the model gives no finite signal at the start "
            f"{dict(zip(_names(free), inside, strict=True))}"
        )

    def derivatives(z: Array) -> Array:
        """Jacobian in scaled unknowns, by quotients that stay within the bounds."""
        return _one_sided_quotients(counted, z * scale, scale, upper)

    # The search itself wants to begin inside; a start on the bound stays reachable as the better of
    # both ends.
    margin = 1e-3 * np.minimum(upper - lower, scale)
    start_inside = np.clip(inside, lower + margin, upper - margin) / scale
    # Close to several bounds the steps of the first search become too short to arrive.
    for method in ("trf", "dogbox"):
        search = least_squares(
            lambda z: counted(z * scale),
            start_inside,
            jac=derivatives,
            bounds=(lower / scale, upper / scale),
            method=method,
            xtol=tolerance,
            ftol=tolerance,
            gtol=None,
            max_nfev=_MOST_ITERATIONS,
            x_scale="jac",
        )
        if search.status != _OUT_OF_ITERATIONS:
            break
        start_inside = search.x
    values = _on_bounds(search.x * scale, lower, upper, scale)
    fit = _at(counted, free, values)
    given = float(np.square(counted(inside)).sum())
    if given < fit.cost:
        fit = _at(counted, free, inside)
    return replace(fit, model_runs=counted.calls)


def _difference_quotients(
    residuals: Residuals, values: Array, scale: Array, lower: Array, upper: Array
) -> Array:
    """Derivatives of the residuals by the scaled parameters, shape (n, p); one-sided at a bound."""
    columns = []
    for k in range(values.size):
        step = _STEP * max(scale[k], abs(values[k]))
        ahead, behind = values.copy(), values.copy()
        ahead[k] = min(values[k] + step, upper[k])
        behind[k] = max(values[k] - step, lower[k])
        columns.append((residuals(ahead) - residuals(behind)) / ((ahead[k] - behind[k]) / scale[k]))
    return np.column_stack(columns)


def _one_sided_quotients(residuals: Residuals, values: Array, scale: Array, upper: Array) -> Array:
    """Derivatives of the residuals by the scaled parameters, shape (n, p), of first order.

    Half the model runs.
    """
    here = residuals(values)
    columns = []
    for k in range(values.size):
        step = _STEP * max(scale[k], abs(values[k]))
        moved = values.copy()
        moved[k] += step if values[k] + step <= upper[k] else -step
        columns.append((residuals(moved) - here) / ((moved[k] - values[k]) / scale[k]))
    return np.column_stack(columns)


class _Counted:
    """Residual function that counts its calls and remembers the last point asked for."""

    def __init__(self, residuals: Residuals) -> None:
        self._residuals = residuals
        self._last: tuple[Array, Array] | None = None
        self.calls = 0

    def __call__(self, values: Array) -> Array:
        if self._last is None or not np.array_equal(self._last[0], values):
            self.calls += 1
            self._last = values.copy(), self._residuals(values)
        return self._last[1]


def _at(counted: _Counted, free: Sequence[FitParameter], values: Array) -> NonlinearFit:
    lower = np.array([parameter.lower for parameter in free])
    upper = np.array([parameter.upper for parameter in free])
    scale = np.array([parameter.scale for parameter in free])
    residual = counted(values)
    jacobian = _difference_quotients(counted, values, scale, lower, upper)
    bound = (values <= lower) | (values >= upper)
    names = tuple(name for name, hit in zip(_names(free), bound, strict=True) if hit)
    return NonlinearFit(
        tuple(free), values, float(residual @ residual), residual, jacobian, names, counted.calls
    )


def _on_bounds(values: Array, lower: Array, upper: Array, scale: Array) -> Array:
    """Put a value that is at its bound to rounding exactly on it."""
    margin = _AT_BOUND * np.minimum(upper - lower, scale)
    return np.where(
        values - lower < margin, lower, np.where(upper - values < margin, upper, values)
    )


def _names(free: Sequence[FitParameter]) -> tuple[str, ...]:
    return tuple(parameter.name for parameter in free)
