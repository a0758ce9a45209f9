"""Score of several causes at once: whether all are found, and whether none is false."""

from collections import Counter
from collections.abc import Sequence

from carrierflex.blind_check.scoring.class_judging import (
    CLEAR_CLASS_GAP,
    OUTCOMES,
    UNDETERMINED,
    ClassJudged,
)
from carrierflex.blind_check.scoring.scoring import ClassRow, Figure, share_figure, wilson
from carrierflex.blind_check.scoring.several_judging import JudgedCauses

_ALL_FOUND, _NONE_FALSE = 0.85, 0.95
_HEAD = "several causes"
_NO_CLASS = "no class"


def several_figures(kind: str, cases: Sequence[ClassJudged]) -> list[Figure]:
    """Figures of the cases with several causes of one kind; none without such a case.

    Parameters
    ----------
    kind : str
        Kind of campaign.
    cases : sequence of ClassJudged
        Cases with several causes.
    """
    if not cases:
        return []
    # Where no cause leaves two floors there is none to be found, but one can be false.
    asked = [case for case in cases if _judged(case).of_gap(CLEAR_CLASS_GAP)]
    found = [_judged(case).finds_all(CLEAR_CLASS_GAP) for case in asked]
    none_false = [not _judged(case).false for case in cases]
    both = [hit and not _judged(case).false for hit, case in zip(found, asked, strict=True)]
    figures = [
        share_figure(
            kind,
            f"{_HEAD}: every one of {CLEAR_CLASS_GAP:g} floors found",
            found,
            f">= {100 * _ALL_FOUND:.0f} %",
            lambda p, n: p >= _ALL_FOUND,
        ),
        share_figure(
            kind,
            f"{_HEAD}: none false",
            none_false,
            f">= {100 * _NONE_FALSE:.0f} %",
            lambda p, n: p >= _NONE_FALSE,
        ),
        share_figure(
            kind,
            f"{_HEAD}: none false in one at least of the sets that are not told apart",
            [not _judged(case).in_every_set for case in cases],
        ),
        share_figure(kind, f"{_HEAD}: every one of 2 floors found and none false", both),
        *_outcome_figures(kind, cases),
    ]
    for number in sorted({len(case.label.effects) for case in cases}):
        own = [hit for hit, case in zip(found, asked, strict=True) if _number(case) == number]
        figures.append(share_figure(kind, f"{_HEAD}, {number}: every one of 2 floors found", own))
    for name, low, high in _BINS:
        hits = [
            cause.is_found
            for case in cases
            for cause in _judged(case).causes
            if low <= cause.gap < high
        ]
        figures.append(share_figure(kind, f"{_HEAD}: single ones of {name} floors found", hits))
    follows = [hit for case in cases for hit in _follows_right(case)]
    if follows:
        figures.append(share_figure(kind, f"{_HEAD}: what a found one follows is right", follows))
    false_laws = [bool(case.false_laws) for case in cases]
    return [*figures, share_figure(kind, f"{_HEAD}: law named, class wrong", false_laws)]


def _outcome_figures(kind: str, cases: Sequence[ClassJudged]) -> list[Figure]:
    """Shares of all cases by outcome, each apart."""
    return [
        share_figure(kind, f"{_HEAD}: {outcome}", [case.outcome == outcome for case in cases])
        for outcome in OUTCOMES
    ]


#: Bins of the gap that a cause leaves alone.
_BINS = (
    ("less than 1", 0.0, 1.0),
    ("1 to 2", 1.0, CLEAR_CLASS_GAP),
    ("2 to 4", CLEAR_CLASS_GAP, 4.0),
    ("4 and more", 4.0, float("inf")),
)


def several_rows(kind: str, cases: Sequence[ClassJudged]) -> list[ClassRow]:
    """How often causes of each class are found, and each class is named falsely.

    Where a cause of two floors is missed, the answers are what stands falsely in its case; where a
    class is named falsely, the causes of its case that are missed.

    Parameters
    ----------
    kind : str
        Kind of campaign.
    cases : sequence of ClassJudged
        Cases with several causes.
    """
    hits: dict[str, list[bool]] = {}
    instead: dict[str, Counter[str]] = {}
    missed_beside: dict[str, Counter[str]] = {}
    for case in cases:
        judged = _judged(case)
        clear = judged.of_gap(CLEAR_CLASS_GAP)
        missed = [cause.class_id for cause in clear if not cause.is_found]
        for cause in clear:
            hits.setdefault(cause.class_id, []).append(cause.is_found)
        for own in missed:
            instead.setdefault(own, Counter())[_words(case, judged.false)] += 1
        for own in judged.false:
            missed_beside.setdefault(own, Counter())[" + ".join(missed) or "none missed"] += 1
    rows = [
        _row(kind, f"{_HEAD}: {own}", sum(of_class), len(of_class), instead.get(own, Counter()))
        for own, of_class in sorted(hits.items())
    ]
    for own, beside in sorted(missed_beside.items()):
        without = [case for case in cases if own not in _classes(case)]
        right = len(without) - beside.total()
        rows.append(_row(kind, f"{_HEAD}: no {own}", right, len(without), beside))
    return rows


def _row(kind: str, name: str, right: int, cases: int, answers: Counter[str]) -> ClassRow:
    return ClassRow(kind, name, cases, right, wilson(right, cases), tuple(answers.most_common()))


def _words(case: ClassJudged, false: Sequence[str]) -> str:
    """What stands falsely in the place of a missed cause."""
    if not case.answer:
        return _NO_CLASS
    return "missed beside " + " + ".join(false) if false else "missed alone"


def _judged(case: ClassJudged) -> JudgedCauses:
    assert case.causes is not None, "a case with several causes is judged cause by cause"
    return case.causes


def _number(case: ClassJudged) -> int:
    return len(case.label.effects)


def _classes(case: ClassJudged) -> set[str]:
    return {cause.class_id for cause in _judged(case).causes}


def _follows_right(case: ClassJudged) -> list[bool]:
    """For every cause found whose class says what it follows, whether the answer says the same."""
    answered = {name.rpartition("/")[0]: name for name in case.answer}
    found = [cause.class_id for cause in _judged(case).causes if cause.is_found]
    told = []
    for name in case.label.classes:
        shape = name.rpartition("/")[0]
        if shape in found and not answered.get(shape, UNDETERMINED).endswith(UNDETERMINED):
            told.append(answered[shape] == name)
    return told
