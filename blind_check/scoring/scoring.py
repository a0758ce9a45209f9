"""Score of a blind check.

Figures with what is wanted, confusion matrix, power; shares with Wilson intervals.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TypeVar

import numpy as np
from scipy import stats

from carrierflex.blind_check.labels import KINDS, MODEL, NOTHING, OUTSIDE, STAGE
from carrierflex.blind_check.scoring.class_judging import ClassJudged
from carrierflex.blind_check.scoring.judging import Judged
from carrierflex.blind_check.scoring.model_judging import (
    MODEL_GAP,
    false_laws,
    false_values,
    gap_beyond_drawing,
    is_of_model,
    model_classes,
)
from carrierflex.diagnosis.inference.results import AT_NOISE_FLOOR

#: Gap over the floor from which an effect has to be found.
CLEAR_GAP = 5.0
#: The same where the stage makes the gap.
STAGE_GAP = 2.0
#: Bins of the gap over the floor for the power.
BINS = (0.0, 1.0, 2.0, 5.0, 10.0, 20.0, math.inf)
#: Fewer cases judge no figure: one case of them would be more than the five percent wanted.
FEWEST = 20
#: Fewer cases cannot tell 99 % from all.
_FEWEST_FOR_99 = 100
_SECONDS = {"carrier": 60.0, "element": 60.0, "mounting": 120.0}
_NORMAL_95 = 1.959964
#: Share of an effect's largest parameter that counts as close: the truth has gains of 3 %, torques
#: of 1 %, laws of another form.
_CLOSE = 0.05


@dataclass(frozen=True)
class Figure:
    """One figure of the score.

    Parameters
    ----------
    kind, name, wanted : str
        Kind of campaign, what it is, what is wanted in words; empty where nothing is.
    value : float
        What was reached; not a number without cases.
    interval : tuple of float, optional
        Wilson interval at 95 % where the value is a share.
    cases : int
        Cases (of coverage of parameters: parameters).
    met : bool, optional
        Whether it is reached; None where nothing is wanted or the cases are too few to judge.
    """

    kind: str
    name: str
    wanted: str
    value: float
    interval: tuple[float, float] | None
    cases: int
    met: bool | None


@dataclass(frozen=True)
class ClassRow:
    """Row of the confusion matrix: how often a true class was met, and what was answered.

    Parameters
    ----------
    kind, name : str
        Kind of campaign and true class.
    cases, right : int
        Cases, and right answers.
    interval : tuple of float
        Wilson interval of the share at 95 %.
    answers : tuple of tuple
        Answer and how often it was given.
    """

    kind: str
    name: str
    cases: int
    right: int
    interval: tuple[float, float]
    answers: tuple[tuple[str, int], ...]


@dataclass(frozen=True)
class Score:
    """Figures, confusion matrix (gap of CLEAR_GAP floors or more.

    Every case of "nothing" and "outside") and the wrong cases.
    """

    figures: tuple[Figure, ...]
    confusion: tuple[ClassRow, ...]
    wrong: tuple[Judged, ...]

    @property
    def met(self) -> bool:
        """Whether no figure is missed that enough cases judge."""
        return all(figure.met is not False for figure in self.figures)


def wilson(hits: int, cases: int) -> tuple[float, float]:
    """Wilson score interval of a share at 95 % (Wilson 1927); from 0 to 1 without cases.

    >>> [round(end, 4) for end in wilson(81, 263)]
    [0.2553, 0.3662]
    """
    if cases == 0:
        return 0.0, 1.0
    interval = stats.binomtest(hits, cases).proportion_ci(method="wilson")
    return float(interval.low), float(interval.high)


def score(cases: Sequence[Judged]) -> Score:
    """Score of judged cases, kind by kind.

    Parameters
    ----------
    cases : sequence of Judged
        Every case of the check.

    Returns
    -------
    Score
        What is reached beside what is wanted.
    """
    figures: list[Figure] = []
    confusion: list[ClassRow] = []
    for kind in KINDS:
        of_kind = [case for case in cases if case.label.kind == kind]
        if of_kind:
            for head, of_noise in by_noise(of_kind):
                of_model = [case for case in of_noise if case.label.family == MODEL]
                others = [case for case in of_noise if case.label.family != MODEL]
                for make, group in ((_figures, others), (_model_figures, of_model)):
                    figures += named_after(head, make(kind, group) if group else ())
            confusion += confusion_rows(
                kind,
                [
                    (case.true_class, case.answered_class, case.is_right)
                    for case in of_kind
                    if is_clear(case)
                ],
            )
    wrong = tuple(case for case in cases if not case.is_right and is_clear(case))
    return Score(tuple(figures), tuple(confusion), wrong)


#: What the figures of cases begin with whose campaigns do not declare their noise.
UNDECLARED_NOISE = "noise not declared: "

Case = TypeVar("Case", Judged, ClassJudged)


def by_noise(cases: Sequence[Case]) -> list[tuple[str, list[Case]]]:
    """Cases that declare their noise and those that do not, each with the head of its figures."""
    groups = (
        (head, [case for case in cases if case.label.declares_noise is declared])
        for head, declared in (("", True), (UNDECLARED_NOISE, False))
    )
    return [(head, group) for head, group in groups if group]


def named_after(head: str, figures: Iterable[Figure]) -> list[Figure]:
    """Figures whose names begin with a head."""
    return [replace(figure, name=f"{head}{figure.name}") for figure in figures]


def is_clear(case: Judged) -> bool:
    """Whether a case must be answered rightly: a gap of CLEAR_GAP floors, or nothing to name."""
    return not case.has_effect or case.label.gap_over_floor >= CLEAR_GAP


def _figures(kind: str, cases: Sequence[Judged]) -> list[Figure]:
    of_stage = [case for case in cases if case.label.family == STAGE]
    effects = [case for case in cases if case.has_effect and case not in of_stage]
    clear = [case for case in effects if is_clear(case)]
    named = [case for case in effects if case.is_right and _rho(case) is not None]
    outside = [case for case in cases if case.label.family == OUTSIDE]
    false_nothing = [bool(case.named) for case in cases if case.label.family == NOTHING]
    unreal = [not set(case.named) <= set(case.label.present) for case in outside]
    figures = [
        share_figure(
            kind,
            "class right, gap >= 5 floors",
            [c.is_right for c in clear],
            ">= 90 %",
            lambda p, n: p >= 0.9,
        ),
        share_figure(
            kind, 'false naming, "nothing"', false_nothing, "<= 5 %", lambda p, n: p <= 0.05
        ),
        share_figure(
            kind,
            'false naming, "outside"',
            [bool(c.named) for c in outside],
            "<= 15 %",
            lambda p, n: p <= 0.15,
        ),
        share_figure(kind, '"outside": real sensor errors not counted', unreal),
        share_figure(
            kind,
            "rho inside its 95 % interval",
            [_is_covered(c) for c in named],
            "90 to 99 %",
            is_nominal,
        ),
        share_figure(
            kind,
            "parameters inside their 95 % interval",
            [hit for c in named for hit in _parameter_hits(c)],
        ),
        share_figure(
            kind,
            f"the same, or within {_CLOSE:.0%}".replace("%", " %"),
            [hit for c in named for hit in _parameter_hits(c, close=_CLOSE)],
        ),
        _stage_figure(kind, of_stage),
        _median_error(kind, named),
        share_figure(
            kind,
            "largest cell right, gap >= 5 floors",
            [_top_cell(c) for c in clear if c.label.where and "where" in c.verdict.document],
        ),
    ]
    for low, high in pairwise(BINS):
        inside = [case.is_right for case in effects if low <= case.label.gap_over_floor < high]
        figures.append(share_figure(kind, f"class right, gap {low:g} to {high:g} floors", inside))
    return figures + time_figures(kind, [case.verdict.seconds for case in cases])


def _model_figures(kind: str, cases: Sequence[Judged]) -> list[Figure]:
    """Figures of carriers off their drawing, or as drawn with any pin fit."""
    off = [case for case in cases if case.label.classes]
    clear = [case for case in off if case.label.gap_over_floor >= MODEL_GAP]
    beyond = [case for case in off if gap_beyond_drawing(case.label) >= MODEL_GAP]
    drawn = [case for case in cases if not case.label.effects]
    others = [case for case in cases if case.label.effects and not case.label.classes]
    silent = [case.verdict.document["verdict"] == AT_NOISE_FLOOR for case in beyond]
    return [
        share_figure(
            kind,
            "model: class right, gap >= 2 floors at the drawn sizes",
            [case.is_right for case in clear],
            ">= 90 %",
            lambda p, n: p >= 0.9,
        ),
        share_figure(
            kind,
            "model: class right, gap >= 2 floors beyond the drawing",
            [case.is_right for case in beyond],
        ),
        share_figure(
            kind,
            "model: values inside their 95 % interval",
            [hit for case in off if case.named for hit in _parameter_hits(case)],
            "90 to 99 %",
            is_nominal,
        ),
        share_figure(
            kind,
            "model: a true value named, alone or in a tie, gap >= 2 floors beyond the drawing",
            [not _true_values(case).isdisjoint(_tied(case)) for case in beyond],
        ),
        share_figure(
            kind,
            "model: the true values named alone, gap >= 2 floors beyond the drawing",
            [_true_values(case) == set(_values(case)) == _tied(case) for case in beyond],
        ),
        share_figure(
            kind,
            "model: a value named that is as drawn",
            [bool(false_values(case.label, case.named, _aliases(case))) for case in cases],
            "<= 2 %",
            lambda p, n: p <= 0.02,
        ),
        share_figure(
            kind,
            "model: named for another cause",
            [bool(model_classes(case.verdict, case.named)) for case in others],
            "<= 2 %",
            lambda p, n: p <= 0.02,
        ),
        share_figure(
            kind,
            "model: named as drawn, any pin fit",
            [bool(model_classes(case.verdict, case.named)) for case in drawn],
            "<= 2 %",
            lambda p, n: p <= 0.02,
        ),
        share_figure(
            kind,
            "model: planet pass or another law named for it",
            [bool(false_laws(case.label, case.named, _aliases(case))) for case in off],
            "<= 2 %",
            lambda p, n: p <= 0.02,
        ),
        share_figure(
            kind,
            "model: within the noise, gap >= 2 floors beyond the drawing",
            silent,
            "0 %",
            lambda p, n: p == 0.0,
        ),
        *time_figures(kind, [case.verdict.seconds for case in cases]),
    ]


def _aliases(case: Judged) -> Sequence[Sequence[str]]:
    return case.verdict.document.get("aliases") or ()


def _values(case: Judged) -> tuple[str, ...]:
    """Named dimensions and constants."""
    return tuple(name for name in case.named if is_of_model(name))


def _true_values(case: Judged) -> set[str]:
    return {name for name in case.label.effects if is_of_model(name)}


def _tied(case: Judged) -> set[str]:
    """Named dimensions and constants, and what shares an alias class with one."""
    named = set(_values(case))
    return named.union(*(members for members in _aliases(case) if named & set(members)))


def _stage_figure(kind: str, of_stage: Sequence[Judged]) -> Figure:
    """How often the stage's own effects are named rightly."""
    clear = [case for case in of_stage if case.label.gap_over_floor >= STAGE_GAP]
    return share_figure(
        kind,
        f"stage's own effects right, gap >= {STAGE_GAP:g} floors",
        [case.is_right for case in clear],
        ">= 90 %",
        lambda p, n: p >= 0.9,
    )


