"""Reading of campaign.toml alone, and of the header lines of the run files it names.

Arrays and the library of tables are not needed for it: a campaign whose document is wrong is
refused before its records are opened.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from carrierflex.files.plain_files import check_plain_file
from carrierflex.files.problems import ProblemsError, problems_of, refuse
from carrierflex.files.toml_files import toml_document
from carrierflex.identification.campaign.campaign_header import (
    CAMPAIGN_FILE,
    CampaignHeader,
    campaign_header,
)
from carrierflex.identification.campaign.file_names import (
    DOCUMENT_NAME,
    RUN_SUFFIXES,
    checked_file_name,
)
from carrierflex.simulation.element.drives import BASE

#: Sanity limits, checked before anything is allocated.
LARGEST_HEADER = 100_000  # bytes of the header line of a CSV file
LARGEST_FILE = 8 * 1024**3  # bytes of a run file


def read_campaign_header(folder: Path) -> CampaignHeader:
    """Read campaign.toml alone.

    Raises
    ------
    ValueError
        Where the file is missing, too large, not TOML, or not as the contract says; with it, which
        of the run files that it names are missing.
    """
    path = folder / DOCUMENT_NAME
    if not path.is_file():
        raise ValueError(f"{folder}: no file {DOCUMENT_NAME}; expected a campaign folder")
    document = toml_document(path, CAMPAIGN_FILE)
    try:
        return campaign_header(document, str(path), _first_columns(document, folder))
    except ValueError as error:
        missing = tuple(_missing_files(document, folder))
        if missing:
            about = f"{path}: " if isinstance(error, ProblemsError) else ""
            refuse((*(about + problem for problem in problems_of(error)), *missing))
        raise


def _first_columns(document: Mapping[str, Any], folder: Path) -> list[str]:
    """Columns of the first run file of an element on a moving base; none elsewhere."""
    rig = document.get("rig")
    if not isinstance(rig, dict) or rig.get("drive") != BASE:
        return []
    try:
        return run_file_header(folder / checked_file_name(document["runs"][0]["file"], "'file'"))
    except (ValueError, OSError, KeyError, IndexError, TypeError, AttributeError):
        return []


def _missing_files(document: Mapping[str, Any], folder: Path) -> Iterator[str]:
    """One text for every run file that a document names and the folder has not."""
    entries = document.get("runs")
    for entry in entries if isinstance(entries, list) else []:
        file = entry.get("file") if isinstance(entry, dict) else None
        if not isinstance(file, str) or not file.lower().endswith(RUN_SUFFIXES):
            continue
        try:
            path = folder / checked_file_name(file, "key 'file'")
        except ValueError:
            # Told with the document.
            continue
        if not path.is_file():
            yield (
                f"{DOCUMENT_NAME}: run {entry.get('name')}: file '{file}' is not in the folder "
                f"{folder}"
            )


def run_file_header(path: Path) -> list[str]:
    """Column names of a run file.

    Raises
    ------
    ValueError
        Where the file is not what its name says, or the header line is too long or a name in it
        is not text.
    """
    is_parquet = path.suffix.lower() == ".parquet"
    check_plain_file(path, "a run file", LARGEST_FILE, text=not is_parquet)
    if is_parquet:
        return _parquet_header(path)
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
    return [name.strip('"') for name in text.split(",")]


def _parquet_header(path: Path) -> list[str]:
    # Late: the library of tables takes longer to load than all else of a document.
    import pyarrow as pa
    import pyarrow.parquet as pa_parquet

    try:
        with path.open("rb") as file:
            return list(pa_parquet.read_schema(file).names)
    except UnicodeDecodeError as error:
        raise ValueError(
            f"{path.name}: a column's name is not UTF-8 text; expected column names"
        ) from error
    except (pa.ArrowInvalid, OSError) as error:
        line = str(error).splitlines()[0].rstrip(".") if str(error) else type(error).__name__
        raise ValueError(f"{path.name}: not a Parquet file: {line}") from error
