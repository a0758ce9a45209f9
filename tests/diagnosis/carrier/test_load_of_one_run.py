"""A radial load that one run alone has: left out, that run is known to no law of the load."""

import pytest

from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.workflows.diagnosis.examination import examined
from tests.diagnosis.carrier.carrier_twin import CHANNELS, CURVES, twin_campaign, twin_problem

#: Torque over nominal, radial loads along y and z [N]: along y, across the others, or at all in the
#: third run alone.
ACROSS = ((1.0, 0, -1e5), (0.5, 0, -2e5), (1.0, 1.5e5, -1e5), (0.75, 0, 5e4), (0.25, 0, -5e4))
ALONE = ((1.0, 0, 0), (0.5, 0, 0), (1.0, 1.5e5, 0), (0.75, 0, 0), (0.25, 0, 0))


@pytest.mark.long
@pytest.mark.parametrize("loads", [ACROSS, ALONE])
def test_a_compliance_that_one_run_alone_shows_is_the_law(loads):
    problem = twin_problem("ntl_tilt", loads=loads, channels=CHANNELS[:4], turns=8)
    diagnosis = diagnose(problem, campaign="one run", kind="carrier")
    assert diagnosis.verdict == "named"
    assert diagnosis.attribution.effects == ("ntl_tilt",)


@pytest.mark.long
def test_a_law_of_the_only_run_with_a_load_ties_with_that_run():
    """The housing may have settled in that run: nothing tells the load from it."""
    campaign = twin_campaign("ntl_tilt", loads=ALONE, channels=CHANNELS[:4], turns=8)
    diagnosis = examined(campaign, CURVES).diagnosis()
    assert (diagnosis.verdict, diagnosis.reason_id) == ("aliased", "wiring/run_of_load")
    assert diagnosis.attribution.effects == ("ntl_tilt",)
    assert "run3 left out, which alone has ntl_y" in diagnosis.reason
    assert [one.about for one in diagnosis.warnings] == ["run3"]
