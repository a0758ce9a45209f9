"""Load sharing of the shipped case and its variants beside what was measured of the family."""

import re
from dataclasses import fields
from pathlib import Path

import pytest

from carrierflex.reduction.pin_joints import carrier_with_pins
from carrierflex.simulation.stage.stage_body import ShaftData, beam_shaft, joined_to_shaft
from studies.tabulate_load_sharing import (
    EXTREME_MOMENT,
    FULL_TORQUE,
    MEASURED,
    SharingRow,
    changed_stages,
    loose_and_preloaded,
    sharing,
    sharing_figure,
    sharing_table,
)

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def body(flexible_reduction, pin_reduction):
    carrier = carrier_with_pins(flexible_reduction.model, pin_reduction.model, 1.7e7)
    return joined_to_shaft(carrier, beam_shaft(ShaftData(), carrier.pilots["shaft_face"]))


@pytest.fixture(scope="module")
def factor(body):
    """Row of a stage at full torque by name and moment."""
    loose, preloaded = loose_and_preloaded()
    stages = {stage.name: stage for stage in (loose, preloaded, *changed_stages(loose))}

    def row(name, moment=0.0):
        return sharing(body, stages[name], FULL_TORQUE, moment)

    return row


def test_one_case_within_its_sources_shares_the_load_as_measured(factor):
    still, down, up = (factor("with clearances", m) for m in (0.0, -EXTREME_MOMENT, EXTREME_MOMENT))
    # The case was chosen for the first; what follows are its predictions.
    assert still.share == pytest.approx(MEASURED.no_moment, abs=0.04)
    assert max(down.share, up.share) == pytest.approx(MEASURED.extreme_moment, abs=0.04)
    assert 1.2 < still.upwind < 1.5
    assert still.upwind > 1.05 * still.downwind
    tight = [factor("preloaded", m) for m in (0.0, -EXTREME_MOMENT, EXTREME_MOMENT)]
    assert max(row.share for row in tight) < MEASURED.preloaded
    assert tight[0].upwind < 0.95 * still.upwind


def test_a_floating_sun_shares_as_no_gearbox_of_the_family_did(factor):
    for name in ("quill 5e6 N/m, the default: the sun floats", "no friction: 0.3 mm of play"):
        rows = [factor(name, m) for m in (0.0, -EXTREME_MOMENT, EXTREME_MOMENT)]
        assert max(row.share for row in rows) < 1.03


def test_the_moment_reaches_the_planets_through_the_sun_as_the_closed_form_says(factor):
    # R_i = T / (3 a) + (2/3) F cos(...): sun and ring push the carrier with the same lateral force.
    row = factor("with clearances", -EXTREME_MOMENT)
    expected = 1.0 + 2.0 / 3.0 * 2.0 * row.sun / (FULL_TORQUE / (3.0 * 0.308))
    assert row.share == pytest.approx(expected, abs=0.02)
    # Friction bounds that force; without its bound the planets take more.
    assert factor("friction 0.1", -EXTREME_MOMENT).share > row.share + 0.04
    assert factor("friction 0.05, spline of 90 mm radius", -EXTREME_MOMENT).share < row.share - 0.01


def test_the_page_shows_what_the_stage_gives(factor):
    page = (Path(__file__).parents[2] / "docs" / "load_sharing.md").read_text(encoding="utf-8")
    for name in ("with clearances", "preloaded", "quill 1.3e8 N/m, 150 mm x 0.5 m"):
        (line,) = re.findall(rf"^\| {re.escape(name)} \| (.*) \|$", page, re.MULTILINE)
        shown = line.split(" | ")
        rows = [factor(name, m) for m in (0.0, -EXTREME_MOMENT, EXTREME_MOMENT)]
        # The page's elements are half as long.
        assert [float(value) for value in shown[:3]] == pytest.approx(
            [row.share for row in rows], abs=0.005
        )
        assert [float(value) for value in shown[4:6]] == pytest.approx(
            [rows[0].upwind, rows[0].downwind], abs=0.03
        )


def test_table_and_picture_show_every_stage_beside_the_measured():
    loose, preloaded = loose_and_preloaded()
    names = [loose.name, preloaded.name, *(stage.name for stage in changed_stages(loose))]
    numbers = [0.01 * i for i in range(len(fields(SharingRow)) - 3)]
    rows = [
        SharingRow(name, FULL_TORQUE, moment, *numbers)
        for name in names
        for moment in (0.0, -EXTREME_MOMENT, EXTREME_MOMENT)
    ]
    table = "\n".join(sharing_table(rows))
    assert all(f"| {name} |" in table for name in names)
    assert "1.16" in table
    labels = [text.get_text() for text in sharing_figure(rows).axes[2].get_yticklabels()]
    assert labels == [loose.name, *names[2:]]
