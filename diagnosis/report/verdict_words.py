"""The verdict in words: two lines of headline, and what to do next."""

import math
from collections.abc import Sequence

from carrierflex.diagnosis.classes.results import LEADING_CLASS, ClassAnswer, ClassFinding
from carrierflex.diagnosis.classes.shapes import DRY_FRICTION
from carrierflex.diagnosis.comparison.effect_names import plain_name
from carrierflex.diagnosis.inference.results import (
    ALIASED,
    AT_NOISE_FLOOR,
    CLASS_NAMED,
    FLOOR_UNKNOWN,
    NAMED,
    NAMED_WITH_REMAINDER,
    NAMING,
    NONE_OF_THESE,
    NOT_DIAGNOSABLE,
    OTHERWISE,
)
from carrierflex.diagnosis.report.words import CHANGE, capitalised, listed, named_rows, percent
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.diagnosis.wiring.refits import (
    OF_NO_KIND,
    Fault,
    fault_words,
)
from carrierflex.files.quantities import sized

#: Shares below this would be rounded to nothing.
_LEAST_SHOWN = 0.005


def share_words(value: float) -> str:
    """Share in per cent, never above 100 and never below 0."""
    if value != value:
        return "–"
    inside = min(max(value, 0.0), 1.0)
    if 0.0 < inside < _LEAST_SHOWN:
        return f"below {100.0 * _LEAST_SHOWN:.1f} %"
    return f"{100.0 * inside:.1f} %" if 0.99 <= inside < 0.9995 else f"{100.0 * inside:.0f} %"


def _class_names(answer: ClassAnswer) -> str:
    """Classes of an answer in words."""
    return " and ".join(plain_name(name) for name in answer.ids)


def _class_words(answer: ClassAnswer, effects: Sequence[str]) -> str:
    """Classes that explain a gap: named effects, and the classes that none of them follows."""
    if not effects:
        classes = _friction_words(answer) or _class_names(answer)
        if _depends_on_unknown_loads(answer):
            return f"{classes}; the loads of the records determine no law"
        law = _near_law(answer)
        return f"{classes}, nearest law {law}" if law else f"{classes}, by no law of the library"
    by_law = {
        finding.id for finding in answer.classes if finding.law_named and finding.law in effects
    }
    laws = " and ".join(plain_name(effect) for effect in effects)
    others = [plain_name(name) for name in answer.ids if name not in by_law]
    return f"{laws}, and {' and '.join(others)}" if others else laws


def is_near_law(finding: ClassFinding) -> bool:
    """Whether a law that is not named explains nearly all that its class does."""
    return bool(finding.law) and finding.law_share > 0.9 * finding.share


def _near_law(answer: ClassAnswer) -> str:
    """Such a law of the only class of an answer, in words; empty where there is none."""
    nearest = [one.law for one in answer.classes if is_near_law(one)]
    return plain_name(nearest[0]) if nearest and len(answer.classes) == 1 else ""


def _depends_on_unknown_loads(answer: ClassAnswer) -> bool:
    """Whether the records do not show how any class depends on the load."""
    return all(name.endswith("/undetermined") for name in answer.ids)


def _friction_words(answer: ClassAnswer) -> str:
    """Dry friction with its size, where the only class is of that shape; empty otherwise."""
    shapes = [finding.shape for finding in answer.classes]
    words = shapes[0].words if len(shapes) == 1 and shapes[0] is not None else ""
    if not words.startswith(DRY_FRICTION):
        return ""
    return f"{', '.join(words.split(', ')[:3])} ({_class_names(answer)})"


_HEADINGS = {
    NONE_OF_THESE: "No known effect explains the gap",
    AT_NOISE_FLOOR: "Simulation and measurement agree within the noise",
    NOT_DIAGNOSABLE: "These records do not allow a diagnosis",
}


def verdict_heading(diagnosis: Diagnosis) -> str:
    """Headline as a text without its last full stop, and without the reason of the verdict."""
    first, second = headlines(diagnosis)
    return first if diagnosis.verdict in _HEADINGS else f"{first}. {second}"


def headlines(diagnosis: Diagnosis) -> tuple[str, str]:
    """What explains the gap, and what cannot be distinguished or remains; may be empty.

    For example ``The gap is explained by cubic stiffness``. A fault of the measurement that
    explains as much comes first, and one beside which more is explained.
    """
    first, second = _explained(diagnosis), _undecided(diagnosis)
    if diagnosis.reason_id in ("", FLOOR_UNKNOWN):
        return _fault_beside(diagnosis, first), second
    fault = _fault_heading(diagnosis)
    if diagnosis.verdict == NONE_OF_THESE:
        return fault, second
    return f"{fault}{OTHERWISE}{first[:1].lower()}{first[1:]}", second


