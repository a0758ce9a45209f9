"""What two answers to the same sealed case are worth, side by side.

Cases are judged by class (:mod:`carrierflex.blind_check.scoring.class_judging`). Where a case
withholds laws of the library (families single, pair, aliased, one_condition and stage of kinds
carrier and mounting), its classes are those of the laws, or of laws that the label accepts in
their place: an answer that holds only these is right too. An answer that names laws but no class
has the classes of its laws. A line off the shaft's orders is neither class nor law of the library:
it is counted by itself, and judged neither right nor wrong.
"""

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

from carrierflex.blind_check.labels import FORM_FAMILIES, NOTHING, OUTSIDE, Label
from carrierflex.blind_check.scoring.class_judging import (
    CLASSES_OF_LAW,
    CLEAR_CLASS_GAP,
    RIGHT,
    TIE,
    ClassJudged,
    judge_by_class,
)
from carrierflex.blind_check.scoring.class_score import covered_parameters
from carrierflex.blind_check.scoring.judging import judge
from carrierflex.blind_check.scoring.scoring import wilson
from carrierflex.blind_check.sealing.check import LABELS_FILE
from carrierflex.blind_check.sealing.verdicts import ERROR, Verdict
from carrierflex.blind_check.truth.element.families import CAUSES
from carrierflex.diagnosis.inference.results import AT_NOISE_FLOOR, NAMED, NamedValue
from carrierflex.diagnosis.report.diagnosis_files import DIAGNOSIS_FILE, read_diagnosis
from validation.law_coverage import (
    RHO,
    covered_values,
    has_true_parameters,
)

_NORMAL_95 = 1.959964
#: Id of a line off the shaft's orders.
_LINE = re.compile(r"(nonsynchronous|channel)/[0-9.]+(X|Hz)")


@dataclass(frozen=True, eq=False)
class ScoredAnswer:
    """One answer to one sealed case.

    Parameters
    ----------
    verdict : str
        Verdict word.
    answer : str
        Classes, ties included.
    laws : tuple of str
        Laws that are named.
    nearest_laws : tuple of str
        Nearest law of each class of the answer.
    outcome : str
        Outcome by class.
    has_class_tie, has_law_tie : bool
        Whether the answer holds other sets of classes beside its own; other laws beside one named.
    is_law_right : bool, optional
        Whether the laws named are the truth's, alone or in a tie that holds them; None where the
        truth is no textbook law.
    is_nearest_right : bool, optional
        The same of the nearest laws of the classes.
    is_law_false : bool
        Whether a law is named whose class is wrong, or where nothing or no class is missing.
    is_law_other : bool
        Whether the truth is a textbook law and others are named, of the right class or not.
    names_line : bool
        Whether a line off the shaft's orders is named.
    causes_found : int
        True classes that the answer holds, in its classes or as classes of the laws named.
    rho_hit : bool, optional
        Whether the interval of rho holds the true value; None where the laws are not right or no
        interval is given.
    parameter_hits : tuple of bool
        Whether the interval of each scored parameter holds the true value.
    seconds : float
        Processor time [s].
    """

    verdict: str
    answer: str
    laws: tuple[str, ...]
    nearest_laws: tuple[str, ...]
    outcome: str
    has_class_tie: bool
    has_law_tie: bool
    is_law_right: bool | None
    is_nearest_right: bool | None
    is_law_false: bool
    is_law_other: bool
    names_line: bool
    causes_found: int
    rho_hit: bool | None
    parameter_hits: tuple[bool, ...]
    seconds: float

    @property
    def is_class_right(self) -> bool:
        """Whether the class is right, or nothing is named where nothing can be."""
        return self.outcome == RIGHT

    @property
    def says_noise(self) -> bool:
        """Whether the verdict is that the gap is noise."""
        return self.verdict == AT_NOISE_FLOOR


def read_labels(truth: Path) -> dict[str, Label]:
    """Labels of every kind, as they were sealed.

    Parameters
    ----------
    truth : Path
        Folder with a folder for each kind.
    """
    return {
        case: Label.from_text(json.dumps(content))
        for path in sorted(truth.glob(f"*/{LABELS_FILE}"))
        for case, content in json.loads(path.read_text(encoding="utf-8")).items()
    }


def with_classes(label: Label) -> Label:
    """Label whose withheld laws are told by their classes too; any other as it is."""
    if label.classes or label.kind == "element" or label.family in (NOTHING, OUTSIDE):
        return label
    table = CLASSES_OF_LAW[label.kind]
    first, *others = (
        tuple(sorted({table[law][0] for law in laws})) for laws in product(*label.acceptable)
    )
    return replace(label, classes=first, class_aliases=tuple(sorted(set(others) - {first})))


