import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.simulation.laws import Law, Table
from carrierflex.simulation.mounting.equations import mounting_blocks
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.measured_laws.bushing_laws import packed_laws
from carrierflex.simulation.mounting.parameter_arrays import parameter_array
from carrierflex.simulation.mounting.parameters import INDEX
from carrierflex.simulation.mounting.rig import SENSORS, MountingRig
from carrierflex.simulation.mounting.simulate import simulate
from carrierflex.simulation.mounting.time_integration import mounting_model, state_at_rest
from tests.simulation.mounting.mounting_runs import BUSHINGS, shaking_inputs
from tests.simulation.mounting.scipy_reference import reference_signals

RIG = MountingRig(zeroing_samples=1)


def law_of(parameters):
    return {name: parameters[index] for name, index in INDEX.items()}


def slow_inputs(torque=0.0, ntl_y=0.0, ntl_z=0.0, duration=60.0):
    """Loads that grow over the record: its end is as good as static."""
    time = np.linspace(0.0, duration, 3001)
    grows = np.clip(time / (0.8 * duration), 0.0, 1.0)
    rest = np.zeros_like(time)
    return MountingInputs(time, torque * grows, rest, rest, ntl_y * grows, ntl_z * grows)


@pytest.mark.parametrize("name", ["linear", "nonlinear", "nonlinear, damping of the paper"])
def test_signals_equal_those_of_a_second_model_integrated_by_scipy(name):
    parameters = parameter_array(RIG, BUSHINGS[name])
    inputs = shaking_inputs(0.6)
    reference = reference_signals(
        RIG, law_of(parameters), inputs, rtol=1e-9 if name == "linear" else 1e-7
    )
    ours = simulate(RIG, parameters, inputs).signals
    assert np.abs(reference).max() > 2e-3
    # The linear model is exact, the nonlinear ones hold 1e-4 at the chosen step.
    tolerance = 1e-8 if name == "linear" else 1e-4
    assert_allclose(ours, reference, rtol=0.0, atol=tolerance * np.abs(reference).max())


@pytest.mark.long
def test_the_fluid_branch_and_damping_that_grows_with_deflection_equal_the_second_model():
    law = {"C1": 5e4, "k": 46.82e6, "c": 5.72e6, "K5": 1.2e15, "C3": 5e9}
    parameters = parameter_array(RIG, law)
    inputs = shaking_inputs(0.8)
    reference = reference_signals(RIG, law_of(parameters), inputs)
    ours = simulate(RIG, parameters, inputs, step=inputs.step / 4).signals
    assert_allclose(ours, reference, rtol=0.0, atol=1e-6 * np.abs(reference).max())


def test_static_roll_follows_the_torque_that_the_housing_carries():
    parameters = parameter_array(RIG, {"P_T": 0.1})
    d = RIG.housing_motion(
        simulate(RIG, parameters, slow_inputs(torque=100e3, ntl_z=-50e3)).signals
    )[-1]
    carried = (1.0 - 1.0 / 81.491) * (100e3 + 0.1 * -50e3)
    assert_allclose(d[3], carried / (2.0 * 20.2e6 * 0.75**2), rtol=1e-6)
    # The load acts upwind of the main bearing: pushing down there lifts the bushings, by the lever
    # rule.
    lift = 50e3 * 1.75 / 2.3 / (2.0 * 20.2e6)
    assert_allclose(d[2], lift, rtol=1e-6)
    assert_allclose(d[4], -lift / 2.3, rtol=1e-6)
    assert_allclose(d[[0, 1, 5]], 0.0, atol=1e-12)


def test_yaw_works_on_the_axial_stiffness_of_the_bushings():
    parameters = parameter_array(RIG, {"k_x": 4e7})
    d = RIG.housing_motion(simulate(RIG, parameters, slow_inputs(ntl_y=50e3)).signals)[-1]
    stiffness = 2.0 * 20.2e6 * 2.3**2 + 2.0 * 4e7 * 0.75**2
    assert_allclose(d[5], -1.75 * 50e3 / stiffness, rtol=1e-6)
    assert_allclose(d[1], 2.3 * d[5], rtol=1e-9)


