"""Rigid motion that radial probes alone see is no tilt."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.report.verdict_words import headlines
from tests.diagnosis.carrier.carrier_twin import CHANNELS, twin_problem

#: Two radial probes, and four.
TWO = CHANNELS
FOUR = (*CHANNELS, *(replace(one, name=f"r{k}", angle=k) for k, one in enumerate(CHANNELS[4:])))
SIZE, DIRECTION = 7e-5, 1.0


def shift(channel, angle):
    """Towards an angle of the housing, d_z along its zero and d_y a quarter turn before."""
    return SIZE * np.cos(DIRECTION - channel.angle) + 0.0 * angle


def eccentricity(channel, angle):
    """Towards an angle that turns with the carrier."""
    return SIZE * np.cos(DIRECTION + angle - channel.angle)


def diagnosed(motion, channels):
    """Diagnosis of a motion that radial probes alone see."""

    def at_radial(channel, angle):
        return motion(channel, angle) * (channel.quantity == "radial_displacement")

    problem = twin_problem(extra=at_radial, channels=channels, turns=8)
    return diagnose(problem, campaign="radial", kind="carrier")


@pytest.mark.parametrize(
    ("motion", "law", "values"),
    [
        (
            shift,
            "radial_offset",
            {"d_y": -SIZE * np.sin(DIRECTION), "d_z": SIZE * np.cos(DIRECTION)},
        ),
        (eccentricity, "eccentricity", {"e_PLC": SIZE, "theta_e": DIRECTION}),
    ],
)
@pytest.mark.long
def test_radial_motion_is_named_with_its_size(motion, law, values):
    diagnosis = diagnosed(motion, FOUR)
    assert diagnosis.verdict == "named"
    assert diagnosis.attribution.effects == (law,)
    fitted = diagnosis.attribution.parameters[law]
    for name, value in values.items():
        assert fitted[name].value == pytest.approx(value, abs=5.0 * fitted[name].std)


@pytest.mark.long
def test_a_shift_at_two_radial_probes_may_be_their_zeros_and_is_no_tilt():
    diagnosis = diagnosed(shift, TWO)
    assert diagnosis.verdict == "aliased"
    second = headlines(diagnosis)[1]
    assert "one of radial offset; zero of a sensor" in second
    assert "tilt" not in second