def _fault_beside(diagnosis: Diagnosis, first: str) -> str:
    """First line behind a fault beside which clearly more is explained; as it is without one."""
    far = diagnosis.reduction
    # A run or a channel left out takes something of any cause.
    faults = [
        one for one in diagnosis.warnings if one.check == "wiring" and one.id not in OF_NO_KIND
    ]
    if far is None or diagnosis.verdict not in (*NAMING, CLASS_NAMED) or not faults:
        return first
    fault = max(faults, key=lambda one: one.figure)
    if fault.figure <= far.phi + WORTH_A_LOOK:
        return first
    return (
        f"Check {fault.about} first ({fault_words(fault.id)}): once it is put right, "
        f"{percent(min(fault.figure, 1.0))} of the gap is explained; as measured, "
        f"{first[:1].lower()}{first[1:]}"
    )


def _fault_heading(diagnosis: Diagnosis) -> str:
    """Fault of the measurement that is the most likely cause, and what it explains."""
    fault = next((w for w in diagnosis.warnings if w.id == diagnosis.reason_id), None)
    if fault is None:
        return capitalised(diagnosis.reason.partition(OTHERWISE)[0])
    share = percent(min(fault.figure, 1.0))
    return f"Check {fault.about} first ({fault_words(fault.id)}): it explains {share} of the gap"


def _explained(diagnosis: Diagnosis) -> str:
    """First line without the faults of the measurement."""
    verdict, answer = diagnosis.verdict, diagnosis.classes
    if verdict == NONE_OF_THESE and answer is not None and answer.changes:
        return "An effect is missing whose size changes in the course of the records"
    if verdict == NONE_OF_THESE and answer is not None and answer.experiment:
        return "These records show that an effect is missing, not which one"
    if diagnosis.reason_id == FLOOR_UNKNOWN:
        return "Whether an effect is missing is not known: the size of the noise is not"
    if verdict in _HEADINGS:
        return _HEADINGS[verdict]
    if verdict == CLASS_NAMED:
        what = "an effect of a known class, by no law of the library"
        if answer is not None and answer.classes:
            what = _class_words(answer, diagnosis.attribution.effects)
        is_leading = answer is not None and answer.state == LEADING_CLASS
        return f"The {'larger part of the ' if is_leading else ''}gap is explained by {what}"
    groups = _alternatives(diagnosis)
    n_open = sum(len(group) > 1 for group in groups)
    several = "one of several causes" if n_open == 1 else "several causes, each with alternatives"
    sure = [group[0] for group in groups if len(group) == 1]
    causes = listed([*sure, several] if n_open else sure)
    if answer is not None and len(answer.ids) == 1 and answer.ids[0].startswith("model/"):
        body = answer.ids[0].partition("/")[2]
        verb = "differ from their" if body.endswith("s") else "differs from its"
        return f"The {body} {verb} drawing: {causes}"
    return f"The gap is explained by {causes}"


def _undecided(diagnosis: Diagnosis) -> str:
    """Second line: what cannot be distinguished, what remains, or why there is no answer."""
    verdict, far = diagnosis.verdict, diagnosis.reduction
    if verdict in _HEADINGS:
        return capitalised(diagnosis.reason)
    groups = [group for group in _alternatives(diagnosis, with_faults=True) if len(group) > 1]
    if verdict == ALIASED and groups:
        texts = [f"one of {'; '.join(group)}" for group in groups]
        return f"Cannot be distinguished in these records: {', and beside it '.join(texts)}"
    remains = far is not None and verdict in (NAMED_WITH_REMAINDER, CLASS_NAMED)
    if far is not None and remains and far.rho > WORTH_A_LOOK and far.floor_multiple > 1.1:
        above_noise = math.sqrt(max(1.0 - far.phi, 0.0))
        return f"Part of the gap ({percent(above_noise)} of its RMS above the noise) is unexplained"
    return "No other effect of the library explains the records as well"


def _with_change(diagnosis: Diagnosis, effect: str) -> str:
    """Effect in words, with size and 95 % interval of a dimension: ``outer radius -13 ± 2 mm``."""
    name = plain_name(effect)
    row = next((row for row in named_rows(diagnosis, effect) if row.name == CHANGE), None)
    if row is None:
        return name
    if row.unit == "mm":
        name = name.removesuffix(" of the carrier")
    if row.unit in ("mm", "GPa"):
        return f"{name} {row.value:+.1f} ± {row.error:.1f} {row.unit}"
    return f"{name} {row.value:+.3f} ± {row.error:.3f}"


def _alternatives(diagnosis: Diagnosis, *, with_faults: bool = False) -> list[list[str]]:
    """Named effects or classes in words, each with what cannot be distinguished from it."""
    answer, which = diagnosis.classes, diagnosis.attribution
    groups = {name: [_with_change(diagnosis, name)] for name in which.effects}
    if not which.effects and answer is not None and answer.ids:
        tied = [" and ".join(plain_name(name) for name in names) for names in answer.ties]
        laws = [finding.law for finding in answer.classes if finding.law_named]
        first = _class_words(answer, laws) if laws else _class_names(answer)
        groups = {answer.ids[0]: [first, *tied]}
    named = which.effects or (() if answer is None else answer.ids)
    for first, *others in which.aliases:
        # Classes that are named together are one group.
        known = next(iter(groups)) if first in named and first not in groups else first
        groups.setdefault(known, [_with_change(diagnosis, first)]).extend(
            f"a fault of the measurement ({fault_words(name)})"
            if _is_fault(name)
            else _with_change(diagnosis, name)
            for name in others
            # What is named beside an effect is no alternative to it: a fault may stand for all.
            if name not in named and (with_faults or not _is_fault(name))
        )
    return list(groups.values())


