"""``cf.planned_campaign``: which causes a campaign can detect and separate, and what to add."""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

from carrierflex.diagnosis.inference.planning.results import (
    CampaignPlan,
    CausePair,
    first_sentences,
    plan_figure,
)
from carrierflex.workflows.diagnosis import plan_campaign
from carrierflex.workflows.in_python.notebook import shown_in_notebook

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame


@dataclass(frozen=True, eq=False, repr=False)
class Planned:
    """A plan of a campaign.

    Parameters
    ----------
    result : CampaignPlan
        Smallest sizes, pairs, additions.
    """

    result: CampaignPlan

    @property
    def proposal(self) -> str:
        """First proposal in words; empty where nothing is to be parted."""
        ranked = self.result.proposal
        return "" if ranked is None else ranked.addition.text

    def to_dataframe(self) -> "DataFrame":
        """Every cause with every rival: angle [deg], what is left [floors], state."""
        import pandas as pd

        names = [field.name for field in fields(CausePair)]
        return pd.DataFrame([vars(pair) for pair in self.result.pairs], columns=names)

    def plot(self) -> "Figure":
        """Smallest sizes as bars, angles between causes as a map."""
        return plan_figure(self.result)

    def __repr__(self) -> str:
        """How many pairs are alike, and the first proposal."""
        plan = self.result
        first = f"; first proposal: {self.proposal}" if self.proposal else ""
        return f"Planned({plan.campaign}: {len(plan.alike)} pairs pass for another{first})"

    def _repr_html_(self) -> str:
        rows = [("summary", first_sentences(self.result))]
        return shown_in_notebook(f"Plan of {self.result.campaign}", rows, self.plot())


def planned_campaign(
    case: Path | str = "carrier_lc1_to_lc4",
    *,
    gap: float | None = None,
    baseline: list[str] | None = None,
) -> Planned:
    """Causes that a campaign can detect and separate, and the cheapest addition for more.

    Parameters
    ----------
    case : path or str
        Case file (TOML) of kind carrier or mounting, the name of a bundled case, or a
        campaign folder.
    gap : float, optional
        Gap over the noise at which causes are to be distinguished; default: 6, or that of the case.
    baseline : list of str, optional
        Effects that the baseline contains, in place of those of the campaign.

    Returns
    -------
    Planned
        What ``carrierflex plan`` would write.

    Raises
    ------
    ValueError
        Where the case or campaign is refused.
    """
    return Planned(plan_campaign.main(Path(case), gap=gap, baseline=baseline, quiet=True))
