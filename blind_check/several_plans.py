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
#: Causes of one word are never together. Slow loads do not tell one static map from another.
_APART: Mapping[str, Mapping[str, str]] = {
    "carrier": {name: form.shape for name, form in OTHER_FORMS.items()},
    "mounting": {
        name: "static map" if form.class_id in STATIC_MAPS else form.class_id
        for name, form in MOUNTING_FORMS.items()
    },
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
    apart = _APART[kind]
    names = tuple(apart)
    start = int(rng.integers(len(names)))
    drawn = []
    for k in range(count):
        first = names[(start + k) % len(names)]
        words = sorted({*apart.values()} - {apart[first]})
        chosen = rng.choice(words, _NUMBERS[k % len(_NUMBERS)] - 1, replace=False)
        others = [str(rng.choice([n for n in names if apart[n] == word])) for word in chosen]
        causes = tuple(sorted((first, *others)))
        exponents = rng.uniform(size=len(causes))
        ratios = SMALLEST_OWN * (LARGEST_OWN / SMALLEST_OWN) ** exponents
        drawn.append((causes, tuple(float(ratio) for ratio in ratios)))
    return [drawn[k] for k in rng.permutation(count)]
