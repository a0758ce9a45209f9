"""Measured shape of a class: its curve with a band, in words, and as a law."""

import re
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from carrierflex.diagnosis.classes.columns import TIME_VARIATION
from carrierflex.diagnosis.classes.gram_table import IntArray
from carrierflex.diagnosis.classes.held_out import (
    ClassScores,
    HeldOutSquares,
    coefficients,
    products_of,
)
from carrierflex.diagnosis.classes.results import (
    LEADING_CLASS,
    NAMED_CLASS,
    BesideCurve,
    ClassAnswer,
    ClassFinding,
)
from carrierflex.diagnosis.classes.shares import INTERVAL
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.files.quantities import sized
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning
from carrierflex.simulation.effect_parameters import EffectParameter
from carrierflex.simulation.laws import (
    COUPLED_DAMPING,
    DISSIPATION,
    FORCE_SURFACE,
    HYSTERESIS,
    MEMORY,
    RESTORING_FORCE,
    Law,
)

#: Points of a curve.
POINTS = 81
_SEED = 3
#: Share of the range over which a curve is called straight, to take the baseline's part out.
_STRAIGHT = 0.25
#: What a quarter far from rest must be straighter by, as a share of the curve's size.
_NEAR_REST = 0.02
#: Speeds over that of rest from which the sign of the speed is certain: tanh is 0.995.
CERTAIN_SIGN = 3.0
#: Speeds over that of rest along which a curve is a straight line that shows the step at rest.
_BESIDE_REST = (1.0, 9.0)


def drawn_coefficients(
    scores: ClassScores, result: HeldOutSquares, columns: IntArray
) -> FloatArray:
    """Coefficients of some columns of a result in the table's units, shape (1 + n_draws, n).

    Those of all blocks, then of every draw of the blocks.
    """
    table = scores.table
    model = scores.model(result)
    chosen = np.array([int(np.flatnonzero(model.columns == column)[0]) for column in columns])
    rng = np.random.default_rng(_SEED)
    n = len(table.gram)
    counts = rng.multinomial(n, np.full(n, 1.0 / n), size=scores.constants.band_samples)
    by_block = products_of(table.gram, model)
    draws = [
        coefficients(np.tensordot(weights, by_block, axes=1), model)[chosen]
        for weights in (np.ones(n), *counts)
    ]
    # Column k of the table is the raw column times scale[k], the target times scale[0].
    return np.array(draws) * table.scale[columns] / table.scale[0]


def band_of(y: FloatArray, draws: FloatArray) -> FloatArray:
    """95 % band of a curve over its draws, the curve itself within it; shape (n, 2)."""
    low, high = np.quantile(draws, INTERVAL, axis=0)
    return np.array([np.minimum(low, y), np.maximum(high, y)]).T


def straight_part(x: FloatArray, y: FloatArray) -> FloatArray:
    """Line (slope, value at zero) along the straightest quarter of a curve, the nearest to rest."""
    even = np.linspace(x[0], x[-1], POINTS)
    values = np.interp(even, x, y)
    width = max(int(_STRAIGHT * POINTS), 8)
    size = float(np.ptp(values)) or 1.0
    rest = np.clip(0.0, even[0], even[-1])
    at, quarters = (sliding_window_view(row, width)[::4] for row in (even, values))
    middle, level = at.mean(axis=1), quarters.mean(axis=1)
    along = at - middle[:, None]
    slope = (along * quarters).sum(axis=1) / (along**2).sum(axis=1)
    bend = np.abs(level[:, None] + slope[:, None] * along - quarters).max(axis=1) / size
    away = np.abs(middle - rest) / (even[-1] - even[0])
    best = int(np.argmin(bend + _NEAR_REST * away))
    return np.array([slope[best], level[best] - slope[best] * middle[best]])


def loop_spring(x: FloatArray, y: FloatArray) -> float:
    """Slope of a loop where it slips: on the way outwards, both senses of the motion."""
    middle = 0.5 * (x.max() + x.min())
    outwards = np.gradient(x) * (x - middle) > 0.0
    ways = [outwards & (x > middle), outwards & (x < middle)]
    return float(np.mean([np.polyfit(x[way], y[way], 1)[0] for way in ways]))


