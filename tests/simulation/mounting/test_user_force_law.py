"""A user's force law in the bushings, against the built-in laws and another integrator."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from carrierflex.simulation.force_laws import ForceLaw, compiled_force, sum_of_laws
from carrierflex.simulation.mounting.equations import mounting_blocks
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.linearised import linearised_block
from carrierflex.simulation.mounting.parameter_arrays import parameter_array
from carrierflex.simulation.mounting.rig import MountingRig
from carrierflex.simulation.mounting.simulate import simulate
from carrierflex.simulation.mounting.time_integration import mounting_model, state_at_rest

RIG = MountingRig(zeroing_samples=1)
K3 = 6e11
K5 = 1.5e16
C3 = 2e11
LINEAR = {"K1": 18e6, "C1": 1e5}
HARDENING = compiled_force(lambda u, v, p: p[0] * u**3 + p[1] * u**5 + p[2] * u * u * v)
STOP = compiled_force(lambda u, v, p: p[0] * (max(u - p[1], 0.0) + min(u + p[1], 0.0)))


def inputs(*, seconds=20.0, step=0.01):
    time = step * np.arange(round(seconds / step) + 1)
    torque = 2e5 + 1e5 * np.sin(2.0 * np.pi * 0.9 * time)
    ntl_y = 6e4 * np.sin(2.0 * np.pi * 0.31 * time)
    ntl_z = -8e4 * np.cos(2.0 * np.pi * 0.23 * time)
    return MountingInputs(time, torque, np.zeros(time.size), np.zeros(time.size), ntl_y, ntl_z)


@pytest.mark.long
@pytest.mark.parametrize(
    "extra",
    [
        {},
        {"Kp": 8e6, "Fy": 1.5e4},
        {"k": 1e7, "c": 5e6, "gravity": 9.81},
    ],
)
def test_a_law_equal_to_the_built_in_ones_gives_their_motion(extra):
    law = ForceLaw(HARDENING, np.array([K3, K5, C3]))
    parameters = parameter_array(RIG, {**LINEAR, **extra})
    by_user_law = simulate(RIG, parameters, inputs(), step=1e-3, user_law=law).signals
    values = {**LINEAR, **extra, "K3": K3, "K5": K5, "C3": C3}
    built_in = simulate(RIG, parameter_array(RIG, values), inputs(), step=1e-3).signals
    # Both solve the same equations to the tolerance of the iteration, 1e-8.
    assert_allclose(by_user_law, built_in, rtol=0.0, atol=1e-7 * np.abs(built_in).max())


@pytest.mark.long
def test_a_stiff_law_that_needs_newtons_method_gives_the_motion_of_the_built_in_one():
    # At 4 ms the added stiffness turns by 2 rad a step: only Newton's method with the slopes of the
    # law gets to rounding.
    law = ForceLaw(HARDENING, np.array([40.0 * K3, 100.0 * K5, 0.0]))
    by_user_law = simulate(
        RIG, parameter_array(RIG, LINEAR), inputs(), step=4e-3, user_law=law
    ).signals
    values = {**LINEAR, "K3": 40.0 * K3, "K5": 100.0 * K5}
    built_in = simulate(RIG, parameter_array(RIG, values), inputs(), step=4e-3).signals
    assert_allclose(by_user_law, built_in, rtol=0.0, atol=1e-10 * np.abs(built_in).max())


@pytest.mark.long
def test_a_stop_moves_the_housing_as_another_integrator_says():
    stiffness, gap = 3e7, 0.8e-3
    loads = inputs(seconds=3.0)
    law = ForceLaw(STOP, np.array([stiffness, gap]))
    parameters = parameter_array(RIG, LINEAR)
    signals = simulate(RIG, parameters, loads, step=5e-4, user_law=law).signals
    blocks = mounting_blocks(RIG, parameters)
    model = mounting_model(RIG, parameters, loads.loads, loads.step, user_law=law)
    start = state_at_rest(model, loads.loads[0])
    expected = np.zeros_like(signals)
    for block, state in zip(blocks, start.states, strict=True):
        n = len(block.names)

        def rates(t, x, block=block, n=n):
            u = block.rows @ x[:n]
            stop = stiffness * np.sign(u) * np.maximum(np.abs(u) - gap, 0.0)
            force = block.G @ [np.interp(t, loads.time, column) for column in loads.loads.T]
            force -= block.K @ x[:n] + block.C @ x[n:] + block.rows.T @ (block.weights * stop)
            return np.concatenate([x[n:], np.linalg.solve(block.M, force)])

        solution = solve_ivp(
            rates,
            (0.0, 3.0),
            state,
            "DOP853",
            loads.time,
            rtol=1e-8,
            atol=1e-12,
            max_step=5e-3,
        )
        expected += solution.y[:n].T @ block.output.T
    expected -= expected[0]
    without = simulate(RIG, parameters, loads).signals
    assert np.abs(without - expected).max() > 0.1 * np.abs(expected).max()
    # A kink costs the parabola through a step its order: 5e-4 s leave 1e-5 of the motion.
    assert_allclose(signals, expected, rtol=0.0, atol=3e-5 * np.abs(expected).max())


def test_laws_add_up():
    single = [ForceLaw(HARDENING, np.array([K3, 0.0, 0.0])), ForceLaw(STOP, np.array([1e7, 1e-3]))]
    single.append(ForceLaw(HARDENING, np.array([0.0, 0.0, C3])))
    total = sum_of_laws(tuple(single))
    assert_allclose(total.parameters, [K3, 0.0, 0.0, 1e7, 1e-3, 0.0, 0.0, C3])
    u, v = 2e-3, -0.05
    expected = sum(law.force(u, v, law.parameters) for law in single)
    assert_allclose(total.force(u, v, total.parameters), expected, rtol=1e-14)
    assert sum_of_laws(()) is None


def test_small_motions_know_the_slopes_of_the_law():
    law = ForceLaw(HARDENING, np.array([K3, K5, C3]))
    load = np.array([3e5, 5e4, -1e5])
    built_in = mounting_blocks(RIG, parameter_array(RIG, {**LINEAR, "K3": K3, "K5": K5, "C3": C3}))
    by_user_law = mounting_blocks(RIG, parameter_array(RIG, LINEAR), law)
    for expected, block in zip(built_in, by_user_law, strict=True):
        linear = linearised_block(block, load)
        assert linear.is_linear
        # Central differences with a step of 1e-5 of the deflection.
        assert_allclose(linear.K, linearised_block(expected, load).K, rtol=1e-8)
        assert_allclose(linear.C, linearised_block(expected, load).C, rtol=1e-8)
