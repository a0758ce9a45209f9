from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.carrier.problem import carrier_problem
from carrierflex.workflows.main_job.job import effects_in_turn
from tests.diagnosis.carrier.carrier_twin import CURVES, KNOWN, NOISE, twin_campaign, twin_problem

pytestmark = pytest.mark.long

PAPER_ORDER = ("housing_tilt", "carrier_tilt", "flexible_pins", "stiff_pins")


@pytest.fixture(scope="module")
def in_turn():
    return effects_in_turn(twin_problem(contained=("axial_offset",)), PAPER_ORDER)


def test_each_effect_takes_its_own_mean_square_and_the_noise_is_left(in_turn):
    taken = -np.diff(in_turn.rms**2)
    # Over a revolution a tilt is R phi / sqrt(2) on the four axial of six channels.
    assert_allclose(
        taken[0], (0.412 * np.hypot(*KNOWN["housing_tilt"])) ** 2 / 2 * 4 / 6, rtol=0.02
    )
    assert_allclose(
        taken[1], (0.412 * np.hypot(*KNOWN["carrier_tilt"])) ** 2 / 2 * 4 / 6, rtol=0.02
    )
    assert_allclose(in_turn.rms[-1], NOISE, rtol=0.01)
    assert_allclose(in_turn.noise_floor, NOISE, rtol=1e-9)
    assert in_turn.phi[0] == 0.0
    assert_allclose(in_turn.phi[-1], 1.0, atol=1e-4)
    assert_allclose(in_turn.rho, in_turn.rms / in_turn.rms[0], rtol=1e-12)


def test_an_effect_alone_takes_what_it_takes_in_turn(in_turn):
    """Over whole revolutions the tilts and the deflection are orthogonal."""
    assert_allclose(
        in_turn.rms[0] ** 2 - in_turn.rms_alone[:3] ** 2, -np.diff(in_turn.rms**2)[:3], rtol=0.03
    )


def test_an_effect_that_is_not_there_gains_nothing(in_turn):
    assert_allclose(in_turn.rms[4], in_turn.rms[3], rtol=0.005)


def test_what_happens_in_one_condition_alone_is_predicted_from_no_other():
    campaign = twin_campaign(contained=tuple(KNOWN), turns=8)
    run = campaign.runs[2]
    signals = {
        c.name: run.signals[c.name] + 1e-4 * np.sin(3.0 * (run.inputs["carrier_angle"] - c.angle))
        for c in campaign.channels
    }
    changed = replace(
        campaign, runs=(*campaign.runs[:2], replace(run, signals=signals), *campaign.runs[3:])
    )
    result = effects_in_turn(carrier_problem(changed, CURVES), ("face_runout",))
    assert result.rms[1] > 0.95 * result.rms[0]


def test_effects_that_are_no_candidates_are_refused():
    with pytest.raises(
        ValueError,
        match="effects carrier_tilt, rust; expected candidates of the problem: torque_tilt, ",
    ):
        effects_in_turn(twin_problem(turns=4), ("carrier_tilt", "rust"))
