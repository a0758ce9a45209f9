"""S5: the six verdicts, in their order; exactly one is given, with its reason."""

import numpy as np

from carrierflex.diagnosis.comparison.effect_names import set_name
from carrierflex.diagnosis.comparison.problem import Effects
from carrierflex.diagnosis.inference.alias_classes import is_named_consistently
from carrierflex.diagnosis.inference.forward_selection import ForwardSelection
from carrierflex.diagnosis.inference.held_out import HeldOut
from carrierflex.diagnosis.inference.results import (
    ALIASED,
    AT_NOISE_FLOOR,
    NAMED,
    NAMED_WITH_REMAINDER,
    NONE_OF_THESE,
    NOT_DIAGNOSABLE,
    GapReduction,
)
from carrierflex.diagnosis.inference.screening import Screen
from carrierflex.diagnosis.inference.selection import Selection


def verdict(
    search: ForwardSelection,
    screened: Screen,
    selection: Selection,
    classes: tuple[Effects, ...],
    reduction: GapReduction,
    *,
    floor_is_measured: bool,
    explainable: float,
) -> tuple[str, str]:
    """Verdict and its reason.

    Parameters
    ----------
    search, screened, selection, classes, reduction
        What the search found.
    floor_is_measured : bool
        Whether the noise floor was declared or comes from repeats.
    explainable : float
        Share of the gap that a flexible model explains.

    Returns
    -------
    tuple of str
        One of :data:`carrierflex.diagnosis.results.VERDICTS`, and a sentence.
    """
    limits = search.thresholds
    ratio = (
        (reduction.rms_before / reduction.noise_floor) ** 2
        if reduction.noise_floor > 0.0
        else np.inf
    )
    highest = limits.floor_ratio if floor_is_measured else limits.floor_ratio_estimated
    if ratio <= highest and (floor_is_measured or not selection.accepted):
        return (
            AT_NOISE_FLOOR,
            f"the held-out gap is {ratio:.3f} times the mean square of the noise floor",
        )
    if (
        ratio <= limits.coloured_ratio
        and explainable <= limits.nothing_learnt
        and not selection.accepted
    ):
        return AT_NOISE_FLOOR, (
            f"the held-out gap is {ratio:.2f} times the mean square of the noise floor, and a "
            "black-box reference learns nothing "
            "of it: as from noise whose neighbouring samples are correlated"
        )
    visible = [effect for effect in screened.effects if effect.surviving >= limits.surviving_share]
    if not visible:
        return (
            NOT_DIAGNOSABLE,
            "the baseline absorbs the signature of every effect in these records",
        )
    if not selection.accepted:
        return NONE_OF_THESE, _nothing_found(search, selection, explainable)
    refused = _doubt(search, selection, classes, reduction, explainable)
    if refused:
        return refused
    explained = (
        f"explains {reduction.phi:.1%} of the gap above the floor (mean square) on held-out records"
    )
    if reduction.floor_multiple > limits.remainder:
        return (
            NAMED_WITH_REMAINDER,
            f"{explained}; what is left is {reduction.floor_multiple:.1f} times the noise floor",
        )
    return (
        NAMED,
        f"{explained}; what is left is {reduction.floor_multiple:.2f} times the noise floor",
    )


def _doubt(
    search: ForwardSelection,
    selection: Selection,
    classes: tuple[Effects, ...],
    reduction: GapReduction,
    explainable: float,
) -> tuple[str, str] | None:
    """Verdict where the accepted effects are not to be named, and why."""
    limits = search.thresholds
    best_phi = reduction.phi
    share = (
        limits.named_share_beyond
        if reduction.floor_multiple > limits.gap_beyond_floor
        else limits.named_share
    )
    if best_phi < share:
        return NONE_OF_THESE, (
            f"the best set, {set_name(selection.accepted)}, explains {best_phi:.0%} of the gap and "
            "leaves "
            f"{reduction.floor_multiple:.1f} times the noise floor; a cause explains at least "
            f"{share:.0%} then"
        )
    if best_phi < limits.black_box_share * min(explainable, 1.0):
        return NONE_OF_THESE, (
            f"the best set explains {best_phi:.0%} of the gap, a black-box reference "
            f"{explainable:.0%}: it can be learnt, "
            "but not by this library"
        )
    if any(len(members) > 1 for members in classes) and selection.rivals:
        return ALIASED, f"{_listed(selection.rivals)} predicts held-out records as well"
    fit: HeldOut = search.score(selection.accepted)
    if not is_named_consistently(limits, fit.fit, fit.theta_by_fold):
        return (
            NONE_OF_THESE,
            "the parameters of the best set change from fold to fold beyond their error",
        )
    weight = selection.class_weight(classes)
    if weight < limits.class_weight and selection.rivals:
        return (
            ALIASED,
            f"the class holds {weight:.2f} of the stacking weight; {_listed(selection.rivals)} is "
            "as good",
        )
    is_wholly_explained = best_phi >= limits.wholly_explained
    if (
        not is_wholly_explained
        and 1.0 - reduction.negative_control_rho** 2
        > limits.negative_control_share * (1.0 - reduction.rho**2)
    ):
        return (
            NONE_OF_THESE,
            f"a negative control shrinks the gap to {reduction.negative_control_rho:.2f} too: the "
            "records allow no naming",
        )
    return None


def _nothing_found(search: ForwardSelection, selection: Selection, explainable: float) -> str:
    tried = [ranked for ranked in selection.ranking if ranked.effects]
    best = min(tried, key=lambda ranked: ranked.held_out_rms)
    before = np.sqrt(search.mean_square(()))
    return (
        f"the best set tried, {set_name(best.effects)}, leaves {best.held_out_rms / before:.2f} of "
        "the held-out gap and is "
        f"rejected ({best.refused}); a black-box reference could explain "
        f"{max(explainable, 0.0):.0%}"
    )


def _listed(sets: tuple[Effects, ...]) -> str:
    return ", ".join(set_name(effects) for effects in sets)
