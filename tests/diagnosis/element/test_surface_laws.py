"""Surfaces f(q, v) kept as laws: table, dry friction that depends on deflection, round trips."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.blind_check.labels import SINGLE, CasePlan
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.diagnosis.classes.results import NAMED_CLASS, NO_CLASS
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.element.shapes import (
    beyond_visited,
    law_of_answer,
)
from carrierflex.diagnosis.inference.effect_fit import fit_effects
from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.simulation.element.kernels import (
    driven_motion,
    element_values,
    no_law,
    restoring_force,
)
from carrierflex.simulation.element.law_forces import element_law
from carrierflex.simulation.element.memory_laws import (
    NO_PARTS,
    flat_parts,
    joined_parts,
    memory_parts,
)
from carrierflex.simulation.law_files import read_law, write_law
from carrierflex.simulation.laws import ELEMENT, Friction, Law, Stop, Surface
from carrierflex.workflows.diagnosis import diagnose_campaign
from tests.diagnosis.element.element_campaigns import displacement_campaign
from tests.diagnosis.element.test_measured_laws import shrinkage

NONE = np.empty(0)
UNITS = ("N", "m")
X, V = np.linspace(-1e-3, 1e-3, 5), np.linspace(-0.1, 0.1, 7)
LEVEL = 3.0


def surface(x=X, v=V):
    """3 + 1e3 q + 20 v + 4e4 q v, with dry friction of 3 N everywhere."""
    y = 3.0 + 1e3 * X[:, None] + 20.0 * V + 4e4 * X[:, None] * V
    friction = Friction(ELEMENT, x=x, level=np.full(X.size, LEVEL))
    stop = Stop(ELEMENT, 1e-4, 0.5, half_range=1e-3)
    terms = (Surface(ELEMENT, x, v, y), friction, stop)
    return Law("own", ELEMENT, "force_surface", UNITS, terms)


def flat(levels, **values):
    """Parameters of the kernels with dry friction by place."""
    with_levels = replace(NO_PARTS, levels=np.column_stack([X, levels]))
    return np.append(element_values({"m": 2.0, **values}), flat_parts(with_levels))


def motion_of(drive, p, start=(0.0, 0.0)):
    laws = (no_law, no_law, NONE, NONE)
    return driven_motion(drive, np.array(start), 1, p, np.array([1e-3, 1.0]), *laws)


def drive(n=3000):
    t = 0.5e-3 * np.arange(2 * n + 1)
    return 9.0 * np.sin(2.0 * np.pi * 7.0 * t) + 4.0 * np.sin(2.0 * np.pi * 11.3 * t)


def test_a_table_holds_a_bilinear_force_and_goes_on_with_its_slopes():
    law = element_law(surface()).of_size(2.0)

    def force(q, v):
        return law.force(q, v, law.parameters)

    def exact(q, v):
        return 2.0 * (3.0 + 1e3 * q + 20.0 * v + 4e4 * q * v)

    for q, v in ((0.0, 0.0), (3.3e-4, -0.07), (-1e-3, 0.1), (1e-3, -0.1)):
        assert force(q, v) == pytest.approx(exact(q, v))
    # Along q at the same speed, along v at the same deflection.
    assert force(3e-3, 0.05) == pytest.approx(exact(3e-3, 0.05))
    assert force(5e-4, 0.3) == pytest.approx(exact(5e-4, 0.3))
    # 20 + 4e4 q is negative there: damping does not turn into a drive beyond the table.
    assert force(-1e-3, 0.3) == pytest.approx(exact(-1e-3, 0.1))


def test_the_same_dry_friction_everywhere_is_that_of_the_library():
    values = {"K1": 8e3, "C1": 12.0}
    result = motion_of(drive(), flat(np.full(X.size, LEVEL), **values))
    expected = motion_of(
        drive(), element_values({"m": 2.0, **values, "F_plus": LEVEL, "F_minus": LEVEL})
    )
    assert_allclose(result, expected, rtol=1e-12, atol=1e-15)
    assert np.count_nonzero(expected[1] == 0.0) > 100
    q = 8e-4 * np.sin(np.linspace(0.0, 20.0, 500))
    v, still, limits = np.gradient(q, 1e-3), np.zeros(500), np.array([1e-3, 1e-6])
    p = flat(X * 1e3 + 2.0, m=0.0)
    force = restoring_force(q, v, still, p, limits, no_law, no_law, NONE, NONE)
    assert_allclose(force, np.sign(v) * (2.0 + 1e3 * q), atol=1e-9)


def test_a_motion_sticks_where_its_friction_is_larger_than_what_pulls():
    levels = np.array([0.0, 0.0, 0.0, 4.0, 4.0])
    p = flat(levels, K1=5e3)
    still = np.zeros(2001)
    position, _ = motion_of(still, p, (6e-4, 0.0))
    # 3 N of the spring against 4.8 N of friction on one side; nothing on the other.
    assert_allclose(position, 6e-4)
    free, _ = motion_of(still, p, (-6e-4, 0.0))
    assert free.min() == pytest.approx(-6e-4)
    assert free.max() > 0.0


def test_tables_of_two_laws_add_up_at_the_nodes_of_both():
    first = memory_parts(surface())
    nodes = np.array([-5e-4, 7e-4])
    second = replace(first, stops=NO_PARTS.stops, levels=np.column_stack([nodes, [1.0, 2.0]]))
    joined = joined_parts([(first, 2.0), (second, 10.0)]).levels
    at = np.array([-2e-3, -5e-4, 1e-4, 7e-4])
    expected = 2.0 * LEVEL + 10.0 * np.array([1.0, 1.0, 1.5, 2.0])
    assert_allclose(np.interp(at, *joined.T), expected)


def test_deflection_and_speed_beyond_the_table_are_told():
    records = element_problem(displacement_campaign(lambda q, v: 0.0 * q, n=3000)).records
    warnings = beyond_visited(surface(v=1e-2 * V), records)
    assert [("m/s" in one.text) for one in warnings] == [False, True]
    assert "the slopes of its edge" in warnings[0].remedy
    assert beyond_visited(surface(x=100.0 * X, v=100.0 * V), records) == ()


def orifice(q, v):
    """Damping by the square of the speed through an opening that changes along the way."""
    return 400.0 * (1.0 + 0.8 * np.tanh(q / 6e-4)) * v * np.abs(v)


def rubbing(q, v):
    """Dry friction that is nineteen times as large on one side."""
    return 6.0 * (1.0 + 0.9 * np.clip(q / 1e-3, -1.0, 1.0)) * np.sign(v)


def saved_law(campaign, path):
    """Surface of a campaign's class after a turn through its file."""
    answer = element_problem(campaign).class_answer()
    write_law(path, law_of_answer(answer, "twin", "force_surface"))
    return read_law(path)


