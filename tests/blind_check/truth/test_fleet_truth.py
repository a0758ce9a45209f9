"""The truth of a simulated fleet: sizes over the days, faults, one state a turbine."""

from collections import Counter

import numpy as np
import pytest

from carrierflex.blind_check.labels import NOTHING
from carrierflex.blind_check.truth.fleet import (
    DEAD_SENSOR,
    EXCHANGED_CABLE,
    fleet_plans,
    write_fleet_case,
)
from carrierflex.identification.campaign.campaign_files import read_campaign


def of_fate(fate, n_days=4):
    """Days of the first turbine with a fate."""
    plans = [plan for plan in fleet_plans(20, n_days, 1) if plan.fate == fate]
    return plans[:n_days]


def test_causes_grow_as_their_fate_says_and_sizes_fill_their_range():
    for fate, shares in (
        ("misalignment", (0.25, 0.5, 0.75, 1.0)),
        ("wear", (0.0625, 0.25, 0.5625, 1.0)),
        ("bushing", (0.0, 0.0, 1.0, 1.0)),
    ):
        plans = of_fate(fate)
        np.testing.assert_allclose([plan.ratio / plan.last_ratio for plan in plans], shares)
        assert all(bool(plan.effects) == (plan.ratio > 0.0) for plan in plans)
    sizes = [plan.last_ratio for plan in fleet_plans(1000, 1, 2) if plan.effects]
    assert Counter(plan.fate for plan in fleet_plans(1000, 1, 2))[NOTHING] == 200
    # Half of a size uniform in its logarithm lies below the root of 0.5 times 10; 700: within 4 %.
    assert abs(np.mean(np.array(sizes) < np.sqrt(5.0)) - 0.5) < 0.06
    assert 0.5 <= min(sizes) < max(sizes) <= 10.0


def test_a_plan_and_its_name_say_nothing_of_the_fate():
    assert {plan.name for plan in fleet_plans(3, 2, 1)} == {
        f"T00{turbine}/day0{day}" for turbine in (1, 2, 3) for day in (1, 2)
    }


@pytest.mark.parametrize("fate", [DEAD_SENSOR, EXCHANGED_CABLE])
def test_a_fault_comes_in_the_middle_and_only_its_sensors_change(fate, tmp_path):
    plans = of_fate(fate)
    labels = [write_fleet_case(plan, tmp_path / str(plan.day)) for plan in plans]
    assert [label.family for label in labels] == [NOTHING, NOTHING, fate, fate]
    before, after = (read_campaign(tmp_path / str(day)) for day in (2, 3))
    assert (after.turbine, after.recorded.isoformat()) == (plans[2].turbine, "2026-03-16")
    channel = labels[2].where["channel_pattern"]
    first, last = (campaign.runs[0].signals for campaign in (before, after))
    moved = {name for name in first if np.sqrt(np.mean((last[name] - first[name]) ** 2)) > 5e-5}
    if fate == DEAD_SENSOR:
        assert np.ptp(last[channel]) == 0.0
    else:
        assert len(moved) == 2
        assert channel in moved
    # The same state and the same loads on both days: all other signals differ by their noise.
    others = [name for name in first if name not in {*moved, channel}]
    noise = before.channels[0].noise_std
    for name in others:
        difference = np.std(last[name] - first[name])
        np.testing.assert_allclose(difference, np.sqrt(2.0) * noise, rtol=0.2)
