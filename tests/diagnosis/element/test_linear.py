"""The linear element behind noisy deflections, and what a record's ends do to its derivatives."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import cont2discrete, lfilter

from carrierflex.blind_check.labels import NOTHING, CasePlan
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.diagnosis.element import signatures
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.element.records import element_records
from carrierflex.diagnosis.element.signatures import _linear_element
from carrierflex.diagnosis.inference.effect_fit import fit_effects, mean_square_left
from carrierflex.diagnosis.kinds import problem_of
from tests.diagnosis.element.element_campaigns import (
    DAMPING,
    MASS,
    STIFFNESS,
    displacement_campaign,
    force_campaign,
    no_law,
)


@pytest.fixture(scope="module")
def noisy_records():
    """Deflections with half their own size in noise."""
    campaign = force_campaign(no_law, amplitudes=(2.0, 2.0), noise=1e-4)
    return element_records(campaign)


def test_noise_in_the_deflection_does_not_bias_the_element(noisy_records):
    poor = (0.05 * MASS, 0.5 * STIFFNESS, DAMPING, 0.0)
    m, K1, C1, f0 = _linear_element(noisy_records, poor, mass=None)
    assert_allclose([m, K1], [MASS, STIFFNESS], rtol=0.05)
    # From draw to draw of the noise the damping scatters by 5 %.
    assert_allclose(C1, DAMPING, rtol=0.1)
    assert abs(f0) < 0.1


def test_a_given_mass_stays(noisy_records):
    m, K1, _, _ = _linear_element(noisy_records, (MASS, 0.5 * STIFFNESS, DAMPING, 0.0), mass=MASS)
    assert m == MASS
    assert_allclose(K1, STIFFNESS, rtol=0.03)


def test_an_estimate_that_predicts_better_stays(noisy_records):
    # No noise could be fitted better than by the element behind the record and its neighbours.
    exact = (MASS, STIFFNESS, DAMPING, 0.0)
    result = _linear_element(noisy_records, exact, mass=None)
    assert_allclose(result[:2], exact[:2], rtol=0.02)


def test_a_baseline_is_found_under_noise():
    problem = element_problem(force_campaign(no_law, amplitudes=(1.0, 2.0), noise=1e-4))
    fit = fit_effects(problem, ())
    assert_allclose(np.sqrt(fit.sums.square.sum() / problem.noise_square.sum()), 1.0, atol=0.03)
    assert_allclose(fit.theta[0], MASS, rtol=0.05)


def test_the_ends_of_a_record_do_not_count_as_a_gap():
    campaign = displacement_campaign(no_law, noise=1e-3)
    # A mass makes the acceleration count, which is unknown beyond the ends.
    runs = []
    for run in campaign.runs:
        q, step = run.inputs["displacement"], run.time[1] - run.time[0]
        inertia = 20.0 * np.gradient(np.gradient(q, step), step)
        runs.append(replace(run, signals={"F": run.signals["F"] + inertia}))
    problem = element_problem(replace(campaign, runs=tuple(runs)))
    per_cell = fit_effects(problem, ()).sums.square / problem.cell_counts.sum(axis=1)
    blocks = np.array([segment.block for segment in problem.segments])
    last = per_cell[blocks == blocks.max()].mean()
    assert last < 4.0 * np.median(per_cell)


def test_a_long_gap_in_a_record_leaves_the_other_blocks():
    campaign = displacement_campaign(no_law, amplitudes=(1e-3, 2e-3))
    first, *others = campaign.runs
    F = first.signals["F"].copy()
    F[1000:2200] = np.nan
    records = element_records(replace(campaign, runs=(replace(first, signals={"F": F}), *others)))
    assert records[0].n_blocks < records[1].n_blocks
    for record in records:
        assert sorted(set(record.block[record.block >= 0])) == list(range(record.n_blocks))
    assert (records[0].block[1000:2200] == -1).all()


def test_where_no_round_gives_an_element_resonances_are_tried(monkeypatch):
    """Mass and spring of zero, on which every simulation runs away, are no start."""
    exact = element_records(force_campaign(no_law, amplitudes=(2.0, 2.0), noise=1e-6))
    monkeypatch.setattr(signatures, "_instrumental", lambda records, instrument, mass: None)
    for mass in (None, MASS):
        m, K1, C1, _ = _linear_element(exact, (0.0, 0.0, DAMPING, 0.0), mass=mass)
        # Resonances are tried at steps of 21 %.
        assert_allclose([m, K1], [MASS, STIFFNESS], rtol=0.4)
        assert C1 > 0.0


@pytest.mark.long
def test_the_baseline_follows_sines_above_its_resonance():
    """A blind check's case with nothing missing whose every start ran away."""
    plan = CasePlan("element", 165, 303, NOTHING, (), 0.0, "sines")
    problem = problem_of(case_campaign(plan)[0], None)
    mean_square = mean_square_left(problem, fit_effects(problem, ()))
    assert mean_square < 1.2 * problem.noise_square.sum() / problem.cell_counts.sum()


def test_a_baseline_damped_far_beyond_critical_is_found():
    """Its fastest exponential falls to a ten-thousandth from sample to sample."""
    m, K1, C1, step = 8.0, 1e5, 1.14e4, 6.5e-3
    template = force_campaign(no_law, amplitudes=(1.0, 2.0))
    rng = np.random.default_rng(4)
    numerator, denominator, _ = cont2discrete(([1.0], [m, C1, K1]), step, method="foh")
    runs = []
    for run in template.runs:
        force = 10.0 * lfilter([0.2], [1.0, -0.8], rng.standard_normal(3000))
        q = lfilter(np.ravel(numerator), denominator, force)
        noisy = q + 2e-6 * rng.standard_normal(q.size)
        time = step * np.arange(q.size)
        runs.append(replace(run, time=time, inputs={"force": force}, signals={"q": noisy}))
    problem = element_problem(replace(template, runs=tuple(runs)))
    fit = fit_effects(problem, ())
    assert mean_square_left(problem, fit) < 1.1 * (2e-6) ** 2
    result = dict(zip([parameter.name for parameter in fit.parameters], fit.theta, strict=True))
    assert_allclose([result["K1"], result["C1"]], [K1, C1], rtol=0.01)


@pytest.mark.parametrize("damping_ratio", [0.01, 1.0, 8.0])
def test_the_response_is_exact_for_straight_lines_between_samples(damping_ratio: float):
    """A ramp's closed form: ``q = r/K1 (t - C1/K1 + decaying)``, from rest."""
    m, K1, step = 8.0, 2e3, 0.05
    C1 = 2.0 * damping_ratio * np.sqrt(K1 * m)
    numerator, denominator = signatures._difference_equation(m, K1, C1, step)
    t = step * np.arange(400)
    ramp = lfilter(numerator, denominator, t)
    poles = np.roots([m, C1, K1]).astype(complex)
    if damping_ratio == 1.0:
        w = np.sqrt(K1 / m)
        decaying = np.exp(-w * t) * (t + 2.0 / w)
    else:
        # Two exponentials that cancel value and slope of the straight line at the start.
        start = np.linalg.solve([[1.0, 1.0], poles], [C1 / K1, -1.0])
        decaying = (start[:, None] * np.exp(np.outer(poles, t))).sum(axis=0).real
    assert_allclose(ramp, (t - C1 / K1 + decaying) / K1, rtol=1e-9, atol=1e-12 / K1)
