"""Quick fit of a set of carrier effects.

Gauss-Newton on the sums of whole runs, thresholds fixed.
"""

import numpy as np

from carrierflex.diagnosis.carrier.model import CarrierModel, Choice
from carrierflex.diagnosis.carrier.sums import used_columns
from carrierflex.diagnosis.comparison.problem import Effects, FloatArray, bounds_of
from carrierflex.identification.estimation.gauss_newton import Bounds, CostSums, bounded_step

#: Steps of the fits that choose a channel or a threshold.
_QUICK_STEPS = 4
#: Share of every column's square on the diagonal: keeps columns that are alike from large values of
#: opposite sign.
_RIDGE = 1e-9


def closed_fit(
    model: CarrierModel, run_gram: FloatArray, effects: Effects, choice: Choice, start: FloatArray
) -> tuple[FloatArray, float]:
    """Gauss-Newton steps on the sums of whole runs, thresholds fixed; within bounds.

    Parameters
    ----------
    model : CarrierModel
        Weights of the columns and their derivatives.
    run_gram : ndarray, shape (n_runs, n_channels, n, n)
        Products of all columns by run and channel.
    effects : tuple of str
        Set beside the baseline.
    choice : mapping of str to int
        Channel of every effect of one sensor.
    start : ndarray, shape (p,)
        Values to start from; those of the thresholds stay.

    Returns
    -------
    tuple of (ndarray, float)
        Parameters, and the sum of squares that they leave.
    """
    theta = start.copy()
    parameters = model.parameters(effects, choice)
    bounds = Bounds(*bounds_of(parameters))
    free = np.array([not parameter.shape for parameter in parameters], dtype=bool)
    bilinear = any(
        model.effects[name].measurement is not None for name in (*model.contained, *effects)
    )
    for _ in range(_QUICK_STEPS if bilinear else 1):
        sums = _sums_of_runs(model, run_gram, effects, choice, theta)
        theta = bounded_step(sums, theta, bounds=bounds, free=free, damping=_RIDGE)
    return theta, _sums_of_runs(model, run_gram, effects, choice, theta).cost


def _sums_of_runs(
    model: CarrierModel, run_gram: FloatArray, effects: Effects, choice: Choice, theta: FloatArray
) -> CostSums[None]:
    """``J.T J``, ``J.T r`` and ``r.T r`` over all runs and channels."""
    W, D = model.weights(effects, choice, theta)
    columns = used_columns(W, D)
    slopes = D[..., columns]
    residual = -W[..., columns]
    residual[..., 0] += 1.0
    gram = run_gram[..., columns[:, None], columns]
    products = slopes @ gram
    matrix = np.einsum("rcpk,rcqk->pq", products, slopes, optimize=True)
    right = np.einsum("rcpk,rck->p", products, residual, optimize=True)
    square = np.einsum("rck,rckl,rcl->", residual, gram, residual, optimize=True)
    return CostSums(float(square), matrix, right, None)