def test_a_turned_radial_load_is_the_load_turned_about_x():
    angle = 0.3
    turned = simulate(
        RIG, parameter_array(RIG, {"ntl_angle": angle}), slow_inputs(ntl_y=50e3)
    ).signals
    plain = simulate(
        RIG,
        parameter_array(RIG),
        slow_inputs(ntl_y=50e3 * np.cos(angle), ntl_z=50e3 * np.sin(angle)),
    ).signals
    assert_allclose(turned, plain, rtol=0.0, atol=1e-12)


def test_unequal_bushings_turn_a_vertical_load_into_roll():
    excess = 0.2
    parameters = parameter_array(RIG, {"starboard_excess": excess})
    d = RIG.housing_motion(simulate(RIG, parameters, slow_inputs(ntl_z=-50e3)).signals)[-1]
    starboard, port = d[2] + 0.75 * d[3], d[2] - 0.75 * d[3]
    # No roll moment acts, so both bushings carry the same force; the stiffer one moves less.
    assert_allclose(starboard * (1.0 + excess), port * (1.0 - excess), rtol=1e-6)
    assert d[3] < 0.0


def test_a_compliant_main_bearing_adds_its_deflection_and_vanishes_when_stiff():
    load = slow_inputs(ntl_z=-50e3)
    d = RIG.housing_motion(
        simulate(RIG, parameter_array(RIG, {"main_bearing_compliance": 2e-9}), load).signals
    )[-1]
    rigid = RIG.housing_motion(simulate(RIG, parameter_array(RIG), load).signals)[-1]
    bearing = -50e3 * (1.0 + 1.75 / 2.3) * 2e-9
    # The bushings feel the same force; the housing tilts about them as the bearing gives way.
    assert_allclose(d[2], rigid[2], rtol=1e-5)
    assert_allclose(d[4] - rigid[4], bearing / 2.3, rtol=1e-5)
    almost = simulate(RIG, parameter_array(RIG, {"main_bearing_compliance": 1e-14}), load).signals
    assert_allclose(almost, simulate(RIG, parameter_array(RIG), load).signals, rtol=0.0, atol=1e-8)


def test_axial_motion_stays_zero_with_equal_bushings_and_follows_yaw_with_unequal_ones():
    rig = MountingRig(zeroing_samples=1, axial_motion=True)
    load = slow_inputs(ntl_y=50e3)
    equal = rig.housing_motion(simulate(rig, parameter_array(rig), load).signals)[-1]
    unequal = rig.housing_motion(
        simulate(rig, parameter_array(rig, {"starboard_excess": 0.2}), load).signals
    )[-1]
    assert_allclose(equal[0], 0.0, atol=1e-12)
    # The axial forces balance: 1.2 (d_x - R_x theta_z) + 0.8 (d_x + R_x theta_z) = 0.
    assert_allclose(unequal[0], 0.2 * 0.75 * unequal[5], rtol=1e-6)


def test_weight_loads_nonlinear_bushings_and_leaves_with_the_zero():
    inputs = shaking_inputs(1.0)
    linear = [
        simulate(RIG, parameter_array(RIG, {"gravity": g}), inputs).signals for g in (0.0, 9.81)
    ]
    assert_allclose(linear[0], linear[1], rtol=0.0, atol=1e-15)
    law = {"K3": 1e13}
    hard = [
        simulate(RIG, parameter_array(RIG, {**law, "gravity": g}), inputs).signals
        for g in (0.0, 9.81)
    ]
    assert np.abs(hard[0] - hard[1]).max() > 1e-5


def test_static_start_holds_still_under_constant_load():
    inputs = shaking_inputs(1.0)
    rest = MountingInputs(
        inputs.time, *(np.full_like(inputs.time, v) for v in (2e5, 0.0, 0.0, 3e4, -8e4))
    )
    for name in ("nonlinear", "hydro-dynamic"):
        signals = simulate(RIG, parameter_array(RIG, BUSHINGS[name]), rest).signals
        assert_allclose(signals, 0.0, atol=1e-11)
        model = mounting_model(RIG, parameter_array(RIG, BUSHINGS[name]), rest.loads, rest.step)
        assert np.abs(state_at_rest(model, rest.loads[0]).states[0][0]) > 1e-3


