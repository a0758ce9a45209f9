"""Watch a turbine: tell from its running records when a new cause comes, or one changes its size.

Revolutions are compared, as they come, with a learning period of the same turbine, less what the
diagnosed baseline predicts. Writes watch.json and watch.html, and state.npz, from which the same
command goes on. A good answer: no alarm, and a dead band below the size that matters.
"""

from __future__ import annotations

import hashlib
import io
import json
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, BinaryIO, Literal, TypedDict

import numpy as np
import pyarrow.csv as pa_csv
import pyarrow.parquet as pa_parquet
from numpy.typing import NDArray

from carrierflex.files.json_files import read_document, save_json, save_text
from carrierflex.files.versions import Software, Versions, software_name, versions
from carrierflex.files.whole_files import file_digest, refuse_foreign
from carrierflex.identification.campaign.declarations import expected_columns
from carrierflex.identification.campaign.document_files import read_campaign_header, run_file_header
from carrierflex.identification.campaign.file_names import DOCUMENT_NAME, RUN_SUFFIXES
from carrierflex.identification.campaign.run_files import ExpectedColumns, column_pieces
from carrierflex.identification.estimation.single_thread import single_threaded
from carrierflex.workflows.fleet.watch_result import WatchResult
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages

if TYPE_CHECKING:
    from carrierflex.diagnosis.carrier.watch.rim_revolutions import RimBaseline
    from carrierflex.diagnosis.carrier.watch.turbine_watch import Alarm, TurbineWatch

Columns = dict[str, NDArray[np.float64]]
#: Consecutive samples of one file, empty of standard input; no columns where there is nothing new.
Piece = tuple[str, Columns]
#: Bytes of standard input that are taken at once at most.
_BLOCK = 1 << 18
_STANDARD_INPUT = "standard input"
FORMAT = "carrierflex-watch"
WATCH_FILE, PAGE_FILE, STATE_FILE = "watch.json", "watch.html", "state.npz"
#: Seconds between two states, and between two pages, where no alarm comes.
_STATE_EVERY, _PAGE_EVERY = 1.0, 60.0


class WatchDocument(TypedDict):
    """watch.json, written by watch."""

    format: Annotated[Literal["carrierflex-watch"], "Kind of the file"]
    version: Annotated[Literal[1], "Version of the format"]
    software: Software
    versions: Versions
    baseline: Annotated[str, "SHA-256 of diagnosis.json"]
    options: Annotated[dict[str, float], "Options of the watch"]
    watch: Annotated[WatchResult, "State and alarms"]


