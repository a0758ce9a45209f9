"""Cases of the element's truth: gap, noise, change of form, strata."""

import tomllib
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from carrierflex.blind_check.case_plans import case_plans, full_size
from carrierflex.blind_check.element_plans import DRIVEN_SIZE
from carrierflex.blind_check.labels import DECAYS, NOTHING, OUTSIDE, PAIR, SINGLE, CasePlan
from carrierflex.blind_check.truth.campaigns import case_campaign, write_case
from carrierflex.blind_check.truth.element.case import DecayRefit, ForcedRefit, samples
from carrierflex.blind_check.truth.element.drawing import (
    _with_cause,
    drawn_element,
    sized_drives,
    with_causes,
)
from carrierflex.blind_check.truth.element.drives import (
    DECAY,
    DRIVES,
    MULTISINE,
    NOISE,
    ONE_SINE,
    STRATUM,
    SWEEPS,
    Release,
    drawn_drives,
)
from carrierflex.blind_check.truth.element.element import Element
from carrierflex.blind_check.truth.element.families import CAUSES
from carrierflex.blind_check.truth.element.reference import reference_motion
from carrierflex.blind_check.truth.element.truth import _drawn_case, true_parameters
from carrierflex.blind_check.truth.noise import case_rng, largest_leak, root_mean_square
from carrierflex.diagnosis.kinds import problem_of
from carrierflex.identification.campaign.campaign_files import read_campaign

N = 600


@pytest.fixture(scope="module")
def driven():
    """A driven element and its reference motion."""
    rng = np.random.default_rng(4)
    plain = replace(drawn_element(rng, MULTISINE), by_force=False)
    drives = drawn_drives(
        rng, MULTISINE, omega=plain.omega, duration=N * plain.step, growth=0.1, by_force=False
    )
    drives = sized_drives(rng, plain, drives, N)
    return plain, reference_motion(plain, drives[-1], N), drives


@pytest.mark.parametrize("name", ["cubic_spring", "coulomb", "slider", "maxwell", "saturation"])
def test_change_of_form_is_as_drawn(name, driven):
    plain, reference, drives = driven
    forces = []
    for change in (0.0, 0.2):
        rng = np.random.default_rng(8)
        element = _with_cause(rng, name, change, 1.0, plain, reference, 1)
        fine = element._driven_force(drives[-1], 0, N) - plain._driven_force(drives[-1], 0, N)
        forces.append(fine)
    if name != "saturation":  # whose size is that of its unchanged force
        forces[1] *= element_size(name, 0.2, driven) / element_size(name, 0.0, driven)
    changed = reference.missing(forces[1] - forces[0])
    unchanged = reference.missing(forces[0])
    np.testing.assert_allclose(changed / unchanged, 0.2, rtol=0.03)


def element_size(name, change, driven):
    """What one newton of size is divided by."""
    plain, reference, _ = driven
    element = _with_cause(np.random.default_rng(8), name, change, 1.0, plain, reference, 1)
    return 1.0 / element.laws[0].scale[0]


@pytest.mark.long
def test_refit_of_a_linear_element_leaves_nothing():
    rng = np.random.default_rng(3)
    plain = replace(drawn_element(rng, SWEEPS), by_force=True)
    for kind in (SWEEPS, ONE_SINE):
        drives = drawn_drives(
            rng, kind, omega=plain.omega, duration=N * plain.step, growth=0.1, by_force=True
        )
        signals = [plain.channel(drive, 0, N) for drive in drives]
        time = plain.step / 8 * np.arange((N - 1.0) * 8 + 1.0)
        wrong = plain.base * (1.05, 0.97, 1.3, 1.0)
        refit = ForcedRefit([drive.at(time) for drive in drives], plain.step / 8, 8, wrong, 100)
        residual = np.array(refit.residuals(signals))
        assert residual.std() < 3e-3 * np.array(signals).std()


@pytest.mark.long
def test_a_refit_that_runs_away_ends():
    """One mass on a spring cannot answer as one with a mass on top of it: no refit holds."""
    plan = CasePlan("element", 36, 51002, OUTSIDE, ("tuned_mass",), 0.709, "sines")
    _, label = case_campaign(plan)
    assert label.gap_over_floor == pytest.approx(0.709)
    assert 0.0 < label.floor < 1e-3


def test_refit_of_linear_decays_leaves_nothing():
    time = 0.01 * np.arange(500.0)
    swings = [
        1e-4 + start * np.exp(-0.3 * time) * np.cos(np.sqrt(100.0 - 0.09) * time)
        for start in (1e-3, 2e-3)
    ]
    residual = DecayRefit(0.01, 10.3, 0.02).residuals(swings)
    assert np.abs(residual).max() < 1e-9


