"""Score of a blind check in tables with titles, and as a page."""

import math

from carrierflex.blind_check.scoring.class_judging import ClassJudged
from carrierflex.blind_check.scoring.class_score import ChangeRow, ClassScore
from carrierflex.blind_check.scoring.judging import Judged
from carrierflex.blind_check.scoring.result import BlindCheck
from carrierflex.blind_check.scoring.scoring import ClassRow, Figure, Score

_FIGURES = ("kind", "figure", "required", "actual", "95 %", "cases", "pass")
_CLASSES = ("kind", "true class", "cases", "right", "95 %", "answers")
_WRONG = ("case", "family", "truth", "gap / floor", "verdict", "named")
_CHANGES = (
    "change of form",
    "cases",
    "class right",
    "95 %",
    "law named",
    "own or kin",
    "class share",
    "law share",
)
_FALSE = (
    "case",
    "drive",
    "cause",
    "class",
    "gap / floor",
    "change",
    "outcome",
    "answer",
    "law named",
    "false law",
)
Section = tuple[str, tuple[str, ...], list[list[str]]]


def score_page(check: BlindCheck, *, command: str, date: str, software: str) -> str:
    """Markdown of a score, one table a section, with what made it, when, with which version."""
    seals = f"digest of the seals `{check.digest}`"
    lines = [f"Run of {date}, {software}, by `{command}`; {seals}.", ""]
    for title, columns, rows in score_sections(check):
        lines += [
            f"### {title[0].upper()}{title[1:]}",
            "",
            _line(columns),
            _line(["---"] * len(columns)),
        ]
        lines += [*(_line(row) for row in rows), ""]
    return "\n".join(lines)


def score_sections(check: BlindCheck) -> list[Section]:
    """Title, columns and rows of every table of a score."""
    sections: list[Section] = []
    if check.score is not None:
        sections += _effect_sections(check.score)
    if check.class_score is not None:
        sections += _class_sections(check.class_score)
    if check.reference_checks:
        sections.append(_references(check))
    return sections


def _references(check: BlindCheck) -> Section:
    """Shares that the diagnosis reaches beside those of other answers to the same seals."""
    others = [_figures_of(score) for score in check.reference_checks.values()]
    rows = []
    for key, figure in _figures_of(check).items():
        if figure.interval is not None and figure.cases:
            values = [_percent(other[key].value) if key in other else "-" for other in others]
            reached = _percent(figure.value)
            rows.append([figure.kind, figure.name, figure.wanted, reached, *values])
    names = [name.replace("_", " ") for name in check.reference_checks]
    columns = ("kind", "figure", "required", "carrierflex", *names)
    return "compared with plain methods on the same cases", columns, rows


def _figures_of(check: BlindCheck) -> dict[tuple[str, str], Figure]:
    scores = [score for score in (check.score, check.class_score) if score is not None]
    return {(figure.kind, figure.name): figure for score in scores for figure in score.figures}


def _effect_sections(score: Score) -> list[Section]:
    return [
        ("figures", _FIGURES, [_figure(row) for row in score.figures]),
        (
            "confusion by alias class, gap >= 5 floors",
            _CLASSES,
            [_class(row) for row in score.confusion],
        ),
        ("wrong cases", _WRONG, [_wrong(row) for row in score.wrong]),
    ]


def _class_sections(score: ClassScore) -> list[Section]:
    return [
        ("figures by class", _FIGURES, [_figure(row) for row in score.figures]),
        (
            "confusion by class, gap >= 2 floors",
            _CLASSES,
            [_class(row) for row in score.confusion],
        ),
        *_changes(score),
        ("wrong classes, ties and false laws", _FALSE, [_false(row) for row in score.wrong]),
    ]


def _changes(score: ClassScore) -> list[Section]:
    """Single causes of elements, whose forms are changed by known amounts."""
    title = "single causes by their change of form, gap >= 2 floors"
    return [(title, _CHANGES, [_change(row) for row in score.changes])] if score.changes else []


def _line(cells: list[str] | tuple[str, ...]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _percent(share: float) -> str:
    return "-" if math.isnan(share) else f"{100.0 * share:.1f} %"


def _interval(interval: tuple[float, float]) -> str:
    return f"{100.0 * interval[0]:.0f} to {100.0 * interval[1]:.0f} %"


def _figure(figure: Figure) -> list[str]:
    is_share = figure.interval is not None
    reached = (
        _percent(figure.value)
        if is_share
        else "-"
        if math.isnan(figure.value)
        else f"{figure.value:.3g}"
    )
    met = {True: "yes", False: "no", None: "too few" if figure.wanted else ""}[figure.met]
    interval = _interval(figure.interval) if figure.interval is not None else ""
    return [figure.kind, figure.name, figure.wanted, reached, interval, str(figure.cases), met]


def _class(row: ClassRow) -> list[str]:
    answers = ", ".join(f"{name}: {count}" for name, count in row.answers)
    return [row.kind, row.name, str(row.cases), str(row.right), _interval(row.interval), answers]


def _change(row: ChangeRow) -> list[str]:
    return [
        row.name,
        str(row.cases),
        str(row.right),
        _interval(row.interval),
        str(row.laws_named),
        str(row.laws_right),
        _percent(row.class_share),
        _percent(row.law_share),
    ]


def _false(case: ClassJudged) -> list[str]:
    label = case.label
    changes = ", ".join(f"{100.0 * change:.0f} %" for change in label.changes)
    return [
        label.case,
        label.drive,
        " + ".join(label.effects) or "-",
        case.truth,
        f"{label.gap_over_floor:.1f}",
        changes,
        case.outcome,
        case.answered,
        " + ".join(case.laws) or "-",
        " + ".join(case.false_laws) or "-",
    ]


def _wrong(case: Judged) -> list[str]:
    label, verdict = case.label, str(case.verdict.document["verdict"])
    truth, named = (" + ".join(names) or "-" for names in (label.effects, case.named))
    return [label.case, label.family, truth, f"{label.gap_over_floor:.1f}", verdict, named]
