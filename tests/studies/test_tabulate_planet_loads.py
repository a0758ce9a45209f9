"""Simulated campaigns of hidden stages: their intervals against the truth and the bound."""

from dataclasses import fields
from types import SimpleNamespace

import numpy as np
import pytest

from carrierflex.identification.carrier.planet_loads import ReadingErrors
from carrierflex.simulation.stage.hidden_stages import (
    HIDDEN,
    TURN_ANGLES,
    Bodies,
    LoadedTurn,
    drawn_load,
)
from carrierflex.simulation.stage.stage_data import StageData
from studies import tabulate_planet_loads
from studies.tabulate_planet_loads import (
    KNOWN,
    NOMINAL,
    SENSORS,
    LoadsRow,
    bound_at,
    loads_row,
    loads_table,
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
    table = dict(line.strip("| ").split(" | ") for line in lines[2:])
    assert table["95 % intervals of the pins' tangential forces hold"] == "90.0 %"
    assert table["those of torque, M_y, M_z"].startswith("50.0 %")
    assert table["median half width over a pin's load"] == "10.0 %"
    assert table["median half width over the bound"] == "1.5"
    assert table["torque within 3 % of itself"] == "50.0 %"
    assert table["torque within 3 % of the nominal one"] == "100.0 %"
    assert table["median error of the torque"] == "3.0 %"


def test_the_bound_is_the_closed_form_of_linear_readings(monkeypatch):
    """Readings and pin forces that follow the stage's shares and the load by known matrices."""
    rng, n, shape = np.random.default_rng(2), len(HIDDEN) + 3, (len(SENSORS), TURN_ANGLES)
    A, B = 20e-6 * rng.standard_normal((*shape, n)), 1e-10 * rng.standard_normal((*shape, 3))
    C, D = 1e3 * rng.standard_normal((3, TURN_ANGLES, n)), rng.standard_normal((3, TURN_ANGLES, 3))

    def loaded_turn(shares, load, _sensors):
        pins = np.repeat((1e5 + C @ shares + D @ load)[:, None], 4, axis=1)
        return LoadedTurn(A @ shares + B @ load, pins)

    monkeypatch.setattr(tabulate_planet_loads, "loaded_turn", loaded_turn)
    monkeypatch.setattr(tabulate_planet_loads, "load_of", lambda load, _arm: load)
    monkeypatch.setattr(
        tabulate_planet_loads,
        "stage_at",
        lambda shares: SimpleNamespace(model=lambda _bodies: shares),
    )
    bodies = Bodies(None, None, StageData())
    bound = bound_at(bodies, 1, 0)
    # The same draw again.
    draw = np.random.default_rng([1, 2, 0])
    shares, load = draw.random(n), drawn_load(draw, NOMINAL)
    readings = np.array([A @ shares + B @ of for of in (load, KNOWN)])
    noise = 5e-6**2 * TURN_ANGLES / 2700 * np.ones((2, len(SENSORS), 1, 1)) * np.eye(TURN_ANGLES)
    R = ReadingErrors().covariance(SENSORS, readings, noise)
    J = np.concatenate([np.dstack([A, B]), np.dstack([A, np.zeros_like(B)])]).reshape(len(R), -1)
    spread = [1.05 * NOMINAL, 0.0, 0.0] + np.array([0.0, 320e3, 320e3]) * np.sqrt(3.0)
    prior = np.concatenate([np.full(n, 1.0), spread]) ** 2 / 12.0
    P = np.linalg.inv(J.T @ np.linalg.solve(R, J) + np.diag(1.0 / prior))
    assert bound.torque == load[0]
    assert bound.torque_stds[0] == pytest.approx(np.sqrt(P[n, n]), rel=1e-4)
    assert bound.moment_stds[0] == pytest.approx(np.sqrt(np.diag(P)[n + 1 :]).mean(), rel=1e-4)
    Q = np.dstack([C, D])
    pins = np.sqrt(np.einsum("paj,jk,pak->pa", Q, P, Q)).mean()
    assert bound.pin_stds[0] == pytest.approx(pins / (1e5 + C @ shares + D @ load).mean(), rel=1e-4)
    # A second known load tells more, and an error that is gone as well.
    assert (np.array(bound.torque_stds[1:]) <= bound.torque_stds[0] * (1.0 + 1e-6)).all()


@pytest.mark.acceptance
def test_intervals_hold_and_are_near_the_bound(flexible_reduction, pin_reduction):
    """Four campaigns: few for 95 %, enough to see errors or intervals doubled."""
    bodies = Bodies(flexible_reduction.model, pin_reduction.model, StageData())
    rows = [loads_row(bodies, bodies, 800, np.random.default_rng([1, k])) for k in range(4)]
    assert np.mean([r.pins_held for r in rows]) > 0.8
    assert np.median([r.pins_half / r.pins_bound for r in rows]) < 2.0
    assert np.mean([abs(r.torque_error) <= r.torque_half for r in rows]) > 0.7
    assert 0.5 < np.median([r.misfit for r in rows]) < 1.5
