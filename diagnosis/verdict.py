"""The verdict, from the classes that the table shows and the laws fitted in the simulator."""

import math
from collections.abc import Callable, Mapping, Sequence
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
from carrierflex.diagnosis.comparison.effect_names import plain_name, set_name
from carrierflex.diagnosis.comparison.problem import Effects
from carrierflex.diagnosis.inference.law_fits import Selection
from carrierflex.diagnosis.inference.results import (
    ALIASED,
    AT_NOISE_FLOOR,
    CLASS_NAMED,
    NAMED,
    NAMED_WITH_REMAINDER,
    NAMING,
    NONE_OF_THESE,
    NOT_DIAGNOSABLE,
    GapReduction,
)
from carrierflex.diagnosis.inference.thresholds import Thresholds

#: Of classes that one drive mixes, or of more causes than two.
_NOT_WHICH = "and these records do not show which"


@dataclass(frozen=True, eq=False)
class Verdict:
    """What is said of the cause."""

    verdict: str
    reason: str
    effects: Effects  # Laws that are named
    #: Classes; where a law decides between tied ones reduced to its own. None where the records are
    #: too short for a comparison of classes.
    answer: ClassAnswer | None
    reduction: GapReduction  # How far what is named shrinks the gap
    reason_id: str = ""  # FLOOR_UNKNOWN where the size of the noise is not known; else empty
    experiment: str = ""  # What would decide it; empty where the verdict needs nothing more


def verdict_of(
    selection: Selection,
    reduction: GapReduction,
    answer: ClassAnswer | None,
    limits: Thresholds,
    *,
    floor_is_measured: bool,
    by_shapes: Callable[[ClassAnswer], GapReduction | str | None] = lambda answer: None,
    predictive: Effects = (),
    measured: Effects = (),
) -> Verdict:
    """Verdict from the laws that were fitted and the classes of the table.

    The first of these that holds: nothing visible; no gap; laws that lie in the classes of the
    answer, or explain as much as all classes; the class; none of these. `by_shapes` says how far
    the measured shapes of an answer shrink the gap in the simulator, or why the records do not
    support them there (None: a class has none); `predictive` are laws of which the size alone is
    free, and `measured` those of files: their shape is that of other records.
    """
    verdict, reason = _of_laws(
        selection, reduction, answer, limits, floor_is_measured=floor_is_measured
    )
    # The one that explains most first.
    rank = {step.added: k for k, step in enumerate(reduction.steps)}
    ordered = tuple(sorted(selection.accepted, key=lambda law: rank.get(law, 0)))
    laws = ordered if verdict in NAMING else ()
    if answer is None:
        return Verdict(verdict, reason, laws, None, reduction)
    if answer.state == NOT_VISIBLE and not laws and verdict != AT_NOISE_FLOOR:
        return Verdict(NOT_DIAGNOSABLE, answer.note, (), answer, reduction)
    if answer.state in (NOTHING, NOT_VISIBLE):
        return Verdict(verdict, reason, laws, _by_laws(answer, laws, reduction), reduction)
    if verdict == AT_NOISE_FLOOR and (answer.state == LEADING_CLASS or answer.same_scores):
        # Noise of the motion in a contained law is no white noise in force space: a class that only
        # leads there says less than the records, which the simulation meets to their noise.
        return Verdict(verdict, reason, (), _silent(answer), reduction)
    if answer.same_scores and _are_enough(laws, answer, reduction, limits):
        named = _by_laws(_silent(answer), laws, reduction, answer.ids)
        ties = _open_ties(answer, named.ids, laws, predictive)
        if ties and verdict in NAMING:
            others = ", ".join(_listed(names) for names in ties)
            text = f"{reason}; {others} predicts held-out records as well"
            return Verdict(ALIASED, text, (), replace(named, ties=ties), reduction)
        return Verdict(verdict, reason, laws, named, reduction)
    covered = _covered(laws, answer) or _with_small_causes(laws, answer, reduction)
    is_near_floor = reduction.floor_multiple <= limits.near_floor
    shapes = None
    if covered is not None and _follow(answer, reduction, limits):
        is_textbook = not set(laws) & set(measured)
        is_open = verdict in (NAMED, NAMED_WITH_REMAINDER) and covered == answer.ids and is_textbook
        shapes = by_shapes(answer) if is_open and not is_near_floor else None
        if not _leave_far_less(shapes, reduction):
            named = _with_named_laws(answer, covered, laws)
            return Verdict(verdict, reason, laws, named, reduction)
    if answer.state == NO_CLASS:
        return _without_class(verdict, reason, laws, answer, reduction, limits)
    shapes = shapes or by_shapes(answer)
    are_worse = isinstance(shapes, str) or _leave_far_less(reduction, shapes)
    if laws and is_near_floor and are_worse:
        # In force space a friction that stops the mass stands in a further class.
        return Verdict(verdict, reason, laws, _by_laws(answer, laws, reduction), reduction)
    least = ClassConstants().leading_share
    if isinstance(shapes, GapReduction) and shapes.phi < least:
        text = (
            f"{_listed(answer.ids)} explains {min(answer.share, 1.0):.0%} of the gap along the "
            f"measured motion, but {max(shapes.phi, 0.0):.0%} of it once simulated on held-out "
            f"records; a cause explains at least {least:.0%}"
        )
        return Verdict(NONE_OF_THESE, text, (), replace(answer, state=NO_CLASS), reduction)
    return _of_class(answer, laws, reduction, shapes)


