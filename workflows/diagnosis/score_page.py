"""Score of a blind check in tables with titles, and as a page."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from carrierflex.blind_check.scoring.class_judging import ClassJudged
from carrierflex.blind_check.scoring.class_score import ChangeRow, ClassScore
from carrierflex.blind_check.scoring.judging import Judged
from carrierflex.blind_check.scoring.result import BlindCheck
from carrierflex.blind_check.scoring.scoring import ClassRow, Figure, Score

Section = tuple[str, tuple[str, ...], list[list[str]]]


def score_page(check: BlindCheck, *, command: str, date: str, software: str) -> str:
    """Markdown of a score, one table a section, with what made it, when, with which version."""
    seals = f"digest of the seals `{check.digest}`"
    lines = [f"Run of {date}, {software}, by `{command}`; {seals}.", ""]
    for title, columns, rows in score_sections(check):
        lines += [f"### {title[0].upper()}{title[1:]}", ""]
        lines += [_line(row) for row in (columns, ["---"] * len(columns), *rows)]
        lines += [""]
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
        _section("figures", _FIGURE, score.figures),
        _section("confusion by alias class, gap >= 5 floors", _CLASS, score.confusion),
        _section("wrong cases", _WRONG, score.wrong),
    ]


def _class_sections(score: ClassScore) -> list[Section]:
    # Single causes of elements, whose forms are changed by known amounts.
    by_change = "single causes by their change of form, gap >= 2 floors"
    return [
        _section("figures by class", _FIGURE, score.figures),
        _section("confusion by class, gap >= 2 floors", _CLASS, score.confusion),
        *([_section(by_change, _CHANGE, score.changes)] if score.changes else []),
        _section("wrong classes, ties and false laws", _FALSE, score.wrong),
    ]


def _section(title: str, cells: Mapping[str, Callable[[Any], str]], rows: Iterable[Any]) -> Section:
    return title, tuple(cells), [[cell(row) for cell in cells.values()] for row in rows]


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _percent(share: float) -> str:
    return "-" if math.isnan(share) else f"{100.0 * share:.1f} %"


def _interval(interval: tuple[float, float] | None) -> str:
    return "" if interval is None else f"{100.0 * interval[0]:.0f} to {100.0 * interval[1]:.0f} %"


def _joined(names: Sequence[str]) -> str:
    return " + ".join(names) or "-"


def _reached(figure: Figure) -> str:
    if figure.interval is not None or math.isnan(figure.value):
        return _percent(figure.value)
    return f"{figure.value:.3g}"


#: Columns of every table, and the cell of a row in them.
_FIGURE: dict[str, Callable[[Figure], str]] = {
    "kind": lambda one: one.kind,
    "figure": lambda one: one.name,
    "required": lambda one: one.wanted,
    "actual": _reached,
    "95 %": lambda one: _interval(one.interval),
    "cases": lambda one: str(one.cases),
    "pass": lambda one: {True: "yes", False: "no", None: "too few" if one.wanted else ""}[one.met],
}
_CLASS: dict[str, Callable[[ClassRow], str]] = {
    "kind": lambda row: row.kind,
    "true class": lambda row: row.name,
    "cases": lambda row: str(row.cases),
    "right": lambda row: str(row.right),
    "95 %": lambda row: _interval(row.interval),
    "answers": lambda row: ", ".join(f"{name}: {count}" for name, count in row.answers),
}
_WRONG: dict[str, Callable[[Judged], str]] = {
    "case": lambda case: case.label.case,
    "family": lambda case: case.label.family,
    "truth": lambda case: _joined(case.label.effects),
    "gap / floor": lambda case: f"{case.label.gap_over_floor:.1f}",
    "verdict": lambda case: str(case.verdict.document["verdict"]),
    "named": lambda case: _joined(case.named),
}
_CHANGE: dict[str, Callable[[ChangeRow], str]] = {
    "change of form": lambda row: row.name,
    "cases": lambda row: str(row.cases),
    "class right": lambda row: str(row.right),
    "95 %": lambda row: _interval(row.interval),
    "law named": lambda row: str(row.laws_named),
    "own or kin": lambda row: str(row.laws_right),
    "class share": lambda row: _percent(row.class_share),
    "law share": lambda row: _percent(row.law_share),
}
_FALSE: dict[str, Callable[[ClassJudged], str]] = {
    "case": lambda case: case.label.case,
    "drive": lambda case: case.label.drive,
    "cause": lambda case: _joined(case.label.effects),
    "class": lambda case: case.truth,
    "gap / floor": lambda case: f"{case.label.gap_over_floor:.1f}",
    "change": lambda case: ", ".join(f"{100.0 * change:.0f} %" for change in case.label.changes),
    "outcome": lambda case: case.outcome,
    "answer": lambda case: case.answered,
    "law named": lambda case: _joined(case.laws),
    "false law": lambda case: _joined(case.false_laws),
}
