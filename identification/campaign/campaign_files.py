"""Reading and writing of campaign folders: campaign.toml with one CSV or Parquet file a run."""

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pa_parquet
import tomli_w

from carrierflex.files.problems import Problems, problems_of, refuse, repeated_names
from carrierflex.files.temporary_store import TemporaryStore
from carrierflex.files.versions import software_name
from carrierflex.files.whole_files import errors_naming, file_digest
from carrierflex.files.whole_folders import check_writable, taken_up, whole_folder
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_header import (
    CAMPAIGN_FILE,
    CampaignHeader,
    RunEntry,
    campaign_header,
)
from carrierflex.identification.campaign.campaign_kinds import BENDING
from carrierflex.identification.campaign.declarations import (
    PREDICTION_SUFFIX,
    Baseline,
    Channel,
    InputSignal,
    SimulatedMark,
    expected_columns,
)
from carrierflex.identification.campaign.document_files import read_campaign_header
from carrierflex.identification.campaign.file_names import DOCUMENT_NAME, checked_file_name
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.run_files import (
    ExpectedColumns,
    left_out_columns,
    run_columns,
)

#: Copy of the simulation case that a campaign was made from; it may stand beside the campaign's own
#: files.
CASE_COPY = "case.toml"
#: Copies of the law files that a case was simulated with, by number.
LAW_COPY = "law_{}.toml"
#: Bytes of all records up to which they are kept in memory.
_IN_MEMORY = 200_000_000


def read_campaign(folder: Path, *, bending: bool = False) -> Campaign:
    """Read a campaign folder.

    Parameters
    ----------
    folder : Path
        Folder with campaign.toml and the run files it names.
    bending : bool
        Of kind mounting: read the bending moments of the main shaft; the motion sensors of the
        housing where it is false.

    Returns
    -------
    Campaign
        What was asked for of it, checked against the contract.

    Raises
    ------
    ValueError
        Where a file is missing or anything in it is not as the contract says; one line that names
        the file, the key or column, what was found and what is expected, for everything that is
        wrong at once: of campaign.toml and the files it names, and of the records where it is
        sound.
    """
    header = read_campaign_header(folder)
    expected = columns_of(header)
    header = _of_quantity(header, bending=bending)
    problems = Problems()
    curves = header.rig.get("deflection_curves")
    if curves is not None and not (folder / curves).is_file():
        problems.messages.append(
            f"{DOCUMENT_NAME}: [rig]: file '{curves}' of key 'deflection_curves' is not in the "
            f"folder {folder}"
        )
    records = KeptRuns(len(header.runs))
    for entry in header.runs:
        with problems.at():
            records.add(_read_run(folder, entry, header, expected))
    refuse(problems.messages)
    return header.with_records(records.runs, _left_out(folder, header, expected))


def _of_quantity(header: CampaignHeader, *, bending: bool) -> CampaignHeader:
    """Header with the channels that are asked for; another kind has no bending moments."""
    channels = tuple(
        channel for channel in header.channels if (channel.quantity == BENDING) == bending
    )
    if not channels:
        wanted = BENDING if bending else "housing_displacement"
        raise ValueError(
            f"{DOCUMENT_NAME}: no channel of quantity {wanted}, which this needs; found "
            f"{', '.join(sorted({channel.quantity for channel in header.channels}))}"
        )
    return replace(header, channels=channels)


