"""Waves of the carrier and of the housing that are one at evenly spaced sensors stay a tie."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.diagnosis.carrier.problem import carrier_problem
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel
from carrierflex.identification.campaign.records import Run

#: Four planets whose lobes are 38 um at the nominal torque.
LOBE, NOMINAL, PIN_RADIUS = 38e-6, 1.5e6, 0.35


def curves(turned_deg):
    """Deflection curves of order 4, turned by an angle."""
    theta = np.deg2rad(np.arange(360.0))
    shape = np.sin(4.0 * (theta - np.deg2rad(turned_deg)))
    per_torque = -LOBE / (NOMINAL / 1e3) * shape
    # Four pins, each with a quarter of the torque at the pin circle.
    per_force = per_torque / 4.0 / (1e3 / (4.0 * PIN_RADIUS)) * (1.0 + 0.3 * np.cos(theta))
    stiff = 0.1 * LOBE / (NOMINAL / 1e3) * np.sin(8.0 * theta)
    values = {"delta_s": (1e3, stiff), "delta_f": (1e3, per_torque), "g_f": (1.0, per_force)}
    return {
        name: DeflectionCurve(name, 0.62, load, y, 0.0 * y) for name, (load, y) in values.items()
    }


def campaign(sensors_deg=(20.0, 110.0, 200.0, 290.0)):
    """Flexible pins beside a tilt of the carrier and one of the housing, at three torques."""
    rng = np.random.default_rng(4)
    channels = tuple(
        Channel(f"s{v:03.0f}", "axial_displacement", "m", angle=np.deg2rad(v), radius=0.62)
        for v in sensors_deg
    )
    runs = []
    for k, level in enumerate((1.0, 0.6, 0.3)):
        time = np.arange(0.0, 60.0, 0.04)
        theta = 1.466 * time
        torque = level * NOMINAL * np.ones_like(time)
        signals = {}
        for channel in channels:
            v = channel.angle
            tilts = 0.62 * (0.42e-3 * np.sin(0.6 + theta - v) + 0.25e-3 * level * np.sin(1.4 - v))
            lobes = -LOBE * level * np.sin(4.0 * (v - theta))
            noise = 2e-6 * rng.standard_normal(time.size)
            signals[channel.name] = tilts + lobes + noise
        inputs = {"carrier_angle": theta, "torque": torque}
        runs.append(Run(f"R{k}", f"R{k}.csv", f"{level}", time, inputs, signals))
    rig = {
        "nominal_torque": NOMINAL,
        "sensor_radius": 0.62,
        "n_planets": 4,
        "radial_load": "none",
    }
    effects = ("axial_offset", "carrier_tilt", "torque_tilt")
    return Campaign("carrier", "four", Baseline("model", effects), rig, channels, tuple(runs))


def diagnosis_of(campaign, turned_deg):
    problem = carrier_problem(campaign, curves(turned_deg))
    return diagnose(problem, campaign="four", kind="carrier")


@pytest.mark.long
def test_a_curve_with_its_predicted_phase_decides_between_the_frames():
    diagnosis = diagnosis_of(campaign(), 0.0)
    assert (diagnosis.verdict, diagnosis.attribution.effects) == ("named", ("flexible_pins",))


@pytest.mark.long
def test_a_law_of_free_phase_does_not():
    """The carrier is off its drawing: its lobes stand 6 degrees on, and any wave has that phase."""
    diagnosis = diagnosis_of(campaign(), 6.0)
    assert diagnosis.verdict == "aliased"
    assert not diagnosis.attribution.effects
    answer = diagnosis.classes
    tied = {name for names in (answer.ids, *answer.ties) for name in names}
    assert tied == {"carrier/waves/torque", "housing/planet_pass/torque"}
    assert "sensor at 65 degrees" in diagnosis.attribution.discriminating_experiment


@pytest.mark.long
def test_the_sensor_that_is_asked_for_decides():
    diagnosis = diagnosis_of(campaign((20.0, 65.0, 110.0, 200.0, 290.0)), 6.0)
    assert [finding.id for finding in diagnosis.classes.classes] == ["carrier/waves/torque"]
    assert not diagnosis.classes.ties


@pytest.mark.long
@pytest.mark.parametrize("levels", [(0.1, 0.25, 0.5, 0.75, 1.0)])
def test_a_recorded_experiment_is_not_proposed(levels):
    one = campaign()
    run = one.runs[0]
    runs = tuple(
        replace(
            run,
            name=f"R{k}",
            file=f"R{k}.csv",
            inputs={**run.inputs, "torque": 0.0 * run.time + x * NOMINAL},
        )
        for k, x in enumerate(levels)
    )
    before = carrier_problem(one, curves(0.0)).candidate_experiments()
    after = carrier_problem(replace(one, runs=runs), curves(0.0)).candidate_experiments()
    assert [trial.text.split(",")[0] for trial in before] == ["steps of 10"]
    assert not after
