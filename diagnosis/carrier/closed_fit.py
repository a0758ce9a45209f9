"""Quick fit of a set of carrier effects.

Gauss-Newton on the sums of whole runs, thresholds fixed.
"""

import numpy as np

from carrierflex.diagnosis.carrier.model import CarrierModel, Choice
from carrierflex.diagnosis.carrier.sums import used_columns
from carrierflex.diagnosis.comparison.problem import Effects, FloatArray, bounds_of

#: Steps of the fits that choose a channel or a threshold.
_QUICK_STEPS = 4


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
    free = np.array([not parameter.shape for parameter in parameters], dtype=bool)
    bilinear = any(
        model.effects[name].measurement is not None for name in (*model.contained, *effects)
    )
    for _ in range(_QUICK_STEPS if bilinear else 1):
        matrix, right, _ = _sums_of_runs(model, run_gram, effects, choice, theta)
        sensitive = free & (np.diag(matrix) > 0.0)
        size = np.sqrt(np.diag(matrix)[sensitive])
        scaled = matrix[np.ix_(sensitive, sensitive)] / np.outer(size, size) + 1e-9 * np.eye(
            size.size
        )
        theta[sensitive] += np.linalg.lstsq(scaled, right[sensitive] / size, rcond=1e-12)[0] / size
        theta = np.clip(theta, *bounds_of(parameters))
    return theta, _sums_of_runs(model, run_gram, effects, choice, theta)[2]


def _sums_of_runs(
    model: CarrierModel, run_gram: FloatArray, effects: Effects, choice: Choice, theta: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
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
    return matrix, right, float(square)
