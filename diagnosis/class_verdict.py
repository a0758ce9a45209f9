"""The verdict of both answers: the class that the records show, and the laws that the search named.

Columns of the table: class, law, what is left; see docs/diagnosis.md.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, permutations

from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.results import (
    LEADING_CLASS,
    NAMED_CLASS,
    NO_CLASS,
    NOT_VISIBLE,
    NOTHING,
    ClassAnswer,
    ClassFinding,
)
from carrierflex.diagnosis.comparison.effect_names import plain_name
from carrierflex.diagnosis.comparison.problem import Effects
from carrierflex.diagnosis.inference.results import (
    ALIASED,
    AT_NOISE_FLOOR,
    CLASS_NAMED,
    NAMING,
    NONE_OF_THESE,
    NOT_DIAGNOSABLE,
    GapReduction,
)
from carrierflex.diagnosis.inference.thresholds import Thresholds

#: Share by which laws may stay behind their class and still be named.
_BEHIND = 0.01
#: Share from which laws that were simulated are believed although no class is seen in force space.
_NAMED_BY_SIMULATION = 0.91


@dataclass(frozen=True, eq=False)
class JointVerdict:
    """Verdict of both answers.

    Parameters
    ----------
    verdict, reason : str
        Verdict and its reason.
    effects : tuple of str
        Laws that are named.
    answer : ClassAnswer
        Classes, where the law decides between tied ones reduced to its own.
    reduction : GapReduction
        How far what is named shrinks the gap.
    """

    verdict: str
    reason: str
    effects: Effects
    answer: ClassAnswer
    reduction: GapReduction


def joint_verdict(
    verdict: str,
    reason: str,
    laws: Effects,
    reduction: GapReduction,
    answer: ClassAnswer,
) -> JointVerdict:
    """Verdict from the search for laws and the comparison of classes.

    Parameters
    ----------
    verdict, reason : str
        What the search for laws alone says.
    laws : tuple of str
        Laws of its best set.
    reduction : GapReduction
        How far that set shrinks the gap.
    answer : ClassAnswer
        What the comparison of classes says.

    Returns
    -------
    JointVerdict
        One row of the table.
    """
    named = laws if verdict in NAMING else ()
    if answer.state == NOT_VISIBLE and not named and verdict != AT_NOISE_FLOOR:
        return JointVerdict(NOT_DIAGNOSABLE, answer.note, (), answer, reduction)
    if answer.state in (NOTHING, NOT_VISIBLE):
        kept = _of_laws(answer, named, reduction)
        return JointVerdict(verdict, reason, named, kept, reduction)
    if verdict == AT_NOISE_FLOOR and answer.state == LEADING_CLASS:
        # Noise of the motion in a contained law is no white noise in force space: a class that only
        # leads there says less than the records, which the simulation meets to their noise.
        return JointVerdict(verdict, reason, (), _silent(answer), reduction)
    if answer.same_scores and (verdict == AT_NOISE_FLOOR or _stand(named, answer, reduction)):
        kept = _of_laws(_silent(answer), named, reduction, answer.ids)
        return JointVerdict(verdict, reason, named, kept, reduction)
    covered = _covered(named, answer) or _with_small_causes(named, answer, reduction)
    if covered is not None and _follow(answer, reduction):
        resolved = _with_named_laws(answer, covered, named)
        return JointVerdict(verdict, reason, named, resolved, reduction)
    if answer.state == NO_CLASS:
        return _without_class(verdict, reason, named, answer, reduction)
    return _of_class(answer, named, reduction)


def _stand(laws: Effects, answer: ClassAnswer, reduction: GapReduction) -> bool:
    """Whether named laws leave no more than noise, or no more than the classes do.

    Of laws and classes that are scored alike the laws, which have fewer parameters, are believed
    unless a class explains as much more as a second cause would.
    """
    behind = min(answer.share, 1.0) - reduction.phi
    near_floor = reduction.floor_multiple <= Thresholds().gap_beyond_floor
    return bool(laws) and (near_floor or behind <= ClassConstants().second_cause)


def _silent(answer: ClassAnswer) -> ClassAnswer:
    """Answer that names no class."""
    return replace(answer, state=NOTHING, classes=(), ties=(), learnt_by=())


def _follow(answer: ClassAnswer, reduction: GapReduction) -> bool:
    """Whether the laws explain what their class does."""
    equal = all(finding.law_named for finding in answer.classes)
    return equal or reduction.phi >= min(answer.share, 1.0) - _BEHIND


def _covered(laws: Effects, answer: ClassAnswer) -> tuple[str, ...] | None:
    """Classes of the answer, or of a tie, each of which holds one law and every law in one.

    Also the answer with the class that learns some of what it leaves.
    """
    if not laws:
        return None
    for classes in (answer.ids, *answer.ties, (*answer.ids, *answer.learnt_by)):
        if _covers(laws, classes, answer):
            return classes
    return None


def _with_small_causes(
    laws: Effects, answer: ClassAnswer, reduction: GapReduction
) -> tuple[str, ...] | None:
    """Classes of the answer and of further laws that take at least half of what it leaves.

    A cause too small beside the first to be a class of its own is seen once it is simulated.
    """
    classes = answer.ids
    further = [law for law in laws if not set(answer.classes_of_law.get(law, ())) & set(classes)]
    own = tuple(law for law in laws if law not in further)
    if not further or not all(answer.classes_of_law.get(law) for law in further):
        return None
    if not own or not _covers(own, classes, answer):
        return None
    most_left = (1.0 - ClassConstants().gain_of_left) * (1.0 - answer.share)
    if 1.0 - reduction.phi > most_left:
        return None
    return (*classes, *dict.fromkeys(answer.classes_of_law[law][0] for law in further))


def _covers(laws: Effects, classes: Sequence[str], answer: ClassAnswer) -> bool:
    """Whether every class holds a law, and every law lies in one of the classes."""
    holders = {law: set(answer.classes_of_law.get(law, ())) for law in laws}
    if not all(holders[law] & set(classes) for law in laws):
        return False
    if len(laws) < len(classes):
        return False
    return any(
        all(own in holders[law] for own, law in zip(classes, order, strict=False))
        for order in permutations(laws)
    )


def _with_named_laws(answer: ClassAnswer, classes: tuple[str, ...], laws: Effects) -> ClassAnswer:
    """Answer of the classes whose laws are named.

    Those that a tie put in question, or a second one that the laws show beside the first.
    """
    known = {finding.id: finding for finding in answer.classes}
    findings = []
    for name in classes:
        held = [law for law in laws if name in answer.classes_of_law.get(law, ())]
        found = known.get(name) or _of_named_law(
            answer, name, held[0], is_second=bool(known.keys() & set(classes))
        )
        law = found.law if found.law in held or not held else held[0]
        findings.append(replace(found, law=law, law_named=True))
    ties = answer.ties
    if set(classes) in [set(tied) for tied in answer.ties]:
        ties = (answer.ids, *(tied for tied in answer.ties if set(tied) != set(classes)))
    return replace(answer, classes=tuple(findings), ties=ties)


def _of_named_law(answer: ClassAnswer, name: str, law: str, *, is_second: bool) -> ClassFinding:
    """Class that the comparison of classes alone did not name."""
    share = answer.beyond_learnable if is_second else answer.share
    return ClassFinding(
        name, share, (0.0, 1.0) if is_second else answer.share_ci95, law, share, True
    )


def _without_class(
    verdict: str, reason: str, named: Effects, answer: ClassAnswer, reduction: GapReduction
) -> JointVerdict:
    """No class explains the gap in force space.

    Nothing is named, unless simulated laws explain what no class can see there: while dry friction
    sticks, the speed is zero and its force is no function of the motion.
    """
    if not named:
        return JointVerdict(verdict, reason, (), answer, reduction)
    if reduction.phi >= max(_NAMED_BY_SIMULATION, answer.learnable):
        kept = _of_laws(answer, named, reduction)
        return JointVerdict(verdict, reason, named, kept, reduction)
    text = (
        f"the best class explains {max(answer.share, 0.0):.0%} of the gap in force space, so that "
        f"{_listed(named)} is no cause of it; all classes together learn "
        f"{min(max(answer.learnable, 0.0), 1.0):.0%}"
    )
    return JointVerdict(NONE_OF_THESE, text, (), answer, reduction)


def _of_laws(
    answer: ClassAnswer, laws: Effects, reduction: GapReduction, seen: Sequence[str] = ()
) -> ClassAnswer:
    """Answer whose classes are those of the laws that the search named.

    Of the classes of a law the one that was `seen`, else its own.
    """
    held: dict[str, str] = {}
    for law in laws:
        own = answer.classes_of_law.get(law, ())
        for name in (*(name for name in own if name in seen), *own)[:1]:
            held.setdefault(name, law)
    if not held:
        return answer
    share, interval = min(reduction.phi, 1.0), reduction.phi_ci95
    parts = _parts(held, answer, reduction)
    findings = tuple(
        ClassFinding(
            name,
            share * parts[name],
            (interval[0] * parts[name], interval[1] * parts[name]),
            law,
            share * parts[name],
            law_named=True,
        )
        for name, law in held.items()
    )
    return replace(
        answer,
        state=NAMED_CLASS,
        classes=findings,
        rivals={name: share for name, share in answer.rivals.items() if name not in held},
        share=share,
        share_ci95=interval,
        law_share=share,
    )


def _parts(
    classes: Mapping[str, str], answer: ClassAnswer, reduction: GapReduction
) -> dict[str, float]:
    """Part of each class in what the laws explain together; all parts add up to one.

    A law's part is the mean square that goes as it is added to those before it, largest first.
    Laws of one class add up.
    """
    gone = dict.fromkeys(classes, 0.0)
    for before, after in pairwise(reduction.steps):
        holders = [name for name in answer.classes_of_law.get(after.added, ()) if name in classes]
        for name in holders[:1]:
            gone[name] += max(before.rms**2 - after.rms**2, 0.0)
    total = sum(gone.values())
    if total > 0.0:
        return {name: square / total for name, square in gone.items()}
    return {name: 1.0 / len(classes) for name in classes}


def _of_class(answer: ClassAnswer, laws: Effects, reduction: GapReduction) -> JointVerdict:
    """The class is the answer; its laws are the nearest ones."""
    share = min(answer.share, 1.0)
    classes = " with ".join(plain_name(name) for name in answer.ids)
    text = (
        f"{classes} explains {share:.1%} of the gap above the floor (mean square) on held-out "
        "records"
    )
    nearest = [finding for finding in answer.classes if finding.law]
    if nearest:
        text += "; nearest law " + ", ".join(
            f"{plain_name(finding.law)} {min(max(finding.law_share, 0.0), 1.0):.0%}"
            for finding in nearest
        )
    one_of_pair = _named_in_pair(answer, laws)
    findings = tuple(
        replace(finding, law_named=finding.law in one_of_pair) for finding in answer.classes
    )
    kept = replace(answer, classes=findings)
    if answer.ties and answer.state == NAMED_CLASS:
        tied = {name for names in (answer.ids, *answer.ties) for name in names}
        effects = tuple(law for law in laws if tied <= set(answer.classes_of_law.get(law, ())))
        others = ", ".join(" with ".join(plain_name(n) for n in names) for names in answer.ties)
        text += f"; {others} predicts held-out records as well"
        return JointVerdict(ALIASED, text, effects, kept, _class_reduction(answer, reduction))
    return JointVerdict(CLASS_NAMED, text, one_of_pair, kept, _class_reduction(answer, reduction))


def _named_in_pair(answer: ClassAnswer, laws: Effects) -> Effects:
    """Laws of a named pair that both the search names and the class cannot be told from."""
    if answer.state != NAMED_CLASS or len(answer.classes) < 2:
        return ()
    return tuple(
        finding.law for finding in answer.classes if finding.law_named and finding.law in laws
    )


def _class_reduction(answer: ClassAnswer, reduction: GapReduction) -> GapReduction:
    """How far the class model shrinks the gap.

    Its share of the square above the floor is that of its comparison (an element's in force space);
    what such a share leaves of the gap in the channel's unit never lies below the floor. A baseline
    that runs away leaves no such gap.
    """
    before, floor = reduction.rms_before, reduction.noise_floor
    phi = min(answer.share, 1.0)
    low, high = (min(end, 1.0) for end in answer.share_ci95)
    shares = replace(reduction, phi=phi, phi_ci95=(low, high))
    if not (math.isfinite(before) and before > 0.0):
        return shares
    at_floor = min(floor / before, 1.0)

    def ratio(share: float) -> float:
        """RMS after over before where a share is explained."""
        return math.sqrt(at_floor**2 + (1.0 - share) * (1.0 - at_floor**2))

    after = ratio(phi)
    return replace(
        shares,
        rms_after=after * before,
        rho=after,
        rho_ci95=(ratio(high), ratio(low)),
        floor_multiple=after * before / floor if floor > 0.0 else math.inf,
    )


def _listed(laws: Effects) -> str:
    return " with ".join(plain_name(law) for law in laws)
