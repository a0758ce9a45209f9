"""The measured shape of a class: its curve with a band over the blocks, and its law."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np
from scipy.stats import gamma

from carrierflex.diagnosis.classes.answer import NearestLaw, ShapeAndLaw
from carrierflex.diagnosis.classes.columns import TIME_VARIATION, curved_speed, step_at_rest
from carrierflex.diagnosis.classes.gram_table import IntArray
from carrierflex.diagnosis.classes.held_out import HeldOutSquares
from carrierflex.diagnosis.classes.results import (
    BesideCurve,
    ClassAnswer,
    ClassFinding,
    MeasuredShape,
)
from carrierflex.diagnosis.classes.shapes import (
    CERTAIN_SIGN,
    POINTS,
    SIZE,
    axes_of,
    band_of,
    drawn_coefficients,
    fitted_law,
    half_step,
    in_unit,
    law_of_class,
    loop_spring,
    shape_words,
    slope_beside_rest,
    straight_part,
    surface_words,
    visited_range_warning,
    without_steps,
)
from carrierflex.diagnosis.comparison.effect_cards import EffectCard
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.columns import (
    DELAY,
    DRIVE_SIDE,
    ElementBases,
    MotionSize,
    memory_of_stops,
    static_law,
    stops_columns,
    stops_of,
    surface_products,
)
from carrierflex.diagnosis.element.records import ElementRecord
from carrierflex.diagnosis.element.table import CLASS_GROUPS, LOOP, ElementTable, is_one_curve
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning
from carrierflex.simulation.element.effects import ELEMENT_EFFECTS
from carrierflex.simulation.element.law_forces import law_of_effect
from carrierflex.simulation.element.memory_laws import NO_PARTS, STIFFNESS, law_terms
from carrierflex.simulation.laws import (
    COUPLED_DAMPING,
    DISSIPATION,
    ELEMENT,
    FORCE_SURFACE,
    HYSTERESIS,
    MEMORY,
    RESTORING_FORCE,
    TABULATED,
    WITH_MEMORY,
    Friction,
    Law,
    LawTerm,
    Surface,
    Table,
)

#: Group of the bristles that turn as dry friction begins to slip.
_PRESLIDING = "presliding"
#: Turns after which a loop is drawn: smooth ones drift to where they close.
_SETTLING = 12
#: Points of the table over deflection, and half of those over speed.
_POINTS = 33
#: Where in the range of the deflection the curves are drawn.
_DRAWN_AT = (0.25, 0.75)
#: Stops in place of one bristle: its curve to 2.4 % of the friction.
_STOPS_OF_BRISTLE = 8
#: Classes that a law file holds, and what their law is.
_EQUATIONS = {
    RESTORING_FORCE: "f(q)",
    DISSIPATION: "g(v)",
    COUPLED_DAMPING: "h(q) v",
    HYSTERESIS: "stops that slip",
    MEMORY: "branches that relax",
    FORCE_SURFACE: "f(q, v)",
}


def measured_shape(
    table: ElementTable, name: str, squares: HeldOutSquares, law: NearestLaw
) -> ShapeAndLaw:
    """Curve of one class of an answer, and the law without a name that it makes.

    `squares` are those of the answer; `law` is drawn over the curve. None for a class without a
    curve, and for one that no file holds. A curve over the speed is the whole force, with the
    baseline's damping; the law is what stands beside that.
    """
    if name == FORCE_SURFACE:
        shape, measured_law = _surface_shape(table, squares)
        # Off the one curve that the records go round a surface is anything.
        return shape, None if is_one_curve(table) else measured_law
    if name == DELAY or name not in CLASS_GROUPS:
        return None, None
    x, rows = _curve(table, name)
    labels, units = axes_of(name, table.model.units)
    has_loop = name == HYSTERESIS and table.loop is not None
    groups = (*CLASS_GROUPS[name], LOOP) if has_loop else CLASS_GROUPS[name]
    columns = np.concatenate([table.table.groups[group].columns for group in groups])
    draws, damping = _with_damping(table, squares, columns)
    drawn = draws @ rows
    curves = np.array([values - _baseline_share(x, values, name) for values in drawn])
    smooth, steps, friction = curves[0], (0.0, 0.0), (0.0, 0.0, 0.0)
    if name == DISSIPATION:
        rest_speed = table.bases.size.rest_speed
        smooth, steps = without_steps(x, curves[0], rest_speed)
        friction = half_step(x, curves, rest_speed)
        at_rest = np.array([np.interp(0.0, x, values) for values in drawn])
        curves = drawn - at_rest[:, None] + np.outer(damping, x)
    y, band = curves[0], band_of(curves[0], curves[1:])
    shape = MeasuredShape(
        x,
        y,
        band,
        _law_curve(table, name, law, x, y),
        labels,
        units,
        shape_words(name, x, y, units, friction),
        smooth,
        steps,
    )
    return shape, _law(table, name, shape, draws[0])


def _with_damping(
    table: ElementTable, squares: HeldOutSquares, columns: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Draws of the coefficients of some columns, and those of the baseline's damping C1 beside."""
    # The target is the table's first column; mass, where it is fitted, K1 and C1 follow.
    damping = 2 + (table.model.mass is None)
    drawn = drawn_coefficients(table.scores, squares, np.append(columns, damping))
    return drawn[:, :-1], drawn[:, -1]


