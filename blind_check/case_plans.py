"""Which cases a check holds.

Families in fixed shares, effects in turn, gaps from half to thirty times the floor.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from carrierflex.blind_check.element_plans import (
    DRIVEN_SIZE,
    FULL_SIZE,
    decay_plans,
    element_plans,
    strata_weights,
)
from carrierflex.blind_check.labels import (
    ALIASED,
    DECAYS,
    FAMILIES,
    FORM,
    KINDS,
    MODEL,
    NOTHING,
    ONE_CONDITION,
    OUTSIDE,
    PAIR,
    SEVERAL,
    SINGLE,
    STAGE,
    CasePlan,
)
from carrierflex.blind_check.truth.alias_table import (
    CONSTANT_LOAD,
    ONE_CONDITION_EFFECTS,
    OUTSIDE_NAMES,
    SINGLES,
    STAGE_EFFECTS,
    same_class,
)
from carrierflex.blind_check.truth.carrier.off_drawing import OFF_DRAWING
from carrierflex.blind_check.truth.carrier.off_drawing import OTHERS as BESIDE_OFF_DRAWING
from carrierflex.blind_check.truth.carrier.other_forms import OTHER_FORMS
from carrierflex.blind_check.truth.mounting.other_forms import MOUNTING_FORMS, STATIC_MAPS

#: Shares of the families in a check; a full one holds twelve cases of each single effect, 24 pairs,
#: 24 with nothing missing, 24 outside the library, 12 aliased, 12 of one condition, 26 of a stage.
_WEIGHTS = {PAIR: 24, NOTHING: 24, OUTSIDE: 24, ALIASED: 12, ONE_CONDITION: 12, STAGE: 26}
_PER_EFFECT = 12
#: Causes of another form: of six cases one holds nothing and one two causes.
_FORMS, _FORM_CYCLE = 200, 6
#: Several causes at once.
_SEVERAL = 200
#: Carriers off their drawing: of ten cases seven, one of them with another cause; one has another
#: cause alone, two are as drawn.
_MODELS = 280
_MODEL_CYCLE = (*[(True, False)] * 6, (True, True), (False, True), *[(False, False)] * 2)
_SHAPES_OF_FORMS = {
    "carrier": {name: form.shape for name, form in OTHER_FORMS.items()},
    "mounting": {name: form.shape for name, form in MOUNTING_FORMS.items()},
}
#: Gap over floor, drawn with a uniform logarithm.
SMALLEST_RATIO, LARGEST_RATIO = 0.5, 30.0
_STREAM = {kind: number for number, kind in enumerate(KINDS)}


#: Numbers of causes in turn.
_NUMBERS = (3, 4, 5)
#: Gap of one cause alone over the floor.
SMALLEST_OWN, LARGEST_OWN = 0.7, 10.0
_CLASSES: Mapping[str, Mapping[str, str]] = {
    "carrier": {name: form.shape for name, form in OTHER_FORMS.items()},
    "mounting": {name: form.class_id for name, form in MOUNTING_FORMS.items()},
}
#: Causes of other classes that these records do not tell apart by the truth's own equations; one of
#: each set at most is in a case. Waves of as many lobes as planets are a tilt at the planets' order
#: to four sensors a quarter turn apart, and so are planets that pass; slow loads leave the same
#: signals of every static map.
_ALIKE: Mapping[str, frozenset[str]] = {
    "carrier": frozenset({"bounded_lobes", "stiffening_lobes", "torque_power_pass", "steady_pass"}),
    "mounting": frozenset(
        name for name, form in MOUNTING_FORMS.items() if form.class_id in STATIC_MAPS
    ),
}


def full_size(kind: str) -> int:
    """Cases of a full check of one kind."""
    if kind == "element":
        return FULL_SIZE
    weights = _weights(kind)
    return sum(weights[name] for name in FAMILIES if name in weights) if kind != "mounting" else 60


def case_plans(
    kind: str, cases: int, seed: int, families: Sequence[str] = FAMILIES
) -> tuple[CasePlan, ...]:
    """Plan of a check; the same arguments give the same plan.

    Parameters
    ----------
    kind : str
        Kind of campaign.
    cases : int
        Number of cases.
    seed : int
        Seed.
    families : sequence of str
        Families to draw from, of those that the kind has. Kind element draws from all, and a full
        check ends with its decays; where these are asked for it draws them alone.

    Returns
    -------
    tuple of CasePlan
        In an order that says nothing about the content.

    Raises
    ------
    ValueError
        Where the kind is unknown or has none of the families, or there is no case or no valid seed.
    """
    if kind not in KINDS:
        raise ValueError(f"kind is '{kind}'; expected one of {', '.join(KINDS)}")
    if cases < 1:
        raise ValueError(f"--cases is {cases}; expected 1 or more")
    if seed < 0:
        raise ValueError(f"--seed is {seed}; expected 0 or more")
    rng = np.random.default_rng([seed, _STREAM[kind], 0])
    if kind == "element":
        # Numbers of their own: cases of a seed that hold no decay stay what they are.
        of_decays = np.random.default_rng([seed, _STREAM[kind], 1])
        if DECAYS in families:
            return tuple(decay_plans(cases, seed, of_decays))
        driven = min(cases, DRIVEN_SIZE)
        plans = element_plans(_counts(strata_weights(), driven), seed, rng)
        return (*plans, *decay_plans(cases - driven, seed, of_decays, first=driven + 1))
    weights = {name: weight for name, weight in _weights(kind).items() if name in families}
    if not weights:
        raise ValueError(
            f"kind {kind} has no family {', '.join(families)}; it has {', '.join(_weights(kind))}"
        )
    drawn = []
    for family, count in _counts(weights, cases).items():
        make = _several_plans if family == SEVERAL else _plans_of_family
        drawn += make(kind, family, count, seed, rng)
    order = rng.permutation(len(drawn))
    return tuple(replace(drawn[k], number=index + 1) for index, k in enumerate(order))


def _plans_of_family(
    kind: str, family: str, count: int, seed: int, rng: np.random.Generator
) -> list[CasePlan]:
    """Plans without their numbers, of one gap each."""
    drawn = []
    for k, effects in enumerate(_effects(kind, family, count, rng)):
        # Even strata of the logarithm: a small check covers the range too.
        fraction = (k + rng.uniform()) / count
        ratio = SMALLEST_RATIO * (LARGEST_RATIO / SMALLEST_RATIO) ** fraction
        drawn.append(CasePlan(kind, 0, seed, family, effects, float(ratio) if effects else 0.0))
    return drawn


def _several_plans(
    kind: str, family: str, count: int, seed: int, rng: np.random.Generator
) -> list[CasePlan]:
    """Plans without their numbers, of several causes with a gap of its own each."""
    return [
        CasePlan(kind, 0, seed, family, causes, math.hypot(*ratios), own_ratios=ratios)
        for causes, ratios in _several_causes(kind, count, rng)
    ]


#: Whether the campaigns of a check declare the noise of their channels: all, none, every other one.
DECLARED = "declared"
UNDECLARED = "undeclared"
HALF = "half"


def with_noise_declared(plans: Sequence[CasePlan], noise: str) -> tuple[CasePlan, ...]:
    """Plans whose campaigns declare the noise of their channels, or do not.

    Parameters
    ----------
    plans : sequence of CasePlan
        Plans of one kind, in an order that says nothing about the content.
    noise : str
        :data:`DECLARED`, :data:`UNDECLARED` or :data:`HALF`.

    Returns
    -------
    tuple of CasePlan
        The same causes and gaps.

    Raises
    ------
    ValueError
        Where a campaign that shall not declare its noise is of an element.
    """
    if noise == DECLARED:
        return tuple(plans)
    if any(plan.kind == "element" for plan in plans):
        raise ValueError(
            f"--noise is '{noise}' with kind element; expected kind carrier or mounting"
        )
    return tuple(
        replace(plan, declares_noise=noise == HALF and plan.number % 2 == 1) for plan in plans
    )


def _weights(kind: str) -> dict[str, int]:
    weights = {SINGLE: _PER_EFFECT * len(SINGLES[kind]), **_WEIGHTS}
    # Sets of loads at which the effects of the mounting cannot be told apart are no case of their
    # own yet.
    absent = (ALIASED, STAGE) if kind == "mounting" else ()
    drawn = {family: weights[family] for family in FAMILIES if family not in absent}
    of_carrier = {MODEL: _MODELS} if kind == "carrier" else {}
    return {**drawn, FORM: _FORMS, SEVERAL: _SEVERAL, **of_carrier}


def _counts(weights: Mapping[str, int], cases: int) -> dict[str, int]:
    """Cases by family in proportion to the weights, the largest remainders rounded up."""
    total = sum(weights.values())
    exact = {family: cases * weight / total for family, weight in weights.items()}
    counts = {family: math.floor(share) for family, share in exact.items()}
    missing = sorted(exact, key=lambda family: counts[family] - exact[family])[
        : cases - sum(counts.values())
    ]
    counts.update({family: counts[family] + 1 for family in missing})
    return {family: count for family, count in counts.items() if count}


def _effects(kind: str, family: str, count: int, rng: np.random.Generator) -> list[tuple[str, ...]]:
    """Effects of every case of a family."""
    if family == NOTHING:
        return [()] * count
    if family == PAIR:
        return [_pair(kind, rng) for _ in range(count)]
    if family == FORM:
        return _forms(_SHAPES_OF_FORMS[kind], count, rng)
    if family == MODEL:
        return _models(count, rng)
    if family == STAGE:
        first = int(rng.integers(len(STAGE_EFFECTS)))
        turned = [STAGE_EFFECTS[(first + k) % len(STAGE_EFFECTS)] for k in range(count)]
        return [turned[k] for k in rng.permutation(count)]
    names = {
        SINGLE: SINGLES[kind],
        OUTSIDE: OUTSIDE_NAMES[kind],
        ALIASED: CONSTANT_LOAD[kind],
        ONE_CONDITION: ONE_CONDITION_EFFECTS[kind],
    }[family]
    start = int(rng.integers(len(names)))
    turns = [names[(start + k) % len(names)] for k in range(count)]
    return [(turns[k],) for k in rng.permutation(count)]


def _forms(
    shapes: Mapping[str, str], count: int, rng: np.random.Generator
) -> list[tuple[str, ...]]:
    """Causes of another form in turn, alone, in pairs of two classes, and none."""
    names = tuple(shapes)
    start = int(rng.integers(len(names)))
    drawn: list[tuple[str, ...]] = []
    for k in range(count):
        first = names[(start + k) % len(names)]
        others = [name for name in names if shapes[name] != shapes[first]]
        pair = (first, str(rng.choice(others)))
        drawn.append({0: (), 1: tuple(sorted(pair))}.get(k % _FORM_CYCLE, (first,)))
    return [drawn[k] for k in rng.permutation(count)]


def _models(count: int, rng: np.random.Generator) -> list[tuple[str, ...]]:
    """Carriers off their drawing or not, another cause or none."""
    drawn = []
    for k in range(count):
        is_off, has_other = _MODEL_CYCLE[k % len(_MODEL_CYCLE)]
        others = (str(rng.choice(BESIDE_OFF_DRAWING)),) if has_other else ()
        drawn.append(((OFF_DRAWING,) if is_off else ()) + others)
    return [drawn[k] for k in rng.permutation(count)]


def _pair(kind: str, rng: np.random.Generator) -> tuple[str, ...]:
    """Two effects that are not of one class."""
    while True:
        first, second = (str(name) for name in rng.choice(SINGLES[kind], 2, replace=False))
        if second not in same_class(kind, first):
            return tuple(sorted((first, second)))


def _several_causes(
    kind: str, count: int, rng: np.random.Generator
) -> list[tuple[tuple[str, ...], tuple[float, ...]]]:
    """Causes of every case of the family, and the gap over the floor that each leaves alone."""
    names = tuple(_CLASSES[kind])
    start = int(rng.integers(len(names)))
    drawn = []
    for k in range(count):
        causes = [names[(start + k) % len(names)]]
        while len(causes) < _NUMBERS[k % len(_NUMBERS)]:
            causes.append(_further(kind, causes, rng))
        exponents = rng.uniform(size=len(causes))
        ratios = SMALLEST_OWN * (LARGEST_OWN / SMALLEST_OWN) ** exponents
        drawn.append((tuple(sorted(causes)), tuple(float(ratio) for ratio in ratios)))
    return [drawn[k] for k in rng.permutation(count)]


def _further(kind: str, causes: list[str], rng: np.random.Generator) -> str:
    """A cause of another class than those so far, that the records can tell from them."""
    classes = _CLASSES[kind]
    taken = {classes[name] for name in causes}
    is_distinguishable = _ALIKE[kind].isdisjoint(causes)
    free = [
        name
        for name, class_id in classes.items()
        if class_id not in taken and (is_distinguishable or name not in _ALIKE[kind])
    ]
    chosen = rng.choice(sorted({classes[name] for name in free}))
    return str(rng.choice([name for name in free if classes[name] == chosen]))
