"""Roots, frequency response, Campbell diagram of the mounting against the runs they stand for."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.simulation.mounting.equations import mounting_blocks
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.linearised import (
    campbell_diagram,
    frequency_response,
    mounting_modes,
    mounting_state_space,
)
from carrierflex.simulation.mounting.parameter_arrays import parameter_array
from carrierflex.simulation.mounting.parameters import INDEX
from carrierflex.simulation.mounting.rig import SENSORS, MountingRig
from carrierflex.simulation.mounting.simulate import simulate
from carrierflex.simulation.mounting.view import linearised_figure
from carrierflex.simulation.stage.linearised import CampbellDiagram
from tests.simulation.mounting.mounting_runs import BUSHINGS
from tests.simulation.mounting.scipy_reference import rates

RIG = MountingRig(zeroing_samples=1)
LOADED = np.array([200e3, 0.0, 0.0])


def steady_inputs(loads, seconds, rate):
    """Loads that stay."""
    time = np.arange(round(seconds * rate) + 1) / rate
    rest = np.zeros_like(time)
    return MountingInputs(
        time, np.full_like(time, loads[0]), rest, rest, rest + loads[1], rest + loads[2]
    )


def roots_of_decay(signal, order, step):
    """Roots of a free decay by linear prediction.

    ``y_{n+p} = -a_0 y_n - … - a_{p-1} y_{n+p-1}``.
    """
    rows = np.lib.stride_tricks.sliding_window_view(signal, order + 1)
    coefficients = np.linalg.lstsq(rows[:, :order], rows[:, order], rcond=None)[0]
    return np.log(np.roots([1.0, *-coefficients[::-1]]).astype(complex)) / step


@pytest.mark.parametrize(
    ("name", "n_roots"),
    [("linear", 2), ("nonlinear", 2), ("nonlinear, damping of the paper", 1), ("hydro-dynamic", 3)],
)
def test_a_small_free_decay_about_a_torque_has_the_roots_of_the_roll(name, n_roots):
    parameters = parameter_array(RIG, BUSHINGS[name])
    # Torque alone bends both bushings alike, so that roll stays apart from pitch. It begins
    # slightly off its value.
    rate = 2000.0
    inputs = steady_inputs(LOADED, 0.6, rate)
    torque = inputs.torque.copy()
    torque[0] += 5.0
    roll = RIG.housing_motion(simulate(RIG, parameters, replace(inputs, torque=torque)).signals)[
        :, 3
    ]
    # Differences of the samples decay alike and do not know the resting place; the stiff root is
    # gone after two samples.
    result = roots_of_decay(np.diff(roll)[4:], n_roots, 1.0 / rate)
    modes = mounting_modes(RIG, parameters, LOADED)
    of_roll = [
        root
        for root in modes.roots
        if abs(root) < rate and np.abs(result / root - 1.0).min() < 1e-3
    ]
    assert len(of_roll) == (n_roots if n_roots < 2 else n_roots - 1), (result, modes.roots)


@pytest.mark.parametrize("name", ["linear", "nonlinear", "hydro-dynamic"])
def test_roots_are_those_of_the_second_model_by_differences(name):
    law = {**BUSHINGS[name], "C3": 2e9, "K1": 15e6}
    friction = law.pop("Kp", 0.0), law.pop("Fy", 0.0)  # the second model has none
    assert name == "hydro-dynamic" or friction == (0.0, 0.0)
    parameters = parameter_array(RIG, law)
    loads = np.array([150e3, 40e3, -90e3])
    values = {key: parameters[index] for key, index in INDEX.items()}
    vertical, horizontal = mounting_blocks(RIG, parameters)
    y = np.zeros(10)
    y[:2], y[2] = vertical.static_solution(loads)[0], horizontal.static_solution(loads)[0][0]
    A = np.zeros((10, 10))
    for column in range(10):
        ends = []
        for sign in (1.0, -1.0):
            moved = y.copy()
            moved[column] += sign * 1e-7
            ends.append(rates(RIG, values, 0.0, moved, lambda t: loads))
        A[:, column] = (ends[0] - ends[1]) / 2e-7
    if name != "hydro-dynamic":
        A = A[:6, :6]  # no fluid states
    expected = np.linalg.eigvals(A)
    for root in mounting_modes(RIG, parameters, loads).roots:
        assert np.abs(expected - root).min() < 1e-4 * abs(root)


def test_a_torque_stiffens_nonlinear_bushings_alone():
    nonlinear, linear = (parameter_array(RIG, BUSHINGS[name]) for name in ("nonlinear", "linear"))
    torques = (0.0, 80e3, 360e3)
    rising = [
        mounting_modes(RIG, nonlinear, np.array([T, 0.0, 0.0])).frequency_hz[-1] for T in torques
    ]
    still = [mounting_modes(RIG, linear, np.array([T, 0.0, 0.0])).frequency_hz[-1] for T in torques]
    assert rising[0] < 0.97 * rising[1] < 0.7 * rising[2]
    assert_allclose(still, still[0], rtol=1e-12)
    # Undamped roll of two linear bushings: 2 K1 R_x² over the housing's inertia.
    bare = mounting_modes(RIG, parameter_array(RIG, {"C1": 0.0, "c_x": 0.0}), np.zeros(3))
    assert_allclose(
        bare.frequency_hz[-1], np.sqrt(2.0 * 20.2e6 * 0.75**2 / 1000.0) / (2.0 * np.pi), rtol=1e-9
    )
    assert_allclose(bare.damping_ratio, 0.0, atol=1e-9)
    assert bare.leading_coordinates()[-1] == "theta_x"
    damped = mounting_modes(RIG, linear, np.zeros(3))
    assert_allclose(
        damped.damping_ratio[-1],
        1e5 * 0.75**2 / np.sqrt(2.0 * 20.2e6 * 0.75**2 * 1000.0),
        rtol=1e-9,
    )


def test_the_papers_damping_makes_every_mode_creep():
    modes = mounting_modes(
        RIG, parameter_array(RIG, BUSHINGS["linear, damping of the paper"]), np.zeros(3)
    )
    assert not modes.frequency_hz.any()
    assert_allclose(modes.damping_ratio, 1.0)
    # Slow root K1 / C1 of a bushing without mass.
    assert_allclose(modes.roots[0].real, -20.2e6 / 4.83e6, rtol=2e-3)
    assert modes.stable


@pytest.mark.parametrize("name", ["linear", "nonlinear", "hydro-dynamic"])
@pytest.mark.parametrize("load", [0, 2])
def test_frequency_response_is_that_of_a_simulated_sine(name, load):
    parameters = parameter_array(RIG, {**BUSHINGS[name], "gain_spz": 1.1, "P_T": 0.1})
    loads = np.array([200e3, 20e3, -60e3])
    frequency = 8.0
    periods = 40
    per_period = 200
    inputs = steady_inputs(loads, periods / frequency, frequency * per_period)
    size = np.array([50.0, 20.0, 20.0])[load]
    column = ("torque", "ntl_y", "ntl_z")[load]
    sine = size * np.sin(2.0 * np.pi * frequency * inputs.time)
    signals = simulate(
        RIG, parameters, replace(inputs, **{column: getattr(inputs, column) + sine})
    ).signals
    window = slice(-4 * per_period - 1, -1)
    wave = np.exp(-2j * np.pi * frequency * inputs.time[window]) * 2j / (4 * per_period)
    rest = simulate(RIG, parameters, inputs).signals
    result = wave @ (signals - rest)[window] / size
    expected = frequency_response(RIG, parameters, loads, np.array([frequency]))[0, :, load]
    responds = np.abs(expected) > 1e-3 * np.abs(expected).max()
    assert responds.sum() >= 2
    assert_allclose(result[responds], expected[responds], rtol=1e-3)
    assert_allclose(result[~responds], 0.0, atol=1e-3 * np.abs(expected).max())


def test_a_force_that_hardly_changes_meets_the_static_answer_and_a_late_sensor_lags():
    parameters = parameter_array(RIG, BUSHINGS["nonlinear"])
    step = np.array([50.0, 0.0, 0.0])
    vertical, _ = mounting_blocks(RIG, parameters)
    moved = vertical.static_solution(LOADED + step)[0] - vertical.static_solution(LOADED - step)[0]
    response = frequency_response(RIG, parameters, LOADED, np.array([0.0]))[0, :, 0]
    assert_allclose(response.real, vertical.output @ moved / 100.0, rtol=1e-5, atol=1e-14)
    late = parameter_array(RIG, {**BUSHINGS["nonlinear"], "delay": 0.02})
    pair = [
        frequency_response(RIG, p, LOADED, np.array([5.0]))[0, 2, 0] for p in (parameters, late)
    ]
    assert_allclose(np.angle(pair[1] / pair[0]), -2.0 * np.pi * 5.0 * 0.02, rtol=1e-12)
    assert SENSORS[2] == "ssz"


def test_the_gyroscopic_moment_splits_pitch_and_yaw_and_leaves_roll():
    # Pitch and yaw alike: no axial stiffness, no damping.
    parameters = parameter_array(RIG, {"k_x": 0.0, "c_x": 0.0, "C1": 0.0})
    spin, speeds = 4e6, np.array([0.0, 1.0, 2.0])
    diagram = campbell_diagram(RIG, parameters, np.zeros(3), speeds, polar_inertia=spin)
    vertical, _ = mounting_blocks(RIG, parameters)
    inertia, alone = vertical.M[1, 1], np.sqrt(vertical.K[1, 1] / vertical.M[1, 1])
    half = 0.5 * spin * speeds / inertia
    whirl = np.stack(
        [np.sqrt(alone**2 + half**2) - half, np.sqrt(alone**2 + half**2) + half], axis=1
    )
    roll = np.full(3, np.sqrt(vertical.K[0, 0] / vertical.M[0, 0]))
    expected = np.sort(np.column_stack([whirl, roll]), axis=1) / (2.0 * np.pi)
    assert_allclose(diagram.frequency_hz, expected, rtol=1e-7)
    forward = mounting_modes(RIG, parameters, np.zeros(3), speed=2.0, polar_inertia=spin)
    # Of the faster whirl the tip of the shaft runs with the spin: (y, z) = (theta_z, -theta_y), so
    # theta_z leads.
    names = forward.names
    fastest = forward.shape[:, np.abs(forward.frequency_hz - expected[2].max()).argmin()]
    lag = np.angle(fastest[names.index("theta_z")] / -fastest[names.index("theta_y")])
    assert_allclose(lag, np.pi / 2.0, atol=1e-6)


def test_the_shaft_at_rated_speed_hardly_turns_a_mode():
    diagram = campbell_diagram(RIG, parameter_array(RIG), np.zeros(3), [0.0, 2.3143, 4.0])
    assert 0.0 < np.abs(diagram.frequency_hz[1] / diagram.frequency_hz[0] - 1.0).max() < 1e-6
    assert_allclose(diagram.order_hz["mesh"][1], 36.465, rtol=1e-4)
    assert_allclose(diagram.order_hz["3P"], 3.0 * diagram.speed / (2.0 * np.pi))
    # The mesh meets the roll where 99 times the speed is its frequency.
    assert_allclose(
        diagram.crossings("mesh") * 99 / (2.0 * np.pi), diagram.frequency_hz[0], rtol=1e-5
    )


def test_a_bushing_that_softens_under_its_load_has_a_root_that_grows():
    # Beyond sqrt(K1 / (3 |K3|)) = 5.8 mm this law pushes outward.
    softening = parameter_array(RIG, {"K3": -2e11, "C1": 1e5})
    assert mounting_modes(RIG, softening, np.array([50e3, 0.0, 0.0])).stable
    beyond = mounting_modes(RIG, softening, np.array([400e3, 0.0, 0.0]))
    assert not beyond.stable
    assert beyond.roots.real.max() > 1.0


def test_operating_points_and_frequencies_that_make_no_sense_are_refused():
    parameters = parameter_array(RIG)
    with pytest.raises(
        ValueError, match=r"operating point: .*nan.*; expected three finite numbers"
    ):
        mounting_modes(RIG, parameters, np.array([np.nan, 0.0, 0.0]))
    with pytest.raises(ValueError, match=r"smallest frequency is -1\.0 Hz; expected numbers >= 0"):
        frequency_response(RIG, parameters, np.zeros(3), np.array([-1.0, 2.0]))
    wrong = parameters.copy()
    wrong[INDEX["K1"]] = -1.0
    with pytest.raises(ValueError, match="parameter K1 is -1 N/m"):
        mounting_modes(RIG, wrong, np.zeros(3))


@pytest.mark.parametrize("name", ["linear", "nonlinear", "hydro-dynamic"])
def test_the_state_space_has_the_roots_and_the_response_of_the_model(name):
    parameters = parameter_array(RIG, BUSHINGS[name])
    parameters[INDEX["gain_ssz"]] = 1.07
    loads = np.array([200e3, 10e3, -50e3])
    system = mounting_state_space(RIG, parameters, loads)
    roots = mounting_modes(RIG, parameters, loads).roots
    result = np.linalg.eigvals(system.A)
    for root in roots:
        assert np.abs(result - root).min() < 1e-10 * abs(root)
    assert len(result) == sum(1 if root.imag == 0.0 else 2 for root in roots)
    hz = np.geomspace(0.1, 100.0, 7)
    expected = frequency_response(RIG, parameters, loads, hz)
    H = system.frequency_response(hz)
    assert_allclose(H, expected, rtol=1e-8, atol=1e-12 * np.abs(expected).max())
    assert system.outputs.names == SENSORS
    assert system.inputs.units == ("N m", "N", "N")
    assert len(set(system.states.names)) == len(system.A)


def test_a_delay_of_the_sensors_is_refused_as_a_state_space():
    parameters = parameter_array(RIG)
    parameters[INDEX["delay"]] = 0.004
    with pytest.raises(ValueError, match=r"delay of 0\.004 s.*expected delay = 0 in \[truth\]"):
        mounting_state_space(RIG, parameters, LOADED)


def test_modes_and_orders_of_the_campbell_diagram_are_named():
    speed = np.array([1.0, 2.0])
    diagram = CampbellDiagram(speed, np.array([[3.0, 5.0]] * 2), {"1P": speed / (2.0 * np.pi)})
    amplitude = np.ones((2, len(SENSORS), 3), dtype=complex)
    figure = linearised_figure(
        title="case", frequency_hz=speed, response=amplitude, campbell=diagram, sensors=SENSORS
    )
    labels = [text.get_text() for text in figure.axes[3].get_legend().get_texts()]
    assert labels == ["modes", "1P"]
