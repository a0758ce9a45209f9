"""Patterns of unequal pin loads beside the superposition of single pins' curves."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.carrier.classes.class_rows import _pin_weights
from carrierflex.simulation.carrier.effects.deflection import LOAD_SHARING_NTL, load_sharing_of
from carrierflex.simulation.carrier.measured_laws.rim_patterns import (
    MODULATED,
    TILT,
    UNEVEN,
    WAVES,
    modulated_waves,
    tilt,
    uneven_waves,
)
from carrierflex.simulation.carrier.rim import CarrierInputs, RimSensor
from tests.diagnosis.carrier.carrier_twin import CARRIER_RIG

G_F = CARRIER_RIG.curves["g_f"]
#: A curve that is alike neither to its mirror nor to its negative.
LEANING = replace(G_F, axial=np.roll(G_F.axial, G_F.axial.size // 12) + 0.5 * G_F.axial)
QUANTITIES = ("axial_displacement", "radial_displacement")
ANGLE = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
SENSORS = [(v, is_axial) for v in (0.2, 1.1, 2.9, 4.4) for is_axial in (True, False)]


def rig_of(n_planets, pin_angle, curve):
    """Rig whose pins bend the carrier by a curve."""
    curves = {"g_f": curve}
    return replace(CARRIER_RIG, n_planets=n_planets, pin_angle=pin_angle, curves=curves)


def inputs_under(ntl_y: float, ntl_z: float) -> CarrierInputs:
    one = np.ones_like(ANGLE)
    return CarrierInputs(ANGLE, ANGLE, 3e5 * one, ntl_y * one, ntl_z * one, 0.0, 1.0)


def law_signals(effect, rig, ntl_y=0.0, ntl_z=0.0):
    """Every column of a law at all sensors, shape (n_columns, n_sensors, n)."""
    inputs = inputs_under(ntl_y, ntl_z)
    signals = [effect.signals(RimSensor(v, 0.412, axial), inputs, rig) for v, axial in SENSORS]
    return np.swapaxes(np.array(signals), 0, 1)


def pattern_signals(columns, weights):
    """Every pattern at all sensors, shape (n_patterns, n_sensors, n)."""
    result = np.zeros((len(columns), len(SENSORS), ANGLE.size))
    for k, (v, axial) in enumerate(SENSORS):
        for number, column in enumerate(columns):
            if column.quantity == QUANTITIES[0 if axial else 1]:
                cosine, sine = column.over(np.array([v]))
                phase = column.order * ANGLE
                result[number, k] = cosine[0] * np.cos(phase) + sine[0] * np.sin(phase)
    return np.tensordot(weights, result, 1)


def left_of(target, patterns):
    """Share of a signal's square that no sum of patterns meets."""
    design = patterns.reshape(len(patterns), -1).T
    fit = np.linalg.lstsq(design, target.ravel(), rcond=None)[0]
    return np.sum((target.ravel() - design @ fit) ** 2) / np.sum(target**2)


@pytest.mark.parametrize("curve", [G_F, LEANING], ids=["of a carrier", "leaning"])
@pytest.mark.parametrize("pin_angle", [0.0, 0.4])
@pytest.mark.parametrize("n_planets", [3, 4, 5])
def test_uneven_pins_are_met_by_one_pattern_less_than_planets(n_planets, pin_angle, curve):
    rig = rig_of(n_planets, pin_angle, curve)
    columns = uneven_waves(QUANTITIES, n_planets)
    weights = _pin_weights(UNEVEN, columns, rig)
    assert weights.shape == (2 * (n_planets - 1), len(columns))
    for signal in law_signals(load_sharing_of(n_planets), rig):
        # What is left is waves beyond the orders of the pattern.
        assert left_of(signal, pattern_signals(columns, weights)) < 5e-4


@pytest.mark.parametrize("curve", [G_F, LEANING], ids=["of a carrier", "leaning"])
@pytest.mark.parametrize("pin_angle", [0.0, 0.4])
@pytest.mark.parametrize("n_planets", [3, 4, 5])
def test_shares_that_change_once_a_turn_are_met_by_two_patterns(n_planets, pin_angle, curve):
    rig = rig_of(n_planets, pin_angle, curve)
    columns = modulated_waves(QUANTITIES, n_planets)
    weights = _pin_weights(MODULATED, columns, rig)
    assert weights.shape == (4, len(columns))
    for signal in law_signals(LOAD_SHARING_NTL, rig, ntl_y=5e4, ntl_z=-8e4):
        assert left_of(signal, pattern_signals(columns, weights)) < 5e-4


def test_a_wave_with_a_size_of_its_own_is_no_unequal_load():
    """What a bump on the face leaves beside its first order."""
    columns = uneven_waves(QUANTITIES, 3)
    weights = _pin_weights(UNEVEN, columns, CARRIER_RIG)
    bump = np.array([axial * np.cos(2.0 * (v - ANGLE)) for v, axial in SENSORS])
    assert left_of(bump, pattern_signals(columns, np.eye(len(columns)))) < 1e-12
    assert left_of(bump, pattern_signals(columns, weights)) > 0.9


def test_other_patterns_and_rigs_without_the_curve_keep_their_columns():
    columns = uneven_waves(QUANTITIES, 3)
    without = replace(CARRIER_RIG, curves={})
    assert_allclose(_pin_weights(UNEVEN, columns, without), np.eye(len(columns)), rtol=0.0)
    of_tilt = tilt(QUANTITIES)
    assert_allclose(_pin_weights(TILT, of_tilt, CARRIER_RIG), np.eye(len(of_tilt)), rtol=0.0)
    assert_allclose(_pin_weights(WAVES, columns, CARRIER_RIG), np.eye(len(columns)), rtol=0.0)


def test_weights_are_of_the_order_of_one():
    weights = _pin_weights(UNEVEN, uneven_waves(QUANTITIES, 3), CARRIER_RIG)
    by_quantity = np.abs(weights).reshape(2, -1)
    assert_allclose(by_quantity.max(axis=1), 1.0)
