"""Which faults of a measuring chain are noticed: one row a fault and size, over seeds.

Campaigns of the blind check with nothing missing get one fault each. Detected: `check` tells a
finding that the campaign without the fault does not give, or refuses it. Of the others, harmless:
the verdict and every parameter of the baseline stay (within 3 standard deviations). A good answer:
nothing missed.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from threadpoolctl import threadpool_limits

from carrierflex.blind_check.case_plans import case_plans
from carrierflex.blind_check.faults.fault_table import faults_of
from carrierflex.blind_check.labels import NOTHING, CasePlan
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.diagnosis.baseline_check import checked_baseline, with_findings
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.kinds import problem_of, wiring_of
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.files.whole_files import whole_file
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning
from carrierflex.identification.campaign_check.copies import without_copies
from carrierflex.identification.campaign_check.records_check import records_findings
from carrierflex.workflows.support.default_curves import default_curves

DETECTED = "detected"
HARMLESS = "harmless"
MISSED = "missed"
#: Standard deviations within which a parameter of the baseline has not moved.
_UNMOVED = 3.0
#: Cases of a plan that holds some with nothing missing.
_CASES = 60


@dataclass(frozen=True)
class FaultRow:
    """A fault of one size, and how often it was detected, harmless or missed."""

    fault: str
    size: str
    counts: tuple[int, int, int]


def main(
    *, out: Path, kind: Literal["carrier", "mounting", "element"], seeds: Sequence[int] = (1, 2, 3)
) -> tuple[FaultRow, ...]:
    """Put every fault into campaigns without one and count what becomes of it.

    Parameters
    ----------
    out : Path
        Markdown file for the table.
    kind : str
        Kind of campaign.
    seeds : sequence of int
        Seeds of the campaigns.

    Returns
    -------
    tuple of FaultRow
        In the order of the faults.
    """
    counts = {(fault.name, fault.size): [0, 0, 0] for fault in faults_of(kind)}
    with threadpool_limits(limits=1):
        for seed in seeds:
            clean = case_campaign(_without_effect(kind, seed))[0]
            told = {finding.check for finding in _findings(clean)}
            before: list[Diagnosis] = []
            for number, fault in enumerate(faults_of(kind)):
                rng = np.random.default_rng([seed, number])
                outcome = _outcome(clean, fault.change(clean, rng), told, before)
                counts[fault.name, fault.size][(DETECTED, HARMLESS, MISSED).index(outcome)] += 1
    rows = tuple(
        FaultRow(name, size, (found[0], found[1], found[2]))
        for (name, size), found in counts.items()
    )
    with whole_file(out) as file:
        file.write_text(_table(kind, rows), encoding="utf-8")
    return rows


def _without_effect(kind: str, seed: int) -> CasePlan:
    """First case of a check with nothing missing."""
    plans = case_plans(kind, _CASES, seed)
    return next(plan for plan in plans if plan.family == NOTHING)


def _outcome(clean: Campaign, faulty: Campaign, told: set[str], before: list[Diagnosis]) -> str:
    """What becomes of a fault; the diagnosis without it is made once, where it is first needed."""
    try:
        if {finding.check for finding in _findings(faulty)} - told:
            return DETECTED
    except ValueError:
        return DETECTED
    if not before:
        before.append(_diagnosed(clean))
    after = _diagnosed(faulty)
    same = after.verdict == before[0].verdict and _unmoved(before[0], after)
    return HARMLESS if same else MISSED


def _findings(campaign: Campaign) -> tuple[CampaignWarning, ...]:
    curves = default_curves() if campaign.kind == "carrier" else None
    records = records_findings(campaign, curves)
    if records:
        return records
    distinct = without_copies(campaign)
    problem = problem_of(distinct, curves)[0]
    return checked_baseline(problem, distinct, wiring_of(problem, distinct)).warnings


def _diagnosed(campaign: Campaign) -> Diagnosis:
    curves = default_curves() if campaign.kind == "carrier" else None
    problem, measured = problem_of(campaign, curves)
    found = diagnose(
        problem, campaign=campaign.name, kind=campaign.kind, floor_is_measured=measured
    )
    baseline = checked_baseline(problem, campaign, wiring_of(problem, campaign))
    return with_findings(found, (), baseline)


def _unmoved(before: Diagnosis, after: Diagnosis) -> bool:
    for effect, values in before.attribution.parameters.items():
        for name, value in values.items():
            moved = after.attribution.parameters.get(effect, {}).get(name)
            known = moved is not None and np.isfinite([value.std, moved.std]).all()
            if known and moved is not None:
                limit = _UNMOVED * float(np.hypot(value.std, moved.std))
                if abs(moved.value - value.value) > limit:
                    return False
    return True


def _table(kind: str, rows: Sequence[FaultRow]) -> str:
    lines = [f"| {kind}: fault | size | detected | harmless | missed |", "|---|---|---|---|---|"]
    lines += [f"| {row.fault} | {row.size} | {' | '.join(map(str, row.counts))} |" for row in rows]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)
