"""A sensor of a mounting with its sign reversed, and faults beside a law that explains all."""

from dataclasses import replace

import pytest

from carrierflex.diagnosis.mounting.problem import mounting_problem
from carrierflex.diagnosis.mounting.wiring import mounting_rivals
from carrierflex.workflows.diagnosis.examination import examined
from tests.diagnosis.mounting.mounting_campaigns import CONDITIONS, NOISE, mounting_campaign

#: Stiffness and damping of the bushings and nothing else.
LINEAR = {}


def with_signs(campaign, signs):
    """Campaign whose channels have other signs."""
    runs = tuple(
        replace(run, signals={name: signs.get(name, 1.0) * y for name, y in run.signals.items()})
        for run in campaign.runs
    )
    return replace(campaign, runs=runs)


@pytest.mark.long
@pytest.mark.parametrize("names", [("ssz",), ("spy",), ()])
def test_a_reversed_channel_is_found_however_far_the_fit_runs_away(names):
    made = mounting_campaign(LINEAR, conditions=CONDITIONS[:2], seconds=60.0)
    turned = with_signs(made, dict.fromkeys(names, -1.0))
    rivals = mounting_rivals(mounting_problem(turned), turned)
    reversed_channels = [rival for rival in rivals if rival.id == "wiring/polarity"]
    assert [rival.about for rival in reversed_channels] == list(names)
    # With the sign put right nothing but noise is left.
    assert all(rival.mean_square < 1.1 * NOISE**2 for rival in reversed_channels)


@pytest.mark.long
def test_a_law_that_leaves_noise_leaves_no_channel_to_check():
    made = mounting_campaign({"starboard_excess": 0.2}, conditions=CONDITIONS[:2])
    diagnosis = examined(made).diagnosis()
    assert (diagnosis.verdict, diagnosis.attribution.effects) == ("named", ("unequal_bushings",))
    assert not [one.id for one in diagnosis.warnings if one.id.startswith("wiring/")]
