"""A plan on one page: smallest sizes as bars, angles between causes as a map."""

from typing import TYPE_CHECKING

import numpy as np

from carrierflex.diagnosis.comparison.effect_names import plain_name
from carrierflex.diagnosis.inference.planning.results import CampaignPlan

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Angles from which two signatures share next to nothing [deg].
_APART = 90.0


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
    names = [plain_name(own.effect) for own in plan.sizes]
    place = np.arange(len(names))
    seen = np.array([own.seen_from / own.noticeable for own in plan.sizes])
    named = np.array([own.named_from / own.noticeable for own in plan.sizes])
    there = np.isfinite(seen)
    if there.any():
        least = 0.3 * seen[there].min()
        axes.barh(place[there], named[there] - least, left=least, color="#c9d8e8", label="named")
        axes.barh(place[there], seen[there] - least, left=least, color="#3f74a8", label="seen")
        axes.set_xscale("log")
        axes.set_xlim(left=least)
        axes.axvline(1.0, color="0.4", linewidth=0.8, linestyle="--")
        axes.legend(loc="lower right", fontsize=8)
    for k in place[~there]:
        axes.text(0.02, k, "not seen", va="center", fontsize=8, color="0.4",
                  transform=axes.get_yaxis_transform())  # fmt: skip
    axes.set_yticks(place, names, fontsize=8)
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
    names = [plain_name(own) for own in causes]
    axes.set_xticks(range(len(names)), names, rotation=55, ha="right", fontsize=8)
    axes.set_yticks(range(len(names)), names, fontsize=8)
    axes.set_xlabel(f"effect that is fitted (bold: passes for the cause at {plan.gap:.3g} floors)")
    axes.set_ylabel("cause")
    axes.figure.colorbar(image, ax=axes, label="smallest angle between signatures [deg]")
