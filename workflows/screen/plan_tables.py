"""A plan of a campaign as tables on the screen."""

import numpy as np
from rich.console import Group, RenderableType

from carrierflex.diagnosis.inference.planning.report import first_sentences
from carrierflex.diagnosis.inference.planning.results import CampaignPlan
from carrierflex.workflows.screen.titled_table import titled_table

#: Additions that are shown.
_MOST_ADDITIONS = 8


def plan_table(plan: CampaignPlan) -> RenderableType:
    """Sentences, then smallest sizes, pairs that are not parted, additions."""
    return Group(first_sentences(plan), "", _sizes(plan), "", _pairs(plan), "", _additions(plan))


def _sizes(plan: CampaignPlan) -> RenderableType:
    table = titled_table(
        f"smallest sizes (noise {plan.noise_std:.2g} {plan.unit})",
        "cause", "parameter", "seen from", "named from", "gap seen [floors]", "beside the baseline",
    )  # fmt: skip
    for own in plan.sizes:
        table.add_row(
            own.effect,
            f"{own.parameter} [{own.unit}]",
            _number(own.seen_from),
            _number(own.named_from),
            _number(own.gap_seen),
            f"{own.surviving:.0%}",
        )
    return table


def _pairs(plan: CampaignPlan) -> RenderableType:
    table = titled_table(
        f"not told apart at {plan.gap:.3g} floors",
        "cause", "fitted instead", "angle [deg]", "left [floors]", "parted from [floors]",
        "by an addition",
    )  # fmt: skip
    for pair in plan.pairs:
        if pair.state != "parted":
            table.add_row(
                pair.cause,
                pair.rival,
                f"{pair.angle_deg:.1f}",
                f"{pair.left:.2f}",
                _number(pair.parted_from),
                "yes" if pair.state == "alike" else "no",
            )
    return table


def _additions(plan: CampaignPlan) -> RenderableType:
    table = titled_table(
        "additions", "addition", "cost [min]", "pairs parted", "least left [floors]", "distance",
        "information per min [nat]",
    )  # fmt: skip
    for ranked in plan.additions[:_MOST_ADDITIONS]:
        table.add_row(
            ranked.addition.text,
            f"{ranked.addition.cost:.0f}",
            f"{len(ranked.parted)} of {len(plan.alike)}",
            f"{ranked.least_left:.2f}",
            f"{ranked.distance:.0f}",
            _number(ranked.per_cost),
        )
    return table


def _number(value: float) -> str:
    return f"{value:.3g}" if np.isfinite(value) else "never"
