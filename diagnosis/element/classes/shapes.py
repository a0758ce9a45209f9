"""The measured shape of a class: its curve over the visited range with a band over the blocks."""

from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.classes.fits import coefficients
from carrierflex.diagnosis.classes.gram_table import IntArray
from carrierflex.diagnosis.classes.held_out import ClassScores, HeldOutSquares
from carrierflex.diagnosis.classes.laws import NearestLaw
from carrierflex.diagnosis.classes.results import MeasuredShape
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.classes.columns import ElementBases, stops_columns
from carrierflex.diagnosis.element.classes.laws import (
    COUPLED_DAMPING,
    DISSIPATION,
    DRIVE_SIDE,
    HYSTERESIS,
    MEMORY,
    RESTORING_FORCE,
    TIME_VARIATION,
    static_law,
)
from carrierflex.diagnosis.element.classes.shape_words import shape_words
from carrierflex.diagnosis.element.classes.table import ElementTable

#: Points of a curve.
_POINTS = 81
_SEED = 3
_BAND = (0.025, 0.975)
#: Share of the range over which a curve is called straight, to take the baseline's part out.
_STRAIGHT = 0.25
#: What a quarter far from rest must be straighter by, as a share of the curve's size.
_NEAR_REST = 0.02
#: Speeds over that of rest from which the sign of the speed is certain: tanh is 0.995.
_CERTAIN_SIGN = 3.0
#: Groups whose columns make the curve of a class.
_GROUPS: dict[str, tuple[str, ...]] = {
    RESTORING_FORCE: ("f",),
    DISSIPATION: ("g", "jump"),
    COUPLED_DAMPING: ("h",),
    HYSTERESIS: ("stops",),
    MEMORY: ("prony",),
    TIME_VARIATION: ("time",),
    DRIVE_SIDE: ("side",),
}


@dataclass(frozen=True, eq=False)
class _Curve:
    """Rows of a curve: abscissa, values of each column along it, names of both axes."""

    x: FloatArray
    rows: FloatArray
    labels: tuple[str, str]
    units: tuple[str, str]


def measured_shape(
    own: ElementTable,
    units: tuple[str, str],
    scores: ClassScores,
    name: str,
    held: HeldOutSquares,
    law: NearestLaw,
) -> MeasuredShape | None:
    """Curve of one class of an answer.

    Parameters
    ----------
    own : ElementTable
        Table and its bases.
    units : tuple of str
        Units of force and deflection.
    scores : ClassScores
        Held-out squares.
    name : str
        Class.
    held : HeldOutSquares
        The answer it is part of.
    law : NearestLaw
        Law to be drawn over the curve.

    Returns
    -------
    MeasuredShape or None
        None for a class without a curve.
    """
    if name not in _GROUPS:
        return None
    curve = _curve(own.bases, name, units)
    places = np.concatenate([scores.table.groups[group].columns for group in _GROUPS[name]])
    draws = _draws(scores, held, places)
    values = draws @ curve.rows
    y, others = values[0], values[1:]
    line = _baseline_part(curve.x, y, name)
    others = others - np.array([_baseline_part(curve.x, one, name) for one in others])
    y = y - line
    low, high = np.quantile(others, _BAND, axis=0)
    band = np.array([np.minimum(low, y), np.maximum(high, y)]).T
    drawn = _law_curve(own, curve, name, law, y)
    words = shape_words(name, curve.x, y, band, curve.units)
    smooth, steps = (y, (0.0, 0.0)) if name != DISSIPATION else _without_steps(own, curve.x, y)
    return MeasuredShape(curve.x, y, band, drawn, curve.labels, curve.units, words, smooth, steps)


def _without_steps(
    own: ElementTable, v: FloatArray, y: FloatArray
) -> tuple[FloatArray, tuple[float, float]]:
    """Curve over the speed without its steps at rest, and their heights.

    A step is what the curve has risen by where the sign of the speed is certain; columns of the
    splines and of the steps share it between them in any way. Friction never drives.
    """
    certain = _CERTAIN_SIGN * own.bases.size.rest_speed
    edges = np.array([min(certain, v[-1]), max(-certain, v[0])])
    first, second = np.interp(edges, v, y)
    steps = (max(float(first), 0.0), max(-float(second), 0.0))
    rest = np.where(v > 0.0, y - steps[0], y + steps[1])
    inner = (v > edges[1]) & (v < edges[0])
    rest[inner] = np.interp(v[inner], edges[::-1], [second + steps[1], first - steps[0]])
    return rest, steps


def _draws(scores: ClassScores, held: HeldOutSquares, places: IntArray) -> FloatArray:
    """Coefficients of some columns in the table's units: of all blocks, then of every draw."""
    table = scores.table
    model = scores.model(held)
    chosen = np.array([int(np.flatnonzero(model.columns == place)[0]) for place in places])
    rng = np.random.default_rng(_SEED)
    n = len(table.gram)
    counts = rng.multinomial(n, np.full(n, 1.0 / n), size=scores.constants.band_samples)
    used = np.concatenate([[0], model.columns])
    small = table.gram[:, used[:, None], used[None]]
    found = []
    for weights in (np.ones(n), *counts):
        gram = np.zeros(table.total.shape)
        gram[np.ix_(used, used)] = np.tensordot(weights, small, axes=1)
        found.append(coefficients(gram, model)[chosen])
    # Column k of the table is the raw column times scale[k], the target times scale[0].
    return np.array(found) * table.scale[places] / table.scale[0]


