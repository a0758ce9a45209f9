"""Beyond plain least squares on axial sensors.

Radial sensors, free pin angle, outliers, bootstrap.
"""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import lfilter

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.carrier.carrier_identification import (
    FitOptions,
    axial_channels,
    identify_each_run,
    identify_jointly,
    residual_signal,
)
from carrierflex.identification.carrier.models import (
    flexible_model,
    rigid_model,
    with_radial_motion,
)
from carrierflex.identification.carrier.pin_angle import identify_with_pin_angle
from carrierflex.identification.carrier.robust_loss import flagged_outliers
from carrierflex.simulation.carrier.effect import Effect
from carrierflex.simulation.carrier.run_cases import RADIAL, Sensor
from carrierflex.simulation.effect_parameters import EffectParameter
from tests.identification.synthetic_campaigns import SENSORS, TRUTH, carrier_campaign, run_case
from tests.simulation.synthetic_curves import flexible_curve, stiff_curve

CURVES = stiff_curve(), flexible_curve()
M2 = flexible_model(*CURVES)
RIGID = replace(TRUTH, rho_s=0.0, rho_f=0.0)
RADIALS = tuple(
    Sensor(f"r{angle:03d}", RADIAL, float(np.deg2rad(angle)), 0.412) for angle in (40, 310)
)


def _changed(campaign: Campaign, change) -> Campaign:
    """Campaign whose signals went through ``change(run, channel, signal)``."""
    runs = [
        replace(
            run,
            signals={c.name: change(run, c, run.signals[c.name].copy()) for c in campaign.channels},
        )
        for run in campaign.runs
    ]
    return replace(campaign, runs=tuple(runs))


def _turned(campaign: Campaign, pin_angle: float) -> Campaign:
    """Campaign whose carrier angle is counted from elsewhere.

    Pin 1 stands at `pin_angle` in the carrier frame.
    """
    runs = [
        replace(
            run, inputs={**run.inputs, "carrier_angle": run.inputs["carrier_angle"] - pin_angle}
        )
        for run in campaign.runs
    ]
    return replace(campaign, runs=tuple(runs))


def test_radial_sensors_find_the_scales_alone_and_with_the_axial_ones():
    campaign = carrier_campaign(sensors=(*SENSORS, *RADIALS), noise_std=1e-6)
    model = with_radial_motion(M2)

    def moved(run, channel, signal):
        turning = np.cos(run.inputs["carrier_angle"] + 0.4 - channel.angle)
        return signal + (channel.quantity == RADIAL) * (
            2e-5 * np.cos(channel.angle) + 1e-5 * turning
        )

    shifted = _changed(campaign, moved)
    both = identify_jointly(shifted, model, FitOptions(radial=True))
    k = {
        name: both.index(name, "LC1")
        for name in ("d_y", "d_z", "e_PLC", "theta_e", "rho_s", "rho_f", "phi_PLC")
    }
    truth = {
        "d_y": 0.0,
        "d_z": 2e-5,
        "e_PLC": 1e-5,
        "theta_e": 0.4,
        "rho_s": 0.26,
        "rho_f": 0.61,
        "phi_PLC": 5.8e-4,
    }
    for name, index in k.items():
        assert abs(both.values[index] - truth[name]) < 4.0 * both.std[index], name
    assert set(both.rms_by_channel["LC1"]) == {"s047", "s137", "s227", "s317", "r040", "r310"}
    axial = identify_jointly(campaign, M2)
    assert both.std[k["rho_f"]] < axial.std[axial.index("rho_f", "LC1")]


def test_radial_signals_leave_an_axial_fit_alone():
    with_radials = carrier_campaign(sensors=(*SENSORS, *RADIALS), noise_std=0.0)
    assert_allclose(
        identify_jointly(with_radials, M2).values,
        identify_jointly(carrier_campaign(noise_std=0.0), M2).values,
        rtol=1e-12,
    )


