"""The intervals of rig.md 1.7 and what they must contain whatever the rounding was."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.identification.carrier.printed_tables import (
    LOAD_CASES,
    SENSOR_RADIUS,
    TABLE_4,
    derived_facts,
)

FACTS = derived_facts()


@pytest.mark.parametrize(
    ("case", "value", "low", "high"),
    [
        ("LC1", 0.0301, 0.026, 0.034),
        ("LC2", 0.0137, 0.0, 0.019),
        ("LC3", 0.0276, 0.020, 0.034),
        ("LC4", 0.0299, 0.029, 0.031),
    ],
)
def test_rim_deflection_of_table_4_in_mm(case, value, low, high):
    rms = FACTS.deflection_rms[case]
    assert_allclose(rms.value * 1e3, value, atol=6e-5)
    assert_allclose([rms.low * 1e3, rms.high * 1e3], [low, high], atol=6e-4)


def test_one_deflection_per_torque_fits_all_four_load_cases():
    common = FACTS.common_deflection_per_torque
    assert common is not None
    assert common.low < 0.0831e-9 < common.high
    assert_allclose(FACTS.order_3_amplitude.value, 0.117e-9, rtol=0.01)


def test_deflections_that_contradict_one_another_have_nothing_in_common():
    """With exact digits the four cases differ: nothing is claimed in common."""
    assert derived_facts(half_digit=1e-9).common_deflection_per_torque is None


@pytest.mark.parametrize(("case", "phi"), [("LC1", 0.58e-3), ("LC2", 0.55e-3), ("LC4", 0.65e-3)])
def test_misalignment_of_table_5(case, phi):
    tilt = FACTS.phi_PLC[case]
    assert_allclose(tilt.value, phi, atol=6e-6)
    assert tilt.low < tilt.value < tilt.high


def test_saddle_is_a_line_in_the_radial_load():
    at_rest, slope = FACTS.saddle_line
    assert_allclose([at_rest.value, slope.value], [0.107e-3, -4.2e-10], rtol=0.01)
    assert_allclose(FACTS.saddle_zero.value, 250e3, rtol=0.02)
    for case, (share, load) in LOAD_CASES.items():
        if share == 1.0:
            assert abs(at_rest.value + slope.value * load - TABLE_4[case][1]) < 8e-6


def test_intervals_hold_every_machine_that_prints_the_same_digits():
    """Machines drawn at random print these tables: their truth never leaves the interval."""
    rng = np.random.default_rng(1)
    deflection, rest = 30e-6, 111e-6
    for _ in range(200):
        m2 = rest + rng.uniform(-0.4e-6, 0.4e-6)
        rms = deflection + rng.uniform(-3e-6, 3e-6)
        if round(np.hypot(m2, rms) * 1e6) == 115 and round(m2 * 1e6) == 111:
            assert FACTS.deflection_rms["LC1"].low <= rms <= FACTS.deflection_rms["LC1"].high
    phi = FACTS.phi_PLC["LC1"]
    amplitude = SENSOR_RADIUS * phi.value
    assert_allclose(np.hypot(0.241e-3, amplitude / np.sqrt(2)), 0.295e-3, rtol=1e-12)
