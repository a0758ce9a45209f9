"""What a diagnosis says of an error of measuring practice, with nothing missing and with a cause.

An error counts where the baseline, fitted anew, leaves two noise floors more in quadrature than
without it; what a refit takes up is the record of another machine. Then it is

- reported: one of its ids is among the findings that are new, the ties or what is named;
- physics: not reported, and a law or class is named that is neither true, nor holds a true law,
  nor is of the measurement (a delay, a gain, a map of loads or sensors), nor tied with a finding;
- harmless: no physics, and nothing to report: the records are right (cut, in another order);
- another finding: not reported, and a finding that the campaign without the error does not have;
- silent: the rest, "none of these" and the true cause alone among them.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from carrierflex.blind_check.labels import Label
from carrierflex.diagnosis.inference.effect_fit import fit_effects, mean_square_left
from carrierflex.diagnosis.inference.results import ALIASED, CLASS_NAMED, NAMING
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning
from carrierflex.workflows.diagnosis.examination import ExaminedCampaign, examined
from studies.fault_outcomes import HARMLESS, REFUSED, Curves, Outcome
from studies.fault_table import Fault

SMALL = "below two floors"
REPORTED = "reported"
PHYSICS = "physics"
ANOTHER = "another finding"
SILENT = "silent"
ANSWERS = (SMALL, REPORTED, PHYSICS, HARMLESS, ANOTHER, SILENT)
#: What an error must leave, over the noise floor.
_FLOORS = 2.0
#: Beginnings of laws and classes that are of the measurement.
_OF_MEASUREMENT = (
    "aliased/", "sensor", "sensors/", "clock/", "delay", "channel/", "loads/", "input_", "wiring/",
)  # fmt: skip
_WIRING = "wiring/"


def fault_answers(
    clean: Campaign,
    label: Label,
    faults: Sequence[Fault],
    seed: int,
    curves: Curves,
    *,
    first: int = 0,
) -> Iterator[Outcome]:
    """Diagnose a campaign with one error after the other.

    Parameters
    ----------
    clean : Campaign
        Campaign without an error.
    label : Label
        What is missing in it.
    faults : sequence of Fault
        Errors.
    seed : int
        Seed of their random numbers.
    curves : mapping of str to DeflectionCurve, optional
        Deflection curves of a carrier.
    first : int
        Number of the error to begin with.

    Yields
    ------
    Outcome
        In the order of the errors; `by` has the gap in floors, the verdict, what is named and the
        new findings.
    """
    examination = examined(clean, curves)
    before, floor = _squares(examination)
    findings = {*examination.warnings, *examination.baseline().warnings}
    without = {(one.id or one.check, one.about) for one in findings}
    for number, fault in list(enumerate(faults))[first:]:
        try:
            faulty = fault.change(clean, np.random.default_rng([seed, number]))
            examination = examined(faulty, curves)
            residual_square, _ = _squares(examination)
            floors = float(np.sqrt(max(residual_square - before, 0.0) / floor))
            if floors < _FLOORS:
                yield Outcome(fault.name, fault.size, SMALL, (f"{floors:.1f} floors",))
                continue
            diagnosis = examination.diagnosis()
        except ValueError as error:
            yield Outcome(fault.name, fault.size, REPORTED, (REFUSED, str(error)[:200]))
            continue
        new = [one for one in diagnosis.warnings if (one.id or one.check, one.about) not in without]
        answer = answer_of(fault, label, diagnosis, new)
        yield Outcome(
            fault.name, fault.size, answer, (f"{floors:.1f} floors", *_words(diagnosis, new))
        )


def _squares(examination: ExaminedCampaign) -> tuple[float, float]:
    """Mean square that the fitted baseline leaves, and that of the noise."""
    problem = examination.problem
    residual_square = mean_square_left(problem, fit_effects(problem, ()))
    return residual_square, problem.noise_floor_square


def _named(diagnosis: Diagnosis) -> set[str]:
    """Laws and classes that are named."""
    if diagnosis.verdict not in (*NAMING, CLASS_NAMED):
        return set()
    return {*diagnosis.attribution.effects, *diagnosis.class_ids}


def _ties(diagnosis: Diagnosis) -> set[str]:
    """What is tied with something else, and the fault that is the reason."""
    tied = {name for names in diagnosis.attribution.aliases for name in names}
    return {*tied, *([diagnosis.reason_id] if diagnosis.reason_id else [])}


def answer_of(
    fault: Fault, label: Label, diagnosis: Diagnosis, new: Sequence[CampaignWarning]
) -> str:
    """Which of the `ANSWERS` a diagnosis gives.

    Parameters
    ----------
    fault : Fault
        Error that is in the records.
    label : Label
        What is missing in the baseline.
    diagnosis : Diagnosis
        Diagnosis of the campaign with the error.
    new : sequence of CampaignWarning
        Findings that the campaign without the error does not have.
    """
    named, ties = _named(diagnosis), _ties(diagnosis)
    ids = {name for one in new for name in (one.id, one.check)} | ties | named
    if ids & set(fault.ids):
        return REPORTED
    true = {*label.effects, *label.classes}
    for sets in (label.acceptable, label.class_aliases):
        true |= {name for names in sets for name in names}
    if diagnosis.classes is not None:
        holders = diagnosis.classes.classes_of_law
        true |= {name for law in set(true) for name in holders.get(law, ())}
    physics = {name for name in named - true if not name.startswith(_OF_MEASUREMENT)}
    is_tied = diagnosis.verdict == ALIASED and any(name.startswith(_WIRING) for name in ties)
    if physics and not is_tied:
        return PHYSICS
    if not fault.ids:
        return HARMLESS
    return ANOTHER if new else SILENT


def _words(diagnosis: Diagnosis, new: Sequence[CampaignWarning]) -> Iterator[str]:
    """Verdict, names, ties and new findings."""
    yield f"{diagnosis.verdict} {', '.join(sorted(_named(diagnosis)))}".strip()
    if diagnosis.reason_id:
        yield f"reason {diagnosis.reason_id}"
    for one in new:
        yield f"{one.id or one.check} of {one.about}: {one.figure:.3g}"