def _curve(bases: ElementBases, name: str, units: tuple[str, str]) -> _Curve:
    """Columns of a class along its abscissa."""
    force, length = units
    size = bases.size
    x = np.linspace(size.low, size.high, _POINTS)
    if name == RESTORING_FORCE:
        return _Curve(x, bases.force(x), ("deflection", "restoring force"), (length, force))
    if name == COUPLED_DAMPING:
        return _Curve(
            x, bases.coupled(x), ("deflection", "damping"), (length, f"{force} s/{length}")
        )
    if name == DISSIPATION:
        curved = np.linspace(bases.speed.low, bases.speed.high, 2 * _POINTS)
        v = 0.1 * size.speed * np.sinh(curved)
        sign = np.tanh(v / size.rest_speed)
        rows = np.vstack([bases.speed(curved), np.maximum(sign, 0.0), np.minimum(sign, 0.0)])
        return _Curve(v, rows, ("speed", "dissipative force"), (f"{length}/s", force))
    if name == HYSTERESIS:
        middle = 0.5 * (size.low + size.high)
        turns = middle + size.half_range * np.sin(np.linspace(0.0, 4.5 * np.pi, 9 * _POINTS))
        rows = stops_columns(turns, size)[:, 5 * _POINTS :]
        return _Curve(
            turns[5 * _POINTS :], rows, ("deflection", "hysteretic force"), (length, force)
        )
    if name == MEMORY:
        t = np.geomspace(bases.taus[0] / 3.0, 3.0 * bases.taus[-1], _POINTS)
        rows = np.exp(-t[None] / bases.taus[:, None])
        return _Curve(
            t, rows, ("time after a step", "relaxing stiffness"), ("s", f"{force}/{length}")
        )
    if name == TIME_VARIATION:
        t = np.linspace(bases.time.low, bases.time.high, _POINTS)
        splines = bases.time(t) / size.half_range
        rows = np.vstack([splines, np.zeros((2 * len(splines), t.size))])
        return _Curve(t, rows, ("time", "stiffness"), ("s", f"{force}/{length}"))
    u = np.linspace(bases.side.low, bases.side.high, _POINTS)
    return _Curve(u, bases.side(u), ("drive", "force"), (force, force))


def _baseline_part(x: FloatArray, y: FloatArray, name: str) -> FloatArray:
    """Straight line that the baseline can take up, shape (n,).

    Of f(x) and g(v) that through the straightest quarter of the range nearest to rest; of h(x) and
    of a change with time the mean.
    """
    if name in (COUPLED_DAMPING, TIME_VARIATION):
        return np.full(x.size, y.mean())
    if name not in (RESTORING_FORCE, DISSIPATION, DRIVE_SIDE):
        return np.zeros(x.size)
    if name == DISSIPATION:
        # Friction is a step between two straight sides: their common slope is the baseline's.
        sides = [side for side in (x > 0.0, x < 0.0) if np.count_nonzero(side) > 8]
        slope = float(np.mean([_straightest(x[side], y[side])[0] for side in sides]))
        return np.asarray(np.interp(0.0, x, y) + slope * x, dtype=np.float64)
    return np.asarray(np.polyval(_straightest(x, y), x))


def _straightest(x: FloatArray, y: FloatArray) -> FloatArray:
    """Line (slope, value at zero) along the straightest quarter of a curve, the nearest to rest."""
    even = np.linspace(x[0], x[-1], _POINTS)
    values = np.interp(even, x, y)
    width = max(int(_STRAIGHT * _POINTS), 8)
    size = float(np.ptp(values)) or 1.0
    rest = float(np.clip(0.0, even[0], even[-1]))
    best = (np.inf, np.zeros(2))
    for first in range(0, _POINTS - width + 1, 4):
        part = slice(first, first + width)
        line = np.polyfit(even[part], values[part], 1)
        bend = float(np.abs(np.polyval(line, even[part]) - values[part]).max()) / size
        away = abs(float(even[part].mean()) - rest) / float(even[-1] - even[0])
        cost = bend + _NEAR_REST * away
        if cost < best[0]:
            best = (cost, line)
    return np.asarray(best[1])


def _law_curve(
    own: ElementTable, curve: _Curve, name: str, law: NearestLaw, y: FloatArray
) -> FloatArray:
    """Law of the class fitted to its curve with a straight line; empty where none can be drawn."""
    if not law.id or name not in (RESTORING_FORCE, DISSIPATION, COUPLED_DAMPING):
        return np.empty(0)
    still = np.zeros(curve.x.size)
    is_speed = name == DISSIPATION
    q, v = (still, curve.x) if is_speed else (curve.x, still + 1.0)
    shapes = static_law(law.id, q, v, own.bases.size)
    if shapes is None:
        return np.empty(0)
    fits = [_fitted(columns, curve.x, y) for columns in shapes]
    return min(fits, key=lambda fit: float(np.sum((fit - y) ** 2)))


def _fitted(columns: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    design = np.vstack([columns, x, np.ones(x.size)]).T
    size = np.maximum(np.abs(design).max(axis=0), 1e-300)
    c = np.linalg.lstsq(design / size, y, rcond=None)[0]
    return np.asarray(design / size @ c)
