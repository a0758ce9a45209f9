"""The command watch: alarms of a folder and of standard input, restarts, refusals."""

import io
import json
import signal
import subprocess
import sys
import time
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pa_parquet
import pytest

from carrierflex.diagnosis.report.diagnosis_files import DIAGNOSIS_FILE
from carrierflex.workflows.fleet import watch_turbine
from tests.diagnosis.carrier.watch.turbines import (
    ANGLES,
    DEFLECTION,
    NOISE,
    TILT,
    effect_signal,
    record,
)
from tests.diagnosis.carrier.watch.turbines import turbine as running_turbine
from tests.workflows.checked_documents import checked_document

BASELINE = running_turbine()
SINCE, N = 115, 140
HOUSING_TILT = 3.0 * NOISE * np.sqrt(2.0) / 0.412  # of three floors [rad]
CAMPAIGN = """format = "carrierflex-campaign"
version = 2
kind = "carrier"
name = "T07"
runs = [{ name = "LC1", file = "LC1.csv", condition = "full load" }]

[baseline]
source = "model"
effects = ["axial_offset", "carrier_tilt", "flexible_pins", "flange_warp"]

[rig]
nominal_torque = 360e3
sensor_radius = 0.412
n_planets = 3
"""


def cause(columns, signals):
    return signals + effect_signal(BASELINE, columns, "housing_tilt", (HOUSING_TILT, 0.0))


@pytest.fixture(scope="module")
def columns():
    return record(BASELINE, N, np.random.default_rng(21), cause, since=SINCE)


@pytest.fixture
def diagnosed(tmp_path):
    """Folders of a campaign and of its diagnosis, with what watch reads of them."""
    folder = tmp_path / "campaign"
    folder.mkdir()
    channels = (
        f'[[channels]]\nname = "{name}"\nquantity = "axial_displacement"\nunit = "m"\n'
        f"angle_deg = {angle}\nradius_m = 0.412\n"
        for name, angle in ANGLES.items()
    )
    (folder / "campaign.toml").write_text(CAMPAIGN + "\n" + "\n".join(channels))
    (folder / "LC1.csv").write_text("time\n")
    # As of a diagnosis that leaves a parameter undetermined.
    polar = {"phi_PLC": float(np.hypot(*TILT)), "theta_PLC": float(np.arctan2(TILT[1], TILT[0]))}
    values = {"carrier_tilt": polar, "flexible_pins": {"rho_f": DEFLECTION}, "flange_warp": {}}
    document = {
        "format": "carrierflex-diagnosis",
        "version": 2,
        "campaign": "T07",
        "kind": "carrier",
        "verdict": "at_noise_floor",
        "effects": [],
        "parameters": {
            effect: {name: {"value": value} for name, value in of.items()}
            for effect, of in values.items()
        },
        "how_far": {"rms_after": 3.1e-6, "noise_floor": 3e-6},
    }
    (tmp_path / DIAGNOSIS_FILE).write_text(json.dumps(document))
    return {"baseline": tmp_path, "campaign": folder, "learn": 100}


def write_files(folder, columns, n_files=7, *, begins_anew=False):
    """Write a record as Parquet files, where the logger's clock goes on or begins anew."""
    folder.mkdir(exist_ok=True)
    edges = np.linspace(0, columns["time"].size, n_files + 1).astype(int)
    for k, (first, end) in enumerate(pairwise(edges)):
        piece = {name: values[first:end] for name, values in columns.items()}
        if begins_anew:
            piece["time"] = piece["time"] - piece["time"][0]
        pa_parquet.write_table(pa.table(piece), folder / f"{k:04d}.parquet")


def test_a_folder_gives_an_alarm_page_and_document(tmp_path, diagnosed, columns):
    write_files(tmp_path / "records", columns)
    out = tmp_path / "out"
    result = watch_turbine.main(tmp_path / "records", out=out, once=True, quiet=True, **diagnosed)
    assert [alarm.change.id for alarm in result.alarms] == ["housing/tilt"]
    assert result.alarms[0].since == SINCE
    assert result.state == "new reference"
    assert result.run_length == pytest.approx(86400.0 * 2.3 / (2.0 * np.pi) / 1e-3, rel=0.01)
    document = checked_document(out / "watch.json")
    assert document["watch"]["lines"] == result.lines
    assert result.lines[0].startswith(
        f"T07: tilt of the housing since revolution {SINCE} (0006.parquet"
    )
    page = (out / "watch.html").read_text(encoding="utf-8")
    assert "Taking a new reference: 1 alarm; 139 revolutions read" in page
    assert "tilt of the housing since revolution 115" in page
    assert "http://" not in page.replace("http://www.w3.org", "")
    # Again: nothing new.
    again = watch_turbine.main(tmp_path / "records", out=out, once=True, quiet=True, **diagnosed)
    assert again.lines == result.lines