def _law(table: ElementTable, name: str, shape: MeasuredShape, weights: FloatArray) -> Law | None:
    """Law of a curve, without name; None of a class that no file holds."""
    size, units = table.bases.size, table.model.units
    if name in TABULATED:
        terms: list[LawTerm] = [Table(ELEMENT, shape.x, shape.smooth)]
        if name == DISSIPATION:
            # Dry friction whose steps at rest are those of the curve, its bristles as stops.
            slips = np.maximum(weights[-size.presliding.size :], 0.0)
            turning = min(float(slips.sum()), *shape.steps)
            if turning > 0.0:
                terms += _stops_of_friction(size, slips * turning / slips.sum())
            plus, minus = (step - turning for step in shape.steps)
            terms += [Friction(ELEMENT, plus, minus)] if plus or minus else []
        return Law("", ELEMENT, name, units, tuple(terms))
    if name not in WITH_MEMORY:
        return None
    if name == MEMORY:
        rows = np.column_stack([table.bases.taus, np.maximum(weights, 0.0)])
        memory = replace(NO_PARTS, branches=rows[rows[:, STIFFNESS] > 0.0])
    elif table.loop is None:
        memory = stops_of(weights, size)
    else:
        loops = table.loop.row(weights[-1])[None]
        memory = replace(stops_of(weights[:-1], size), loops=loops)
    return Law("", ELEMENT, name, units, law_terms(memory), {"deflection": (size.low, size.high)})


def _curve(table: ElementTable, name: str) -> tuple[FloatArray, FloatArray]:
    """Abscissa of a class, and its columns along that."""
    bases, size = table.bases, table.bases.size
    x = np.linspace(size.low, size.high, POINTS)
    if name == RESTORING_FORCE:
        return x, bases.force(x)
    if name == COUPLED_DAMPING:
        return x, bases.coupled(x)
    if name == DISSIPATION:
        v = bases.drawn_speeds(2 * POINTS)
        # A bristle that has turned holds its whole force against the motion.
        turned = np.tile(np.tanh(v / size.rest_speed), (size.presliding.size, 1))
        curved = np.linspace(bases.speed.low, bases.speed.high, 2 * POINTS)
        rows = np.concatenate([bases.speed(curved), step_at_rest(v, size.rest_speed), turned])
        return v, rows
    if name == HYSTERESIS:
        middle = 0.5 * (size.low + size.high)
        angle = np.linspace(0.0, (2.0 * _SETTLING + 0.5) * np.pi, (4 * _SETTLING + 1) * POINTS)
        turns = middle + size.half_range * np.sin(angle)
        rows = stops_columns(turns, size)
        if table.loop is not None:
            rows = np.vstack([rows, table.loop.along(turns)])
        turn = slice(-4 * POINTS, None)
        return turns[turn], rows[:, turn]
    if name == MEMORY:
        t = np.geomspace(bases.taus[0] / 3.0, 3.0 * bases.taus[-1], POINTS)
        return t, np.exp(-t[None] / bases.taus[:, None])
    if name == TIME_VARIATION:
        t = np.linspace(bases.time.low, bases.time.high, POINTS)
        splines = bases.time(t) / size.half_range
        return t, np.vstack([splines, np.zeros((2 * len(splines), t.size))])
    u = np.linspace(bases.side.low, bases.side.high, POINTS)
    return u, bases.side(u)


def _baseline_share(x: FloatArray, y: FloatArray, name: str) -> FloatArray:
    """Straight line that the baseline can take up, shape (n,).

    Of f(x) that through the straightest quarter of the range nearest to rest, of g(v) the slope at
    rest, of a loop its spring; of h(x) and of a change with time the mean.
    """
    if name == HYSTERESIS:
        return loop_spring(x, y) * x
    if name in (COUPLED_DAMPING, TIME_VARIATION):
        return np.full(x.size, y.mean())
    if name not in (RESTORING_FORCE, DISSIPATION, DRIVE_SIDE):
        return np.zeros(x.size)
    if name == DISSIPATION:
        slope = slope_beside_rest(x, y)
        return np.asarray(np.interp(0.0, x, y) + slope * x, dtype=np.float64)
    return np.asarray(np.polyval(straight_part(x, y), x))


