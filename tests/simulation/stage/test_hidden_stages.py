"""Drawn stages: equilibrium, ranges, and a stage as function of normal numbers."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.simulation.carrier.run_cases import AXIAL, RADIAL, Sensor
from carrierflex.simulation.stage.hidden_stages import (
    HIDDEN,
    Bodies,
    HiddenRange,
    HiddenStage,
    StagePair,
    load_of,
    loaded_turn,
    stage_at,
)
from carrierflex.simulation.stage.stage_data import StageData

SENSORS = (
    Sensor("s047", AXIAL, np.deg2rad(47.0), 0.412),
    Sensor("s137", AXIAL, np.deg2rad(137.0), 0.412),
    Sensor("r040", RADIAL, np.deg2rad(40.0), 0.412),
)
LOAD = np.array([200e3, -150e3, 80e3])


def drawn(rng):
    """Stage of three planets, every quantity within its range."""
    return stage_at(rng.random(len(HIDDEN) + 3))


@pytest.fixture(scope="module")
def bodies(flexible_reduction, pin_reduction):
    return Bodies(flexible_reduction.model, pin_reduction.model, StageData())


@pytest.fixture(scope="module")
def stage():
    return drawn(np.random.default_rng(3))


def turn(bodies, stage, load=LOAD):
    model = stage.model(bodies)
    return model, loaded_turn(model, load_of(load, 1.22), SENSORS)


def test_a_body_between_its_corners_is_the_body_that_is_joined_anew(bodies):
    """Stiffness and load of a misalignment are linear in elasticity and pin fit."""
    for pin_fit, elasticity in ((3e6, 0.93), (9e7, 1.08)):
        body, anew = bodies.body(pin_fit, elasticity), bodies._joined(pin_fit, elasticity)
        assert_allclose(body.model.K, anew.model.K, atol=1e-12 * np.abs(anew.model.K).max())
        load = anew.misalignment_load
        assert_allclose(body.misalignment_load, load, atol=1e-12 * np.abs(load).max())


def test_pin_forces_hold_the_torque(bodies, stage):
    """Moment balance about the axis: ``a sum F_t = T``, whatever is hidden and at any angle."""
    _, loaded = turn(bodies, stage)
    assert_allclose(loaded.pins[:, 0].sum(axis=0) * 0.308, LOAD[0], rtol=1e-6)


def test_rotor_moment_is_that_of_the_radial_force():
    load = load_of(np.array([0.0, 100e3, 50e3]), 1.22)
    moment = np.cross([-1.22, 0.0, 0.0], [0.0, load.ntl_y, load.ntl_z])
    assert_allclose(moment, [0.0, 100e3, 50e3])


def test_a_pair_is_the_stage_under_both_loads(bodies):
    """Numbers of zero are the middle of every range; readings of the known load come first."""
    known = np.array([360e3, 0.0, 0.0])
    pair = StagePair(bodies, known, SENSORS, 360e3)
    z = np.zeros(pair.n_unknowns)
    z[-1] = 0.5
    load = np.array([0.675 * 360e3, 0.0, 80e3])
    assert_allclose(pair.load(z), load)
    middle = stage_at(np.full(bodies.n_hidden, 0.5))
    turns = [turn(bodies, middle, of)[1] for of in (known, load)]
    readings, loads = pair(z)
    assert_allclose(readings, np.concatenate([t.readings.ravel() for t in turns]))
    assert_allclose(loads[:3], load)
    assert_allclose(loads[5:], turns[1].pins.ravel())
    assert np.exp(loads[4]) == pytest.approx(HIDDEN["pin_fit"].at(0.5))
    tangential = turns[1].pins[:, 0]
    assert loads[3] == pytest.approx((3.0 * tangential / tangential.sum(axis=0)).max())
    alone = StagePair(bodies, known, SENSORS, 360e3, of_known=True)
    readings, loads = alone(z[: alone.n_unknowns])
    assert_allclose(readings, turns[0].readings.ravel())
    assert_allclose(loads[5:], turns[0].pins.ravel())


def test_draws_fill_their_ranges():
    rng = np.random.default_rng(0)
    values = np.array([list(drawn(rng).values.values()) for _ in range(400)])
    for column, hidden in zip(values.T, HIDDEN.values(), strict=True):
        assert hidden.lower <= column.min()
        assert column.max() <= hidden.upper
        middle = hidden.at(0.5)
        # 400 draws: half of them below the middle within four standard deviations.
        assert abs(np.mean(column < middle) - 0.5) < 0.1


def test_sun_and_clearances_span_what_is_not_published():
    assert (HIDDEN["sun_radial"].lower, HIDDEN["sun_radial"].upper) == (1e6, 3e9)
    assert HIDDEN["upwind_clearance"].upper == 0.25e-3  # 0.5 mm of diameter


def test_an_empty_range_is_refused():
    with pytest.raises(ValueError, match="expected lower < upper"):
        HiddenRange(1.0, 1.0, False, "")
    with pytest.raises(ValueError, match="both positive"):
        HiddenRange(0.0, 1.0, True, "")


def test_a_hidden_stage_names_all_ranges():
    assert set(stage_at(np.zeros(len(HIDDEN) + 4)).values) == set(HIDDEN)
    assert len(HiddenStage({}, (0.0, 0.0)).pin_offset) == 2
