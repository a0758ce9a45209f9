"""Score of the answers to a blind check, by effect or by class, and its files."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any, Literal, NotRequired, TypedDict

from carrierflex.blind_check.labels import Label
from carrierflex.blind_check.scoring.class_judging import (
    ClassJudged,
    cases_judged_by_class,
    is_judged_by_class,
)
from carrierflex.blind_check.scoring.class_score import ChangeRow, class_score
from carrierflex.blind_check.scoring.judging import Judged, judged_cases
from carrierflex.blind_check.scoring.result import BlindCheck
from carrierflex.blind_check.scoring.scoring import ClassRow, Figure, score
from carrierflex.blind_check.scoring.several_judging import JudgedCause
from carrierflex.blind_check.sealing.verdicts import Verdict
from carrierflex.files.json_files import plain, save_json
from carrierflex.files.versions import Software, software_name
from carrierflex.files.whole_files import whole_file
from carrierflex.workflows.diagnosis.score_page import score_page


def scored(
    labels: Mapping[str, Label], verdicts: Mapping[str, Verdict], digest: str
) -> tuple[BlindCheck, list[dict[str, Any]]]:
    """Score of verdicts under seals of one digest, and the cases one by one."""
    by_class = cases_judged_by_class(labels, verdicts)
    effect_labels = {case: of for case, of in labels.items() if not is_judged_by_class(of)}
    by_effect = judged_cases(effect_labels, {case: verdicts[case] for case in effect_labels})
    result = BlindCheck(
        score(by_effect) if by_effect else None,
        class_score(by_class) if by_class else None,
        digest,
    )
    return result, [*(_row(case) for case in by_effect), *(_class_row(case) for case in by_class)]


def write_score(
    out: Path, result: BlindCheck, rows: Sequence[Mapping[str, Any]], *, command: str
) -> None:
    """Write blind_check.json and blind_check.md, with the command that made them."""
    date, software = f"{datetime.now():%Y-%m-%d}", software_name()
    head = {"format": "carrierflex-blind-check", "version": 2, "software": software, "date": date}
    figures: dict[str, Any] = {
        "met": result.met,
        "figures": _of_scores(result, "figures"),
        "confusion": _of_scores(result, "confusion"),
    }
    if result.reference_checks:
        figures["beside"] = {
            name: _of_scores(check, "figures") for name, check in result.reference_checks.items()
        }
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
    return {
        **_stated(case, "rho", "declares_noise"),
        "named": case.named,
        "right": case.is_right,
    }


def _class_row(case: ClassJudged) -> dict[str, Any]:
    document = case.verdict.document
    row = {
        **_stated(case, "declares_noise", "classes", "drive", "changes"),
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


def _stated(case: Judged | ClassJudged, *names: str) -> dict[str, Any]:
    """What label and verdict of a case state."""
    names = ("case", "family", "effects", "gap_over_floor", *names)
    document = case.verdict.document
    return {
        **{name: getattr(case.label, name) for name in names},
        "verdict": document["verdict"],
        "reason": document.get("reason"),
        "seconds": case.verdict.seconds,
    }


def _of_scores(result: BlindCheck, field: str) -> list[Any]:
    """Figures or confusion of the scores by effect and by class."""
    scores = [each for each in (result.score, result.class_score) if each is not None]
    return [plain(row) for each in scores for row in getattr(each, field)]


class BlindCase(TypedDict):
    """A case of the blind check: its label, its answer."""

    case: Annotated[str, "Name"]
    family: Annotated[str, "Family"]
    effects: Annotated[Sequence[str], "Withheld effects"]
    gap_over_floor: Annotated[float, "RMS of the gap over that of the noise"]
    verdict: Annotated[str, "Verdict; error where the diagnosis failed"]
    reason: Annotated[str | None, "Why this verdict"]
    seconds: Annotated[float, "Time of the diagnosis [s]"]
    named: Annotated[Sequence[str], "Laws that are named"]
    declares_noise: Annotated[bool, "Whether the campaign declares its noise"]
    rho: NotRequired[Annotated[float, "RMS with the true effect over that without"]]
    right: NotRequired[Annotated[bool, "Whether the answer is right"]]
    classes: NotRequired[Annotated[Sequence[str], "True classes"]]
    drive: NotRequired[Annotated[str, "Drive of the element"]]
    changes: NotRequired[Annotated[Sequence[float], "How far laws are from those of the library"]]
    answer: NotRequired[Annotated[Sequence[str], "Classes that are named"]]
    class_ties: NotRequired[Annotated[Sequence[Sequence[str]], "Classes not distinguished"]]
    rivals: NotRequired[Annotated[Mapping[str, float], "Share by rival class"]]
    outcome: NotRequired[Annotated[str, "Right, wrong, tied, abstained or silent"]]
    false_laws: NotRequired[Annotated[Sequence[str], "Laws that are wrong"]]
    causes: NotRequired[Annotated[Sequence[JudgedCause], "Of several causes, each by itself"]]
    false_classes: NotRequired[Annotated[Sequence[str], "Classes that are no cause's"]]


class BlindCheckDocument(TypedDict):
    """blind_check.json, written by blind-check."""

    format: Annotated[Literal["carrierflex-blind-check"], "Kind of the file"]
    version: Annotated[Literal[2], "Version of the format"]
    software: Software
    date: Annotated[str, "Day"]
    command: Annotated[str, "Command that repeats it"]
    digest: Annotated[str, "Digest of the seals"]
    met: Annotated[bool, "Whether every figure is met"]
    figures: Annotated[Sequence[Figure], "Required and actual"]
    confusion: Annotated[Sequence[ClassRow], "Answers by true class"]
    beside: NotRequired[
        Annotated[Mapping[str, Sequence[Figure]], "Figures of other tools' answers, by tool"]
    ]
    by_change_of_form: NotRequired[Annotated[Sequence[ChangeRow], "Answers by change of form"]]
    cases: Annotated[Sequence[BlindCase], "Every case"]


class SealsDocument(TypedDict):
    """seals.json, written by blind-check before the first diagnosis."""

    format: Annotated[str, "Kind of the file"]
    version: Annotated[int, "Version of the format"]
    check: Annotated[Mapping[str, Any], "Seed and number of cases"]
    digest: Annotated[str, "SHA-256 of all seals"]
    seals: Annotated[Mapping[str, str], "SHA-256 of label and salt by case"]


class OpenedLabel(TypedDict):
    """A label that was opened."""

    label: Annotated[Mapping[str, Any], "The truth of the case"]
    salt: Annotated[str, "Random bytes of its seal"]


LabelsDocument = Annotated[Mapping[str, OpenedLabel], "labels.json of blind-check: label by case"]


SaltsDocument = Annotated[Mapping[str, str], "salts.json of blind-check: random bytes by case"]


class Answer(TypedDict):
    """Answer of a tool to a case."""

    verdict: NotRequired[Annotated[str, "Verdict; error where there is no answer"]]
    seconds: NotRequired[Annotated[float, "Time it took [s]"]]
    effects: NotRequired[Annotated[Sequence[str], "Named effects"]]
    aliases: NotRequired[Annotated[Sequence[Sequence[str]], "Effects not distinguished"]]
    classes: NotRequired[Annotated[Sequence[str], "Named classes"]]
    class_ties: NotRequired[Annotated[Sequence[Sequence[str]], "Classes not distinguished"]]
    rho: NotRequired[Annotated[float, "RMS with the effects over that without"]]
    rho_ci95: NotRequired[Annotated[Sequence[float], "95 % interval of rho"]]
    parameters: NotRequired[
        Annotated[Mapping[str, Mapping[str, Any]], "Values by effect and name, as in diagnosis"]
    ]


class AnswersDocument(TypedDict):
    """Answers of any tool to a blind check, which it scores."""

    format: Annotated[Literal["carrierflex-answers"], "Kind of the file"]
    version: Annotated[Literal[1], "Version of the format"]
    tool: Annotated[str, "Name and version"]
    cases: Annotated[Mapping[str, Answer], "Answer by case"]


class Reference(TypedDict):
    """What a plain method answers to a case."""

    effects: Annotated[Sequence[str], "Named effects"]
    error: Annotated[str | None, "Why it failed; null where it did not"]
    seconds: Annotated[float, "Time it took [s]"]


ReferencesDocument = Annotated[
    Mapping[str, Reference], "references.json of blind-check: answer by plain method"
]


class TimesDocument(TypedDict):
    """times.json, written by blind-check beside every diagnosis."""

    seconds: Annotated[float, "Time of the diagnosis [s]"]
    error: Annotated[str | None, "Why it failed; null where it did not"]
