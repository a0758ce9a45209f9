"""A campaign simulated at its candidates' fits, diagnosed and counted."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.inference.confusion.draws import (
    MOST_DIAGNOSES,
    block_length,
    with_signals,
)
from carrierflex.diagnosis.inference.confusion.results import Answer
from carrierflex.diagnosis.inference.confusion.words import confusion_sentences
from carrierflex.diagnosis.inference.effect_fit import fit_effects
from carrierflex.diagnosis.inference.evidence.candidates import samples_per_independent
from carrierflex.diagnosis.kinds import problem_of, residuals_of
from carrierflex.workflows.support import examination
from carrierflex.workflows.support.examination import examined
from tests.diagnosis.element.element_campaigns import force_campaign
from tests.diagnosis.mounting.mounting_campaigns import CONDITIONS, mounting_campaign
from tests.identification.synthetic_campaigns import carrier_campaign, flexible_curve, stiff_curve

CURVES = {"delta_s": stiff_curve(), "delta_f": flexible_curve()}


def cubic(q, v):
    return 8e8 * q**3


def confusion(campaign, diagnosis, **options):
    return examined(campaign).confusion(diagnosis, **options)


@pytest.fixture(scope="module")
def campaign():
    return force_campaign(cubic)


@pytest.fixture(scope="module")
def problem(campaign):
    return problem_of(campaign)[0]


@pytest.fixture(scope="module")
def diagnosis(campaign, problem):
    return diagnose(problem, campaign=campaign.name, kind=campaign.kind)


@pytest.fixture
def counted(monkeypatch):
    """Campaigns that were diagnosed; each is answered by the RMS of its signals, not diagnosed."""
    seen = []

    def answered(campaign, **given):
        seen.append(campaign)
        signals = np.concatenate([run.signals["q"] for run in campaign.runs])
        return Answer(f"{np.sqrt(np.mean(signals**2)):.15e}")

    monkeypatch.setattr(examination, "_answer", answered)
    return seen


def test_evidence_of_a_cubic_spring_is_beyond_doubt(diagnosis):
    assert diagnosis.evidence.preferred.effects == ("cubic_stiffness",)
    assert diagnosis.evidence.of(("cubic_stiffness",)).share > 0.999
    assert diagnosis.evidence.candidates[0].effects == ()
    assert diagnosis.evidence.candidates[0].log_evidence == 0.0


def test_no_more_campaigns_are_diagnosed_than_the_bound(campaign, problem, diagnosis, counted):
    found = confusion(campaign, diagnosis)
    assert len(counted) == found.n_diagnoses <= MOST_DIAGNOSES == 12
    n_draws = {len(row.answers) for row in found.rows}
    assert len(n_draws) == 1
    assert min(n_draws) >= 4
    assert sum(sum(found.counts(row)) for row in found.rows) == found.n_diagnoses


def test_draws_are_the_same_for_the_same_seed(campaign, problem, diagnosis, counted):
    first, again, other = (confusion(campaign, diagnosis, seed=seed) for seed in (0, 0, 1))
    assert first.rows == again.rows
    assert first.rows != other.rows
    # Every draw is another noise.
    answers = [answer for row in first.rows for answer in row.answers]
    assert len(set(answers)) == len(answers)


def test_draws_in_other_workers_are_counted_where_they_belong(campaign, diagnosis, counted):
    with ThreadPoolExecutor(2) as executor:
        shared = confusion(campaign, diagnosis, executor=executor)
    assert shared.rows == confusion(campaign, diagnosis).rows
    assert len(counted) == 2 * shared.n_diagnoses


def test_a_draw_is_the_candidate_with_the_residual_of_the_best(
    campaign, problem, diagnosis, counted
):
    confusion(campaign, diagnosis)
    evidence = diagnosis.evidence
    nothing = evidence.candidates[0].fit
    best = evidence.of(evidence.best).fit
    without = residuals_of(problem, campaign, nothing.effects, nothing.theta)
    noise = residuals_of(problem, campaign, best.effects, best.theta)
    # The first draw is of the baseline alone.
    for run, drawn, left, own in zip(campaign.runs, counted[0].runs, without, noise, strict=True):
        predicted = run.signals["q"] - left[:, 0]
        added = drawn.signals["q"] - predicted
        assert_allclose(np.abs(added), np.abs(own[:, 0]), atol=1e-12)
        share = np.mean(np.sign(added) == np.sign(own[:, 0]))
        assert 0.2 < share < 0.8
        assert_array_equal(drawn.inputs["force"], run.inputs["force"])


def test_missing_samples_stay_missing(problem, diagnosis, counted):
    campaign = force_campaign(cubic)
    signal = campaign.runs[0].signals["q"].copy()
    signal[700:705] = np.nan
    runs = list(campaign.runs)
    runs[0] = with_signals(campaign, [np.array([signal]).T] * 3).runs[0]
    gapped = with_signals(campaign, [np.array([run.signals["q"]]).T for run in runs])
    confusion(gapped, diagnosis)
    assert_array_equal(np.flatnonzero(np.isnan(counted[3].runs[0].signals["q"])), range(700, 705))


def test_blocks_hold_ten_correlation_times():
    rng = np.random.default_rng(0)
    white = rng.standard_normal((20_000, 2))
    assert 10 <= block_length(white) <= 12
    slow = np.zeros_like(white)
    for k in range(1, len(slow)):
        slow[k] = 0.9 * slow[k - 1] + white[k]
    # tau = (1 + 0.9) / (1 - 0.9) = 19.
    assert_allclose(block_length(slow), 190, rtol=0.25)
    assert block_length(np.ones((800, 1))) == 100


@pytest.mark.parametrize("kind", ["carrier", "element", "mounting"])
def test_residuals_in_time_are_those_that_the_diagnosis_scores(kind, campaign):
    own = {
        "carrier": carrier_campaign,
        "element": lambda: campaign,
        "mounting": lambda: mounting_campaign({"K3": 4e12}, conditions=CONDITIONS[:1]),
    }[kind]()
    problem, _ = problem_of(own, CURVES)
    theta = np.asarray(problem.starts((), {})[0])
    everything = np.ones(len(problem.segments), dtype=bool)
    left = residuals_of(problem, own, (), theta)
    scored = [np.ones(len(residual), dtype=bool) for residual in left]
    if kind != "carrier":
        # Blocks of an element leave the transient out.
        scored = [record.block >= 0 for record in problem.records]
    square = sum(np.nansum(r[counts] ** 2) for r, counts in zip(left, scored, strict=True))
    expected = problem.sums((), theta, everything).square.sum()
    assert_allclose(square, expected, rtol=1e-6)


def test_white_noise_is_worth_all_its_samples_and_slow_noise_fewer(campaign, problem):
    fit = fit_effects(problem, ("cubic_stiffness",))
    left = float(fit.sums.square.sum() / problem.cell_counts.sum())
    # 24 blocks tell the factor to some 40 %.
    assert samples_per_independent(fit, left) < 2.0
    rng = np.random.default_rng(3)
    slow = []
    for run in campaign.runs:
        noise = 2e-6 * np.repeat(rng.standard_normal(run.time.size // 64 + 1), 64)
        slow.append((run.signals["q"] + noise[: run.time.size])[:, None])
    slowed = with_signals(campaign, slow)
    other, _ = problem_of(slowed)
    fit = fit_effects(other, ("cubic_stiffness",))
    assert samples_per_independent(fit, float(fit.sums.square.sum() / 6144)) > 3.0


@pytest.mark.long
def test_an_unmistakable_effect_is_found_in_nearly_every_draw(campaign, problem, diagnosis):
    found = confusion(campaign, diagnosis)
    row = found.row_of(("cubic_stiffness",))
    assert found.named == ("cubic_stiffness",)
    assert found.answer == Answer("named", ("cubic_stiffness",))
    assert row.count(found.answer) >= len(row.answers) - 1
    assert found.rows[0].effects == ()
    assert found.rows[0].count(found.answer) == 0


@pytest.mark.long
def test_laws_that_one_amplitude_does_not_part_give_the_same_answer():
    faint = force_campaign(cubic, amplitudes=(2.0, 2.0), noise=6e-5)
    own = examined(faint)
    found = own.inference()
    counted = own.confusion(found)
    assert found.verdict == "aliased"
    assert {"cubic_stiffness", "quintic_stiffness"} <= set(found.answer.causes)
    rival = next(row for row in counted.rows if row.effects not in ((), counted.named))
    assert rival.effects == ("quintic_stiffness",)
    assert rival.count(counted.answer) > 0
    assert any(
        "Quintic stiffness gives this answer about as often" in text
        for text in confusion_sentences(counted)
    )
