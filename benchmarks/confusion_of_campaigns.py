"""What evidence and confusion say of campaigns whose truth is known, and what they cost.

``python -m benchmarks.confusion_of_campaigns --kind element --cases 6 --seed 16``: campaigns of the
blind check's own truth. A row each: the verdict; candidate of the largest evidence; whether the
named candidate, simulated, gives the verdict again; processor time over that of the diagnosis.
"""

import argparse
import time
from dataclasses import dataclass

from carrierflex.blind_check.case_plans import case_plans
from carrierflex.blind_check.labels import CasePlan
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.diagnosis.comparison.effect_names import set_name
from carrierflex.diagnosis.inference.confusion.words import answer_words
from carrierflex.diagnosis.inference.results import NAMING
from carrierflex.workflows.support.default_curves import default_curves
from carrierflex.workflows.support.examination import examined


@dataclass(frozen=True)
class Counted:
    """One campaign.

    `agrees` and `is_right`: the evidence's candidate is the held-out one, and holds nothing but
    what is acceptable; None where the verdict names no law, or the truth holds none of the library.
    """

    text: str
    cost: float
    agrees: bool | None
    is_right: bool | None
    diagonal: float


def counted(plan: CasePlan) -> Counted:
    """Diagnose a campaign, weigh its candidates, and count its draws."""
    campaign, label = case_campaign(plan)
    curves = default_curves() if plan.kind == "carrier" else None
    begun = time.process_time()
    examination = examined(campaign, curves)
    diagnosis = examination.inference()
    examination.checked(diagnosis)
    alone = time.process_time() - begun
    found = examination.confusion(diagnosis)
    cost = (time.process_time() - begun) / alone
    if found is None or diagnosis.evidence is None:
        return Counted(f"{plan.name} {plan.effects}: {diagnosis.verdict}", cost, None, None, 0.0)
    preferred = diagnosis.evidence.preferred.effects
    own = found.row_of(found.named)
    diagonal = own.count(found.answer) / len(own.answers) if own else 0.0
    allowed = {name for names in label.acceptable for name in names} | set(label.present)
    is_named = diagnosis.verdict in NAMING
    rows = "; ".join(
        f"{set_name(row.effects)}: {row.count(found.answer)}/{len(row.answers)}"
        for row in found.rows
    )
    text = (
        f"{plan.name} {' + '.join(plan.effects)}, gap {plan.ratio:.1f}: "
        f"{answer_words(found.answer)}; evidence for {set_name(preferred)}; {rows}; "
        f"{alone:.1f} s, cost {cost:.1f}"
    )
    return Counted(
        text,
        cost,
        preferred == found.named if is_named else None,
        set(preferred) <= allowed if allowed or not plan.effects else None,
        diagonal,
    )


def main(kind: str, cases: int, seed: int) -> None:
    """Print every campaign and the totals."""
    rows = []
    for plan in case_plans(kind, cases, seed):
        rows.append(counted(plan))
        print(rows[-1].text, flush=True)
    agreeing = [row.agrees for row in rows if row.agrees is not None]
    right = [row.is_right for row in rows if row.is_right is not None]
    print(
        f"{len(rows)} campaigns: cost {max(row.cost for row in rows):.1f} at most; evidence agrees "
        f"with the verdict in {sum(agreeing)} of {len(agreeing)} named, with the truth in "
        f"{sum(right)} of {len(right)}; mean diagonal "
        f"{sum(row.diagonal for row in rows) / len(rows):.2f}"
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kind", default="element")
    parser.add_argument("--cases", type=int, default=6)
    parser.add_argument("--seed", type=int, default=16)
    given = parser.parse_args()
    main(given.kind, given.cases, given.seed)
