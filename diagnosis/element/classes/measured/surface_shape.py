"""The measured surface f(x, v): its curves over the speed, and the law that is kept of it."""

from dataclasses import dataclass, replace

import numpy as np

from carrierflex.diagnosis.classes.held_out import ClassScores, HeldOutSquares
from carrierflex.diagnosis.classes.results import BesideCurve, MeasuredShape
from carrierflex.diagnosis.classes.shapes import (
    CERTAIN_SIGN,
    band_of,
    drawn_coefficients,
    length_words,
    slope_beside_rest,
    straight_part,
    surface_words,
)
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.classes.columns import (
    ElementBases,
    step_at_rest,
    surface_products,
)
from carrierflex.diagnosis.element.classes.memory_parts import (
    parts_of_stops,
    stops_of_bristles,
)
from carrierflex.simulation.element.memory_laws import law_parts
from carrierflex.simulation.laws import ELEMENT, FORCE_SURFACE, Law, Surface

#: Groups whose columns make the surface, dry friction with a memory last.
GROUPS = ("f", "g", "jump", "h", "surface")
_PRESLIDING = "presliding"
#: Points of the table over deflection, and half of those over speed.
_POINTS = 33
#: Where in the range of the deflection the curves are drawn.
_DRAWN_AT = (0.25, 0.75)


@dataclass(frozen=True, eq=False)
class _Grid:
    """Points of a surface and its columns there, shape (n_columns, n_x * n_v)."""

    x: FloatArray
    v: FloatArray
    columns: FloatArray

    def values(self, weights: FloatArray) -> FloatArray:
        """Force at the points, shape (n_x, n_v)."""
        return np.reshape(weights @ self.columns, (self.x.size, self.v.size))


def surface_shape(
    bases: ElementBases, units: tuple[str, str], scores: ClassScores, held: HeldOutSquares
) -> tuple[MeasuredShape, Law]:
    """Force over the speed at two deflections, and the surface as a law without a name.

    Parameters
    ----------
    bases : ElementBases
        Splines and sizes.
    units : tuple of str
        Units of force and deflection.
    scores : ClassScores
        Held-out squares.
    held : HeldOutSquares
        The answer that the surface is part of.

    Returns
    -------
    tuple of (MeasuredShape, Law)
        Curve at a quarter of the range, beside it that at three quarters; straight parts that the
        baseline takes up are in neither curve nor law.
    """
    force, length = units
    groups = scores.table.groups
    places = np.concatenate([groups[name].columns for name in (*GROUPS, _PRESLIDING)])
    draws = drawn_coefficients(scores, held, places)
    n_slips = groups[_PRESLIDING].columns.size
    smooth, slips = np.split(draws, [draws.shape[1] - n_slips], axis=1)
    grid, size = _grid(bases), bases.size
    law = _law(grid, bases, smooth[0], slips[0], units)
    places_x = [size.low + share * (size.high - size.low) for share in _DRAWN_AT]
    friction = np.sum(np.maximum(slips, 0.0), axis=1)[:, None]
    at_rest = friction * np.tanh(grid.v / size.rest_speed)
    along_v = [_columns(bases, np.full(grid.v.size, x), grid.v) for x in places_x]
    drawn = _without_lines(grid.v, smooth @ np.array(along_v) + at_rest, size.rest_speed)
    curves = []
    for x, values in zip(places_x, drawn, strict=True):
        name = f"at {length_words(x, length)}"
        curves.append(BesideCurve(name, grid.v, values[0], band_of(values[0], values[1:])))
    lower, upper = curves
    shape = MeasuredShape(
        lower.x,
        lower.y,
        lower.band,
        np.empty(0),
        ("speed", "force beyond that at rest"),
        (f"{length}/s", force),
        surface_words(lower, upper, (f"{length}/s", force)),
        lower.y,
        (0.0, 0.0),
        beside=(upper,),
        name=lower.name,
    )
    return shape, law


def _without_lines(v: FloatArray, values: FloatArray, rest_speed: float) -> FloatArray:
    """Curves over the speed, shape (n_curves, n_draws, n), without what the baseline takes up.

    That is the middle of the step at rest of each, and of every draw the mean slope beside rest.
    """
    slopes = np.array([[slope_beside_rest(v, row) for row in curve] for curve in values])
    values = values - slopes.mean(axis=0)[:, None] * v
    ends = _beside_rest(v, rest_speed)
    middles = [[np.interp(ends, v, row).mean() for row in curve] for curve in values]
    return np.asarray(values - np.array(middles)[..., None])


def _beside_rest(v: FloatArray, rest_speed: float) -> FloatArray:
    """Speeds on both sides of rest from which the sign of the speed is certain, shape (2,)."""
    certain = CERTAIN_SIGN * rest_speed
    return np.array([max(-certain, v[0]), min(certain, v[-1])])


def _columns(bases: ElementBases, x: FloatArray, v: FloatArray) -> FloatArray:
    """Columns of the surface's groups at some points, shape (n_columns, n)."""
    return np.concatenate(
        [
            bases.force(x),
            bases.speed(bases.curved_speed(v)),
            step_at_rest(v, bases.size),
            bases.coupled(x) * v,
            surface_products(bases, x, v),
        ]
    )


def _grid(bases: ElementBases) -> _Grid:
    """Points over what the runs visit, those of the speed dense beside rest."""
    size = bases.size
    x = np.linspace(size.low, size.high, _POINTS)
    curved = np.linspace(bases.speed.low, bases.speed.high, 2 * _POINTS)
    v = 0.1 * size.speed * np.sinh(curved)
    at_x, at_v = (own.ravel() for own in np.meshgrid(x, v, indexing="ij"))
    return _Grid(x, v, _columns(bases, at_x, at_v))


def _law(
    grid: _Grid,
    bases: ElementBases,
    weights: FloatArray,
    slips: FloatArray,
    units: tuple[str, str],
) -> Law:
    """Surface without its steps at rest, dry friction beside it.

    Without the plane of x and v too, which the baseline takes up.
    """
    size = bases.size
    edges = _beside_rest(grid.v, size.rest_speed)
    inner = (grid.v > edges[0]) & (grid.v < edges[1])
    rows, levels = [], []
    for values in grid.values(weights):
        # The step is read where the sign of the speed is certain, less what grows with the speed.
        # Half of it is dry friction; the middle of it is a force of the deflection.
        slope = slope_beside_rest(grid.v, values)
        lower, upper = np.interp(edges, grid.v, values - slope * grid.v)
        level = max(0.5 * (upper - lower), 0.0)
        row = values - level * np.sign(grid.v)
        row[inner] = np.interp(grid.v[inner], edges, np.interp(edges, grid.v, row))
        rows.append(row)
        levels.append(level)
    y, middle = np.array(rows), rows[_POINTS // 2]
    slope, constant = straight_part(grid.x, np.array([np.interp(0.0, grid.v, row) for row in y]))
    damping = slope_beside_rest(grid.v, middle)
    y -= slope * grid.x[:, None] + constant + damping * grid.v
    bristles = stops_of_bristles(size.presliding, slips)
    turning = parts_of_stops({"slip": bristles}, 0.0, size.half_range)
    friction = np.column_stack([grid.x, levels])
    parts = law_parts(replace(turning, levels=friction) if any(levels) else turning)
    surface = Surface(ELEMENT, grid.x, grid.v, y)
    return Law("", ELEMENT, FORCE_SURFACE, units, (surface, *parts))
