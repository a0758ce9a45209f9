"""What few sensors cannot tell: the mean tilt from two, a saddle from a zero of one of four."""

import numpy as np
import pytest

from carrierflex.diagnosis.baseline_check import checked_baseline
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.inference.effect_fit import fit_effects
from carrierflex.diagnosis.inference.named_values import published_values
from carrierflex.identification.campaign.declarations import Channel
from tests.diagnosis.carrier.carrier_twin import twin_campaign, twin_problem


def axial(*angles_deg):
    """Axial sensors at the rim."""
    return tuple(
        Channel(f"s{v:03.0f}", "axial_displacement", "m", angle=np.deg2rad(v), radius=0.412)
        for v in angles_deg
    )


TWO, FOUR = axial(47, 137), axial(47, 137, 227, 317)
EIGHT = axial(2, 47, 92, 137, 182, 227, 272, 317)


@pytest.mark.parametrize(("channels", "is_known"), [(TWO, False), (FOUR, True)])
def test_two_sensors_do_not_tell_a_mean_tilt_from_an_offset(channels, is_known):
    problem = twin_problem(channels=channels, turns=4)
    published = published_values(problem, fit_effects(problem, ()), floor_ratio=1.1)
    values = published.parameters
    for effect in ("housing_tilt", "axial_offset"):
        assert all(np.isfinite(value.std) == is_known for value in values[effect].values())
    assert all(np.isfinite(value.std) for value in values["carrier_tilt"].values())
    assert ("phi_H is not determined by these records" in published.undetermined) != is_known


@pytest.mark.long
@pytest.mark.parametrize(
    ("channels", "verdict", "about"), [(FOUR, "aliased", []), (EIGHT, "named", ["s137"])]
)
def test_the_zero_of_one_of_four_sensors_is_a_saddle_and_any_sensors_zero(channels, verdict, about):
    campaign = twin_campaign("sensor_zero", channels=channels, turns=4)
    problem = twin_problem("sensor_zero", channels=channels, turns=4)
    diagnosis = diagnose(problem, campaign="few", kind="carrier")
    assert diagnosis.verdict == verdict
    assert diagnosis.attribution.effects == ("sensor_zero",)
    check = checked_baseline(problem, campaign, problem.wiring(campaign))
    zeros = [one.about for one in check.warnings if one.id == "wiring/channel_zero"]
    assert zeros == about
