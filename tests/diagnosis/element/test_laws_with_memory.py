"""Hysteresis and memory kept as laws: parts of their own kinematics, round trips, files."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import lfilter

from carrierflex.blind_check.labels import SINGLE, CasePlan
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.diagnosis.classes.results import NAMED_CLASS
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.element.shapes import (
    beyond_visited,
    law_cards,
    law_of_answer,
)
from carrierflex.diagnosis.inference.effect_fit import fit_effects
from carrierflex.diagnosis.inference.results import NAMING
from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.simulation.element.kernels import (
    driven_motion,
    element_values,
    no_law,
    restoring_force,
)
from carrierflex.simulation.element.memory_laws import (
    AT,
    NO_PARTS,
    flat_parts,
    joined_parts,
    memory_parts,
)
from carrierflex.simulation.law_files import read_law, write_law
from carrierflex.simulation.laws import ELEMENT, Branch, Law, Stop
from carrierflex.workflows.diagnosis import diagnose_campaign
from tests.diagnosis.element.element_campaigns import STEP, bouc_wen, displacement_campaign
from tests.diagnosis.element.test_measured_laws import shrinkage

NONE = np.empty(0)
UNITS = ("N", "m")
STIFFNESS, SLIP, TAU = 1e4, 3.0, 0.02


def stop(**forces):
    """One stop that slips at 0.3 mm."""
    row = np.zeros(len(AT))
    values = {"yield_deflection": SLIP / STIFFNESS, "half_range": 1e-3, **forces}
    for name, value in values.items():
        row[getattr(AT, name)] = value
    return replace(NO_PARTS, stops=row[None])


BRANCH = replace(NO_PARTS, branches=np.array([[TAU, STIFFNESS]]))


def force_of(q, memory, step=1e-3, **values):
    flat = np.append(element_values({"m": 0.0, **values}), flat_parts(memory))
    still, limits = np.zeros(q.size), np.array([step, 1.0])
    laws = (no_law, no_law, NONE, NONE)
    return restoring_force(q, still, still, flat, limits, *laws)


def motion_of(drive, memory, **values):
    values = {"m": 2.0, "K1": 8e3, "C1": 12.0, **values}
    flat = np.append(element_values(values), flat_parts(memory))
    limits, start = np.array([1e-3, 1.0]), np.zeros(2)
    laws = (no_law, no_law, NONE, NONE)
    return driven_motion(drive, start, 1, flat, limits, *laws)


def loop(n=2000, amplitude=1e-3):
    """Two turns of a sine."""
    return amplitude * np.sin(2.0 * np.pi * np.arange(2 * n) / n)


def drive(n=4000):
    t = 0.5e-3 * np.arange(2 * n + 1)
    return 20.0 * np.sin(2.0 * np.pi * 7.0 * t) + 9.0 * np.sin(2.0 * np.pi * 11.3 * t)


@pytest.mark.parametrize(
    ("memory", "effect"),
    [
        (stop(slip=SLIP), {"Kp": STIFFNESS, "Fy": SLIP}),
        (BRANCH, {"k": STIFFNESS, "tau": TAU}),
    ],
)
def test_one_part_is_the_effect_of_the_library(memory, effect):
    q = loop()
    assert_allclose(force_of(q, memory), force_of(q, NO_PARTS, **effect), atol=1e-10)
    result, expected = motion_of(drive(), memory), motion_of(drive(), NO_PARTS, **effect)
    # Of a branch the library integrates the rate, the part is exact along a straight motion.
    assert_allclose(result[0], expected[0], atol=2e-3 * np.abs(expected[0]).max())
    assert np.abs(expected[0] - motion_of(drive(), NO_PARTS)[0]).max() > 1e-4


def test_a_stop_differs_from_side_to_side_and_in_the_middle():
    q = loop()
    pinched = force_of(q, stop(slip_middle=SLIP))
    assert_allclose(pinched[[2500, 3500]], 0.0, atol=1e-6)
    assert pinched[np.argmin(np.abs(q[2000:2400])) + 2000] == pytest.approx(SLIP, rel=1e-2)
    upper = force_of(q, stop(slip_upper=SLIP))
    assert upper[2500] == pytest.approx(SLIP, rel=1e-3)
    assert upper[3500] == pytest.approx(0.0, abs=1e-6)
    lower = force_of(q, stop(slip_lower=SLIP))
    assert lower[3500] == pytest.approx(-SLIP, rel=1e-3)
    # Weak in the middle alone: whole beyond a quarter of the half range.
    outside = force_of(q, stop(slip_outside=SLIP))
    assert_allclose(outside[[2100, 2500, 3500]], SLIP * np.array([1.0, 1.0, -1.0]), rtol=1e-3)
    assert_allclose(outside[2020], force_of(q, stop(slip=SLIP))[2020] * 4.0 * q[2020] / 1e-3)
    curved = force_of(q, stop(inner=SLIP, outer_upper=2.0 * SLIP, outer_lower=4.0 * SLIP))
    assert_allclose([curved.max(), curved.min()], [1.5 * SLIP, -2.5 * SLIP], rtol=1e-6)


def test_the_size_scales_forces_and_no_deflection():
    law = lasting(terms=(Stop(ELEMENT, SLIP / STIFFNESS, SLIP, half_range=1e-3),))
    other = lasting(effect_class="memory", terms=(Branch(ELEMENT, TAU, STIFFNESS),))
    joined = joined_parts([(memory_parts(law), 2.0), (memory_parts(other), 3.0)])
    q = loop()
    expected = 2.0 * force_of(q, stop(slip=SLIP)) + 3.0 * force_of(q, BRANCH)
    assert_allclose(force_of(q, joined), expected, rtol=1e-12, atol=1e-12)


def smooth_loop(q, v):
    """Bouc-Wen loop, whose turns are round: no law of the library."""
    return 6.0 * bouc_wen(q, 3e-4, exponent=1.5, beta=0.8, gamma=0.2, substeps=4)


def rubber(q, v):
    """Three branches where the library has one."""
    moved = np.diff(q, prepend=q[0])
    force = np.zeros(q.size)
    for stiffness, tau in ((4e3, 0.03), (3e3, 0.12), (2e3, 0.5)):
        decay = np.exp(-STEP / tau)
        force += lfilter([stiffness * tau / STEP * (1.0 - decay)], [1.0, -decay], moved)
    return force


def saved_law(campaign, path):
    """Law of a campaign's class after a turn through its file."""
    write_law(path, law_of_answer(element_problem(campaign).class_answer(), "twin"))
    return read_law(path)


