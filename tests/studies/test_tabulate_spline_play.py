"""Play of the sun's spline: load sharing and sensors as the page has them; backlash by rolling."""

import re
from pathlib import Path

import numpy as np
import pytest

from carrierflex.reduction.pin_joints import carrier_with_pins
from carrierflex.simulation.stage.stage_body import ShaftData, beam_shaft, joined_to_shaft
from carrierflex.simulation.stage.stage_data import StageData
from studies.tabulate_spline_play import BACKLASHES, backlash_table, spline_rows

PAGE = Path(__file__).parents[2] / "docs" / "stage_model.md"


@pytest.mark.long
def test_the_page_shows_what_the_spline_moves(flexible_reduction, pin_reduction):
    carrier = carrier_with_pins(flexible_reduction.model, pin_reduction.model, 1.7e7)
    body = joined_to_shaft(carrier, beam_shaft(ShaftData(), carrier.pilots["shaft_face"]))
    page = PAGE.read_text(encoding="utf-8")
    rows = {row.spline: row for row in spline_rows(body)}
    for name, row in rows.items():
        (line,) = re.findall(rf"^\| {re.escape(name)} \| (.*) \|$", page, re.MULTILINE)
        shown = [float(cell) for cell in line.split(" | ")]
        # The page's elements are half as long.
        assert row.factors == pytest.approx(shown[:3], abs=0.01)
        moved = 1e6 * np.array([row.static, row.order_1, row.order_3])
        assert moved == pytest.approx(shown[3:], rel=0.15, abs=1.5)
    # A sun that sticks does not know its clearance; one that slides freely does.
    for clearance in ("0.1", "0.3"):
        assert rows[f"clearance {clearance} mm, friction 0.15"].static < 2e-6
    floating = [rows[f"clearance {c} mm, friction 0"].static for c in ("0.1", "0.3")]
    assert 1.2 * floating[0] < floating[1]


def test_a_backlash_turns_the_carrier_by_its_share_of_the_suns_turn():
    data = StageData()
    table = backlash_table(data)
    assert "\n".join(table) in PAGE.read_text(encoding="utf-8")
    for line, backlash in zip(table[2:], BACKLASHES, strict=True):
        _, sun, carrier, generator = map(float, line.strip("| ").split(" | "))
        # Willis: the ring stands, so that the sun turns 1 + 99/21 times as far as the carrier.
        assert sun == pytest.approx(1e3 * backlash / 0.07, rel=5e-3)
        assert carrier == pytest.approx(sun / (1.0 + 99.0 / 21.0), rel=1e-2)
        assert generator == pytest.approx(81.49 * carrier, rel=1e-2)
