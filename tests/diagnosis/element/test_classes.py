"""Classes of an element whose missing force is known and, mostly, no law of the library."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

import carrierflex.diagnosis.element.table as element_table
from carrierflex.diagnosis.classes.columns import dahl_friction, relaxing_branches, stops
from carrierflex.diagnosis.classes.results import NAMED_CLASS, NO_CLASS, NOTHING
from carrierflex.diagnosis.classes.shapes import shape_words
from carrierflex.diagnosis.element.force_records import (
    fold_of,
    force_records,
    where_folds_overlap,
    while_sliding,
)
from carrierflex.diagnosis.element.motion import with_all_lines
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.element.table import _is_switched_on, table_of
from carrierflex.simulation.element.law_forces import element_law
from carrierflex.simulation.element.memory_laws import FIRST_FORCE
from tests.diagnosis.element.element_campaigns import (
    DAMPING,
    MASS,
    STEP,
    STIFFNESS,
    displacement_campaign,
    force_campaign,
    no_law,
)

HALF = 2.0e-3


def answer(campaign):
    return element_problem(campaign).class_answer()


def along(force):
    """Campaign whose missing force is ``force(time, q)`` with its own memory."""
    plain = displacement_campaign(lambda q, v: 0.0 * q, n=2000)
    runs = []
    for run in plain.runs:
        extra = force(run.time, run.inputs["displacement"])
        runs.append(replace(run, signals={"F": run.signals["F"] + extra}))
    return replace(plain, runs=tuple(runs))


def test_a_stop_on_one_side_is_a_restoring_force_by_no_law_with_its_play_in_words():
    result = answer(displacement_campaign(lambda q, v: 2e4 * np.maximum(q - 6e-4, 0.0), n=2000))
    assert (result.state, result.ids) == (NAMED_CLASS, ("restoring_force",))
    law = result.classes[0]
    assert not law.law_named
    assert law.law_share < 0.9 < law.share
    shape = law.shape
    assert shape is not None
    # Nothing on the other side and below the play, whatever stiffness the baseline took up.
    assert np.abs(shape.y[shape.x < 5e-4]).max() < 0.05 * np.abs(shape.y).max()
    inner = (shape.x > 1e-3) & (shape.x < 0.9 * shape.x.max())
    assert_allclose(shape.y[inner], 2e4 * (shape.x[inner] - 6e-4), rtol=0.1)
    assert "one side only" in shape.words
    assert "zero below 0." in shape.words
    assert (shape.band[:, 0] <= shape.band[:, 1]).all()


def test_columns_of_long_runs_in_single_precision_leave_what_those_in_double_leave(monkeypatch):
    """Their rounding is far below the noise, which is 1e-6 of the force here (squares)."""
    problem = element_problem(displacement_campaign(lambda q, v: 3.0 * np.sign(v), n=2000))
    table = problem.class_table
    monkeypatch.setattr(element_table, "_LONG", 0)
    single = table_of(table, table.scores.constants)
    for name in ("dissipation", "hysteresis", "restoring_force"):
        remaining = [one.scores.of((name,)).total for one in (table, single)]
        assert remaining[1] == pytest.approx(remaining[0], rel=1e-5)
        assert remaining[1] != remaining[0]


def test_friction_by_no_law_is_dissipation():
    result = answer(
        displacement_campaign(lambda q, v: 3.0 * np.tanh(v / 5e-3) * (1 + v**2), n=2000)
    )
    assert result.ids == ("dissipation",)
    assert "dry friction, about" in result.classes[0].shape.words


@pytest.mark.parametrize("friction", [3.0, 12.0])
def test_the_step_at_rest_is_the_whole_friction_with_its_bristles(friction):
    # Bristles that turn over 1 % of the motion carry all of it, the columns of the speed nothing.
    turning = along(lambda time, q: friction * dahl_friction(q, np.array([2e-5]))[0])
    finding = answer(turning).classes[0]
    assert finding.id == "dissipation"
    assert_allclose(finding.shape.steps, friction, rtol=0.15)
    law = element_law(finding.measured_law)
    slips = law.memory.stops[:, FIRST_FORCE:].sum()
    assert_allclose(law.friction + slips, finding.shape.steps, rtol=1e-6)
    assert slips > 0.5 * friction


def test_a_slider_that_grips_harder_outwards_is_a_hysteresis():
    def lopsided(time, q):
        z = stops(q, np.array([2e-4, 6e-4])).sum(axis=0)
        return 3.0 * z * (1.0 + 0.5 * q / np.abs(q).max())

    result = answer(along(lopsided))
    assert result.ids == ("hysteresis",)
    assert "outwards" in result.classes[0].shape.words


@pytest.mark.long
def test_friction_that_turns_over_a_short_travel_is_dissipation_and_over_a_long_one_hysteresis():
    def dahl(length):
        return answer(along(lambda time, q: 4.0 * dahl_friction(q, np.array([length]))[0]))

    for length in (0.01, 0.035):
        short = dahl(length * HALF)
        assert ("dissipation",) in (short.ids, *short.ties)
    assert dahl(0.3 * HALF).ids == ("hysteresis",)


def test_sliders_and_branches_from_rest_are_relaxed_at_the_first_sample():
    x = HALF * (0.3 + np.linspace(0.0, 1.0, 50))
    slider, branch = (
        stops(x, np.array([0.4 * HALF]), from_rest=True)[0],
        relaxing_branches(x, np.array([1e6]), STEP, from_rest=True)[0],
    )
    assert_allclose(slider, np.minimum((x - x[0]) / (0.4 * HALF), 1.0), atol=1e-12)
    assert_allclose(branch, x - x[0], rtol=1e-5, atol=1e-12)
    # Played backwards first, the slider stands where the way down has left it.
    assert_allclose(stops(x, np.array([0.4 * HALF]))[0][0], -1.0)


def test_a_run_is_switched_on_where_its_drive_grows_from_rest():
    problem = element_problem(displacement_campaign(lambda q, v: 0.0 * q, n=2000))
    record = force_records(problem.model, problem.records)[0]
    assert not _is_switched_on(record)
    t = np.linspace(0.0, 1.0, record.x.size)
    grown = replace(record.record, drive=record.record.drive * np.clip(8.0 * t, 0.0, 1.0) ** 3)
    assert _is_switched_on(replace(record, record=grown))
    # Of one sample nothing is known.
    single = np.where(np.arange(record.x.size) == 1000, 0, -1)
    assert not _is_switched_on(replace(record, record=grown, block=single))


def test_a_slider_with_a_spring_that_hardens_is_a_hysteresis():
    def hardening(time, q):
        z = stops(q, np.array([0.25 * HALF]))[0]
        return 3.0 * (z + 0.8 * z**3)

    result = answer(along(hardening))
    assert result.ids == ("hysteresis",)
    assert result.share > 0.96


def test_two_relaxing_springs_are_one_memory():
    def branches(time, q):
        return 2e3 * relaxing_branches(q, np.array([0.05, 0.5]), STEP).sum(axis=0)

    assert answer(along(branches)).ids == ("memory",)


def test_what_one_fold_alone_visits_does_not_count():
    problem = element_problem(displacement_campaign(lambda q, v: 0.0 * q, n=2000))
    unfiltered = force_records(problem.model, problem.records)
    peak = max(range(len(unfiltered)), key=lambda k: unfiltered[k].x[unfiltered[k].counts].max())
    sample = np.flatnonzero(unfiltered[peak].counts)[
        np.argmax(unfiltered[peak].x[unfiltered[peak].counts])
    ]
    overlapping = where_folds_overlap(unfiltered, 4)
    assert overlapping[peak].block[sample] == -1
    # Every end that is left is visited by two folds at least.
    folds = [fold_of(record, number, 4) for number, record in enumerate(overlapping)]
    for name, end in (("x", np.max), ("x", np.min), ("v", np.max), ("v", np.min)):
        ends = [
            end(
                np.concatenate(
                    [getattr(r, name)[of == k] for r, of in zip(overlapping, folds, strict=True)]
                )
            )
            for k in range(4)
        ]
        second = sorted(ends, key=abs)[-2]
        before = [getattr(r, name)[r.counts] for r in unfiltered]
        assert abs(second) > 0.5 * abs(end(np.concatenate(before)))
    assert sum(r.counts.sum() for r in overlapping) > 0.95 * sum(r.counts.sum() for r in unfiltered)


@pytest.mark.long
def test_motion_under_a_force_holds_the_lines_that_noise_does_not_make():
    clean = force_campaign(lambda q, v: 5e8 * q**3, noise=0.0)
    noisy = force_campaign(lambda q, v: 5e8 * q**3, noise=1e-5)
    problem = element_problem(noisy)
    record = with_all_lines(problem.model, problem.records[2])
    assert record.flat_hz > 1.2 * problem.records[2].flat_hz
    force_record = force_records(problem.model, [record])[0]
    inner = force_record.counts
    true = element_problem(clean).records[2].motion[1][inner]
    measured = record.motion[1][inner]
    # The nearest speed is nearer than what was measured, and its error is the one that is told.
    assert np.std(force_record.v[inner] - true) < np.std(measured - true)
    assert np.std(force_record.v[inner] - true) == pytest.approx(force_record.speed_error, rel=0.5)


def test_damping_that_depends_on_deflection_is_coupled():
    result = answer(displacement_campaign(lambda q, v: 60.0 * np.abs(q) / HALF * v, n=2000))
    assert result.ids == ("coupled_damping",)


def test_a_stiffness_that_falls_in_every_run_is_a_change_with_time():
    result = answer(along(lambda time, q: -2e3 * q * time / time[-1]))
    assert result.ids == ("time_variation",)


def warming(frequencies):
    """Element whose stiffness falls by a quarter in every run, moved by sines [Hz]."""
    plain = displacement_campaign(lambda q, v: 0.0 * q, n=2000)
    rng = np.random.default_rng(4)
    runs = []
    for run in plain.runs:
        t = run.time
        w = 2.0 * np.pi * np.array(frequencies)
        q = HALF * np.sin(np.outer(t, w) + rng.uniform(0.0, 6.0, w.size)).mean(axis=1)
        force = 8e3 * q * (1.0 - 0.25 * t / t[-1]) + 0.05 * rng.standard_normal(t.size)
        runs.append(replace(run, inputs={"displacement": q}, signals={"F": force}))
    return replace(plain, runs=tuple(runs))


@pytest.mark.long
def test_a_change_with_time_is_asked_only_of_drives_with_two_frequencies():
    assert answer(warming((2.13, 3.57))).ids == ("time_variation",)
    result = answer(warming((2.13,)))
    assert result.state != NOTHING
    assert "time_variation" not in (*result.ids, *result.rivals)
    assert "one frequency drives all runs" in result.note


@pytest.mark.long
def test_three_causes_are_no_class_and_are_to_be_recorded_apart():
    def three(q, v):
        slider = 4.0 * stops(q, np.array([6e-4]), from_rest=False)[0]
        branch = relaxing_branches(q, np.array([0.1]), STEP, from_rest=False)[0]
        return slider + 4e8 * q**3 + 4e3 * branch

    result = answer(displacement_campaign(three, n=2000))
    assert result.state == NO_CLASS
    assert result.learnable > result.share + 0.025
    assert result.experiment.startswith("record small and large deflections")
    assert "all classes together explain more" in result.note


def test_nothing_missing_is_nothing_under_both_drives():
    assert answer(displacement_campaign(lambda q, v: 0.0 * q, n=2000)).state == NOTHING
    assert answer(force_campaign(no_law)).state == NOTHING


def test_a_cube_is_named_under_a_force():
    result = answer(force_campaign(lambda q, v: 5e8 * q**3))
    assert result.ids == ("restoring_force",)
    assert (result.classes[0].law, result.classes[0].law_named) == ("cubic_stiffness", True)


def test_the_floor_of_a_filtered_record_is_not_its_plateau():
    plain = displacement_campaign(lambda q, v: 4.0 * np.sign(v), n=2000)
    b = np.hanning(17) / np.hanning(17).sum()
    runs = []
    for run in plain.runs:
        # The same filter on both signals: the element keeps its law within the band.
        inputs = {"displacement": lfilter(b, 1.0, lfilter(b, 1.0, run.inputs["displacement"]))}
        signals = {"F": lfilter(b, 1.0, lfilter(b, 1.0, run.signals["F"]))}
        runs.append(replace(run, inputs=inputs, signals=signals))
    channel = replace(plain.channels[0], noise_std=None)
    problem = element_problem(replace(plain, runs=tuple(runs), channels=(channel,)))
    assert "cannot be known" in problem.noise_note
    result = problem.class_answer()
    scores = problem.class_table.scores
    assert scores.of(result.ids).total < 9.0 * scores.table.floor.sum()
    assert "cannot be known" in result.note


def test_a_slider_follows_its_spring_and_slips_at_its_yield():
    x = np.concatenate([np.linspace(0.0, 3.0, 301), np.linspace(3.0, -3.0, 601)])
    z = stops(x, np.array([1.0]))[0]
    assert z[300] == pytest.approx(1.0)
    # Half of the way back from the turning point it carries nothing, then slips the other way.
    assert z[401] == pytest.approx(0.0, abs=1e-9)
    assert_allclose(z[501:], -1.0, atol=1e-9)


def test_dry_friction_with_presliding_turns_over_its_length():
    x = np.concatenate([np.linspace(0.0, 9.0, 901), np.linspace(9.0, 0.0, 901)])
    z = dahl_friction(x, np.array([1.0]))[0]
    assert z[900] == pytest.approx(1.0, abs=1e-3)
    # dz/dx = 1 + z on the way back: z = -1 + 2 exp(-d).
    assert z[1001] == pytest.approx(-1.0 + 2.0 * np.exp(-1.0), abs=1e-3)


def test_a_relaxing_spring_forgets_a_step():
    x = np.concatenate([np.zeros(400), np.ones(400)])
    z = relaxing_branches(x, np.array([0.1]), 1e-3)[0]
    assert z[400 + 100] == pytest.approx(np.exp(-1.0), rel=0.02)


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (lambda x: x**3, "stiffening"),
        (lambda x: -(x**3), "softening"),
        (lambda x: np.maximum(x - 0.4, 0.0) ** 2, "zero below"),
        (lambda x: np.maximum(x, 0.0) ** 3, "one side only"),
    ],
)
def test_springs_in_words(law, words):
    x = np.linspace(-1.0, 1.0, 81)
    assert words in shape_words("restoring_force", x, law(x), ("m", "N"))


def test_sides_of_a_spring_are_compared_at_the_same_deflection():
    x = np.linspace(-1.0, 0.6, 81)
    assert "other side" not in shape_words("restoring_force", x, x**3, ("m", "N"))
    unequal = np.where(x > 0.0, 1.0, 0.5) * x**3
    assert "50% as strong on the other side" in shape_words(
        "restoring_force", x, unequal, ("m", "N")
    )
    # Nothing is known of a stop on a side that did not go that far, whatever the noise says.
    stop = np.maximum(-x - 0.7, 0.0) + 1e-4 * np.where(x > 0.0, x, 0.1 * x)
    words = shape_words("restoring_force", x, stop, ("m", "N"))
    assert "side" not in words
    assert "zero below 0.7" in words


def test_a_branch_that_relaxes_slower_than_the_records_has_no_time_of_half():
    t = np.geomspace(1e-3, 1.0, 81)
    words = [shape_words("memory", t, np.exp(-t / tau), ("s", "N/m")) for tau in (0.1, 10.0)]
    assert words[0].endswith("half of it after 0.075 s")
    assert words[1].endswith("half of it later than 1 s")


def test_free_play_beside_a_spring_that_was_fitted_with_it_is_not_zero_where_the_curve_crosses():
    """A play of 0.4 mm: the fitted spring is too soft, the curve crosses zero far outside."""
    x = np.linspace(0.0, 10e-3, 81)
    play = -2.4e7 * np.minimum(x, 0.4e-3) + 1.9e6 * x
    words = shape_words("restoring_force", x, play, ("m", "N"))
    assert words.startswith("-8.65 kN at 0.5 mm, then 9.4 kN at 10 mm")
    assert "zero" not in words


def sweep_campaign(law):
    """Force sweeps through the resonance and far beyond it, where the motion sinks into noise."""
    rng = np.random.default_rng(3)
    plain = force_campaign(no_law)
    time = plain.runs[0].time
    runs = []
    for number, (first, last) in enumerate(((2.0, 60.0), (60.0, 2.0))):
        rate = np.log(last / first) / time[-1]

        def force(t, first=first, rate=rate):
            return 30.0 * np.sin(2.0 * np.pi * first * np.expm1(rate * t) / rate)

        def slope(t, y, force=force):
            net_force = force(t) - STIFFNESS * y[0] - DAMPING * y[1] - law(y[0], y[1])
            return [y[1], net_force / MASS]

        fine = solve_ivp(slope, (0.0, time[-1]), [0.0, 0.0], "DOP853", time, rtol=1e-8, atol=1e-12)
        q = fine.y[0] + 2e-5 * rng.standard_normal(time.size)
        runs.append(replace(plain.runs[number], inputs={"force": force(time)}, signals={"q": q}))
    channel = replace(plain.channels[0], noise_std=2e-5)
    return replace(plain, rig={"drive": "force"}, channels=(channel,), runs=tuple(runs))


@pytest.mark.long
def test_a_sweep_counts_where_its_motion_lies_in_the_trusted_band():
    problem = element_problem(sweep_campaign(lambda q, v: 40.0 * v * np.abs(v)))
    records = force_records(problem.model, problem.records)
    for record in records:
        assert record.weight.band_hz < 50.0
        # What counts goes through the resonance, and ends before the band does.
        rate = np.log(30.0) / record.record.step / record.x.size
        time = np.flatnonzero(record.counts) * record.step
        at = (
            2.0 * np.exp(rate * time) if record.record.name == "R0" else 60.0 * np.exp(-rate * time)
        )
        assert at.min() < 8.0
        assert 12.0 < at.max() < 1.2 * record.weight.band_hz
    result = problem.class_answer()
    assert result.ids == ("dissipation",)
    assert result.share > 0.98


def test_a_mass_that_stands_still_does_not_count_and_one_that_turns_round_does():
    problem = element_problem(force_campaign(no_law))
    record = force_records(problem.model, problem.records)[0]
    speed = float(np.abs(record.v).max())
    assert_array_equal(while_sliding(record, 1e-6 * speed).counts, record.counts)
    still = slice(500, 600)
    v = record.v.copy()
    v[still] = 0.0
    sliding = while_sliding(replace(record, v=v), 1e-6 * speed)
    assert not sliding.counts[still].any()
    assert_array_equal(np.delete(sliding.counts, still), np.delete(record.counts, still))
    for still in ({"v": 0.0 * v}, {"v": 0.0 * v, "a": 0.0 * v}):
        assert while_sliding(replace(record, **still), 1e-6 * speed) is None


@pytest.mark.parametrize(("drop", "law"), [(0.8, "backlash"), (-0.8, "cubic_stiffness")])
def test_play_is_near_a_spring_that_is_softer_at_rest_alone(drop, law):
    """A spring that is softer beyond 0.6 mm is play of a negative stiffness, which there is not."""
    play = displacement_campaign(
        lambda q, v: -drop * STIFFNESS * np.clip(q, -0.6e-3, 0.6e-3), amplitudes=(1e-3, 2e-3, 4e-3)
    )
    (finding,) = element_problem(play).class_answer().classes
    assert finding.id == "restoring_force"
    assert finding.law == law
    assert (finding.law_share > 0.95) == (law == "backlash")


def bristles(run):
    """Force of LuGre's bristles: 5 N sliding, 8 N at rest, stiff within 0.04 mm."""
    fine = np.linspace(run.time[0], run.time[-1], 40 * run.time.size)
    q = CubicSpline(run.time, run.inputs["displacement"])
    v, step, z = q(fine, 1), fine[1] - fine[0], 0.0
    force = np.empty(fine.size)
    for k, speed in enumerate(v):
        length = (5.0 + 3.0 * np.exp(-((speed / 0.005) ** 2))) / 2e5
        rate = speed - abs(speed) / length * z
        z = (z + step * speed) / (1.0 + step * abs(speed) / length)
        force[k] = 2e5 * z + 20.0 * rate
    return np.interp(run.time, fine, force)


def stribeck(run):
    q = CubicSpline(run.time, run.inputs["displacement"])
    v = q(run.time, 1)
    return np.sign(v) * (5.0 + 3.0 * np.exp(-((v / 0.01) ** 2)))


@pytest.mark.parametrize("friction", [bristles, stribeck])
def test_friction_that_falls_with_speed_is_no_force_surface(friction):
    plain = displacement_campaign(no_law, n=2000)
    runs = tuple(
        replace(run, signals={"F": run.signals["F"] + friction(run)}) for run in plain.runs
    )
    result = answer(replace(plain, runs=runs))
    assert result.ids == ("dissipation",)
    assert result.classes[0].shape.words.startswith("dry friction")
