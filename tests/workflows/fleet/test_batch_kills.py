"""`batch` killed at random moments: nothing is lost, and its end is that of an undisturbed run.

``make acceptance`` kills 100 times (BATCH_KILLS: another number).
"""

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from dataclasses import replace

import pyarrow.parquet as pa_parquet
import pytest

from carrierflex.identification.campaign.campaign_files import write_campaign
from tests.diagnosis.carrier.carrier_twin import LOADS, twin_campaign

pytestmark = pytest.mark.acceptance

KILLS = int(os.environ.get("BATCH_KILLS", "100"))
LINE = [
    sys.executable, "-P", "-m", "carrierflex.workflows.command_line", "batch", "records",
    "--effects", "torque_tilt", "--effects", "carrier_tilt", "--no-report",
]  # fmt: skip


def started(folder, out):
    return subprocess.Popen(
        [*LINE, "--out", out],
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        start_new_session=True,
    )


def completed(folder, out):
    """Run to the end; its time [s]."""
    begin = time.monotonic()
    process = started(folder, out)
    _, stderr = process.communicate(timeout=1200)
    assert process.returncode == 0, stderr.decode()
    return time.monotonic() - begin


def results(out):
    """What a batch says, without the times of its work."""
    documents = {
        str(path.relative_to(out)): json.loads(path.read_text(encoding="utf-8"))
        for path in sorted(out.rglob("[!.]*.json"))
    }
    for name, document in documents.items():
        if name.endswith("batch.json"):
            del document["seconds"], document["run"]
        if name.endswith("report.json"):
            del document["data"]["source"]["written"]
    table = pa_parquet.read_table(out / "fleet.parquet").to_pylist()
    # What is not a number differs from itself.
    return documents, str(table), (out / "fleet.csv").read_bytes()


def finished(out):
    """Content of the folder of every campaign that is finished; all JSON files can be read."""
    contents = {}
    for path in out.rglob("[!.]*.json"):
        document = json.loads(path.read_text(encoding="utf-8"))
        if path.name == "batch.json" and document["state"] == "finished":
            contents |= {
                file: file.read_bytes() for file in path.parent.iterdir() if file.suffix == ".json"
            }
    return contents


def test_killed_batches_lose_nothing_and_end_as_an_undisturbed_one(tmp_path, capsys):
    campaign = twin_campaign("torque_tilt", loads=LOADS[:2])
    for name in ("T1", "T2"):
        write_campaign(replace(campaign, turbine=name), tmp_path / "records" / name / "one")
    seconds = completed(tmp_path, "calm")
    expected = results(tmp_path / "calm")
    rng, out = random.Random(), tmp_path / "fleet"
    counts: Counter[str] = Counter()
    while counts["kills"] < KILLS:
        before = finished(out)
        begin = time.monotonic()
        process = started(tmp_path, "fleet")
        time.sleep(rng.uniform(0.0, seconds))
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate(timeout=600)
        counts["kills"] += process.returncode == -signal.SIGKILL
        after = finished(out)
        counts["campaigns finished"] += len(after) > len(before)
        assert before.items() <= after.items()
        if process.returncode == 0:
            # The first run compiled: one from the beginning is quicker. One that goes on is shorter
            # still, and kills within its time alone would come before any campaign is finished.
            if not before:
                seconds = min(seconds, time.monotonic() - begin)
            assert results(out) == expected
            counts["undisturbed ends"] += 1
            shutil.rmtree(out)
        elif process.returncode > 0:
            pytest.fail(f"batch refused to go on after {counts['kills']} kills")
        with capsys.disabled():
            print(f"\r{dict(counts)}", end="", flush=True)
    completed(tmp_path, "fleet")
    assert results(out) == expected
    assert [path for path in out.rglob(".*") if path.name.startswith((".part-", ".old-"))] == []
    assert counts["campaigns finished"] > 0
