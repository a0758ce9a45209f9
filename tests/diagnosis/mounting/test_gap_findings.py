"""The gap of a mounting beyond its map."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.mounting.problem import mounting_problem
from tests.diagnosis.mounting.mounting_campaigns import (
    CONDITIONS,
    NOISE,
    TRUE_LINEAR,
    mounting_campaign,
)

THETA = np.array(list(TRUE_LINEAR.values()))


def findings_of(campaign):
    return mounting_problem(campaign).gap((), THETA).findings()


def growth_of(findings, name):
    return next(growth for growth in findings.growth if growth.channel_pattern == name).exponents


@pytest.mark.parametrize(("power", "tolerance"), [(1.0, 0.05), (2.0, 0.3)])
def test_a_gap_grows_with_the_torque_as_it_was_made_to(power, tolerance):
    def rolled(inputs):
        return 2e-4 * np.outer(
            (np.abs(inputs.torque) / 3e5) ** power, [0.0, 0.0, 1.0, -1.0, 0.0, 0.0]
        )

    # Sensors in the order ssx, spx, ssz, spz, spy, sbx: opposite vertical motion at the sides is
    # roll.
    result = growth_of(findings_of(mounting_campaign(extra=rolled)), "roll")["torque"]
    # The RMS of a square is no square of the RMS where a block holds rest and load: its exponent
    # comes out lower.
    assert_allclose(result.value, power, atol=tolerance)
    assert result.p_value < 1e-6


def test_gap_in_time_shows_when_it_rises():
    def late(inputs):
        return np.outer(5e-5 * (inputs.time > 65.0), np.ones(6))

    moments = [
        moment
        for moment in findings_of(mounting_campaign(extra=late)).in_time
        if moment.run == "R0"
    ]
    early, after = (
        np.array([m.rms for m in moments if (m.time > 65.0) == side]) for side in (False, True)
    )
    assert_allclose(early, NOISE, rtol=0.1)
    assert_allclose(after, np.hypot(5e-5, NOISE), rtol=0.1)


def test_what_differs_between_repeats_is_told_and_what_repeats_is_not():
    def campaign(extra):
        first, second = (
            mounting_campaign(conditions=CONDITIONS[:1], seed=0, extra=addition)
            for addition in (None, extra)
        )
        noisy = np.random.default_rng(9)
        (run,) = second.runs
        signals = {k: v + NOISE * noisy.standard_normal(v.size) for k, v in run.signals.items()}
        return replace(
            first, runs=(*first.runs, replace(run, name="R1", file="R1.csv", signals=signals))
        )

    wave = 2e-5 * np.sin(2.0 * np.pi * 0.9 * np.arange(2600) * 0.05)
    shaken = findings_of(campaign(lambda inputs: np.outer(wave, [0.0, 0.0, 0.0, 0.0, 1.0, 0.0])))
    first = shaken.non_synchronous[0]
    assert (first.run, first.channel_pattern) == ("R0 and R1", "sideways")
    # Half of the squared difference, on one of six channels.
    assert_allclose(first.gap, 2e-5**2 / 2.0 / 2.0 / 6.0, rtol=0.1)
    (repeats,) = shaken.repeatability
    assert repeats.repetition == "repeat"
    assert repeats.largest is first
    # Half of the squared difference of the two runs; the wave lies in more than one band.
    assert_allclose(repeats.rms, 2e-5 / 2.0 / np.sqrt(6.0), rtol=0.1)


def test_scalars_are_means_and_spans_of_the_motions():
    campaign = mounting_campaign(
        extra=lambda inputs: np.outer(np.full(inputs.time.size, 1e-4), [0, 0, 1, 1, 0, 0])
    )
    scalars = {
        scalar.name: scalar for scalar in mounting_problem(campaign).gap((), THETA).scalars()
    }
    mean, span = scalars["vertical, mean"], scalars["vertical, peak to peak"]
    # Two channels of 100 um each are sqrt(2) times that along the unit pattern; 325 samples a
    # block.
    assert_allclose(
        mean.measured - mean.predicted, np.sqrt(2.0) * 1e-4, atol=4.0 * NOISE / np.sqrt(325)
    )
    assert_allclose(span.measured, span.predicted, atol=10.0 * NOISE)


@pytest.mark.acceptance
def test_the_diagnosis_holds_the_detail_before_and_after():
    result = diagnose(
        mounting_problem(mounting_campaign({"K3": 6e12})), campaign="twin", kind="mounting"
    )
    assert result.gap.scalars
    roll = next(scalar for scalar in result.gap.scalars if scalar.name == "roll, peak to peak")
    assert roll.area_after < 0.3 * roll.area_before
    assert all(cell.error_after < cell.error_before for cell in result.gap.cells[:3])


@pytest.mark.long
def test_the_picture_shows_the_law_that_the_baseline_lacks():
    campaign = mounting_campaign({"K3": 6e12})
    problem = mounting_problem(campaign)
    theta = np.array([*THETA, 6e12])
    (picture,) = problem.pictures(("cubic_stiffness",), theta)
    assert picture.title == "Unexplained roll motion"
    gap, law = picture.panels[0].traces
    assert (gap.role, law.role) == ("gap", "law")
    # Beside the law there is noise alone: strips of the gap lie on it.
    on_law = np.interp(gap.x, law.x, law.y)
    assert np.std(gap.y - on_law) < 0.1 * np.std(gap.y)
    assert problem.pictures((), THETA)[0].panels[0].traces[0].role == "gap"