def share_figure(
    kind: str,
    name: str,
    hits: Iterable[bool],
    wanted: str = "",
    is_met: Callable[[float, int], bool] | None = None,
) -> Figure:
    """Figure of a share; fewer than FEWEST cases judge nothing."""
    outcomes = list(hits)
    n, k = len(outcomes), sum(outcomes)
    share = k / n if n else math.nan
    met = is_met(share, n) if is_met is not None and n >= FEWEST else None
    return Figure(kind, name, wanted, share, wilson(k, n), n, met)


def is_nominal(share: float, cases: int) -> bool:
    """Whether a coverage is 90 to 99 %; few cases cannot miss the upper end."""
    return share >= 0.9 and (share <= 0.99 or cases < _FEWEST_FOR_99)


def _median_error(kind: str, named: Sequence[Judged]) -> Figure:
    errors = [
        abs(float(case.verdict.document["how_far"]["rho"]) - case.label.rho) for case in named
    ]
    value = float(np.median(errors)) if errors else math.nan
    met = value <= 0.05 if len(errors) >= FEWEST else None
    return Figure(kind, "median |rho claimed - rho true|", "<= 0.05", value, None, len(errors), met)


def time_figures(kind: str, seconds: Sequence[float]) -> list[Figure]:
    """Median and longest time of a diagnosis."""
    limit, n = _SECONDS[kind], len(seconds)
    known = [value for value in seconds if not math.isnan(value)]
    longest = max(known, default=math.nan)
    met = longest <= limit if len(known) >= FEWEST else None
    median = float(np.median(known)) if known else math.nan
    return [
        Figure(kind, "seconds a case, median", "", median, None, n, None),
        Figure(kind, "seconds a case, longest", f"<= {limit:g}", longest, None, n, met),
    ]


