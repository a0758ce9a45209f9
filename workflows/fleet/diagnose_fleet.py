"""Diagnose every campaign below a folder with one baseline and model, and set them side by side.

Writes a folder of results for each campaign, then fleet.json, fleet.csv, fleet.parquet and
fleet.html: cause and size by turbine and day, the fleet's prior of every size, turbines that differ
and changes over time. The same command goes on where it was interrupted. A good answer: no campaign
without a diagnosis, and no turbine whose interval lies away from the others without a reason.
"""

from __future__ import annotations

import functools
import hashlib
import json
import os
import secrets
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, Executor, as_completed
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypedDict

from carrierflex.files.json_files import read_json, save_json, save_text
from carrierflex.files.shown_values import shortened
from carrierflex.files.versions import Software, Versions, software_name, versions
from carrierflex.files.whole_files import file_digest, refuse_foreign_files, whole_file
from carrierflex.identification.campaign.document_files import read_campaign_header
from carrierflex.identification.campaign.file_names import DOCUMENT_NAME
from carrierflex.workflows.diagnosis.diagnose_campaign import REPORT_FILE, marks_of_diagnosis
from carrierflex.workflows.diagnosis.diagnose_campaign import main as diagnose_campaign
from carrierflex.workflows.executors import check_workers, other_processes, work_executor
from carrierflex.workflows.outputs import prepared_folder, save_table
from carrierflex.workflows.progress import Stages

if TYPE_CHECKING:
    from carrierflex.workflows.diagnosis.fleet_sizes import CampaignRow
    from carrierflex.workflows.fleet.fleet import FleetDiagnosis, FleetPrior, SizeTrend

FORMAT = "carrierflex-fleet"
FLEET_FILE, PAGE_FILE = "fleet.json", "fleet.html"
TABLE_FILE, PARQUET_FILE = "fleet.csv", "fleet.parquet"
#: Signs of a reason that are shown while the batch runs; the page has them all.
_MOST_SHOWN = 200
#: Folder of the results of every campaign.
CAMPAIGNS = "campaigns"
#: Written last into a campaign's folder of results: it is finished.
ENTRY_FILE = "batch.json"
_ENDED = (
    "its process ended without a message, as one that runs out of memory does; expected a shorter "
    "record or more memory: diagnose it alone"
)


class EntryDocument(TypedDict):
    """batch.json, written by batch into every campaign's folder of results."""

    key: Annotated[str, "SHA-256 of the campaign's files, the options and the versions"]
    run: Annotated[str, "Mark of the run of batch that began it"]
    state: Annotated[Literal["begun", "finished"], "Whether the diagnosis has ended"]
    error: Annotated[str | None, "Why there is no diagnosis; null where there is one"]
    seconds: Annotated[float, "Time of the diagnosis [s]"]


class OptionsDocument(TypedDict):
    """Options that are the same for all campaigns."""

    baseline: Annotated[Sequence[str] | None, "Effects of the baseline; null: as campaign.toml"]
    effects: Annotated[Sequence[str] | None, "Effects that are candidates; null: all of the kind"]
    law: Annotated[Sequence[str], "SHA-256 of law files that are candidates"]
    seed: Annotated[int, "Seed of the bootstrap samples"]


class FleetDocument(TypedDict):
    """fleet.json, written by batch."""

    format: Annotated[Literal["carrierflex-fleet"], "Kind of the file"]
    version: Annotated[Literal[1], "Version of the format"]
    software: Software
    versions: Versions
    folder: Annotated[str, "Folder of the campaigns"]
    options: Annotated[OptionsDocument, "Options of every diagnosis"]
    campaigns: Annotated[Sequence[CampaignRow], "Campaigns, by turbine and day"]
    priors: Annotated[Sequence[FleetPrior], "Sizes over the turbines, where four know one"]
    trends: Annotated[Sequence[SizeTrend], "Sizes over time, where three days know one"]


@dataclass(frozen=True)
class _Options:
    """Options of every diagnosis."""

    baseline: list[str] | None
    effects: list[str] | None
    law: list[Path]
    seed: int
    report: bool

    def document(self) -> OptionsDocument:
        """What decides a result."""
        laws = [file_digest(path) for path in self.law]
        return {
            "baseline": self.baseline,
            "effects": self.effects,
            "law": laws,
            "seed": self.seed,
        }