def slope_beside_rest(x: FloatArray, y: FloatArray) -> float:
    """Slope of a curve over the speed: friction is a step between two straight sides."""
    sides = [side for side in (x > 0.0, x < 0.0) if np.count_nonzero(side) > 8]
    return float(np.mean([straight_part(x[side], y[side])[0] for side in sides]))


def without_steps(
    v: FloatArray, y: FloatArray, rest_speed: float
) -> tuple[FloatArray, tuple[float, float]]:
    """Curve over the speed without its steps at rest, and their heights.

    A step is where the curve beside rest reaches rest on a straight line;
    columns of the splines and of the steps share it between them in any way. Friction never drives:
    steps at positive and at negative speed are >= 0. Below `rest_speed` the sign is uncertain.
    """
    certain = CERTAIN_SIGN * rest_speed
    edges = np.array([min(certain, v[-1]), max(-certain, v[0])])
    first, second = np.interp(edges, v, y)
    plus, minus = _steps_at_rest(v, y, rest_speed)[0]
    steps = (max(plus, 0.0), max(minus, 0.0))
    rest = np.where(v > 0.0, y - steps[0], y + steps[1])
    inner = (v > edges[1]) & (v < edges[0])
    rest[inner] = np.interp(v[inner], edges[::-1], [second + steps[1], first - steps[0]])
    return rest, steps


def _steps_at_rest(
    v: FloatArray, y: FloatArray, rest_speed: float
) -> tuple[tuple[float, float], float]:
    """Force at positive and at negative speed that a curve has at rest, and its uncertainty.

    The line along each side of rest, from the speed below which the sign is uncertain to nine times
    that; the uncertainty is what the curve swings about both lines, RMS, and how far parabolas
    reach rest from them.
    """
    x = np.linspace(*_BESIDE_REST, POINTS) * rest_speed
    steps, swings, bends = [], [], []
    for side in (1.0, -1.0):
        values = side * np.interp(side * x, v, y)
        line = np.polyfit(x, values, 1)
        steps.append(float(line[1]))
        swings.append(values - np.polyval(line, x))
        bends.append(abs(float(np.polyfit(x, values, 2)[2] - line[1])))
    swing = float(np.sqrt(np.mean(np.square(swings))))
    return (steps[0], steps[1]), swing + float(np.mean(bends))


def half_step(v: FloatArray, draws: FloatArray, rest_speed: float) -> tuple[float, float, float]:
    """Dry friction of a curve over the speed, half its step at rest, with its 95 % interval.

    `draws`, shape (1 + n_draws, n), are the curve of all blocks and those of the draws.
    """
    halves = []
    for y in draws:
        (plus, minus), error = _steps_at_rest(v, y, rest_speed)
        level = 0.5 * (max(plus, 0.0) + max(minus, 0.0))
        halves.append((level, level - error, level + error))
    low, high = np.quantile(np.array(halves)[:, 1:], INTERVAL, axis=0)
    return halves[0][0], max(min(low[0], halves[0][0]), 0.0), max(high[1], halves[0][0])


