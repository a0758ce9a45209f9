"""Sensors to rigid-body motion and back; what too few sensors cannot tell is said."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.identification.mounting.housing_motion import housing_motion
from carrierflex.simulation.mounting.rig import HOUSING_MOTION, SENSORS, MountingRig

RIG = MountingRig()
RNG = np.random.default_rng(4)
MOTION = RNG.standard_normal((50, 6)) * [1e-3, 1e-3, 2e-3, 5e-3, 1e-3, 1e-3]


def _signals(motion=MOTION, names=SENSORS):
    readings = motion @ RIG.sensor_matrix.T
    return {name: readings[:, SENSORS.index(name)].copy() for name in names}


def test_six_sensors_give_the_six_coordinates_back():
    result = housing_motion(RIG, _signals())
    assert result.coordinates == HOUSING_MOTION
    assert_allclose(result.motion, MOTION, rtol=0.0, atol=1e-15)
    assert_allclose(result.residual, 0.0, atol=1e-16)
    assert (result.incomplete_samples, result.lost_samples) == (0, 0)
    assert 2.0 < result.condition_number < 4.5


def test_a_vertical_motion_and_a_roll_are_read_as_the_figure_shows():
    """Figure 5: ssz and spz agree in a vertical motion and differ in a roll."""
    roll = housing_motion(
        RIG, {**_signals(np.zeros((1, 6))), "ssz": np.array([7.5e-4]), "spz": np.array([-7.5e-4])}
    )
    assert_allclose(roll.motion[0], [0, 0, 0, 1e-3, 0, 0], atol=1e-18)


@pytest.mark.parametrize("missing", SENSORS)
def test_five_sensors_are_not_enough_for_six_coordinates(missing):
    names = tuple(name for name in SENSORS if name != missing)
    with pytest.raises(
        ValueError, match=r"5 sensors .* see 5 of 6 coordinates; the motion .* stays unseen"
    ):
        housing_motion(RIG, _signals(names=names))


def test_without_axial_motion_five_sensors_are_enough_and_six_are_averaged():
    known = MOTION * [0, 1, 1, 1, 1, 1]
    five = tuple(name for name in SENSORS if name != "sbx")
    result = housing_motion(RIG, _signals(known, five), coordinates=HOUSING_MOTION[1:])
    assert_allclose(result.motion, known[:, 1:], atol=1e-15)
    noisy = _signals(known)
    noisy["sbx"] += 1e-5
    averaged = housing_motion(RIG, noisy, coordinates=HOUSING_MOTION[1:])
    assert np.abs(averaged.residual).max() > 1e-6
    T = RIG.sensor_matrix[:, 1:]
    assert_allclose(
        averaged.residual @ T, 0.0, atol=1e-17
    )  # least squares leaves nothing along the columns


def test_gaps_are_bridged_where_the_other_sensors_suffice_and_counted_where_not():
    signals = _signals(MOTION * [0, 1, 1, 1, 1, 1])
    signals["ssx"][3] = np.nan
    signals["spy"][7] = np.nan
    result = housing_motion(RIG, signals, coordinates=HOUSING_MOTION[1:])
    assert (result.incomplete_samples, result.lost_samples) == (1, 1)
    assert_allclose(result.motion[3], MOTION[3, 1:], atol=1e-15)
    assert np.isnan(result.motion[7]).all()


def test_unknown_names_are_refused():
    with pytest.raises(ValueError, match="unknown sensor 'ssy'; expected one of ssx"):
        housing_motion(RIG, {"ssy": np.zeros(1)})
    with pytest.raises(ValueError, match="unknown coordinate 'd_w'"):
        housing_motion(RIG, _signals(), coordinates=("d_w",))
