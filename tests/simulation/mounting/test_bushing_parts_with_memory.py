"""Stops and branches of the bushings, against the built-in laws and another integrator."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.simulation.laws import (
    APART,
    BOTH,
    MOUNTING,
    PORT,
    RADIAL,
    SMOOTH,
    STARBOARD,
    Branch,
    Law,
    Stop,
)
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.measured_laws.bushing_laws import bushing_forces, packed_laws
from carrierflex.simulation.mounting.parameter_arrays import parameter_array
from carrierflex.simulation.mounting.simulate import simulate
from carrierflex.simulation.mounting.time_integration import (
    first_signals,
    marched,
    mounting_model,
    state_at_rest,
)
from tests.simulation.mounting.test_user_force_law import LINEAR, RIG

SLIP, YIELD = 1e4, 5e-4


def laws_of(*terms, size=1.0):
    return packed_laws([(Law("law", MOUNTING, "hysteresis", ("N", "m"), terms), size)])


def from_rest(*, seconds=20.0, step=0.01):
    """Loads that begin at zero, where parts are relaxed and so are the built-in laws."""
    time = step * np.arange(round(seconds / step) + 1)
    rise = np.minimum(time / 2.0, 1.0)
    torque = rise * (2e5 + 1e5 * np.sin(2.0 * np.pi * 0.9 * time))
    ntl_y = rise * 6e4 * np.sin(2.0 * np.pi * 0.31 * time)
    ntl_z = -rise * 8e4 * np.cos(2.0 * np.pi * 0.23 * time)
    return MountingInputs(time, torque, 0.0 * time, 0.0 * time, ntl_y, ntl_z)


@pytest.mark.long
@pytest.mark.parametrize(
    ("built_in", "term", "tolerance"),
    [
        pytest.param(
            {"Kp": SLIP / YIELD, "Fy": SLIP},
            Stop(BOTH, YIELD, SLIP, APART),
            1e-10,
            marks=pytest.mark.long,
        ),
        # Steps differ: the built-in branch is a linear state.
        ({"k": 1e7, "c": 5e6}, Branch(BOTH, 0.5, 1e7), 1e-6),
    ],
)
def test_a_part_moves_the_housing_as_its_built_in_law_does(built_in, term, tolerance):
    by_term = simulate(
        RIG, parameter_array(RIG, LINEAR), from_rest(), step=2e-3, tables=laws_of(term)
    ).signals
    reference = simulate(
        RIG, parameter_array(RIG, {**LINEAR, **built_in}), from_rest(), step=2e-3
    ).signals
    largest = np.abs(reference).max()
    assert_allclose(by_term, reference, rtol=0.0, atol=tolerance * largest)
    bare = simulate(RIG, parameter_array(RIG, LINEAR), from_rest()).signals
    assert np.abs(bare - reference).max() > 0.02 * largest


@pytest.mark.long
@pytest.mark.parametrize(("step", "tolerance"), [(1e-3, 1e-5), (4e-3, 1e-4)])
def test_stiff_parts_move_alike_at_long_steps(step, tolerance):
    # 400 MN/m and more beside 18: the longest steps that are taken turn by 3 rad.
    laws = laws_of(Stop(BOTH, 2e-3, 8e5, RADIAL), Branch(PORT, 0.2, 3e8))
    parameters = parameter_array(RIG, LINEAR)
    coarse = simulate(RIG, parameters, from_rest(seconds=4.0), step=step, tables=laws).signals
    fine = simulate(RIG, parameters, from_rest(seconds=4.0), step=2.5e-4, tables=laws).signals
    assert_allclose(coarse, fine, rtol=0.0, atol=tolerance * np.abs(fine).max())


@pytest.mark.long
def test_a_record_in_pieces_is_the_whole_record():
    laws = laws_of(
        Stop(STARBOARD, YIELD, SLIP, RADIAL),
        Stop(PORT, YIELD, SLIP, SMOOTH),
        Branch(BOTH, 0.3, 1e7),
    )
    inputs = from_rest()
    model = mounting_model(
        RIG, parameter_array(RIG, LINEAR), inputs.loads, inputs.step, tables=laws
    )
    state = state_at_rest(model, inputs.loads[0])
    at_once, _ = marched(model, state, inputs.loads)
    first, middle = marched(model, state, inputs.loads[:801])
    second, _ = marched(model, middle, inputs.loads[800:])
    assert_allclose(np.concatenate([first, second[1:]]), at_once, rtol=0.0, atol=1e-15)
    # The state that the march began with is as it was.
    assert_allclose(marched(model, state, inputs.loads)[0], at_once, rtol=0.0, atol=0.0)
    assert first_signals(model, middle) == pytest.approx(first[-1])


def test_a_radial_stop_slips_in_the_direction_of_the_motion():
    """Round and round at twice its yield deflection: the force lags by a constant angle."""
    angle = np.linspace(0.0, 8.0 * np.pi, 40_001)
    circle = 2.0 * YIELD * np.array([np.cos(angle), np.sin(angle)])
    u = np.stack([circle, np.zeros_like(circle)])
    force = bushing_forces(laws_of(Stop(BOTH, YIELD, SLIP, RADIAL)), u, 0.0 * u, 1e-3)
    late = slice(30_000, None)
    assert_allclose(np.hypot(*force[0])[late], SLIP, rtol=1e-9)
    # A tractrix about a circle of radius R = 2 r: in the steady state the stop's end goes along its
    # own direction round a smaller circle, to which it is tangent, so that its component along the
    # radius of the large one is r r / R.
    along = force[0][:, late] * np.array([np.cos(angle), np.sin(angle)])[:, late]
    assert_allclose(along.sum(axis=0), SLIP * YIELD / (2.0 * YIELD), rtol=1e-3)
    assert_allclose(force[1], 0.0)


def test_a_radial_stop_in_one_direction_is_one_that_acts_apart():
    u = np.zeros((2, 2, 400))
    u[:, 1] = 3.0 * YIELD * np.sin(np.linspace(0.0, 12.0, 400))
    radial = bushing_forces(laws_of(Stop(BOTH, YIELD, SLIP, RADIAL)), u, 0.0 * u, 1e-3)
    apart = bushing_forces(laws_of(Stop(BOTH, YIELD, SLIP, APART)), u, 0.0 * u, 1e-3)
    assert_allclose(radial, apart, atol=1e-9 * SLIP)
    assert np.abs(apart).max() == pytest.approx(SLIP)


def test_the_size_scales_forces_and_a_part_acts_in_its_bushing():
    u = np.cumsum(np.random.default_rng(0).standard_normal((2, 2, 300)) * 2e-4, axis=2)
    terms = (Stop(PORT, YIELD, SLIP, APART), Branch(PORT, 0.1, 1e7))
    force = bushing_forces(laws_of(*terms), u, 0.0 * u, 1e-2)
    assert_allclose(force[0], 0.0)
    assert np.abs(force[1]).max() > SLIP
    assert_allclose(bushing_forces(laws_of(*terms, size=3.0), u, 0.0 * u, 1e-2), 3.0 * force)


def test_a_branch_relaxes_with_its_time():
    u = np.zeros((2, 2, 200))
    u[:, :, 1:] = 1e-3
    tau, step = 0.25, 1e-2
    force = bushing_forces(laws_of(Branch(BOTH, tau, 1e7)), u, 0.0 * u, step)
    decay = np.exp(-step * np.arange(199) / tau)
    assert_allclose(force[0, 0, 1:], force[0, 0, 1] * decay, rtol=1e-9)
    # A ramp of one step leaves tau / step (1 - exp(-step / tau)) of the spring's force.
    assert force[0, 0, 1] == pytest.approx(1e4 * tau / step * -np.expm1(-step / tau))


def test_a_smooth_stop_gives_way_along_its_path():
    # dz/du = (1 - z) / yield on the way out and (1 + z) / yield on the way back.
    out = np.linspace(0.0, 3.0 * YIELD, 200)
    back = np.linspace(3.0 * YIELD, YIELD, 150)[1:]
    u = np.zeros((2, 2, 349))
    u[:, 1] = np.concatenate([out, back])
    force = bushing_forces(laws_of(Stop(BOTH, YIELD, SLIP, SMOOTH)), u, 0.0 * u, 1e-3)
    rising = -np.expm1(-out / YIELD)
    falling = (1.0 + rising[-1]) * np.exp((back - out[-1]) / YIELD) - 1.0
    assert_allclose(force[0, 1], SLIP * np.concatenate([rising, falling]), atol=1e-9 * SLIP)
    assert_allclose(force[:, 0], 0.0)


def test_a_smooth_stop_follows_its_path_round_a_circle():
    """In the steady state the force lags by an angle whose tangent is yield over radius."""
    angle = np.linspace(0.0, 8.0 * np.pi, 40_001)
    circle = 2.0 * YIELD * np.array([np.cos(angle), np.sin(angle)])
    u = np.stack([circle, np.zeros_like(circle)])
    force = bushing_forces(laws_of(Stop(BOTH, YIELD, SLIP, SMOOTH)), u, 0.0 * u, 1e-3)
    late = slice(30_000, None)
    # z' = t - z / l along the path, t turning once in 2 pi R: |z| = 1 / sqrt(1 + (l / R)^2), behind
    # the tangent by atan(l / R).
    assert_allclose(np.hypot(*force[0])[late], SLIP / np.hypot(1.0, 0.5), rtol=1e-6)
    along = force[0][:, late] * np.array([-np.sin(angle), np.cos(angle)])[:, late]
    assert_allclose(along.sum(axis=0), SLIP / (1.0 + 0.25), rtol=1e-3)
