"""Diagnose the main job's load cases against a rigid, aligned carrier.

And what the papers' effects are worth.

Writes diagnosis.json and report.html. A good answer names the misalignment and the flexible pins
that the load cases hold.
"""

from dataclasses import dataclass
from pathlib import Path

from threadpoolctl import threadpool_limits

from carrierflex.diagnosis.inference.gap_reduction import EffectsInTurn, effects_in_turn
from carrierflex.diagnosis.kinds import problem_of
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.workflows.diagnosis import diagnose_campaign

#: Effects of the 2012 paper's models M1 and M2, in the order of its argument.
PAPER_EFFECTS = ("housing_tilt", "carrier_tilt", "flexible_pins", "stiff_pins")


@dataclass(frozen=True, eq=False)
class Gap:
    """Diagnosis of the load cases, and held-out RMS as the paper's effects are added."""

    diagnosis: Diagnosis
    in_turn: EffectsInTurn


def main(campaign: Path, *, out: Path) -> Gap:
    """Diagnose a campaign of kind "carrier" whose baseline holds none of the paper's effects.

    Parameters
    ----------
    campaign : Path
        Campaign folder.
    out : Path
        Folder for diagnosis.json and report.html.

    Returns
    -------
    Gap
        A good model leaves no cell above the noise; every effect must pay on held-out records.

    Raises
    ------
    ValueError
        Where the campaign is refused, or its baseline holds one of the paper's effects.
    OSError
        Where `out` cannot be written.
    """
    diagnosis = diagnose_campaign.main(campaign, out=out, quiet=True)
    measured = read_campaign(campaign)
    with threadpool_limits(limits=1):  # as in diagnose_campaign
        problem, _ = problem_of(measured, diagnose_campaign.campaign_curves(measured, campaign))
        return Gap(diagnosis, effects_in_turn(problem, PAPER_EFFECTS))