def _law_curve(
    table: ElementTable, name: str, law: NearestLaw, x: FloatArray, y: FloatArray
) -> FloatArray:
    """Law of the class fitted to its curve with a straight line; empty where none can be drawn."""
    if not law.id or name not in (RESTORING_FORCE, DISSIPATION, COUPLED_DAMPING):
        return np.empty(0)
    still = np.zeros(x.size)
    q, v = (still, x) if name == DISSIPATION else (x, still + 1.0)
    shapes = static_law(law.id, q, v, table.bases.size)
    if shapes is None:
        return np.empty(0)
    return fitted_law(shapes, x, y)


def _surface_shape(table: ElementTable, squares: HeldOutSquares) -> tuple[MeasuredShape, Law]:
    """Force over the speed at two deflections, and the surface as a law without a name."""
    bases, units = table.bases, table.model.units
    force, length = units
    units_along_v = (f"{length}/s", force)
    groups = table.table.groups
    # Dry friction with a memory stands last.
    smooth_groups = [name for name in CLASS_GROUPS[FORCE_SURFACE] if name != _PRESLIDING]
    columns = np.concatenate([groups[name].columns for name in (*smooth_groups, _PRESLIDING)])
    draws, damping = _with_damping(table, squares, columns)
    n_slips = groups[_PRESLIDING].columns.size
    smooth, slips = np.split(draws, [draws.shape[1] - n_slips], axis=1)
    size = bases.size
    x, v = np.linspace(size.low, size.high, _POINTS), bases.drawn_speeds(2 * _POINTS)
    at_x, at_v = (axis.ravel() for axis in np.meshgrid(x, v, indexing="ij"))
    forces = np.reshape(smooth[0] @ _columns(bases, at_x, at_v), (x.size, v.size))
    surface, levels = _without_steps(x, v, forces, size)
    terms = _stops_of_friction(size, slips[0], np.column_stack([x, levels]))
    law = Law("", ELEMENT, FORCE_SURFACE, units, (surface, *terms))
    deflections = [size.low + share * (size.high - size.low) for share in _DRAWN_AT]
    friction = np.sum(np.maximum(slips, 0.0), axis=1)[:, None]
    along_v = [_columns(bases, np.full(v.size, place), v) for place in deflections]
    drawn = smooth @ np.array(along_v) + friction * np.tanh(v / size.rest_speed)
    drawn += np.outer(damping, v)
    ends = _edges_of_rest(v, size.rest_speed)
    middles = [[np.interp(ends, v, row).mean() for row in curve] for curve in drawn]
    drawn -= np.array(middles)[..., None]
    lower, upper = (
        BesideCurve(f"at {in_unit(place, length)}", v, y[0], band_of(y[0], y[1:]))
        for place, y in zip(deflections, drawn, strict=True)
    )
    shape = MeasuredShape(
        lower.x,
        lower.y,
        lower.band,
        np.empty(0),
        ("speed", "force beyond that at rest"),
        units_along_v,
        surface_words(lower, upper, units_along_v),
        lower.y,
        (0.0, 0.0),
        beside=(upper,),
        name=lower.name,
    )
    return shape, law


def _edges_of_rest(v: FloatArray, rest_speed: float) -> FloatArray:
    """Speeds on both sides of rest from which the sign of the speed is certain, shape (2,)."""
    certain = CERTAIN_SIGN * rest_speed
    return np.array([max(-certain, v[0]), min(certain, v[-1])])


def _columns(bases: ElementBases, x: FloatArray, v: FloatArray) -> FloatArray:
    """Columns of the surface's groups at some points, shape (n_columns, n)."""
    return np.concatenate(
        [
            bases.force(x),
            bases.speed(curved_speed(v, bases.size.speed)),
            step_at_rest(v, bases.size.rest_speed),
            bases.coupled(x) * v,
            surface_products(bases, x, v),
        ]
    )


