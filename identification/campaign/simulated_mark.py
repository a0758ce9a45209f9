"""What tells a simulated campaign from a measured one: SHA-256 of every run file, as written."""

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from carrierflex.files.versions import software_name


@dataclass(frozen=True)
class SimulatedMark:
    """Table ``[simulated]`` of campaign.toml, written by this program's simulators only.

    Parameters
    ----------
    software : str
        Name and version of the program.
    sha256 : mapping of str to str
        Hexadecimal digest of each run file, by file name.
    """

    software: str
    sha256: Mapping[str, str]

    def table(self) -> dict[str, object]:
        """The table, ready for a TOML writer."""
        return {"software": self.software, "sha256": dict(self.sha256)}

    def first_other(self, folder: Path, files: Iterable[str]) -> str | None:
        """Name of the first run file that is not the one that was written; None where all are."""
        files = list(files)
        for name in sorted({*files, *self.sha256}):
            path = folder / name
            if name not in files or name not in self.sha256 or not path.is_file():
                return name
            if _digest(path) != self.sha256[name]:
                return name
        return None


def simulated_mark(folder: Path, files: Iterable[str]) -> SimulatedMark:
    """Mark of the run files that stand in a folder."""
    return SimulatedMark(software_name(), {name: _digest(folder / name) for name in files})


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
