"""A fault of one channel, one run, a load or the angle is named with its size."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.signal import lfilter

from carrierflex.blind_check.case_plans import case_plans
from carrierflex.blind_check.labels import NOTHING, SINGLE
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.workflows.diagnosis.examination import examined
from carrierflex.workflows.fe.default_curves import default_curves


@cache
def carrier(family, effect=""):
    """Campaign of six runs at four sensors, with no effect missing or with one."""
    plans = case_plans("carrier", 60, 73)
    plan = next(p for p in plans if p.family == family and (effect in p.effects or not effect))
    return case_campaign(plan)[0]


def rivals(campaign, laws=()):
    """Text and share of every wiring that explains the gap, by id and what it is about."""
    check = examined(campaign, default_curves()).baseline(None, laws)
    return {(rival.id, rival.about): (rival.text, share) for rival, share in check.rivals}


def with_signal(campaign, name, change):
    """Campaign in which one channel reads something else; `change` is given the run."""
    runs = tuple(replace(run, signals={**run.signals, name: change(run)}) for run in campaign.runs)
    return replace(campaign, runs=runs)


def with_input(campaign, name, change, only=""):
    """Campaign whose input was read otherwise, in all runs or in one."""
    runs = tuple(
        replace(run, inputs={**run.inputs, name: change(run.inputs[name])})
        if only in ("", run.name)
        else run
        for run in campaign.runs
    )
    return replace(campaign, runs=runs)


def noise(campaign, name):
    return next(one.noise_std for one in campaign.channels if one.name == name)


def ac_coupled(run):
    """High-pass of first order, 4 s, of the signal about its first value."""
    values = run.signals["s137"]
    share = np.median(np.diff(run.time)) / 4.0
    slow = lfilter([share], [1.0, share - 1.0], values, zi=[(1.0 - share) * values[0]])[0]
    return values - slow


def filtered(run):
    """Low-pass of first order, 0.15 s."""
    share = np.median(np.diff(run.time)) / (0.15 + np.median(np.diff(run.time)))
    values = run.signals["s137"]
    return lfilter([share], [1.0, share - 1.0], values, zi=[(1.0 - share) * values[0]])[0]


FAULTS = {
    "polarity": lambda run: -run.signals["s137"],
    "dead_channel": lambda run: 0.02 * run.signals["s137"],
    "copied_channel": lambda run: run.signals["s227"],
    "crosstalk": lambda run: run.signals["s137"] + 0.1 * run.signals["s227"],
    "sensor_on_ground": lambda run: run.signals["s137"] + 8e-11 * run.inputs["torque"],
    "ac_coupled": ac_coupled,
    "filtered_channel": filtered,
}


@pytest.mark.long
def test_an_ac_coupled_channel_of_a_mounting_is_named():
    """Its diagnosis alone has a map of the bushings and one of the loads, half each."""
    plans = case_plans("mounting", 60, 311)
    campaign, _ = case_campaign(next(plan for plan in plans if plan.family == NOTHING))

    def slow(run):
        share = np.median(np.diff(run.time)) / 8.0
        values = run.signals["ssz"]
        return (
            values - lfilter([share], [1.0, share - 1.0], values, zi=[(1 - share) * values[0]])[0]
        )

    check = examined(with_signal(campaign, "ssz", slow), None).baseline(None, ())
    (share,) = [
        share
        for rival, share in check.rivals
        if (rival.id, rival.about) == ("wiring/ac_coupled", "ssz")
    ]
    assert share > 0.9


@pytest.mark.long
@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("effect", ["", "flange_warp"])
def test_the_fault_of_a_lone_channel_is_named(fault, effect):
    campaign = with_signal(carrier(SINGLE if effect else NOTHING, effect), "s137", FAULTS[fault])
    laws = (effect,) if effect else ()
    text, share = rivals(campaign, laws)[f"wiring/{fault}", "s137"]
    assert share > 0.9
    assert "s137" in text


@pytest.mark.long
def test_a_carriers_fault_is_sought_beside_laws_where_its_class_has_a_shape():
    """Refits of a carrier hold laws at their fitted shapes, and no measured one."""
    plans = case_plans("carrier", 1260, 8)
    plan = next(one for one in plans if one.effects == ("clearance_rocking",))
    clean = case_campaign(plan)[0]
    shapes = examined(clean, default_curves()).compared().classes.shapes
    assert shapes
    name = clean.channels[0].name
    campaign = with_signal(clean, name, lambda run: -run.signals[name])
    check = examined(campaign, default_curves()).baseline(None, plan.effects, shapes)
    assert ("wiring/polarity", name) in [(rival.id, rival.about) for rival, _ in check.rivals]


@pytest.mark.long
@pytest.mark.parametrize("effect", ["", "flange_warp", "ring_pass", "clearance_rocking"])
def test_no_fault_is_named_of_a_campaign_without_one(effect):
    campaign = carrier(SINGLE if effect else NOTHING, effect)
    laws = (effect,) if effect else ()
    assert rivals(campaign, laws) == {}


@pytest.mark.long
def test_a_channel_that_is_only_noisier_has_no_other_fault():
    campaign = carrier(NOTHING)
    rng = np.random.default_rng(5)
    size = 5.0 * noise(campaign, "s137")
    noisier = with_signal(
        campaign,
        "s137",
        lambda run: run.signals["s137"] + size * rng.standard_normal(run.time.size),
    )
    assert list(rivals(noisier)) == [("wiring/declared_noise", "s137")]


@pytest.mark.long
def test_a_fault_of_no_kind_names_the_channel():
    """A converter whose steps are not equal."""
    campaign = carrier(NOTHING)
    size = 10.0 * noise(campaign, "s137")
    uneven = with_signal(
        campaign,
        "s137",
        lambda run: run.signals["s137"] + size * np.sin(run.signals["s137"] / (0.5 * size)),
    )
    ((id_, about),) = rivals(uneven)
    assert (id_, about) == ("wiring/channel", "s137")


@pytest.mark.long
@pytest.mark.parametrize("degrees", [10.0, -25.0])
def test_the_zero_of_the_angle_is_found_to_a_tenth_of_a_degree(degrees):
    campaign = with_input(
        carrier(NOTHING), "carrier_angle", lambda angle: angle + np.deg2rad(degrees)
    )
    text, share = rivals(campaign)["wiring/angle_zero", "carrier_angle"]
    assert share > 0.99
    size = float(text.split("moved by ")[1].split()[0])
    assert size == pytest.approx(-degrees, abs=0.1)


@pytest.mark.long
def test_an_eccentric_encoder_is_found_with_its_size():
    campaign = with_input(
        carrier(NOTHING),
        "carrier_angle",
        lambda angle: angle + np.deg2rad(3.0) * np.sin(angle + 0.7),
    )
    text, share = rivals(campaign)["wiring/encoder", "carrier_angle"]
    assert share > 0.9
    assert float(text.split("by ")[1].split()[0]) == pytest.approx(3.0, rel=0.1)


@pytest.mark.long
def test_a_run_without_which_the_others_agree_is_named():
    campaign = carrier(NOTHING)
    run = campaign.runs[1].name
    late = with_input(campaign, "carrier_angle", lambda angle: angle + 0.4, only=run)
    assert rivals(late)["wiring/run", run][1] > 0.9
    # The size of a load alone is told as such.
    louder = replace(
        campaign,
        runs=tuple(
            replace(one, signals={k: 1.3 * v for k, v in one.signals.items()})
            if one.name == run
            else one
            for one in campaign.runs
        ),
    )
    text, share = rivals(louder)["wiring/input_gain", run]
    assert share > 0.9
    assert float(text.split()[4]) == pytest.approx(1.3, rel=0.01)


@pytest.mark.long
def test_two_channels_on_one_cable_are_told_once():
    campaign = with_signal(carrier(NOTHING), "s137", lambda run: run.signals["s227"])
    findings = examined(campaign, default_curves()).diagnosis().warnings
    copied = [one for one in findings if "copied_channel" in (one.check, one.id.split("/")[-1])]
    assert [(one.id, one.about) for one in copied] == [("wiring/copied_channel", "s137")]
