"""Order, step independence, friction memory, energy and refusals of the mounting's integration."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.simulation.mounting.bushings import elasto_plastic_force
from carrierflex.simulation.mounting.energy import energy_balance
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.parameter_arrays import parameter_array
from carrierflex.simulation.mounting.rig import SENSORS, MountingRig
from carrierflex.simulation.mounting.simulate import simulate
from carrierflex.simulation.mounting.time_integration import (
    DivergedError,
    marched,
    mounting_model,
    state_at_rest,
)
from tests.simulation.mounting.mounting_runs import BUSHINGS, shaking_inputs

RIG = MountingRig(zeroing_samples=1)


def errors_of_steps(parameters, inputs, substeps):
    reference = simulate(RIG, parameters, inputs, step=inputs.step / (8 * substeps[-1])).signals
    runs = [simulate(RIG, parameters, inputs, step=inputs.step / n).signals for n in substeps]
    return [np.abs(run - reference).max() / np.abs(reference).max() for run in runs]


def order(parameters, inputs, substeps):
    errors = errors_of_steps(parameters, inputs, np.array(substeps))
    return -np.polyfit(np.log(substeps), np.log(errors), 1)[0]


def test_the_nonlinear_integrator_is_of_order_four():
    assert (
        3.7
        < order(parameter_array(RIG, BUSHINGS["nonlinear"]), shaking_inputs(1.0), [2, 4, 8, 16])
        < 4.3
    )


def test_the_order_falls_to_two_where_the_damping_is_stiff_and_recovers_where_steps_resolve_it():
    # Roots near -5e3 1/s: 10 ms is fifty of their time constants, 0.16 ms is one.
    parameters, inputs = (
        parameter_array(RIG, BUSHINGS["nonlinear, damping of the paper"]),
        shaking_inputs(0.8),
    )
    assert 1.7 < order(parameters, inputs, [1, 2, 4]) < 2.6
    assert 3.0 < order(parameters, inputs, [16, 32, 64]) < 4.3
    assert errors_of_steps(parameters, inputs, np.array([1, 64]))[0] < 1e-6


@pytest.mark.parametrize("name", BUSHINGS)
def test_the_chosen_step_holds_its_stated_error(name):
    inputs = shaking_inputs(2.0)
    parameters = parameter_array(RIG, BUSHINGS[name])
    chosen = simulate(RIG, parameters, inputs).signals
    converged = simulate(RIG, parameters, inputs, step=inputs.step / 64).signals
    assert_allclose(chosen, converged, rtol=0.0, atol=1e-4 * np.abs(converged).max())


def test_the_linear_model_is_exact_at_any_step_of_the_loads():
    for name in ("linear", "linear, damping of the paper"):
        parameters = parameter_array(RIG, {**BUSHINGS[name], "k": 4e7, "c": 5e6, "m": 16.2})
        inputs = shaking_inputs(2.0, rate=20.0)
        fine = simulate(RIG, parameters, inputs.refined(50)).signals
        assert_allclose(
            simulate(RIG, parameters, inputs).signals,
            fine[::50],
            rtol=0.0,
            atol=1e-9 * np.abs(fine).max(),
        )


def test_friction_remembers_the_turning_points_not_the_steps():
    path = 1e-3 * np.array([0.0, 9.0, 2.0, 5.0, -8.0, 1.0])
    coarse = fine = 0.0
    for before, after in pairwise(path):
        coarse = elasto_plastic_force(coarse, after - before, 8.29e6, 60.06e3)
        for _ in range(1000):
            fine = elasto_plastic_force(fine, (after - before) / 1000, 8.29e6, 60.06e3)
        assert_allclose(coarse, fine, rtol=1e-9)
    # The last stretch starts from -Fy at -8 mm and ends 9 mm above: it yields again, on the other
    # side.
    assert coarse == pytest.approx(min(-60.06e3 + 8.29e6 * 9e-3, 60.06e3))


def test_the_friction_state_of_a_run_does_not_depend_on_the_step():
    parameters = parameter_array(RIG, {**BUSHINGS["hydro-dynamic"], "Fy": 20e3})
    inputs = shaking_inputs(2.0)
    forces = []
    for n in (2, 16, 64):
        model = mounting_model(RIG, parameters, inputs.loads, inputs.step, step=inputs.step / n)
        _, end = marched(model, state_at_rest(model, inputs.loads[0]), inputs.loads)
        forces.append(np.concatenate([memory[0] for memory in end.memories]))
    assert np.abs(forces[2]).max() > 10e3
    assert_allclose(forces[0], forces[2], rtol=0.0, atol=1e-3 * 20e3)
    assert_allclose(forces[1], forces[2], rtol=0.0, atol=1e-4 * 20e3)


@pytest.mark.parametrize("name", ["linear", "nonlinear", "hydro-dynamic"])
def test_energy_balances_to_a_millionth_of_the_work(name):
    inputs = shaking_inputs(1.0).refined(20)
    balance = energy_balance(RIG, parameter_array(RIG, {**BUSHINGS[name], "c_x": 1e6}), inputs)
    assert balance.error < 1e-6
    assert balance.dissipated[-1] > 1e-3 * balance.work[-1]
    assert (np.diff(balance.dissipated) > -1e-9 * balance.work.max()).all()


@pytest.mark.long
def test_energy_balances_with_a_fluid_mass_and_damping_that_grows_with_deflection():
    values = {**BUSHINGS["hydro-dynamic"], "m": 16.2, "C3": 5e9, "starboard_excess": 0.1}
    balance = energy_balance(RIG, parameter_array(RIG, values), shaking_inputs(0.8).refined(20))
    assert balance.error < 1e-6


def test_a_step_too_large_is_refused_with_the_one_that_would_do():
    inputs = shaking_inputs(2.0, rate=20.0)
    parameters = parameter_array(RIG, BUSHINGS["nonlinear"])
    with pytest.raises(
        ValueError,
        match=r"step 0\.05 s is too large .* expected at most 0\.0\d+ s, 0\.00\d+ s for full",
    ):
        simulate(RIG, parameters, inputs, step=0.05)
    chosen, fine = (simulate(RIG, parameters, inputs, step=step).signals for step in (None, 2e-4))
    assert_allclose(chosen, fine, rtol=0.0, atol=1e-4 * np.abs(fine).max())
    with pytest.raises(ValueError, match="expected positive numbers"):
        simulate(RIG, parameters, inputs, step=0.0)


def test_a_softening_bushing_diverges_with_time_coordinate_and_the_signals_before():
    # Beyond 5.8 mm this law pushes outward: K1 u + K3 u³ turns at sqrt(K1 / (3 |K3|)).
    parameters = parameter_array(RIG, {"K3": -2e11, "C1": 1e5})
    inputs = shaking_inputs(2.0)
    still = replace(
        inputs, torque=0.0 * inputs.torque, ntl_y=0.0 * inputs.torque, ntl_z=0.0 * inputs.torque
    )
    gentle = 1e-4
    small = replace(
        inputs,
        torque=gentle * inputs.torque,
        ntl_y=gentle * inputs.ntl_y,
        ntl_z=gentle * inputs.ntl_z,
    )
    model = mounting_model(RIG, parameters, small.loads, small.step, step=1e-3)
    with pytest.raises(
        DivergedError, match=r"theta_\w.* after 0\.\d+ s; the signals up to there are kept"
    ) as caught:
        marched(model, state_at_rest(model, still.loads[0]), inputs.loads)
    error = caught.value
    assert 0.2 < error.time < 1.0
    assert error.coordinate in ("theta_x", "theta_y", "theta_z")
    assert len(error.signals) == error.samples == round(error.time / inputs.step) + 1
    assert np.isfinite(error.signals).all()
    assert np.abs(error.signals).max() > 1e-3


@pytest.mark.parametrize("name", ["linear", "nonlinear", "hydro-dynamic"])
def test_a_block_without_loads_rests_as_if_it_had_been_marched(name):
    inputs, parameters = shaking_inputs(1.0), parameter_array(RIG, {**BUSHINGS[name], "k_x": 2e6})
    vertical = replace(inputs, ntl_y=np.zeros_like(inputs.time))
    hardly = replace(inputs, ntl_y=np.full_like(inputs.time, 1e-9))
    signals = [simulate(RIG, parameters, loads).signals for loads in (vertical, hardly)]
    assert_allclose(signals[0], signals[1], rtol=0.0, atol=1e-15)
    # A load that has gone leaves motion behind: the block goes on.
    model = mounting_model(RIG, parameters, inputs.loads, inputs.step)
    _, moved = marched(model, state_at_rest(model, np.zeros(3)), inputs.loads)
    rest, _ = marched(model, moved, np.zeros((50, 3)))
    assert np.abs(np.diff(rest[1:, SENSORS.index("spy")])).max() > 1e-6


def test_the_block_that_diverges_first_is_told_and_both_have_come_as_far():
    # Soft bushings: the radial load in y throws the yaw out before the torque, which grows slowly,
    # does so with the roll.
    time = np.arange(401) / 100.0
    rest = np.zeros_like(time)
    torque, ntl_y = 9e4 * time / 4.0, 2e6 * np.clip(time - 1.0, 0.0, 1.0)
    for nonlinear in ({}, {"K3": 1.0}):
        law = parameter_array(RIG, {"K1": 2e5, "C1": 1e4, **nonlinear})
        with pytest.raises(DivergedError, match="theta_x") as of_roll:
            simulate(RIG, law, MountingInputs(time, torque, rest, rest, rest, rest))
        with pytest.raises(DivergedError, match="theta_z: diverged after") as of_both:
            simulate(RIG, law, MountingInputs(time, torque, rest, rest, ntl_y, rest))
        assert of_both.value.time < of_roll.value.time
        # Roll up to there is that of the run without the radial load.
        count = of_both.value.samples
        roll = [
            RIG.housing_motion(error.value.signals[:count])[:, 3] for error in (of_roll, of_both)
        ]
        assert_allclose(roll[1], roll[0], rtol=0.0, atol=1e-12)
        assert np.abs(roll[0][-1]) > 1e-2
        yaw = RIG.housing_motion(of_both.value.signals)[:, 5]
        assert 0.1 < np.abs(yaw[-1]) < 0.3
        late = np.where(time < of_roll.value.time - 0.1, 0.0, 1e5)
        with pytest.raises(DivergedError, match="theta_x: diverged after") as of_roll_again:
            simulate(RIG, law, MountingInputs(time, torque, rest, rest, late, rest))
        # Yaw would go on: its share ends where roll did.
        assert of_roll_again.value.time == of_roll.value.time
        assert np.abs(RIG.housing_motion(of_roll_again.value.signals)[-1, 5]) > 1e-3
        late[-1] = 1e9
        with pytest.raises(DivergedError, match="theta_x: diverged after") as with_yaw_later:
            simulate(RIG, law, MountingInputs(time, torque, rest, rest, late, rest))
        assert with_yaw_later.value.time == of_roll.value.time


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_loads_that_are_not_finite_are_refused_before_the_run(bad):
    inputs = shaking_inputs(1.0)
    torque = inputs.torque.copy()
    torque[30] = bad
    with pytest.raises(
        ValueError,
        match=r"inputs: torque is (nan|inf) at time 0\.3 s \(sample 30\); expected a finite",
    ):
        replace(inputs, torque=torque)


def test_impossible_rigs_and_parameters_are_refused_by_name():
    with pytest.raises(
        ValueError, match=r"parameter K1 is -2e.07 N/m; expected a value from 100000 to"
    ):
        parameter_array(RIG, {"K1": -20e6})
    with pytest.raises(ValueError, match="unknown parameter 'K2'; expected one of K1, C1"):
        parameter_array(RIG, {"K2": 1.0})
    with pytest.raises(
        ValueError, match=r"rig: bushing_radial_stiffness is -1.0; expected a positive number"
    ):
        MountingRig(bushing_radial_stiffness=-1.0)
    with pytest.raises(ValueError, match="rig: shaft_mass is nan; expected a number >= 0"):
        MountingRig(shaft_mass=float("nan"))
    time = np.array([0.0, 1.0, 0.5])
    with pytest.raises(
        ValueError, match=r"time is 0\.5 s at sample 2, not later than the one before"
    ):
        MountingInputs(time, *(np.zeros(3) for _ in range(5)))
