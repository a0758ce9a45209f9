"""The carrier's truth means what the contract says.

Signs, orders and sizes, beside the simulator's own patterns.
"""

import numpy as np
import pytest

from carrierflex.blind_check.labels import NOTHING, PAIR, SINGLE, CasePlan
from carrierflex.blind_check.truth.alias_table import SINGLES
from carrierflex.blind_check.truth.campaigns import write_case
from carrierflex.blind_check.truth.carrier.rig import SENSOR_ANGLES, drawn_record
from carrierflex.blind_check.truth.carrier.signals import (
    NOMINAL_TORQUE,
    PIN_RADIUS,
    RADIUS,
    SIGNALS,
    curve_at,
    drawn_values,
    scaled_values,
)
from carrierflex.blind_check.truth.carrier.truth import KNOWN, carrier_case
from carrierflex.blind_check.truth.linear_refit import LinearBaseline
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.simulation.carrier.effects.library import CARRIER_EFFECTS
from carrierflex.simulation.carrier.rim import CarrierInputs, CarrierRig, RimSensor

RECORD = drawn_record(np.random.default_rng(1), 0, (0.8, 6e4, -9e4, 2.3), 30.0)


def curves():
    angle = 2.0 * np.pi * np.arange(720) / 720
    loads = {"delta_s": 1e3, "delta_f": 1e3, "g_s": 1.0, "g_f": 1.0}
    return {
        name: DeflectionCurve(name, RADIUS, load, curve_at(name, angle), np.zeros(720))
        for name, load in loads.items()
    }


def by_the_library(effect, values):
    """Signal of the same parameters by the effect that the diagnosis fits."""
    inputs = CarrierInputs(
        RECORD.time,
        RECORD.angle,
        RECORD.torque,
        RECORD.ntl_y,
        RECORD.ntl_z,
        RECORD.time[0],
        RECORD.time[-1],
    )
    rig = CarrierRig(NOMINAL_TORQUE, 3, PIN_RADIUS, curves())
    if effect.pair:
        size, angle = (values[name] for name in (effect.pair.size, effect.pair.angle))
        coefficients = [size * np.cos(angle), size * np.sin(angle)]
    else:
        coefficients = [values.get(parameter.name, 0.0) for parameter in effect.parameters]
    sensors = [RimSensor(angle, RADIUS, True) for angle in SENSOR_ANGLES]
    return np.array([effect.signal(coefficients, sensor, inputs, rig) for sensor in sensors])


@pytest.mark.parametrize(
    "effect",
    [
        "housing_tilt", "torque_tilt", "carrier_tilt", "flexible_pins", "stiff_pins",
        "unequal_load_sharing",
        "load_sharing_ntl", "ntl_tilt", "flange_warp", "face_runout", "ring_pass",
    ],
)  # fmt: skip
def test_own_equations_give_the_signal_that_the_contract_means(effect):
    values = drawn_values(effect, np.random.default_rng(3), 6)
    truth = SIGNALS[effect](RECORD, values)
    other = by_the_library(CARRIER_EFFECTS[effect], values)
    # Curves are interpolated between half degrees there and summed as a series here.
    np.testing.assert_allclose(truth, other, atol=2e-3 * np.abs(other).max(), rtol=0.0)


def diametral(signal, order):
    """A_m(n) for m = 0, 1, 2, 3: 1/4 sum_i Y_i(n) exp(j m v_i)."""
    turns = 2.0 * np.pi * np.arange(3600) / 3600 * 3
    angle = RECORD.angle[0] + turns
    even = np.array([np.interp(angle, RECORD.angle, channel) for channel in signal])
    amplitude = even @ np.exp(-1j * order * turns) / turns.size
    return [abs(np.mean(amplitude * np.exp(1j * m * SENSOR_ANGLES))) for m in range(4)]


@pytest.mark.parametrize("order", [2, 3, 4, 5])
def test_a_wave_on_the_face_stands_in_one_pattern_alone(order):
    signal = SIGNALS["face_runout"](RECORD, {f"a_{order}": 3e-5, f"b_{order}": 1e-5})
    amplitudes = diametral(signal, order)
    assert np.argmax(amplitudes) == order % 4
    # Linear interpolation at 20 samples a second smears a thousandth.
    assert np.sort(amplitudes)[-2] < 5e-3 * max(amplitudes)


