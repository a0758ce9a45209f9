"""Reading and writing of campaign folders: campaign.toml with one CSV or Parquet file a run."""

import os
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pa_parquet
import tomli_w

from carrierflex.files.toml_files import toml_document
from carrierflex.files.whole_files import errors_naming
from carrierflex.files.whole_folders import check_writable, taken_up, whole_folder
from carrierflex.identification.campaign.campaign import Campaign, check_columns, expected_columns
from carrierflex.identification.campaign.campaign_document import (
    CAMPAIGN_FILE,
    CampaignHeader,
    RunEntry,
    campaign_document,
    campaign_header,
)
from carrierflex.identification.campaign.file_names import DOCUMENT_NAME, checked_file_name
from carrierflex.identification.campaign.records import PREDICTION_SUFFIX, Run
from carrierflex.identification.campaign.simulated_mark import simulated_mark

#: Sanity limits, checked before anything is allocated.
LARGEST_HEADER = 100_000  # bytes of the header line of a CSV file
LARGEST_CSV = 8 * 1024**3  # bytes of a CSV file
LARGEST_TABLE = 1_000_000_000  # cells of a Parquet file: 8 GB of numbers

#: Copy of the simulation case that a campaign was made from; it may stand beside the campaign's own
#: files.
CASE_COPY = "case.toml"

#: How a missing sample may be written.
MISSING = ["", "nan", "NaN", "NAN", "NA"]


def read_campaign(folder: Path) -> Campaign:
    """Read a campaign folder.

    Parameters
    ----------
    folder : Path
        Folder with campaign.toml and the run files it names.

    Returns
    -------
    Campaign
        Everything in it, checked against the contract.

    Raises
    ------
    ValueError
        Where a file is missing or anything in it is not as the contract says; one line that names
        the file, the key or column, what was found and what is expected.
    """
    header = read_campaign_header(folder)
    expected = expected_columns(header.contract, header.channels, header.baseline)
    runs = tuple(_read_run(folder, entry, header, expected) for entry in header.runs)
    return Campaign(
        kind=header.contract.name,
        name=header.name,
        baseline=header.baseline,
        rig=header.rig,
        channels=header.channels,
        runs=runs,
        input_units=header.input_units,
    )


def read_campaign_header(folder: Path) -> CampaignHeader:
    """Read campaign.toml alone.

    Raises
    ------
    ValueError
        Where the file is missing, too large, not TOML, or not as the contract says.
    """
    path = folder / DOCUMENT_NAME
    if not path.is_file():
        raise ValueError(f"{folder}: no file {DOCUMENT_NAME}; expected a campaign folder")
    return campaign_header(toml_document(path, CAMPAIGN_FILE), str(path))


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
            mark = simulated_mark(partial, [run.file for run in campaign.runs])
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
    foreign = sorted(path.name for path in folder.iterdir() if path.name not in campaign_names)
    if foreign:
        raise ValueError(
            f"{folder}: holds '{foreign[0]}' beside the campaign; expected a new or empty folder"
        )
    _refuse_measurement(folder, header)


def _refuse_measurement(folder: Path, header: CampaignHeader) -> None:
    """Refuse records that this program did not simulate: they may be the only ones."""
    if header.simulated is None:
        raise ValueError(
            f"{folder / DOCUMENT_NAME}: no table [simulated], so these are measured records, which "
            "are never replaced; expected a new or empty folder"
        )
    other = header.simulated.first_other(folder, [run.file for run in header.runs])
    if other is not None:
        raise ValueError(
            f"{folder / other}: not as [simulated] in {DOCUMENT_NAME} says that it was written; "
            "changed records are never replaced; expected a new or empty folder"
        )


def _read_run(
    folder: Path, entry: RunEntry, header: CampaignHeader, expected: Mapping[str, str]
) -> Run:
    path = folder / entry.file
    if not path.is_file():
        raise ValueError(
            f"{DOCUMENT_NAME}: run {entry.name}: file '{entry.file}' is not in the folder {folder}"
        )
    table = (
        _read_parquet(path, expected)
        if path.suffix.lower() == ".parquet"
        else _read_csv(path, expected)
    )
    columns = {
        name: as_floats(table[name], f"{path.name}: column '{name}'") for name in table.column_names
    }
    return run_of_table(columns, entry, header, path.name)


