"""What tells a simulated campaign from a measured one: SHA-256 of every run file, as written."""

import hashlib
from collections.abc import Iterable
from pathlib import Path

from carrierflex.files.versions import software_name
from carrierflex.identification.campaign.declarations import SimulatedMark


def simulated_mark(folder: Path, files: Iterable[str]) -> SimulatedMark:
    """Mark of the run files that stand in a folder."""
    return SimulatedMark(software_name(), {name: _digest(folder / name) for name in files})


def first_other_file(mark: SimulatedMark, folder: Path, files: Iterable[str]) -> str | None:
    """Name of the first run file that is not the one that was written; None where all are."""
    files = list(files)
    for name in sorted({*files, *mark.sha256}):
        path = folder / name
        if name not in files or name not in mark.sha256 or not path.is_file():
            return name
        if _digest(path) != mark.sha256[name]:
            return name
    return None


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