def test_clearances_close_and_saturate():
    low, high = ({"c": 1.0, "T_c": T} for T in (2.0 * NOMINAL_TORQUE, 0.5 * NOMINAL_TORQUE))
    assert not SIGNALS["pin_clearance"](RECORD, low).any()
    assert np.abs(SIGNALS["pin_clearance"](RECORD, high)).max() > 1e-7
    sizes = []
    for load in (1e4, 1e6, 2e6):
        record = drawn_record(np.random.default_rng(1), 0, (0.5, 0.0, load, 2.3), 5.0)
        sizes.append(
            np.abs(SIGNALS["bearing_clearance"](record, {"phi_B": 1e-4, "F_s": 5e4})).max()
        )
    assert sizes[0] < 0.25 * sizes[2]
    assert sizes[1] == pytest.approx(sizes[2], rel=1e-6)
    rocking = {"phi_R": 1e-4, "W_1": 5e4, "W_2": 9e4}
    # At rest, under weight alone, the sensors read nothing of it.
    still = drawn_record(np.random.default_rng(1), 0, (0.5, 0.0, 0.0, 2.3), 5.0)
    assert np.abs(SIGNALS["clearance_rocking"](still, rocking)).max() < 1e-15


def test_pin_loads_of_unequal_sharing_sum_to_zero_and_stay_pushing():
    values = drawn_values("unequal_load_sharing", np.random.default_rng(5), 6)
    third = -values["e_1"] - values["e_2"]
    assert max(abs(values["e_1"]), abs(values["e_2"]), abs(third)) <= 0.1
    assert np.hypot(values["e_1"], (values["e_2"] - third) / np.sqrt(3.0)) == pytest.approx(0.1)


@pytest.mark.parametrize("effect", SINGLES["carrier"])
def test_gap_is_as_planned(effect, tmp_path):
    label = write_case(CasePlan("carrier", 4, 2, SINGLE, (effect,), 8.0), tmp_path / "case")
    assert label.gap_over_floor == pytest.approx(8.0, rel=2e-3)
    assert label.acceptable[0][0] == effect
    assert set(label.parameters) == {effect, *KNOWN}
    # Errors of measurement and noise are left; held out, the gap may be larger.
    assert label.rho < 0.16


def test_effect_at_its_physical_limit_leaves_less_and_the_label_says_so(tmp_path):
    label = write_case(
        CasePlan("carrier", 4, 2, SINGLE, ("sensor_angle",), 300.0), tmp_path / "case"
    )
    assert label.gap_over_floor < 100.0
    ((name, value),) = label.parameters["sensor_angle"].items()
    assert name in ("dv_s047", "dv_s137", "dv_s227", "dv_s317")
    assert abs(value) == pytest.approx(0.09)


def test_pair_leaves_about_the_planned_gap(tmp_path):
    label = write_case(
        CasePlan("carrier", 6, 2, PAIR, ("carrier_tilt", "thermal_drift"), 8.0), tmp_path / "case"
    )
    assert label.effects == ("carrier_tilt", "thermal_drift")
    assert label.gap_over_floor == pytest.approx(8.0, rel=0.05)


def test_nothing_is_left_but_noise_where_nothing_is_missing(tmp_path):
    for number in (1, 2, 3):
        label = write_case(CasePlan("carrier", number, 2, NOTHING, (), 0.0), tmp_path / "case")
        campaign = read_campaign(tmp_path / "case")
        columns, signals = [], []
        for run in campaign.runs:
            u = SENSOR_ANGLES[:, None] - run.inputs["carrier_angle"]
            still = SENSOR_ANGLES[:, None] + 0.0 * u
            rows = (
                np.sin(still),
                np.cos(still),
                np.sin(u),
                np.cos(u),
                curve_at("delta_f", u) * run.inputs["torque"],
            )
            columns.append(np.array([row.reshape(-1) for row in rows]).T)
            signals.append(np.array(list(run.signals.values())))
        residual = np.concatenate(
            LinearBaseline(columns, own_offset=True).residuals(signals), axis=1
        )
        # Noise with a memory of one sample: 23 000 samples tell its size to 1 %; the sensors'
        # errors add half a per cent.
        assert residual.std() / label.floor == pytest.approx(1.0, abs=0.03)
        assert label.present == ()
        assert label.rho == 1.0
        assert label.gap_over_floor == 0.0


def test_shape_stays_when_an_effect_is_scaled():
    values = {"phi_H": 1e-4, "theta_H": 0.7}
    assert scaled_values(values, 3.0) == {"phi_H": pytest.approx(3e-4), "theta_H": 0.7}


def test_campaign_declares_the_errors_that_its_sensors_are_drawn_with():
    campaign, _ = carrier_case(CasePlan("carrier", 4, 2, SINGLE, ("torque_tilt",), 8.0))
    quiet, _ = carrier_case(CasePlan("carrier", 5, 2, NOTHING, (), 0.0))
    assert [(signal.name, signal.gain_std) for signal in campaign.inputs] == [("torque", 0.01)]
    for channel in campaign.channels:
        # Any size up to 3 % and half a degree is as likely, or up to a share of both.
        assert 0.0 < channel.gain_std <= 0.03 / np.sqrt(3.0)
        assert channel.angle_std / channel.gain_std == pytest.approx(np.deg2rad(0.5) / 0.03)
    # With nothing missing the errors are smaller, and so is what is known of them.
    assert quiet.channels[0].gain_std < campaign.channels[0].gain_std
