"""The check from plans to page.

Order of seal, diagnosis and opening; interruption; a small fixed part of the real one.
"""

import json

import pytest

from carrierflex.blind_check.case_plans import case_plans
from carrierflex.blind_check.labels import NOTHING, SINGLE, CasePlan, Label
from carrierflex.blind_check.scoring.class_judging import FAILED, OUTCOMES
from carrierflex.blind_check.scoring.judging import judged_cases
from carrierflex.blind_check.scoring.scoring import score
from carrierflex.blind_check.sealing.check import LABELS_FILE, diagnosed, opened, sealed_check
from carrierflex.blind_check.sealing.verdicts import TIMES_FILE, read_verdict
from carrierflex.diagnosis.report.diagnosis_files import FORMAT, VERSION
from carrierflex.files.json_files import save_json
from carrierflex.workflows.diagnosis import run_blind_check
from carrierflex.workflows.diagnosis.diagnose_case import diagnose_case
from carrierflex.workflows.diagnosis.run_blind_check import main
from carrierflex.workflows.executors import SerialExecutor
from tests.workflows.checked_documents import checked_document, printed_again

PLANS = tuple(
    CasePlan(
        "mounting",
        k,
        3,
        SINGLE if k % 2 else NOTHING,
        ("backlash",) if k % 2 else (),
        10.0 * (k % 2),
    )
    for k in range(1, 7)
)


