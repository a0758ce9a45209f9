"""Drawn stages: equilibrium of the rotating body, and the recovery rows of another pin fit."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.simulation.carrier.run_cases import AXIAL, RADIAL, Sensor
from carrierflex.simulation.stage.hidden_stages import (
    HIDDEN,
    Bodies,
    HiddenRange,
    HiddenStage,
    StageEnsemble,
    drawn_ensemble,
    drawn_stage,
    load_of,
    loaded_turn,
    reading_per_force,
)
from carrierflex.simulation.stage.stage_data import StageData

SENSORS = (
    Sensor("s047", AXIAL, np.deg2rad(47.0), 0.412),
    Sensor("s137", AXIAL, np.deg2rad(137.0), 0.412),
    Sensor("r040", RADIAL, np.deg2rad(40.0), 0.412),
)
LOAD = np.array([200e3, -150e3, 80e3])


@pytest.fixture(scope="module")
def bodies(flexible_reduction, pin_reduction):
    return Bodies(flexible_reduction.model, pin_reduction.model, StageData())


@pytest.fixture(scope="module")
def stage():
    return drawn_stage(np.random.default_rng(3), 3)


def turn(bodies, stage, load=LOAD):
    model = stage.model(bodies)
    return model, loaded_turn(model, load_of(load, 1.22), SENSORS)


def test_pin_forces_hold_the_torque(bodies, stage):
    """Moment balance about the axis: ``a sum F_t = T``, whatever is hidden and at any angle."""
    _, loaded = turn(bodies, stage)
    assert_allclose(loaded.pins[:, 0].sum(axis=0) * 0.308, LOAD[0], rtol=1e-6)


def test_rotor_moment_is_that_of_the_radial_force():
    load = load_of(np.array([0.0, 100e3, 50e3]), 1.22)
    moment = np.cross([-1.22, 0.0, 0.0], [0.0, load.ntl_y, load.ntl_z])
    assert_allclose(moment, [0.0, 100e3, 50e3])


def test_recovery_rows_tell_another_pin_fit(bodies, stage):
    """Forces on the body hardly change with the pin fit, so its rows give what sensors read.

    Order 3 of another pin fit within 2 %, while it differs by a third itself.
    """
    soft = replace(stage, values={**stage.values, "pin_fit": 1e7, "sun_radial": 1e6})
    stiff = replace(soft, values={**soft.values, "pin_fit": 3e7})
    (soft_model, soft_turn), (stiff_model, stiff_turn) = turn(bodies, soft), turn(bodies, stiff)
    of_soft, of_stiff = (
        reading_per_force(model.layout.body, SENSORS, 12) for model in (soft_model, stiff_model)
    )
    moved = np.einsum("saf,af->sa", of_stiff - of_soft, soft_turn.forces)

    def order_3(readings):
        return np.fft.rfft(readings[:2], axis=1)[:, 3]

    told, solved = order_3(soft_turn.readings + moved), order_3(stiff_turn.readings)
    assert_allclose(told, solved, atol=0.02 * np.abs(solved).max())
    assert np.abs(order_3(soft_turn.readings) - solved).max() > 0.25 * np.abs(solved).max()


def test_rows_between_two_degrees_are_between_theirs(bodies, stage):
    body = stage.model(bodies).layout.body
    at = [
        reading_per_force(body, [Sensor("s", AXIAL, np.deg2rad(a), 0.412)], 12)
        for a in (359.0, 359.5, 360.0)
    ]
    assert_allclose(at[1], 0.5 * (at[0] + at[2]))


def test_ensemble_reads_what_the_stages_read(bodies):
    known = np.array([360e3, 0.0, 0.0])
    ensemble = drawn_ensemble(
        bodies, known, SENSORS, 3, nominal_torque=360e3, rng=np.random.default_rng(1)
    )
    first = drawn_stage(np.random.default_rng(1), 3)
    assert len(ensemble.loads) + ensemble.n_failed == 3
    model, loaded = turn(bodies, first, known)
    readings = ensemble.readings(reading_per_force(model.layout.body, SENSORS, 12))
    assert_allclose(readings[0, 0], loaded.readings, atol=1e-9)
    assert_allclose(ensemble.loads[:, 0], np.tile(known, (3, 1)))


def test_draws_fill_their_ranges():
    rng = np.random.default_rng(0)
    values = np.array([list(drawn_stage(rng, 3).values.values()) for _ in range(400)])
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
    assert set(drawn_stage(np.random.default_rng(0), 4).values) == set(HIDDEN)
    assert len(HiddenStage({}, (0.0, 0.0)).pin_offset) == 2


def test_a_stage_counted_from_its_next_pin_is_a_stage(bodies, stage):
    """Turned copies of readings, forces and pin loads are those of the stage solved anew."""
    known = np.array([360e3, 0.0, 0.0])
    loose = replace(stage, values={**stage.values, "kink_y": 8e-4, "kink_z": -3e-4})
    c, s = np.cos(2.0 * np.pi / 3.0), np.sin(2.0 * np.pi / 3.0)
    # The kink's axis as the paper counts it is an angle in the carrier's frame: it falls by a step.
    kink = {"kink_y": c * 8e-4 + s * -3e-4, "kink_z": c * -3e-4 - s * 8e-4}
    first, second, third = loose.pin_offset
    renamed = HiddenStage({**loose.values, **kink}, (second, third, first))

    def ensemble(of):
        model = of.model(bodies)
        A = reading_per_force(model.layout.body, SENSORS, 12)
        turns = [loaded_turn(model, load_of(load, 1.22), SENSORS) for load in (known, LOAD)]
        rest = [t.readings - np.einsum("saf,af->sa", A, t.forces) for t in turns]
        parts = ([known, LOAD], rest, [t.forces for t in turns], [t.pins for t in turns])
        return StageEnsemble(*(np.array([part]) for part in parts), n_failed=0)

    copies, solved = ensemble(loose).with_turned_copies(), ensemble(renamed)
    assert len(copies.loads) == 3
    assert_allclose(copies.pins[1], solved.pins[0], atol=1.0)  # N of 4e5
    assert_allclose(copies.rest[1], solved.rest[0], atol=1e-9)
    assert_allclose(copies.forces[1], solved.forces[0], atol=2.0)
    assert not np.allclose(copies.pins[1], copies.pins[0], atol=100.0)