def fitted_law(shapes: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    """Law at its best shape fitted to a curve with a straight line added, shape (n,).

    `shapes`, shape (n_shapes, n_columns, n), are the law for unit amplitudes.
    """
    fits = []
    for columns in shapes:
        design = np.vstack([columns, x, np.ones(x.size)]).T
        size = np.maximum(np.abs(design).max(axis=0), 1e-300)
        c = np.linalg.lstsq(design / size, y, rcond=None)[0]
        fits.append(np.asarray(design / size @ c))
    return min(fits, key=lambda fit: float(np.sum((fit - y) ** 2)))


def axes_of(name: str, units: tuple[str, str]) -> tuple[tuple[str, str], tuple[str, str]]:
    """What both axes of the curve of a class are, and their units, from those of its law."""
    force, length = units
    stiffness = ("s", f"{force}/{length}")
    axes = {
        RESTORING_FORCE: (("deflection", "restoring force"), (length, force)),
        DISSIPATION: (("speed", "dissipative force"), (f"{length}/s", force)),
        COUPLED_DAMPING: (("deflection", "damping"), (length, f"{force} s/{length}")),
        HYSTERESIS: (("deflection", "hysteretic force"), (length, force)),
        MEMORY: (("time after a step", "relaxing stiffness"), stiffness),
        TIME_VARIATION: (("time", "stiffness"), stiffness),
    }
    return axes.get(name, (("drive", "force"), (force, force)))


#: Share of the largest value below which a curve counts as zero.
_ZERO = 0.05
#: Ratio of both sides from which a curve is called one-sided, or stronger on one side.
_ONE_SIDED, _STRONGER = 0.15, 0.8
#: Word of the field for a force that steps where the speed changes its sign, the share of the force
#: at the largest speed from which half the step is named, and the factor by which the force may
#: change over the speeds and be called constant.
DRY_FRICTION, _STEP, _CHANGES = "dry friction", 0.15, 1.1
#: Ratio of the slopes of the outer and the inner half from which a curve is called bent.
_CURVED = 1.3
#: Distance beyond a gap, as a share of the deflection, below which it is not taken: its logarithm.
_NEXT = 0.01
#: Gaps that are tried beside none.
_GAPS = 12


def shape_words(
    name: str,
    x: FloatArray,
    y: FloatArray,
    units: tuple[str, str],
    friction: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> str:
    """Curve of a class in words: ``zero below 0.8 mm, stiffening above, one side only``.

    `friction` is half the step at rest of a curve over the speed, with its interval.
    """
    if not np.abs(y).max() > 0.0:
        return "zero throughout"
    if name == DISSIPATION:
        return _dissipation_words(x, y, units, friction)
    words = {
        RESTORING_FORCE: _force_words,
        HYSTERESIS: _loop_words,
        MEMORY: _memory_words,
        COUPLED_DAMPING: _coupled_words,
    }
    if name in words:
        return words[name](x, y, units)
    return f"changes by {in_unit(float(np.ptp(y)), units[1])}"


def surface_words(lower: BesideCurve, upper: BesideCurve, units: tuple[str, str]) -> str:
    """How the force over the speed differs between two deflections.

    For example ``loss at 0.2 m/s of 3 N at -1 mm and of 9 N at 1 mm``.
    """
    top = min(float(lower.x[-1]), -float(lower.x[0]))
    losses = [
        0.5 * float(np.interp(top, curve.x, curve.y) - np.interp(-top, curve.x, curve.y))
        for curve in (lower, upper)
    ]
    first, second = (in_unit(loss, units[1]) for loss in losses)
    return f"loss at {in_unit(top, units[0])} of {first} {lower.name} and of {second} {upper.name}"


def in_unit(value: float, unit: str) -> str:
    """Size with its unit; deflections and speeds below a tenth of a metre in millimetres."""
    if unit in ("m", "m/s") and abs(value) < 0.1:
        return f"{1e3 * value:.3g} m{unit}"
    return f"{value:.3g} {unit}" if 0.1 <= abs(value) < 1e3 else sized(value, unit)


def _force_words(x: FloatArray, y: FloatArray, units: tuple[str, str]) -> str:
    top = float(np.abs(y).max())
    # Sides are compared as far as the mass went on both.
    both = np.abs(x) <= min(-float(x[0]), float(x[-1]))
    positive = float(np.abs(y[(x > 0.0) & both]).max(initial=0.0))
    negative = float(np.abs(y[(x < 0.0) & both]).max(initial=0.0))
    weaker, stronger = sorted((negative, positive))
    # A force that is zero as far as that says nothing of the side that did not go further.
    is_unequal = stronger >= _ZERO * top and weaker < _STRONGER * stronger
    sizes = (positive, negative) if is_unequal else (float(x[-1]), -float(x[0]))
    side = np.flatnonzero(x > 0.0 if sizes[0] >= sizes[1] else x < 0.0)
    side = side[np.argsort(np.abs(x[side]))]
    d, f = np.abs(x[side]), y[side] * np.sign(x[side])
    words = []
    # From rest on: a curve that changes its sign far out is zero there once more.
    n_inside = int(np.argmax(np.abs(f) >= _ZERO * top))
    far = float(d[n_inside - 1]) if n_inside else 0.0
    power = _power(d, np.abs(f), far)
    changes_sign = min(float(f.max(initial=0.0)), -float(f.min(initial=0.0))) > _ONE_SIDED * top
    if changes_sign:
        # The baseline's spring took a line of it: where it begins to rise says nothing.
        ends = sorted((int(np.argmin(f)), int(np.argmax(f))))
        at = [f"{in_unit(float(f[k]), units[1])} at {in_unit(float(d[k]), units[0])}" for k in ends]
        words += [f"{at[0]}, then {at[1]}, beside the baseline's spring"]
    elif power:
        towards = "stiffening" if float(np.sum(x * y)) > 0.0 else "softening"
        words.append(f"{towards} as the power {power:.1f} of the deflection")
    elif far > 0.05 * float(np.abs(x).max()):
        words.append(f"zero below {in_unit(far, units[0])}")
        words.append(f"{_bending(d[n_inside - 1 :], f[n_inside - 1 :])} above")
    else:
        words.append(_bending(d, f))
    if is_unequal and weaker < _ONE_SIDED * stronger:
        words.append("one side only")
    elif is_unequal:
        words.append(f"{weaker / stronger:.0%} as strong on the other side")
    if not changes_sign:
        words.append(f"up to {in_unit(top, units[1])}")
    return ", ".join(words)


def _power(d: FloatArray, f: FloatArray, gap: float) -> float:
    """Power of a force that rises from zero on; zero where one that rises beyond a gap fits it."""
    rises = (d > 0.0) & (f > _ZERO * f.max(initial=0.0))
    if np.count_nonzero(rises) < 4:
        return 0.0
    x, y = d[rises], f[rises]

    def fitted(distance: FloatArray) -> tuple[float, float]:
        """Power of a force over a distance, and the square that it leaves."""
        power, size = np.polyfit(np.log(distance), np.log(y), 1)
        return float(power), float(np.sum((y - np.exp(size) * distance**power) ** 2))

    power, square = fitted(x)
    gaps = np.linspace(0.0, gap, _GAPS)[1:]
    beyond = min(fitted(np.maximum(x - one, _NEXT * x))[1] for one in gaps)
    return power if power > _CURVED and square < beyond else 0.0


def _bending(d: FloatArray, f: FloatArray) -> str:
    """Whether a force grows with deflection or falls, and how."""
    if d.size < 4:
        return "too short to say"
    half = d.size // 2
    first = np.polyfit(d[: half + 1], f[: half + 1], 1)[0]
    second = np.polyfit(d[half:], f[half:], 1)[0]
    if f[-1] < 0.0:
        return "softening" if second < first else "softening, then straight"
    if second > _CURVED * first:
        return "stiffening"
    return "straight" if second > first / _CURVED else "stiffening ever less"


def _dissipation_words(
    x: FloatArray, y: FloatArray, units: tuple[str, str], friction: tuple[float, float, float]
) -> str:
    top = float(np.abs(x).max())
    end = 0.5 * (float(np.interp(top, x, y)) - float(np.interp(-top, x, y)))
    if end < 0.0:
        # No damper drives: another class of the answer holds the rest of its force.
        return "its size cannot be determined together with the other cause"
    at_top = f"{in_unit(end, units[1])} at {in_unit(top, units[0])}"
    level, low, high = friction
    if level <= _STEP * end:
        return f"grows with speed, {at_top}"
    ends = f"{in_unit(low, units[1])} to {in_unit(high, units[1])}"
    words = f"{DRY_FRICTION}, about {in_unit(level, units[1])} ({ends})"
    if level / _CHANGES <= end <= _CHANGES * level:
        return f"{words}, at every speed"
    return f"{words}, {'falling' if end < level else 'growing'} with speed, {at_top}"


def _loop_words(x: FloatArray, y: FloatArray, units: tuple[str, str]) -> str:
    middle = 0.5 * (x.max() + x.min())
    half = 0.5 * float(np.ptp(x))
    outwards, inwards = y[x > middle], y[x < middle]
    rising = np.gradient(x) > 0.0
    height = float(
        np.interp(middle, *_sorted(x[rising], y[rising]))
        - np.interp(middle, *_sorted(x[~rising], y[~rising]))
    )
    end = float(np.abs(y).max())
    words = [f"loop of {in_unit(float(np.ptp(y)), units[1])} over {in_unit(2.0 * half, units[0])}"]
    if end > 0.0 and height < 0.7 * float(np.ptp(y)):
        words.append("narrow in the middle" if height < 0.4 * np.ptp(y) else "rising to its ends")
    strong, weak = float(np.abs(outwards).max()), float(np.abs(inwards).max())
    if weak > 0.0 and abs(strong / weak - 1.0) > 0.05:
        words.append(
            f"{abs(strong / weak - 1.0):.0%} {'stronger' if strong > weak else 'weaker'} outwards"
        )
    return ", ".join(words)


def _sorted(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    order = np.argsort(x)
    return x[order], y[order]


def _memory_words(x: FloatArray, y: FloatArray, units: tuple[str, str]) -> str:
    start = float(y[0])
    if start <= 0.0:
        return "no relaxation"
    below = np.flatnonzero(y < 0.5 * start)
    half = f"after {float(x[below[0]]):.3g} s" if below.size else f"later than {float(x[-1]):.3g} s"
    return f"relaxes from {in_unit(start, units[1])}, half of it {half}"


def _coupled_words(x: FloatArray, y: FloatArray, units: tuple[str, str]) -> str:
    ends = 0.5 * float(y[0] + y[-1])
    middle = float(np.interp(0.5 * (x[0] + x[-1]), x, y))
    sense = "larger far from the middle" if ends > middle else "larger in the middle"
    return f"{sense}, by {in_unit(float(np.ptp(y)), units[1])}"


#: The parameter of a measured law: one where the shape is as measured.
SIZE = EffectParameter("size", "1", 0.0, np.inf, scale=1.0)
_MOST_LETTERS = 40
#: How a law goes on that does not with the slope of its end.
_CONTINUED = {
    COUPLED_DAMPING: "its end value",
    HYSTERESIS: "stops that slip as at its end",
    MEMORY: "branches that stay linear",
    FORCE_SURFACE: "the slopes of its edge",
}


def law_of_class(
    answer: ClassAnswer,
    campaign: str,
    names: Mapping[str, str],
    wanted: str | None,
    refusal: Callable[[str, ClassFinding], str],
) -> Law:
    """Measured shape of a class of an answer, named after class and campaign.

    `names` are the classes that a law file holds and what the file calls them; `wanted` is one as
    the file calls it, default: that of the largest share. `refusal` gives why a class has no law
    although its shape was measured; empty where it has one.

    Raises
    ------
    ValueError
        Where no class is named or leading, the answer has not the wanted one, or it has no law.
    """
    if answer.state not in (NAMED_CLASS, LEADING_CLASS) or not answer.classes:
        raise ValueError(f"no law to save: the answer by class is '{answer.state}'")
    known = {names.get(finding.id, finding.id): finding for finding in answer.classes}
    name = wanted or max(known, key=lambda one: known[one].share)
    if name not in known:
        listed = ", ".join(known)
        raise ValueError(f"no law to save: '{name}' is not in the answer; expected {listed}")
    if name not in names.values():
        raise ValueError(
            f"no law to save: the class '{name}' cannot be saved as a law; expected one of "
            f"{', '.join(dict.fromkeys(names.values()))}"
        )
    finding = known[name]
    reason = refusal(name, finding)
    if not reason and finding.measured_law is None:
        reason = (
            f"'{name}' was named by its law {finding.law}, not by its shape; add that law to the "
            "model, its parameters are in diagnosis.json"
            if finding.law_named
            else f"the shape of '{name}' was not supported by the records in the simulator"
        )
    if reason or finding.measured_law is None:
        raise ValueError(f"no law to save: {reason}")
    return replace(finding.measured_law, name=_law_name(name, campaign), measured_on=campaign)


def _law_name(effect_class: str, campaign: str) -> str:
    """Id of a law: small letters, digits and underscores."""
    slug = re.sub(r"[^a-z0-9]+", "_", campaign.lower()).strip("_")[:_MOST_LETTERS]
    return f"{effect_class.replace('/', '_')}_of_{slug or 'campaign'}"


def visited_range_warning(
    law: Law,
    *,
    share: float,
    reached: FloatArray,
    table: FloatArray,
    unit: str,
    run: str,
) -> CampaignWarning:
    """Warning of what a law does beyond its table.

    `share` of the samples lie outside; `reached` and `table` in `unit`; `run` is farthest outside.
    """
    text = (
        f"{share:.2%} of the samples lie outside the range in which the law was measured: records "
        f"reach from {in_unit(reached.min(), unit)} to {in_unit(reached.max(), unit)}, its table "
        f"from {in_unit(table[0], unit)} to {in_unit(table[-1], unit)}"
    )
    continued = _CONTINUED.get(law.effect_class, "the slope of its end")
    remedy = f"beyond its table the law is extrapolated with {continued}; measure it at this size"
    return CampaignWarning("visited_range", law.name, text, remedy, share, f"run {run}")
