"""The one door to the truth: write the campaign of a planned case and hand back its label."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from carrierflex.blind_check.labels import CasePlan, Label
from carrierflex.blind_check.truth.carrier.off_drawing import CURVES_FILE, write_drawn_curves
from carrierflex.blind_check.truth.carrier.truth import carrier_case
from carrierflex.blind_check.truth.element.truth import element_case
from carrierflex.blind_check.truth.mounting.truth import mounting_case
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import write_campaign

_MAKERS: dict[str, Callable[[CasePlan, int], tuple[Campaign, Label]]] = {
    "carrier": carrier_case,
    "element": element_case,
    "mounting": mounting_case,
}


def write_case(plan: CasePlan, folder: Path, *, repeat: int = 0) -> Label:
    """Write the campaign of one case.

    The label goes to the caller alone, no file of the folder holds any of it.

    Parameters
    ----------
    plan : CasePlan
        What to withhold. The same plan gives the same records and label.
    folder : Path
        Folder of the campaign; new, empty, or an earlier simulated campaign, which is replaced.
    repeat : int
        Repeats of a case hold the same truth under the same loads with other noise: records that no
        diagnosis has seen, on which what one has claimed can be measured.

    Returns
    -------
    Label
        The truth of the case, to be sealed.

    Raises
    ------
    ValueError
        Where the kind has no truth, or the folder holds something that is not a campaign.
    """
    campaign, label = case_campaign(plan, repeat=repeat)
    has_curves = "deflection_curves" in campaign.rig
    files = {CURVES_FILE: write_drawn_curves} if has_curves else None
    write_campaign(campaign, folder, simulated=True, more_files=files)
    return label


def case_campaign(plan: CasePlan, *, repeat: int = 0) -> tuple[Campaign, Label]:
    """Campaign and label of one case; the arguments are those of :func:`write_case`.

    Raises
    ------
    ValueError
        Where the kind has no truth.
    """
    if plan.kind not in _MAKERS:
        raise ValueError(f"kind is '{plan.kind}'; expected one of {', '.join(_MAKERS)}")
    campaign, label = _MAKERS[plan.kind](plan, repeat)
    if plan.declares_noise:
        return campaign, label
    channels = tuple(replace(channel, noise_std=None) for channel in campaign.channels)
    return replace(campaign, channels=channels), replace(label, declares_noise=False)