def _of_laws(
    selection: Selection,
    reduction: GapReduction,
    answer: ClassAnswer | None,
    limits: Thresholds,
    *,
    floor_is_measured: bool,
) -> tuple[str, str]:
    """Verdict of the fits alone, and its reason."""
    floor, laws = reduction.noise_floor, selection.accepted
    ratio = (reduction.rms_before / floor) ** 2 if floor > 0.0 else math.inf
    highest = limits.floor_ratio if floor_is_measured else limits.floor_ratio_estimated
    # Of a floor that is estimated, laws must explain what is a gap above a known one.
    square_explained = reduction.rms_before**2 - reduction.rms_after**2
    are_small = square_explained < (limits.floor_ratio - 1.0) * floor**2
    if ratio <= highest and (floor_is_measured or not laws or are_small):
        return (
            AT_NOISE_FLOOR,
            f"the held-out gap is {ratio:.3f} times the mean square of the noise floor",
        )
    learns_nothing = answer is None or answer.state == NOTHING
    may_be_coloured = not floor_is_measured and ratio <= ClassConstants().coloured_ratio
    if may_be_coloured and learns_nothing and not laws:
        return AT_NOISE_FLOOR, (
            f"the held-out gap is {ratio:.2f} times the mean square of the noise floor, and no "
            "class learns anything of it: as from noise whose neighbouring samples are correlated"
        )
    if not laws and not selection.ranking:
        return NONE_OF_THESE, "no law of the library acts on these records"
    if not laws:
        best = selection.ranking[0]
        return NONE_OF_THESE, (
            f"the best laws fitted, {set_name(best.effects)}, leave "
            f"{best.held_out_rms / reduction.rms_before:.2f} of the held-out gap and are refused "
            f"({best.refused})"
        )
    if reduction.phi < limits.named_share:
        share = max(reduction.phi, 0.0)
        return NONE_OF_THESE, (
            f"the best laws, {set_name(laws)}, explain {share:.0%} of the gap and leave "
            f"{reduction.floor_multiple:.1f} times the noise floor; a cause explains at least "
            f"{limits.named_share:.0%}"
        )
    if selection.rivals:
        rivals = ", ".join(set_name(rival) for rival in selection.rivals)
        return ALIASED, f"{rivals} predicts held-out records as well"
    explained = (
        f"{_listed(laws)} explains {reduction.phi:.1%} of the gap above the floor (mean square) on "
        "held-out records"
    )
    is_remainder = reduction.floor_multiple > limits.remainder
    remaining = f"{reduction.floor_multiple:.{1 if is_remainder else 2}f} times the noise floor"
    verdict = NAMED_WITH_REMAINDER if is_remainder else NAMED
    return verdict, f"{explained}; what remains is {remaining}"