@pytest.mark.parametrize("pin_angle", [0.0, 0.35, -0.9])
def test_pin_angle_is_found(pin_angle):
    campaign = _turned(carrier_campaign(noise_std=0.0), pin_angle)
    result = identify_with_pin_angle(campaign, *CURVES, FitOptions())["LC1"][1]
    # The other angles of the carrier frame turn with it.
    expected = {
        "theta_rho": pin_angle,
        "rho_s": 0.26,
        "rho_f": 0.61,
        "theta_PLC": TRUTH.theta_PLC + pin_angle,
    }
    for name, value in expected.items():
        assert_allclose(result.values[result.index(name, "LC1")], value, atol=1e-6, err_msg=name)


@pytest.mark.long
def test_intervals_of_a_free_pin_angle_cover_the_truth():
    inside = []
    for seed in range(60):
        campaign = _turned(carrier_campaign([run_case(sample_rate=12.0)], seed=seed), 0.2)
        result = identify_with_pin_angle(campaign, *CURVES, FitOptions(), per_run=True)["LC1"][1]
        truth = {"theta_rho": 0.2, "rho_s": 0.26, "rho_f": 0.61}
        k = [result.index(name, "LC1") for name in truth]
        inside.append(
            [
                result.ci95[i, 0] < value < result.ci95[i, 1]
                for i, value in zip(k, truth.values(), strict=True)
            ]
        )
    assert (np.mean(inside, axis=0) >= 0.85).all(), np.mean(inside, axis=0)
    assert (np.mean(inside, axis=0) <= 0.99).all(), np.mean(inside, axis=0)


def _with_spikes(campaign):
    def spikes(run, channel, signal):
        signal[::37] += 2e-3 if channel.name == "s047" else 0.0
        return signal

    return _changed(campaign, spikes)


def test_hubers_loss_keeps_outliers_from_moving_the_parameters():
    campaign = _with_spikes(carrier_campaign())
    plain, robust = (
        identify_jointly(campaign, M2, FitOptions(huber=huber)) for huber in (False, True)
    )
    k = plain.index("d_x", "LC1")
    assert abs(plain.values[k] - TRUTH.d_x) > 1e-5
    assert abs(robust.values[k] - TRUTH.d_x) < 1e-6
    assert robust.rms > plain.rms  # the RMS counts every sample: least squares has the least


