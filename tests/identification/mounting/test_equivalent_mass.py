"""Mass and arm of the dynamometer's coupling from bending moments of the main shaft."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_kinds import BENDING
from carrierflex.identification.campaign.declarations import Baseline, Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.mounting.equivalent_mass import identify_equivalent_mass
from carrierflex.simulation.mounting.rig import MountingRig
from carrierflex.simulation.mounting.shaft_bending import EquivalentMass, shaft_bending

#: Section 3 of the 2011 paper.
TRUTH = EquivalentMass(4100.0, 1.75)
NOISE = 2e3  # N m, 3 % of the moment of the weight


def campaign(sections=(0.3,), ntl_z=(0.0,), *, noise=NOISE, zero=5e3, gain_std=None, seed=0):
    """One run a radial load, ten turns each, at every section M_y and M_z with constant errors."""
    rng, angle = np.random.default_rng(seed), np.linspace(0.0, 20.0 * np.pi, 2000)
    channels, runs = [], []
    for k, section in enumerate(sections):
        channels += [
            Channel(
                f"M_{axis}_{k}", BENDING, "N m", axis=axis, section=section,
                noise_std=NOISE, gain_std=gain_std,
            )
            for axis in "yz"
        ]  # fmt: skip
    for number, load in enumerate(ntl_z):
        n = angle.size
        inputs = {
            "torque": np.zeros(n), "speed": np.full(n, 2.3), "carrier_angle": angle,
            "ntl_y": np.zeros(n), "ntl_z": np.full(n, load),
        }  # fmt: skip
        signals = {}
        for k, section in enumerate(sections):
            pair = shaft_bending(TRUTH, section, angle, inputs["ntl_y"], inputs["ntl_z"])
            for column, axis in enumerate("yz"):
                signals[f"M_{axis}_{k}"] = pair[:, column] + zero + noise * rng.standard_normal(n)
        runs.append(Run(f"run_{number}", f"run_{number}.csv", "", angle / 2.3, inputs, signals))
    rig = MountingRig().table()
    return Campaign("mounting", "shaft", Baseline("model"), rig, tuple(channels), tuple(runs))


def test_moment_is_that_of_forces_upwind():
    """Cross product of lever and force, seen from axes that turn with the shaft."""
    angle, ones = np.array([0.0, 0.5 * np.pi]), np.ones(2)
    M = shaft_bending(TRUTH, 0.25, angle, 2e3 * ones, 1e3 * ones)
    F = np.array([0.0, 2e3, 1e3 - 4100.0 * 9.81])
    _, M_y, M_z = np.cross([-1.5, 0.0, 0.0], F)
    # A quarter turn on, the shaft's y stands along z and its z along -y.
    np.testing.assert_allclose(M, [[M_y, M_z], [M_z, -M_y]], atol=1e-9)


@pytest.mark.parametrize(
    ("sections", "ntl_z"), [((0.3,), (0.0, -100e3)), ((0.0, 0.9), (0.0,))], ids=["load", "sections"]
)
def test_papers_mass_and_arm_within_one_percent(sections, ntl_z):
    estimate = identify_equivalent_mass(campaign(sections, ntl_z))
    mass, arm = estimate.values[:2]
    assert abs(mass / TRUTH.mass - 1.0) < 0.01
    assert abs(arm / TRUTH.arm - 1.0) < 0.01
    assert not estimate.undetermined


@pytest.mark.long
def test_intervals_hold_the_truth():
    """Of 100 records 89 to 99: the range that a binomial of 95 % leaves with 99.5 %."""
    covered = np.zeros(2)
    for seed in range(100):
        ci = identify_equivalent_mass(campaign(ntl_z=(0.0, -50e3), seed=seed)).ci95[:2]
        covered += (ci[:, 0] <= [4100.0, 1.75]) & ([4100.0, 1.75] <= ci[:, 1])
    assert (covered >= 89).all(), covered


def test_one_section_knows_the_moment_alone():
    estimate = identify_equivalent_mass(campaign())
    assert not np.isfinite(estimate.covariance[0, 0])
    (text,) = estimate.undetermined
    moment = float(text.split("= ")[1].split(" kN m")[0])
    assert moment == pytest.approx(4.100 * 9.81 * (1.75 - 0.3), rel=0.01)
    assert "--mass" in text
    known = identify_equivalent_mass(campaign(), mass=4100.0)
    assert known.names[0] == "arm"
    assert abs(known.values[0] / 1.75 - 1.0) < 0.01


def test_declared_gain_widens_the_arm_alone():
    """A gain common to the moments scales the lever; the mass is a ratio of two of them."""
    sharp, blunt = (
        identify_equivalent_mass(campaign(ntl_z=(0.0, -100e3), gain_std=gain))
        for gain in (None, 0.02)
    )
    assert blunt.std[1] > 3.0 * sharp.std[1]
    assert blunt.std[0] < 1.5 * sharp.std[0]


def test_axes_of_gauges_may_be_turned():
    """Gauges 5 degrees from the shaft's axes change neither mass nor arm."""
    turned = campaign(ntl_z=(0.0, -100e3))
    runs = [
        replace(run, inputs={**run.inputs, "carrier_angle": run.inputs["carrier_angle"] - 0.0873})
        for run in turned.runs
    ]
    estimate = identify_equivalent_mass(replace(turned, runs=tuple(runs)))
    assert estimate.values[2] == pytest.approx(0.0873, abs=3.0 * estimate.std[2])
    assert abs(estimate.values[0] / TRUTH.mass - 1.0) < 0.01


def test_a_campaign_without_moments_is_refused():
    without = campaign()
    channel = Channel("ssx", "housing_displacement", "m", sensor="ssx")
    runs = tuple(run.with_signals({"ssx": np.zeros(run.time.size)}) for run in without.runs)
    with pytest.raises(ValueError, match="no channel of quantity shaft_bending_moment"):
        identify_equivalent_mass(replace(without, channels=(channel,), runs=runs))