def write_campaign(
    campaign: Campaign,
    folder: Path,
    *,
    simulated: bool = False,
    more_files: Mapping[str, Callable[[Path], None]] | None = None,
    written_files: Mapping[str, Path] | None = None,
) -> None:
    """Write a campaign folder; it appears complete or not at all.

    Parameters
    ----------
    campaign : Campaign
        What to write.
    folder : Path
        New, empty, or an earlier simulated campaign, which is replaced.
    simulated : bool
        Mark the folder as simulated (``[simulated]``): only then may a later one replace it.
    more_files : mapping of str to callable, optional
        Functions that write further files of the folder (deflection curves), by file name.
    written_files : mapping of str to Path, optional
        Run files written before, by file name
        (:mod:`carrierflex.identification.campaign.growing_runs`): moved into the folder, in place
        of what the campaign's runs hold.

    Raises
    ------
    ValueError
        Where the folder holds a measurement or something that is no campaign.
    OSError
        Where a file cannot be written; the message names it.
    """
    document = campaign_document(campaign)
    campaign_header(document)  # what is written must be readable again
    prepare_campaign_folder(folder)
    names = [*(more_files or {}), *(run.file for run in campaign.runs)]
    refuse(repeated_names(names, f"{folder}: file"))
    with whole_folder(folder) as partial:
        for name, write in (more_files or {}).items():
            path = partial / checked_file_name(name, "file")
            with errors_naming(folder / name, path):
                write(path)
        for run in campaign.runs:
            path = partial / checked_file_name(run.file, f"run {run.name}: file")
            if written_files and run.file in written_files:
                os.replace(written_files[run.file], path)
            else:
                with errors_naming(folder / run.file, path):
                    _write_run(run, path)
        if simulated:
            mark = _simulated_mark(partial, [run.file for run in campaign.runs])
            document |= {"version": CAMPAIGN_FILE.version, "simulated": mark.table()}
        path = partial / DOCUMENT_NAME
        with errors_naming(folder / DOCUMENT_NAME, path):
            path.write_bytes(tomli_w.dumps(document).encode())


def prepare_campaign_folder(folder: Path) -> None:
    """Make sure that a campaign can be written to `folder`, before the work.

    What a killed run left there is finished or removed. Only an empty folder or one that this
    program simulated may be replaced.

    Raises
    ------
    ValueError
        Where it is a file or a link, holds a measurement or something else; the message names it.
    OSError
        Where the folder cannot be written.
    """
    if folder.is_file() or folder.is_symlink():
        raise ValueError(f"{folder}: a file or a link; expected a new folder for the campaign")
    check_writable(folder.parent)
    taken_up(folder)
    if not folder.exists() or not any(folder.iterdir()):
        return
    try:
        header = read_campaign_header(folder)
    except ValueError as error:
        raise ValueError(
            f"{folder}: holds something that is not a campaign; expected a new or empty folder"
        ) from error
    campaign_names = {
        DOCUMENT_NAME,
        CASE_COPY,
        header.rig.get("deflection_curves"),
        *(run.file for run in header.runs),
    }
    foreign = sorted(
        path.name
        for path in folder.iterdir()
        if path.name not in campaign_names
        and not fnmatch(path.name, LAW_COPY.format("*"))
        and not _is_view(path)
    )
    if foreign:
        raise ValueError(
            f"{folder}: holds '{foreign[0]}', which is no file of the campaign; expected a new or "
            "empty folder"
        )
    _refuse_measurement(folder, header)


def _is_view(path: Path) -> bool:
    """Whether a file is the page that the view of this campaign wrote into its folder."""
    return path.name == "view.html" and path.is_file() and b"k3d" in path.read_bytes()


def _refuse_measurement(folder: Path, header: CampaignHeader) -> None:
    """Refuse records that this program did not simulate: they may be the only ones."""
    if header.simulated is None:
        raise ValueError(
            f"{folder / DOCUMENT_NAME}: no table [simulated]: the records are measured and are "
            "not replaced; expected a new or empty folder"
        )
    other = _first_other_file(header.simulated, folder, [run.file for run in header.runs])
    if other is not None:
        raise ValueError(
            f"{folder / other}: not as [simulated] in {DOCUMENT_NAME} says that it was written; "
            "changed records are never replaced; expected a new or empty folder"
        )


