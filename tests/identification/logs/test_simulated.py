"""Another simulator's prediction beside a logger's records."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.identification.campaign_check.records_check import clock_shift_findings
from carrierflex.workflows.identification.import_records import main as import_records
from carrierflex.workflows.identification.new_campaign import main as new_campaign
from tests.workflows.checked_documents import checked_document

SHIFT = 0.737


def motion(t):
    return 1e-3 * (np.sin(1.7 * t) + 0.4 * np.sin(4.1 * t + 1.0) + 0.3 * np.sin(0.6 * t))


@pytest.fixture
def files(tmp_path):
    """Records of an element, and a prediction with a clock, a rate and names of its own."""
    time = np.arange(0.0, 60.0, 0.02)
    rng = np.random.default_rng(0)
    measured = motion(time) + 1e-6 * rng.standard_normal(time.size)
    rows = zip(time, 8e3 * motion(time), 1e6 * measured, strict=True)
    lines = [f"{t:.3f},{f:.6f},{x:.4f}" for t, f, x in rows]
    (tmp_path / "run.csv").write_text("t (s),force (N),disp (um)\n" + "\n".join(lines))
    clock = np.arange(0.0, 55.0, 0.007)
    lines = [
        f"{1e3 * t:.3f};{1e3 * x:.9f}" for t, x in zip(clock, motion(clock + SHIFT), strict=True)
    ]
    (tmp_path / "sim.txt").write_text("clock;q\n" + "\n".join(lines))
    new = new_campaign(
        kind="element", from_=[tmp_path / "run.csv"], drive="force", out=tmp_path / "map.toml"
    )
    tables = """
[simulated]
time = { column = "clock", unit = "ms" }
[[simulated.channels]]
channel = "measured_displacement"
column = "q"
unit = "mm"
"""
    new.path.write_text(new.text + tables, encoding="utf-8")
    return tmp_path


def imported(files):
    import_records(
        [files / "run.csv"],
        map_=files / "map.toml",
        simulated=[files / "sim.txt"],
        out=files / "campaign",
    )
    return read_campaign(files / "campaign")


def test_the_prediction_stands_on_the_clock_of_the_measurement(files):
    campaign = imported(files)
    assert campaign.baseline.source == "columns"
    (run,) = campaign.runs
    (prediction,) = run.predictions.values()
    inside = (run.time > 2.0) & (run.time < 54.0)
    assert_allclose(prediction[inside], motion(run.time[inside]), atol=3e-6)
    known = campaign.baseline.clock_shift["run"]
    assert_allclose(known.value, SHIFT, atol=1e-3)
    assert known.std < 1e-3
    shift = checked_document(files / "campaign" / "import.json")["clock_shift"]["run"]
    assert_allclose(shift["seconds"], known.value)


def test_a_shift_is_told_as_a_rival_of_the_sensors_delay(files):
    campaign = imported(files)
    (warning,) = clock_shift_findings(campaign)
    assert warning.about == "sensor_delay"
    assert "moved the simulator's clock by 737" in warning.text
    still = replace(campaign, baseline=replace(campaign.baseline, clock_shift={}))
    assert not list(clock_shift_findings(still))


def test_a_stated_shift_is_taken_and_not_sought(files):
    text = (files / "map.toml").read_text(encoding="utf-8")
    stated = text.replace("[simulated]\n", f"[simulated]\nshift = {SHIFT}\n")
    (files / "map.toml").write_text(stated, encoding="utf-8")
    campaign = imported(files)
    assert campaign.baseline.clock_shift == {}
    (prediction,) = campaign.runs[0].predictions.values()
    inside = (campaign.runs[0].time > 2.0) & (campaign.runs[0].time < 54.0)
    assert_allclose(prediction[inside], motion(campaign.runs[0].time[inside]), atol=3e-6)


def test_predictions_that_do_not_go_with_the_runs_are_refused(files):
    with pytest.raises(ValueError, match="--simulated has 2 files and the map 1 runs"):
        import_records(
            [files / "run.csv"],
            map_=files / "map.toml",
            simulated=[files / "sim.txt", files / "run.csv"],
            out=files / "campaign",
        )
    assert not (files / "campaign").exists()