@dataclass(frozen=True)
class Task:
    """A campaign, where its results go, and a mark of the run of batch."""

    name: str
    campaign: Path
    out: Path
    run: str


def main(
    folder: Path,
    *,
    out: Path,
    baseline: list[str] | None = None,
    effects: list[str] | None = None,
    law: list[Path] | None = None,
    seed: int = 0,
    report: bool = True,
    workers: int = 1,
    scheduler: str | None = None,
    quiet: bool = False,
) -> FleetDiagnosis:
    """Diagnose all campaigns below a folder, and compare turbines and days.

    The keys `turbine` and `recorded` of campaign.toml say what was measured and when. Without the
    first, the turbine is the folder directly below FOLDER; without the second, there are no changes
    over time.

    Parameters
    ----------
    folder : Path
        Folder with campaign folders at any depth.
    out : Path
        Folder to write: fleet.json, fleet.csv, fleet.parquet and fleet.html, and a folder of
        results for each campaign. A second run with the same folder continues: it skips campaigns
        with unchanged files, options and versions, and repeats failed ones.
    baseline : list of str, optional
        Effects of the baseline of every campaign, instead of those of campaign.toml; may be given
        several times.
    effects : list of str, optional
        Effects that are candidates; default: all of the kind. May be given several times.
    law : list of Path, optional
        Law files (TOML) that are further candidates; may be given several times.
    seed : int
        Seed of the bootstrap samples behind the intervals, 0 or more.
    report : bool
        Draw report.html of every campaign, to which fleet.html links.
    workers : int
        Processes that diagnose campaigns.
    scheduler : str, optional
        Address of a Dask scheduler (tcp://host:8786) instead of --workers; its workers must have
        access to both folders.
    quiet : bool
        Show no progress.

    Returns
    -------
    FleetDiagnosis
        Campaigns, sizes with the fleet as prior, changes over time.

    Raises
    ------
    ValueError
        Where no campaign is below the folder, or an option is refused.
    OSError
        Where `out` cannot be written, or holds files of this name that are no results of batch.
    """
    check_workers(workers, scheduler)
    if seed < 0:
        raise ValueError(f"--seed is {seed}; expected a whole number >= 0")
    from carrierflex.simulation.law_files import read_law

    for path in law or ():
        # A law that is refused ends no batch of hours.
        read_law(path)
    options = _Options(baseline, effects, [path.resolve() for path in law or ()], seed, report)
    stated = options.document()
    tasks = list(_tasks(folder.resolve(), out.resolve()))
    if not tasks:
        raise ValueError(
            f"{folder}: no folder below it holds {DOCUMENT_NAME}; expected campaign folders, as "
            f"{folder / 'T01' / '2026-01' / DOCUMENT_NAME}"
        )
    _refuse_foreign(out, tasks)
    prepared_folder(out)
    stages = Stages(2, quiet, (1.0, 0.0))
    with stages.stage(f"diagnosing {len(tasks)} campaigns below {folder}"):
        work = functools.partial(_diagnose, options=options)
        errors = diagnosed(tasks, work, stages, lambda: _processes(workers, scheduler))

    from carrierflex.workflows.fleet.fleet import fleet_diagnosis

    with stages.stage(f"writing {out / PAGE_FILE}"):
        fleet = fleet_diagnosis([_row(task, errors.get(task.name)) for task in tasks])
        _write(fleet, folder, out, stated)
    return fleet


def _refuse_foreign(out: Path, tasks: Sequence[Task]) -> None:
    """Refuse files that batch did not write where it is to write, before any work."""
    marks = {
        out / FLEET_FILE: f'"{FORMAT}"',
        out / TABLE_FILE: "campaign,turbine,",
        out / PARQUET_FILE: "gap_floors",
        out / PAGE_FILE: "carrierflex",
    }
    for task in tasks:
        marks |= {task.out / ENTRY_FILE: '"run"', **marks_of_diagnosis(task.out)}
    refuse_foreign_files(marks)


def _tasks(folder: Path, out: Path) -> Iterator[Task]:
    """Campaigns below a folder, sorted; hidden folders and the results are passed over."""
    run = secrets.token_hex(8)
    for current, below, files in os.walk(folder):
        path = Path(current)
        below[:] = sorted(name for name in below if not name.startswith(".") and path / name != out)
        if DOCUMENT_NAME in files:
            below.clear()
            name = path.relative_to(folder).as_posix()
            # A folder that is itself a campaign is a fleet of one.
            name = folder.name if name == "." else name
            yield Task(name, path, out / CAMPAIGNS / name, run)