def _are_enough(
    laws: Effects, answer: ClassAnswer, reduction: GapReduction, limits: Thresholds
) -> bool:
    """Whether laws leave no more than noise, or no more than the classes do."""
    # Laws have fewer parameters: in the classes of the answer they are believed unless these
    # explain as much more as a second cause would. Laws of other classes may only come near.
    behind = min(answer.share, 1.0) - reduction.phi
    if answer.state != NO_CLASS and not _covered(laws, answer):
        return bool(laws) and behind <= 0.0
    is_near_floor = reduction.floor_multiple <= limits.near_floor
    return bool(laws) and (is_near_floor or behind <= ClassConstants().second_cause)


def _open_ties(
    answer: ClassAnswer, named: Sequence[str], laws: Effects, predictive: Effects
) -> tuple[tuple[str, ...], ...]:
    """Ties of an answer that its named laws leave open."""
    # A law of which the size alone is free predicts its pattern: it would be a coincidence in
    # another class. One with amplitudes and phases is any pattern that its class is, and decides
    # nothing.
    tied = (answer.ids, *answer.ties)
    if set(named) not in [set(classes) for classes in tied]:
        return ()
    holders = [answer.classes_of_law.get(law, ()) for law in laws if law in predictive]
    decided = {name for name in named if any(name in classes for classes in holders)}
    return tuple(
        classes
        for classes in tied
        if set(classes) != set(named) and not decided & (set(named) - set(classes))
    )


def _silent(answer: ClassAnswer) -> ClassAnswer:
    """Answer that names no class."""
    return replace(answer, state=NOTHING, classes=(), ties=(), learnt_by=())


def _follow(answer: ClassAnswer, reduction: GapReduction, limits: Thresholds) -> bool:
    """Whether the laws explain what their class does, where that is all of a cause."""
    # A class that only leads leaves part of the gap that its law does not hold either.
    if answer.state == LEADING_CLASS and reduction.floor_multiple > limits.near_floor:
        return False
    is_equal = all(finding.law_named for finding in answer.classes)
    return is_equal or reduction.phi >= min(answer.share, 1.0) - ClassConstants().law_named


def _leave_far_less(first: GapReduction | str | None, second: GapReduction | str | None) -> bool:
    """Whether the first leaves less than any that is equal to the second."""
    # Measured shapes of classes, and laws, both simulated: a spring that hardens by a hyperbolic
    # sine follows a cubic law to 1 % of the gap, and its remainder is that of the law.
    if not (isinstance(first, GapReduction) and isinstance(second, GapReduction)):
        return False
    remaining = [far.rms_after**2 - far.noise_floor**2 for far in (first, second)]
    return max(remaining[0], 0.0) * ClassConstants().most_equal_left < remaining[1]


def _covered(laws: Effects, answer: ClassAnswer) -> tuple[str, ...] | None:
    """Classes of the answer, or of a tie, each of which holds one law and every law in one."""
    if not laws:
        return None
    for classes in (answer.ids, *answer.ties, (*answer.ids, *answer.learnt_by)):
        if _covers(laws, classes, answer):
            return classes
    return None


