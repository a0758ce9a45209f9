"""The measured shape of a force of the bushings: curves over the visited range, and its law."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from carrierflex.diagnosis.classes.answer import NearestLaw, ShapeAndLaw
from carrierflex.diagnosis.classes.columns import curved_speed, straight_speed, time_splines
from carrierflex.diagnosis.classes.decision import shape_of, way_of
from carrierflex.diagnosis.classes.held_out import Classes, ClassScores, HeldOutSquares
from carrierflex.diagnosis.classes.results import (
    BesideCurve,
    ClassAnswer,
    ClassFinding,
    MeasuredShape,
)
from carrierflex.diagnosis.classes.shapes import (
    POINTS,
    SIZE,
    axes_of,
    band_of,
    drawn_coefficients,
    fitted_law,
    half_step,
    law_of_class,
    loop_spring,
    shape_words,
    slope_beside_rest,
    visited_range_warning,
    without_steps,
)
from carrierflex.diagnosis.classes.shares import Shares
from carrierflex.diagnosis.comparison.effect_cards import EffectCard
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.mounting.columns import ForceGroup, force_groups, law_forces
from carrierflex.diagnosis.mounting.model import KIND, MountingModel
from carrierflex.diagnosis.mounting.motion import BushingMotion, bushing_motions
from carrierflex.diagnosis.mounting.records import MountingRecord
from carrierflex.diagnosis.mounting.table import (
    CHANGE,
    COUPLED,
    DISSIPATION,
    FORCE,
    FORCE_GROUPS,
    HYSTERESIS,
    MEMORY,
    SAME,
    MountingTable,
)
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning
from carrierflex.simulation.laws import (
    APART,
    BOTH,
    MOUNTING,
    PORT,
    RADIAL,
    SMOOTH,
    STARBOARD,
    Branch,
    Law,
    LawTerm,
    Stop,
    Table,
)

#: Ways of a group's force, in the order of the groups of a class.
_ACTS = (APART, RADIAL, SMOOTH)
_IN_WORDS = {
    APART: "in y and in z apart",
    RADIAL: "along its direction in the plane",
    SMOOTH: "giving way along its path in the plane",
}
#: Bushings of each part, in the order of their motions.
_BUSHINGS: Mapping[str, tuple[int, ...]] = {BOTH: (0, 1), STARBOARD: (0,), PORT: (1,)}
#: Share of the visited sizes that are small deflections.
_SMALL = 0.25
#: Classes whose curves hold a straight part that the linear bushings take up.
_WITH_STRAIGHT_LINE = (FORCE, DISSIPATION, COUPLED)
#: Classes that a law file holds, and what it calls them.
_NAMES: Mapping[str, str] = {
    name: name.rpartition("/")[2] for name in (FORCE, DISSIPATION, COUPLED, HYSTERESIS, MEMORY)
}
_EQUATIONS = {
    _NAMES[FORCE]: "f(u) of measured tables",
    _NAMES[DISSIPATION]: "g(v) of measured tables",
    _NAMES[COUPLED]: "h(u) v of measured tables",
    _NAMES[HYSTERESIS]: "the stops of a measured loop",
    _NAMES[MEMORY]: "the branches of a measured relaxation",
}
#: Share of the largest force from which a step at rest is dry friction: what is drawn as zero.
_FRICTION = 0.05


def measured_shape(
    table: MountingTable,
    shares: Shares,
    classes: Classes,
    name: str,
    scored: HeldOutSquares,
    law: NearestLaw,
) -> ShapeAndLaw:
    """Curve of one class of an answer, and the law without a name that it makes."""
    if shape_of(name) not in FORCE_GROUPS:
        return None, None
    fit, way_words = _fit(table, shares, classes, name, scored)
    reduced = fit.reduced(fit.acts)
    first, *others = sorted(reduced, key=lambda side: -float(np.ptp(reduced[side][1][0])))
    labels, units = axes_of(fit.shape.rpartition("/")[2], ("N", "m"))
    x, draws = reduced[first]
    words = [_words(fit, x, draws, units), way_words]
    size = max(float(np.ptp(draws[0])), 1e-300)
    beside = []
    for side in others:
        x_beside, drawn = reduced[side]
        share = 100.0 * float(np.ptp(drawn[0])) / size
        words.append(f"{first} bushing; {side} bushing {share:.0f} % of it")
        band = band_of(drawn[0], drawn[1:])
        beside.append(BesideCurve(f"{side} bushing", x_beside, drawn[0], band))
    terms, steps, visited = fit.terms()
    shape = MeasuredShape(
        x,
        draws[0],
        band_of(draws[0], draws[1:]),
        _law_curve(table, fit.shape, law, x, draws[0]),
        labels,
        units,
        ", ".join(text for text in words if text),
        draws[0],
        steps,
        tuple(beside),
    )
    if fit.shape not in _NAMES:
        return shape, None
    return shape, Law("", MOUNTING, _NAMES[fit.shape], ("N", "m"), terms, visited)


def bushing_law_of_answer(answer: ClassAnswer, campaign: str, wanted: str | None = None) -> Law:
    """Measured shape of a class of the answer, without what the linear bushings take up."""
    return law_of_class(answer, campaign, _NAMES, wanted, _refusal)


def law_cards(laws: Sequence[Law]) -> tuple[EffectCard, ...]:
    """Effect cards of measured laws, whose one parameter is the size, over the measured one."""
    return tuple(
        EffectCard(
            law.name,
            KIND,
            f"size x {_EQUATIONS[law.effect_class]} in the bushings",
            (SIZE,),
            "that of its measured shape",
        )
        for law in laws
    )


def beyond_visited(
    law: Law,
    model: MountingModel,
    records: Sequence[MountingRecord],
    linear: FloatArray,
) -> tuple[CampaignWarning, ...]:
    """Warning where records leave the range in which a law was measured; empty where none does."""
    motions = bushing_motions(model, records, linear)
    if not motions:
        return ()
    tables = law.of(Table) or tuple(
        Table(BOTH, np.array(ends), np.zeros(2), RADIAL) for ends in law.visited.values()
    )
    along_speed = law.effect_class == _NAMES[DISSIPATION]
    reached = [
        [_reached_by(table, run, along_speed=along_speed) for run in motions] for table in tables
    ]
    shares = np.array(
        [
            [
                float(((values < table.x[0]) | (values > table.x[-1])).any(axis=0).mean())
                for values in of_table
            ]
            for table, of_table in zip(tables, reached, strict=True)
        ]
    )
    sizes = np.array([run.u.shape[2] for run in motions])
    by_table = shares @ sizes / sizes.sum()
    worst = int(np.argmax(by_table))
    share = float(by_table[worst])
    if not share > 0.0:
        return ()
    warning = visited_range_warning(
        law,
        share=share,
        reached=np.concatenate([values.ravel() for values in reached[worst]]),
        table=tables[worst].x,
        unit="m/s" if along_speed else "m",
        run=motions[int(np.argmax(shares[worst]))].record.name,
    )
    return (warning,)


@dataclass(frozen=True, eq=False)
class _Fit:
    """A class in the model that is drawn."""

    table: MountingTable
    shape: str
    #: Coefficients by side, then by way, (n_draws, n_columns): of all blocks first, then of every
    #: draw
    drawn: Mapping[str, Mapping[str, FloatArray]]

    @property
    def acts(self) -> tuple[str, ...]:
        """Ways in which the force acts."""
        return tuple(next(iter(self.drawn.values())))

    @cached_property
    def _groups(self) -> dict[str, ForceGroup]:
        """Groups of columns by way."""
        groups = {group.id: group for group in force_groups(self.table.size)}
        names = zip(_ACTS, FORCE_GROUPS[self.shape], strict=False)
        return {act: groups[name] for act, name in names}

    def reduced(self, acts: Sequence[str]) -> dict[str, tuple[FloatArray, FloatArray]]:
        """Abscissa and force of each side as some ways add up, shape (n_draws, n).

        Without what linear bushings take up, alike in both; forces zero at zero.
        """
        curves = {}
        for side, coefficients in self.drawn.items():
            x = self._abscissa(side, acts[0])
            rows = np.sum([coefficients[act] @ self._along(act, x) for act in acts], axis=0)
            # A loop is drawn once it has come round.
            shown = slice(5 * POINTS if self.shape == HYSTERESIS else 0, None)
            curves[side] = x[shown], rows[:, shown]
        taken = np.mean([_straight(self.shape, x, draws) for x, draws in curves.values()], axis=0)
        return {side: (x, _without(self.shape, x, y, taken)) for side, (x, y) in curves.items()}

    def _abscissa(self, side: str, act: str) -> FloatArray:
        """Values along which the curve is drawn, over what counted samples visit."""
        size = self.table.size
        if self.shape == CHANGE:
            return np.linspace(0.0, size.length, POINTS)
        if self.shape == MEMORY:
            return np.geomspace(size.taus[0] / 3.0, 3.0 * size.taus[-1], POINTS)
        if self.shape == HYSTERESIS:
            turns = np.sin(np.linspace(0.0, 4.5 * np.pi, 9 * POINTS))
            return np.asarray(size.deflection * turns)
        deflection, speed = self.table.counted(_BUSHINGS[side])
        motion = speed if self.shape == DISSIPATION else deflection
        ends = np.array([motion.min(), motion.max()])
        if act == RADIAL:
            ends = np.array([0.0, np.hypot(motion[0], motion[1]).max()])
        if self.shape != DISSIPATION:
            return np.linspace(ends[0], ends[1], POINTS)
        low, high = curved_speed(ends, size.speed)
        return straight_speed(np.linspace(low, high, 2 * POINTS), size.speed)

    def _along(self, act: str, x: FloatArray) -> FloatArray:
        """Columns of a way along a straight motion of the bushings, shape (n_columns, n)."""
        if self.shape == MEMORY:
            return np.asarray(np.exp(-x[None] / self.table.size.taus[:, None]))
        if self.shape == CHANGE:
            return time_splines(self.table.size.length)(x)
        return self._groups[act].columns(_motion(self.table, self.shape, x))[:, 0, 1]

    def terms(
        self,
    ) -> tuple[tuple[LawTerm, ...], tuple[float, float], dict[str, tuple[float, float]]]:
        """Terms of the law, its largest steps at rest, which it does not hold, what it visited."""
        terms: list[LawTerm] = []
        steps = (0.0, 0.0)
        size = self.table.size
        if self.shape in _WITH_STRAIGHT_LINE:
            for act in self.acts:
                for side, (x, draws) in self.reduced([act]).items():
                    y = draws[0]
                    if self.shape == DISSIPATION:
                        y, risen = without_steps(x, y, size.rest_speed)
                        steps = (max(steps[0], risen[0]), max(steps[1], risen[1]))
                    terms.append(Table(side, x, y, act))
            return tuple(terms), steps, {}
        for side, coefficients in self.drawn.items():
            for act, drawn in coefficients.items():
                weights = drawn[0].tolist()
                if self.shape == MEMORY:
                    taus = zip(size.taus.tolist(), weights, strict=True)
                    terms += [Branch(side, tau, weight) for tau, weight in taus if weight > 0.0]
                elif self.shape == HYSTERESIS:
                    yields = size.yields if act == APART else size.radial_yields
                    slips = zip(yields.tolist(), weights, strict=True)
                    terms += [
                        Stop(side, slip, weight, act) for slip, weight in slips if weight > 0.0
                    ]
        u, _ = self.table.counted((0, 1))
        return tuple(terms), steps, {"deflection": (0.0, float(np.hypot(u[0], u[1]).max()))}


def _words(fit: _Fit, x: FloatArray, draws: FloatArray, units: tuple[str, str]) -> str:
    """Curve in words; along the size of a motion it is the same in either sense."""
    kind = fit.shape.rpartition("/")[2]
    if fit.shape in _WITH_STRAIGHT_LINE and fit.acts == (RADIAL,):
        sign = 1.0 if fit.shape == COUPLED else -1.0
        x = np.concatenate([-x[:0:-1], x])
        draws = np.concatenate([sign * draws[:, :0:-1], draws], axis=1)
    friction = (0.0, 0.0, 0.0)
    if fit.shape == DISSIPATION:
        friction = half_step(x, draws, fit.table.size.rest_speed)
    return shape_words(kind, x, draws[0], units, friction)


def _fit(
    table: MountingTable, shares: Shares, classes: Classes, name: str, scored: HeldOutSquares
) -> tuple[_Fit, str]:
    """The class in the one of its ways that leaves as much, in all where none does; in words."""
    scores, shape, way = table.scores, shape_of(name), way_of(name)
    groups = FORCE_GROUPS[shape]
    sides = (BOTH,) if way == SAME else (STARBOARD, PORT)
    acts: tuple[str, ...] = _ACTS[: len(groups)]
    words = ""
    if len(groups) > 1:
        variants = {
            f"{name}:{act}": tuple(_named(group, side) for side in sides)
            for act, group in zip(acts, groups, strict=True)
        }
        of_variants = replace(scores.table, classes={**scores.table.classes, **variants})
        scores = ClassScores(of_variants, scores.constants)
        others = tuple(other for other in classes if other != name)
        results = {act: scores.of((*others, f"{name}:{act}")) for act in acts}
        as_good = [
            act
            for act, result in results.items()
            if result.total <= scored.total or shares.are_equal(result, scored)
        ]
        if as_good:
            best = min(as_good, key=lambda act: results[act].total)
            scored, acts = results[best], (best,)
            words = _IN_WORDS[best]
            if len(as_good) > 1:
                as_well = " or ".join(_IN_WORDS[act] for act in as_good if act != best)
                words += f" ({as_well} leaves as much)"
        else:
            words = "; ".join(_IN_WORDS[act] for act in acts)
    columns = [
        scores.table.groups[_named(groups[_ACTS.index(act)], side)].columns
        for side in sides
        for act in acts
    ]
    drawn = drawn_coefficients(scores, scored, np.concatenate(columns))
    ends = np.cumsum([members.size for members in columns])[:-1]
    coefficients = iter(np.split(drawn, ends, axis=1))
    by_side = {side: {act: next(coefficients) for act in acts} for side in sides}
    return _Fit(table, shape, by_side), words


def _named(group: str, side: str) -> str:
    """Group of the table of one group of forces."""
    return group if side == BOTH else f"{group}:{side}"


def _motion(table: MountingTable, shape: str, x: FloatArray) -> BushingMotion:
    """Motion of the bushings in z alone, x their speed or deflection; damping at unit speed."""
    u = np.zeros((2, 2, x.size))
    v = np.zeros((2, 2, x.size))
    if shape == DISSIPATION:
        v[:, 1] = x
    else:
        u[:, 1] = x
    if shape == COUPLED:
        v[:, 1] = 1.0
    return replace(table.motions[0], loads=np.zeros((x.size, 3)), u=u, v=v)


def _straight(shape: str, x: FloatArray, draws: FloatArray) -> FloatArray:
    """What of curves the linear bushings take up: a slope, or a constant, shape (n_draws,)."""
    if shape == FORCE:
        # Stiffness of small motions: the least deflections that are visited, and a quarter more.
        least = np.abs(x).min() + _SMALL * np.ptp(np.abs(x))
        small = np.abs(x) <= least
        return np.array([np.polyfit(x[small], y[small], 1)[0] for y in draws])
    if shape == DISSIPATION:
        return np.array([slope_beside_rest(x, y) for y in draws])
    if shape == HYSTERESIS:
        return np.array([loop_spring(x, y) for y in draws])
    return draws.mean(axis=1) if shape in (COUPLED, CHANGE) else np.zeros(len(draws))


def _without(shape: str, x: FloatArray, draws: FloatArray, taken: FloatArray) -> FloatArray:
    """Curves without what linear bushings take up, alike in both; forces zero at zero."""
    if shape not in (FORCE, DISSIPATION, HYSTERESIS):
        return draws - taken[:, None]
    rest = draws - np.outer(taken, x)
    if shape == HYSTERESIS:
        return rest
    return rest - np.array([np.interp(0.0, x, y) for y in rest])[:, None]


def _law_curve(
    table: MountingTable, shape: str, law: NearestLaw, x: FloatArray, y: FloatArray
) -> FloatArray:
    """Law of the class fitted to its curve with a straight line; empty where none can be drawn."""
    if not law.id or shape not in _WITH_STRAIGHT_LINE:
        return np.empty(0)
    shapes = law_forces(table.model, table.size, _motion(table, shape, x), law.id)[:, :, 0, 1]
    return fitted_law(shapes, x, y)


def _refusal(name: str, finding: ClassFinding) -> str:
    """Why a class whose shape was measured has no law."""
    tables = finding.measured_law.of(Table) if finding.measured_law else ()
    if not tables or finding.shape is None:
        return ""
    step = max(finding.shape.steps)
    largest = max(float(np.abs(table.y).max()) for table in tables)
    if step <= _FRICTION * max(largest, step):
        return ""
    return (
        f"'{name}' holds dry friction of {step:.3g} N at rest, which no table of a bushing does; "
        "expected a force that is continuous in the speed"
    )


def _reached_by(table: Table, run: BushingMotion, *, along_speed: bool) -> FloatArray:
    """Deflection or speed of the bushings of a table, shape (m, n)."""
    motion = (run.v if along_speed else run.u)[list(_BUSHINGS[table.acts_on])]
    if table.plane == RADIAL:
        return np.asarray(np.hypot(motion[:, 0], motion[:, 1]))
    return motion.reshape(-1, motion.shape[2])
