"""How an answer is judged where the carrier itself may be off its drawing.

A cause of the model is named as the class ``model/carrier`` or ``model/pins`` or by an effect
``geometry/<dimension>`` or ``material/<constant>``; dimensions that cannot be told apart stand
among the aliases.

right
    The truth's classes of the model are named, or none where the carrier is as drawn, and no law
    beside them that is not acting. Where several causes act, a class whose values leave less than
    two floors by themselves need not be named if another leaves more. A value whose gap a pin fit
    of the drawing takes is counted apart by :func:`gap_beyond_drawing`.
"""

from collections.abc import Sequence

from carrierflex.blind_check.labels import Label
from carrierflex.blind_check.sealing.verdicts import Verdict
from carrierflex.blind_check.truth.carrier.off_drawing import BEYOND, class_of_value

#: Gap over the floor from which a carrier off its drawing is counted.
MODEL_GAP = 2.0
_CLASS_OF_MODEL = "model/"
_OF_MODEL = ("geometry/", "material/")


def is_of_model(effect: str) -> bool:
    """Whether an effect is a dimension or a constant of the model."""
    return effect.startswith(_OF_MODEL)


def gap_beyond_drawing(label: Label) -> float:
    """Gap over the floor that no pin fit of the drawing takes."""
    return float(label.where[BEYOND])


def model_classes(verdict: Verdict, named: Sequence[str]) -> frozenset[str]:
    """Classes of the model that an answer names, by themselves or by their effects."""
    classes = {str(entry["id"]) for entry in verdict.document.get("classes") or ()}
    of_model = {name for name in classes if name.startswith(_CLASS_OF_MODEL)}
    return frozenset(of_model | _classes_of(named))


def _classes_of(effects: Sequence[str]) -> frozenset[str]:
    """Classes of the dimensions and constants among some effects."""
    return frozenset(
        class_of_value(name.partition("/")[2]) for name in effects if is_of_model(name)
    )


def false_laws(label: Label, named: Sequence[str], aliases: Sequence[Sequence[str]]) -> list[str]:
    """Named laws beside the model that do not act, nor anything among their aliases."""
    acting = {*label.effects, *label.present}
    for members in (*label.acceptable, *aliases):
        if not acting.isdisjoint(members):
            acting |= set(members)
    return [name for name in named if not is_of_model(name) and name not in acting]


def false_values(label: Label, named: Sequence[str], aliases: Sequence[Sequence[str]]) -> list[str]:
    """Named dimensions and constants that are as drawn, and no alias of one that is not."""
    alike = {name: {name} for name in named if is_of_model(name)}
    for members in aliases:
        for name in set(members) & set(alike):
            alike[name] |= set(members)
    return [name for name, members in alike.items() if members.isdisjoint(label.effects)]


def is_right(label: Label, verdict: Verdict, named: Sequence[str]) -> bool:
    """Whether an answer to a case of the family is right."""
    aliases = verdict.document.get("aliases") or ()
    is_of_truth = _visible_classes(label) <= model_classes(verdict, named) <= {*label.classes}
    return is_of_truth and not false_laws(label, named, aliases)


def _visible_classes(label: Label) -> frozenset[str]:
    """Classes of the truth that an answer must name."""
    gaps = label.own_gaps or (label.gap_over_floor,) * len(label.effects)
    visible = [effect for effect, gap in zip(label.effects, gaps, strict=True) if gap >= MODEL_GAP]
    return _classes_of(visible) if visible else frozenset(label.classes)