@pytest.mark.parametrize("ratio", [0.01, 0.08])
def test_a_release_decays_as_the_exact_solution_does(ratio):
    omega, preload, start = 20.0, 3.0, 2e-3
    element = Element(np.array([10.0, 4000.0, 2.0 * ratio * 10.0 * omega, preload]), omega, True)
    result = element.channel(Release(start), 0, 400)
    time = element.step * np.arange(400.0)
    turn = omega * np.sqrt(1.0 - ratio**2)
    rest = -preload / 4000.0
    # At rest when it is let go.
    shape = np.cos(turn * time) + ratio * omega / turn * np.sin(turn * time)
    exact = rest + (start - rest) * np.exp(-ratio * omega * time) * shape
    np.testing.assert_allclose(result, exact, atol=1e-7 * start)


def test_decays_are_a_campaign_without_a_drive(tmp_path):
    plan = CasePlan("element", 3, 9, SINGLE, ("cubic_spring",), 6.0, DECAY)
    label = write_case(plan, tmp_path / "case")
    campaign = read_campaign(tmp_path / "case")
    assert tomllib.loads((tmp_path / "case" / "campaign.toml").read_text())["version"] == 2
    assert campaign.rig == {"drive": "free_decay"}
    assert campaign.inputs == ()
    assert all(run.inputs == {} for run in campaign.runs)
    assert 4 <= len(campaign.runs) <= 6
    starts = [abs(float(run.signals["measured_displacement"][0])) for run in campaign.runs]
    assert starts == sorted(starts)
    assert starts[-1] > 1.9 * starts[0]
    assert (label.drive, label.classes) == (DECAY, ("restoring_force",))
    assert label.gap_over_floor == pytest.approx(6.0, rel=1e-6)


def test_decays_last_until_they_have_all_but_stopped():
    ratios = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        plain = drawn_element(rng, DECAY)
        ratios.append(plain.damping_ratio)
        n = samples(DECAY, plain)
        remaining = np.exp(-plain.damping_ratio * plain.omega * n * plain.step)
        assert remaining == pytest.approx(0.01, rel=0.05) or (n == 1200 and remaining > 0.01)
    assert 0.01 <= min(ratios) < 0.02
    assert 0.06 < max(ratios) <= 0.08


def test_decays_are_drawn_beside_the_cases_of_a_seed_not_among_them():
    asked = case_plans("element", 60, 5, (DECAYS,))
    assert {plan.drive for plan in asked} == {DECAY}
    assert Counter(plan.family for plan in asked) == {
        SINGLE: 30,
        PAIR: 10,
        NOTHING: 10,
        OUTSIDE: 10,
    }
    causes = {ids for plan in asked for name in plan.effects for ids in CAUSES[name].classes}
    # A decay has no drive to be late or unequal, and is one line that falls with time.
    assert causes == {
        "restoring_force",
        "dissipation",
        "hysteresis",
        "coupled_damping",
        "force_surface",
    }
    driven = case_plans("element", DRIVEN_SIZE, 5)
    full = case_plans("element", full_size("element"), 5)
    assert full[:DRIVEN_SIZE] == driven
    assert DECAY not in {plan.drive for plan in driven}
    assert {plan.drive for plan in full[DRIVEN_SIZE:]} == {DECAY}
    assert [plan.number for plan in full] == list(range(1, len(full) + 1))


@pytest.mark.long
@pytest.mark.parametrize("seed", [11, 12, 13, 14, 15])
def test_a_decay_with_nothing_missing_is_silent(seed):
    campaign, _ = case_campaign(CasePlan("element", 1, seed, NOTHING, (), 0.0, DECAY))
    answer = problem_of(campaign).class_answer()
    assert answer is None or answer.state == "nothing"


@pytest.mark.long
@pytest.mark.parametrize("number", [2])
def test_gap_is_as_planned_and_noise_as_declared(number, tmp_path):
    plan = CasePlan("element", number, 9, SINGLE, ("coulomb",), 6.0, MULTISINE)
    label = write_case(plan, tmp_path / "case")
    campaign = read_campaign(tmp_path / "case")
    assert label.gap_over_floor == pytest.approx(6.0, rel=1e-6)
    assert campaign.channels[0].noise_std == pytest.approx(label.floor)
    assert label.rho == pytest.approx(1.0 / np.sqrt(37.0))
    assert (label.classes, label.class_aliases) == (("dissipation",), (("hysteresis",),))
    assert label.drive == MULTISINE
    assert len(label.changes) == 1


def residual_of_own_baseline(campaign):
    """RMS left by mass, spring, damper and offset in a driven run.

    By derivatives of the measured input alone.
    """
    settle, residuals = campaign.rig["settle_samples"], []
    for run in campaign.runs:
        q, force = run.inputs["displacement"], run.signals["measured_force"]
        step = run.time[1] - run.time[0]
        spectrum, omega = np.fft.rfft(q), 2.0 * np.pi * np.fft.rfftfreq(q.size, step)
        rows = [np.fft.irfft(spectrum * (1j * omega) ** n, q.size) for n in (0, 1, 2)]
        # The transform takes the record for periodic: away from its ends.
        inner = slice(2 * settle, -settle)
        matrix = np.array([*rows, np.ones_like(q)]).T[inner]
        solution = np.linalg.lstsq(matrix, force[inner], rcond=None)[0]
        residuals.append(force[inner] - matrix @ solution)
    return np.sqrt(np.mean(np.square(residuals)))


