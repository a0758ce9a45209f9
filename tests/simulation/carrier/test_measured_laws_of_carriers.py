"""Measured laws of a carrier: patterns as waves, amplitudes over the loads, and their files."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.simulation.carrier import kinematics, patterns
from carrierflex.simulation.carrier.measured_laws.carrier_laws import law_signal, refuse_other_rig
from carrierflex.simulation.carrier.measured_laws.rim_patterns import (
    RIM_PATTERNS,
    has_wave,
    modulated_waves,
    offset,
    planet_pass,
    saddle,
    tilt,
    turning_tilt,
    turning_waves,
    uneven_waves,
)
from carrierflex.simulation.carrier.motion import simulate_run
from carrierflex.simulation.carrier.rim import CarrierInputs, RimSensor
from carrierflex.simulation.carrier.run_cases import CarrierMotion, RunCase, Sensor
from carrierflex.simulation.laws import CARRIER, Law, Wave
from tests.simulation.synthetic_curves import flexible_curve, stiff_curve

AXIAL = "axial_displacement"
RADIAL = "radial_displacement"
V = 0.7
THETA = np.linspace(0.0, 7.0, 40)
VISITED = {"torque": (0.0, 4e5), "ntl_y": (-1e5, 1e5), "ntl_z": (-2e5, 2e5)}
ROUNDING = 1e-13


def wave(order, lobes, cosine, sine=None, quantity=AXIAL, *, follows="none", x=(), along=""):
    """Wave of some amplitudes; its sine is as long as its cosine."""
    sine = np.zeros(np.size(cosine)) if sine is None else sine
    return Wave(quantity, order, lobes, follows, np.atleast_1d(cosine), sine, np.array(x), along)


def law_of(*waves, pattern="housing/tilt"):
    """Law of some waves."""
    rig = {"n_planets": 3, "sensor_radius": 0.412}
    return Law("law", CARRIER, pattern, ("N", "m"), waves, VISITED, rig)


def read_at(law, *, torque=0.0, y=0.0, z=0.0, is_axial=True, v=V):
    """Signal of a law over some turns, its loads constant or over time."""
    one = np.ones_like(THETA)
    inputs = CarrierInputs(THETA, THETA, torque * one, y * one, z * one, 0.0, float(THETA[-1]))
    return law_signal(law, RimSensor(v, 0.412, is_axial), inputs)


def column_signals(columns):
    """Signal of every column of a pattern at the sensor."""
    rows = []
    for column in columns:
        cosine, sine = column.over(np.array([V]))
        rows.append(cosine * np.cos(column.order * THETA) + sine * np.sin(column.order * THETA))
    return np.array(rows)


def test_patterns_are_those_of_the_simulator():
    assert_allclose(column_signals(offset([AXIAL])), kinematics.offset_pattern(THETA)[None])
    about = (0.0, np.pi / 2.0)
    tilts = [kinematics.housing_tilt_pattern(THETA, V, 1.0, axis) for axis in about]
    # A tilt about the axis at zero is minus the sine over the sensors.
    assert_allclose(column_signals(tilt([AXIAL])), [tilts[1], -tilts[0]], atol=ROUNDING)
    turning = [kinematics.carrier_tilt_pattern(THETA, V, 1.0, axis) for axis in about]
    assert_allclose(column_signals(turning_tilt([AXIAL])), [turning[1], -turning[0]], atol=ROUNDING)
    first = column_signals(saddle([AXIAL]))[0]
    assert_allclose(first, kinematics.saddle_pattern(THETA, V), atol=ROUNDING)
    waves = patterns.face_waves_pattern(THETA, V, 4)
    assert_allclose(column_signals(turning_waves([AXIAL], [4])), waves, atol=ROUNDING)
    passing = patterns.planet_pass_pattern(THETA, np.ones_like(THETA), 3)
    shapes = (1.0, np.cos(V), np.sin(V))
    expected = [shape * phase for shape in shapes for phase in passing]
    assert_allclose(column_signals(planet_pass([AXIAL], 3)), expected, atol=ROUNDING)


def test_pins_that_change_once_a_turn_show_as_modulated_waves():
    """Waves of each pin times its load, which turns through a direction of the housing."""
    total = np.zeros_like(THETA)
    for pin in 2.0 * np.pi / 3.0 * np.arange(3):
        load = np.cos(THETA + pin - 0.4)
        total += load * sum(np.cos(h * (V - THETA - pin) + 0.2 * h) for h in range(1, 8))
    design = column_signals(modulated_waves([AXIAL], 3))
    # Pins of seven lobes modulate orders up to eight: those that three pins keep are 0, 3 and 6.
    amplitudes = np.linalg.lstsq(design.T, total, rcond=None)[0]
    assert_allclose(amplitudes @ design, total, atol=1e-10)


def test_every_column_of_a_pattern_is_one_of_its_waves():
    columns = {
        "housing/offset": offset([AXIAL]),
        "housing/tilt": tilt([AXIAL]),
        "housing/saddle": saddle([AXIAL]),
        "housing/planet_pass": planet_pass([AXIAL], 5),
        "housing/load_sharing": modulated_waves([AXIAL], 5),
        "carrier/tilt": turning_tilt([AXIAL]),
        "carrier/waves": turning_waves([AXIAL], range(2, 21)),
        "carrier/load_sharing": uneven_waves([AXIAL], 5),
    }
    assert tuple(columns) == RIM_PATTERNS
    for pattern, waves in columns.items():
        for column in waves:
            for one in column.waves:
                assert has_wave(pattern, column.order, one.lobes, 5)
    assert not has_wave("carrier/load_sharing", 5, 5, 5)
    assert not has_wave("housing/tilt", 1, 1, 5)


def test_amplitudes_follow_the_torque_and_go_on_with_the_slope_of_their_end():
    x = np.linspace(1e5, 4e5, 31)
    term = wave(0, 1, 1e-10 * x + 2e-6, follows="torque", x=x)
    for torque in (2.2e5, 5e5, 0.0):
        expected = (1e-10 * torque + 2e-6) * np.cos(V)
        assert_allclose(read_at(law_of(term), torque=torque), expected)


@pytest.mark.parametrize("torque", [0.0, 3e5])
def test_a_radial_load_is_followed_as_a_vector(torque):
    r = np.linspace(0.0, 3e5, 7)
    terms = [
        wave(0, 1, size * r, 2.0 * size * r, follows="radial_load", x=r, along=along)
        for size, along in ((1e-11, "y"), (2e-11, "z"), (3e-12, "yy"), (4e-12, "yz"), (5e-12, "zz"))
    ]
    y, z = -8e4, 6e4
    e_y, e_z = -0.8, 0.6
    height = 1e-11 * y + 2e-11 * z
    height += 1e5 * (3e-12 * e_y**2 + 4e-12 * e_y * e_z + 5e-12 * e_z**2)
    expected = height * (np.cos(V) + 2.0 * np.sin(V))
    assert_allclose(read_at(law_of(*terms), torque=torque, y=y, z=z), expected)
    # The other sense of the load turns round what is odd in it, not what is even.
    odd = 1e-11 * y + 2e-11 * z
    other = read_at(law_of(*terms), torque=torque, y=-y, z=-z)
    assert_allclose(other, expected * (height - 2.0 * odd) / height)
    assert_allclose(read_at(law_of(*terms)), 0.0)


def test_torque_and_radial_load_make_an_amplitude_together():
    r = np.linspace(0.0, 3e5, 7)
    together = wave(3, 2, 1e-16 * r, 2e-16 * r, follows="load_sharing", x=r, along="z")
    law = law_of(together, pattern="housing/load_sharing")
    phase = 2.0 * V - 3.0 * THETA
    expected = 2e5 * 1e-16 * 1e5 * (np.cos(phase) + 2.0 * np.sin(phase))
    assert_allclose(read_at(law, torque=2e5, z=1e5), expected, atol=1e-20)
    assert_allclose(read_at(law, z=1e5), 0.0)


def test_a_drift_follows_the_share_of_the_run_and_a_constant_nothing():
    x = np.linspace(0.0, 1.0, 101)
    drift = law_of(wave(0, 0, 1e-5 * x, follows="time", x=x), pattern="housing/offset")
    assert_allclose(read_at(drift), 1e-5 * THETA / THETA[-1])
    still = law_of(wave(0, 1, 2e-5))
    assert_allclose(read_at(still), 2e-5 * np.cos(V))


def test_axial_and_radial_sensors_have_amplitudes_of_their_own():
    law = law_of(wave(0, 1, 2e-5), wave(0, 1, 3e-5, quantity=RADIAL))
    assert_allclose(read_at(law), 2e-5 * np.cos(V))
    assert_allclose(read_at(law, is_axial=False), 3e-5 * np.cos(V))


def test_the_simulator_adds_the_signal_of_a_law():
    motion = CarrierMotion(1e-4, 1e-4, 0.2, 3e-4, 0.1, 0.1, 0.6)
    case = RunCase("run", "a", 3e5, 1e4, -5e4, 2.0, 6.0, 50.0, motion, 0.01, 0.02)
    sensors = (Sensor("s", AXIAL, V, 0.412), Sensor("r", RADIAL, 1.2, 0.412))
    r = np.linspace(0.0, 1e5, 5)
    law = law_of(
        wave(0, 1, np.array([0.0, 4e-5]), follows="torque", x=(0.0, 4e5)),
        wave(0, 1, 1e-10 * r, quantity=RADIAL, follows="radial_load", x=r, along="z"),
    )
    curves = (stiff_curve(), flexible_curve())
    runs = [
        simulate_run(
            case, sensors, *curves, noise_std=1e-6, rng=np.random.default_rng(3), laws=laws
        )
        for laws in ((), (law,))
    ]
    without, with_law = runs
    added = {name: with_law.signals[name] - without.signals[name] for name in ("s", "r")}
    assert_allclose(added["s"], 1e-10 * with_law.torque * np.cos(V), atol=1e-18)
    assert_allclose(added["r"], 1e-10 * -5e4 * np.cos(1.2), atol=1e-18)


@pytest.mark.parametrize(
    ("planets", "radius", "message"),
    [(4, 0.412, "of a carrier with 3 planets"), (3, 0.5, "measured at the radius 0.412 m")],
)
def test_a_law_of_another_rig_is_refused(planets, radius, message):
    law = law_of(wave(0, 1, 2e-5))
    refuse_other_rig(law, 3, 0.4125)
    with pytest.raises(ValueError, match=message):
        refuse_other_rig(law, planets, radius)