def textbook_laws(label: Label) -> tuple[str, ...]:
    """Laws of the library that a case withholds; empty where one of its causes is none."""
    if label.family in (NOTHING, OUTSIDE, *FORM_FAMILIES):
        return ()
    if label.kind != "element":
        return label.effects
    laws = tuple(CAUSES[name].library for name in label.effects)
    return laws if all(laws) else ()


def read_answer(row: Mapping[str, Any], folder: Path) -> Verdict:
    """Answer that `run_tree` wrote of one case; a failed diagnosis is an error.

    Parameters
    ----------
    row : mapping
        Line of the answers.
    folder : Path
        Folder of their documents.
    """
    if row["error"] is not None:
        return Verdict({"verdict": ERROR, "reason": row["error"]}, row["seconds"])
    return Verdict(read_diagnosis(folder / row["case"] / DIAGNOSIS_FILE), row["seconds"])


def scored_answer(label: Label, verdict: Verdict) -> ScoredAnswer:
    """Score one answer.

    Parameters
    ----------
    label : Label
        The truth, from :func:`with_classes`.
    verdict : Verdict
        The answer.
    """
    document = verdict.document
    classes = [str(entry["id"]) for entry in document.get("classes") or ()]
    judged = _judged(label, _with_classes_of_laws(_without_lines(verdict)))
    nearest = tuple(
        str(entry["law"]) for entry in document.get("classes") or () if entry.get("law")
    )
    true_laws = textbook_laws(label)
    is_right = _names_laws(label, verdict, judged.laws) if true_laws else None
    has_aliases = bool(judged.laws) and any(
        set(members) & set(judged.laws) for members in document.get("aliases") or ()
    )
    rho, hits = _interval_hits(label, verdict, judged, is_law_right=bool(is_right))
    return ScoredAnswer(
        verdict=str(document["verdict"]),
        answer=judged.answered,
        laws=tuple(sorted(judged.laws)),
        nearest_laws=nearest,
        outcome=judged.outcome,
        has_class_tie=bool(document.get("class_ties")),
        has_law_tie=has_aliases,
        is_law_right=is_right,
        is_nearest_right=_names_laws(label, verdict, nearest) if true_laws else None,
        is_law_false=bool(judged.false_laws),
        is_law_other=bool(true_laws) and bool(judged.laws) and not is_right,
        names_line=any(_LINE.fullmatch(name) for name in classes),
        causes_found=_causes_found(label, judged),
        rho_hit=rho,
        parameter_hits=hits,
        seconds=verdict.seconds,
    )


def _judged(label: Label, verdict: Verdict) -> ClassJudged:
    """Judgement by class; of withheld laws the best over the sets that the label accepts."""
    judged = judge_by_class(label, verdict)
    if label.drive or label.kind == "element" or not label.class_aliases:
        return judged
    sets = (label.classes, *label.class_aliases)
    others = [
        judge_by_class(
            replace(
                label, classes=classes, class_aliases=tuple(ids for ids in sets if ids != classes)
            ),
            verdict,
        )
        for classes in label.class_aliases
    ]
    best = min(
        (judged, *others),
        key=lambda judgement: (judgement.outcome != RIGHT, judgement.outcome != TIE),
    )
    return replace(best, label=label)


def _without_lines(verdict: Verdict) -> Verdict:
    """Answer without the lines off the shaft's orders."""
    document = dict(verdict.document)
    if document.get("classes"):
        document["classes"] = [
            entry for entry in document["classes"] if not _LINE.fullmatch(str(entry["id"]))
        ]
        document["class_ties"] = [
            [name for name in ids if not _LINE.fullmatch(name)]
            for ids in document.get("class_ties") or ()
        ]
    return Verdict(document, verdict.seconds)


def _with_classes_of_laws(verdict: Verdict) -> Verdict:
    """Answer without the key of its classes where it names laws and no class."""
    document = verdict.document
    if document.get("classes") or not document.get("effects"):
        return verdict
    remaining = {key: value for key, value in document.items() if key != "classes"}
    return Verdict(remaining, verdict.seconds)


def _names_laws(label: Label, verdict: Verdict, laws: Sequence[str]) -> bool:
    """Whether laws are those withheld, or what the label accepts in their place."""
    if not laws:
        return False
    document = {
        "verdict": NAMED,
        "effects": list(laws),
        "aliases": verdict.document.get("aliases") or [],
    }
    effects = textbook_laws(label)
    return judge(replace(label, effects=effects), Verdict(document, verdict.seconds)).is_right


