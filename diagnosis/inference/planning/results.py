"""What a plan says: smallest sizes, causes that look alike, additions; sentences and a picture."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import numpy as np

from carrierflex.diagnosis.comparison.effect_names import plain_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: How an addition is made: a sensor more, runs under other loads, longer runs.
SENSOR = "sensor"
LOADS = "load_case"
MINUTES = "minutes"
#: What becomes of a pair: told apart as planned, by what can be added, or by nothing feasible.
PARTED = "parted"
ALIKE = "alike"
NEVER = "never"


@dataclass(frozen=True)
class Costs:
    """What an addition costs, in minutes on the rig that could be had instead."""

    sensor: Annotated[float, "One more sensor: bracket, cable, calibration (assumed)"] = 240.0
    load_case: Annotated[
        float, "One more load case in addition to its length: settling, zeros (assumed)"
    ] = 15.0
    minute: Annotated[float, "A minute of record"] = 1.0


@dataclass(frozen=True)
class RigLimits:
    """What the rig can do."""

    torque: Annotated[float, "Largest torque [N m]"] = 4.0e5
    radial_load: Annotated[float, "Largest radial load [N]"] = 2.0e5
    sensor_angles: Annotated[
        tuple[float, ...], "Housing angles for sensors [rad]; every 30 degrees where empty"
    ] = ()


@dataclass(frozen=True, eq=False)
class Addition:
    """Something that could be added to a campaign."""

    kind: Annotated[str, "SENSOR, LOADS or MINUTES"]
    text: Annotated[str, "What it is, as a sentence"]
    minutes: Annotated[
        Mapping[str, float], "Length of every run of the enlarged campaign, over that in the table"
    ]
    channels: Annotated[tuple[str, ...], "Channels of the enlarged campaign"]
    cost: Annotated[float, "Minutes on the rig"]


@dataclass(frozen=True)
class VisibleSize:
    """From which size a cause is seen."""

    effect: Annotated[str, "Effect id"]
    parameter: Annotated[str, "Its first amplitude; the others grow alike, each by its scale"]
    unit: Annotated[str, "Unit of that"]
    noticeable: Annotated[float, "Smallest relevant size, as the library states it [unit]"]
    seen_from: Annotated[
        float,
        "Size from which the held-out gap shrinks in 97.5 % of draws, by noise alone [unit]; "
        "infinite where the baseline takes up all of it",
    ]
    named_from: Annotated[
        float, "Size from which the gap clears the rule of the noise floor too [unit]"
    ]
    gap_seen: Annotated[float, "RMS of the gap at `seen_from`, in floors of noise"]
    gap_named: Annotated[float, "RMS of the gap at `named_from`, in floors of noise"]
    sigmas: Annotated[float, "Standard deviations that a signature of as many amplitudes needs"]
    surviving: Annotated[float, "Share of the signature that the baseline leaves"]


@dataclass(frozen=True)
class HiddenSize:
    """From which size a cause is seen where no run has its radial load on record."""

    effect: Annotated[str, "Effect id"]
    parameter: Annotated[str, "Its first amplitude"]
    unit: Annotated[str, "Unit of that"]
    none: Annotated[float, "Size from which it is seen where no radial load acts [unit]"]
    unrecorded: Annotated[
        float,
        "The same beside an unrecorded load of up to the rig's limit, which tilts and warps the "
        "housing and shifts load between the pins, run by run, by noticeable amounts [unit]",
    ]
    bending: Annotated[
        float, "The same with strain gauges of the main shaft's bending moments M_y, M_z [unit]"
    ]


@dataclass(frozen=True)
class CausePair:
    """How far a cause and another that is fitted in its place are apart."""

    cause: Annotated[str, "Effect that acts"]
    rival: Annotated[str, "Effect that is fitted"]
    angle_deg: Annotated[
        float,
        "Smallest angle between the signatures after removal of the baseline, of the median shape "
        "[deg]",
    ]
    left: Annotated[float, "RMS that the rival leaves of the cause's gap, in floors of noise"]
    parted_from: Annotated[
        float,
        "Gap of the cause, in floors, from which it is distinguished from the rival; infinite: "
        "never",
    ]
    state: Annotated[str, "PARTED, ALIKE or NEVER"]


@dataclass(frozen=True, eq=False)
class RankedAddition:
    """An addition and what it brings."""

    addition: Annotated[Addition, "What is added"]
    least_left: Annotated[
        float,
        "RMS that a rival leaves at least of the pairs not distinguished as planned, in floors",
    ]
    mean_left: Annotated[
        float, "Geometric mean of the same: of equal costs the largest comes first"
    ]
    distance: Annotated[float, "Mahalanobis distance of the least separated pair"]
    information: Annotated[
        float, "Expected log odds for the true cause in that pair, ``d² / 2`` [nat]"
    ]
    per_cost: Annotated[float, "The same over the cost [nat/min]"]
    parted: Annotated[tuple[tuple[str, str], ...], "Pairs it parts, cause and rival"]
    is_sufficient: Annotated[bool, "Whether it parts every pair that something feasible parts"]


@dataclass(frozen=True, eq=False)
class CampaignPlan:
    """Causes that a campaign can detect and separate, and what to add."""

    campaign: Annotated[str, "Name of the case or campaign"]
    kind: Annotated[str, "Kind of the campaign"]
    unit: Annotated[str, "Unit of the channels"]
    gap: Annotated[float, "Gap in floors at which causes are to be distinguished"]
    noise_std: Annotated[float, "Floor: root of the mean variance of the noise [unit]"]
    is_measured: Annotated[
        bool,
        "Whether records say which amplitudes a cause has; else those that another imitates best",
    ]
    left_wanted: Annotated[float, "RMS that a rival must leave, in floors"]
    sizes: Annotated[tuple[VisibleSize, ...], "Size from which each cause is seen; infinite: never"]
    pairs: Annotated[tuple[CausePair, ...], "Every cause with every rival"]
    additions: Annotated[
        tuple[RankedAddition, ...], "Cheapest sufficient first, then most separated for their cost"
    ]
    costs: Annotated[Costs, "What additions cost [min]"]
    hidden: Annotated[
        tuple[HiddenSize, ...],
        "What an unrecorded radial load hides and strain gauges bring back; empty where a run has "
        "its radial load on record or the rig has none",
    ] = ()

    @property
    def alike(self) -> tuple[CausePair, ...]:
        """Pairs that are alike as planned and that something feasible parts."""
        return tuple(pair for pair in self.pairs if pair.state == ALIKE)

    @property
    def proposal(self) -> RankedAddition | None:
        """First proposal; None where nothing is alike, or nothing feasible parts it."""
        return self.additions[0] if self.alike and self.additions else None


#: Pairs that a sentence names.
_MOST = 6
#: Causes hidden by an unrecorded load that a sentence names.
_MOST_HIDDEN = 3
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
        sentences.append(f"Not detectable with this baseline: {', '.join(unseen)}.")
    size = f"a gap of {plan.gap:.3g} floors"
    where = f"the gap of the records, {plan.gap:.3g} floors" if plan.is_measured else size
    if plan.hidden:
        sentences.append(_hidden_words(plan.hidden))
    if not plan.pairs:
        fit = "One cause alone fits" if plan.is_measured else "Fewer than two causes leave"
        sentences.append(f"{fit} {where}; there is nothing to distinguish.")
        return " ".join(sentences)
    if plan.alike:
        sentences.append(
            f"At {where} these can be confused with another cause: {_pair_words(plan.alike)}; a "
            f"rival leaves a residual below {plan.left_wanted:g} floors."
        )
    else:
        sentences.append(
            f"At {where} no cause is mistaken for another that can be distinguished from it."
        )
    never = tuple(pair for pair in plan.pairs if pair.state == NEVER)
    if never:
        sentences.append(
            f"No feasible addition separates {_pair_words(never)}: one contains the other as a "
            "limit, or no sensor and load distinguishes them; of equal fits the simpler one is "
            "named."
        )
    if plan.proposal is not None:
        sentences.append(_proposal_words(plan.proposal, len(plan.alike)))
    return " ".join(sentences)


def _hidden_words(sizes: tuple[HiddenSize, ...]) -> str:
    """What an unrecorded radial load hides most, and what strain gauges bring back."""
    hidden = [size for size in sizes if size.unrecorded > 2.0 * size.none]
    hidden.sort(key=lambda size: size.none / size.unrecorded)
    named = "; ".join(
        f"{plain_name(size.effect)} below {size.unrecorded:.2g} {size.unit} (with strain gauges "
        f"of the main shaft's bending {size.bending:.2g} {size.unit})".replace(" 1)", ")")
        for size in hidden[:_MOST_HIDDEN]
    )
    start = "No run has a radial load on record"
    if not named:
        return f"{start}; an unrecorded one would not hide any cause."
    return f"{start}; one that acts unrecorded would hide {named}."


def _proposal_words(ranked: RankedAddition, n_alike: int) -> str:
    """The first proposal with how well it parts."""
    cost = f"{ranked.addition.cost:.0f} min on the rig"
    if ranked.is_sufficient:
        return (
            f"Cheapest sufficient addition: {ranked.addition.text} ({cost}); every rival then "
            f"leaves a residual of {ranked.least_left:.1f} floors or more, a Mahalanobis distance "
            f"of {ranked.distance:.0f} from the noise alone."
        )
    return (
        f"No addition separates all pairs; the best one: {ranked.addition.text} ({cost}), "
        f"{len(ranked.parted)} of {n_alike} pairs."
    )


def plan_figure(plan: CampaignPlan) -> "Figure":
    """Sizes and pairs of a plan.

    Bars of the sizes from which a cause is seen and named, over the size worth noticing; map of the
    smallest angle between each cause and each rival [deg].
    """
    from matplotlib.figure import Figure

    height = 2.4 + 0.34 * max(len(plan.sizes), 4)
    figure = Figure(figsize=(14.0, height), layout="constrained")
    sizes, pairs = figure.subplots(1, 2, width_ratios=(1.0, 1.25))
    _draw_sizes(sizes, plan)
    _draw_pairs(pairs, plan)
    figure.suptitle(f"{plan.campaign}: what this campaign can detect and separate")
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
    axes.set_xlabel("size from which it is detected, and named, over the relevant size")


def _draw_pairs(axes: "Axes", plan: CampaignPlan) -> None:
    causes = list(dict.fromkeys(pair.cause for pair in plan.pairs))
    if not causes:
        axes.text(0.5, 0.5, "nothing to distinguish", ha="center", va="center")
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