def columns_of(header: CampaignHeader) -> ExpectedColumns:
    """Columns that the run files of a campaign must have."""
    kinds = expected_columns(header.contract, header.channels, header.baseline)
    return ExpectedColumns(kinds, others_allowed=header.version >= 2)


def _read_run(
    folder: Path, entry: RunEntry, header: CampaignHeader, expected: ExpectedColumns
) -> Run:
    path = folder / entry.file
    if not path.is_file():
        problem = "is no regular file in" if os.path.lexists(path) else "is not in"
        raise ValueError(
            f"{DOCUMENT_NAME}: run {entry.name}: file '{entry.file}' {problem} the folder {folder}"
        )
    run = run_of_columns(run_columns(path, expected), entry, header)
    if not run.in_use.any():
        raise ValueError(
            f"{DOCUMENT_NAME}: run {run.name}: no sample of {entry.file} lies in a window of "
            f"'use'; its time runs from {run.time[0]:g} to {run.time[-1]:g} s"
        )
    return run


def run_of_columns(
    columns: Mapping[str, np.ndarray], entry: RunEntry, header: CampaignHeader
) -> Run:
    """Run from the columns of its file, or of a piece of it.

    Raises
    ------
    ValueError
        Where the record is not as the contract says; the message names the file.
    """
    names = [channel.name for channel in header.channels]
    try:
        return Run(
            name=entry.name,
            file=entry.file,
            condition=entry.condition,
            time=columns["time"],
            inputs={name: columns[name] for name in header.contract.inputs},
            signals={name: columns[name] for name in names},
            predictions={
                name: columns[name + PREDICTION_SUFFIX]
                for name in names
                if name + PREDICTION_SUFFIX in columns
            },
            use=entry.use,
        )
    except ValueError as error:
        refuse(f"{entry.file}: {problem}" for problem in problems_of(error))
        raise


def _left_out(folder: Path, header: CampaignHeader, expected: ExpectedColumns) -> Iterator[str]:
    """One note for every run file with columns that are neither input nor channel."""
    for entry in header.runs:
        names = left_out_columns(folder / entry.file, expected)
        if names:
            listed = ", ".join(f"'{name}'" for name in names)
            yield f"{entry.file}: left out, neither an input nor a channel: {listed}"


def _write_run(run: Run, path: Path) -> None:
    columns = {"time": run.time, **run.columns()}
    table = pa.table({name: pa.array(values, from_pandas=True) for name, values in columns.items()})
    if path.suffix.lower() == ".parquet":
        with path.open("wb") as file:
            pa_parquet.write_table(table, file)
    else:
        with path.open("wb") as file:
            # Arrow would quote the column names.
            file.write((",".join(columns) + "\n").encode())
            pa_csv.write_csv(table, file, pa_csv.WriteOptions(include_header=False))


def _simulated_mark(folder: Path, files: Iterable[str]) -> SimulatedMark:
    """Mark of the run files that stand in a folder."""
    return SimulatedMark(software_name(), {name: file_digest(folder / name) for name in files})


def _first_other_file(mark: SimulatedMark, folder: Path, files: Iterable[str]) -> str | None:
    """Name of the first run file that is not the one that was written; None where all are."""
    files = list(files)
    for name in sorted({*files, *mark.sha256}):
        path = folder / name
        if name not in files or name not in mark.sha256 or not path.is_file():
            return name
        if file_digest(path) != mark.sha256[name]:
            return name
    return None