def _causes_found(label: Label, judged: ClassJudged) -> int:
    """True classes in the answer or among the classes of its laws, frame and pattern compared."""
    if not judged.has_class or judged.outcome not in (RIGHT, TIE, "wrong"):
        return 0
    table = CLASSES_OF_LAW[label.kind]
    named = {_shape(name) for name in judged.answer}
    named |= {_shape(name) for law in judged.laws for name in table.get(law, ())}
    return len({_shape(name) for name in label.classes} & named)


def _shape(class_id: str) -> str:
    frame, separator, _ = class_id.rpartition("/")
    return frame if class_id.count("/") == 2 and separator else class_id


def _interval_hits(
    label: Label, verdict: Verdict, judged: ClassJudged, *, is_law_right: bool
) -> tuple[bool | None, tuple[bool, ...]]:
    """Whether rho and the scored parameters lie inside the intervals of an answer."""
    document = verdict.document
    low, high = (document.get("how_far") or {}).get("rho_ci95") or (None, None)
    interval = None if low is None or high is None else (float(low), float(high))
    if not is_law_right:
        interval = None
    rho = interval[0] <= label.rho <= interval[1] if interval else None
    if label.kind == "element":
        return rho, tuple(hit.is_covered for hit in covered_parameters(judged))
    if interval is None:
        return rho, ()
    is_scored = set(judged.laws) == set(label.effects) and has_true_parameters(
        label.kind, label.effects
    )
    if not is_scored:
        return rho, ()
    parameters = {
        effect: {
            name: value for name, entry in values.items() if (value := _named(entry)) is not None
        }
        for effect, values in document["parameters"].items()
    }
    hits = covered_values(label, parameters, interval)
    return rho, tuple(hit.is_covered for hit in hits if hit.name != RHO)


def _named(entry: Mapping[str, Any]) -> NamedValue | None:
    """Parameter of a document; None where it has no interval."""
    value, std = entry.get("value"), entry.get("std")
    if value is None or std is None:
        return None
    low, high = entry.get("ci95") or (None, None)
    if low is None or high is None:
        low, high = value - _NORMAL_95 * std, value + _NORMAL_95 * std
    return NamedValue(float(value), float(std), entry["unit"], (float(low), float(high)))


def is_clear(label: Label) -> bool:
    """Whether a case has to be answered rightly: a gap of two floors, or nothing to name."""
    return label.has_no_class or label.gap_over_floor >= CLEAR_CLASS_GAP


def paired_difference(first: Sequence[bool], second: Sequence[bool]) -> tuple[float, float, float]:
    """Difference of two paired shares with its 95 % interval.

    Square-and-add limits of Newcombe (1998), method 10: Wilson limits of both shares, with the
    correlation of the fourfold table, continuity corrected.

    Parameters
    ----------
    first, second : sequence of bool
        Outcomes of the same cases.

    Returns
    -------
    tuple of float
        Share of `first` minus that of `second`, lower and upper limit.

    Examples
    --------
    >>> first = [True] * 48 + [False] * 2
    >>> second = [True] * 36 + [False] * 12 + [True] * 2
    >>> [round(value, 4) for value in paired_difference(first, second)]
    [0.2, 0.0569, 0.3404]
    """
    n = len(first)
    if n == 0:
        return math.nan, -1.0, 1.0
    pairs = list(zip(first, second, strict=True))
    both = sum(a and b for a, b in pairs)
    only_first, only_second = sum(a > b for a, b in pairs), sum(a < b for a, b in pairs)
    neither = n - both - only_first - only_second
    hits_1, hits_2 = both + only_first, both + only_second
    p1, p2 = hits_1 / n, hits_2 / n
    (l1, u1), (l2, u2) = wilson(hits_1, n), wilson(hits_2, n)
    product_of_margins = hits_1 * (n - hits_1) * hits_2 * (n - hits_2)
    cross = float(both * neither - only_first * only_second)
    if cross > 0.0:
        cross = max(cross - n / 2.0, 0.0)
    phi = cross / math.sqrt(product_of_margins) if product_of_margins else 0.0
    below = (p1 - l1) ** 2 - 2.0 * phi * (p1 - l1) * (u2 - p2) + (u2 - p2) ** 2
    above = (p2 - l2) ** 2 - 2.0 * phi * (p2 - l2) * (u1 - p1) + (u1 - p1) ** 2
    delta = p1 - p2
    return delta, delta - math.sqrt(max(below, 0.0)), delta + math.sqrt(max(above, 0.0))
