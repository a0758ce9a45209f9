"""What is told of a class, what its saved law leaves, and the friction in words are of one fit."""

import re

import numpy as np
import pytest

from carrierflex.diagnosis.classes.shapes import half_step, loop_spring, shape_words
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.inference.effect_fit import fit_effects
from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.simulation.element.effects import ELEMENT_EFFECTS
from carrierflex.simulation.element.law_forces import law_of_effect
from carrierflex.simulation.laws import DISSIPATION, Friction, Table
from carrierflex.workflows.diagnosis import diagnose_campaign

from .element_campaigns import displacement_campaign


def friction(size, falling=0.0, speed=0.05):
    """Force of dry friction that falls with the speed by a share of itself."""
    return lambda q, v: size * np.sign(v) * (1.0 + falling * np.exp(-((v / speed) ** 2)))


def smooth(q, v):
    """Damping that is steep beside rest and has no step there."""
    return 30.0 * np.tanh(v / 0.01) + 6.0 * np.tanh(v / 0.3)


@pytest.mark.parametrize("cause", [friction(50.0), friction(50.0, 0.4), smooth])
@pytest.mark.long
def test_a_saved_law_leaves_what_is_told(cause, tmp_path):
    write_campaign(displacement_campaign(cause), tmp_path / "campaign")
    law = tmp_path / "law.toml"
    options = {"report": False, "quiet": True}
    first = diagnose_campaign.main(
        tmp_path / "campaign", out=tmp_path / "first", save_law=law, **options
    )
    again = diagnose_campaign.main(
        tmp_path / "campaign", out=tmp_path / "second", law=[law], **options
    )
    leaves = {
        entry.effects: entry.held_out_rms
        for entry in again.attribution.ranking
        if "dissipation" in entry.effects[0]
    }
    assert list(leaves.values()) == pytest.approx([first.reduction.rms_after], rel=0.02)


@pytest.mark.parametrize(("size", "falling"), [(50.0, 0.0), (20.0, 0.4)])
def test_friction_is_half_the_step_of_the_force_at_rest(size, falling):
    campaign = displacement_campaign(friction(size, falling))
    words = element_problem(campaign).class_answer().classes[0].shape.words
    level, low, high = map(
        float, re.search(r"about (\S+) N \((\S+) N to (\S+) N\)", words).groups()
    )
    step = size * (1.0 + falling)
    assert level == pytest.approx(step, rel=0.05)
    assert low < step < high
    assert ("falling" in words) == (falling > 0.0)


def test_damping_without_a_step_is_not_told_as_friction():
    shape = element_problem(displacement_campaign(smooth)).class_answer().classes[0].shape
    assert shape.words.startswith("grows with speed, 3")
    # The whole force at the largest speed, with the 12 N s/m of the baseline.
    v = shape.x[-1]
    assert shape.y[-1] == pytest.approx(smooth(0.0, v) + 12.0 * v, rel=0.02)


def test_a_step_is_read_beside_a_damping_that_bends():
    v = np.linspace(-0.1, 0.1, 2001)
    draws = np.array([5.0 * np.tanh(v / 1e-4) + 40.0 * v * np.abs(v)] * 3)
    level, low, high = half_step(v, draws, 1e-3)
    assert level == pytest.approx(5.0, rel=1e-3)
    assert high - low < 0.01
    words = shape_words(DISSIPATION, v, draws[0], ("m/s", "N"), (level, low, high))
    assert words == "dry friction, about 5 N (5 N to 5 N), at every speed"


def test_the_interval_of_a_step_holds_what_a_bend_beside_rest_hides():
    v = np.linspace(-0.1, 0.1, 2001)
    at_rest = 7.0
    force = np.tanh(v / 1e-4) * (5.0 + (at_rest - 5.0) * np.exp(-np.abs(v) / 8e-3))
    level, low, high = half_step(v, np.array([force] * 3), 1e-3)
    assert low < level < at_rest < high
    assert high - low < 0.1 * at_rest


def test_friction_that_falls_is_fitted_by_its_law_and_not_at_a_bound():
    problem = element_problem(displacement_campaign(friction(77.0, 0.4)))
    fit = fit_effects(problem, ("stribeck_friction",))
    values = {p.name: x for p, x in zip(fit.parameters, fit.theta, strict=True)}
    assert values["Fc"] == pytest.approx(77.0, rel=0.03)
    assert values["Fs"] == pytest.approx(0.4 * 77.0, rel=0.06)
    assert values["v_s"] == pytest.approx(0.05, rel=0.05)


def test_a_named_law_is_written_as_its_equation():
    v = np.linspace(-0.2, 0.2, 41)
    values = {"Fc": 3.0, "Fs": 2.0, "v_s": 0.05}
    law = law_of_effect(ELEMENT_EFFECTS["stribeck_friction"], DISSIPATION, values, v, ("N", "m"))
    (table,), (step,) = law.of(Table), law.of(Friction)
    assert (step.plus, step.minus) == pytest.approx((5.0, 5.0))
    expected = (3.0 + 2.0 * np.exp(-((v / 0.05) ** 2))) * np.sign(v)
    moving = np.abs(v) > 1e-9
    forces = table.y + step.plus * np.sign(v)
    np.testing.assert_allclose(forces[moving], expected[moving], rtol=1e-9)


def test_a_baseline_that_predicts_worse_than_no_motion_is_no_gap():
    levels = (0.5e-3, 1e-3, 8e-3)
    campaign = displacement_campaign(friction(40.0), amplitudes=levels)
    diagnosis = diagnose(element_problem(campaign), campaign=campaign.name, kind="element")
    signal = np.concatenate([run.signals["F"] for run in campaign.runs]).std()
    assert diagnosis.reduction.rms_before <= signal


@pytest.mark.parametrize("spring", [0.0, 12.0, -40.0])
def test_a_loop_is_drawn_without_its_spring(spring):
    """A slider of 3 N behind a spring of 20 N/m, whatever linear spring the fit put beside it."""
    x = np.sin(np.linspace(0.0, 4.5 * np.pi, 2001))
    slider = np.empty(x.size)
    force = 0.0
    for k in range(x.size):
        force = np.clip(force + 20.0 * (x[k] - (x[k - 1] if k else 0.0)), -3.0, 3.0)
        slider[k] = force
    turn = slice(-890, None)
    assert loop_spring(x[turn], (slider + spring * x)[turn]) == pytest.approx(spring, abs=0.2)
