"""The measured shape of a class: its curve over the visited range with a band over the blocks."""

from dataclasses import dataclass, replace

import numpy as np

from carrierflex.diagnosis.classes.answer import NearestLaw, ShapeAndLaw
from carrierflex.diagnosis.classes.held_out import ClassScores, HeldOutSquares
from carrierflex.diagnosis.classes.results import MeasuredShape
from carrierflex.diagnosis.classes.shapes import (
    POINTS,
    band_of,
    drawn_coefficients,
    fitted_law,
    shape_words,
    slope_beside_rest,
    straight_part,
    without_steps,
)
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.classes.answer import is_one_curve
from carrierflex.diagnosis.element.classes.columns import stops_columns, stops_of
from carrierflex.diagnosis.element.classes.laws import (
    COUPLED_DAMPING,
    DISSIPATION,
    DRIVE_SIDE,
    FORCE_SURFACE,
    HYSTERESIS,
    MEMORY,
    RESTORING_FORCE,
    TIME_VARIATION,
    static_law,
)
from carrierflex.diagnosis.element.classes.measured.surface_shape import surface_shape
from carrierflex.diagnosis.element.classes.memory_parts import parts_of_branches
from carrierflex.diagnosis.element.classes.table import ElementTable
from carrierflex.diagnosis.element.classes.table_of_loop import LOOP
from carrierflex.simulation.element.memory_laws import NO_PARTS, MemoryParts, law_parts
from carrierflex.simulation.laws import (
    ELEMENT,
    TABULATED,
    WITH_MEMORY,
    Friction,
    Law,
    Part,
    Table,
)

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


#: Turns after which a loop is drawn: smooth ones drift to where they close.
_SETTLING = 12


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
) -> ShapeAndLaw:
    """Curve of one class of an answer, and the law without a name that it makes.

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
    tuple of (MeasuredShape or None, Law or None)
        None for a class without a curve, and for one without a law.
    """
    if name == FORCE_SURFACE:
        shape, measured_law = surface_shape(own.bases, units, scores, held)
        # Off the one curve that the records go round a surface is anything.
        return shape, None if is_one_curve(own) else measured_law
    if name not in _GROUPS:
        return None, None
    curve = _curve(own, name, units)
    has_loop = name == HYSTERESIS and own.loop is not None
    groups = (*_GROUPS[name], LOOP) if has_loop else _GROUPS[name]
    places = np.concatenate([scores.table.groups[group].columns for group in groups])
    draws = drawn_coefficients(scores, held, places)
    values = draws @ curve.rows
    y, others = values[0], values[1:]
    line = _baseline_part(curve.x, y, name)
    others = others - np.array([_baseline_part(curve.x, one, name) for one in others])
    y = y - line
    band = band_of(y, others)
    drawn = _law_curve(own, curve, name, law, y)
    words = shape_words(name, curve.x, y, band, curve.units)
    smooth, steps = y, (0.0, 0.0)
    if name == DISSIPATION:
        smooth, steps = without_steps(curve.x, y, own.bases.size.rest_speed)
    shape = MeasuredShape(
        curve.x,
        y,
        band,
        drawn,
        curve.labels,
        curve.units,
        words,
        smooth,
        steps,
    )
    return shape, _law(own, name, shape, draws[0], units)


def _law(
    own: ElementTable,
    name: str,
    shape: MeasuredShape,
    weights: FloatArray,
    units: tuple[str, str],
) -> Law | None:
    """Law of a curve, without name; None of a class that no file holds."""
    if name in TABULATED:
        parts: list[Part] = [Table(ELEMENT, shape.x, shape.smooth)]
        if any(shape.steps):
            parts.append(Friction(ELEMENT, *shape.steps))
        return Law("", ELEMENT, name, units, tuple(parts))
    if name not in WITH_MEMORY:
        return None
    size = own.bases.size
    rows = _rows_with_memory(own, name, weights)
    return Law("", ELEMENT, name, units, law_parts(rows), {"deflection": (size.low, size.high)})


def _rows_with_memory(own: ElementTable, name: str, weights: FloatArray) -> MemoryParts:
    """Branches of a memory; stops and smooth loop of a hysteresis."""
    if name == MEMORY:
        return parts_of_branches(own.bases.taus, weights)
    if own.loop is None:
        return stops_of(weights, own.bases.size)
    stops = stops_of(weights[:-1], own.bases.size).stops
    return replace(NO_PARTS, stops=stops, loops=own.loop.row(weights[-1])[None])


def _curve(own: ElementTable, name: str, units: tuple[str, str]) -> _Curve:
    """Columns of a class along its abscissa."""
    force, length = units
    bases, size = own.bases, own.bases.size
    x = np.linspace(size.low, size.high, POINTS)
    if name == RESTORING_FORCE:
        return _Curve(x, bases.force(x), ("deflection", "restoring force"), (length, force))
    if name == COUPLED_DAMPING:
        return _Curve(
            x, bases.coupled(x), ("deflection", "damping"), (length, f"{force} s/{length}")
        )
    if name == DISSIPATION:
        curved = np.linspace(bases.speed.low, bases.speed.high, 2 * POINTS)
        v = 0.1 * size.speed * np.sinh(curved)
        sign = np.tanh(v / size.rest_speed)
        rows = np.vstack([bases.speed(curved), np.maximum(sign, 0.0), np.minimum(sign, 0.0)])
        return _Curve(v, rows, ("speed", "dissipative force"), (f"{length}/s", force))
    if name == HYSTERESIS:
        middle = 0.5 * (size.low + size.high)
        angle = np.linspace(0.0, (2.0 * _SETTLING + 0.5) * np.pi, (4 * _SETTLING + 1) * POINTS)
        turns = middle + size.half_range * np.sin(angle)
        rows = stops_columns(turns, size)
        if own.loop is not None:
            rows = np.vstack([rows, own.loop.along(turns)])
        turn = slice(-4 * POINTS, None)
        return _Curve(
            turns[turn], rows[:, turn], ("deflection", "hysteretic force"), (length, force)
        )
    if name == MEMORY:
        t = np.geomspace(bases.taus[0] / 3.0, 3.0 * bases.taus[-1], POINTS)
        rows = np.exp(-t[None] / bases.taus[:, None])
        return _Curve(
            t, rows, ("time after a step", "relaxing stiffness"), ("s", f"{force}/{length}")
        )
    if name == TIME_VARIATION:
        t = np.linspace(bases.time.low, bases.time.high, POINTS)
        splines = bases.time(t) / size.half_range
        rows = np.vstack([splines, np.zeros((2 * len(splines), t.size))])
        return _Curve(t, rows, ("time", "stiffness"), ("s", f"{force}/{length}"))
    u = np.linspace(bases.side.low, bases.side.high, POINTS)
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
        slope = slope_beside_rest(x, y)
        return np.asarray(np.interp(0.0, x, y) + slope * x, dtype=np.float64)
    return np.asarray(np.polyval(straight_part(x, y), x))


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
    fits = [fitted_law(columns, curve.x, y) for columns in shapes]
    return min(fits, key=lambda fit: float(np.sum((fit - y) ** 2)))
