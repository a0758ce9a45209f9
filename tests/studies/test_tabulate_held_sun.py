"""Campaigns whose sun is held: how an answer counts, and what such a sun leaves at the sensors."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.reduction.pin_joints import carrier_with_pins
from carrierflex.simulation.stage.stage_body import ShaftData, beam_shaft, joined_to_shaft
from studies.tabulate_held_sun import (
    BELOW,
    FLOOR,
    NONE,
    OTHER,
    RIGHT,
    RIGHT_AMONG_OTHERS,
    VISIBLE,
    HeldSun,
    drawn_data,
    held_sun_table,
    series,
)


@pytest.mark.parametrize(
    ("gap", "named", "ties", "outcome"),
    [
        (1.5, ("ntl_tilt",), (), BELOW),
        (5.0, ("clearance_rocking", "ntl_tilt"), (), RIGHT),
        (5.0, ("housing/tilt/torque+radial_load",), (), RIGHT),
        (5.0, ("housing/tilt/none",), (), OTHER),
        (5.0, ("ntl_tilt", "torque_tilt"), (), RIGHT_AMONG_OTHERS),
        (5.0, ("channel/gain/none",), ("housing/tilt/radial_load",), RIGHT_AMONG_OTHERS),
        (5.0, ("housing/saddle/radial_load",), (), OTHER),
        (5.0, (), (), NONE),
    ],
)
def test_a_tilt_by_the_radial_load_counts_as_right(gap, named, ties, outcome):
    assert HeldSun(gap, "named", named, ties).outcome == outcome


def test_the_table_counts_campaigns_of_two_floors_and_more():
    rows = [HeldSun(1.0, "at_noise_floor", (), ()), HeldSun(9.0, "named", ("ntl_tilt",), ())]
    lines = held_sun_table([*rows, HeldSun(4.0, "none_of_these", (), ())])
    assert lines[0] == "| 3 campaigns, gap of 1.0 to 9.0 floors | |"
    assert "| two floors and more | 2 |" in lines
    assert f"| {RIGHT} | 1 |" in lines
    assert f"| {NONE} | 1 |" in lines


@pytest.mark.long
def test_a_held_sun_leaves_a_static_tilt_where_bearings_have_clearance(
    flexible_reduction, pin_reduction
):
    carrier = carrier_with_pins(flexible_reduction.model, pin_reduction.model, 1e6)
    body = joined_to_shaft(carrier, beam_shaft(ShaftData(), carrier.pilots["shaft_face"]))
    supported, floating, pins = drawn_data(np.random.default_rng([1, 1]))
    assert supported.mounting == floating.mounting
    assert supported.bearings.upwind_clearance == floating.bearings.upwind_clearance > 0.0

    def gap(change):
        held_turns, floating_turns = (
            series(body, replace(data, bearings=replace(data.bearings, **change)), pins)
            for data in (supported, floating)
        )
        return held_turns - floating_turns

    loose = gap({})
    square = loose**2 * np.r_[1.0, np.full(loose.shape[2] - 1, 0.5)]
    assert np.sqrt(square.sum() / loose[:, :, 0].size) > VISIBLE * FLOOR
    assert square[:, :, 0].sum() > 0.9 * square.sum()
    # A tilt: sensors opposite each other read it with opposite signs.
    np.testing.assert_allclose(loose[:, :2, 0], -loose[:, 2:, 0], atol=2e-6)
    tight = gap({"upwind_clearance": 0.0, "downwind_clearance": 0.0})
    assert np.abs(tight).max() < 0.2 * np.abs(loose).max()