def _rho(case: Judged) -> tuple[float, float] | None:
    """Claimed interval of rho; None where it is not finite."""
    reduction = case.verdict.document.get("how_far", {})
    low, high = reduction.get("rho_ci95", (None, None))
    return None if reduction.get("rho") is None or low is None or high is None else (low, high)


def _is_covered(case: Judged) -> bool:
    interval = _rho(case)
    return interval is not None and interval[0] <= case.label.rho <= interval[1]


def _parameter_hits(case: Judged, *, close: float = 0.0) -> list[bool]:
    """For every parameter that answer and label both name."""
    hits = []
    for effect, claimed in case.verdict.document.get("parameters", {}).items():
        values = case.label.parameters.get(effect, {})
        for name, true in values.items():
            claim = claimed.get(name)
            if claim is None or claim["value"] is None or claim["std"] is None:
                continue
            alike = [
                abs(values[key])
                for key, other in claimed.items()
                if key in values and other["unit"] == claim["unit"]
            ]
            hits.append(
                abs(claim["value"] - true) <= max(_NORMAL_95 * claim["std"], close * max(alike))
            )
    return hits


def _top_cell(case: Judged) -> bool:
    """Whether the largest cell has the true order and pattern."""
    cells = case.verdict.document.get("where", ())
    if not cells:
        return False
    top, where = max(cells, key=lambda cell: cell["share"] or 0.0), case.label.where
    if "order" not in where:
        return all(top.get(name) == value for name, value in where.items())
    static = top["order"] == where["order"] == 0
    patterns = [
        str(cell["channel_pattern"]).replace("-1", "+1" if static else "-1")
        for cell in (top, where)
    ]
    return bool(top["order"] == where["order"] and patterns[0] == patterns[1])


def confusion_rows(kind: str, cases: Iterable[tuple[str, str, bool]]) -> list[ClassRow]:
    """Rows of the confusion matrix, of cases as (truth, answer, whether it is right)."""
    answered: dict[str, list[tuple[str, bool]]] = {}
    for truth, answer, is_right in cases:
        answered.setdefault(truth, []).append((answer, is_right))
    rows = []
    for truth, outcomes in sorted(answered.items()):
        right, n = sum(is_right for _, is_right in outcomes), len(outcomes)
        answers = Counter(answer for answer, _ in outcomes).most_common()
        rows.append(ClassRow(kind, truth, n, right, wilson(right, n), tuple(answers)))
    return rows
