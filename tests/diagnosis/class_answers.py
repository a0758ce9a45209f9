"""Answers by class that were never computed."""

from collections.abc import Mapping

from carrierflex.diagnosis.classes.results import NAMED_CLASS, ClassAnswer, ClassFinding


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
