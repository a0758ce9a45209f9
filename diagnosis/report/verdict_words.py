"""The verdict in words: what is missing, which law of it, what remains, what to do next."""

import math
from collections.abc import Sequence

from carrierflex.diagnosis.classes.results import (
    LEADING_CLASS,
    NAMED_CLASS,
    NO_CLASS,
    ClassAnswer,
    ClassFinding,
)
from carrierflex.diagnosis.classes.shapes import DRY_FRICTION
from carrierflex.diagnosis.comparison.effect_names import plain_name
from carrierflex.diagnosis.inference.results import (
    ALIASED,
    AT_NOISE_FLOOR,
    CLASS_NAMED,
    FLOOR_UNKNOWN,
    NAMED,
    NAMED_WITH_REMAINDER,
    NONE_OF_THESE,
    NOT_DIAGNOSABLE,
    OTHERWISE,
)
from carrierflex.diagnosis.report.words import capitalised, counted, listed, percent, sized
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.diagnosis.wiring.refits import RUN_VARIATION
from carrierflex.simulation.laws import FORCE_SURFACE

#: Rivals below this share are not listed.
_LEAST_RIVAL = 0.05
_MOST_RIVALS = 4
#: Shares below the first would be rounded to nothing; what is named is the second at least.
_LEAST_SHOWN = 0.005
_SMALLEST = 1e-300


def _share_words(value: float) -> str:
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


def _lacking_words(answer: ClassAnswer, effects: Sequence[str]) -> str:
    """What a simulation lacks: named effects, and the classes that none of them follows."""
    if not effects:
        friction = _friction_words(answer)
        if friction:
            return f"{friction} ({_class_names(answer)}, by no law of the library)"
        return f"{_class_names(answer)}, by no law of the library"
    by_law = {
        finding.id for finding in answer.classes if finding.law_named and finding.law in effects
    }
    laws = " and ".join(plain_name(effect) for effect in effects)
    others = [plain_name(name) for name in answer.ids if name not in by_law]
    return f"{laws}, and {' and '.join(others)}" if others else laws


def _friction_words(answer: ClassAnswer) -> str:
    """Dry friction with its size, where the only class is of that shape; empty otherwise."""
    shapes = [finding.shape for finding in answer.classes]
    words = shapes[0].words if len(shapes) == 1 and shapes[0] is not None else ""
    if not words.startswith(DRY_FRICTION):
        return ""
    return ", ".join(words.split(", ")[:3])


def class_sentence(answer: ClassAnswer | None) -> str:
    """Answer by class as one or two sentences; empty where there is none.

    For example ``Restoring force (99 %; next class 42 %): zero below 0.8 mm, stiffening above, one
    side only; no law of the library, nearest backlash 74 %.``
    """
    if answer is None or answer.state not in (NAMED_CLASS, LEADING_CLASS, NO_CLASS):
        return ""
    if answer.state == NO_CLASS:
        best = " and ".join(plain_name(name) for name in answer.best)
        which = f"the best ({best})" if best else "the best"
        return (
            f"No class of effect is named: {which} explains {_share_words(answer.share)} of the "
            f"gap, all together {_share_words(max(answer.learnable, answer.share))}."
        )
    first, *others = (_finding_words(finding, answer) for finding in answer.classes)
    text = ". ".join([first, *(text[:1].upper() + text[1:] for text in others)])
    if answer.state == LEADING_CLASS:
        text = f"Leading, incomplete: {text}"
    text = text[:1].upper() + text[1:] + "."
    if answer.ties:
        tied = ", ".join(" and ".join(plain_name(n) for n in names) for names in answer.ties)
        text += f" In these records {tied} cannot be distinguished from it."
    return text


def _finding_words(finding: ClassFinding, answer: ClassAnswer) -> str:
    rival = max(
        (share for name, share in answer.rivals.items() if name not in answer.ids), default=0.0
    )
    alone = len(answer.classes) == 1
    next_class = f"; next class {_share_words(rival)}" if alone else ""
    # What is named is not nothing: a second cause may add as little as it harms alone.
    share = max(finding.share, _SMALLEST)
    text = f"{plain_name(finding.id)} ({_share_words(share)}{next_class})"
    if finding.shape is not None and finding.shape.words:
        text += f": {finding.shape.words}"
    if finding.id.endswith("/undetermined") and not finding.law_named:
        text += "; its load dependence cannot be determined from these records"
    return f"{text}; {_law_words(finding, answer)}"


