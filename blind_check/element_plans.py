"""Which cases a check of kind "element" holds: strata of drives, classes in turn, pairs.

A stratum is one kind of drive, or nothing missing, or a cause outside every class under any drive.
"""

from collections.abc import Sequence

import numpy as np

from carrierflex.blind_check.labels import NOTHING, OUTSIDE, PAIR, SINGLE, CasePlan
from carrierflex.blind_check.truth.element.drives import (
    DECAY,
    MULTISINE,
    NOISE,
    ONE_SINE,
    SINES,
    SWEEPS,
)
from carrierflex.blind_check.truth.element.families import (
    CAUSES,
    INSIDE_CAUSES,
    OUTSIDE_CAUSES,
    class_sets,
)

#: Cases by stratum in a full check. A quarter of those with a cause lie below two floors, where no
#: class has to be found, so that 200 of the two strata with a target lie above.
_STRATA: dict[str, tuple[int, tuple[str, ...]]] = {
    "wide_band": (272, (MULTISINE, NOISE)),
    "levels": (272, (SWEEPS, SINES)),
    "single_level": (60, (ONE_SINE,)),
    NOTHING: (200, (MULTISINE, NOISE, SWEEPS, SINES)),
    OUTSIDE: (200, (MULTISINE, NOISE, SWEEPS, SINES)),
}
DRIVEN_SIZE = sum(count for count, _ in _STRATA.values())
#: Free decays of a full check beside them. Of six two hold nothing or a cause outside every class.
_DECAYS, _DECAY_CYCLE = 60, 6
FULL_SIZE = DRIVEN_SIZE + _DECAYS
#: Gap over floor, drawn with a uniform logarithm.
SMALLEST_RATIO, LARGEST_RATIO = 0.7, 50.0
#: Every fourth round of the drives holds two causes, so that pairs meet every drive.
_PAIR_EVERY = 4


def element_plans(counts: dict[str, int], seed: int, rng: np.random.Generator) -> list[CasePlan]:
    """Plans of a check of kind "element".

    Parameters
    ----------
    counts : dict of str to int
        Cases by stratum, from :func:`strata_weights`.
    seed : int
        Seed of the check.
    rng : Generator
        Random numbers.

    Returns
    -------
    list of CasePlan
        In an order that says nothing about the content.
    """
    drawn: list[tuple[str, tuple[str, ...], float, str]] = []
    for stratum, count in counts.items():
        names = _STRATA[stratum][1]
        drives = _in_turn(rng, names, count)
        for k, (drive, ratio) in enumerate(zip(drives, _ratios(rng, count), strict=True)):
            family, effects = _content(stratum, drive, k // len(names), rng)
            drawn.append((family, effects, 0.0 if family == NOTHING else ratio, drive))
    order = rng.permutation(len(drawn))
    return [CasePlan("element", n + 1, seed, *drawn[k]) for n, k in enumerate(order)]


def decay_plans(
    cases: int, seed: int, rng: np.random.Generator, *, first: int = 1
) -> list[CasePlan]:
    """Plans of free decays, a stratum of their own.

    Parameters
    ----------
    cases : int
        Number of cases.
    seed : int
        Seed of the check.
    rng : Generator
        Random numbers.
    first : int
        Number of the first case.

    Returns
    -------
    list of CasePlan
        In an order that says nothing about the content.
    """
    strata = {0: NOTHING, 1: OUTSIDE}
    drawn: list[tuple[str, tuple[str, ...], float, str]] = []
    for k, ratio in enumerate(_ratios(rng, cases)):
        turn, index = divmod(k, _DECAY_CYCLE)
        family, effects = _content(
            strata.get(index, DECAY), DECAY, turn if index < len(strata) else index, rng
        )
        drawn.append((family, effects, 0.0 if family == NOTHING else ratio, DECAY))
    order = rng.permutation(cases)
    return [CasePlan("element", first + n, seed, *drawn[k]) for n, k in enumerate(order)]


def strata_weights() -> dict[str, int]:
    """Cases by stratum in a full check."""
    return {stratum: count for stratum, (count, _) in _STRATA.items()}


def _ratios(rng: np.random.Generator, count: int) -> list[float]:
    """Even strata of the logarithm, in a random order: a small check covers the range too."""
    fraction = (rng.permutation(count) + rng.uniform(size=count)) / max(count, 1)
    return [float(r) for r in SMALLEST_RATIO * (LARGEST_RATIO / SMALLEST_RATIO) ** fraction]


def _in_turn(rng: np.random.Generator, names: Sequence[str], count: int) -> list[str]:
    start = int(rng.integers(len(names)))
    return [names[(start + k) % len(names)] for k in range(count)]


def _content(
    stratum: str, drive: str, turn: int, rng: np.random.Generator
) -> tuple[str, tuple[str, ...]]:
    """Family and causes of a case of a stratum, in a round of its drives."""
    if stratum == NOTHING:
        return NOTHING, ()
    if stratum == OUTSIDE:
        return OUTSIDE, (OUTSIDE_CAUSES[turn % len(OUTSIDE_CAUSES)],)
    first = _drawn_cause(drive, rng)
    if turn % _PAIR_EVERY:
        return SINGLE, (first,)
    while True:
        second = _drawn_cause(drive, rng)
        # Both of one class alone, so that a pair of causes is a pair of classes.
        classes = CAUSES[first].classes + CAUSES[second].classes
        is_pair = len(class_sets((first, second))[0]) == 2
        if is_pair and len(classes) == len(set(classes)) == 2:
            return PAIR, tuple(sorted((first, second)))
        first = _drawn_cause(drive, rng)


def _drawn_cause(drive: str, rng: np.random.Generator) -> str:
    """A class that the drive shows, then a cause in it."""
    visible = [name for name in INSIDE_CAUSES if drive in _drives_of(name)]
    classes = sorted({CAUSES[name].classes for name in visible})
    weights = np.array([_weight(ids, visible) for ids in classes])
    ids = classes[int(rng.choice(len(classes), p=weights / weights.sum()))]
    return str(rng.choice([name for name in visible if CAUSES[name].classes == ids]))


def _drives_of(name: str) -> tuple[str, ...]:
    drives = CAUSES[name].drives
    # One level shows what several levels at one frequency show.
    return (*drives, ONE_SINE) if SINES in drives else drives


def _weight(ids: tuple[str, ...], visible: Sequence[str]) -> float:
    """Classes with many causes come up oftener, by the root of their number."""
    return float(sum(CAUSES[name].classes == ids for name in visible)) ** 0.5