def main(
    source: Path,
    *,
    baseline: Path,
    out: Path,
    campaign: Path | None = None,
    learn: int = 200,
    least: float = 1.0,
    false_alarms: float = 1e-3,
    drift: float = 5.0,
    once: bool = False,
    every: float = 10.0,
    quiet: bool = False,
) -> WatchResult:
    """Watch the running records of a turbine for a new cause or a change of size.

    Kind carrier. The same command with the same folder goes on where it was ended or killed.

    Parameters
    ----------
    source : Path
        Folder to which Parquet or CSV files are added, read in the order of their names, or - for
        CSV rows from standard input. Columns are those of the campaign's run files, SI units.
    baseline : Path
        diagnosis.json of this turbine, or its folder: effects and values that are predicted.
    out : Path
        Folder to write: watch.json, watch.html, which needs no network, and state.npz.
    campaign : Path, optional
        Campaign folder that was diagnosed; default: where the diagnosis read it.
    learn : int
        Revolutions of the learning period, at least 100: mean, noise and memory of the noise.
    least : float
        Smallest change that is looked for, RMS over channels and turn [noise floors].
    false_alarms : float
        Largest mean rate of false alarms, above 0 and below 1 [1/turbine-day].
    drift : float
        Fastest drift of the offset common to all axial channels that is temperature and no change
        [noise floors an hour].
    once : bool
        End with the last file of the folder; default: wait for further ones until interrupted.
    every : float
        Time between two looks for further files [s].
    quiet : bool
        Show no progress and no alarms.

    Returns
    -------
    WatchResult
        State and alarms.

    Raises
    ------
    ValueError
        Where an option, the diagnosis or a file of the source is refused, or state.npz is of
        another watch.
    OSError
        Where `out` cannot be written, or holds files of these names that are not of watch.
    """
    _refuse(source, out, learn, least, false_alarms, drift, every)

    from carrierflex.diagnosis.carrier.watch.state_files import read_state
    from carrierflex.diagnosis.carrier.watch.turbine_watch import TurbineWatch, WatchOptions

    rim, expected, document, digest = _diagnosed(baseline, campaign)
    far = document["how_far"]
    after, noise = far.get("rms_after"), far.get("noise_floor")
    remaining = float(np.sqrt(max(after**2 - noise**2, 0.0))) if after and noise else 0.0
    options = WatchOptions(learn, least, false_alarms, drift, remaining)
    key = hashlib.sha256(f"{digest} {json.dumps(asdict(options))}".encode()).hexdigest()
    prepared_folder(out)
    watch = TurbineWatch(rim, options)
    if (out / STATE_FILE).exists():
        watch = read_state(out / STATE_FILE, rim, options, key)
    writer = _Writer(out, str(source), document["campaign"], digest, key, watch)
    stages = Stages(1, quiet)
    with single_threaded(), stages.stage(f"watching {source}"):
        if rim.unknown:
            stages.tell(f"not determined by the diagnosis, taken as zero: {', '.join(rim.unknown)}")
        if watch.n_revolutions:
            stages.tell(f"goes on after {watch.n_revolutions} revolutions, {watch.position:g} s")
        samples = _samples(source, expected, watch, None if once else every)
        for alarm in _alarms(watch, samples, writer, stages):
            stages.tell(writer.line(alarm))
    return writer.write(page=True)


def _refuse(
    source: Path,
    out: Path,
    learn: int,
    least: float,
    false_alarms: float,
    drift: float,
    every: float,
) -> None:
    """Refuse options before any work."""
    from carrierflex.diagnosis.carrier.watch.change_test import LEAST_LEARNED

    if learn < LEAST_LEARNED:
        raise ValueError(
            f"--learn is {learn}; expected at least {LEAST_LEARNED} revolutions, from which the "
            "noise can be bounded"
        )
    for name, value, most in (
        ("--least", least, np.inf),
        ("--false-alarms", false_alarms, 1.0),
        ("--every", every, np.inf),
    ):
        if not 0.0 < value < most:
            expected = "a number above 0" + ("" if most == np.inf else f" and below {most:g}")
            raise ValueError(f"{name} is {value:g}; expected {expected}")
    if not 0.0 <= drift < np.inf:
        raise ValueError(f"--drift is {drift:g}; expected 0 or more noise floors an hour")
    if str(source) != "-" and not source.is_dir():
        raise ValueError(
            f"{source}: no such folder; expected a folder with Parquet or CSV files, or - for CSV "
            "rows from standard input"
        )
    refuse_foreign(out / WATCH_FILE, f'"{FORMAT}"')
    refuse_foreign(out / PAGE_FILE, "<title>Watch: ", "carrierflex")


