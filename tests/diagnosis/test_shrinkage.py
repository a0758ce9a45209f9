from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from diagnosis.noise_floor import noise_floor
from diagnosis.shrinkage import NestedCostError, check_nested, shrinkage
from identification.carrier_identification import axial_channels
from identification.carrier_models import AXIAL_OFFSET, CARRIER_TILT, HOUSING_TILT, flexible_pins, stiff_pins
from tests.identification.synthetic_campaigns import TRUTH, carrier_campaign, run_case
from tests.simulation.synthetic_curves import flexible_curve, stiff_curve

LADDER = [HOUSING_TILT.each_run(), CARRIER_TILT, flexible_pins(flexible_curve()), stiff_pins(stiff_curve())]


def test_each_effect_takes_its_own_mean_square_and_the_noise_is_left():
    result = shrinkage(carrier_campaign([run_case()]), [AXIAL_OFFSET], LADDER)
    assert result.effects == ("housing_tilt", "carrier_tilt", "flexible_pins", "stiff_pins")
    taken = -np.diff(result.rms**2)
    assert_allclose(taken[0], (0.412 * TRUTH.phi_H) ** 2 / 2, rtol=0.02)
    assert_allclose(taken[1], (0.412 * TRUTH.phi_PLC) ** 2 / 2, rtol=0.02)
    assert_allclose(result.rms[-1], 5e-6, rtol=0.06)
    assert_allclose(result.rho, result.rms / result.rms[0])
    assert result.phi[0] == 0.0
    assert_allclose(result.phi[-1], 1.0, atol=1e-4)
    assert (np.diff(result.phi) > 0.0).all()


def test_an_effect_alone_takes_what_it_takes_in_turn():
    """Over whole revolutions the effects are orthogonal, but for the two curves."""
    result = shrinkage(carrier_campaign([run_case()]), [AXIAL_OFFSET], LADDER)
    alone = result.rms[0] ** 2 - result.rms_alone**2
    in_turn = -np.diff(result.rms**2)
    assert_allclose(alone[:2], in_turn[:2], rtol=0.03)
    assert result.rho_alone[1] < result.rho_alone[2] < 1.0


def test_an_effect_that_is_not_there_gains_nothing_on_held_out_revolutions():
    campaign = carrier_campaign([run_case(motion=replace(TRUTH, rho_s=0.0))])
    result = shrinkage(campaign, [AXIAL_OFFSET], LADDER)
    assert_allclose(result.rms[-1], result.rms[-2], rtol=0.01)
    assert_allclose(result.placebo_rho, 1.0, atol=0.005)


def test_what_happens_in_held_out_revolutions_alone_enters_the_score_and_not_the_fit():
    campaign = carrier_campaign([run_case()])
    run = campaign.runs[0]
    turns = (run.inputs["carrier_angle"] // (2.0 * np.pi)).astype(int)
    held_out = (turns // 2) % 2 == 1
    signals = {**run.signals, "s047": run.signals["s047"] + 1e-4 * held_out}
    result = shrinkage(replace(campaign, runs=(replace(run, signals=signals),)), [AXIAL_OFFSET], LADDER)
    assert_allclose(result.rms[-1] ** 2, 1e-4**2 / 4 + 5e-6**2, rtol=0.02)


def test_a_tilt_shared_by_runs_that_differ_leaves_more_than_one_of_each_run():
    campaign = carrier_campaign()
    own = shrinkage(campaign, [AXIAL_OFFSET], LADDER)
    shared = shrinkage(campaign, [AXIAL_OFFSET], [HOUSING_TILT, *LADDER[1:]])
    assert_allclose(own.rms[-1], 5e-6, rtol=0.06)
    # phi_H differs by 0.1 mrad: half of it is left in either run.
    assert_allclose(shared.rms[-1] ** 2, 5e-6**2 + (0.412 * 0.5e-4) ** 2 / 2, rtol=0.05)


def test_rms_by_run_adds_up_to_the_overall_rms():
    result = shrinkage(carrier_campaign(), [AXIAL_OFFSET], LADDER)
    assert result.rms_by_run.shape == (5, 2)
    # Both runs hold the same number of held-out samples within one.
    assert_allclose((result.rms_by_run**2).mean(axis=1), result.rms**2, rtol=0.01)


@pytest.mark.parametrize("declared", [True, False])
def test_noise_floor_is_the_sensors_noise_declared_or_measured(declared):
    campaign = carrier_campaign([run_case(duration=60.0, torque_ripple=0.0)], declared_noise=declared)
    found = noise_floor(campaign.runs[0], axial_channels(campaign))
    # 4400 samples about a mean revolution: a per cent, and the declared value exactly.
    assert_allclose(found, 5e-6, rtol=0.04 if not declared else 1e-12)


def test_a_rise_of_the_training_cost_is_an_error_with_its_numbers():
    check_nested("carrier_tilt", 1.0, 1.0 + 1e-12, scale=1.0)
    with pytest.raises(NestedCostError, match="adding 'carrier_tilt' raised the training cost") as caught:
        check_nested("carrier_tilt", 1.0, 1.001, scale=1.0)
    assert (caught.value.before, caught.value.after) == (1.0, 1.001)


def test_too_few_revolutions_to_hold_any_out_are_refused():
    with pytest.raises(ValueError, match="run LC1: 3 whole revolutions; expected at least 4, a block of 2 to fit"):
        shrinkage(carrier_campaign([run_case(duration=9.0)]), [AXIAL_OFFSET], LADDER)


def test_sequence_of_runs_does_not_matter():
    campaign = carrier_campaign()
    turned = replace(campaign, runs=campaign.runs[::-1])
    first = shrinkage(campaign, [AXIAL_OFFSET], LADDER)
    second = shrinkage(turned, [AXIAL_OFFSET], LADDER)
    assert_allclose(second.rms, first.rms, rtol=1e-9)
    assert_allclose(second.rms_by_run[:, ::-1], first.rms_by_run, rtol=1e-9)
