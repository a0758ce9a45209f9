"""Motion between the shaft's orders: found where it is, none where there is none."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.diagnosis.carrier.gap_findings import _off_order_tables
from carrierflex.diagnosis.carrier.off_order_lines import _searched, off_orders
from carrierflex.diagnosis.carrier.problem import carrier_problem
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.gap.gap_map import gap_cells
from carrierflex.diagnosis.report.diagnosis_files import diagnosis_document
from carrierflex.diagnosis.report.verdict_words import verdict_heading
from carrierflex.simulation.carrier.effects.library import CARRIER_EFFECTS
from tests.diagnosis.carrier.carrier_twin import CURVES, KNOWN, LOADS, NOISE, SPEEDS, twin_campaign
from tests.identification.synthetic_campaigns import SPEED, carrier_campaign, run_case

AMPLITUDE = 2e-5


def whirl(channel, angle):
    """Whole rim at 0.47 of the speed."""
    return AMPLITUDE * np.sin(0.47 * angle - channel.angle)


def at_one_sensor(channel, angle):
    """Bracket of one sensor, at one frequency whatever the speed."""
    return (0.0 if channel.name != "s137" else AMPLITUDE) * np.sin(0.6 * angle)


def undeclared(campaign, *, looked_for=()):
    """Campaign without declared noise; few effects are looked for, to be quick."""
    channels = tuple(replace(channel, noise_std=None) for channel in campaign.channels)
    possible = {*KNOWN, *looked_for}
    impossible = tuple(name for name in CARRIER_EFFECTS if name not in possible)
    baseline = replace(campaign.baseline, impossible=impossible)
    return replace(campaign, channels=channels, baseline=baseline)


def with_tone(campaign, hertz):
    """Campaign whose sensor r040 hums."""
    runs = []
    for run in campaign.runs:
        hum = AMPLITUDE * np.sin(2.0 * np.pi * hertz * run.time)
        runs.append(replace(run, signals={**run.signals, "r040": run.signals["r040"] + hum}))
    return replace(campaign, runs=tuple(runs))


@pytest.mark.parametrize("effect", [None, "torque_tilt", "pin_clearance", "thermal_drift"])
def test_nothing_is_found_beside_the_orders_of_records_without(effect):
    assert off_orders(twin_campaign(effect)).motions == ()


def rippling_campaign(torques=(0.5, 0.75, 0.25, 1.0), turns=8.3, noise=5e-7):
    """Short runs whose torque ripples by 3 %: lines beside every order that follows it."""
    cases = [
        run_case(
            f"LC{k}",
            torque=share * 360e3,
            condition=f"load {k}",
            duration=turns * 2.0 * np.pi / SPEED,
            torque_ripple=0.03,
        )
        for k, share in enumerate(torques)
    ]
    return carrier_campaign(cases, noise_std=noise, seed=2)


def test_a_rippling_torque_makes_no_lines_in_runs_too_short_to_follow_it_alone():
    assert off_orders(rippling_campaign()).motions == ()


def test_a_line_is_found_beside_a_rippling_torque():
    campaign = rippling_campaign()
    runs = []
    for run in campaign.runs:
        angle = run.inputs["carrier_angle"]
        signals = {
            channel.name: run.signals[channel.name] + 2e-6 * np.sin(2.5 * angle - channel.angle)
            for channel in campaign.channels
        }
        runs.append(replace(run, signals=signals))
    (motion,) = off_orders(replace(campaign, runs=tuple(runs))).motions
    assert motion.id == "nonsynchronous/2.50X"


def test_a_whirl_keeps_its_order_and_is_taken_out_of_the_records():
    result = off_orders(twin_campaign(extra=whirl))
    (motion,) = result.motions
    assert motion.id == "nonsynchronous/0.47X"
    assert motion.is_in_every_run
    assert motion.explained > 0.9
    # The mean square of a wave is half its squared amplitude.
    assert np.allclose(list(motion.mean_square.values()), 0.5 * AMPLITUDE**2, rtol=0.1)
    low, high = motion.band_hz
    assert np.isclose(low, 0.47 * min(SPEEDS) / (2.0 * np.pi), rtol=0.01)
    assert np.isclose(high, 0.47 * max(SPEEDS) / (2.0 * np.pi), rtol=0.01)
    clean = twin_campaign()
    for run, bare in zip(result.campaign.runs, clean.runs, strict=True):
        for name, values in run.signals.items():
            residual_rms = np.sqrt(np.mean((values - bare.signals[name]) ** 2))
            assert residual_rms < 0.2 * NOISE, f"{run.name} {name}"


def test_a_tone_of_one_sensor_keeps_its_frequency():
    (motion,) = off_orders(with_tone(twin_campaign(), 0.61)).motions
    assert motion.id == "channel/0.61Hz"
    assert motion.channels == ("r040",)


def test_missing_samples_and_another_simulator_do_not_hide_a_line():
    campaign = twin_campaign(extra=whirl)
    rng = np.random.default_rng(4)
    runs = []
    for run in campaign.runs:
        gone = rng.uniform(size=run.time.size) < 0.05
        signals = {name: np.where(gone, np.nan, signal) for name, signal in run.signals.items()}
        runs.append(replace(run, signals=signals))
    (motion,) = off_orders(replace(campaign, runs=tuple(runs))).motions
    assert motion.id == "nonsynchronous/0.47X"
    predicted = tuple(
        replace(
            run,
            predictions={
                channel.name: whirl(channel, run.inputs["carrier_angle"])
                for channel in campaign.channels
            },
        )
        for run in campaign.runs
    )
    baseline = replace(campaign.baseline, source="columns")
    predicted_campaign = replace(campaign, runs=predicted, baseline=baseline)
    assert off_orders(predicted_campaign).motions == ()


def test_cells_of_a_line_have_its_frequency_and_channel():
    result = off_orders(twin_campaign(extra=at_one_sensor))
    cells = gap_cells(tuple(_off_order_tables(result)))
    assert {cell.channel_pattern for cell in cells} == {"s137"}
    assert {cell.run for cell in cells} == {run.name for run in result.campaign.runs}
    for cell in cells:
        assert np.isclose(cell.order, 0.6, atol=0.02)
        assert cell.frequency_hz is not None
        assert cell.share_ci95[0] < cell.share < cell.share_ci95[1]


@pytest.mark.long
def test_without_declared_noise_a_line_is_a_class_and_not_the_floor():
    problem = carrier_problem(undeclared(twin_campaign(extra=whirl)), CURVES)
    assert np.allclose(np.sqrt(problem.noise), NOISE, rtol=0.1)
    problem = carrier_problem(
        undeclared(
            twin_campaign("torque_tilt", extra=whirl, loads=LOADS[:4]), looked_for=("torque_tilt",)
        ),
        CURVES,
    )
    diagnosis = diagnose(problem, campaign="twin", kind="carrier")
    document = diagnosis_document(diagnosis)
    assert document["verdict"] == "class_named"
    classes = [entry["id"] for entry in document["classes"]]
    assert classes == ["nonsynchronous/0.47X", "housing/tilt/undetermined"]
    assert document["effects"] == ["torque_tilt"]
    heading = verdict_heading(diagnosis)
    assert heading.startswith("The gap is explained by torque tilt, and motion at 0.47X, betw")
    # Effect and line leave the noise alone.
    far = document["how_far"]
    assert far["rms_before"] > 2.5 * NOISE
    assert np.isclose(far["rms_after"], NOISE, rtol=0.15)
    assert "a line at 0.47X" in document["where_text"]
    lines = [cell for cell in document["where"] if "frequency_hz" in cell]
    assert lines
    assert not [cell for cell in document["remaining"] if "frequency_hz" in cell]
    total = sum(row["samples"] * row["mean_square"] for row in document["held_out"])
    samples = sum(row["samples"] for row in document["held_out"])
    assert np.isclose(np.sqrt(total / samples), far["rms_before"], rtol=0.01)


def test_a_line_found_in_some_runs_is_taken_out_of_all(monkeypatch):
    """Five of six are searched, the one of another speed among them: it tells order from tone."""
    campaign = with_tone(twin_campaign(None), 1.37)
    campaign = replace(campaign, runs=campaign.runs[::-1])
    usual = off_orders(campaign)
    numbers = "carrierflex.diagnosis.carrier.off_order_lines._MOST_SEARCHED"
    samples = sum(run.time.size for run in campaign.runs)
    monkeypatch.setattr(numbers, samples * 11 // 12)
    few = off_orders(campaign)
    assert len(_searched(campaign)) == len(campaign.runs) - 1
    assert list(few.speeds) == [run.name for run in campaign.runs]
    assert few.lines[0][0].position == pytest.approx(usual.lines[0][0].position, rel=1e-3)
    for run, cleaned in zip(campaign.runs, few.campaign.runs, strict=True):
        hum = AMPLITUDE * np.sin(2.0 * np.pi * 1.37 * run.time)
        taken = run.signals["r040"] - cleaned.signals["r040"]
        assert np.std(taken - hum) < 0.2 * np.std(hum)
