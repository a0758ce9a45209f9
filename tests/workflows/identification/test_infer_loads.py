"""From records to loads of the planet pins: files, refusals, and what the intervals hold."""

import io

import numpy as np
import pytest
from rich.console import Console

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.reduction.body_files import write_body
from carrierflex.reduction.pin_joints import carrier_with_pins
from carrierflex.simulation.stage.hidden_stages import Bodies, load_of, loaded_turn, stage_at
from carrierflex.simulation.stage.stage_data import StageData
from carrierflex.workflows.identification import infer_loads
from carrierflex.workflows.screen.tables import loads_table
from studies.tabulate_planet_loads import KNOWN, NOMINAL, SENSORS
from tests.workflows.checked_documents import checked_document

HIDDEN = np.array([250e3, -120e3, 60e3])


def campaign_of(runs, *, n_planets=3, sensors=SENSORS):
    channels = tuple(
        Channel(s.name, s.quantity, "m", angle=s.angle, radius=s.radius) for s in sensors
    )
    rig = {"nominal_torque": NOMINAL, "sensor_radius": 0.412, "n_planets": n_planets}
    if n_planets != 3:
        rig["deflection_curves"] = "curves.csv"
    baseline = Baseline("model", ("axial_offset",))
    return Campaign("carrier", "simulated", baseline, rig, channels, tuple(runs))


def run_of(name, readings, torque, rng, sensors=SENSORS):
    angle = 2.0 * np.pi * np.arange(36 * 6) / 36
    inputs = {"carrier_angle": angle, "torque": np.full(angle.size, torque)}
    inputs |= {"ntl_y": np.zeros(angle.size), "ntl_z": np.zeros(angle.size)}
    signals = {
        s.name: np.tile(values, 6) + 2e-6 * rng.standard_normal(angle.size)
        for s, values in zip(sensors, readings, strict=True)
    }
    return Run(name, f"{name}.csv", name, angle, inputs, signals)


@pytest.fixture(scope="module")
def body_file(flexible_reduction, tmp_path_factory):
    path = tmp_path_factory.mktemp("body") / "carrier.h5"
    write_body(flexible_reduction.model, path)
    return path


@pytest.fixture(scope="module")
def flat(tmp_path_factory):
    """Campaign whose sensors read nothing."""
    rng = np.random.default_rng(0)
    folder = tmp_path_factory.mktemp("flat") / "campaign"
    write_campaign(campaign_of([run_of("a", np.zeros((6, 36)), NOMINAL, rng)]), folder)
    return folder


@pytest.mark.long
def test_intervals_hold_the_loads_of_a_stage(
    flexible_reduction, pin_reduction, body_file, tmp_path, monkeypatch
):
    """A hidden stage: its torque and most of its pin forces, in file, table and on the screen."""
    bodies = Bodies(flexible_reduction.model, pin_reduction.model, StageData())
    model = stage_at(np.random.default_rng(8).random(bodies.n_hidden)).model(bodies)
    turns = [loaded_turn(model, load_of(x, 1.22), SENSORS, n_angles=36) for x in (KNOWN, HIDDEN)]
    rng = np.random.default_rng(0)
    runs = [
        run_of("known", turns[0].readings, NOMINAL, rng),
        run_of("hidden", turns[1].readings, 0.0, rng),
    ]
    write_campaign(campaign_of(runs), tmp_path / "campaign")
    module = "carrierflex.workflows.simulation.stage_bodies.reduced_pin"
    monkeypatch.setattr(module, lambda _size: pin_reduction.model)
    out = tmp_path / "loads"
    folder = tmp_path / "campaign"
    inferred = infer_loads.main(folder, body=body_file, out=out, draws=600, quiet=True)
    document = checked_document(out / "loads.json")
    known, hidden = document["runs"]
    assert inferred.known_run == known["run"] == "known"
    assert [known["torque"][key] for key in ("low", "high")] == pytest.approx([NOMINAL] * 2)
    assert hidden["torque"]["low"] < HIDDEN[0] < hidden["torque"]["high"]
    estimate = inferred.estimates["hidden"]
    true = turns[1].pins[:, :, ::3]
    covered = np.abs(estimate.pins - true)[:, 0] <= estimate.half_width[:, 0]
    assert covered.mean() > 0.7  # one draw of what holds 95 % on average, pins and angles alike
    # Moment balance: the inferred forces hold the inferred torque.
    assert estimate.pins[:, 0].sum(axis=0) * 0.308 == pytest.approx(
        np.full(12, estimate.load[0]), rel=2e-3
    )
    lines = (out / "loads.csv").read_text(encoding="utf-8").splitlines()
    assert len(lines) == 1 + 2 * 3 * 4 * 12
    assert (out / "loads_hidden.png").read_bytes().startswith(b"\x89PNG")
    console = Console(width=120, record=True, file=io.StringIO())
    console.print(loads_table(inferred))
    assert "360.0, known" in console.export_text()


@pytest.mark.long
def test_what_cannot_be_inferred_is_refused(body_file, flat, tmp_path):
    def refused(match, **changes):
        with pytest.raises(ValueError, match=match):
            infer_loads.main(flat, body=body_file, out=tmp_path / "x", quiet=True, **changes)
        assert not (tmp_path / "x").exists()

    refused("expected 600 or more", draws=10)
    refused("--workers is 0; expected 1 or more", workers=0)
    refused("no such run; expected one of a", known_run="b")
    refused(r"known torque is -5 N m; expected a positive one", known_torque=-5.0)


def test_a_carrier_with_its_pins_is_refused(flexible_reduction, pin_reduction, flat, tmp_path):
    pinned = carrier_with_pins(flexible_reduction.model, pin_reduction.model)
    write_body(pinned, tmp_path / "stiff.h5")
    with pytest.raises(ValueError, match="comes with its pins"):
        infer_loads.main(flat, body=tmp_path / "stiff.h5", out=tmp_path / "x", quiet=True)


def test_two_axial_sensors_are_too_few(body_file, tmp_path):
    rng, two = np.random.default_rng(0), SENSORS[:2]
    run = run_of("a", np.zeros((2, 36)), NOMINAL, rng, two)
    write_campaign(campaign_of([run], sensors=two), tmp_path / "campaign")
    with pytest.raises(ValueError, match="2 axial sensors; expected three or more"):
        infer_loads.main(tmp_path / "campaign", body=body_file, out=tmp_path / "x", quiet=True)


def test_a_campaign_of_four_planets_needs_their_carrier(body_file, flat, tmp_path):
    document = (flat / "campaign.toml").read_text(encoding="utf-8")
    folder = tmp_path / "four"
    folder.mkdir()
    (folder / "a.csv").write_bytes((flat / "a.csv").read_bytes())
    (folder / "curves.csv").write_text("", encoding="utf-8")
    text = document.replace("n_planets = 3", 'n_planets = 4\ndeflection_curves = "curves.csv"')
    (folder / "campaign.toml").write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match="a carrier of 3 planets; expected 4"):
        infer_loads.main(folder, body=body_file, out=tmp_path / "x", quiet=True)
