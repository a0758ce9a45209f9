"""A measured shape of the bushings kept as a law explains its class on new records of the rig."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from carrierflex.blind_check.case_plans import case_plans
from carrierflex.blind_check.labels import FORM
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.diagnosis.classes.results import NAMED_CLASS, ClassAnswer, ClassFinding
from carrierflex.diagnosis.inference.effect_fit import fit_effects
from carrierflex.diagnosis.kinds import problem_of, saved_law
from carrierflex.diagnosis.mounting.problem import mounting_problem
from carrierflex.diagnosis.mounting.shapes import bushing_law_of_answer
from carrierflex.simulation.law_files import read_law, write_law
from carrierflex.simulation.laws import (
    APART,
    BOTH,
    MOUNTING,
    PORT,
    RADIAL,
    STARBOARD,
    Law,
    Stop,
    Table,
)
from carrierflex.simulation.mounting.measured_laws.bushing_laws import packed_laws
from tests.diagnosis.mounting.mounting_campaigns import mounting_campaign

FAR = np.linspace(0.0, 20e-3, 4001)
WIDE = np.linspace(-20e-3, 20e-3, 8001)
FAST = np.linspace(0.0, 0.2, 4001)


def stop(r):
    """Rubber stop of 15 MN/m from 1.5 mm, in whatever direction, which no law of the library is."""
    return 1.5e7 * np.maximum(r - 1.5e-3, 0.0)


def true_law(effect_class, *tables):
    """Law that the rig follows."""
    return Law("true", MOUNTING, effect_class, ("N", "m"), tables)


CAUSES = {
    "stop in the plane": true_law("restoring_force", Table(BOTH, FAR, stop(FAR), RADIAL)),
    "stop of its own in either bushing": true_law(
        "restoring_force",
        Table(PORT, FAR, 2.0 * stop(FAR), RADIAL),
        Table(STARBOARD, FAR, 0.5 * stop(FAR), RADIAL),
    ),
    "hyperbolic spring": true_law(
        "restoring_force", Table(BOTH, WIDE, 2e4 * np.sinh(WIDE / 1e-3) - 2e7 * WIDE, APART)
    ),
    "damping by the square of the speed": true_law(
        "dissipation", Table(BOTH, FAST, 2e8 * FAST**2, RADIAL)
    ),
    "damping far from the middle": true_law(
        "coupled_damping",
        Table(BOTH, FAR, 1e6 * (1.0 - np.exp(-((FAR / 2e-3) ** 2))), RADIAL),
    ),
}


def moved(law, seed, **options):
    """Campaign of a rig whose bushings follow a law."""
    return mounting_campaign(tables=packed_laws([(law, 1.0)]), seed=seed, seconds=70.0, **options)


@pytest.mark.long
@pytest.mark.parametrize("cause", CAUSES)
def test_a_saved_law_explains_its_class_on_new_records(cause, tmp_path):
    true = CAUSES[cause]
    first = moved(true, 0)
    answer = mounting_problem(first).class_answer()
    assert (answer.state, answer.ids) == (NAMED_CLASS, (f"bushings/{true.effect_class}",))
    shape = answer.classes[0].shape
    assert (shape.band[:, 0] <= shape.y).all()
    assert (shape.band[:, 1] >= shape.y).all()
    write_law(tmp_path / "law.toml", saved_law(first, answer, None))
    law = read_law(tmp_path / "law.toml")
    problem = mounting_problem(moved(true, 7), (law,))
    result = problem.class_answer()
    assert result.ids == answer.ids
    assert (result.classes[0].law, result.classes[0].law_named) == (law.name, True)
    noise = problem.noise_square.sum()
    before = fit_effects(problem, ()).sums.square.sum() - noise
    fit = fit_effects(problem, (law.name,))
    assert 1.0 - (fit.sums.square.sum() - noise) / before > 0.98 * result.share
    # The linear bushings beside it are fitted too: a curve that is nearly straight is theirs.
    assert fit.theta[-1] == pytest.approx(1.0, abs=0.1)


@pytest.mark.long
def test_one_curve_for_either_bushing_is_drawn_where_they_differ():
    cause = CAUSES["stop of its own in either bushing"]
    # Torque of one sign moves one bushing up and the other down: one law that is not even.
    conditions = ((3e5, 0.0, -1e5), (-3e5, 1e5, 1e5), (-2e5, -1e5, 5e4), (3.5e5, 5e4, 0.0))
    (finding,) = mounting_problem(moved(cause, 0, conditions=conditions)).class_answer().classes
    shape = finding.shape
    (other,) = shape.beside
    assert other.name == "starboard bushing"
    assert "port bushing; starboard bushing" in shape.words
    assert np.ptp(other.y) < 0.5 * np.ptp(shape.y)
    assert {term.acts_on for term in finding.measured_law.terms} == {STARBOARD, PORT}


@pytest.mark.long
def test_a_class_with_memory_is_drawn_and_kept_as_branches():
    answer = mounting_problem(mounting_campaign({"k": 1e7, "c": 5e6}, seconds=70.0)).class_answer()
    shape = answer.classes[0].shape
    assert "relaxes from" in shape.words
    # The branch is a spring of 10 MN/m: its force relaxes with c / k = 0.5 s.
    assert shape.y[0] == pytest.approx(1e7, rel=0.1)
    assert np.interp(0.5, shape.x, shape.y) == pytest.approx(1e7 / np.e, rel=0.2)
    law = bushing_law_of_answer(answer, "twin")
    assert (law.name, law.effect_class) == ("memory_of_twin", "memory")
    relaxed = [branch.stiffness * np.exp(-0.5 / branch.tau) for branch in law.terms]
    assert sum(relaxed) == pytest.approx(np.interp(0.5, shape.x, shape.y), rel=0.02)


@pytest.mark.long
@pytest.mark.parametrize(("number", "effect_class"), [(11, "hysteresis"), (23, "memory")])
def test_a_saved_law_with_a_memory_explains_its_class_on_new_noise(number, effect_class, tmp_path):
    # A smooth loop and a rubber: the truth has other equations and another integrator.
    plan = case_plans("mounting", 24, 902, (FORM,))[number - 1]
    answer = mounting_problem(case_campaign(plan)[0]).class_answer()
    assert answer.ids == (f"bushings/{effect_class}",)
    write_law(tmp_path / "law.toml", bushing_law_of_answer(answer, "twin"))
    law = read_law(tmp_path / "law.toml")
    problem = mounting_problem(case_campaign(plan, repeat=1)[0], (law,))
    result = problem.class_answer()
    assert (result.ids, result.classes[0].law) == (answer.ids, law.name)
    noise = problem.noise_square.sum()
    before = fit_effects(problem, ()).sums.square.sum() - noise
    fit = fit_effects(problem, (law.name,))
    assert 1.0 - (fit.sums.square.sum() - noise) / before > 0.98 * result.share
    assert fit.theta[-1] == pytest.approx(1.0, abs=0.05)


def straight(**changes):
    """Law of two tables."""
    x = np.linspace(0.0, 1e-3, 21)
    tables = (
        Table(STARBOARD, x, 2e6 * x, RADIAL),
        Table(BOTH, np.linspace(-1e-3, 1e-3, 3), np.array([-1.0, 0.0, 2.0]), APART),
    )
    return replace(true_law("restoring_force", *tables), name="straight", **changes)


def lasting(visited=2e-3):
    """Law of a stop."""
    stop = Stop(BOTH, 1e-4, 3.0, RADIAL)
    law = true_law("hysteresis", stop)
    return replace(law, name="own", visited={"deflection": (0.0, visited)})


def test_a_law_with_a_memory_is_for_mountings_and_tells_where_it_was_measured():
    campaign = SimpleNamespace(name="rig", kind="carrier")
    with pytest.raises(ValueError, match="law 'own' is of bushings"):
        problem_of(campaign, {}, (lasting(),))
    problem = mounting_problem(mounting_campaign(seconds=40.0), (lasting(visited=1e-4),))
    (warning,) = problem.beyond_visited(lasting(visited=1e-4))
    assert "is extrapolated with stops that slip as at its end" in warning.remedy
    assert problem.beyond_visited(lasting(visited=1.0)) == ()


def test_a_law_of_bushings_is_for_mountings():
    campaign = SimpleNamespace(name="rig", kind="element")
    with pytest.raises(ValueError, match="of kind element; law 'straight' is of bushings"):
        problem_of(campaign, None, (straight(),))


def test_records_that_leave_the_range_of_a_law_are_told():
    problem = mounting_problem(mounting_campaign(seconds=40.0), (straight(),))
    (warning,) = problem.beyond_visited(straight())
    assert (warning.check, warning.about) == ("visited_range", "straight")
    assert 0.0 < warning.figure < 1.0
    assert "is extrapolated with the slope of its end" in warning.remedy
    x = np.linspace(-1.0, 1.0, 3)
    wide = straight(terms=(Table(BOTH, x, x, APART),))
    assert problem.beyond_visited(wide) == ()


def friction_answer(steps):
    """Answer by class whose dissipation rises at rest."""
    v = np.linspace(0.0, 1e-2, 11)
    finding = ClassFinding(
        "bushings/dissipation",
        0.9,
        (0.8, 1.0),
        "",
        float("nan"),
        law_named=False,
        shape=SimpleNamespace(steps=steps),
        measured_law=true_law("dissipation", Table(BOTH, v, 1e5 * v, RADIAL)),
    )
    return ClassAnswer(NAMED_CLASS, (finding,), (), {}, 0.9, (0.8, 1.0), 0.9, (), float("nan"), {})


def test_dry_friction_is_no_table_of_a_bushing():
    with pytest.raises(ValueError, match="'dissipation' holds dry friction of 500 N at rest"):
        bushing_law_of_answer(friction_answer((500.0, 400.0)), "twin")
    law = bushing_law_of_answer(friction_answer((20.0, 0.0)), "Rig 7: twin")
    assert (law.name, law.effect_class) == ("dissipation_of_rig_7_twin", "dissipation")
