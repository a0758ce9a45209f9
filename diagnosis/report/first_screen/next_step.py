"""What to do next, and what it is worth, in one or two sentences."""

import math

from carrierflex.diagnosis.comparison.effect_names import plain_name
from carrierflex.diagnosis.inference.results import (
    ALIASED,
    AT_NOISE_FLOOR,
    CLASS_NAMED,
    NAMED,
    NAMED_WITH_REMAINDER,
    NOT_DIAGNOSABLE,
)
from carrierflex.diagnosis.report.class_words import class_names
from carrierflex.diagnosis.report.words import experiment_text, listed, sized
from carrierflex.diagnosis.results import Diagnosis

#: Share of the gap above the floor that is worth a second look.
_WORTH = 0.05


def next_step(diagnosis: Diagnosis) -> str:
    """What to do next.

    Parameters
    ----------
    diagnosis : Diagnosis
        Result of the diagnosis.

    Returns
    -------
    str
        For example ``Put carrier tilt into the simulation, with the values below.``
    """
    names = listed([plain_name(effect) for effect in diagnosis.attribution.effects])
    experiment = experiment_text(diagnosis)
    if diagnosis.verdict == NOT_DIAGNOSABLE:
        return f"Measure again: {diagnosis.reason}."
    if diagnosis.warnings:
        first = diagnosis.warnings[0]
        return f"First check {first.about}: {first.remedy}. {_by_verdict(diagnosis, names)}".strip()
    return " ".join(part for part in (_by_verdict(diagnosis, names), experiment) if part)


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
                f"Look for the source of {class_names(answer)} in the machine and in the measuring "
                "chain: no law of the library has it."
            )
        if not any(finding.measured_law for finding in answer.classes):
            return (
                f"Look for what makes {class_names(answer)}: its measured shape is below, and no "
                "law of the library follows it."
            )
        return (
            f"Take the measured shape of {class_names(answer)} into the simulation "
            "(diagnose --save-law), or find the law that has it."
        )
    if diagnosis.verdict == AT_NOISE_FLOOR:
        return "Nothing: the simulation is as good as this measurement can tell."
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
    floor = sized(far.noise_floor, diagnosis.unit)
    explains = diagnosis.shrinks_by_class or len(far.steps) > 1
    if diagnosis.verdict == AT_NOISE_FLOOR or not explains or not math.isfinite(far.rho):
        return f"The gap is {before} RMS, the noise floor {floor}."
    share = f", {100.0 * (1.0 - far.rho):.0f} % less" if far.rho < 1.0 - _WORTH else ""
    what = "with all that the answer by class explains " if diagnosis.shrinks_by_class else ""
    return (
        f"Worth it: {what}the gap goes from {before} to {sized(far.rms_after, diagnosis.unit)} "
        f"RMS{share}, on records that were not fitted to; the noise floor is {floor}."
    )


def gists(diagnosis: Diagnosis) -> dict[str, str]:
    """One line for every folded section, so that what is in it is known before it is opened."""
    far = diagnosis.reduction
    which = diagnosis.attribution
    tried = f"{len(which.ranking)} sets of effects tried" if which.ranking else "nothing tried"
    steps = len(far.steps) - 1 if far is not None and far.steps else 0
    far_gist = f"RMS as effects are added, {steps} of them" if steps else "no effect was added"
    if diagnosis.shrinks_by_class:
        far_gist += "; what the answer by class explains"
    return {
        "where": "maps of the gap, its growth with the conditions, what does not repeat",
        "which": f"signatures, parameters, rivals; {tried}",
        "far": far_gist,
        "remaining": "what is left, run by run" if steps else "the gap itself",
        "inputs": f"{diagnosis.campaign}: runs, channels, rig, versions",
        "words": "rho, phi, noise floor and the other words of this page",
    }
