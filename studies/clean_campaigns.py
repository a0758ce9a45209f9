"""Campaigns without a fault of the measuring chain, and what is reported of them.

With nothing missing, with effects of 0.5 to 30 floors that the baseline does not have, and with the
prediction of another simulator in place of the model.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from carrierflex.blind_check.case_plans import case_plans
from carrierflex.blind_check.labels import NOTHING, OUTSIDE, CasePlan, Label
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.diagnosis.carrier.problem import flexibility
from carrierflex.diagnosis.inference.effect_fit import fit_effects
from carrierflex.diagnosis.kinds import problem_of
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.workflows.diagnosis.examination import examined
from studies.fault_outcomes import Curves

WITHOUT_EFFECT = "nothing missing"
WITH_EFFECT = "an effect missing"
BESIDE_COLUMNS = "prediction columns"
SORTS = (WITHOUT_EFFECT, WITH_EFFECT, BESIDE_COLUMNS)

#: Campaigns by kind, in the order of `SORTS`: 200 in all, 55 with effects, 20 with columns.
_COUNTS = {"carrier": (80, 30, 4), "element": (35, 20, 14), "mounting": (10, 5, 2)}
#: Cases of the plan that they are taken from: of a carrier's one in fifteen holds nothing, of an
#: element's one in five.
_PLANNED = {"carrier": 1260, "element": 602, "mounting": 168}


@dataclass(frozen=True)
class CleanCase:
    """One campaign to be checked: its plan, and whether a prediction stands for the model."""

    sort: str
    plan: CasePlan


@dataclass(frozen=True)
class CleanOutcome:
    """What is reported of a campaign without a fault.

    Parameters
    ----------
    case, kind, sort : str
        Name, kind and one of `SORTS`.
    findings : tuple of str
        Checks that give a finding.
    change : str
        Verdict without and with the findings (``before -> after``); empty where it stays.
    is_tie : bool
        Whether that verdict ties the finding with all that is missing in truth: one more parameter
        of the baseline's own kind explains as much, and no check can call the finding false.
    """

    case: str
    kind: str
    sort: str
    findings: tuple[str, ...]
    change: str
    is_tie: bool


def clean_cases(seed: int) -> Iterator[CleanCase]:
    """Campaigns of a check, 200 in all.

    Parameters
    ----------
    seed : int
        Seed of the plans; the same one gives the same campaigns.
    """
    for kind, (n_without, n_with, n_columns) in _COUNTS.items():
        plans = case_plans(kind, _PLANNED[kind], seed)
        without = [plan for plan in plans if plan.family == NOTHING]
        # A cause outside the library may be a tone or a jump, which a check is right to tell.
        missing = [plan for plan in plans if plan.family not in (NOTHING, OUTSIDE)]
        sorts = (
            (WITHOUT_EFFECT, without[:n_without]),
            (WITH_EFFECT, missing[:n_with]),
            (BESIDE_COLUMNS, without[n_without : n_without + n_columns]),
        )
        for sort, chosen in sorts:
            yield from (CleanCase(sort, plan) for plan in chosen)


def clean_outcome(case: CleanCase, curves: Curves) -> CleanOutcome:
    """Diagnose one campaign.

    Parameters
    ----------
    case : CleanCase
        Campaign.
    curves : mapping of str to DeflectionCurve, optional
        Deflection curves of a carrier.
    """
    campaign, label = case_campaign(case.plan)
    if case.sort == BESIDE_COLUMNS:
        campaign = beside_columns(campaign, curves)
    examination = examined(campaign, curves)
    before = examination.compared()
    after = examination.checked(before)
    change, is_tie = "", False
    if after.verdict != before.verdict:
        change = f"{before.verdict} -> {after.verdict}"
        truth = set(case.plan.effects)
        is_tie = any(truth <= set(tied) for tied in after.attribution.aliases)
    findings = {finding.id or finding.check for finding in after.warnings}
    if _flexibility(label) > 1.0:
        findings.discard("drawing")  # true: its sizes are beyond what the drawing allows
    ordered = tuple(sorted(findings))
    return CleanOutcome(case.plan.name, campaign.kind, case.sort, ordered, change, is_tie)


def _flexibility(label: Label) -> float:
    """Flexibility of the true carrier over its drawing, at most 1 as drawn."""
    stiff, flexible = (label.parameters.get(name, {}) for name in ("stiff_pins", "flexible_pins"))
    return flexibility(stiff.get("rho_s", 0.0), flexible.get("rho_f", 0.0))


def beside_columns(campaign: Campaign, curves: Curves) -> Campaign:
    """Campaign whose baseline is a column: the prediction of the model fitted to it.

    Parameters
    ----------
    campaign : Campaign
        Campaign with the model as its baseline.
    curves : mapping of str to DeflectionCurve, optional
        Deflection curves of a carrier.
    """
    problem = problem_of(campaign, curves)
    fit = fit_effects(problem, ())
    predicted = {record.run: record for record in problem.wiring(campaign).predictions(fit.theta)}
    names = [channel.name for channel in campaign.channels]
    runs = tuple(
        replace(run, predictions=dict(zip(names, predicted[run.name].predicted.T, strict=True)))
        for run in campaign.runs
    )
    return replace(campaign, runs=runs, baseline=replace(campaign.baseline, source="columns"))
