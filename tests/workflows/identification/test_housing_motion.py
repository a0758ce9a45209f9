"""Sensors to rigid-body motion and back; what too few sensors cannot tell is said."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.simulation.mounting.rig import SENSORS, MountingRig
from carrierflex.workflows.identification.identify_bushings import measured_motion
from tests.identification.mounting.mounting_campaigns import LINEAR_TRUTH, mounting_campaign

RIG = MountingRig()
CAMPAIGN = mounting_campaign(LINEAR_TRUTH, duration=5.0, rate=10.0)
MOTION = np.random.default_rng(4).standard_normal((50, 6)) * [1e-3, 1e-3, 2e-3, 5e-3, 1e-3, 1e-3]


def _campaign(motion=MOTION, names=SENSORS):
    readings = motion @ RIG.sensor_matrix.T
    channels = [c for c in CAMPAIGN.channels if c.sensor in names]
    signals = {c.name: readings[:, SENSORS.index(c.sensor)].copy() for c in channels}
    runs = tuple(replace(run, signals=signals) for run in CAMPAIGN.runs)
    return replace(CAMPAIGN, channels=tuple(channels), runs=runs)


def test_six_sensors_give_the_six_coordinates_back():
    assert_allclose(measured_motion(_campaign())["R0"], MOTION, rtol=0.0, atol=1e-15)


def test_a_vertical_motion_and_a_roll_are_read_as_the_figure_shows():
    """Figure 5: ssz and spz agree in a vertical motion and differ in a roll."""
    readings = np.zeros((1, 6))
    readings[0, [SENSORS.index("ssz"), SENSORS.index("spz")]] = 7.5e-4, -7.5e-4
    assert_allclose(RIG.housing_motion(readings)[0], [0, 0, 0, 1e-3, 0, 0], atol=1e-18)


@pytest.mark.parametrize("missing", SENSORS)
def test_five_sensors_are_not_enough_for_six_coordinates(missing):
    names = tuple(name for name in SENSORS if name != missing)
    with pytest.raises(
        ValueError, match=r"5 sensors .* see 5 of 6 coordinates; the motion .* stays unseen"
    ):
        measured_motion(_campaign(names=names))


def test_a_sample_without_one_sensor_has_no_motion():
    campaign = _campaign()
    name = next(c.name for c in campaign.channels if c.sensor == "spy")
    campaign.runs[0].signals[name][7] = np.nan
    motion = measured_motion(campaign)["R0"]
    assert np.isnan(motion[7]).all()
    assert_allclose(np.delete(motion, 7, axis=0), np.delete(MOTION, 7, axis=0), atol=1e-15)