def test_sensor_errors_change_their_channel_alone():
    inputs = shaking_inputs(1.0)
    clean = simulate(RIG, parameter_array(RIG), inputs).signals
    wrong = simulate(
        RIG, parameter_array(RIG, {"gain_spz": 1.02, "zero_ssz": 1e-4}), inputs
    ).signals
    ssz, spz = SENSORS.index("ssz"), SENSORS.index("spz")
    assert_allclose(wrong[:, spz], 1.02 * clean[:, spz])
    assert_allclose(wrong[:, ssz], clean[:, ssz] + 1e-4)
    others = [i for i in range(6) if i not in (ssz, spz)]
    assert_allclose(wrong[:, others], clean[:, others], rtol=0.0, atol=0.0)
    late = simulate(RIG, parameter_array(RIG, {"delay": 0.05}), inputs).signals
    assert_allclose(late[5:], clean[:-5], rtol=0.0, atol=1e-15)


def test_sensor_matrix_reads_the_points_of_figure_5():
    rig = MountingRig()
    motion = np.array([1e-3, -2e-3, 3e-3, 4e-3, -5e-3, 6e-3])
    points = {
        "ssx": ([0.0, rig.R_z, rig.R_y], 0),
        "spx": ([0.0, -rig.R_z, rig.R_y], 0),
        "ssz": ([0.0, rig.R_x, 0.0], 2),
        "spz": ([0.0, -rig.R_x, 0.0], 2),
        "spy": ([-rig.R_yz, -rig.R_x, 0.0], 1),
        "sbx": ([0.0, 0.0, -rig.R_b], 0),
    }
    read = rig.sensor_matrix @ motion
    for row, sensor in enumerate(SENSORS):
        point, axis = points[sensor]
        assert_allclose(read[row], (motion[:3] + np.cross(motion[3:], point))[axis], rtol=1e-12)
    assert_allclose(rig.housing_motion(read[None])[0], motion, rtol=1e-12)


def test_mass_matrix_is_the_inertia_about_the_main_bearing():
    vertical, horizontal = mounting_blocks(
        RIG, parameter_array(RIG, {"main_bearing_compliance": 1e-9})
    )
    arms = np.array([0.25 + 2.3, -0.8 + 2.3, -1.75])
    masses = np.array([3310.0, 2692.0, 4100.0])
    assert_allclose(vertical.M[1, 1], 900.0 + masses @ arms**2)
    assert_allclose(vertical.M[2, 2], masses.sum())
    # Pitch upwards at the bushings is negative: kinetic energy couples it with the bearing's rise
    # by the first moment.
    assert_allclose([vertical.M[1, 2], horizontal.M[0, 1]], [-(masses @ arms), masses @ arms])


def test_inputs_on_an_uneven_grid_give_the_signals_at_their_own_times():
    even = shaking_inputs(1.0, rate=400.0)
    chosen = np.unique(np.concatenate([np.arange(0, 401, 3), np.arange(0, 401, 7)]))
    uneven = MountingInputs(*(values[chosen] for values in even.columns().values()))
    parameters = parameter_array(RIG, BUSHINGS["linear"])
    full, subset = (
        simulate(RIG, parameters, even).signals,
        simulate(RIG, parameters, uneven).signals,
    )
    # Loads and signals are taken as linear between samples 7.5 ms apart: each errs by h²/8 of the
    # second derivative.
    bend = np.abs(np.diff(full, 2, axis=0)).max() * 400.0**2
    assert_allclose(subset, full[chosen], rtol=0.0, atol=2.0 * 0.0075**2 / 8.0 * bend)
    assert 2.0 * 0.0075**2 / 8.0 * bend < 5e-3 * np.abs(full).max()


def test_free_play_of_the_bushings_adds_to_the_static_roll():
    """Within the play no spring acts: the roll begins with the play over the lever of a bushing."""
    play = 0.4e-3
    ends = np.array([-1.0, -play, play, 1.0])
    no_spring = Table("both", ends, -20.2e6 * np.clip(ends, -play, play), "apart")
    law = Law("play", "mounting", "restoring_force", ("N", "m"), (no_spring,))
    inputs = slow_inputs(torque=100e3)
    model = mounting_model(
        RIG, parameter_array(RIG), inputs.loads, inputs.step, tables=packed_laws([(law, 1.0)])
    )
    vertical = model.blocks[0]
    roll = vertical.static_solution(np.array([100e3, 0.0, 0.0]))[0][vertical.names.index("theta_x")]
    carried = (1.0 - 1.0 / 81.491) * 100e3
    assert_allclose(roll, carried / (2.0 * 20.2e6 * 0.75**2) + play / 0.75, rtol=1e-9)