@pytest.mark.parametrize(
    ("family", "effects", "ratio"),
    [(NOTHING, (), 0.0), (OUTSIDE, ("random_disturbance",), 5.0)],
)
def test_nothing_is_left_but_noise_where_nothing_is_missing(family, effects, ratio, tmp_path):
    driven_case = next(
        number
        for number in range(1, 20)
        if not drawn_for(CasePlan("element", number, 9, family, effects, ratio, MULTISINE))
    )
    plan = CasePlan("element", driven_case, 9, family, effects, ratio, MULTISINE)
    label = write_case(plan, tmp_path / family)
    residual = residual_of_own_baseline(read_campaign(tmp_path / family)) / label.floor
    assert (0.9 < residual < 1.15) if family == NOTHING else (residual > 4.0)
    assert label.classes == ()


def drawn_for(plan) -> bool:
    """Whether the case of a plan is driven by a force."""
    from carrierflex.blind_check.truth.noise import case_rng

    element: Element = drawn_element(case_rng(plan), plan.drive)
    return element.by_force


def test_textbook_laws_have_true_parameters_and_changed_ones_none(driven):
    plain, reference, _ = driven
    has_values = set()
    for seed in range(12):
        rng = np.random.default_rng(seed)
        element, changes = with_causes(rng, ["cubic_spring"], plain, reference, 2.0, 1)
        values = true_parameters(["cubic_spring"], changes, element, is_decay=False)
        assert bool(values) is (changes == (0.0,))
        assert changes == (0.0,) or 0.05 <= changes[0] <= 0.30
        has_values.add(bool(values))
        if values:
            q = reference.columns[:, 0]
            cube = values["cubic_stiffness"]["K3"] * q**3
            np.testing.assert_allclose(reference.missing(cube), 2.0, rtol=1e-6)
            assert values["baseline"]["K1"] == plain.base[1]
    assert has_values == {True, False}


def test_a_full_check_holds_200_clear_cases_of_every_stratum_with_a_target():
    plans = case_plans("element", full_size("element"), 5)
    clear = [plan for plan in plans if plan.family in (SINGLE, PAIR) and plan.ratio >= 2.0]
    strata = Counter(STRATUM[plan.drive] for plan in clear)
    assert min(strata["wide_band"], strata["levels"]) >= 195
    families = Counter(plan.family for plan in plans)
    assert min(families[NOTHING], families[OUTSIDE]) >= 200
    assert {plan.drive for plan in plans} <= set(DRIVES)
    for plan in plans:
        classes = [ids for name in plan.effects for ids in CAUSES[name].classes]
        assert len(classes) == len(set(classes))
        assert plan.family != PAIR or len(classes) == 2
    drawn_classes = {ids for plan in plans for name in plan.effects for ids in CAUSES[name].classes}
    assert len(drawn_classes) == 9


def test_pairs_and_outside_causes_meet_every_drive():
    plans = case_plans("element", full_size("element"), 7)
    for stratum in ("wide_band", "levels"):
        in_stratum = [plan for plan in plans if STRATUM[plan.drive] == stratum]
        pairs = Counter(plan.drive for plan in in_stratum if plan.family == PAIR)
        assert len(pairs) == 2
        assert max(pairs.values()) - min(pairs.values()) <= 1
    outside = Counter((plan.drive, plan.effects) for plan in plans if plan.family == OUTSIDE)
    driven = {drive for drive, _ in outside} - {DECAY}
    assert len([pair for pair in outside if pair[0] in driven]) == len(driven) * 5


def test_linear_causes_are_not_asked_of_one_frequency():
    plans = case_plans("element", full_size("element"), 6)
    for plan in plans:
        if STRATUM[plan.drive] == "single_level":
            classes = {ids for name in plan.effects for ids in CAUSES[name].classes}
            assert not classes & {"memory", "delay", "time_variation"}


@pytest.mark.long
@pytest.mark.parametrize("effect", ["late_sensor", "exponential_coupling"])
def test_a_baseline_a_little_wrong_leaves_no_more_than_it_may(effect):
    # A delay of a sample leaves less than a force of the drawn size; a coupling that takes damping
    # away makes more of a small force.
    plan = CasePlan("element", 1, 6, SINGLE, (effect,), 8.0, NOISE)
    case = _drawn_case(plan, case_rng(plan))
    residual = np.array(case.baseline(case.channels))
    straight = replace(case, element=replace(case.element, laws=case.element.laws[:-2]))
    leaked = residual - np.array(case.baseline(straight.channels))
    ratio = root_mean_square(leaked) / root_mean_square(residual) * plan.ratio
    assert 0.19 * largest_leak(plan) < ratio < 1.05 * largest_leak(plan)
