"""Classes of a mounting: bushings, housing, loads, sensors, clock."""

import numpy as np
import pytest

from carrierflex.diagnosis.classes.results import NAMED_CLASS, NO_CLASS, NOTHING
from carrierflex.diagnosis.mounting.answer import _INPUT_MAP, _STIFFNESS_MAP, contract_id
from carrierflex.diagnosis.mounting.columns import _guide_forces, bushing_size, force_groups
from carrierflex.diagnosis.mounting.motion import N_FREE, bushing_motions, rigid_body
from carrierflex.diagnosis.mounting.problem import mounting_problem
from carrierflex.diagnosis.mounting.table import SHAPE_OF_LAW
from carrierflex.simulation.laws import APART, BOTH, MOUNTING, RADIAL, SMOOTH, Law, Stop
from carrierflex.simulation.mounting.measured_laws.bushing_laws import bushing_forces, packed_laws
from carrierflex.simulation.mounting.rig import MountingRig
from tests.diagnosis.mounting.mounting_campaigns import NOISE, RIG, TRUE_LINEAR, mounting_campaign
from tests.diagnosis.mounting.test_problem import TRUTH

SECONDS = 70.0
#: Twins of the default suite: one of every kind of column; the others are long.
QUICK = (
    "cubic_stiffness",
    "elasto_plastic_friction",
    "fluid_branch",
    "main_bearing_compliance",
    "sensor_delay",
)


def answer_to(values=None, **options):
    """Answer by class to a twin with these values of the simulator."""
    campaign = mounting_campaign(values, **{"seconds": SECONDS, **options})
    return mounting_problem(campaign).class_answer()


def check_twin(effect):
    """The class of the law is named, and the law cannot be told from it."""
    result = answer_to(TRUTH[effect][0])
    assert result.state == NAMED_CLASS
    assert result.ids == (contract_id(f"{SHAPE_OF_LAW[effect]}/all"),)
    assert result.ties == ()
    assert result.classes[0].law == effect
    assert result.share > 0.97


@pytest.mark.long
@pytest.mark.parametrize("effect", QUICK)
def test_class_of_a_law_is_found_without_its_form(effect):
    check_twin(effect)


@pytest.mark.long
@pytest.mark.parametrize("effect", [name for name in TRUTH if name not in QUICK])
def test_class_of_every_other_law_is_found_without_its_form(effect):
    check_twin(effect)


def test_nothing_missing_names_no_class():
    result = answer_to()
    assert result.state == NOTHING
    assert result.ids == ()


@pytest.mark.long
def test_motions_that_slow_torque_alone_does_not_part_are_a_tie_of_linear_maps():
    def moved(inputs):
        """Pitch and yaw in proportion to the torque."""
        L = RIG.main_bearing_x
        pitch, yaw = 7e-11 * inputs.torque, -5e-11 * inputs.torque
        still = np.zeros_like(pitch)
        motion = np.array([still, L * yaw, -L * pitch, still, pitch, yaw])
        return motion.T @ RIG.sensor_matrix.T

    conditions = tuple((torque, 0.0, 0.0) for torque in (3.0e5, 1.5e5, 2.2e5, 3.5e5))
    result = answer_to(extra=moved, conditions=conditions)
    tied = {name for names in (result.ids, *result.ties) for name in names}
    assert {_STIFFNESS_MAP, _INPUT_MAP} <= tied
    assert "load together with the others parts them" in result.note


def test_reaction_of_the_bearing_is_the_load_that_the_bushings_do_not_bear():
    problem = mounting_problem(mounting_campaign(noise=0.0, seconds=40.0))
    theta = np.array([TRUE_LINEAR["K1"], TRUE_LINEAR["C1"]])
    motion = bushing_motions(problem.model, problem.records, theta)[1]
    body = motion.body
    bushings = -np.sum(
        TRUE_LINEAR["K1"] * motion.u[:, 1] + TRUE_LINEAR["C1"] * motion.v[:, 1], axis=0
    )
    acceleration = np.gradient(motion.rate, motion.step, axis=1)
    inertia = (body.M[N_FREE:, :N_FREE] @ acceleration)[0]
    load = motion.loads[:, 2]
    reaction = _guide_forces(motion)[0]
    np.testing.assert_allclose(reaction, load + bushings - inertia, atol=1e-6 * np.abs(load).max())


@pytest.mark.long
@pytest.mark.parametrize(
    ("group", "acts"), [("stops", APART), ("radial_stops", RADIAL), ("smooth_stops", SMOOTH)]
)
def test_a_slider_of_the_classes_is_that_of_the_simulator(group, acts):
    """A column is the force, over that at slip, of the part that a law file keeps."""
    problem = mounting_problem(mounting_campaign(noise=0.0, seconds=40.0))
    theta = np.array([TRUE_LINEAR["K1"], TRUE_LINEAR["C1"]])
    motions = bushing_motions(problem.model, problem.records, theta)
    motion = motions[2]
    size = bushing_size(motions)
    (columns,) = (each.columns(motion) for each in force_groups(size) if each.id == group)
    yields = size.yields if acts == APART else size.radial_yields
    for column, yield_deflection in zip(columns, yields, strict=True):
        stop = Stop(BOTH, float(yield_deflection), 1.0, acts)
        laws = packed_laws([(Law("own", MOUNTING, "hysteresis", ("N", "m"), (stop,)), 1.0)])
        force = bushing_forces(laws, motion.u, motion.v, motion.step)
        np.testing.assert_allclose(column, force, atol=1e-9)


def test_response_of_the_housing_is_that_of_the_simulator():
    rig = MountingRig()
    problem = mounting_problem(mounting_campaign(noise=0.0, seconds=40.0))
    body = rigid_body(rig, problem.model.sensors, TRUE_LINEAR["K1"], TRUE_LINEAR["C1"])
    record = problem.records[2]
    p = body.G[:N_FREE] @ record.inputs.loads.T
    signals = body.free_output @ body.response(p, record.step)
    signals -= signals[:, : record.zeroing_samples].mean(axis=1, keepdims=True)
    np.testing.assert_allclose(signals.T, record.measured, atol=1e-3 * NOISE)


def test_a_channel_that_rocks_by_itself_is_no_class():
    def shaken(inputs):
        """One sensor rocks."""
        signal = np.zeros((inputs.time.size, 6))
        signal[:, 4] = 5e-5 * np.sin(2.0 * np.pi * 1.03 * inputs.time)
        return signal

    assert answer_to(extra=shaken).ids == ()


def test_ground_that_shakes_two_sensors_is_no_stiffness():
    """The map's columns hold what the sensors read; no stiffness of a rig makes anything of it."""

    def shaken(inputs):
        """The frame of both vertical sensors shakes, with a machine nearby."""
        t = inputs.time
        signal = np.zeros((t.size, 6))
        signal[:, 2:4] = 1e-3 * np.sin(2.0 * np.pi * 0.71 * t + 0.4 * np.sin(0.6 * t))[:, None]
        return signal

    answer = answer_to(extra=shaken)
    assert answer.state == NO_CLASS
    assert "stiffness_map" in answer.ids


def test_channels_that_do_not_show_the_motion_have_no_class():
    campaign = mounting_campaign(seconds=40.0)
    problem = mounting_problem(campaign)
    body = rigid_body(RIG, ("ssz", "spz"), TRUE_LINEAR["K1"], TRUE_LINEAR["C1"])
    assert not body.shows_motion
    assert problem.class_answer() is not None
