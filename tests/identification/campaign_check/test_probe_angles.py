"""The phase of order 1 reads where probes stand, without a baseline."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.identification.campaign_check.probe_angles import probe_angles, probe_findings
from tests.identification.synthetic_campaigns import carrier_campaign, run_case

PROBES = np.deg2rad([20.0, 75.0, 160.0, 290.0])


def tilted(angles=PROBES, signs=(1.0, 1.0, 1.0, 1.0), direction=1.0, tilt=2e-4):
    """Rim of a tilted carrier with three lobes in front of probes at some angles."""
    campaign = carrier_campaign([run_case("LC1"), run_case("LC2", torque=180e3)])
    rng = np.random.default_rng(3)
    names = [channel.name for channel in campaign.channels]
    channels = tuple(
        replace(channel, angle=float(angle), noise_std=2e-6)
        for channel, angle in zip(campaign.channels, PROBES, strict=True)
    )
    runs = []
    for run in campaign.runs:
        theta = run.inputs["carrier_angle"]
        signals = {
            name: sign
            * (
                tilt * np.cos(theta - alpha + 0.6)
                + 4e-5 * np.sin(3.0 * (alpha - theta))
                + 1e-4 * np.cos(alpha)
                + 2e-6 * rng.standard_normal(theta.size)
            )
            for name, alpha, sign in zip(names, angles, signs, strict=True)
        }
        inputs = {**run.inputs, "carrier_angle": direction * theta}
        runs.append(replace(run, signals=signals, inputs=inputs))
    return replace(campaign, channels=channels, runs=tuple(runs))


def ids(campaign):
    return {finding.id for finding in probe_findings(probe_angles(campaign))}


def test_angles_are_read_to_a_tenth_of_a_degree_within_their_intervals():
    rows = probe_angles(tilted())
    assert [row.sign for row in rows] == [1, 1, 1, 1]
    for row, angle in zip(rows, PROBES, strict=True):
        assert row.read_deg == pytest.approx(np.rad2deg(angle), abs=0.1)
        assert abs(row.read_deg - np.rad2deg(angle)) <= 2.0 * row.interval_deg + 1e-9
        assert row.gain == pytest.approx(1.0, abs=0.002)
    assert not ids(tilted())


def test_exchanged_cables_are_read_from_the_records_alone():
    exchanged = tilted(angles=PROBES[[0, 3, 2, 1]])
    (finding,) = probe_findings(probe_angles(exchanged))
    assert finding.id == "wiring/sensor_order"
    assert len(finding.about.split(", ")) == 2


def test_an_angle_counted_the_other_way_is_told_as_such():
    # Exchanged cables may read the same: both are told.
    first = next(probe_findings(probe_angles(tilted(direction=-1.0))))
    assert (first.id, first.about) == ("wiring/angle_direction", "carrier_angle")
    assert ids(tilted(direction=-1.0)) <= {"wiring/angle_direction", "wiring/sensor_order"}


def test_one_reversed_channel_has_its_angle_half_a_turn_off():
    campaign = tilted(signs=(1.0, 1.0, -1.0, 1.0))
    (finding,) = probe_findings(probe_angles(campaign))
    assert (finding.id, finding.about) == ("wiring/polarity", campaign.channels[2].name)
    assert [row.sign for row in probe_angles(campaign)] == [1, 1, -1, 1]


def test_a_probe_far_from_its_declared_angle_is_told_alone():
    campaign = tilted(angles=PROBES + np.deg2rad([0.0, 0.0, 60.0, 0.0]))
    (finding,) = probe_findings(probe_angles(campaign))
    assert (finding.id, finding.about) == ("wiring/sensor_angle", campaign.channels[2].name)


def test_nothing_is_read_where_order_1_is_as_small_as_the_noise():
    campaign = tilted(tilt=1e-8)
    assert [row.read_deg for row in probe_angles(campaign)] == [None] * 4
    assert not ids(campaign)


def test_a_channel_without_samples_is_blank_and_spoils_no_other():
    campaign = tilted()
    name = campaign.channels[2].name
    runs = tuple(
        replace(run, signals={**run.signals, name: np.full(run.time.size, np.nan)})
        for run in campaign.runs
    )
    rows = probe_angles(replace(campaign, runs=runs))
    assert [row.read_deg is None for row in rows] == [False, False, True, False]
    assert rows[1].read_deg == pytest.approx(np.rad2deg(PROBES[1]), abs=0.1)