def _law_words(finding: ClassFinding, answer: ClassAnswer) -> str:
    """Law of a class: named, or the nearest with its part of the class."""
    if not finding.law:
        return "no law of the library lies in this class"
    share = finding.law_share / finding.share if finding.share > 0.0 else float("nan")
    if finding.law_named:
        # A surface of deflection and speed holds the laws of one of them: there is more in it.
        class_of_law = answer.classes_of_law.get(finding.law, (finding.id,))[0]
        is_component = finding.id == FORCE_SURFACE and class_of_law != finding.id
        name = plain_name(finding.law)
        return f"of it the library has the law {name}" if is_component else f"law: {name}"
    return f"no law of the library, nearest {plain_name(finding.law)} {_share_words(share)} of it"


def remaining_words(answer: ClassAnswer | None) -> str:
    """What the answer leaves: law, class beyond it, learnable beyond the class, the rest."""
    if answer is None or not answer.classes:
        return ""
    share = min(max(answer.share, 0.0), 1.0)
    law = min(max(answer.law_share, 0.0), share) if answer.law_share == answer.law_share else 0.0
    rest = max(1.0 - share - answer.beyond_learnable, 0.0)
    text = (
        f"Of the gap above the floor on held-out records the nearest laws explain "
        f"{_share_words(law)}, the class beyond them {_share_words(share - law)}; "
        f"{_share_words(answer.beyond_learnable)} could still be learnt by another class"
    )
    if answer.learnt_by:
        text += f" ({', '.join(plain_name(name) for name in answer.learnt_by)})"
    return f"{text}; {_share_words(rest)} by none."


def rival_rows(answer: ClassAnswer | None) -> list[tuple[str, str]]:
    """Other classes alone, largest first."""
    if answer is None:
        return []
    ordered = sorted(answer.rivals.items(), key=lambda item: -item[1])
    return [
        (plain_name(name), _share_words(share))
        for name, share in ordered[:_MOST_RIVALS]
        if share >= _LEAST_RIVAL
    ]


_HEADINGS = {
    NAMED: "The simulation lacks {effects}",
    NAMED_WITH_REMAINDER: "Missing: {effects}. {remains} of the gap (RMS) remains unexplained",
    CLASS_NAMED: "The simulation lacks an effect of a known class, by no law of the library",
    ALIASED: "The simulation lacks {effects}",
    NONE_OF_THESE: "No known effect explains the gap",
    AT_NOISE_FLOOR: "Simulation and measurement agree within the noise",
    NOT_DIAGNOSABLE: "These records do not allow a diagnosis",
}
_MEANINGS = {
    NAMED: "What is named explains the gap on records it was not fitted to; the remaining gap is "
    "near the noise.",
    NAMED_WITH_REMAINDER: "What is named explains most of the gap on records it was not fitted to; "
    "a remainder is above the noise.",
    CLASS_NAMED: "A model of the class without a fixed form explains the gap on records it was not "
    "fitted to; no law of the library follows its curve.",
    ALIASED: "Several effects explain the gap equally well under the measured conditions.",
    NONE_OF_THESE: "There is a gap, but no effect of the library may be named as its cause.",
    AT_NOISE_FLOOR: "There is no gap above the noise floor that an effect could explain.",
    NOT_DIAGNOSABLE: "Something is missing in the records; the reason says what.",
}


def verdict_heading(diagnosis: Diagnosis) -> str:
    """Verdict as a heading: ``The simulation lacks cubic stiffness``.

    What the records cannot distinguish stands in it; a fault of the measurement that explains as
    much comes first.
    """
    if diagnosis.reason_id not in ("", FLOOR_UNKNOWN):
        first = _fault_heading(diagnosis)
        if diagnosis.verdict == NONE_OF_THESE:
            return first
        physics = _physics_heading(diagnosis)
        return f"{first}{OTHERWISE}{physics[:1].lower()}{physics[1:]}"
    return _physics_heading(diagnosis)


def _fault_heading(diagnosis: Diagnosis) -> str:
    """Fault of the measurement that is the most likely cause, and what it explains."""
    fault = next((w for w in diagnosis.warnings if w.id == diagnosis.reason_id), None)
    if fault is None:
        return capitalised(diagnosis.reason.partition(OTHERWISE)[0])
    share = percent(min(fault.figure, 1.0))
    return f"Check {fault.about} first ({_fault_words(fault.id)}): it explains {share} of the gap"


def _fault_words(fault: str) -> str:
    """Fault of the measurement in words: ``sensor on ground``."""
    return fault.removeprefix("wiring/").replace("_", " ")


