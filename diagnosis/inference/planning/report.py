"""A plan in sentences and in a picture."""

from typing import TYPE_CHECKING

import numpy as np

from carrierflex.diagnosis.comparison.effect_names import plain_name
from carrierflex.diagnosis.inference.planning.results import (
    NEVER,
    CampaignPlan,
    CausePair,
    RankedAddition,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


#: Pairs that a sentence names.
_MOST = 6
#: Angles from which two signatures share next to nothing [deg].
_APART = 90.0


def _pair_words(pairs: tuple[CausePair, ...]) -> str:
    """Each cause with the rivals that pass for it: ``pin clearance (as stiff pins)``."""
    rivals: dict[str, list[str]] = {}
    for pair in pairs:
        rivals.setdefault(pair.cause, []).append(plain_name(pair.rival))
    named = [f"{plain_name(cause)} (as {' or '.join(others)})" for cause, others in rivals.items()]
    more = f" and {len(named) - _MOST} more" if len(named) > _MOST else ""
    return ", ".join(named[:_MOST]) + more


def first_sentences(plan: CampaignPlan) -> str:
    """What cannot be seen, what looks alike, what to add."""
    unseen = [plain_name(cause.effect) for cause in plan.sizes if cause.gap_seen == float("inf")]
    sentences = []
    if unseen:
        sentences.append(f"Not to be seen beside the baseline: {', '.join(unseen)}.")
    size = f"a gap of {plan.gap:.3g} floors"
    where = f"the gap of the records, {plan.gap:.3g} floors" if plan.is_measured else size
    if not plan.pairs:
        fit = "One cause alone fits" if plan.is_measured else "Fewer than two causes leave"
        sentences.append(f"{fit} {where}; nothing is to be told apart.")
        return " ".join(sentences)
    if not plan.alike:
        sentences.append(f"At {where} no cause passes for another that could be told from it.")
    else:
        sentences.append(
            f"At {where} these could pass for another: {_pair_words(plan.alike)}; a rival leaves "
            f"less than {plan.left_wanted:g} floors of them."
        )
    never = tuple(pair for pair in plan.pairs if pair.state == NEVER)
    if never:
        sentences.append(
            f"Nothing feasible parts {_pair_words(never)}: one holds the other as a limit, or no "
            "sensor and load tells them; of equal fits the simpler is named."
        )
    if plan.proposal is not None:
        sentences.append(_proposal_words(plan.proposal, len(plan.alike)))
    return " ".join(sentences)


def _proposal_words(ranked: RankedAddition, n_alike: int) -> str:
    """The first proposal with how well it parts."""
    cost = f"{ranked.addition.cost:.0f} min on the rig"
    if ranked.is_sufficient:
        return (
            f"Cheapest sufficient addition: {ranked.addition.text} ({cost}); every rival then "
            f"leaves {ranked.least_left:.1f} floors or more, a Mahalanobis distance of "
            f"{ranked.distance:.0f} from the noise alone."
        )
    return (
        f"No addition parts them all; the one that parts most: {ranked.addition.text} ({cost}), "
        f"{len(ranked.parted)} of {n_alike} pairs."
    )


def plan_figure(plan: CampaignPlan) -> "Figure":
    """Sizes and pairs of a plan.

    Parameters
    ----------
    plan : CampaignPlan
        Plan.

    Returns
    -------
    Figure
        Bars of the sizes from which a cause is seen and named, over the size worth noticing; map of
        the smallest angle between each cause and each rival [deg].
    """
    from matplotlib.figure import Figure

    height = 2.4 + 0.34 * max(len(plan.sizes), 4)
    figure = Figure(figsize=(14.0, height), layout="constrained")
    sizes, pairs = figure.subplots(1, 2, width_ratios=(1.0, 1.25))
    _draw_sizes(sizes, plan)
    _draw_pairs(pairs, plan)
    figure.suptitle(f"{plan.campaign}: what this campaign could see and part")
    return figure


def _draw_sizes(axes: "Axes", plan: CampaignPlan) -> None:
    names = [plain_name(size.effect) for size in plan.sizes]
    rows = np.arange(len(names))
    visible = np.array([size.seen_from / size.noticeable for size in plan.sizes])
    named = np.array([size.named_from / size.noticeable for size in plan.sizes])
    there = np.isfinite(visible)
    if there.any():
        least = 0.3 * visible[there].min()
        axes.barh(rows[there], named[there] - least, left=least, color="#c9d8e8", label="named")
        axes.barh(rows[there], visible[there] - least, left=least, color="#3f74a8", label="seen")
        axes.set_xscale("log")
        axes.set_xlim(left=least)
        axes.axvline(1.0, color="0.4", linewidth=0.8, linestyle="--")
        axes.legend(loc="lower right", fontsize=8)
    for k in rows[~there]:
        axes.text(0.02, k, "not seen", va="center", fontsize=8, color="0.4",
                  transform=axes.get_yaxis_transform())  # fmt: skip
    axes.set_yticks(rows, names, fontsize=8)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_xlabel("size from which it is seen, and named, over the size worth noticing")


def _draw_pairs(axes: "Axes", plan: CampaignPlan) -> None:
    causes = list(dict.fromkeys(pair.cause for pair in plan.pairs))
    if not causes:
        axes.text(0.5, 0.5, "nothing to be told apart", ha="center", va="center")
        axes.set_axis_off()
        return
    angle = np.full((len(causes), len(causes)), np.nan)
    for pair in plan.pairs:
        angle[causes.index(pair.cause), causes.index(pair.rival)] = pair.angle_deg
    image = axes.imshow(angle, vmin=0.0, vmax=_APART, cmap="YlGnBu", aspect="auto")
    alike = {(pair.cause, pair.rival) for pair in plan.alike}
    for row, cause in enumerate(causes):
        for column, rival in enumerate(causes):
            if cause == rival:
                continue
            value = angle[row, column]
            axes.text(column, row, f"{value:.0f}", ha="center", va="center", fontsize=7,
                      color="white" if value > 0.6 * _APART else "black",
                      fontweight="bold" if (cause, rival) in alike else "normal")  # fmt: skip
    names = [plain_name(name) for name in causes]
    axes.set_xticks(range(len(names)), names, rotation=55, ha="right", fontsize=8)
    axes.set_yticks(range(len(names)), names, fontsize=8)
    axes.set_xlabel(f"effect that is fitted (bold: passes for the cause at {plan.gap:.3g} floors)")
    axes.set_ylabel("cause")
    axes.figure.colorbar(image, ax=axes, label="smallest angle between signatures [deg]")