def run_of_table(
    columns: Mapping[str, np.ndarray], entry: RunEntry, header: CampaignHeader, file: str
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
        )
    except ValueError as error:
        raise ValueError(f"{file}: {error}") from error


def _read_csv(path: Path, expected: Mapping[str, str]) -> pa.Table:
    if path.stat().st_size > LARGEST_CSV:
        raise ValueError(
            f"{path.name}: {path.stat().st_size} bytes; expected at most {LARGEST_CSV}"
        )
    columns = csv_header(path, expected)
    convert = pa_csv.ConvertOptions(
        column_types=dict.fromkeys(columns, pa.float64()),
        null_values=MISSING,
        quoted_strings_can_be_null=True,
    )
    read = pa_csv.ReadOptions(column_names=columns, skip_rows=1)
    try:
        return pa_csv.read_csv(path, read_options=read, convert_options=convert)
    except pa.ArrowInvalid as error:
        if "Empty CSV" in str(error):
            raise ValueError(
                f"{path.name}: no samples below the header; expected at least one"
            ) from error
        raise ValueError(
            f"{path.name}: {one_line(error)}; expected numbers in every column"
        ) from error


def csv_header(path: Path, expected: Mapping[str, str]) -> list[str]:
    """Column names of a CSV run file, checked against the campaign.

    Raises
    ------
    ValueError
        Where the header line is too long, not text, or does not match.
    """
    with path.open("rb") as file:
        line = file.readline(LARGEST_HEADER + 1)
    if len(line) > LARGEST_HEADER:
        raise ValueError(
            f"{path.name}: the header line exceeds {LARGEST_HEADER} bytes; expected column names"
        )
    try:
        text = line.decode("utf-8-sig").strip("\r\n")
    except UnicodeDecodeError as error:
        raise ValueError(
            f"{path.name}: the header line is not UTF-8 text; expected column names"
        ) from error
    columns = [name.strip('"') for name in text.split(",")]
    check_columns(columns, expected, path.name)
    return columns


def _read_parquet(path: Path, expected: Mapping[str, str]) -> pa.Table:
    try:
        file = pa_parquet.ParquetFile(path)
        check_columns(file.schema_arrow.names, expected, path.name)
        cells = file.metadata.num_rows * file.metadata.num_columns
        if cells > LARGEST_TABLE:
            raise ValueError(f"{path.name}: {cells} cells; expected at most {LARGEST_TABLE}")
        return file.read()
    except (pa.ArrowInvalid, OSError) as error:
        raise ValueError(f"{path.name}: not a Parquet file: {one_line(error)}") from error


def as_floats(column: pa.ChunkedArray, where: str) -> np.ndarray:
    """Numbers of a column, missing ones NaN, in an array of their own.

    Raises
    ------
    ValueError
        Where the column holds something else.
    """
    if not (pa.types.is_floating(column.type) or pa.types.is_integer(column.type)):
        raise ValueError(f"{where}: holds {column.type}; expected numbers")
    values = column.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False)
    return np.array(values, dtype=np.float64)


def _write_run(run: Run, path: Path) -> None:
    columns = {"time": run.time, **run.columns()}
    table = pa.table({name: pa.array(values, from_pandas=True) for name, values in columns.items()})
    if path.suffix.lower() == ".parquet":
        pa_parquet.write_table(table, path)
    else:
        with path.open("wb") as file:
            # Arrow would quote the column names.
            file.write((",".join(columns) + "\n").encode())
            pa_csv.write_csv(table, file, pa_csv.WriteOptions(include_header=False))


def one_line(error: Exception) -> str:
    """First line of an exception's message."""
    return str(error).splitlines()[0].rstrip(".") if str(error) else type(error).__name__
