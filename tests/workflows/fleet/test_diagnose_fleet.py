"""A batch of campaigns: one table of all, whatever becomes of one of them or of its process."""

import json
import tomllib
from concurrent.futures import BrokenExecutor, Future
from contextlib import nullcontext
from dataclasses import replace
from datetime import date

import pyarrow.parquet as pa_parquet
import pytest

from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.workflows.executors import SerialExecutor, other_processes
from carrierflex.workflows.fleet import diagnose_fleet
from carrierflex.workflows.fleet.diagnose_fleet import Task, diagnosed, entry_of
from carrierflex.workflows.progress import Stages
from tests.diagnosis.carrier.carrier_twin import LOADS, twin_campaign
from tests.workflows.checked_documents import checked_document
from tests.workflows.fleet.killed_work import write_or_die

TURBINES = ("T1", "T2", "T3", "T4")


def write_fleet(folder):
    """Four turbines with a tilt by the torque, one larger; a file that is no campaign beside."""
    campaign = twin_campaign("torque_tilt", loads=LOADS[:2])
    for number, name in enumerate(TURBINES):
        # Half as much again of every signal is half as much again of every cause.
        factor = 1.5 if name == "T4" else 1.0
        runs = [
            replace(run, signals={key: factor * row for key, row in run.signals.items()})
            for run in campaign.runs
        ]
        day = date(2026, 1, 10 + number)
        channels = [
            replace(channel, noise_std=factor * channel.noise_std) for channel in campaign.channels
        ]
        scaled = replace(campaign, runs=tuple(runs), channels=tuple(channels))
        measured = replace(scaled, turbine=name, recorded=day)
        write_campaign(measured, folder / f"machine {number + 1}" / "one")
    (folder / "bad").mkdir()
    (folder / "bad" / "campaign.toml").write_text("version = [", encoding="utf-8")
    (folder / "empty").mkdir()


@pytest.mark.long
def test_a_batch_holds_every_campaign_and_goes_on_where_it_was(tmp_path):
    write_fleet(tmp_path / "records")
    options = {
        "effects": ["torque_tilt", "carrier_tilt"], "report": False, "workers": 2, "quiet": True,
    }  # fmt: skip
    fleet = diagnose_fleet.main(tmp_path / "records", out=tmp_path / "out", **options)
    assert [row.turbine for row in fleet.rows] == ["T1", "T2", "T3", "T4", "bad"]
    assert [row.verdict for row in fleet.rows] == [*["named"] * 4, "error"]
    assert "campaign.toml: not a TOML file" in fleet.failed[0].text
    sizes = {
        row.turbine: size.value
        for row in fleet.latest
        for size in row.sizes
        if size.parameter == "phi_T"
    }
    # The signals, and their noise, are larger by the factor.
    assert sizes["T4"] == pytest.approx(1.5 * sizes["T1"], rel=1e-3)
    document = checked_document(tmp_path / "out" / "fleet.json")
    assert len(document["campaigns"]) == 5
    assert document["campaigns"][1]["recorded"] == "2026-01-11"
    table = pa_parquet.read_table(tmp_path / "out" / "fleet.parquet").to_pylist()
    of_named = [row for row in table if row["is_named"] and row["parameter"] == "phi_T"]
    assert {row["turbine"]: row["value"] for row in of_named} == pytest.approx(sizes)
    assert sum(row["verdict"] == "error" for row in table) == 1
    page = (tmp_path / "out" / "fleet.html").read_text(encoding="utf-8")
    assert "5 campaigns of 5 turbines: a cause is named in the last campaign of 4." in page

    # Again: nothing is diagnosed twice but what failed, and what has changed.
    folders = sorted((tmp_path / "out" / "campaigns").rglob("batch.json"))
    before = {path: (path.stat().st_mtime_ns, checked_document(path)) for path in folders}
    changed = tmp_path / "records" / "machine 2" / "one" / "campaign.toml"
    text = changed.read_text(encoding="utf-8").replace('turbine = "T2"', 'turbine = "T9"')
    assert tomllib.loads(text)["turbine"] == "T9"
    changed.write_text(text, encoding="utf-8")
    again = diagnose_fleet.main(tmp_path / "records", out=tmp_path / "out", **options)
    assert [row.turbine for row in again.rows] == ["T1", "T3", "T4", "T9", "bad"]
    redone = [path.parent.name for path in folders if path.stat().st_mtime_ns != before[path][0]]
    assert len(folders) == 5
    assert sorted(redone) == ["bad", "one"]


@pytest.mark.long
def test_a_process_that_is_lost_takes_no_other_campaign_with_it(tmp_path):
    names = ("a", "kills", "b", "once", "raises", "c", "d")
    tasks = [Task(name, tmp_path, tmp_path / "out" / name, "now") for name in names]
    errors = diagnosed(tasks, write_or_die, Stages(1, quiet=True), lambda: other_processes(2))
    assert set(errors) == {"kills", "raises"}
    assert "out of memory" in errors["kills"]
    assert errors["raises"] == "OSError: no space left"
    finished = {task.name for task in tasks if entry_of(task)["state"] == "finished"}
    assert finished == {"a", "b", "c", "d", "once"}


class LosesItsProcess(SerialExecutor):
    """Executor that does the work and whose answer is lost."""

    def submit(self, function, /, *arguments, **options):
        super().submit(function, *arguments, **options)
        future = Future()
        future.set_exception(BrokenExecutor("a process ended"))
        return future


@pytest.mark.long
def test_a_campaign_that_is_run_again_alone_says_why_it_failed(tmp_path):
    task = Task("raises", tmp_path, tmp_path / "out", "now")
    errors = diagnosed(
        [task], write_or_die, Stages(1, quiet=True), lambda: nullcontext(LosesItsProcess())
    )
    assert errors == {"raises": "OSError: no space left"}


@pytest.mark.parametrize("has_fleet", [False, True])
@pytest.mark.parametrize(
    "name",
    [
        "fleet.json", "fleet.csv", "fleet.parquet", "fleet.html", "campaigns/bad/batch.json",
        "campaigns/bad/diagnosis.json", "campaigns/bad/report.html",
    ],
)  # fmt: skip
def test_what_batch_did_not_write_is_refused_before_any_work(
    name, has_fleet, tmp_path, monkeypatch
):
    monkeypatch.setattr(diagnose_fleet, "diagnosed", lambda *_: pytest.fail("work has begun"))
    (tmp_path / "records" / "bad").mkdir(parents=True)
    (tmp_path / "records" / "bad" / "campaign.toml").write_text("version = [", encoding="utf-8")
    out = tmp_path / "out"
    path = out / name
    path.parent.mkdir(parents=True)
    if has_fleet:
        (out / "fleet.json").write_text('{"format": "carrierflex-fleet"}', encoding="utf-8")
    path.write_text(json.dumps({"mine": 1}), encoding="utf-8")
    with pytest.raises(FileExistsError, match=rf"{path.name}: is there already"):
        diagnose_fleet.main(tmp_path / "records", out=out, quiet=True)
    assert json.loads(path.read_text(encoding="utf-8")) == {"mine": 1}
    path.unlink()
    path.mkdir()
    with pytest.raises(OSError, match=rf"{path.name}: is a folder; expected the name of a file"):
        diagnose_fleet.main(tmp_path / "records", out=out, quiet=True)


def test_a_folder_without_campaigns_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"no folder below it holds campaign\.toml; expected"):
        diagnose_fleet.main(tmp_path, out=tmp_path / "out", quiet=True)
