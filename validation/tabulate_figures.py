"""Figures of whole diagnoses of sealed cases, as the validation page has them.

    python -m validation.tabulate_figures ANSWERS.jsonl [MORE.jsonl ...] --truth FOLDER/truth

The answers are files of `run_tree`, the truth is that of `paired_cases`. Cases are scored as
`carrierflex blind-check` scores them: elements and causes in forms of no law by class, the others
by law. Intervals are Wilson's.
"""

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path

from carrierflex.blind_check.labels import KINDS, MODEL, Label
from carrierflex.blind_check.scoring.scoring import Figure, share_figure
from carrierflex.blind_check.sealing.verdicts import Verdict
from carrierflex.workflows.diagnosis.scored_check import scored
from validation.paired_score import (
    read_answer,
    read_labels,
    scored_answer,
    textbook_laws,
    with_classes,
)
from validation.run_tree import read_lines

#: Figures that the page leaves out though a share is required of them: times, carriers off their
#: drawing, which have a section of their own, and what another row says.
_OMITTED = (
    "seconds a case",
    "median |rho",
    "model: ",
    "decays, outside",
    'false naming, "nothing"',
)
#: Figures without a required share that the page has.
_SHOWN = ("class right of all", "gap < 2: right", "outside: class named", "textbook laws: named")
#: Words of the page for those of a figure's name, one after the other.
_WORDS = {
    "wide_band": "wide-band",
    "single_level": "sines at one level",
    "levels,": "sweeps and sines at four levels,",
    "carrier, gap": "form, gap",
    "mounting, gap": "form, gap",
    "gap >= 2: class right of those answered": "2 floors and more: right of the answered",
    "gap >= 2: class right of all": "2 floors and more: right of all",
    "gap >= 2: not answered": "2 floors and more: not answered",
    "gap < 2: right": "below 2 floors: right",
    "found": "identified",
    "stage's own effects": "stage's effects",
    "textbook laws' parameters": "parameters of textbook laws",
    "their 95 % interval": "their intervals",
    "its 95 % interval": "its interval",
}


def read_cases(answers: Sequence[Path], truth: Path) -> tuple[dict[str, Label], dict[str, Verdict]]:
    """Labels of the cases that are answered, and the answers.

    Parameters
    ----------
    answers : sequence of Path
        Files of `run_tree`.
    truth : Path
        Folder with the labels of each kind.
    """
    written = read_labels(truth)
    verdicts = {
        row["case"]: read_answer(row, path.with_suffix(""))
        for path in answers
        for row in read_lines(path)
        if row["case"] in written
    }
    return {case: written[case] for case in verdicts}, verdicts


def figures_of_cases(labels: dict[str, Label], verdicts: dict[str, Verdict]) -> list[Figure]:
    """Figures of the blind check, and of the laws that are named.

    Parameters
    ----------
    labels : dict
        Truth by case.
    verdicts : dict
        Answer by case.
    """
    result, _ = scored(labels, verdicts, "")
    scores = [each for each in (result.class_score, result.score) if each is not None]
    figures = [figure for each in scores for figure in each.figures if _is_of_page(figure)]
    return figures + list(_law_figures(labels, verdicts))


def _is_of_page(figure: Figure) -> bool:
    if not figure.cases or figure.name.startswith(_OMITTED):
        return False
    # Of single lines and decays the page has the share of right answers alone.
    return bool(figure.wanted) or figure.name.endswith(_SHOWN)


def _law_figures(labels: dict[str, Label], verdicts: dict[str, Verdict]) -> Iterator[Figure]:
    """How often the laws that are named are those withheld, or false."""
    for kind in KINDS:
        answers = [
            (label, scored_answer(label, verdicts[label.case]))
            for label in map(with_classes, labels.values())
            # Carriers off their drawing have figures of their own.
            if label.kind == kind and label.family != MODEL
        ]
        if not answers:
            continue
        of_laws = [(label, answer) for label, answer in answers if textbook_laws(label)]
        # A law whose form is changed is another law: its class is named, and which is nearest.
        textbook = [answer for label, answer in of_laws if not any(label.changes)]
        changed = [answer for label, answer in of_laws if any(label.changes)]
        yield share_figure(
            kind,
            "textbook laws: named rightly, alone or in a tie",
            [bool(answer.is_law_right) for answer in textbook],
        )
        yield share_figure(
            kind,
            "textbook laws: nearest laws of the classes counted",
            [bool(answer.is_law_right or answer.is_nearest_right) for answer in textbook],
        )
        if changed:
            yield share_figure(
                kind,
                "laws changed in form by 5 to 30 %: the law is named, or nearest",
                [bool(answer.is_law_right or answer.is_nearest_right) for answer in changed],
            )
        yield share_figure(
            kind,
            "all cases: a false law",
            [answer.is_law_false and not answer.is_class_right for _, answer in answers],
            "<= 1 %",
            lambda share, cases: share <= 0.01,
        )


def page_tables(figures: Sequence[Figure]) -> str:
    """Markdown table of each kind.

    Parameters
    ----------
    figures : sequence of Figure
        Figures of all kinds.
    """
    lines: list[str] = []
    for kind in reversed(KINDS):
        rows = [figure for figure in figures if figure.kind == kind and figure.cases]
        if rows:
            lines += [f"| {kind} | required | actual | 95 % | cases |", "|---|---|---|---|---|"]
            lines += [_row(figure) for figure in rows]
            lines.append("")
    return "\n".join(lines)


def _row(figure: Figure) -> str:
    low, high = (100.0 * end for end in figure.interval or (0.0, 1.0))
    name = figure.name
    for word, of_page in _WORDS.items():
        name = name.replace(word, of_page)
    return (
        f"| {name} | {figure.wanted or '-'} | {100.0 * figure.value:.1f} % "
        f"| {low:.0f} to {high:.0f} % | {figure.cases} |"
    )


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("answers", type=Path, nargs="+", help="answers of run_tree (.jsonl)")
    parser.add_argument("--truth", type=Path, required=True, help="folder of the labels")
    chosen = parser.parse_args()
    print(page_tables(figures_of_cases(*read_cases(chosen.answers, chosen.truth))))


if __name__ == "__main__":
    main()
