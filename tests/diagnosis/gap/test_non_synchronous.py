from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.carrier.problem import carrier_problem
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.gap.gap_map import SIGNIFICANCE
from carrierflex.diagnosis.report.gap_words import scatter_words
from tests.diagnosis.carrier.carrier_twin import CHANNELS, CURVES, KNOWN, NOISE, twin_campaign
from tests.diagnosis.element.element_campaigns import force_campaign, no_law

pytestmark = pytest.mark.long

QUIET = ((1.0, 0, 0), (0.5, 0, 0))
WOBBLE = 2e-5


def findings_of(problem):
    return problem.gap((), problem.starts((), {})[-1]).findings()


@cache
def carrier_findings(*, declared=True, extra=None, noisy=None):
    campaign = twin_campaign(None, extra=extra, loads=QUIET, turns=16, contained=tuple(KNOWN))
    if noisy is not None:
        rng = np.random.default_rng(9)
        for run in campaign.runs:
            run.signals[noisy] += NOISE * rng.standard_normal(run.time.size)
    if not declared:
        campaign = replace(
            campaign,
            channels=tuple(replace(channel, noise_std=None) for channel in campaign.channels),
        )
    return findings_of(carrier_problem(campaign, CURVES))


def sizes_of_turns():
    return np.random.default_rng(4).standard_normal(16)


def wobble(channel, angle):
    """Tilt at 1X whose size differs from one revolution to the next."""
    turn = np.minimum((angle / (2.0 * np.pi)).astype(int), 15)
    size = sizes_of_turns()[turn]
    return WOBBLE * size * np.cos(channel.angle - angle) * (channel in CHANNELS[:4])


def said(findings):
    return scatter_words(findings, "m")


def significant(findings):
    return [cell for cell in findings.non_synchronous if cell.p_value < SIGNIFICANCE]


def test_noise_alone_is_no_incoherent_gap():
    for declared in (True, False):
        assert significant(carrier_findings(declared=declared)) == []
    assert "what does not repeat from revolution to revolution is noise" in said(carrier_findings())


def test_what_changes_from_turn_to_turn_lands_in_its_pattern_and_order():
    for declared in (True, False):
        cell = significant(carrier_findings(declared=declared, extra=wobble))[0]
        assert (cell.channel_pattern, cell.order) == ("m=+1", 1.0)
        # Four of six channels, half the squared amplitude, variance of the sizes drawn; noise
        # adds 0.1 %.
        variance = sizes_of_turns().var(ddof=1)
        assert_allclose(cell.gap, variance * WOBBLE**2 / 2.0 * 4.0 / 6.0, rtol=0.005)
        assert cell.measured > 100.0 * cell.noise
    text = said(carrier_findings(extra=wobble))
    assert "does not repeat from revolution to revolution, most of it at order 1 in run" in text


def test_power_off_the_orders_is_told_from_declared_noise_only():
    findings = carrier_findings(noisy="s137")
    off = [cell for cell in significant(findings) if cell.order is None]
    assert {cell.channel_pattern for cell in off} == {"s137"}
    assert_allclose(off[0].gap / off[0].noise, 2.0, rtol=0.15)
    assert "off the shaft orders" in said(findings)
    silent = [
        cell
        for cell in carrier_findings(noisy="s137", declared=False).non_synchronous
        if cell.order is None
    ]
    assert silent
    assert all(np.isnan(cell.p_value) for cell in silent)


def repeats(extra_of_run):
    campaign = twin_campaign(
        None, loads=((1.0, 0, 0), (1.0, 0, 0), (1.0, 0, 0)), turns=8, contained=tuple(KNOWN)
    )
    runs = tuple(replace(run, condition="100 % torque") for run in campaign.runs)
    for size, run in zip(extra_of_run, runs, strict=True):
        for channel in CHANNELS[:4]:
            run.signals[channel.name] += size * np.cos(channel.angle - run.inputs["carrier_angle"])
    return findings_of(carrier_problem(replace(campaign, runs=runs), CURVES))


def test_what_differs_between_repeats_of_one_condition_is_told_apart():
    findings = repeats((1e-5, -1e-5, 0.0))
    cell = next(each for each in significant(findings) if "and" in each.run)
    assert (cell.run, cell.channel_pattern, cell.order) == ("run1 and run2 and run3", "m=+1", 1.0)
    # Variance of (1, -1, 0) is 1; half of the square over four of six channels.
    assert_allclose(cell.gap, 1e-10 / 2.0 * 4.0 / 6.0, rtol=0.1)
    assert (
        "does not repeat from repeat to repeat, most of it at order 1 in run1 and run2 and run3"
        in said(findings)
    )
    assert [each for each in significant(repeats((0.0, 0.0, 0.0))) if "and" in each.run] == []


def test_an_element_that_chatters_is_not_taken_for_noise():
    quiet = force_campaign(no_law)
    assert significant(findings_of(element_problem(quiet))) == []
    rng = np.random.default_rng(3)
    for run in quiet.runs:
        # Broad chatter at four times the noise of 2 um.
        run.signals["q"] += 8e-6 * rng.standard_normal(run.time.size)
    loud = findings_of(element_problem(quiet))
    cells = significant(loud)
    # Noise and 16 times its power. One cell scatters by a sixth, the mean of all by a thirtieth.
    assert len(cells) > 30
    assert_allclose(np.mean([cell.gap / cell.noise for cell in cells]), 17.0, rtol=0.1)
    assert "does not repeat from period to period" in said(loud)
    undeclared = element_problem(
        replace(quiet, channels=(replace(quiet.channels[0], noise_std=None),))
    )
    assert significant(findings_of(undeclared)) == []