def _physics_heading(diagnosis: Diagnosis) -> str:
    """Heading without the faults of the measurement."""
    answer = diagnosis.classes
    if answer is not None and answer.classes:
        if diagnosis.verdict == CLASS_NAMED:
            lacking = _lacking_words(answer, diagnosis.attribution.effects)
            return f"The simulation lacks {lacking}"
        if diagnosis.verdict == ALIASED and not diagnosis.attribution.effects:
            return f"The simulation lacks {_either(_tied_classes(answer))}"
    if diagnosis.verdict == NONE_OF_THESE and answer is not None and answer.experiment:
        return "These records show that an effect is missing, not which one"
    if diagnosis.reason_id == FLOOR_UNKNOWN:
        return "Whether an effect is missing is not known: the size of the noise is not"
    far = diagnosis.reduction
    if diagnosis.verdict in (NAMED, ALIASED) and answer is not None and _is_model(answer.ids):
        body = answer.ids[0].partition("/")[2]
        verb = "differ from their" if body.endswith("s") else "differs from its"
        causes = listed(_with_alternatives(diagnosis))
        joint = " in" if causes.startswith("one of") else ":"
        return f"The {body} {verb} drawing{joint} {causes}"
    return _HEADINGS[diagnosis.verdict].format(
        effects=listed(_with_alternatives(diagnosis)),
        remains="part" if far is None else percent(far.rho),
    )


def _is_model(classes: Sequence[str]) -> bool:
    """Whether the cause is a body of the model alone."""
    return len(classes) == 1 and classes[0].startswith("model/")


def _with_change(diagnosis: Diagnosis, effect: str) -> str:
    """Effect in words, with its size where it is a dimension: ``outer radius, -13 ± 2 mm``."""
    which = diagnosis.attribution
    change = {**which.alternatives, **which.parameters}.get(effect, {}).get("change")
    if change is None:
        return plain_name(effect)
    name = plain_name(effect)
    if change.unit == "m":
        name = name.removesuffix(" of the carrier")
        return f"{name} {1e3 * change.value:+.1f} ± {1e3 * change.std:.1f} mm"
    if change.unit == "Pa":
        return f"{name} {1e-9 * change.value:+.1f} ± {1e-9 * change.std:.1f} GPa"
    return f"{name} {change.value:+.3f} ± {change.std:.3f}"


def _with_alternatives(diagnosis: Diagnosis) -> list[str]:
    """Named effects, each with the effects that cannot be distinguished from it."""
    named = diagnosis.attribution.effects
    # What is named beside an effect is no alternative to it: a fault may stand for all of them.
    groups = {
        group[0]: [group[0], *(n for n in group if not _is_fault(n) and n not in named)]
        for group in diagnosis.attribution.aliases
    }
    return [
        _either([_with_change(diagnosis, name) for name in groups.get(effect, [effect])])
        for effect in named
    ]


def _tied_classes(answer: ClassAnswer) -> list[str]:
    """Classes of the answer and of every tie, in words."""
    tied = [" and ".join(plain_name(name) for name in names) for names in answer.ties]
    return [_class_names(answer), *tied]


def _is_fault(name: str) -> bool:
    """Whether a name is a fault of the measurement."""
    return name.startswith("wiring/") or name == RUN_VARIATION


def _either(names: Sequence[str]) -> str:
    """Alternatives: ``one of: cubic stiffness, quintic stiffness``."""
    return names[0] if len(names) == 1 else f"one of: {', '.join(names)}"


def verdict_meaning(verdict: str) -> str:
    """What a verdict says in general."""
    return _MEANINGS[verdict]


def alias_sentence(diagnosis: Diagnosis) -> str:
    """Effects that the named ones cannot be told from; empty where none."""
    named = {*diagnosis.attribution.effects, *(diagnosis.classes.ids if diagnosis.classes else ())}
    texts = []
    for first, *others in diagnosis.attribution.aliases:
        together = [first, *(name for name in others if name in named)]
        rivals = [
            f"a fault of the measurement ({_fault_words(name)})"
            if _is_fault(name)
            else plain_name(name)
            for name in others
            if name not in named
        ]
        answer = " with ".join(plain_name(name) for name in together)
        texts.append(f"{answer} cannot be distinguished from {listed(rivals)}")
    return f"In these records {listed(texts)}." if texts else ""


def experiment_text(diagnosis: Diagnosis) -> str:
    """Discriminating experiment as a sentence; empty where none is asked for."""
    text = diagnosis.attribution.discriminating_experiment
    return f"{capitalised(text).rstrip('.')}." if text else ""


