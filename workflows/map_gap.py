"""Map where a rigid, aligned carrier fails to explain the rim sensors, and what each known effect is worth."""

from dataclasses import dataclass
from pathlib import Path

from diagnosis.gap_files import write_gap_csv, write_gap_json
from diagnosis.gap_map import GapMap, gap_map
from diagnosis.gap_words import where_text
from diagnosis.shrinkage import RevolutionLadder, shrinkage
from diagnosis.view import gap_map_figure, ladder_figure
from fe.deflection_curves import DeflectionCurve
from identification.campaign import Campaign
from identification.carrier_models import (
    AXIAL_OFFSET,
    CARRIER_TILT,
    HOUSING_TILT,
    CarrierModel,
    flexible_model,
    flexible_pins,
    stiff_pins,
)
from workflows.outputs import prepared_folder, save_figure


@dataclass(frozen=True, eq=False)
class Gap:
    """Gap of the baseline, gap that M2 leaves, the ladder between them, and the baseline's gap in one sentence."""

    before: GapMap
    after: GapMap
    ladder: RevolutionLadder
    where: str


def main(campaign: Campaign, delta_s: DeflectionCurve, delta_f: DeflectionCurve, *, out: Path) -> Gap:
    """Map the gap of a baseline without misalignment and without flexibility, and add the four effects in turn.

    Writes gap_map.json, gap_map.csv, gap_map.png and ladder.png.

    Parameters
    ----------
    campaign
        Campaign of kind "carrier".
    delta_s, delta_f
        Deflection curves.
    out
        Output folder.

    Returns
    -------
    Gap
        A good model leaves no cell above the noise; every effect must pay on held-out revolutions.
    """
    prepared_folder(out)
    baseline = CarrierModel("axial offset", (AXIAL_OFFSET,))
    before = gap_map(campaign, baseline)
    after = gap_map(campaign, flexible_model(delta_s, delta_f))
    effects = (HOUSING_TILT.each_run(), CARRIER_TILT, flexible_pins(delta_f), stiff_pins(delta_s))
    ladder = shrinkage(campaign, baseline.effects, effects)
    write_gap_json(out / "gap_map.json", before)
    write_gap_csv(out / "gap_map.csv", before)
    save_figure(out / "gap_map.png", gap_map_figure(before, after))
    save_figure(out / "ladder.png", ladder_figure(ladder))
    return Gap(before, after, ladder, where_text(before))