@pytest.mark.long
@pytest.mark.parametrize(("cause", "name"), [(smooth_loop, "hysteresis"), (rubber, "memory")])
def test_a_saved_law_with_a_memory_explains_its_class_on_new_records(cause, name, tmp_path):
    law = saved_law(displacement_campaign(cause, n=3000, seed=0), tmp_path / "law.toml")
    assert (law.effect_class, law.units) == (name, UNITS)
    problem = element_problem(displacement_campaign(cause, n=3000, seed=7), (law,))
    answer = problem.class_answer()
    assert (answer.state, answer.ids) == (NAMED_CLASS, (name,))
    assert answer.classes[0].law == law.name
    assert answer.classes[0].law_share > 0.98 * answer.share
    assert shrinkage(problem, law) > 0.98 * answer.share


@pytest.mark.long
@pytest.mark.parametrize(
    ("number", "cause", "ratio", "drive"),
    [
        (57, "slider", 16.34, "sweeps"),
        (77, "iwan", 4.564, "noise"),
        (99, "two_maxwell", 13.02, "sweeps"),
        (218, "maxwell", 9.239, "multisine"),
    ],
)
def test_it_moves_in_the_simulator_as_the_rig_does(number, cause, ratio, drive, tmp_path):
    plan = CasePlan("element", number, 8123, SINGLE, (cause,), ratio, drive)
    law = saved_law(case_campaign(plan)[0], tmp_path / "law.toml")
    problem = element_problem(case_campaign(plan, repeat=1)[0], (law,))
    assert shrinkage(problem, law) > 0.98 * problem.class_answer().share
    assert fit_effects(problem, (law.name,)).theta[-1] == pytest.approx(1.0, abs=0.05)


def lasting(**changes):
    """A law of one stop."""
    stop = Stop(ELEMENT, SLIP / STIFFNESS, SLIP, half_range=1e-3)
    law = Law("own", ELEMENT, "hysteresis", UNITS, (stop,), {"deflection": (-1e-3, 2e-3)})
    return replace(law, **changes)


def test_units_and_range_are_looked_at():
    with pytest.raises(ValueError, match="units are V and mm; expected those of the records, N"):
        law_cards((lasting(units=("V", "mm")),), UNITS)
    records = element_problem(displacement_campaign(lambda q, v: 0.0 * q, n=3000)).records
    (warning,) = beyond_visited(lasting(), records)
    assert "stops that slip as at its end" in warning.remedy
    assert beyond_visited(lasting(visited={"deflection": (-1.0, 1.0)}), records) == ()


@pytest.mark.long
def test_the_command_keeps_a_loop_and_takes_it_in(tmp_path):
    for name, seed in (("first", 0), ("second", 7)):
        campaign = displacement_campaign(smooth_loop, n=3000, seed=seed)
        write_campaign(replace(campaign, name=name), tmp_path / name, simulated=True)
    law = tmp_path / "law.toml"
    diagnose_campaign.main(tmp_path / "first", out=tmp_path / "d1", save_law=law, quiet=True)
    second = diagnose_campaign.main(tmp_path / "second", out=tmp_path / "d2", law=[law], quiet=True)
    assert second.verdict in NAMING
    assert second.attribution.effects == ("hysteresis_of_first",)
    assert second.reduction.phi > 0.98