class KeptRuns:
    """Runs that are added one by one.

    As long as they are few they stay in memory. Where all of them, as large as the first, or those
    that were added take more, the signals are in a file of the temporary folder and are read where
    they are asked for, unless that is full.
    """

    def __init__(self, expected: int = 1, in_memory: int = _IN_MEMORY) -> None:
        self._expected = expected
        self._in_memory = in_memory
        self._runs: list[Run] = []
        self._n_bytes = 0
        self._store: TemporaryStore | None = None

    @property
    def runs(self) -> tuple[Run, ...]:
        """All runs, in the order in which they were added."""
        return tuple(self._runs)

    def add(self, run: Run) -> None:
        """Add a run.

        Raises
        ------
        OSError
            Where the temporary folder is full.
        """
        size = sum(values.nbytes for values in (run.time, *run.columns().values()))
        self._n_bytes += size
        foreseen = max(self._n_bytes, size * self._expected if not self._runs else 0)
        if self._store is None and foreseen > self._in_memory and TemporaryStore.has_room(foreseen):
            self._store = TemporaryStore()
            self._runs = [earlier.on_disk(self._store) for earlier in self._runs]
        self._runs.append(run.on_disk(self._store) if self._store else run)


def campaign_document(campaign: Campaign) -> dict[str, Any]:
    """Content of the campaign.toml of a campaign, ready for a TOML writer.

    The version is the first that knows all its keys.
    """
    document: dict[str, Any] = {
        "format": CAMPAIGN_FILE.format,
        "version": 1,
        "kind": campaign.kind,
        "name": campaign.name,
        "baseline": _baseline_table(campaign.baseline),
        "rig": dict(campaign.rig),
        "channels": [_channel_table(channel) for channel in campaign.channels],
        "runs": [_run_table(run) for run in campaign.runs],
    }
    if campaign.turbine:
        document["turbine"] = campaign.turbine
    if campaign.recorded is not None:
        document["recorded"] = campaign.recorded
    if campaign.inputs:
        document["inputs"] = [_signal_table(signal) for signal in campaign.inputs]
    return {**document, "version": _version(document)}


def _version(document: Mapping[str, Any]) -> int:
    """First version of the contract that knows all keys of a document."""
    from carrierflex.files.toml_refusals import newer_keys_in
    from carrierflex.identification.campaign.campaign_tables import DOCUMENT_OF_KIND

    table = DOCUMENT_OF_KIND[document["kind"]]
    return CAMPAIGN_FILE.version if newer_keys_in(document, table, 1) else 1


def _baseline_table(baseline: Baseline) -> dict[str, Any]:
    table: dict[str, Any] = {"source": baseline.source, "effects": list(baseline.effects)}
    if baseline.case:
        table["case"] = baseline.case
    for key, values in (("fixed", baseline.fixed), ("clock_shift", baseline.clock_shift)):
        if values:
            table[key] = {
                name: {"value": known.value, "std": known.std} for name, known in values.items()
            }
    if baseline.impossible:
        table["impossible"] = list(baseline.impossible)
    return table


def _run_table(run: Run) -> dict[str, Any]:
    table: dict[str, Any] = {"name": run.name, "file": run.file, "condition": run.condition}
    if run.use:
        table["use"] = [list(window) for window in run.use]
    return table


def _channel_table(channel: Channel) -> dict[str, Any]:
    facts = {
        "angle_deg": _degrees(channel.angle),
        "radius_m": channel.radius,
        "radius_std_m": channel.radius_std,
        "sensor": channel.sensor,
        "motion": channel.motion,
        "axis": channel.axis,
        "section_m": channel.section,
    }
    table = {"quantity": channel.quantity, **_signal_table(channel)}
    return {**table, **{key: value for key, value in facts.items() if value is not None}}


def _signal_table(signal: Channel | InputSignal) -> dict[str, Any]:
    """Name, unit and declared errors."""
    errors = {
        "noise_std": signal.noise_std,
        "gain_std": signal.gain_std,
        "zero_std": signal.zero_std,
        "delay_std": signal.delay_std,
        "angle_std_deg": _degrees(signal.angle_std),
    }
    table: dict[str, Any] = {"name": signal.name, "unit": signal.unit}
    return {**table, **{key: value for key, value in errors.items() if value is not None}}


def _degrees(angle: float | None) -> float | None:
    # Twelve decimals of a degree hide the rounding of the way there and back.
    return None if angle is None else round(float(np.rad2deg(angle)), 12)