def _is_fault(name: str) -> bool:
    """Whether a name is a fault of the measurement."""
    return name.startswith("wiring/") or name == Fault.RUN_VARIATION


def _experiment_text(diagnosis: Diagnosis) -> str:
    """Discriminating experiment as a sentence; empty where none is asked for."""
    text = diagnosis.attribution.discriminating_experiment
    return f"{capitalised(text).rstrip('.')}." if text else ""


#: Share of the gap above the floor that is worth a second look, and RMS over the floor.
WORTH_A_LOOK = 0.05


def next_step(diagnosis: Diagnosis) -> str:
    """What to do next in one text, without what it is worth."""
    return " ".join(next_steps(diagnosis))


def next_steps(diagnosis: Diagnosis, *, has_measured_law: bool | None = None) -> list[str]:
    """What to check, put in and measure, in that order, a sentence each."""
    answer = diagnosis.classes
    if has_measured_law is None:
        has_measured_law = answer is not None and any(one.measured_law for one in answer.classes)
    experiment = _experiment_text(diagnosis)
    if diagnosis.verdict == NOT_DIAGNOSABLE:
        return [experiment if diagnosis.reason_id else f"Measure again: {diagnosis.reason}."]
    first = [f"{one.about}: {one.remedy}." for one in diagnosis.warnings[:1]]
    steps = (*first, _put_in(diagnosis, has_measured_law=has_measured_law), experiment)
    return [step for step in steps if step]


def _put_in(diagnosis: Diagnosis, *, has_measured_law: bool) -> str:
    """What to put into the simulation, or where to look; empty where a measurement comes first."""
    answer = diagnosis.classes
    names = listed([plain_name(effect) for effect in diagnosis.attribution.effects])
    if diagnosis.verdict in (NAMED, NAMED_WITH_REMAINDER):
        # In the order of their worth, each with the gap that it leaves.
        far, unit = diagnosis.reduction, diagnosis.unit
        steps = far.steps[1:] if far is not None else ()
        in_turn = [f"{plain_name(one.added)} (gap to {sized(one.rms, unit)})" for one in steps]
        return f"Put {listed(in_turn) or names} into the simulation."
    if diagnosis.verdict == ALIASED:
        none = f"Do not put {names} into the simulation yet" if names else "Put none of them in yet"
        return none + ("." if _experiment_text(diagnosis) else ": measure where they differ.")
    if diagnosis.verdict == CLASS_NAMED and answer is not None:
        if has_measured_law:
            return (
                f"Put the measured shape of {_class_names(answer)} into the simulation "
                "(diagnose --save-law), or find the law that has it."
            )
        names = _class_names(answer)
        if _depends_on_unknown_loads(answer):
            return f"Measure at other loads: these records do not determine the law of {names}."
        law = _near_law(answer)
        has_it = f"the law {law} has most of it" if law else "no law of the library has it"
        return f"Look for the source of {names}: {has_it}."
    if diagnosis.verdict == AT_NOISE_FLOOR:
        return "Nothing: no difference from the simulation is detectable in this measurement."
    # A clock that drifts changes what it makes of a force, too.
    if answer is not None and answer.changes and not diagnosis.reason_id:
        changing = listed([plain_name(name) for name in answer.best])
        return f"Look for what changes the {changing}: temperature, lubrication, wear, load."
    if answer is not None and answer.experiment:
        return "Do not look for an unknown cause yet: classes explain the gap, but not apart."
    return (
        "Check the position and growth of the gap: no effect of the library matches them. The "
        "cause is outside the library, or in the measurement."
    )


def worth(diagnosis: Diagnosis) -> str:
    """The gap before and after on held-out records; empty where unknown."""
    far = diagnosis.reduction
    if far is None:
        return ""
    before = sized(far.rms_before, diagnosis.unit)
    if diagnosis.reason_id == FLOOR_UNKNOWN:
        return f"The gap is {before} RMS; how much of it is noise is not known."
    floor = sized(far.noise_floor, diagnosis.unit)
    explains = diagnosis.shrinks_by_class or len(far.steps) > 1
    if diagnosis.verdict == AT_NOISE_FLOOR or not explains or not far.rho < 1.0:
        return f"The gap is {before} RMS, the noise floor {floor}."
    share = f" (-{100.0 * (1.0 - far.rho):.3g} %)" if far.rho < 1.0 - WORTH_A_LOOK else ""
    return (
        f"Expected: gap {before} to {sized(far.rms_after, diagnosis.unit)} RMS{share} on "
        f"held-out records; noise floor {floor}."
    )