def diagnosed(
    tasks: Sequence[Task],
    work: Callable[[Task], None],
    stages: Stages,
    processes: Callable[[], AbstractContextManager[Executor]],
) -> dict[str, str]:
    """Do the work of every campaign, whatever becomes of one of them or of its process.

    Parameters
    ----------
    tasks : sequence of Task
        Campaigns.
    work : callable
        Writes the results of one; a function that other processes can import.
    stages : Stages
        Where progress is shown.
    processes : callable
        Makes the executor.

    Returns
    -------
    dict
        By campaign, why nothing could be written down of it.

    Raises
    ------
    RuntimeError
        Where processes end before they begin with a campaign.
    """
    errors: dict[str, str] = {}

    def end(task: Task, error: str | None) -> None:
        if error is not None:
            errors[task.name] = error
        reason = error or entry_of(task).get("error")
        if reason:
            stages.tell(f"{task.name}: {shortened(reason, _MOST_SHOWN)}")

    waiting = list(tasks)
    while waiting:
        ended: set[str] = set()
        with processes() as executor:
            for task, error in _results(executor, waiting, work):
                ended.add(task.name)
                end(task, error)
                n_done = len(tasks) - len(waiting) + len(ended)
                stages.note(f"{n_done} of {len(tasks)}", n_done / len(tasks))
        waiting = [task for task in waiting if task.name not in ended]
        suspects = [task for task in waiting if _is_begun(task)]
        if waiting and not ended and not suspects:
            raise RuntimeError(
                "the processes of --workers end before they diagnose a campaign; expected enough "
                "memory to load the libraries: fewer --workers"
            )
        # A process that ended takes the others' work with it: those it may have had run alone.
        for task in suspects:
            waiting.remove(task)
            with other_processes(1) as executor:
                results = list(_results(executor, [task], work))
            end(task, results[0][1] if results else _ENDED)
    return errors


def _results(
    executor: Executor, tasks: Sequence[Task], work: Callable[[Task], None]
) -> Iterator[tuple[Task, str | None]]:
    """Campaigns as they end, with what could not be written; stops where a process is lost."""
    futures = {executor.submit(work, task): task for task in tasks}
    for future in as_completed(futures):
        error = future.exception()
        if isinstance(error, BrokenExecutor):
            return
        yield futures[future], None if error is None else _words_of(error)


def _processes(workers: int, scheduler: str | None) -> AbstractContextManager[Executor]:
    """Executor in other processes, even if it is only one: a campaign must not end the batch."""
    if workers == 1 and scheduler is None:
        return other_processes(1)
    return work_executor(workers, scheduler)


def _diagnose(task: Task, *, options: _Options) -> None:
    """Diagnose a campaign unless its result stands; a refusal is a result too."""
    key = _key(task.campaign, options)
    entry = entry_of(task)
    finished = entry.get("state") == "finished" and entry.get("error") is None
    has_pages = not options.report or (task.out / REPORT_FILE).is_file()
    if finished and entry.get("key") == key and has_pages:
        return
    prepared_folder(task.out)
    begun: EntryDocument = {
        "key": key,
        "run": task.run,
        "state": "begun",
        "error": None,
        "seconds": 0.0,
    }
    save_json(task.out / ENTRY_FILE, begun)
    start = time.perf_counter()
    error = None
    try:
        diagnose_campaign(
            task.campaign,
            out=task.out,
            law=options.law,
            baseline=options.baseline,
            effects=options.effects,
            seed=options.seed,
            report=options.report,
            quiet=True,
        )
    except Exception as raised:
        error = _words_of(raised)
    seconds = time.perf_counter() - start
    ended: EntryDocument = {**begun, "state": "finished", "error": error, "seconds": seconds}
    save_json(task.out / ENTRY_FILE, ended)


def _words_of(error: BaseException) -> str:
    """Error as one line; what is no refusal of this program with its kind."""
    text = " ".join(str(error).split())
    return text if isinstance(error, ValueError) and text else f"{type(error).__name__}: {text}"


