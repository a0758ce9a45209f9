"""Score of the answers to a blind check, by effect or by class, and its files."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

from carrierflex.blind_check.labels import Label
from carrierflex.blind_check.scoring.class_judging import (
    ClassJudged,
    cases_judged_by_class,
    is_judged_by_class,
)
from carrierflex.blind_check.scoring.class_score import class_score
from carrierflex.blind_check.scoring.judging import Judged, judged_cases
from carrierflex.blind_check.scoring.result import BlindCheck
from carrierflex.blind_check.scoring.scoring import score
from carrierflex.blind_check.sealing.verdicts import Verdict
from carrierflex.files.json_files import plain, save_json
from carrierflex.files.versions import software_name
from carrierflex.files.whole_files import whole_file
from carrierflex.workflows.screen.score_tables import score_page


def scored(
    labels: Mapping[str, Label], verdicts: Mapping[str, Verdict], digest: str
) -> tuple[BlindCheck, list[dict[str, Any]]]:
    """Score of verdicts, and the cases one by one.

    Parameters
    ----------
    labels : mapping of str to Label
        Truth by case.
    verdicts : mapping of str to Verdict
        Answer by case.
    digest : str
        Digest of the seals.
    """
    by_class = cases_judged_by_class(labels, verdicts)
    effect_labels = _by_effect(labels)
    by_effect = judged_cases(effect_labels, {case: verdicts[case] for case in effect_labels})
    result = BlindCheck(
        score(by_effect) if by_effect else None,
        class_score(by_class) if by_class else None,
        digest,
    )
    return result, [*(_row(case) for case in by_effect), *(_class_row(case) for case in by_class)]


def _by_effect(labels: Mapping[str, Label]) -> dict[str, Label]:
    """Labels of the cases that are judged by effect."""
    return {case: label for case, label in labels.items() if not is_judged_by_class(label)}


def write_score(
    out: Path, result: BlindCheck, rows: Sequence[Mapping[str, Any]], *, command: str
) -> None:
    """Write blind_check.json and blind_check.md.

    Parameters
    ----------
    out : Path
        Folder.
    result : BlindCheck
        Score.
    rows : sequence of mapping
        Cases.
    command : str
        What made them.
    """
    date, software = f"{datetime.now():%Y-%m-%d}", software_name()
    head = {"format": "carrierflex-blind-check", "version": 2, "software": software, "date": date}
    scores = [own for own in (result.score, result.class_score) if own is not None]
    figures: dict[str, Any] = {
        "met": result.met,
        "figures": plain([figure for own in scores for figure in own.figures]),
        "confusion": plain([row for own in scores for row in own.confusion]),
    }
    if result.beside:
        figures["beside"] = {name: _shares(own) for name, own in result.beside.items()}
    if result.class_score is not None:
        figures["by_change_of_form"] = plain(result.class_score.changes)
    save_json(
        out / "blind_check.json",
        head | {"command": command, "digest": result.digest} | figures | {"cases": rows},
    )
    page = score_page(result, command=command, date=date, software=software)
    with whole_file(out / "blind_check.md") as file:
        file.write_text(page, encoding="utf-8")


def _row(case: Judged) -> dict[str, Any]:
    names = ("case", "family", "effects", "gap_over_floor", "rho", "declares_noise")
    return {
        **{name: getattr(case.label, name) for name in names},
        **_answer(case.verdict),
        "named": case.named,
        "right": case.is_right,
    }


def _class_row(case: ClassJudged) -> dict[str, Any]:
    names = (
        *("case", "family", "effects", "gap_over_floor", "declares_noise"),
        *("classes", "drive", "changes"),
    )
    document = case.verdict.document
    row = {
        **{name: getattr(case.label, name) for name in names},
        **_answer(case.verdict),
        "named": case.laws,
        "answer": case.answer,
        "class_ties": document.get("class_ties", ()),
        "rivals": document.get("class_rivals", {}),
        "outcome": case.outcome,
        "false_laws": case.false_laws,
    }
    if case.causes is not None:
        row["causes"] = plain(case.causes.causes)
        row["false_classes"] = case.causes.false
    return row


def _answer(verdict: Verdict) -> dict[str, Any]:
    document = verdict.document
    return {
        "verdict": document["verdict"],
        "reason": document.get("reason"),
        "seconds": verdict.seconds,
    }


def _shares(result: BlindCheck) -> list[Any]:
    """Figures of another tool's answers."""
    scores = [own for own in (result.score, result.class_score) if own is not None]
    return [plain(figure) for own in scores for figure in own.figures]