def test_standard_input_says_the_same_as_a_folder(tmp_path, diagnosed, columns, monkeypatch):
    write_files(tmp_path / "records", columns)
    options = {"once": True, "quiet": True, **diagnosed}
    expected = watch_turbine.main(tmp_path / "records", out=tmp_path / "one", **options)
    rows = np.column_stack(list(columns.values()))
    text = ",".join(columns) + "\n" + "\n".join(",".join(map(repr, row)) for row in rows.tolist())
    stream = io.BytesIO((text + "\n").encode())
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=stream))
    result = watch_turbine.main(watch_turbine.Path("-"), out=tmp_path / "two", **options)
    of_both = [
        [(alarm.revolution, alarm.since, alarm.size) for alarm in one.alarms]
        for one in (expected, result)
    ]
    assert of_both[0] == of_both[1]
    assert len(of_both[0]) == 1


def test_files_whose_clock_begins_anew_lose_the_turn_between_them(tmp_path, diagnosed, columns):
    write_files(tmp_path / "records", columns, begins_anew=True)
    options = {"once": True, "quiet": True, **diagnosed}
    result = watch_turbine.main(tmp_path / "records", out=tmp_path / "out", **options)
    assert (result.revolutions, result.omitted) == (N - 7, 1 + 6)
    # Five seams are before the change.
    assert [alarm.since for alarm in result.alarms] == [SINCE - 5]


@pytest.mark.long
def test_nothing_is_lost_where_the_command_is_killed(tmp_path, diagnosed, columns):
    """Killed again and again while files come, it ends as the one that was never killed."""
    records = tmp_path / "records"
    write_files(records, columns, 40)
    options = {"once": True, "quiet": True, **diagnosed}
    unbroken = watch_turbine.main(records, out=tmp_path / "unbroken", **options)
    rng = np.random.default_rng(22)
    line = [sys.executable, "-m", "carrierflex.workflows.command_line", "watch", str(records)]
    line += ["--baseline", str(tmp_path), "--campaign", str(diagnosed["campaign"]), "--quiet"]
    line += ["--learn", "100", "--every", "0.05", "--out", str(tmp_path / "out")]
    for _ in range(3):
        process = subprocess.Popen(line)
        deadline = time.monotonic() + 60.0
        while not (tmp_path / "out" / "state.npz").exists() and time.monotonic() < deadline:
            time.sleep(0.02)
        time.sleep(rng.uniform(0.0, 0.5))
        process.send_signal(signal.SIGKILL)
        process.wait()
    killed = watch_turbine.main(records, out=tmp_path / "out", **options)
    assert killed.lines == unbroken.lines
    assert killed.alarms[0].size == unbroken.alarms[0].size
    assert killed.revolutions == unbroken.revolutions


def test_what_is_wrong_is_refused_by_name(tmp_path, diagnosed, columns):
    options = {"once": True, "quiet": True, **diagnosed}
    records, out = tmp_path / "records", tmp_path / "out"
    with pytest.raises(ValueError, match="records: no such folder; expected a folder with Parquet"):
        watch_turbine.main(records, out=out, **options)
    records.mkdir()
    with pytest.raises(ValueError, match="--learn is 50; expected at least 100 revolutions"):
        watch_turbine.main(records, out=out, **{**options, "learn": 50})
    with pytest.raises(ValueError, match="--false-alarms is 2; expected a number above 0"):
        watch_turbine.main(records, out=out, false_alarms=2.0, **options)
    table = pa.table({"time": [0.0, 1.0, 0.5], **{name: [0.0] * 3 for name in [*columns][1:]}})
    pa_parquet.write_table(table, records / "a.parquet")
    with pytest.raises(ValueError, match=r"a.parquet: column 'time' goes back to 0.5 s; expected"):
        watch_turbine.main(records, out=out, **options)
    (tmp_path / "nothing").mkdir()
    watch_turbine.main(tmp_path / "nothing", out=tmp_path / "empty", **options)
    with pytest.raises(ValueError, match=r"state.npz: is of a watch with another baseline or"):
        watch_turbine.main(records, out=tmp_path / "empty", least=2.0, **options)
    out.joinpath("watch.html").write_text("mine")
    with pytest.raises(FileExistsError, match=r"watch.html: is there already"):
        watch_turbine.main(records, out=out, **options)


def test_a_campaign_that_has_changed_since_its_diagnosis_is_refused(tmp_path, diagnosed):
    path = tmp_path / DIAGNOSIS_FILE
    document = json.loads(path.read_text())
    document["records"] = {"files": {"campaign.toml": "0" * 64}}
    path.write_text(json.dumps(document))
    with pytest.raises(ValueError, match=r"campaign.toml: has changed since .* was written"):
        watch_turbine.main(tmp_path, out=tmp_path / "out", once=True, quiet=True, **diagnosed)
