"""Orders read too seldom, and zeros that follow the torque: named, told apart."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from carrierflex.blind_check.case_plans import case_plans
from carrierflex.blind_check.labels import NOTHING
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.diagnosis.wiring.column_faults import low_pass
from carrierflex.workflows.diagnosis.examination import examined
from carrierflex.workflows.fe.default_curves import default_curves

DRIFT = "wiring/drift"
MESH = 99


@cache
def nothing_missing(kind):
    plan = next(p for p in case_plans(kind, 60, 73) if p.family == NOTHING)
    return case_campaign(plan)[0]


def examination(kind, added):
    """A campaign with nothing missing and motion added to every channel.

    `added` is given the run, the noise and the number of the channel.
    """
    campaign = nothing_missing(kind)

    def changed(run):
        signals = {
            one.name: run.signals[one.name] + added(run, one.noise_std, k)
            for k, one in enumerate(campaign.channels)
        }
        return replace(run, signals=signals)

    campaign = replace(campaign, runs=tuple(map(changed, campaign.runs)))
    return examined(campaign, default_curves() if kind == "carrier" else None)


def rivals(kind, added):
    """Text and share of every fault that explains the gap, by id."""
    check = examination(kind, added).baseline()
    return {rival.id: (rival.text, share) for rival, share in check.rivals}


def order(number, run, noise, k):
    """An order of the shaft, of another phase in every channel, that grows with the torque."""
    torque = run.inputs["torque"] / 360e3
    return 8.0 * noise * torque * np.sin(number * run.inputs["carrier_angle"] + k)


def warming(time, run, noise, k):
    """A channel that follows the torque late, by a size of its own."""
    slow = low_pass(time, run.time, run.inputs["torque"] - run.inputs["torque"][0]) / 360e3
    return 20.0 * noise * (1.0 + 0.7 * (-1.0) ** k) * slow


def test_tooth_mesh_above_half_the_sampling_rate_is_found_and_taken_out():
    meshing = examination("carrier", lambda *args: order(MESH, *args))
    assert [motion.id for motion in meshing.problem.off_order_motions()] == ["aliased/99X"]
    text = {one.id: one.text for one in meshing.findings()}["wiring/aliased_order"]
    assert text.startswith("order 99 of the shaft, up to 36")
    (line,) = [one for one in meshing.diagnosis().gap.findings.where if one.line == "99X"]
    assert line.place == "above half the samples of a turn"
    clean = nothing_missing("carrier")
    for run, before in zip(meshing.problem.campaign.runs, clean.runs, strict=True):
        for channel in clean.channels:
            off = run.signals[channel.name] - before.signals[channel.name]
            # Of 8 times the noise at full load what its fit has of the noise itself remains.
            assert np.std(off) < 0.15 * channel.noise_std


@pytest.mark.parametrize("number", [5, 11])
def test_an_order_that_the_samples_resolve_is_not_read_too_seldom(number):
    findings = examination("carrier", lambda *args: order(number, *args)).findings()
    assert "wiring/aliased_order" not in [one.id for one in findings]


@pytest.mark.long
def test_zeros_that_follow_the_torque_are_found_with_their_time():
    text, share = rivals("mounting", lambda *args: warming(20.0, *args))[DRIFT]
    assert share > 0.9
    assert 15.0 <= float(text.split(" in about ")[1].split(" s ")[0]) <= 30.0


@pytest.mark.long
def test_zeros_that_follow_the_torque_at_once_are_a_map_of_the_loads():
    assert DRIFT not in rivals("mounting", lambda *args: warming(1e-6, *args))