def _with_small_causes(
    laws: Effects, answer: ClassAnswer, reduction: GapReduction
) -> tuple[str, ...] | None:
    """Classes of the answer and of further laws that take at least half of what it leaves."""
    # A cause too small beside the first to be a class is visible once it is simulated.
    classes = answer.ids
    further = [law for law in laws if not set(answer.classes_of_law.get(law, ())) & set(classes)]
    inside = tuple(law for law in laws if law not in further)
    if not further or not all(answer.classes_of_law.get(law) for law in further):
        return None
    if not inside or not _covers(inside, classes, answer):
        return None
    most_remaining = (1.0 - ClassConstants().gain_of_left) * (1.0 - answer.share)
    if 1.0 - reduction.phi > most_remaining:
        return None
    return (*classes, *dict.fromkeys(answer.classes_of_law[law][0] for law in further))


def _covers(laws: Effects, classes: Sequence[str], answer: ClassAnswer) -> bool:
    """Whether every class holds a law, and every law lies in one of the classes."""
    holders = {law: set(answer.classes_of_law.get(law, ())) for law in laws}
    if len(laws) < len(classes) or not all(holders[law] & set(classes) for law in laws):
        return False
    return any(
        all(name in holders[law] for name, law in zip(classes, order, strict=False))
        for order in permutations(laws)
    )


def _with_named_laws(answer: ClassAnswer, classes: tuple[str, ...], laws: Effects) -> ClassAnswer:
    """Answer of the classes whose laws are named."""
    known = {finding.id: finding for finding in answer.classes}
    findings = []
    for name in classes:
        inside = [law for law in laws if name in answer.classes_of_law.get(law, ())]
        finding = known.get(name)
        if finding is None:
            # The comparison of classes alone did not name it.
            share, interval = answer.share, answer.share_ci95
            if known.keys() & set(classes):
                share, interval = answer.beyond_learnable, (0.0, 1.0)
            finding = ClassFinding(name, share, interval, inside[0], share, True)
        law = finding.law if finding.law in inside or not inside else inside[0]
        findings.append(replace(finding, law=law, law_named=True))
    ties = answer.ties
    if set(classes) in [set(tied) for tied in answer.ties]:
        ties = (answer.ids, *(tied for tied in answer.ties if set(tied) != set(classes)))
    return replace(answer, classes=tuple(findings), ties=ties)


def _without_class(
    verdict: str,
    reason: str,
    laws: Effects,
    answer: ClassAnswer,
    reduction: GapReduction,
    limits: Thresholds,
) -> Verdict:
    """No class explains the gap in force space."""
    # Nothing is named, unless simulated laws explain what no class can learn there: while dry
    # friction sticks, the speed is zero and its force is no function of the motion.
    share, learnable = (min(max(one, 0.0), 1.0) for one in (answer.share, answer.learnable))
    is_open = share >= ClassConstants().leading_share
    if not laws:
        if is_open:
            reason = f"classes explain {share:.0%} of the gap, {_NOT_WHICH}; {reason}"
        return Verdict(verdict, reason, (), answer, reduction)
    is_near_floor = reduction.floor_multiple <= limits.near_floor
    if is_near_floor or reduction.phi >= answer.learnable:
        return Verdict(verdict, reason, laws, _by_laws(answer, laws, reduction), reduction)
    if is_open:
        text = (
            f"classes explain {share:.0%} of the gap, {_NOT_WHICH}; the best laws, "
            f"{_listed(laws)}, explain {reduction.phi:.0%}"
        )
    else:
        text = (
            f"the best class explains {share:.0%} of the gap in force space, so that "
            f"{_listed(laws)} is no cause of it; all classes together learn {learnable:.0%}"
        )
    return Verdict(NONE_OF_THESE, text, (), answer, reduction)