def _key(campaign: Path, options: _Options) -> str:
    """SHA-256 of the files of a campaign, the options and the versions."""
    files = [path for path in sorted(campaign.iterdir()) if path.is_file()]
    digests = {path.name: file_digest(path) for path in files if not path.name.startswith(".")}
    content = {"files": digests, "options": options.document(), "versions": versions()}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _is_begun(task: Task) -> bool:
    """Whether this run of batch began a campaign and did not end it."""
    entry = entry_of(task)
    return entry.get("state") == "begun" and entry.get("run") == task.run


def entry_of(task: Task) -> Mapping[str, Any]:
    """Entry of a campaign; empty where there is none to trust."""
    try:
        entry = read_json(task.out / ENTRY_FILE, "an entry of batch")
    except (ValueError, OSError):
        return {}
    return entry if isinstance(entry, dict) else {}


def _row(task: Task, error: str | None) -> CampaignRow:
    """Row of a campaign; one without a diagnosis says why."""
    from carrierflex.diagnosis.report.diagnosis_files import DIAGNOSIS_FILE, read_diagnosis
    from carrierflex.workflows.diagnosis.fleet_sizes import FAILED, CampaignRow, campaign_row

    turbine, recorded, kind = task.name.split("/")[0], "", ""
    try:
        header = read_campaign_header(task.campaign)
        turbine = header.turbine or turbine
        recorded = header.recorded.isoformat() if header.recorded else ""
        kind = header.contract.name
        error = error or entry_of(task)["error"]
        if error is None:
            document = read_diagnosis(task.out / DIAGNOSIS_FILE)
            return campaign_row(document, task.name, turbine, recorded)
    except (ValueError, KeyError, TypeError, OSError) as raised:
        error = error or entry_of(task).get("error") or _words_of(raised)
    return CampaignRow(task.name, turbine, recorded, kind, FAILED, error)


def table_rows(fleet: FleetDiagnosis) -> Iterator[dict[str, Any]]:
    """Rows of fleet.csv and fleet.parquet: one a campaign and size, units in a column."""
    nan = float("nan")
    in_fleet = {
        (one.campaign, prior.cause, prior.parameter): one
        for prior in fleet.priors
        for one in prior.turbines
    }
    for row in fleet.rows:
        of_campaign = {
            "campaign": row.campaign,
            "turbine": row.turbine,
            "recorded": row.recorded,
            "kind": row.kind,
            "verdict": row.verdict,
            "text": row.text,
            "gap_floors": row.gap_floors,
            "noise_floor": row.noise_floor,
            "rho": row.rho,
            "rho_low": row.rho_ci95[0],
            "rho_high": row.rho_ci95[1],
            "faults": "; ".join(row.faults),
            "first_fault": row.first_fault,
        }
        for size in row.sizes or (None,):
            one = in_fleet.get((row.campaign, size.cause, size.parameter)) if size else None
            low, high = size.ci95 if size else (nan, nan)
            yield of_campaign | {
                "cause": size.cause if size else "",
                "parameter": size.parameter if size else "",
                "is_named": bool(size and size.is_named),
                "value": size.value if size else nan,
                "std": size.std if size else nan,
                "low": low,
                "high": high,
                "unit": size.unit if size else "",
                "shrunk": one.shrunk if one else nan,
                "shrunk_low": one.shrunk_ci95[0] if one else nan,
                "shrunk_high": one.shrunk_ci95[1] if one else nan,
                "differs": bool(one and one.differs),
            }


def _write(fleet: FleetDiagnosis, folder: Path, out: Path, options: OptionsDocument) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pa_parquet

    from carrierflex.workflows.fleet.fleet_page import fleet_page

    document: FleetDocument = {
        "format": "carrierflex-fleet",
        "version": 1,
        "software": software_name(),
        "versions": versions(),
        "folder": str(folder),
        "options": options,
        "campaigns": fleet.rows,
        "priors": fleet.priors,
        "trends": fleet.trends,
    }
    save_json(out / FLEET_FILE, document)
    rows = list(table_rows(fleet))
    save_table(out / TABLE_FILE, list(rows[0]), [list(row.values()) for row in rows])
    with whole_file(out / PARQUET_FILE) as path:
        pa_parquet.write_table(pa.Table.from_pylist(rows), path)
    save_text(out / PAGE_FILE, fleet_page(fleet, folder, CAMPAIGNS, REPORT_FILE))
