"""From a logger's files and the map of their columns to a campaign folder.

A good answer: few missing samples, each kind counted; a shift of another simulator's clock that is
small beside a sample, or explained by its start.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypedDict

from cyclopts import Parameter

from carrierflex.files.json_files import plain, save_json
from carrierflex.files.versions import Software, software_name
from carrierflex.identification.campaign.campaign_files import write_campaign

if TYPE_CHECKING:
    from carrierflex.identification.logs.clock_shift import ClockShift
    from carrierflex.identification.logs.imported import Imported
    from carrierflex.identification.logs.logged_signals import Count

#: What was read, left out and moved, beside the campaign; and the map itself.
IMPORT_FILE, MAP_COPY = "import.json", "map.toml"


@dataclass(frozen=True, eq=False)
class ImportedRecords:
    """An imported campaign and its folder."""

    imported: Imported
    folder: Path


def main(
    files: list[Path],
    *,
    map_: Annotated[Path, Parameter(name="--map")],
    out: Path,
    simulated: Annotated[list[Path] | None, Parameter(consume_multiple=True)] = None,
) -> ImportedRecords:
    """Make a campaign folder of a logger's files and the map of their columns.

    Parameters
    ----------
    files
        Files named by the runs of the map.
    map_
        Map (TOML) of `carrierflex new-campaign`, after you have checked it.
    out
        Folder to write: a campaign; new or empty.
    simulated
        Another simulator's predictions, one file for each run in the map's order: the baseline
        instead of this program's model. Its clock is aligned with that of the measurement.

    Returns
    -------
    ImportedRecords
        The campaign with counts of missing samples and shifts of clocks.

    Raises
    ------
    ValueError
        Where the map or a file is refused, everything at once; nothing is written.
    OSError
        Where `out` cannot be written.
    """
    from carrierflex.identification.logs.map_tables import read_map

    document = read_map(map_)

    from carrierflex.identification.logs.imported import imported_campaign

    imported = imported_campaign(document, files, simulated or ())
    more = {
        IMPORT_FILE: lambda path: save_json(path, _record(imported)),
        MAP_COPY: lambda path: _copy(map_, path),
    }
    curves = imported.campaign.rig.get("deflection_curves")
    if curves is not None:
        source = map_.parent / curves
        if not source.is_file():
            raise ValueError(f"{map_}: no file '{curves}' of deflection_curves in its folder")
        more[curves] = lambda path: _copy(source, path)
    write_campaign(imported.campaign, out, more_files=more)
    return ImportedRecords(imported, out)


def _record(imported: Imported) -> dict[str, object]:
    return {
        "format": "carrierflex-import",
        "version": 1,
        "software": software_name(),
        "sha256": dict(imported.sha256),
        "missing": plain(imported.counts),
        "clock_shift": plain(dict(imported.shifts)),
        "notes": list(imported.notes),
    }


def _copy(source: Path, path: Path) -> None:
    path.write_bytes(source.read_bytes())


class ImportDocument(TypedDict):
    """import.json, written by import."""

    format: Annotated[Literal["carrierflex-import"], "Kind of the file"]
    version: Annotated[Literal[1], "Version of the format"]
    software: Software
    sha256: Annotated[Mapping[str, str], "Digest of every file"]
    missing: Annotated[Sequence[Count], "Missing samples by run, column and reason"]
    clock_shift: Annotated[Mapping[str, ClockShift], "By run, of another simulator's prediction"]
    notes: Annotated[Sequence[str], "What was found on the way"]
