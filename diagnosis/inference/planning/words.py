"""A plan in sentences."""

from carrierflex.diagnosis.comparison.effect_names import plain_name
from carrierflex.diagnosis.inference.planning.results import (
    NEVER,
    CampaignPlan,
    CausePair,
    RankedAddition,
)

#: Pairs that a sentence names.
_MOST = 6


def pair_words(pairs: tuple[CausePair, ...]) -> str:
    """Each cause with the rivals that pass for it: ``pin clearance (as stiff pins)``."""
    rivals: dict[str, list[str]] = {}
    for pair in pairs:
        rivals.setdefault(pair.cause, []).append(plain_name(pair.rival))
    named = [f"{plain_name(own)} (as {' or '.join(others)})" for own, others in rivals.items()]
    more = f" and {len(named) - _MOST} more" if len(named) > _MOST else ""
    return ", ".join(named[:_MOST]) + more


def first_sentences(plan: CampaignPlan) -> str:
    """What cannot be seen, what looks alike, what to add."""
    unseen = [plain_name(own.effect) for own in plan.sizes if own.gap_seen == float("inf")]
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
            f"At {where} these could pass for another: {pair_words(plan.alike)}; a rival leaves "
            f"less than {plan.left_wanted:g} floors of them."
        )
    never = tuple(pair for pair in plan.pairs if pair.state == NEVER)
    if never:
        sentences.append(
            f"Nothing feasible parts {pair_words(never)}: one holds the other as a limit, or no "
            "sensor and load tells them; of equal fits the simpler is named."
        )
    if plan.proposal is not None:
        sentences.append(proposal_words(plan.proposal, len(plan.alike)))
    return " ".join(sentences)


def proposal_words(ranked: RankedAddition, n_alike: int) -> str:
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
