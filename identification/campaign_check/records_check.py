"""All findings that the records of a campaign give by themselves."""

from collections.abc import Mapping

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning, merged
from carrierflex.identification.campaign_check.clock_shift import clock_shift_findings
from carrierflex.identification.campaign_check.copies import copied_runs, copy_findings
from carrierflex.identification.campaign_check.rig_facts import Curves, rig_findings
from carrierflex.identification.campaign_check.sample_faults import sample_faults
from carrierflex.identification.campaign_check.sampling import sampling_findings
from carrierflex.identification.campaign_check.tones import tone_findings
from carrierflex.identification.campaign_check.units import unit_findings


def records_findings(
    campaign: Campaign,
    curves: Curves | None = None,
    copies: Mapping[str, str] | None = None,
) -> tuple[CampaignWarning, ...]:
    """Findings about a campaign that need no simulation.

    Parameters
    ----------
    campaign : Campaign
        Records and declarations.
    curves : mapping of str to DeflectionCurve, optional
        Deflection curves of a carrier.
    copies : mapping of str to str, optional
        Runs that are copies, where :func:`copied_runs` told them already.

    Returns
    -------
    tuple of CampaignWarning
        What the rig declares first, then units, sampling and single samples; empty where nothing
        stands out.
    """
    return merged(
        [
            *unit_findings(campaign),
            *rig_findings(campaign, curves),
            *clock_shift_findings(campaign),
            *copy_findings(campaign, copied_runs(campaign) if copies is None else copies),
            *sampling_findings(campaign),
            *sample_faults(campaign),
            *tone_findings(campaign),
        ]
    )