def _diagnosed(
    baseline: Path, campaign: Path | None
) -> tuple[RimBaseline, ExpectedColumns, dict[str, Any], str]:
    """Baseline with its values, columns of the source, diagnosis.json and its digest."""
    from carrierflex.diagnosis.carrier.watch.rim_revolutions import rim_baseline
    from carrierflex.diagnosis.report.diagnosis_files import DIAGNOSIS_FILE, read_diagnosis
    from carrierflex.workflows.diagnosis import report_files
    from carrierflex.workflows.diagnosis.diagnose_campaign import curves_of_rig

    path = baseline / DIAGNOSIS_FILE if baseline.is_dir() else baseline
    document = read_diagnosis(path)
    if campaign is None:
        report = read_document(
            path.with_name(report_files.REPORT_DATA_FILE),
            f"{report_files.REPORT_DATA_FILE} of a diagnosis, or the campaign by --campaign",
            report_files.FORMAT,
            report_files.VERSION,
        )
        campaign = Path(report["data"]["source"]["folder"])
        if not (campaign / DOCUMENT_NAME).is_file():
            raise ValueError(
                f"{campaign}: the campaign that {path} is of is not there; expected its folder by "
                "--campaign"
            )
    header = read_campaign_header(campaign)
    stated = (document.get("records") or {}).get("files", {}).get(DOCUMENT_NAME)
    present = file_digest(campaign / DOCUMENT_NAME)
    if stated is not None and stated != present:
        raise ValueError(
            f"{campaign / DOCUMENT_NAME}: has changed since {path} was written; expected the "
            "diagnosed campaign: diagnose it again"
        )
    try:
        rim = rim_baseline(header, curves_of_rig(header.rig, campaign), document)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    kinds = expected_columns(header.contract, header.channels, header.baseline)
    digest = file_digest(path)
    return rim, ExpectedColumns(kinds, others_allowed=True), document, digest


def _samples(
    source: Path, expected: ExpectedColumns, watch: TurbineWatch, follow: float | None
) -> Iterator[Piece]:
    """Samples of the source from where the watch is."""
    if str(source) == "-":
        return _checked(_rows(sys.stdin.buffer, expected), watch.position, "")
    return _folder_samples(source, expected, watch.file, watch.position, follow=follow)


def _alarms(
    watch: TurbineWatch, samples: Iterator[Piece], writer: _Writer, stages: Stages
) -> Iterator[Alarm]:
    """Alarms, each once its state is written."""
    from carrierflex.diagnosis.carrier.watch.rim_revolutions import RevolutionSplitter

    splitter = RevolutionSplitter()
    for file, columns in samples:
        for turn in splitter.turns(columns, file):
            alarm = watch.take(*turn)
            if alarm is not None:
                writer.write(page=True)
                yield alarm
        writer.write_in_time()
        stages.note(f"{watch.n_revolutions} revolutions, {len(watch.alarms)} alarms")


@dataclass
class _Writer:
    """Writes state, document and page; the state first, from which the others follow."""

    out: Path
    source: str
    turbine: str
    digest: str
    key: str
    watch: TurbineWatch
    state_written: float = -np.inf
    page_written: float = -np.inf

    def line(self, alarm: Alarm) -> str:
        """One line about an alarm."""
        from carrierflex.workflows.fleet.watch_page import alarm_line

        return f"{self.turbine}: {alarm_line(alarm)}"

    def write_in_time(self) -> None:
        """Write what is old."""
        now = time.monotonic()
        if now - self.state_written > _STATE_EVERY:
            self.write(page=now - self.page_written > _PAGE_EVERY)

    def write(self, *, page: bool) -> WatchResult:
        """Write the state and what follows from it."""
        from carrierflex.diagnosis.carrier.watch.state_files import write_state
        from carrierflex.workflows.fleet.watch_page import watch_page

        write_state(self.out / STATE_FILE, self.watch, self.key)
        self.state_written = time.monotonic()
        result = self.result()
        document: WatchDocument = {
            "format": "carrierflex-watch",
            "version": 1,
            "software": software_name(),
            "versions": versions(),
            "baseline": self.digest,
            "options": asdict(self.watch.options),
            "watch": result,
        }
        save_json(self.out / WATCH_FILE, document)
        if page:
            save_text(self.out / PAGE_FILE, watch_page(result, self.watch))
            self.page_written = time.monotonic()
        return result

    def result(self) -> WatchResult:
        """What the watch has seen."""
        watch = self.watch
        is_known = not watch.is_learning
        state: Literal["learning", "watching", "new reference"] = "watching"
        if watch.n_needed:
            state = "new reference" if is_known else "learning"
        deviation = watch.deviations()
        return WatchResult(
            source=self.source,
            turbine=self.turbine,
            state=state,
            revolutions=watch.n_revolutions,
            omitted=watch.n_omitted,
            position=watch.position if np.isfinite(watch.position) else None,
            file=watch.file,
            floor=watch.floor if is_known else None,
            dead_band=watch.dead_band if is_known else None,
            threshold=watch.threshold if is_known else None,
            run_length=float(np.exp(watch.threshold)) if is_known else None,
            deviation=float(deviation[-1]) if deviation.size else None,
            silent=[
                channel.name
                for channel, masked in zip(watch.baseline.channels, watch.masked, strict=True)
                if masked
            ],
            alarms=watch.alarms,
            lines=[self.line(alarm) for alarm in watch.alarms],
        )