def write_tiny(plan, folder):
    """A truth whose campaign is one number: the missing force."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "force").write_text("1" if plan.effects else "0", encoding="utf-8")
    members = tuple((effect,) for effect in plan.effects)
    return Label(
        plan.name, plan.kind, plan.family, plan.effects, members, (), plan.ratio, 1.0, 0.1, {}, {}
    )


def diagnose_tiny(campaign, out):
    root = campaign.parents[1]
    assert (root / "seals.json").is_file()
    assert not (root / LABELS_FILE).exists()
    out.mkdir(parents=True)
    is_there = (campaign / "force").read_text(encoding="utf-8") == "1"
    document = {
        "format": FORMAT,
        "version": VERSION,
        "verdict": "named" if is_there else "at_noise_floor",
    }
    document |= {
        "effects": ["backlash"] if is_there else [],
        "aliases": [],
        "parameters": {},
        "where": [],
    }
    save_json(out / "diagnosis.json", document | {"how_far": {"rho": 0.1, "rho_ci95": [0.05, 0.2]}})
    save_json(out / TIMES_FILE, {"seconds": 1.0, "error": None})


def untold(text, share):
    """Progress that nobody hears of."""


def sealed_tiny(out, plans=PLANS, write=write_tiny, check=None):
    return sealed_check(
        plans,
        out,
        write,
        SerialExecutor(),
        check=check or {"seed": 3},
        note=untold,
    )


def diagnosed_tiny(sealed, diagnose=diagnose_tiny, *, keep=True):
    return diagnosed(sealed, diagnose, SerialExecutor(), keep=keep, note=untold)


def test_cases_are_sealed_diagnosed_and_opened_in_this_order(tmp_path):
    sealed = sealed_tiny(tmp_path)
    verdicts = diagnosed_tiny(sealed)
    result = score(judged_cases(opened(sealed), verdicts))
    assert [(row.name, row.cases, row.right) for row in result.confusion] == [
        ("backlash", 3, 3),
        (NOTHING, 3, 3),
    ]
    assert (
        json.loads((tmp_path / LABELS_FILE).read_text(encoding="utf-8"))["mounting-0001"]["label"][
            "family"
        ]
        == SINGLE
    )


def test_labels_stay_shut_until_the_last_verdict(tmp_path):
    with pytest.raises(ValueError, match=r"6 cases have no verdict \(first: mounting-0001\)"):
        opened(sealed_tiny(tmp_path))
    assert not (tmp_path / LABELS_FILE).exists()


def test_an_interrupted_check_goes_on_and_keeps_what_is_finished(tmp_path):
    calls = []

    def interrupted(campaign, out):
        calls.append(campaign.name)
        if len(calls) == 4:
            raise KeyboardInterrupt
        diagnose_tiny(campaign, out)

    first = sealed_tiny(tmp_path)
    with pytest.raises(KeyboardInterrupt):
        diagnosed_tiny(first, interrupted)
    again = sealed_tiny(tmp_path)
    assert again.published == first.published
    assert len(diagnosed_tiny(again, interrupted)) == 6
    assert calls[4:] == ["mounting-0004", "mounting-0005", "mounting-0006"]
    assert opened(again)


def test_a_folder_of_another_check_is_refused(tmp_path):
    sealed_tiny(tmp_path)
    with pytest.raises(ValueError, match=r"holds a check of .*expected another --out"):
        sealed_tiny(tmp_path, check={"seed": 4})


def test_a_truth_that_has_changed_since_the_seal_is_refused(tmp_path):
    from dataclasses import replace

    sealed_tiny(tmp_path)
    with pytest.raises(ValueError, match="6 labels are not the sealed ones"):
        sealed_tiny(tmp_path, write=lambda plan, folder: replace(write_tiny(plan, folder), rho=0.2))


def test_seals_changed_during_the_check_are_refused(tmp_path):
    sealed = sealed_tiny(tmp_path)
    diagnosed_tiny(sealed)
    (tmp_path / "seals.json").unlink()
    (tmp_path / "salts.json").unlink()
    sealed_tiny(tmp_path)
    with pytest.raises(ValueError, match="changed during the check"):
        opened(sealed)


def test_no_case_is_diagnosed_once_the_labels_are_open(tmp_path):
    sealed = sealed_tiny(tmp_path)
    diagnosed_tiny(sealed)
    opened(sealed)
    (tmp_path / "diagnoses" / "mounting-0002" / TIMES_FILE).unlink()
    with pytest.raises(ValueError, match="labels are opened and mounting-0002 has no verdict"):
        sealed_tiny(tmp_path)


def test_campaigns_go_where_they_are_not_kept(tmp_path):
    diagnosed_tiny(sealed_tiny(tmp_path), keep=False)
    assert not (tmp_path / "campaigns").exists()
    assert (tmp_path / "diagnoses" / "mounting-0001" / "diagnosis.json").is_file()


def test_a_refused_campaign_is_a_wrong_answer_and_ends_no_check(tmp_path):
    diagnose_case(tmp_path / "nowhere", tmp_path / "out")
    answer = read_verdict(tmp_path / "out")
    assert answer.document["verdict"] == "error"
    assert "ValueError" in answer.document["reason"]


@pytest.mark.long
def test_fixed_part_of_the_check_names_no_wrong_class(tmp_path):
    result = main(kind=("carrier",), cases=3, seed=11, out=tmp_path, keep=False, quiet=True)
    figures = {figure.name: figure for figure in result.score.figures}
    # Three cases: one wrong among the clear ones passes, as nine of ten are wanted of many.
    clear = figures["class right, gap >= 5 floors"]
    assert clear.cases >= 1
    assert round((1.0 - clear.value) * clear.cases) <= 1
    assert (
        figures['false naming, "nothing"'].value == 0.0
        or figures['false naming, "nothing"'].cases == 0
    )
    document = checked_document(tmp_path / "blind_check.json")
    assert len(document["cases"]) == 3
    for name in ("seals", "salts", "labels"):
        assert checked_document(tmp_path / f"{name}.json")
    for path in tmp_path.rglob("times.json"):
        assert checked_document(path)["error"] is None
    assert not [case for case in document["cases"] if case["verdict"] == "error"]
    assert not list(tmp_path.rglob("report.html"))


@pytest.mark.long
def test_elements_are_judged_by_class_from_plan_to_page(tmp_path, command, monkeypatch):
    options = {"keep": False, "quiet": True}
    result = main(kind=("element",), cases=2, seed=11, out=tmp_path, **options)
    assert result.score is None
    document = checked_document(tmp_path / "blind_check.json")
    assert {case["outcome"] for case in document["cases"]} <= set(OUTCOMES) - {FAILED}
    assert "### Figures by class" in (tmp_path / "blind_check.md").read_text(encoding="utf-8")
    printed_again(
        "blind-check --kind element --cases 2 --no-keep", result, tmp_path / "blind_check.json",
        module=run_blind_check, command=command, monkeypatch=monkeypatch,
    )  # fmt: skip


@pytest.mark.long
def test_an_exported_check_tells_nothing_and_scores_what_others_answer(tmp_path):
    check, entry = tmp_path / "check", tmp_path / "entry"
    options = {"kind": ("mounting",), "cases": 3, "seed": 12, "quiet": True}
    made = main(out=check, sealed_campaigns=entry, **options)
    assert made.cases == 3
    names = sorted(path.name for path in (entry / "campaigns").iterdir())
    assert names == ["mounting-0001", "mounting-0002", "mounting-0003"]
    assert not (check / "campaigns").exists()
    public = "".join(p.read_text("utf-8") for p in entry.glob("*.*"))
    assert "seed" not in public
    assert "salt" in public  # the page says what the seals are made of
    truth = {plan.name: plan.effects for plan in case_plans("mounting", 3, 12)}
    assert not any(effect in public for effects in truth.values() for effect in effects)
    answers = tmp_path / "other.json"
    content = {"format": "carrierflex-answers", "version": 1, "tool": "other"}
    right = {name: {"effects": list(effects)} for name, effects in truth.items()}
    outside = [
        plan.name for plan in case_plans("mounting", 3, 12) if plan.family in ("outside", NOTHING)
    ]
    right |= {name: {} for name in outside}
    answers.write_text(json.dumps(content | {"cases": right}), encoding="utf-8")
    main(out=check, score=answers)
    document = json.loads((check / "scores" / "other" / "blind_check.json").read_text("utf-8"))
    assert document["digest"] == made.digest
    assert all(case["right"] for case in document["cases"])
    wrong = {name: {"effects": ["no_such_law"]} for name in truth}
    answers.write_text(json.dumps(content | {"cases": wrong}), encoding="utf-8")
    main(out=check, score=answers)
    document = json.loads((check / "scores" / "other" / "blind_check.json").read_text("utf-8"))
    assert not any(case["right"] for case in document["cases"])
    main(out=check, score=answers.rename(tmp_path / "...json"))
    assert (check / "scores" / "answers" / "blind_check.json").exists()
    assert not (check / "blind_check.md").exists()
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("keep", encoding="utf-8")
    with pytest.raises(ValueError, match="holds other files; expected a new or empty folder"):
        main(out=check, sealed_campaigns=tmp_path / "mine", **options)
    assert (tmp_path / "mine" / "notes.txt").read_text(encoding="utf-8") == "keep"


@pytest.mark.long
def test_carriers_of_other_forms_are_judged_by_class_beside_plain_methods(tmp_path):
    options = {"kind": ("carrier",), "family": ("form",), "cases": 2, "seed": 11}
    options |= {"keep": False, "quiet": True, "references": True}
    result = main(out=tmp_path, **options)
    assert result.score is None
    document = json.loads((tmp_path / "blind_check.json").read_text(encoding="utf-8"))
    assert {case["outcome"] for case in document["cases"]} <= set(OUTCOMES) - {FAILED}
    for reference in result.reference_checks.values():
        errors = [
            row.value for row in reference.class_score.figures if row.name.endswith(": error")
        ]
        assert not any(share > 0.0 for share in errors)


@pytest.mark.acceptance
def test_plain_methods_stand_beside_and_their_answers_are_scored_as_anyones(tmp_path):
    options = {"keep": False, "quiet": True, "references": True}
    result = main(kind=("element",), cases=3, seed=11, out=tmp_path, **options)
    assert set(result.reference_checks) == {"best_single_law", "sparse_regression"}
    page = (tmp_path / "blind_check.md").read_text(encoding="utf-8")
    assert "### Compared with plain methods on the same cases" in page
    # What was sealed and answered here is scored alike from the file of answers.
    again = main(out=tmp_path, score=tmp_path / "answers" / "carrierflex.json")
    for figure, other in zip(result.class_score.figures, again.class_score.figures, strict=True):
        assert (figure.name, figure.cases) == (other.name, other.cases)
        assert figure.value == pytest.approx(other.value, nan_ok=True)
    scored = main(out=tmp_path, score=tmp_path / "answers" / "best_single_law.json")
    reference = result.reference_checks["best_single_law"]
    for figure, other in zip(
        reference.class_score.figures, scored.class_score.figures, strict=True
    ):
        assert figure.value == pytest.approx(other.value, nan_ok=True)


def test_a_folder_without_seals_has_no_answers_to_score(tmp_path):
    with pytest.raises(ValueError, match=r"holds no seals.json; expected the folder of an export"):
        main(out=tmp_path, score=tmp_path / "answers.json")
