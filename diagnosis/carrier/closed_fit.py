"""Quick fit of a set of carrier effects.

Gauss-Newton on the sums of whole runs, thresholds fixed.
"""

from collections.abc import Callable, Sequence

import numpy as np

from carrierflex.diagnosis.carrier.model import CarrierModel, Choice, IntArray
from carrierflex.diagnosis.comparison.problem import Effects, FloatArray, bounds_of
from carrierflex.identification.estimation.gauss_newton import Bounds, CostSums, bounded_step

#: Products of the columns with some numbers, by run of a part and channel.
GramOf = Callable[[IntArray, slice], FloatArray]
#: Steps of the fits that choose a channel or a threshold.
_QUICK_STEPS = 4
#: Share of every column's square on the diagonal: keeps columns that are alike from large values of
#: opposite sign.
_RIDGE = 1e-9


def closed_fit(
    model: CarrierModel,
    gram_of: GramOf,
    effects: Effects,
    choice: Choice,
    start: FloatArray,
    *,
    parts: Sequence[slice],
) -> tuple[FloatArray, float]:
    """Gauss-Newton steps on the sums of whole runs, thresholds fixed; within bounds.

    Parameters
    ----------
    model : CarrierModel
        Weights of the columns and their derivatives.
    gram_of : callable
        Products of some columns by run and channel, shape (n_runs, n_channels, u, u), of the runs
        of a part.
    effects : tuple of str
        Set beside the baseline.
    choice : mapping of str to int
        Channel of every effect of one sensor.
    start : ndarray, shape (p,)
        Values to start from; those of the thresholds stay.
    parts : sequence of slice
        Runs whose products are in memory at once.

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
        sums = sums_of_runs(model, gram_of, effects, choice, theta, parts)
        theta = bounded_step(sums, theta, bounds=bounds, free=free, damping=_RIDGE)
    return theta, sums_of_runs(model, gram_of, effects, choice, theta, parts).cost


def sums_of_runs(
    model: CarrierModel,
    gram_of: GramOf,
    effects: Effects,
    choice: Choice,
    theta: FloatArray,
    parts: Sequence[slice],
) -> CostSums[None]:
    """``J.T J``, ``J.T r`` and ``r.T r`` over all runs and channels.

    The arguments are those of :func:`closed_fit`; `theta`, shape (p,), is where the derivatives are
    taken.
    """
    matrix, right = np.zeros((theta.size, theta.size)), np.zeros(theta.size)
    square = 0.0
    for part in parts:
        table = model.weights(effects, choice, theta, part)
        gram = gram_of(table.columns, part)
        residual = table.residual
        products = table.slopes @ gram
        of_runs = np.einsum("rcpk,rcqk->rpq", products, table.slopes, optimize=True)
        right_of_runs = np.einsum("rcpk,rck->rp", products, residual, optimize=True)
        own = table.unknowns
        np.add.at(matrix, (own[:, :, None], own[:, None, :]), of_runs)
        np.add.at(right, own, right_of_runs)
        square += float(np.einsum("rck,rckl,rcl->", residual, gram, residual, optimize=True))
    return CostSums(square, matrix, right, None)