def _folder_samples(
    folder: Path, expected: ExpectedColumns, file: str, time_read: float, *, follow: float | None
) -> Iterator[Piece]:
    """Samples of the files of a folder in the order of their names, and of those that come."""
    last = ""
    while True:
        names = sorted(
            path.name
            for path in folder.iterdir()
            if path.suffix.lower() in RUN_SUFFIXES
            and not path.name.startswith((".", "_"))
            and path.name > last
            and path.name >= file
        )
        for name in names:
            path = folder / name
            if follow is not None and name == names[-1] and not _is_complete(path):
                break
            last = name
            if "time" not in run_file_header(path):
                continue
            begin = time_read if name == file else -np.inf
            yield from _checked(column_pieces(path, expected), begin, name)
        if follow is None:
            return
        yield last, {}
        time.sleep(follow)


def _rows(stream: BinaryIO, expected: ExpectedColumns) -> Iterator[Columns]:
    """Rows of a CSV stream in the pieces in which they come."""
    header = stream.readline()
    names = [name.strip().strip('"') for name in header.decode("utf-8", "replace").split(",")]
    columns = expected.columns_to_read(names, _STANDARD_INPUT)
    convert = pa_csv.ConvertOptions(
        column_types=dict.fromkeys(columns, "float64"),
        include_columns=columns,
        null_values=["", "nan", "NaN", "NAN", "NA"],
    )
    read = pa_csv.ReadOptions(column_names=names)
    read1 = getattr(stream, "read1", stream.read)
    begun = b""
    while block := read1(_BLOCK):
        text, newline, begun = (begun + block).rpartition(b"\n")
        if not text.strip():
            continue
        try:
            rows = io.BytesIO(text + newline)
            table = pa_csv.read_csv(rows, read_options=read, convert_options=convert)
        except ValueError as error:
            reason = str(error).splitlines()[0]
            raise ValueError(f"{_STANDARD_INPUT}: {reason}; expected rows of numbers") from error
        yield {
            name: np.array(table[name].to_numpy(zero_copy_only=False), dtype=np.float64)
            for name in columns
        }


def _is_complete(path: Path) -> bool:
    """Whether a Parquet file has its end, which one that is being written has not."""
    if path.suffix.lower() != ".parquet":
        return True
    try:
        with path.open("rb") as opened:
            pa_parquet.ParquetFile(opened)
    except (OSError, ValueError):
        return False
    return True


def _checked(pieces: Iterator[Columns], after: float, file: str) -> Iterator[Piece]:
    """Samples of one file after a time; time increases, inputs are there."""
    where = file or _STANDARD_INPUT
    last = -np.inf
    for piece in pieces:
        times = piece["time"]
        for name in ("time", "carrier_angle", "torque", "ntl_y", "ntl_z"):
            if name in piece and not np.isfinite(piece[name]).all():
                raise ValueError(
                    f"{where}: column '{name}' has a missing value; expected a finite number in "
                    "every row"
                )
        goes_back = np.diff(np.concatenate([[last], times])) <= 0.0
        if goes_back.any():
            raise ValueError(
                f"{where}: column 'time' goes back to {times[int(np.argmax(goes_back))]:g} s; "
                "expected time that increases"
            )
        last = float(times[-1]) if times.size else last
        wanted = times > after
        yield file, {name: values[wanted] for name, values in piece.items()}
