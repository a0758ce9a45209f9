"""Tables of measured laws in the bushings, against the built-in laws and another integrator."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from carrierflex.simulation.laws import APART, BOTH, MOUNTING, PORT, RADIAL, STARBOARD, Law, Table
from carrierflex.simulation.mounting.measured_laws.bushing_laws import (
    bushing_force,
    bushing_forces,
    packed_laws,
)
from carrierflex.simulation.mounting.parameter_arrays import parameter_array
from carrierflex.simulation.mounting.simulate import simulate
from carrierflex.simulation.mounting.time_integration import mounting_model, state_at_rest
from tests.simulation.mounting.test_user_force_law import K3, LINEAR, RIG, inputs

#: Largest deflection of the loads, and beyond.
ALONG = np.linspace(-8e-3, 8e-3, 4001)
SIZE = np.linspace(0.0, 8e-3, 2001)
HARD = 3e12


def law_of(*terms, effect_class="restoring_force"):
    return packed_laws([(Law("law", MOUNTING, effect_class, ("N", "m"), terms), 1.0)])


def cubic_of(bushing=BOTH):
    return Table(bushing, ALONG, K3 * ALONG**3, APART)


RADIAL_CUBIC = Table(BOTH, SIZE, HARD * SIZE**3, RADIAL)


@pytest.mark.long
def test_a_table_of_the_built_in_law_moves_as_it_does():
    by_table = simulate(
        RIG, parameter_array(RIG, LINEAR), inputs(), tables=law_of(cubic_of())
    ).signals
    built_in = simulate(RIG, parameter_array(RIG, {**LINEAR, "K3": K3}), inputs()).signals
    # Chords of 4 um over a cubic: an error of (4e-6)² f''/8 of the force, 1e-6 of it.
    assert_allclose(by_table, built_in, rtol=0.0, atol=2e-6 * np.abs(built_in).max())


def test_one_table_for_either_bushing_is_the_table_of_both():
    each = law_of(cubic_of(STARBOARD), cubic_of(PORT))
    u, v = np.random.default_rng(0).standard_normal((2, 2, 2, 50)) * 2e-3
    assert_allclose(
        bushing_forces(each, u, v, 1e-2), bushing_forces(law_of(cubic_of()), u, v, 1e-2)
    )
    alone = bushing_forces(law_of(cubic_of(PORT)), u, v, 1e-2)
    assert_allclose(alone[0], 0.0)
    assert np.abs(alone[1]).min() > 0.0


def test_a_radial_force_turns_with_its_deflection():
    tables = law_of(RADIAL_CUBIC)
    y, z = 1.2e-3, -0.7e-3
    force = [bushing_force(tables, 0, *pair, 0.0, 0.0) for pair in ((y, z), (z, y))]
    assert_allclose(force, HARD * (y**2 + z**2) * np.array([y, z]), rtol=1e-4)
    assert bushing_force(tables, 0, 0.0, 0.0, 0.0, 0.0) == 0.0


def test_damping_keeps_its_end_value_and_a_force_its_slope():
    line = Table(BOTH, np.array([-1.0, 0.0, 1.0]), np.array([-2.0, 0.0, 2.0]), APART)
    assert bushing_force(law_of(line), 0, 3.0, 0.0, 9.0, 0.0) == pytest.approx(6.0)
    speed = law_of(line, effect_class="dissipation")
    assert bushing_force(speed, 0, 9.0, 0.0, 3.0, 0.0) == pytest.approx(6.0)
    coupled = law_of(line, effect_class="coupled_damping")
    assert bushing_force(coupled, 0, 3.0, 0.0, 5.0, 0.0) == pytest.approx(10.0)


@pytest.mark.long
@pytest.mark.parametrize(
    "tables",
    [
        law_of(RADIAL_CUBIC),
        law_of(Table(PORT, SIZE, 1e8 * SIZE, RADIAL), effect_class="coupled_damping"),
        law_of(
            Table(BOTH, np.array([0.0, 5e-3, 5e-2]), np.array([0.0, 3e3, 1e4]), RADIAL),
            effect_class="dissipation",
        ),
    ],
)
def test_a_law_in_the_plane_moves_the_housing_as_another_integrator_says(tables):
    loads = inputs(seconds=3.0)
    parameters = parameter_array(RIG, LINEAR)
    signals = simulate(RIG, parameters, loads, step=5e-4, tables=tables).signals
    model = mounting_model(RIG, parameters, loads.loads, loads.step, tables=tables)
    state = state_at_rest(model, loads.loads[0])
    (block,) = model.blocks
    A, B, N = block.state_matrices()
    n_q = len(block.names)

    def slope(time, x):
        now = np.array([np.interp(time, loads.time, column) for column in loads.loads.T])
        u, v = block.rows @ x[:n_q], block.rows @ x[n_q : 2 * n_q]
        forces = [
            bushing_force(tables, e % 2, u[e], u[(e + 2) % 4], v[e], v[(e + 2) % 4])
            for e in range(4)
        ]
        return A @ x + B @ now + N @ np.array(forces)

    result = solve_ivp(
        slope,
        (0.0, 3.0),
        state.states[0],
        t_eval=loads.time,
        method="LSODA",
        rtol=1e-8,
        atol=1e-12,
        max_step=loads.step,
    )
    reference = (block.output @ result.y[:n_q]).T
    reference = reference - reference[0]
    # The table's corners cost the march its order; half a micrometre of seven millimetres.
    assert_allclose(signals, reference, rtol=0.0, atol=1e-4 * np.abs(reference).max())
    assert (
        np.abs(signals - simulate(RIG, parameters, loads).signals).max()
        > 20 * 1e-4 * np.abs(reference).max()
    )
