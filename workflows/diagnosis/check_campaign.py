"""Tell what does not look right in a campaign before anything is concluded from it.

Units, signs, order and clock of the wiring, single samples, and what campaign.toml states beside
what the records show. A good answer: no finding. Each finding has its figure, its place and what to
do about it.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning
from carrierflex.identification.campaign_check.probe_angles import ProbeAngle
from carrierflex.identification.estimation.single_thread import single_threaded
from carrierflex.workflows.diagnosis.diagnose_campaign import (
    campaign_curves,
    with_stage_baseline,
)
from carrierflex.workflows.executors import work_executor
from carrierflex.workflows.progress import Stages


@dataclass(frozen=True, eq=False)
class CampaignCheck:
    """Findings about a campaign; `met` tells whether there are none."""

    campaign: str
    kind: str
    warnings: tuple[CampaignWarning, ...]
    probes: Annotated[
        tuple[ProbeAngle, ...], "Where the probes of a carrier stand, as declared and as read"
    ] = ()

    @property
    def met(self) -> bool:
        """Whether nothing stands out."""
        return not self.warnings


def main(campaign: Path, *, quiet: bool = False) -> CampaignCheck:
    """Check a measurement campaign; the exit code is 0 without a finding, 1 with one.

    Parameters
    ----------
    campaign : Path
        Campaign folder.
    quiet : bool
        Show no progress.

    Returns
    -------
    CampaignCheck
        Findings, each with its figure, place and remedy.

    Raises
    ------
    ValueError
        Where the campaign is refused.
    """
    stages = Stages(3, quiet)
    with single_threaded(), work_executor() as executor:
        with stages.stage(f"reading {campaign}"):
            measured = read_campaign(campaign)
            curves = campaign_curves(measured, campaign)
            measured = with_stage_baseline(measured, campaign, executor, stages)

        from carrierflex.workflows.diagnosis.examination import examined

        with stages.stage("records"):
            examination = examined(measured, curves)
        with stages.stage("baseline and wiring"):
            warnings = examination.findings()
    return CampaignCheck(measured.name, measured.kind, warnings, examination.probes)