@pytest.mark.long
@pytest.mark.parametrize("cause", [orifice, rubbing])
def test_a_saved_surface_explains_its_class_on_new_records(cause, tmp_path):
    law = saved_law(displacement_campaign(cause, n=3000, seed=0), tmp_path / "law.toml")
    problem = element_problem(displacement_campaign(cause, n=3000, seed=7), (law,))
    answer = problem.class_answer()
    assert (answer.state, answer.ids) == (NAMED_CLASS, ("force_surface",))
    assert answer.classes[0].law == law.name
    assert shrinkage(problem, law) > 0.98 * answer.share
    assert fit_effects(problem, (law.name,)).theta[-1] == pytest.approx(1.0, abs=0.05)
    if cause is rubbing:
        # Read off at the quarters of the range, where the records have been at any speed.
        (friction,) = law.of(Friction)
        levels = np.interp([-1.5e-3, 1.5e-3], friction.x, friction.level)
        assert_allclose(levels, [0.6, 11.4], atol=1.5)


@pytest.mark.long
@pytest.mark.parametrize(
    ("number", "cause", "ratio", "drive"),
    [
        (205, "position_dependent_friction", 11.45, "multisine"),
        (433, "metered_orifice", 23.99, "multisine"),
    ],
)
def test_it_moves_in_the_simulator_as_the_truth_does(number, cause, ratio, drive, tmp_path):
    plan = CasePlan("element", number, 8123, SINGLE, (cause,), ratio, drive)
    law = saved_law(case_campaign(plan)[0], tmp_path / "law.toml")
    problem = element_problem(case_campaign(plan, repeat=1)[0], (law,))
    assert shrinkage(problem, law) > 0.98 * problem.class_answer().share


@pytest.mark.long
def test_one_curve_of_deflection_and_speed_is_no_surface():
    cause = ("position_dependent_friction",)
    plan = CasePlan("element", 155, 8123, SINGLE, cause, 10.3, "one_sine")
    answer = element_problem(case_campaign(plan)[0]).class_answer()
    assert (answer.state, answer.best) == (NO_CLASS, ("force_surface",))
    assert "every cause that repeats is a force of deflection and speed" in answer.note
    with pytest.raises(ValueError, match="the answer by class is 'no_class'"):
        law_of_answer(answer, "twin")


@pytest.mark.long
def test_a_surface_that_records_do_not_show_off_one_curve_is_not_kept():
    answer = element_problem(displacement_campaign(orifice, n=3000, seed=0)).class_answer()
    result = answer.classes[0]
    bare = replace(result, measured_law=None)
    with pytest.raises(ValueError, match="one curve of deflection and speed"):
        law_of_answer(replace(answer, classes=(bare,)), "twin")


@pytest.mark.long
def test_the_command_keeps_a_surface_and_takes_it_in(tmp_path):
    for name, seed in (("first", 0), ("second", 7)):
        campaign = displacement_campaign(orifice, n=3000, seed=seed)
        write_campaign(replace(campaign, name=name), tmp_path / name, simulated=True)
    law = tmp_path / "law.toml"
    diagnose_campaign.main(tmp_path / "first", out=tmp_path / "d1", save_law=law, quiet=True)
    second = diagnose_campaign.main(tmp_path / "second", out=tmp_path / "d2", law=[law], quiet=True)
    assert second.attribution.effects == ("force_surface_of_first",)
    assert second.reduction.phi > 0.98
