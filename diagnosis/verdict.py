"""The verdict, from the classes that the table shows and the laws fitted in the simulator."""

import math
from collections.abc import Callable, Sequence
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
    of_fits = Verdict(verdict, reason, laws, answer, reduction)
    if answer is None:
        return of_fits
    if answer.state == NOT_VISIBLE and not laws and verdict != AT_NOISE_FLOOR:
        return replace(of_fits, verdict=NOT_DIAGNOSABLE, reason=answer.note)
    if answer.state in (NOTHING, NOT_VISIBLE):
        return replace(of_fits, answer=_by_laws(answer, laws, reduction))
    if verdict == AT_NOISE_FLOOR and (answer.state == LEADING_CLASS or answer.same_scores):
        # Noise of the motion in a contained law is no white noise in force space: a class that only
        # leads there says less than the records, which the simulation meets to their noise.
        return replace(of_fits, answer=_silent(answer))
    covered = _covered(laws, answer)
    is_near_floor = reduction.floor_multiple <= limits.near_floor
    behind = min(answer.share, 1.0) - reduction.phi
    if answer.same_scores and laws:
        # Laws have fewer parameters: in the classes of the answer they are believed unless these
        # explain as much more as a second cause would. Laws of other classes may only come near.
        if covered or answer.state == NO_CLASS:
            are_enough = is_near_floor or behind <= ClassConstants().second_cause
        else:
            are_enough = behind <= 0.0
        if are_enough:
            named = _by_laws(_silent(answer), laws, reduction, answer.ids)
            ties = _open_ties(answer, named.ids, laws, predictive)
            if not ties:
                return replace(of_fits, answer=named)
            text = f"{reason}; {_as_well(ties)}"
            return Verdict(ALIASED, text, (), replace(named, ties=ties), reduction)
    covered = covered or _with_small_causes(laws, answer, reduction)
    # A class that only leads leaves part of the gap that its law does not hold either.
    is_whole = answer.state != LEADING_CLASS or is_near_floor
    follow = all(one.law_named for one in answer.classes) or behind <= ClassConstants().law_named
    shapes = None
    if covered is not None and is_whole and follow:
        is_textbook = not set(laws) & set(measured)
        is_open = verdict in (NAMED, NAMED_WITH_REMAINDER) and covered == answer.ids and is_textbook
        shapes = by_shapes(answer) if is_open and not is_near_floor else None
        if not _leave_far_less(shapes, reduction):
            return replace(of_fits, answer=_with_named_laws(answer, covered, laws))
    if answer.state == NO_CLASS:
        return _without_class(of_fits, answer, is_near_floor=is_near_floor)
    shapes = shapes or by_shapes(answer)
    are_worse = isinstance(shapes, str) or _leave_far_less(reduction, shapes)
    if laws and is_near_floor and are_worse:
        # In force space a friction that stops the mass stands in a further class.
        return replace(of_fits, answer=_by_laws(answer, laws, reduction))
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
    if not laws or not answer.ids:
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


def _without_class(of_fits: Verdict, answer: ClassAnswer, *, is_near_floor: bool) -> Verdict:
    """No class explains the gap in force space."""
    # Nothing is named, unless simulated laws explain what no class can learn there: while dry
    # friction sticks, the speed is zero and its force is no function of the motion.
    laws, reduction = of_fits.effects, of_fits.reduction
    share, learnable = (min(max(one, 0.0), 1.0) for one in (answer.share, answer.learnable))
    is_open = share >= ClassConstants().leading_share
    which = answer.changes or (
        f"classes explain {share:.0%} of the gap, and these records do not show which"
    )
    if not laws:
        return replace(of_fits, reason=f"{which}; {of_fits.reason}") if is_open else of_fits
    learn_no_more = reduction.phi >= answer.learnable and not answer.changes
    if is_near_floor or learn_no_more:
        return replace(of_fits, answer=_by_laws(answer, laws, reduction))
    text = f"{which}; the best laws, {_listed(laws)}, explain {reduction.phi:.0%}"
    if not is_open:
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
    # A law's part is the mean square that goes as it is added to those before it, largest first;
    # laws of one class add up.
    gone = dict.fromkeys(law_of_class, 0.0)
    for before, after in pairwise(reduction.steps):
        holders = answer.classes_of_law.get(after.added, ())
        for name in [name for name in holders if name in gone][:1]:
            gone[name] += max(before.rms**2 - after.rms**2, 0.0)
    if not sum(gone.values()) > 0.0:
        gone = dict.fromkeys(law_of_class, 1.0)
    share, interval = min(reduction.phi, 1.0), reduction.phi_ci95
    findings = [
        ClassFinding(name, share, interval, law_of_class[name], share, True).part(
            square / sum(gone.values())
        )
        for name, square in gone.items()
    ]
    return replace(
        answer,
        state=NAMED_CLASS,
        classes=tuple(findings),
        rivals={name: one for name, one in answer.rivals.items() if name not in law_of_class},
        share=share,
        share_ci95=interval,
        law_share=share,
    )


def _of_class(
    answer: ClassAnswer,
    laws: Effects,
    reduction: GapReduction,
    by_shapes: GapReduction | str | None,
) -> Verdict:
    """The class is the answer; its laws are the nearest ones."""
    of_class = by_shapes if isinstance(by_shapes, GapReduction) else None
    if of_class is not None:
        share, interval = of_class.phi, of_class.phi_ci95
        total = sum(finding.share for finding in answer.classes)
        whole = [replace(one, share=share, share_ci95=interval) for one in answer.classes]
        parts = tuple(
            replace(all_of_it.part(one.share / total), law_share=one.law_share)
            for all_of_it, one in zip(whole, answer.classes, strict=True)
        )
        answer = replace(answer, classes=parts, share=share, share_ci95=interval)
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
        text += f"; {_as_well(answer.ties)}"
        return Verdict(ALIASED, text, effects, named, of_class)
    return Verdict(CLASS_NAMED, text, one_of_pair, named, of_class)


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


def _as_well(ties: Sequence[Effects]) -> str:
    return f"{', '.join(map(_listed, ties))} predicts held-out records as well"


def _listed(names: Sequence[str]) -> str:
    return " with ".join(plain_name(name) for name in names)