#: Share of the gap above the floor that is worth a second look.
_WORTH = 0.05


def next_step(diagnosis: Diagnosis) -> str:
    """What to do next, such as ``Put carrier tilt into the simulation``."""
    names = listed([plain_name(effect) for effect in diagnosis.attribution.effects])
    experiment = experiment_text(diagnosis)
    if diagnosis.verdict == NOT_DIAGNOSABLE:
        return experiment if diagnosis.reason_id else f"Measure again: {diagnosis.reason}."
    if diagnosis.warnings:
        first = diagnosis.warnings[0]
        return f"First check {first.about}: {first.remedy}. {_by_verdict(diagnosis, names)}".strip()
    return " ".join(text for text in (_by_verdict(diagnosis, names), experiment) if text)


def _by_verdict(diagnosis: Diagnosis, names: str) -> str:
    answer = diagnosis.classes
    if diagnosis.verdict == NAMED:
        return f"Put {names} into the simulation, with the values below."
    if diagnosis.verdict == NAMED_WITH_REMAINDER:
        return (
            f"Put {names} into the simulation, with the values below; then look at the remaining "
            "gap."
        )
    if diagnosis.verdict == ALIASED:
        if not names:
            return "Measure where the classes differ before one is put into the simulation."
        return f"Do not put {names} into the simulation yet: measure where the rivals differ."
    if diagnosis.verdict == CLASS_NAMED and answer is not None:
        if not any(finding.shape or finding.measured_law for finding in answer.classes):
            return (
                f"Look for the source of {_class_names(answer)} in the machine and in the "
                "measuring chain: no law of the library has it."
            )
        if not any(finding.measured_law for finding in answer.classes):
            return (
                f"Look for what makes {_class_names(answer)}: its measured shape is below, and no "
                "law of the library follows it."
            )
        return (
            f"Take the measured shape of {_class_names(answer)} into the simulation "
            "(diagnose --save-law), or find the law that has it."
        )
    if diagnosis.verdict == AT_NOISE_FLOOR:
        return "Nothing: no difference from the simulation is detectable in this measurement."
    if answer is not None and answer.experiment:
        return "Do not look for an unknown cause yet: classes below explain the gap, but not apart."
    return (
        "Look at where the gap lies, below: no effect of the library has that place and growth, so "
        "the cause is one that it does not know, or the measurement itself."
    )


def worth(diagnosis: Diagnosis) -> str:
    """What that is worth: the gap before and after on held-out records; empty where unknown."""
    far = diagnosis.reduction
    if far is None:
        return ""
    before = sized(far.rms_before, diagnosis.unit)
    if diagnosis.reason_id == FLOOR_UNKNOWN:
        return f"The gap is {before} RMS; how much of it is noise is not known."
    floor = sized(far.noise_floor, diagnosis.unit)
    explains = diagnosis.shrinks_by_class or len(far.steps) > 1
    if diagnosis.verdict == AT_NOISE_FLOOR or not explains or not math.isfinite(far.rho):
        return f"The gap is {before} RMS, the noise floor {floor}."
    share = f" (-{100.0 * (1.0 - far.rho):.3g} %)" if far.rho < 1.0 - _WORTH else ""
    what = " with the whole answer by class" if diagnosis.shrinks_by_class else ""
    return (
        f"Expected{what}: gap {before} to {sized(far.rms_after, diagnosis.unit)} RMS{share} on "
        f"held-out records; noise floor {floor}."
    )


def gists(diagnosis: Diagnosis) -> dict[str, str]:
    """One line for every folded section, so that what is in it is known before it is opened."""
    far = diagnosis.reduction
    which = diagnosis.attribution
    n_sets = len(which.ranking)
    tried = f"{counted(n_sets, 'set')} of laws fitted" if n_sets else "nothing fitted"
    steps = len(far.steps) - 1 if far is not None and far.steps else 0
    far_gist = f"RMS after each of {counted(steps, 'effect')}" if steps else "no effect was added"
    if diagnosis.shrinks_by_class:
        far_gist += "; what the answer by class explains"
    return {
        "where": "maps of the gap, its growth with the conditions, what does not repeat",
        "which": f"parameters, rivals; {tried}",
        "far": far_gist,
        "remaining": "remaining gap, run by run" if steps else "the gap itself",
        "inputs": f"{diagnosis.campaign}: runs, channels, rig, versions",
        "words": "rho, phi, noise floor and the other words of this page",
    }
