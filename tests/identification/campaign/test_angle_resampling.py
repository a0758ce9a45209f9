"""Equal angles whatever the sampling in time; gaps stay gaps."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.identification.campaign.angle_resampling import resampled_to_angle
from carrierflex.identification.carrier.carrier_identification import identify_jointly
from carrierflex.identification.carrier.models import flexible_model
from tests.identification.synthetic_campaigns import carrier_campaign, run_case
from tests.simulation.synthetic_curves import flexible_curve, stiff_curve

M2 = flexible_model(stiff_curve(), flexible_curve())


def test_records_of_different_sampling_and_speed_ripple_agree_at_equal_angles():
    slow, fast = (
        resampled_to_angle(
            carrier_campaign([run_case(sample_rate=rate)], noise_std=0.0).runs[0], 72
        )
        for rate in (40.0, 160.0)
    )
    step = np.diff(slow.inputs["carrier_angle"])
    assert_allclose(step, 2.0 * np.pi / 72, rtol=1e-12)
    assert slow.time.size == fast.time.size == 8 * 72
    for name in ("s047", "s317"):
        swing = np.ptp(fast.signals[name])
        assert_allclose(slow.signals[name], fast.signals[name], atol=1e-4 * swing)


def test_identification_gives_the_same_from_the_resampled_record():
    campaign = carrier_campaign([run_case(sample_rate=100.0)], noise_std=0.0)
    even = replace(campaign, runs=(resampled_to_angle(campaign.runs[0], 128),))
    assert_allclose(
        identify_jointly(even, M2).values, identify_jointly(campaign, M2).values, rtol=2e-5
    )


def test_gaps_stay_gaps_and_nothing_else_is_lost():
    run = carrier_campaign([run_case(sample_rate=50.0)], noise_std=0.0).runs[0]
    signal = run.signals["s137"].copy()
    signal[200:230] = np.nan
    complete = resampled_to_angle(run, 64)
    gappy = resampled_to_angle(replace(run, signals={**run.signals, "s137": signal}), 64)
    lost = np.isnan(gappy.signals["s137"])
    inside = (complete.time > run.time[199]) & (complete.time < run.time[230])
    assert (lost == inside).all()
    assert_allclose(gappy.signals["s137"][~lost], complete.signals["s137"][~lost], atol=1e-8)


def test_a_carrier_that_turns_backwards_is_resampled_as_well():
    run = carrier_campaign([run_case()], noise_std=0.0).runs[0]
    back = replace(run, inputs={**run.inputs, "carrier_angle": -run.inputs["carrier_angle"]})
    assert_allclose(
        np.diff(resampled_to_angle(back, 36).inputs["carrier_angle"]), -2.0 * np.pi / 36, rtol=1e-12
    )


def test_bad_records_are_refused():
    run = carrier_campaign([run_case()], noise_std=0.0).runs[0]
    still = run.inputs["carrier_angle"].copy()
    still[50] = still[49]
    with pytest.raises(ValueError, match=r"stops or turns back at 2\.5 s"):
        resampled_to_angle(replace(run, inputs={**run.inputs, "carrier_angle": still}), 64)
    with pytest.raises(ValueError, match=r"turns by 0.* revolutions; expected at least one"):
        resampled_to_angle(carrier_campaign([run_case(duration=2.0)]).runs[0], 64)
    with pytest.raises(ValueError, match="8 samples a revolution; expected at least 16"):
        resampled_to_angle(run, 8)
