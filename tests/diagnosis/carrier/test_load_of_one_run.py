"""A radial load that one run alone has: left out, that run is known to no law of the load."""

import pytest

from carrierflex.diagnosis.diagnose import diagnose
from tests.diagnosis.carrier.carrier_twin import CHANNELS, twin_problem

#: Torque over nominal, radial loads along y and z [N]: along y, across the others, or at all in the
#: third run alone.
ACROSS = ((1.0, 0, -1e5), (0.5, 0, -2e5), (1.0, 1.5e5, -1e5), (0.75, 0, 5e4), (0.25, 0, -5e4))
ALONE = ((1.0, 0, 0), (0.5, 0, 0), (1.0, 1.5e5, 0), (0.75, 0, 0), (0.25, 0, 0))


@pytest.mark.long
@pytest.mark.parametrize("loads", [ACROSS, ALONE])
def test_a_compliance_that_one_run_alone_shows_is_named(loads):
    problem = twin_problem("ntl_tilt", loads=loads, channels=CHANNELS[:4], turns=8)
    diagnosis = diagnose(problem, campaign="one run", kind="carrier")
    assert diagnosis.verdict == "named"
    assert diagnosis.attribution.effects == ("ntl_tilt",)
