"""Laws of the library against what the sensors of the whole stage read, which knows none."""

from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.blind_check.truth.carrier.rig import SENSOR_ANGLES
from carrierflex.blind_check.truth.carrier.stage import LOADS, stage_readings
from carrierflex.diagnosis.carrier.problem import carrier_problem
from carrierflex.diagnosis.inference.effect_fit import fit_effects
from carrierflex.simulation.carrier.effects.deflection import PIN_CLEARANCE, with_weight
from carrierflex.simulation.carrier.effects.library import CLEARANCE_ROCKING
from carrierflex.simulation.carrier.rim import CarrierInputs, RimSensor
from tests.diagnosis.carrier.carrier_twin import CARRIER_RIG, CURVES, NOISE, twin_campaign

ANGLE = 2.0 * np.pi * np.arange(24) / 24
SENSORS = [RimSensor(float(angle), 0.412, True) for angle in SENSOR_ANGLES]


def inputs_under(load):
    torque, y, z = (value * np.ones_like(ANGLE) for value in load)
    return CarrierInputs(ANGLE, ANGLE, torque, y, z, start=0.0, end=ANGLE[-1])


def gap_of(case):
    """Readings with the effect less those without, shape (n_loads, n_sensors, n_angles)."""
    series, nominal = stage_readings(case)
    gap = series - nominal
    waves = np.outer(np.arange(1, (gap.shape[2] + 1) // 2), ANGLE)
    return gap[..., :1] + gap[..., 1::2] @ np.cos(waves) + gap[..., 2::2] @ np.sin(waves)


def share_left(gap, effect, shapes):
    """Least share of the gap's square that an effect leaves, over values of its shape."""
    shares = []
    for shape in shapes:
        columns = np.concatenate(
            [
                effect.signals(sensor, inputs_under(load), CARRIER_RIG, shape)
                for load in LOADS
                for sensor in SENSORS
            ],
            axis=1,
        ).T
        fit, *_ = np.linalg.lstsq(columns, gap.ravel(), rcond=None)
        shares.append(((gap.ravel() - columns @ fit) ** 2).sum() / (gap**2).sum())
    return min(shares)


@pytest.mark.long
@pytest.mark.parametrize(
    ("case", "torque_alone", "turned_loads"),
    [
        ("pin_clearance 1", 0.05, 0.02),
        ("pin_clearance 2", 0.1, 0.025),
        ("pin_clearance 3", 0.3, 0.04),
    ],
)
def test_closed_pins_carry_weight_beside_the_torque(case, torque_alone, turned_loads):
    gap = gap_of(case)
    shapes = np.linspace(0.0, 340e3, 35)
    assert share_left(gap, PIN_CLEARANCE, shapes) > torque_alone
    assert share_left(gap, with_weight(PIN_CLEARANCE, CURVES), shapes) < turned_loads


def test_weight_on_closed_pins_makes_orders_0_3_and_6_of_other_phases_than_torque():
    # A load that turns through three pins: order n of a pin's curve comes as the multiple of three
    # beside it.
    effect = with_weight(PIN_CLEARANCE, CURVES)
    rows = np.array([effect.signals(s, inputs_under(LOADS[0]), CARRIER_RIG, 1e5) for s in SENSORS])
    orders = np.abs(np.fft.rfft(rows, axis=2)).max(axis=0)
    for row in orders[1:3]:
        assert row[[1, 2, 4, 5, 7]].max() < 1e-9 * row.max()
        assert row[[0, 3, 6]].min() > 1e-2 * row.max()
    # The torque's own part has no order 0 but for the mesh, and open pins carry nothing.
    assert orders[0, 0] < 0.03 * orders[0].max()
    open_pins = effect.signals(SENSORS[0], inputs_under(LOADS[0]), CARRIER_RIG, 3.7e5)
    assert not open_pins.any()


@pytest.mark.long
def test_a_clearance_that_closes_below_every_load_is_on_no_bound():
    campaign = twin_campaign("bearing_clearance", turns=4, limiting_load=30.0)
    problem = carrier_problem(campaign, CURVES)
    fit = fit_effects(problem, ("bearing_clearance",))
    F_s = fit.known["bearing_clearance", "F_s"]
    # The least value that is tried: 2 % of the largest radial load.
    assert_allclose(F_s, 0.02 * 2e5, rtol=1e-6)
    assert not fit.at_bound.any()
    assert_allclose(fit.sums.square.sum() / problem.cell_counts.sum(), NOISE**2, rtol=0.05)


@pytest.mark.long
def test_pins_that_bend_to_a_tilt_without_closing_are_on_their_bound():
    """Closed pins carry the radial load too: without their own part they are any tilt by it."""
    problem = carrier_problem(twin_campaign("ntl_tilt", turns=4), CURVES)
    fit = fit_effects(problem, ("pin_clearance",))
    on_bound = {
        parameter.name
        for parameter, hit in zip(fit.parameters, fit.at_bound, strict=True)
        if hit and parameter.effect == "pin_clearance"
    }
    assert on_bound == {"c"}
    left = fit.sums.square.sum() / fit_effects(problem, ()).sums.square.sum()
    assert left < 0.2


def share_of_held_out_loads(gap, weights):
    """Share of the static gap's square that is left where each load is predicted from the others.

    By the rocking of two bearings at the best of some pairs of weights.
    """
    static = gap.mean(axis=2)
    laws = [
        np.array(
            [
                [CLEARANCE_ROCKING.signals(s, inputs_under(load), CARRIER_RIG, *pair)[0, 0]
                 for s in SENSORS]
                for load in LOADS
            ]
        )
        for pair in weights
    ]  # fmt: skip
    remaining = 0.0
    for load in range(len(LOADS)):
        others = np.arange(len(LOADS)) != load
        sizes = [(law[others] * static[others]).sum() / (law[others] ** 2).sum() for law in laws]
        misfits = [
            ((static - size * law)[others] ** 2).sum()
            for size, law in zip(sizes, laws, strict=True)
        ]
        best = int(np.argmin(misfits))
        remaining += ((static[load] - sizes[best] * laws[best][load]) ** 2).sum()
    return remaining / (static**2).sum()


@pytest.mark.parametrize("case", ["bearing_clearance 1", "bearing_clearance 2"])
def test_bearings_with_weights_of_their_own_predict_loads_that_were_not_fitted(case):
    weights = 2e5 * np.geomspace(0.05, 3.2, 13)
    separate = share_of_held_out_loads(gap_of(case), list(product(weights, repeat=2)))
    common = share_of_held_out_loads(gap_of(case), [(weight, weight) for weight in weights])
    assert separate < 0.02
    assert common > 0.1
