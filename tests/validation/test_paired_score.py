"""Scoring of two answers to one sealed case, against published and hand-made examples."""

from dataclasses import replace

import pytest

from carrierflex.blind_check.labels import Label
from carrierflex.blind_check.sealing.verdicts import Verdict
from validation.paired_score import paired_difference, scored_answer, textbook_laws, with_classes
from validation.tabulate_figures import _law_figures


def _label(kind: str, family: str, effects: tuple[str, ...], **more: object) -> Label:
    content: dict[str, object] = {
        "case": f"{kind}-0001",
        "acceptable": tuple((effect,) for effect in effects),
        "present": (),
        "gap_over_floor": 5.0,
        "floor": 1.0,
        "rho": 0.2,
        "parameters": {},
        "where": {},
    }
    return with_classes(Label(kind=kind, family=family, effects=effects, **{**content, **more}))  # type: ignore[arg-type]


def _answer(verdict: str, effects: list[str], classes: list[str], **more: object) -> Verdict:
    document = {
        "verdict": verdict,
        "effects": effects,
        "classes": [{"id": name, "law": None} for name in classes],
    }
    return Verdict({**document, **more}, 1.0)


def test_the_interval_of_a_paired_difference_is_newcombes() -> None:
    """Newcombe (1998), Statistics in Medicine 17, 2635: 36, 12, 2 and 0 of 50, method 10."""
    first = [True] * 48 + [False] * 2
    second = [True] * 36 + [False] * 12 + [True] * 2
    published = (0.20, 0.0569, 0.3404)
    assert paired_difference(first, second) == pytest.approx(published, abs=5e-5)
    assert paired_difference(second, first) == pytest.approx((-0.20, -0.3404, -0.0569), abs=5e-5)


def test_a_withheld_law_is_judged_by_its_class() -> None:
    label = _label("mounting", "single", ("cubic_stiffness",))
    assert label.classes == ("bushings/restoring_force",)
    right = scored_answer(label, _answer("class_named", [], ["bushings/restoring_force"]))
    assert right.is_class_right
    assert right.is_law_right is False
    wrong = scored_answer(label, _answer("named", ["fluid_branch"], ["bushings/memory"]))
    assert not wrong.is_class_right
    assert wrong.is_law_false


def test_a_law_in_a_tie_that_holds_it_is_right() -> None:
    label = _label("element", "single", ("cubic_spring",), classes=("restoring_force",))
    label = Label(**{**label.__dict__, "acceptable": (("cubic_stiffness",),)})
    assert textbook_laws(label) == ("cubic_stiffness",)
    answer = _answer(
        "aliased",
        ["quintic_stiffness"],
        ["restoring_force"],
        aliases=[["quintic_stiffness", "cubic_stiffness"]],
    )
    scored = scored_answer(label, answer)
    assert scored.is_law_right
    assert scored.has_law_tie


def test_laws_without_a_class_have_the_class_of_the_law() -> None:
    label = _label("element", "single", ("cubic_spring",), classes=("restoring_force",))
    scored = scored_answer(label, _answer("named", ["quintic_stiffness"], []))
    assert scored.is_class_right


def test_an_answer_to_nothing_missing_names_nothing() -> None:
    label = _label("carrier", "nothing", ())
    assert scored_answer(label, _answer("at_noise_floor", [], [])).is_class_right
    assert not scored_answer(
        label, _answer("class_named", [], ["housing/tilt/none"])
    ).is_class_right


def test_a_law_of_another_form_is_no_textbook_law() -> None:
    label = _label("element", "single", ("cubic_spring",), classes=("restoring_force",))
    label = replace(label, acceptable=(("cubic_stiffness",),))
    nearest = {"id": "restoring_force", "law": "cubic_stiffness"}
    answer = Verdict({"verdict": "class_named", "effects": [], "classes": [nearest]}, 1.0)
    bent = replace(label, case="bent", changes=(0.2,))
    labels = {label.case: label, bent.case: bent}
    figures = list(_law_figures(labels, dict.fromkeys(labels, answer)))
    cases = {figure.name: (figure.cases, figure.value) for figure in figures}
    assert cases["textbook laws: named rightly, alone or in a tie"] == (1, 0.0)
    assert cases["laws changed in form by 5 to 30 %: the law is named, or nearest"] == (1, 1.0)