def _by_laws(
    answer: ClassAnswer, laws: Effects, reduction: GapReduction, preferred: Sequence[str] = ()
) -> ClassAnswer:
    """Answer whose classes are those of the named laws."""
    law_of_class: dict[str, str] = {}
    for law in laws:
        holders = answer.classes_of_law.get(law, ())
        for name in (*(name for name in holders if name in preferred), *holders)[:1]:
            law_of_class.setdefault(name, law)
    if not law_of_class:
        return answer
    share, (low, high) = min(reduction.phi, 1.0), reduction.phi_ci95
    law_shares = _law_shares(law_of_class, answer, reduction)
    findings = []
    for name, law in law_of_class.items():
        fraction = law_shares[name]
        interval = (low * fraction, high * fraction)
        findings.append(ClassFinding(name, share * fraction, interval, law, share * fraction, True))
    return replace(
        answer,
        state=NAMED_CLASS,
        classes=tuple(findings),
        rivals={name: one for name, one in answer.rivals.items() if name not in law_of_class},
        share=share,
        share_ci95=reduction.phi_ci95,
        law_share=share,
    )


def _law_shares(
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


def _of_class(
    answer: ClassAnswer,
    laws: Effects,
    reduction: GapReduction,
    by_shapes: GapReduction | str | None,
) -> Verdict:
    """The class is the answer; its laws are the nearest ones."""
    if isinstance(by_shapes, GapReduction):
        answer, of_class = _with_share(answer, by_shapes), by_shapes
    else:
        of_class = _class_reduction(answer, reduction)
    if isinstance(by_shapes, str):
        unsupported = {finding.id: finding.measured_law for finding in answer.classes}
        without_laws = tuple(replace(finding, measured_law=None) for finding in answer.classes)
        answer = replace(answer, classes=without_laws, unsupported=unsupported)
    share = min(answer.share, 1.0)
    text = (
        f"{_listed(answer.ids)} explains {share:.1%} of the gap above the floor (mean square) on "
        "held-out records"
    )
    nearest = [finding for finding in answer.classes if finding.law]
    if nearest:
        text += "; nearest law " + ", ".join(
            f"{plain_name(finding.law)} {min(max(finding.law_share, 0.0), 1.0):.0%}"
            for finding in nearest
        )
    # Laws of a named pair that both the fits name and the class cannot be told from.
    is_pair = answer.state == NAMED_CLASS and len(answer.classes) > 1
    both = [one.law for one in answer.classes if one.law_named and one.law in laws]
    one_of_pair = tuple(both) if is_pair else ()
    findings = tuple(
        replace(finding, law_named=finding.law in one_of_pair) for finding in answer.classes
    )
    named = replace(answer, classes=findings)
    if answer.ties and answer.state == NAMED_CLASS:
        tied = {name for names in (answer.ids, *answer.ties) for name in names}
        effects = tuple(law for law in laws if tied <= set(answer.classes_of_law.get(law, ())))
        others = ", ".join(_listed(names) for names in answer.ties)
        text += f"; {others} predicts held-out records as well"
        return Verdict(ALIASED, text, effects, named, of_class)
    return Verdict(CLASS_NAMED, text, one_of_pair, named, of_class)


def _with_share(answer: ClassAnswer, reduction: GapReduction) -> ClassAnswer:
    """Answer whose shares are those of its measured shapes in the simulator."""
    share, interval = reduction.phi, reduction.phi_ci95
    total = sum(finding.share for finding in answer.classes)
    findings = []
    for finding in answer.classes:
        fraction = finding.share / total
        ends = (interval[0] * fraction, interval[1] * fraction)
        findings.append(replace(finding, share=share * fraction, share_ci95=ends))
    return replace(answer, classes=tuple(findings), share=share, share_ci95=interval)


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
    # RMS after over before where a share is explained.
    after, least, most = (
        math.sqrt(at_floor**2 + (1.0 - share) * (1.0 - at_floor**2)) for share in (phi, high, low)
    )
    multiple = after * before / floor if floor > 0.0 else math.inf
    return replace(
        shares, rms_after=after * before, rho=after, rho_ci95=(least, most), floor_multiple=multiple
    )


def _listed(names: Sequence[str]) -> str:
    return " with ".join(plain_name(name) for name in names)
