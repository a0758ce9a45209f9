"""Answers by class of one campaign with every constant moved, one at a time."""

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from carrierflex.blind_check.labels import CasePlan
from carrierflex.blind_check.sensitivity.listed_constants import (
    Constant,
    listed_constants,
    replacement,
)
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.diagnosis.classes.answer import WithClasses
from carrierflex.diagnosis.classes.results import ClassAnswer
from carrierflex.diagnosis.kinds import problem_of
from carrierflex.identification.campaign.campaign import Campaign

#: What every constant is multiplied by.
FACTORS = (0.8, 1.2)
#: Answer where the records are too short, or the diagnosis ends with an error.
NO_ANSWER = "no answer"


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
    usual = _answer(campaign)
    changed = {}
    for constant in listed_constants():
        for factor in FACTORS:
            with moved(constant, factor):
                other = _answer(campaign)
            if other != usual:
                changed[f"{constant.module}.{constant.name} x{factor}"] = other
    return {"answer": usual, "changed": changed}


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


def _answer(campaign: Campaign) -> str:
    """State, classes, ties and named laws in one line."""
    try:
        problem, _ = problem_of(campaign, None)
        assert isinstance(problem, WithClasses)
        answer = problem.class_answer()
    except (ValueError, ArithmeticError, AssertionError):
        return NO_ANSWER
    return _in_words(answer) if answer else NO_ANSWER


def _in_words(answer: ClassAnswer) -> str:
    sets = [tuple(sorted(finding.id for finding in answer.classes)), *map(tuple, answer.ties)]
    classes = " or ".join(" + ".join(ids) for ids in sorted(sets))
    laws = sorted(finding.law for finding in answer.classes if finding.law_named)
    return ": ".join(text for text in (answer.state, classes, ", ".join(laws)) if text)