def test_outliers_are_flagged_where_they_are_and_nowhere_else():
    campaign = _with_spikes(carrier_campaign())
    robust = identify_jointly(campaign, M2, FitOptions(huber=True))
    for run in campaign.runs:
        residuals = {c.name: residual_signal(run, c, M2, robust) for c in axial_channels(campaign)}
        (flag,) = flagged_outliers(run, residuals)
        assert (flag.run, flag.channel, flag.count) == (run.name, "s047", -(-run.time.size // 37))
        assert_allclose(flag.largest, 2e-3 / 5e-6, rtol=0.1)
    clean = carrier_campaign()
    estimate = identify_jointly(clean, M2)
    for run in clean.runs:
        assert (
            flagged_outliers(
                run, {c.name: residual_signal(run, c, M2, estimate) for c in clean.channels}
            )
            == ()
        )


def test_without_outliers_hubers_loss_changes_little():
    plain, robust = (
        identify_jointly(carrier_campaign(), M2, FitOptions(huber=huber)) for huber in (False, True)
    )
    assert (np.abs(plain.values - robust.values) < 2.0 * plain.std).all()


def test_bootstrap_and_jackknife_agree_on_white_noise():
    campaign = carrier_campaign([run_case(duration=110.0, sample_rate=10.0)])
    jackknife, bootstrap = (
        identify_jointly(campaign, M2, FitOptions(bootstrap=n)) for n in (0, 500)
    )
    assert "500 samples, blocks of 3" in bootstrap.covariance_source
    assert_allclose(bootstrap.values, jackknife.values, rtol=1e-12)
    # 13 blocks of three revolutions: one error is known to a fifth, the mean of seven to a tenth.
    assert_allclose(bootstrap.std, jackknife.std, rtol=0.2)
    assert np.mean(bootstrap.std / jackknife.std) == pytest.approx(1.0, abs=0.1)
    assert identify_jointly(campaign, M2, FitOptions(bootstrap=500)).std[0] == bootstrap.std[0]


@pytest.mark.long
def test_bootstrap_covers_the_truth_under_noise_that_lasts_over_revolutions():
    """A drift with a memory of one revolution.

    An error bar for white noise would be several times too small.
    """
    inside, white = [], []
    for seed in range(60):
        campaign = _changed(
            carrier_campaign([run_case(duration=110.0, sample_rate=5.0)], seed=seed),
            _drifting(seed),
        )
        estimate = identify_each_run(campaign, rigid_model(), FitOptions(bootstrap=60))["LC1"]
        k = estimate.index("d_x", "LC1")
        inside.append(estimate.ci95[k, 0] < TRUTH.d_x < estimate.ci95[k, 1])
        white.append(estimate.rms / np.sqrt(estimate.n_samples) / estimate.std[k])
    assert 0.85 <= np.mean(inside) <= 1.0, np.mean(inside)
    assert np.mean(white) < 0.5


@pytest.mark.long
@pytest.mark.parametrize(
    ("model", "motion"), [(rigid_model(), RIGID), (M2, TRUTH)], ids=["m1", "m2"]
)
def test_truth_lies_in_its_interval_in_90_to_99_percent_of_repeats_with_coloured_noise(
    model, motion
):
    """Coloured (AR(1)) noise with a correlation time of a tenth of a revolution.

    At low frequency it has ten times its white level.
    """
    inside = []
    for seed in range(200):
        rng = np.random.default_rng(300 + seed)

        def coloured(run, channel, signal, rng=rng):
            share = np.exp(-1.0 / 4.0)
            noise = lfilter(
                [np.sqrt(1.0 - share**2)], [1.0, -share], rng.standard_normal(signal.size)
            )
            return signal + 1e-5 * noise

        clean = carrier_campaign([run_case(motion=motion, sample_rate=15.0)], noise_std=0.0)
        estimate = identify_each_run(_changed(clean, coloured), model)["LC1"]
        truth = np.array([getattr(motion, name) for name in estimate.names])
        inside.append((estimate.ci95[:, 0] < truth) & (truth < estimate.ci95[:, 1]))
    coverage = np.mean(inside, axis=0)
    assert (coverage >= 0.90).all(), dict(zip(estimate.names, coverage, strict=True))
    assert (coverage <= 0.99).all(), dict(zip(estimate.names, coverage, strict=True))


def _drifting(seed):
    rng = np.random.default_rng(900 + seed)

    def drift(run, channel, signal):
        step = rng.standard_normal(signal.size)
        memory = np.exp(-1.0 / 13.5)
        slow = np.zeros(signal.size)
        for k in range(1, signal.size):
            slow[k] = memory * slow[k - 1] + np.sqrt(1.0 - memory**2) * step[k]
        return signal + 2e-5 * slow

    return drift


def test_what_is_determined_of_an_aliased_pair_is_said():
    """Three axial sensors cannot tell an offset of one of them from the carrier's rigid motion."""
    zero = Effect(
        "zero_of_s047",
        equation="e_047 at the sensor at 47 deg",
        parameters=(EffectParameter("e_047", "m"),),
        signature="order 0 of one channel",
        pattern=lambda sensor, inputs, rig: np.full(
            (1, inputs.torque.size), float(np.isclose(sensor.angle, np.deg2rad(47.0)))
        ),
    )
    model = replace(rigid_model(), effects=(*rigid_model().effects, zero))
    estimate = identify_jointly(carrier_campaign([run_case()], sensors=SENSORS[:3]), model)
    (text,) = estimate.undetermined
    # e_047 = 2 e looks like d_x = e and a tilt about the axis through the sensor at 137 deg: e_137
    # and e_227 stay.
    assert text.startswith("e_047 and d_x of LC1 and phi_H ")
    assert text.endswith("cannot be separated: these signals determine only 2 combinations of them")
    complete = identify_jointly(carrier_campaign([run_case()]), model)
    assert complete.undetermined == ()


def test_too_small_a_bootstrap_is_refused():
    with pytest.raises(ValueError, match="bootstrap is 3 samples; expected 0"):
        FitOptions(bootstrap=3)
    short = carrier_campaign([run_case(duration=6.0)])
    with pytest.raises(ValueError, match="run LC1: 2 revolutions; expected at least 3"):
        identify_jointly(short, M2, FitOptions(bootstrap=100))
