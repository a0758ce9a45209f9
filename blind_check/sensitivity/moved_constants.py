"""Answers by class of one campaign with every constant moved, one at a time.

Measured shapes are left out: no answer that is compared here holds them.
"""

import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from carrierflex.blind_check.labels import CasePlan
from carrierflex.blind_check.sensitivity.listed_constants import (
    Constant,
    listed_constants,
    replacement,
)
from carrierflex.blind_check.sensitivity.usual_case import usual_case
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.identification.campaign.campaign import Campaign

#: What every constant is multiplied by.
FACTORS = (0.8, 1.2)
#: Repeats of a case with other noise: how far a measurement that is repeated keeps its answer.
N_REPEATS = 2


def answers_of_case(plan: CasePlan, kept: Mapping[str, Any] | None = None) -> Mapping[str, Any]:
    """Answer of one case as it is, and every answer that a moved constant changes.

    Parameters
    ----------
    plan : CasePlan
        Case of kind element.
    kept : mapping, optional
        What an earlier call found for it.

    Returns
    -------
    mapping
        As :func:`changed_answers`, and ``repeated``: answers to the same truth under the same
        drive with other noise.
    """
    campaign, _ = case_campaign(plan)
    found = changed_answers(campaign, listed_constants(), kept)
    repeated = kept["repeated"] if kept and kept["answer"] == found["answer"] else ()
    if len(repeated) != N_REPEATS:
        repeated = _repeated_answers(plan)
    return {**found, "repeated": repeated}


def _repeated_answers(plan: CasePlan) -> list[str]:
    repeats = (case_campaign(plan, repeat=1 + number)[0] for number in range(N_REPEATS))
    return [usual_case(campaign).answer for campaign in repeats]


def changed_answers(
    campaign: Campaign, constants: Sequence[Constant], kept: Mapping[str, Any] | None = None
) -> Mapping[str, Any]:
    """Answer of a campaign, and the other answers of moved constants.

    Parameters
    ----------
    campaign : Campaign
        Campaign of kind element.
    constants : sequence of Constant
        Each is moved by every factor.
    kept : mapping, optional
        What an earlier call found: while the answer is what it was, constants that were moved from
        the same values are not moved again.

    Returns
    -------
    mapping
        ``answer``; ``moved``: values by "module.name"; ``changed``: the other answer by that and
        the factor.
    """
    usual = usual_case(campaign)
    values = values_of(constants)
    stands: Mapping[str, Any] = {}
    changed: dict[str, str] = {}
    if kept and kept["answer"] == usual.answer:
        stands = kept["moved"]
        changed = {key: words for key, words in kept["changed"].items() if _name_of(key) in values}
    for constant in constants:
        if stands.get(constant.path) == values[constant.path]:
            continue
        for factor in FACTORS:
            key = f"{constant.path} x{factor}"
            changed.pop(key, None)
            with moved(constant, factor):
                other = usual.answer_beside(constant)
            if other != usual.answer:
                changed[key] = other
    return {"answer": usual.answer, "moved": values, "changed": changed}


def values_of(constants: Sequence[Constant]) -> dict[str, Any]:
    """Values of constants by "module.name", as numbers and lists of them."""
    return {constant.path: np.asarray(constant.value).tolist() for constant in constants}


def _name_of(key: str) -> str:
    """Constant of a changed answer's key."""
    return key.rpartition(" ")[0]


@contextmanager
def moved(constant: Constant, factor: float) -> Iterator[None]:
    """Put a moved constant in the place of its own, in all modules that read it.

    Parameters
    ----------
    constant : Constant
        Which.
    factor : float
        What it is multiplied by.
    """
    name, value = replacement(constant, factor)
    own = sys.modules[f"carrierflex.{constant.module}"]
    usual = getattr(own, name)
    readers = [own]
    if not name.startswith("_"):
        readers += [
            module
            for path, module in list(sys.modules.items())
            if path.startswith("carrierflex.diagnosis") and vars(module).get(name) is usual
        ]
    try:
        for module in readers:
            setattr(module, name, value)
        yield
    finally:
        for module in readers:
            setattr(module, name, usual)
