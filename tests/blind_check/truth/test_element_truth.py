"""Cases of the element's truth: gap, noise, change of form, strata."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from carrierflex.blind_check.case_plans import case_plans, full_size
from carrierflex.blind_check.labels import NOTHING, OUTSIDE, PAIR, SINGLE, CasePlan
from carrierflex.blind_check.truth.campaigns import write_case
from carrierflex.blind_check.truth.element.drawing import (
    _with_cause,
    drawn_element,
    reference_motion,
    sized_drives,
    with_causes,
)
from carrierflex.blind_check.truth.element.drives import (
    DRIVES,
    MULTISINE,
    NOISE,
    ONE_SINE,
    STRATUM,
    SWEEPS,
    drawn_drives,
)
from carrierflex.blind_check.truth.element.element import Element
from carrierflex.blind_check.truth.element.families import CAUSES
from carrierflex.blind_check.truth.element.parameters import true_parameters
from carrierflex.blind_check.truth.element.refit import DecayRefit, ForcedRefit
from carrierflex.blind_check.truth.element.truth import _drawn_case
from carrierflex.blind_check.truth.noise import case_rng, largest_leak, root_mean_square
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
    own = reference.missing(forces[0])
    np.testing.assert_allclose(changed / own, 0.2, rtol=0.03)


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
        left = np.array(refit.residuals(signals))
        assert left.std() < 3e-3 * np.array(signals).std()


def test_refit_of_linear_decays_leaves_nothing():
    time = 0.01 * np.arange(500.0)
    swings = [
        1e-4 + start * np.exp(-0.3 * time) * np.cos(np.sqrt(100.0 - 0.09) * time)
        for start in (1e-3, 2e-3)
    ]
    left = DecayRefit(0.01, 10.3, 0.02).residuals(swings)
    assert np.abs(left).max() < 1e-9


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
    seen = set()
    for seed in range(12):
        rng = np.random.default_rng(seed)
        element, changes = with_causes(rng, ["cubic_spring"], plain, reference, 2.0, 1)
        values = true_parameters(["cubic_spring"], changes, element, is_decay=False)
        assert bool(values) is (changes == (0.0,))
        assert changes == (0.0,) or 0.05 <= changes[0] <= 0.30
        seen.add(bool(values))
        if values:
            q = reference.columns[:, 0]
            cube = values["cubic_stiffness"]["K3"] * q**3
            np.testing.assert_allclose(reference.missing(cube), 2.0, rtol=1e-6)
            assert values["baseline"]["K1"] == plain.base[1]
    assert seen == {True, False}


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
    seen = {ids for plan in plans for name in plan.effects for ids in CAUSES[name].classes}
    assert len(seen) == 9


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
    case, signals = _drawn_case(plan, case_rng(plan))
    left = np.array(case.baseline(signals))
    straight = replace(case, element=replace(case.element, laws=case.element.laws[:-2]))
    leaked = left - np.array(case.baseline(straight.signals(straight.element)))
    ratio = root_mean_square(leaked) / root_mean_square(left) * plan.ratio
    assert 0.19 * largest_leak(plan) < ratio < 1.05 * largest_leak(plan)
