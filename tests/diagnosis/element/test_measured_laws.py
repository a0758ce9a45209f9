"""A measured shape kept as a law explains its class on new records of the same rig."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.classes.results import NAMED_CLASS, NOTHING, ClassAnswer, ClassFinding
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.element.shapes import (
    beyond_visited,
    law_cards,
    law_of_answer,
)
from carrierflex.diagnosis.inference.effect_fit import fit_effects
from carrierflex.diagnosis.kinds import problem_of
from carrierflex.simulation.element.law_forces import element_law
from carrierflex.simulation.law_files import read_law, write_law
from carrierflex.simulation.laws import ELEMENT, Law, Table
from carrierflex.workflows.diagnosis import diagnose_campaign
from tests.diagnosis.element.element_campaigns import displacement_campaign, force_campaign

UNITS = ("N", "m")


def stop(q, v):
    """Stop of a hard rubber on one side, which no law of the library is."""
    return 2e4 * np.maximum(q - 6e-4, 0.0)


def friction(q, v):
    """Dry friction with a root of the speed."""
    return np.sign(v) * (3.0 + 12.0 * np.sqrt(np.abs(v)))


def coupled(q, v):
    """Damping that grows with the size of the deflection."""
    return 6e4 * np.abs(q) * v


def moved(law, seed):
    return displacement_campaign(law, n=2000, seed=seed)


def saved_and_read(campaign, path):
    """Law of a campaign's leading class after a turn through its file."""
    law = law_of_answer(element_problem(campaign).class_answer(), campaign.name)
    write_law(path, law)
    return read_law(path)


def shrinkage(problem, law):
    """Square of the gap above the noise that the law takes away, the baseline refitted."""
    noise = problem.noise_square.sum()
    before = fit_effects(problem, ()).sums.square.sum() - noise
    after = fit_effects(problem, (law.name,)).sums.square.sum() - noise
    return 1.0 - after / before


@pytest.mark.long
@pytest.mark.parametrize(
    ("cause", "name"),
    [
        (stop, "restoring_force"),
        (friction, "dissipation"),
        (coupled, "coupled_damping"),
    ],
)
def test_a_saved_law_explains_its_class_on_new_records(cause, name, tmp_path):
    law = saved_and_read(moved(cause, 0), tmp_path / "law.toml")
    assert (law.effect_class, law.units) == (name, UNITS)
    problem = element_problem(moved(cause, 7), (law,))
    answer = problem.class_answer()
    assert (answer.state, answer.ids) == (NAMED_CLASS, (name,))
    result = answer.classes[0]
    # Of two laws that explain the same either may stand as the nearest.
    assert result.law_share > 0.98 * result.share
    assert shrinkage(problem, law) > 0.98 * answer.share
    size = fit_effects(problem, (law.name,)).theta[-1]
    assert size == pytest.approx(1.0, abs=0.05)


@pytest.mark.acceptance
def test_a_saved_law_moves_in_the_simulator_as_the_rig_does(tmp_path):
    drives = {"amplitudes": (4.0, 8.0, 16.0)}
    law = saved_and_read(force_campaign(stop, seed=0, **drives), tmp_path / "law.toml")
    problem = element_problem(force_campaign(stop, seed=3, **drives), (law,))
    answer = problem.class_answer()
    assert shrinkage(problem, law) > 0.98 * answer.share


def straight(half=1e-3, **changes):
    """Spring of 1e3 N/m over 2 mm."""
    table = Table(ELEMENT, np.linspace(-half, half, 41), np.linspace(-1.0, 1.0, 41))
    return replace(Law("straight", ELEMENT, "restoring_force", UNITS, (table,)), **changes)


def test_a_table_goes_on_with_its_slope_and_damping_with_its_end_value():
    def force(effect_class, q, v):
        law = element_law(straight(effect_class=effect_class)).of_size(2.0)
        return law.force(q, v, law.parameters)

    of_spring = [force("restoring_force", q, 9.0) for q in (5e-4, 3e-3, -3e-3)]
    assert_allclose(of_spring, [1.0, 6.0, -6.0])
    assert_allclose([force("dissipation", 9.0, v) for v in (5e-4, 3e-3)], [1.0, 6.0])
    assert_allclose([force("coupled_damping", q, 3.0) for q in (5e-4, 3e-3)], [3.0, 6.0])


def answer_of(*names, state=NAMED_CLASS):
    """Answer with these classes, shares falling, none with a curve."""
    classes = tuple(
        ClassFinding(name, 0.9 / k, (0.0, 1.0), "backlash", 0.5, law_named=True)
        for k, name in enumerate(names, start=1)
    )
    return ClassAnswer(state, classes, (), {}, 0.9, (0.0, 1.0), 0.9, (), 0.5, {})


@pytest.mark.parametrize(
    ("answer", "wanted", "message"),
    [
        (answer_of(state=NOTHING), None, "answer by class is 'nothing'"),
        (answer_of("delay", "dissipation"), None, "class 'delay' cannot be saved as a law"),
        (answer_of("time_variation"), None, "class 'time_variation' cannot be saved as a law"),
        (answer_of("hysteresis"), None, "was named by its law backlash, not by its shape"),
        (answer_of("delay"), "dissipation", "'dissipation' is not in the answer; expected delay"),
        (answer_of("restoring_force"), None, "was named by its law backlash, not by its shape"),
    ],
)
def test_what_is_no_table_is_refused_by_name(answer, wanted, message):
    with pytest.raises(ValueError, match=message):
        law_of_answer(answer, "twin", wanted)


def test_a_law_of_other_units_is_refused():
    with pytest.raises(ValueError, match="units are V and mm; expected those of the records, N"):
        law_cards((straight(units=("V", "mm")),), UNITS)


def test_records_that_leave_the_range_of_a_law_are_told():
    problem = element_problem(moved(lambda q, v: 0.0 * q, 0))
    narrow, wide = straight(), straight(1.0)
    (warning,) = beyond_visited(narrow, problem.records)
    assert (warning.check, warning.about) == ("visited_range", "straight")
    assert 0.0 < warning.figure < 1.0
    assert "is extrapolated with the slope of its end" in warning.remedy
    assert beyond_visited(wide, problem.records) == ()


@pytest.mark.parametrize("kind", ["mounting", "carrier"])
def test_a_law_file_of_an_element_is_for_elements(kind):
    with pytest.raises(ValueError, match=f"is of kind {kind}; law 'straight' is of one element"):
        problem_of(SimpleNamespace(name="rig", kind=kind), {}, (straight(),))


@pytest.mark.parametrize("name", ["missing/law.toml", "."])
def test_a_law_that_could_not_be_written_is_refused_before_the_work(name, tmp_path):
    with pytest.raises(OSError, match="expected"):
        diagnose_campaign.main(tmp_path, out=tmp_path / "out", save_law=tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_a_class_without_a_file_to_save_it_in_is_refused(tmp_path):
    with pytest.raises(ValueError, match="--law-class without --save-law"):
        diagnose_campaign.main(tmp_path, out=tmp_path / "out", law_class="dissipation")
