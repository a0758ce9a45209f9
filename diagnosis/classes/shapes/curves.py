"""Curves of a class: draws over the blocks, what of them the baseline takes up, steps at rest."""

import numpy as np

from carrierflex.diagnosis.classes.fits import coefficients, products_of
from carrierflex.diagnosis.classes.gram_table import IntArray
from carrierflex.diagnosis.classes.held_out import ClassScores, HeldOutSquares
from carrierflex.diagnosis.comparison.problem import FloatArray

#: Points of a curve.
POINTS = 81
#: Quantiles of the draws that are a curve's 95 % band.
BAND = (0.025, 0.975)
_SEED = 3
#: Share of the range over which a curve is called straight, to take the baseline's part out.
_STRAIGHT = 0.25
#: What a quarter far from rest must be straighter by, as a share of the curve's size.
_NEAR_REST = 0.02
#: Speeds over that of rest from which the sign of the speed is certain: tanh is 0.995.
CERTAIN_SIGN = 3.0


def drawn_coefficients(scores: ClassScores, held: HeldOutSquares, places: IntArray) -> FloatArray:
    """Coefficients of some columns in the table's units: of all blocks, then of every draw.

    Parameters
    ----------
    scores : ClassScores
        Table.
    held : HeldOutSquares
        Result whose columns are fitted.
    places : ndarray of int, shape (n,)
        Columns that are wanted, among those of the result.

    Returns
    -------
    ndarray, shape (1 + n_draws, n)
        Coefficients.
    """
    table = scores.table
    model = scores.model(held)
    chosen = np.array([int(np.flatnonzero(model.columns == place)[0]) for place in places])
    rng = np.random.default_rng(_SEED)
    n = len(table.gram)
    counts = rng.multinomial(n, np.full(n, 1.0 / n), size=scores.constants.band_samples)
    by_block = products_of(table.gram, model)
    found = [
        coefficients(np.tensordot(weights, by_block, axes=1), model)[chosen]
        for weights in (np.ones(n), *counts)
    ]
    # Column k of the table is the raw column times scale[k], the target times scale[0].
    return np.array(found) * table.scale[places] / table.scale[0]


def band_of(y: FloatArray, draws: FloatArray) -> FloatArray:
    """95 % band of a curve over its draws, the curve itself within it; shape (n, 2)."""
    low, high = np.quantile(draws, BAND, axis=0)
    return np.array([np.minimum(low, y), np.maximum(high, y)]).T


def straight_part(x: FloatArray, y: FloatArray) -> FloatArray:
    """Line (slope, value at zero) along the straightest quarter of a curve, the nearest to rest."""
    even = np.linspace(x[0], x[-1], POINTS)
    values = np.interp(even, x, y)
    width = max(int(_STRAIGHT * POINTS), 8)
    size = float(np.ptp(values)) or 1.0
    rest = float(np.clip(0.0, even[0], even[-1]))
    best = (np.inf, np.zeros(2))
    for first in range(0, POINTS - width + 1, 4):
        part = slice(first, first + width)
        line = np.polyfit(even[part], values[part], 1)
        bend = float(np.abs(np.polyval(line, even[part]) - values[part]).max()) / size
        away = abs(float(even[part].mean()) - rest) / float(even[-1] - even[0])
        cost = bend + _NEAR_REST * away
        if cost < best[0]:
            best = (cost, line)
    return np.asarray(best[1])


def slope_beside_rest(x: FloatArray, y: FloatArray) -> float:
    """Slope of a curve over the speed: friction is a step between two straight sides."""
    sides = [side for side in (x > 0.0, x < 0.0) if np.count_nonzero(side) > 8]
    return float(np.mean([straight_part(x[side], y[side])[0] for side in sides]))


def without_steps(
    v: FloatArray, y: FloatArray, rest_speed: float
) -> tuple[FloatArray, tuple[float, float]]:
    """Curve over the speed without its steps at rest, and their heights.

    A step is what the curve has risen by where the sign of the speed is certain; columns of the
    splines and of the steps share it between them in any way. Friction never drives.

    Parameters
    ----------
    v, y : ndarray, shape (n,)
        Speed and curve.
    rest_speed : float
        Speed below which its sign is uncertain.

    Returns
    -------
    tuple of (ndarray, tuple of float)
        Curve, shape (n,), and steps at positive and at negative speed, >= 0.
    """
    certain = CERTAIN_SIGN * rest_speed
    edges = np.array([min(certain, v[-1]), max(-certain, v[0])])
    first, second = np.interp(edges, v, y)
    steps = (max(float(first), 0.0), max(-float(second), 0.0))
    rest = np.where(v > 0.0, y - steps[0], y + steps[1])
    inner = (v > edges[1]) & (v < edges[0])
    rest[inner] = np.interp(v[inner], edges[::-1], [second + steps[1], first - steps[0]])
    return rest, steps


def fitted_law(columns: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    """Law fitted to a curve beside a straight line, shape (n,).

    Parameters
    ----------
    columns : ndarray, shape (n_columns, n)
        Law for unit amplitudes.
    x, y : ndarray, shape (n,)
        Curve.
    """
    design = np.vstack([columns, x, np.ones(x.size)]).T
    size = np.maximum(np.abs(design).max(axis=0), 1e-300)
    c = np.linalg.lstsq(design / size, y, rcond=None)[0]
    return np.asarray(design / size @ c)
