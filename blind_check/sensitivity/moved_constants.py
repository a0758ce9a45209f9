"""Answers by class of one campaign with every constant moved, one at a time.

Measured shapes are left out: no answer that is compared here holds them.
"""

import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

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


def answers_of_case(plan: CasePlan) -> Mapping[str, Any]:
    """Answer of one case as it is, and every answer that a moved constant changes.

    Parameters
    ----------
    plan : CasePlan
        Case of kind element.

    Returns
    -------
    mapping
        ``answer``, and ``changed``: the other answer by "module.name" and factor.
    """
    campaign, _ = case_campaign(plan)
    return changed_answers(campaign, listed_constants())


def changed_answers(campaign: Campaign, constants: Sequence[Constant]) -> Mapping[str, Any]:
    """Answer of a campaign, and the other answers of moved constants.

    Parameters
    ----------
    campaign : Campaign
        Campaign of kind element.
    constants : sequence of Constant
        Each is moved by every factor.

    Returns
    -------
    mapping
        As :func:`answers_of_case`.
    """
    usual = usual_case(campaign)
    changed = {}
    for constant in constants:
        for factor in FACTORS:
            with moved(constant, factor):
                other = usual.answer_beside(constant)
            if other != usual.answer:
                changed[f"{constant.module}.{constant.name} x{factor}"] = other
    return {"answer": usual.answer, "changed": changed}


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
