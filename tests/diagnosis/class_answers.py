"""Answers by class that were never computed."""

from collections.abc import Mapping
from dataclasses import replace

from carrierflex.diagnosis.classes.results import NAMED_CLASS, NO_CLASS, ClassAnswer, ClassFinding
from carrierflex.diagnosis.comparison.problem import Effects


def one_class(
    name: str,
    law: str,
    classes_of_law: Mapping[str, tuple[str, ...]],
    *,
    state: str = NAMED_CLASS,
    share: float = 0.99,
) -> ClassAnswer:
    """Answer of one class, whose law is named where it has one."""
    finding = ClassFinding(name, share, (share, share), law, share, bool(law))
    return ClassAnswer(
        state=state,
        classes=(finding,),
        ties=(),
        rivals={},
        share=share,
        share_ci95=(share, share),
        learnable=share,
        learnt_by=(),
        law_share=share,
        classes_of_law=classes_of_law,
    )


def no_class(*law_sets: Effects, experiment: str = "") -> ClassAnswer:
    """Answer without a class, of a table that proposes sets of laws."""
    answer = one_class("spring", "", {}, state=NO_CLASS)
    return replace(answer, classes=(), law_sets=law_sets, experiment=experiment)