def _without_steps(
    x: FloatArray, v: FloatArray, forces: FloatArray, size: MotionSize
) -> tuple[Surface, list[float]]:
    """Surface of forces, shape (n_x, n_v), without its steps at rest, which are dry friction."""
    edges = _edges_of_rest(v, size.rest_speed)
    inner = (v > edges[0]) & (v < edges[1])
    rows, levels = [], []
    for values in forces:
        # The step is read where the sign of the speed is certain, less what grows with the speed.
        # Half of it is dry friction; the middle of it is a force of the deflection.
        lower, upper = np.interp(edges, v, values - slope_beside_rest(v, values) * v)
        level = max(0.5 * (upper - lower), 0.0)
        row = values - level * np.sign(v)
        row[inner] = np.interp(v[inner], edges, np.interp(edges, v, row))
        rows.append(row)
        levels.append(level)
    y, middle = np.array(rows), rows[_POINTS // 2]
    slope, constant = straight_part(x, np.array([np.interp(0.0, v, row) for row in y]))
    y -= slope * x[:, None] + constant + slope_beside_rest(v, middle) * v
    return Surface(ELEMENT, x, v, y), levels


def _stops_of_friction(
    size: MotionSize, slips: FloatArray, levels: FloatArray = NO_PARTS.levels
) -> Sequence[LawTerm]:
    """Bristles of some forces at slip as stops, and dry friction over the deflection."""
    bristles = _stops_of_bristles(size.presliding, slips)
    turning = memory_of_stops({"slip": bristles}, 0.0, size.half_range)
    return law_terms(replace(turning, levels=levels) if levels[:, 1:].any() else turning)


def _stops_of_bristles(lengths: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Yield deflections and weights of stops that turn as bristles of some lengths do.

    After a reversal friction of Dahl's law turns as ``2 exp(-d / L) - 1``. So do stops of all yield
    deflections y whose weights have the density ``4 y / L² exp(-2 y / L)`` (a gamma
    distribution); a few of equal weight stand for it, in the middle of equal shares of it.

    References
    ----------
    .. [1] W. D. Iwan, "A distributed-element model for hysteresis", J. Appl. Mech. 33 (1966) 893:
       the density is ``-d f''(d)`` of the curve f of first loading.
    """
    shares = (np.arange(_STOPS_OF_BRISTLE) + 0.5) / _STOPS_OF_BRISTLE
    deflections = np.outer(lengths, gamma.ppf(shares, 2.0, scale=0.5))
    divided = np.repeat(weights / _STOPS_OF_BRISTLE, _STOPS_OF_BRISTLE)
    return deflections.ravel(), divided


def law_of_answer(
    answer: ClassAnswer,
    campaign: str,
    wanted: str | None = None,
    values: Mapping[str, Mapping[str, float]] = MappingProxyType({}),
) -> Law:
    """Shape of a class of the answer: as it was measured, or that of its named law.

    `values` are the fitted parameters of named laws, by name.
    """
    findings = []
    for finding in answer.classes:
        measured, effect = finding.measured_law, ELEMENT_EFFECTS.get(finding.law)
        if finding.law_named and measured and effect and finding.shape and finding.law in values:
            x, fitted = finding.shape.x, values[finding.law]
            law = law_of_effect(effect, finding.id, fitted, x, measured.units)
            finding = replace(finding, measured_law=law or measured)
        findings.append(finding)
    answer = replace(answer, classes=tuple(findings))
    return law_of_class(answer, campaign, {name: name for name in _EQUATIONS}, wanted, _refusal)


def _refusal(name: str, finding: ClassFinding) -> str:
    """Why a class whose shape was measured has no law."""
    if name != FORCE_SURFACE or finding.shape is None or finding.measured_law is not None:
        return ""
    return (
        "the records go round one curve of deflection and speed (one frequency at one level), off "
        "which a surface is not known; measure another level or frequency"
    )


def law_cards(laws: Sequence[Law], units: tuple[str, str]) -> tuple[EffectCard, ...]:
    """Effect cards of laws, whose one parameter is the size; a law of other units is refused."""
    for law in laws:
        if law.units != units:
            raise ValueError(
                f"law '{law.name}': units are {' and '.join(law.units)}; expected those of the "
                f"records, {' and '.join(units)}"
            )
    return tuple(
        EffectCard(
            law.name,
            ELEMENT,
            f"size x {_EQUATIONS[law.effect_class]} as it was measured",
            (SIZE,),
            "that of its shape",
        )
        for law in laws
    )


def beyond_visited(law: Law, records: Sequence[ElementRecord]) -> tuple[CampaignWarning, ...]:
    """Warnings where records leave the range in which a law was measured; empty where none does."""
    speed = 1 if law.effect_class == DISSIPATION else 0
    ranges = [(np.array(ends), 0) for ends in law.visited.values()]
    ranges += [(table.x, speed) for table in law.of(Table)]
    for surface in law.of(Surface):
        ranges += [(surface.x, 0), (surface.v, 1)]
    warnings = []
    for visited, motion in ranges:
        # Where samples count: the measured motion may hold a run-in.
        runs = [record.motion[motion][record.block >= 0] for record in records]
        values = np.concatenate(runs)
        outside = (values < visited[0]) | (values > visited[-1])
        beyond = [max(visited[0] - x.min(), x.max() - visited[-1]) for x in runs]
        if outside.any():
            warning = visited_range_warning(
                law,
                share=float(np.mean(outside)),
                reached=values,
                table=visited,
                unit=f"{law.units[1]}/s" if motion else law.units[1],
                run=records[int(np.argmax(beyond))].name,
            )
            warnings.append(warning)
    return tuple(warnings)
