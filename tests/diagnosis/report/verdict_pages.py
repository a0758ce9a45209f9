"""Report pages of every kind and verdict, with sentences as long as real records make them."""

from dataclasses import replace

from carrierflex.diagnosis.classes.results import NAMED_CLASS, ClassAnswer, ClassFinding
from carrierflex.diagnosis.comparison.overlay import SignalComparison
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.inference.results import (
    ALIASED,
    AT_NOISE_FLOOR,
    CLASS_NAMED,
    NAMED_WITH_REMAINDER,
    NONE_OF_THESE,
    NOT_DIAGNOSABLE,
    VERDICTS,
    NamedValue,
)
from carrierflex.diagnosis.kinds import problem_of
from carrierflex.diagnosis.report.page import report_page
from carrierflex.diagnosis.report.report_data import ReportSource, report_data
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning
from tests.diagnosis.carrier.carrier_twin import twin_campaign, twin_problem
from tests.diagnosis.element.element_campaigns import displacement_campaign
from tests.diagnosis.mounting.mounting_campaigns import CONDITIONS, mounting_campaign

LOADS = ((1.0, 0, 0), (0.5, 0, 0), (1.0, 0, -2e5), (1.0, 1e5, 1e5))
#: Five effects at once, as the main job's load cases have them.
SEVERAL = {
    "carrier": ("carrier_tilt", "flange_warp", "torque_tilt", "ntl_tilt", "flexible_pins"),
    "mounting": ("cubic_stiffness", "coulomb_friction", "ntl_direction"),
    "element": ("cubic_stiffness", "coulomb_friction", "quadratic_damping"),
}
EXPERIMENT = (
    "to distinguish carrier tilt + flange warp + flexible pins from carrier tilt + flange warp + "
    "planet pass, run five radial loads along z up to 200 kN of both signs at full torque; "
    "predicted "
    "difference 1.9 times the noise. Equivalent: five radial loads along y up to 200 kN of both "
    "signs at full torque"
)
WARNING = CampaignWarning(
    "wiring",
    "torque",
    "with the torque of the other sign the baseline alone explains 99 % of the gap above the floor",
    "check first: torque sign",
    0.99,
    "line 1 of LC1.csv",
)


def diagnosed(kind):
    """Diagnosis of a small campaign of a kind, and the campaign."""
    if kind == "carrier":
        options = {"loads": LOADS, "turns": 8}
        problem, campaign = (
            twin_problem("carrier_tilt", **options),
            twin_campaign("carrier_tilt", **options),
        )
    elif kind == "mounting":
        campaign = mounting_campaign({"K3": 4e12}, conditions=CONDITIONS[:2])
        problem = problem_of(campaign)
    else:
        campaign = displacement_campaign(lambda q, v: 5e8 * q**3, n=1500)
        problem = problem_of(campaign)
    return diagnose(problem, campaign=f"twin {kind}", kind=kind), campaign


SOURCE = ReportSource("folder/twin", {"numpy": "2.0.1"}, "2026-01-02 03:04")


def data_of(diagnosis, campaign):
    return report_data(diagnosis, campaign, SOURCE)


def page_of(diagnosis, campaign):
    return report_page(data_of(diagnosis, campaign))


def pages(kind):
    """Page of every verdict by its name, drawn one after the other."""
    diagnosis, campaign = diagnosed(kind)
    for verdict in VERDICTS:
        yield verdict, page_of(with_verdict(diagnosis, verdict), campaign)


def with_verdict(diagnosis, verdict):
    """The diagnosis as if it had ended with another verdict."""
    which = diagnosis.attribution
    if verdict == NOT_DIAGNOSABLE:
        reason = "run LC1 holds 120 samples that count; expected at least 200"
        nothing = replace(
            which, effects=(), aliases=(), parameters={}, ranking=(),
            discriminating_experiment=reason,
        )  # fmt: skip
        return Diagnosis(
            diagnosis.campaign, diagnosis.kind, verdict, reason, diagnosis.unit, nothing
        )
    if verdict in (NONE_OF_THESE, AT_NOISE_FLOOR):
        return _without_effects(diagnosis, verdict)
    if verdict == CLASS_NAMED:
        answer = replace(diagnosis.classes or _class_answer(), ties=())
        nothing = replace(which, effects=(), aliases=())
        return replace(diagnosis, verdict=verdict, classes=answer, attribution=nothing)
    several = SEVERAL[diagnosis.kind]
    value = NamedValue(5.951e-4, 2e-6, "rad", (5.9e-4, 6e-4))
    more = {effect: {"amplitude": value, "phase": value} for effect in several}
    if verdict != ALIASED:
        classes = diagnosis.classes and replace(diagnosis.classes, ties=())
        diagnosis, which = replace(diagnosis, classes=classes), replace(which, aliases=())
    which = replace(which, effects=several, parameters={**which.parameters, **more})
    reason = (
        "explains 98.9% of the gap above the floor (mean square) on held-out records; what is left "
        "is 4.4 times the noise floor"
    )
    if verdict == ALIASED:
        aliases = (*which.aliases, (several[0], "ring_pass", "wiring/torque_sign"))
        which = replace(which, aliases=aliases, discriminating_experiment=EXPERIMENT)
        reason = f"check the measurement first: {WARNING.text}; otherwise {reason}"
        diagnosis = replace(diagnosis, warnings=(WARNING, WARNING))
    if verdict == NAMED_WITH_REMAINDER:
        which = replace(which, discriminating_experiment=EXPERIMENT)
    return replace(diagnosis, verdict=verdict, reason=reason, attribution=which)


def _without_effects(diagnosis, verdict):
    far = diagnosis.reduction
    same = replace(
        far, steps=far.steps[:1], rho=1.0, rms_after=far.rms_before, cells_after=far.cells_before
    )
    if verdict == AT_NOISE_FLOOR:
        same = replace(same, rms_before=far.noise_floor, rms_after=far.noise_floor)
    which = replace(diagnosis.attribution, effects=(), aliases=())
    signals = diagnosis.signals
    return replace(
        diagnosis,
        verdict=verdict,
        attribution=which,
        reduction=same,
        classes=None,
        signals=SignalComparison(signals.before, ()) if signals else None,
    )


def _class_answer():
    """A class of the kinds that have no shapes: one line beside the orders."""
    finding = ClassFinding("nonsynchronous/0.47X", 0.97, (0.95, 0.98), "", 0.0, False)
    return ClassAnswer(
        NAMED_CLASS, (finding,), (), {}, 0.97, (0.95, 0.98), 0.97, (), 0.0,
        {}, "the floor is estimated from these records",
    )  # fmt: skip
