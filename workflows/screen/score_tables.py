"""Score of a blind check as a table on the screen and as a page."""

import math
from typing import TYPE_CHECKING

from rich.console import Group, RenderableType

from carrierflex.blind_check.scoring.judging import Judged
from carrierflex.blind_check.scoring.scoring import ClassRow, Figure, Score
from carrierflex.workflows.screen.titled_table import titled_table

if TYPE_CHECKING:
    from carrierflex.blind_check.scoring.result import BlindCheck

_FIGURES = ("kind", "figure", "wanted", "reached", "95 %", "cases", "met")
_CLASSES = ("kind", "true class", "cases", "right", "95 %", "answers")
_WRONG = ("case", "family", "truth", "gap / floor", "verdict", "named")


def blind_check_table(check: "BlindCheck") -> RenderableType:
    """Figures, confusion matrix and wrong cases."""
    parts: list[RenderableType] = []
    for title, columns, rows in _sections(check.score):
        table = titled_table(title, *columns)
        for row in rows:
            table.add_row(*row)
        parts += [table, ""]
    return Group(*parts, f"digest of the seals: {check.digest}")


def score_page(score: Score, *, command: str, date: str, digest: str, software: str) -> str:
    """Markdown of a score.

    Parameters
    ----------
    score : Score
        What was reached.
    command, date, digest, software : str
        What made it, when, under which seals, with which version.

    Returns
    -------
    str
        Page with one table a section.
    """
    lines = [f"Run of {date}, {software}, by `{command}`; digest of the seals `{digest}`.", ""]
    for title, columns, rows in _sections(score):
        lines += [
            f"### {title[0].upper()}{title[1:]}",
            "",
            _line(columns),
            _line(["---"] * len(columns)),
        ]
        lines += [*(_line(row) for row in rows), ""]
    return "\n".join(lines)


def _sections(score: Score) -> list[tuple[str, tuple[str, ...], list[list[str]]]]:
    return [
        ("figures", _FIGURES, [_figure(row) for row in score.figures]),
        (
            "confusion by alias class, gap >= 5 floors",
            _CLASSES,
            [_class(row) for row in score.confusion],
        ),
        ("wrong cases", _WRONG, [_wrong(row) for row in score.wrong]),
    ]


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


def _wrong(case: Judged) -> list[str]:
    label, verdict = case.label, str(case.verdict.document["verdict"])
    truth, named = (" + ".join(names) or "-" for names in (label.effects, case.named))
    return [label.case, label.family, truth, f"{label.gap_over_floor:.1f}", verdict, named]
