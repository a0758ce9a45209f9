"""Score by class of the missing cause: figures by stratum, confusion, false laws, change of form.

Wanted figures hold from two floors upwards; a stratum is a kind of drive, or a kind of campaign.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from carrierflex.blind_check.labels import KINDS, NOTHING, SEVERAL
from carrierflex.blind_check.scoring.class_judging import (
    ABSTAINED,
    CLASS_KINDS,
    CLEAR_CLASS_GAP,
    FAILED,
    OUTCOMES,
    RIGHT,
    SILENT,
    TIE,
    UNDETERMINED,
    WRONG,
    ClassJudged,
)
from carrierflex.blind_check.scoring.scoring import (
    ClassRow,
    Figure,
    by_noise,
    confusion_rows,
    is_nominal,
    named_after,
    share_figure,
    time_figures,
    wilson,
)
from carrierflex.blind_check.scoring.several_judging import JudgedCauses
from carrierflex.blind_check.truth.element.drives import DECAY, STRATUM
from carrierflex.blind_check.truth.element.families import CAUSES

#: Right of those answered at least, and not answered at most, by stratum.
_WANTED = {
    "wide_band": (0.95, 0.10),
    "levels": (0.85, 0.30),
    "carrier": (0.95, 0.10),
    "mounting": (0.90, 0.10),
}
_QUIET = (ABSTAINED, SILENT)
STRATA = ("wide_band", "levels", "single_level", "decays", "carrier", "mounting")
#: False classes with nothing missing at most, by kind.
_FALSE_AT_MOST = {"element": 0.03, "carrier": 0.02, "mounting": 0.02}
#: Ends of the bins of the change of form; textbook laws have none.
CHANGES = (0.0, 0.05, 0.10, 0.15, 0.20, 0.25, 0.30)


_ALL_FOUND, _NONE_FALSE = 0.85, 0.95
_HEAD = "several causes"
_NO_CLASS = "no class"
#: Bins of the gap that a cause leaves alone.
_BINS = (
    ("less than 1", 0.0, 1.0),
    ("1 to 2", 1.0, CLEAR_CLASS_GAP),
    ("2 to 4", CLEAR_CLASS_GAP, 4.0),
    ("4 and more", 4.0, float("inf")),
)


_NORMAL_95 = 1.959964
#: Parameters of the baseline that are scored; its damping is an equivalent one beside any other.
_OF_BASELINE = ("m", "K1")


@dataclass(frozen=True)
class ChangeRow:
    """Cases of one cause by the change of its form.

    Parameters
    ----------
    name : str
        Range of the change of form.
    cases, right : int
        Cases, and how often the class is right.
    interval : tuple of float
        Wilson interval of the share at 95 %.
    laws_named, laws_right : int
        How often a law is named, and is the cause's own or its kin.
    class_share, law_share : float
        Median shares of the gap that class and law are said to explain.
    """

    name: str
    cases: int
    right: int
    interval: tuple[float, float]
    laws_named: int
    laws_right: int
    class_share: float
    law_share: float


@dataclass(frozen=True)
class ClassScore:
    """Score of the cases that are judged by class.

    `wrong`: clear cases whose class is wrong or tied, and every false class and law; `false_laws`:
    cases that name a law whose class is wrong.
    """

    figures: tuple[Figure, ...]
    confusion: tuple[ClassRow, ...]
    changes: tuple[ChangeRow, ...]
    wrong: tuple[ClassJudged, ...]
    false_laws: tuple[ClassJudged, ...]

    @property
    def met(self) -> bool:
        """Whether no figure is missed that enough cases judge."""
        return all(figure.met is not False for figure in self.figures)


def class_score(cases: Sequence[ClassJudged]) -> ClassScore:
    """Score of cases judged by class, kind by kind.

    Parameters
    ----------
    cases : sequence of ClassJudged
        Every case of the check.

    Returns
    -------
    ClassScore
        What is reached beside what is wanted.
    """
    wrong = tuple(
        case
        for case in cases
        if (is_clear(case) and case.outcome in (WRONG, TIE, FAILED)) or case.false_laws
    )
    figures: list[Figure] = []
    confusion: list[ClassRow] = []
    for kind in KINDS:
        of_kind = [case for case in cases if case.label.kind == kind]
        if of_kind:
            for head, selected in by_noise(of_kind):
                figures += named_after(head, _figures(selected))
            several = [case for case in of_kind if case.label.family == SEVERAL]
            clear = [case for case in of_kind if is_clear(case) and case not in several]
            rows = [(case.truth, case.answered, case.outcome == RIGHT) for case in clear]
            confusion += confusion_rows(kind, rows) + _several_rows(kind, several)
    elements = [case for case in cases if case.label.kind in CLASS_KINDS]
    return ClassScore(
        figures=tuple(figures),
        confusion=tuple(confusion),
        changes=tuple(_changes(elements)) if elements else (),
        wrong=wrong,
        false_laws=tuple(case for case in cases if case.false_laws),
    )


def is_clear(case: ClassJudged) -> bool:
    """Whether a case must be answered rightly: a gap of two floors, or nothing to name."""
    return not case.has_class or case.label.gap_over_floor >= CLEAR_CLASS_GAP


def shows_every_cause(case: ClassJudged) -> bool:
    """Whether each of several causes would leave the gap of a clear case alone."""
    return is_clear(case) and all(gap >= CLEAR_CLASS_GAP for gap in case.label.own_gaps)


def _figures(cases: Sequence[ClassJudged]) -> list[Figure]:
    """Figures of one kind; several causes at once have their own."""
    kind = cases[0].label.kind
    several = [case for case in cases if case.label.family == SEVERAL]
    others = [case for case in cases if case.label.family != SEVERAL]
    figures = _several_figures(kind, several)
    if others:
        figures += _figures_of_strata(kind, others)
    return figures + time_figures(kind, [case.verdict.seconds for case in cases])


def _figures_of_strata(kind: str, cases: Sequence[ClassJudged]) -> list[Figure]:
    figures: list[Figure] = []
    for stratum in STRATA:
        figures += _stratum_figures(kind, stratum, cases)
    decays = [case for case in cases if case.label.drive == DECAY]
    aimed = [case for case in cases if case.label.drive != DECAY]
    figures += _false_figures(kind, aimed)
    if decays:
        figures += named_after("decays, ", _false_figures(kind, decays, has_target=False))
    if kind not in CLASS_KINDS:
        follows = [case.follows_right for case in aimed if case.has_class and is_clear(case)]
        answered = [answer for answer in follows if answer is not None]
        figures.append(share_figure(kind, "what a right class follows is right", answered))
        return figures
    hits = [hit for case in aimed for hit in covered_parameters(case)]
    for name, of in (("m and K1", True), ("textbook laws' parameters", False)):
        covered = [hit.is_covered for hit in hits if hit.is_baseline is of]
        text = f"{name} inside their 95 % interval"
        figures.append(share_figure(kind, text, covered, "90 to 99 %", is_nominal))
    return figures


def _stratum(case: ClassJudged) -> str:
    """Stratum of a case: its kind of drive, or its kind where there is no drive."""
    return STRATUM.get(case.label.drive, case.label.kind)


def _stratum_figures(kind: str, stratum: str, cases: Sequence[ClassJudged]) -> list[Figure]:
    of_stratum = [case for case in cases if case.has_class and _stratum(case) == stratum]
    if not of_stratum:
        return []
    clear = [case.outcome for case in of_stratum if is_clear(case)]
    answered = [outcome for outcome in clear if outcome in (RIGHT, TIE, WRONG, FAILED)]
    least, most = _WANTED.get(stratum, (None, None))
    head = f"{stratum}, gap >= {CLEAR_CLASS_GAP:g}"
    right = [outcome == RIGHT for outcome in answered]
    quiet = [outcome in _QUIET for outcome in clear]
    figures = [
        share_figure(kind, f"{head}: class right of those answered", right)
        if least is None
        else share_figure(
            kind,
            f"{head}: class right of those answered",
            right,
            f">= {100 * least:.0f} %",
            lambda p, n: p >= least,
        ),
        share_figure(kind, f"{head}: class right of all", [o == RIGHT for o in clear]),
        share_figure(kind, f"{head}: not answered", quiet)
        if most is None
        else share_figure(
            kind,
            f"{head}: not answered",
            quiet,
            f"<= {100 * most:.0f} %",
            lambda p, n: p <= most,
        ),
    ]
    visible = [case.outcome for case in of_stratum if shows_every_cause(case)]
    visible_answered = [outcome == RIGHT for outcome in visible if outcome not in _QUIET]
    name = f"{head} of every cause alone: class right of those answered"
    figures.append(share_figure(kind, name, visible_answered))
    for outcome in (WRONG, TIE, ABSTAINED, SILENT, FAILED):
        figures.append(share_figure(kind, f"{head}: {outcome}", [o == outcome for o in clear]))
    small = [case.outcome for case in of_stratum if not is_clear(case)]
    below = f"{stratum}, gap < {CLEAR_CLASS_GAP:g}"
    figures.append(share_figure(kind, f"{below}: right", [o == RIGHT for o in small]))
    figures.append(share_figure(kind, f"{below}: wrong", [o in (WRONG, FAILED) for o in small]))
    return figures


def _false_figures(
    kind: str, cases: Sequence[ClassJudged], *, has_target: bool = True
) -> list[Figure]:
    """Names that are false; decays have no target, since one line shows too little."""
    nothing = [case for case in cases if case.label.family == NOTHING]
    outside = [case for case in cases if case.label.has_no_class and case not in nothing]
    inside = [case for case in cases if case.has_class]

    def at_most(name: str, hits: Sequence[bool], most: float) -> Figure:
        """Share of cases, wanted up to a limit where there is a target."""
        if not has_target:
            return share_figure(kind, name, hits)
        return share_figure(kind, name, hits, f"<= {100.0 * most:.0f} %", lambda p, n: p <= most)

    false = [bool(case.answer or case.laws) for case in nothing]
    named = [bool(case.laws) for case in outside]
    false_laws = [bool(case.false_laws) for case in inside]
    return [
        at_most("nothing missing: false class or law", false, _FALSE_AT_MOST[kind]),
        at_most("outside: law named", named, 0.01),
        share_figure(kind, "outside: class named", [bool(case.answer) for case in outside]),
        at_most("law named, class wrong", false_laws, 0.01),
    ]


def _changes(cases: Sequence[ClassJudged]) -> list[ChangeRow]:
    """Clear cases of a single cause, by the change of its form."""
    single = [
        case for case in cases if case.has_class and len(case.label.effects) == 1 and is_clear(case)
    ]
    rows = []
    for k, high in enumerate(CHANGES):
        low = CHANGES[k - 1] if k else -1.0
        name = "textbook" if k == 0 else f"{100 * low:.0f} to {100 * high:.0f} %"
        of_range = [case for case in single if low < case.largest_change <= high]
        rows.append(_change_row(name, of_range))
    others = [case for case in single if not CAUSES[case.label.effects[0]].library]
    return [*rows, _change_row("no law of the library", others)]


def _change_row(name: str, cases: Sequence[ClassJudged]) -> ChangeRow:
    right = sum(case.outcome == RIGHT for case in cases)
    named = [case for case in cases if case.laws]
    n_exact = sum(set(case.laws) <= set(case.label.acceptable[0]) for case in named)
    return ChangeRow(
        name,
        len(cases),
        right,
        wilson(right, len(cases)),
        len(named),
        n_exact,
        _median(_values(cases, "share")),
        _median(_values(cases, "law_share")),
    )


def _values(cases: Sequence[ClassJudged], key: str) -> list[float]:
    """A figure of the first class of every answer that has one."""
    answers: list[Any] = [case.verdict.document.get("classes") or ({},) for case in cases]
    return [float(entries[0][key]) for entries in answers if entries[0].get(key) is not None]


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if values else float("nan")


def _several_figures(kind: str, cases: Sequence[ClassJudged]) -> list[Figure]:
    """Figures of the cases with several causes of one kind; none without such a case."""
    if not cases:
        return []
    # Where no cause leaves two floors there is none to be found, but one can be false.
    asked = [case for case in cases if _judged(case).of_gap(CLEAR_CLASS_GAP)]
    finds = [_judged(case).finds_all(CLEAR_CLASS_GAP) for case in asked]
    none_false = [not _judged(case).false for case in cases]
    both = [hit and not _judged(case).false for hit, case in zip(finds, asked, strict=True)]
    figures = [
        share_figure(
            kind,
            f"{_HEAD}: every one of {CLEAR_CLASS_GAP:g} floors found",
            finds,
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
        of_number = [hit for hit, case in zip(finds, asked, strict=True) if _number(case) == number]
        figures.append(
            share_figure(kind, f"{_HEAD}, {number}: every one of 2 floors found", of_number)
        )
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


def _several_rows(kind: str, cases: Sequence[ClassJudged]) -> list[ClassRow]:
    """How often causes of each class are found, and each class is named falsely."""
    hits: dict[str, list[bool]] = {}
    instead: dict[str, Counter[str]] = {}
    partners_of_missed: dict[str, Counter[str]] = {}
    for case in cases:
        judged = _judged(case)
        clear = judged.of_gap(CLEAR_CLASS_GAP)
        missed = [cause.class_id for cause in clear if not cause.is_found]
        for cause in clear:
            hits.setdefault(cause.class_id, []).append(cause.is_found)
        for class_id in missed:
            instead.setdefault(class_id, Counter())[_words(case, judged.false)] += 1
        for class_id in judged.false:
            partners_of_missed.setdefault(class_id, Counter())[
                " + ".join(missed) or "none missed"
            ] += 1
    rows = [
        _row(
            kind,
            f"{_HEAD}: {class_id}",
            sum(of_class),
            len(of_class),
            instead.get(class_id, Counter()),
        )
        for class_id, of_class in sorted(hits.items())
    ]
    for class_id, partners in sorted(partners_of_missed.items()):
        without = [case for case in cases if class_id not in _classes(case)]
        right = len(without) - partners.total()
        rows.append(_row(kind, f"{_HEAD}: no {class_id}", right, len(without), partners))
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
    named = [cause.class_id for cause in _judged(case).causes if cause.is_found]
    answers = []
    for name in case.label.classes:
        shape = name.rpartition("/")[0]
        if shape in named and not answered.get(shape, UNDETERMINED).endswith(UNDETERMINED):
            answers.append(answered[shape] == name)
    return answers


@dataclass(frozen=True)
class Hit:
    """One parameter that answer and label both hold.

    `half_width` is over the true value, or in rad where the parameter is a direction.
    """

    name: str
    is_baseline: bool
    is_covered: bool
    half_width: float
    is_direction: bool = False


def covered_parameters(case: ClassJudged) -> list[Hit]:
    """Parameters of the baseline and of textbook laws that a right answer names.

    Parameters
    ----------
    case : ClassJudged
        A case; one without true parameters, or that is not right, gives none.

    Returns
    -------
    list of Hit
        Whether the 95 % interval holds the true value, and its half-width over that value.
    """
    if case.outcome != RIGHT:
        return []
    claimed = case.verdict.document.get("parameters") or {}
    hits = []
    for effect, values in case.label.parameters.items():
        for symbol, true in values.items():
            claim = claimed.get(effect, {}).get(symbol)
            interval = _interval(claim) if claim else None
            is_baseline = effect == "baseline"
            if interval is None or true == 0.0 or (is_baseline and symbol not in _OF_BASELINE):
                continue
            low, high = interval
            width = 0.5 * (high - low) / abs(true)
            hits.append(Hit(f"{effect}.{symbol}", is_baseline, low <= true <= high, width))
    return hits


def _interval(claim: Mapping[str, Any]) -> tuple[float, float] | None:
    """The claimed 95 % interval, or that of its standard deviation."""
    interval = claim.get("ci95")
    if interval and None not in interval:
        return float(interval[0]), float(interval[1])
    if claim.get("value") is None or claim.get("std") is None:
        return None
    value, std = float(claim["value"]), float(claim["std"])
    return value - _NORMAL_95 * std, value + _NORMAL_95 * std
