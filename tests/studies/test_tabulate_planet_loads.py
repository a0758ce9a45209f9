"""Simulated campaigns of hidden stages: their intervals against the truth and the linear bound."""

from dataclasses import fields, replace

import numpy as np
import pytest

from carrierflex.identification.carrier.planet_loads import (
    ReadingErrors,
    candidate_bodies,
    load_inference,
)
from carrierflex.simulation.stage.hidden_stages import (
    TURN_ANGLES,
    Bodies,
    StageEnsemble,
    drawn_ensemble,
)
from carrierflex.simulation.stage.stage_data import StageData
from studies import tabulate_planet_loads
from studies.tabulate_planet_loads import (
    KNOWN,
    LIMITS,
    NOMINAL,
    SENSORS,
    LoadsRow,
    loads_row,
    loads_table,
    torque_errors,
)


def row(**changes):
    values = {entry.name: 1.0 for entry in fields(LoadsRow)}
    return LoadsRow(**values | {"torque": 200e3, "pin_load": 200e3} | changes)


def test_the_table_counts_what_the_intervals_hold():
    """Two campaigns of which one torque is held; medians of half widths over load and bound."""
    rows = [
        row(torque_error=5e3, torque_half=6e3, pins_half=20e3, pins_bound=10e3, pins_held=1.0),
        row(torque_error=-7e3, torque_half=6e3, pins_half=20e3, pins_bound=20e3, pins_held=0.8),
    ]
    lines = loads_table(rows, 0.045, 0.02)
    told = dict(line.strip("| ").split(" | ") for line in lines[2:])
    assert told["95 % intervals of the pins' tangential forces hold"] == "90.0 %"
    assert told["those of torque, M_y, M_z"].startswith("50.0 %")
    assert told["median half width over a pin's load"] == "10.0 %"
    assert told["median half width over the linear bound"] == "1.5"
    assert told["torque within 3 % of itself"] == "50.0 %"
    assert told["torque within 3 % of the nominal one"] == "100.0 %"
    assert told["median error of the torque"] == "3.0 %"


def test_the_torques_limit_is_the_closed_form_of_linear_readings(monkeypatch):
    """Readings that follow torque and a hidden state: normal conditioning has a closed form."""
    rng, n = np.random.default_rng(2), 4000
    loads = rng.standard_normal((n, 2, 3)) * 50e3
    per_torque, per_state = 1e-6 * rng.standard_normal((2, 2 * len(SENSORS) * TURN_ANGLES)) / 50e3
    state = 20e3 * rng.standard_normal(n)
    rest = loads[:, 1, 0, None] * per_torque + state[:, None] * per_state
    rest = rest.reshape(n, 2, len(SENSORS), TURN_ANGLES)
    forces, pins = np.zeros((n, 2, TURN_ANGLES, 1)), np.zeros((n, 2, 3, 4, TURN_ANGLES))
    ensemble = StageEnsemble(loads, rest, forces, pins, 0)
    monkeypatch.setattr(
        tabulate_planet_loads,
        "reading_per_force",
        lambda *_: np.zeros((len(SENSORS), TURN_ANGLES, 1)),
    )
    limit = next(limit for limit in LIMITS if limit.errors == ReadingErrors())
    error, std = torque_errors(ensemble, None, limit)
    noise = 5e-6**2 * TURN_ANGLES / 2700 * np.ones((2, len(SENSORS), 1, 1)) * np.eye(TURN_ANGLES)
    R = limit.errors.covariance(SENSORS, rest.mean(axis=0), noise)
    R = R + 20e3**2 * np.outer(per_state, per_state)
    expected = 1.0 / np.sqrt(1.0 / 50e3**2 + per_torque @ np.linalg.solve(R, per_torque))
    assert np.sqrt((error**2).mean() + std**2) == pytest.approx(expected, rel=0.05)
    # A recorded moment that has nothing to do with the torque tells nothing of it.
    recorded = replace(limit, moment=1e3)
    other, _ = torque_errors(ensemble, None, recorded)
    assert np.sqrt((other**2).mean()) == pytest.approx(np.sqrt((error**2).mean()), rel=0.05)


@pytest.mark.long
def test_intervals_hold_and_are_no_wider_than_a_known_carrier_allows(
    flexible_reduction, pin_reduction
):
    """Twelve campaigns of one ensemble: few for 95 %, enough to see errors or intervals doubled."""
    bodies = Bodies(flexible_reduction.model, pin_reduction.model, StageData())
    ensemble = drawn_ensemble(
        bodies, KNOWN, SENSORS, 300, nominal_torque=NOMINAL, rng=np.random.default_rng(0)
    )
    ensemble = ensemble.with_turned_copies()
    inference = load_inference(ensemble, candidate_bodies(bodies), SENSORS)
    rows = [
        loads_row(bodies, ensemble, inference, np.random.default_rng([1, k])) for k in range(12)
    ]
    assert np.mean([r.pins_held for r in rows]) > 0.8
    assert np.median([r.pins_half / r.pins_bound for r in rows]) < 1.3
    assert np.mean([abs(r.torque_error) <= r.torque_half for r in rows]) > 0.7
    assert 0.5 < np.median([r.misfit for r in rows]) < 1.5
