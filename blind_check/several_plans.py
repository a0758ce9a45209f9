"""Plans of several small causes at once: three to five, each of another class and of its own size.

Sizes are drawn independently, each with a uniform logarithm: from a cause that nobody could find by
itself to one of ten floors, where a single cause is still called small. Four of ten leave less than
two floors. None is set beside another: what is large and what is small among them is chance.
"""

from collections.abc import Mapping

import numpy as np

from carrierflex.blind_check.truth.carrier.other_forms import OTHER_FORMS
from carrierflex.blind_check.truth.mounting.other_forms import MOUNTING_FORMS, STATIC_MAPS

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


def several_causes(
    kind: str, count: int, rng: np.random.Generator
) -> list[tuple[tuple[str, ...], tuple[float, ...]]]:
    """Causes of every case of the family, and the gap over the floor that each leaves alone.

    Every cause comes in turn; those beside it are of other classes, the classes as often as one
    another.

    Parameters
    ----------
    kind : str
        Kind of campaign.
    count : int
        Number of cases.
    rng : Generator
        Random numbers.
    """
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
    is_told = _ALIKE[kind].isdisjoint(causes)
    free = [
        name
        for name, own in classes.items()
        if own not in taken and (is_told or name not in _ALIKE[kind])
    ]
    chosen = rng.choice(sorted({classes[name] for name in free}))
    return str(rng.choice([name for name in free if classes[name] == chosen]))
