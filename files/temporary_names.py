"""Names of unfinished files and folders, and removal of those that killed processes left.

A name tells which process is at work: ``.part-MACHINE-PID-START-COUNT-NAME``. What no running
process owns was left by one that was killed, and the next run that writes `NAME` removes it.
"""

import hashlib
import itertools
import os
import re
import shutil
import socket
import time
from collections.abc import Iterator
from functools import cache
from pathlib import Path

#: Beginning of the names of what is being written, and of what is about to be replaced.
UNFINISHED, OLD = ".part", ".old"
#: Processes of another machine or container cannot be asked; what they write is left alone until
#: it is this old [s].
_OLDEST_FOREIGN = 86_400.0
#: Characters of the final name that are kept: together with the rest below the 255 bytes of a name.
_N_NAME_CHARACTERS = 50
_PATTERN = re.compile(r"(\.part|\.old)-([0-9a-f]{8})-(\d+)-(\d+)-\d+-(.*)", re.DOTALL)
_count = itertools.count()


def unfinished_name(name: str, mark: str = UNFINISHED) -> str:
    """Name for something of this process that is to become `name`; of the same suffix."""
    process = os.getpid()
    owner = f"{_machine()}-{process}-{_start(process)}"
    return f"{mark}-{owner}-{next(_count)}-{name[-_N_NAME_CHARACTERS:]}"


def abandoned(folder: Path, name: str | None = None, mark: str = UNFINISHED) -> Iterator[Path]:
    """What killed processes left in a folder.

    Parameters
    ----------
    folder : Path
        Where to look; need not exist.
    name : str, optional
        Only what was to become this; anything without.
    mark : str
        `UNFINISHED` or `OLD`.

    Yields
    ------
    Path
        Unfinished file or folder whose process no longer runs.
    """
    try:
        entries = sorted(entry.name for entry in os.scandir(folder) if entry.name[:1] == ".")
    except OSError:
        return
    for entry in entries:
        match = _PATTERN.fullmatch(entry)
        if (
            match is None
            or match[1] != mark
            or (name is not None and match[5] != name[-_N_NAME_CHARACTERS:])
        ):
            continue
        if _is_over(folder / entry, match[2], int(match[3]), int(match[4])):
            yield folder / entry


def remove_abandoned(folder: Path, name: str | None = None, mark: str = UNFINISHED) -> None:
    """Remove what :func:`abandoned` finds; what cannot be removed stays."""
    for path in abandoned(folder, name, mark):
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
            continue
        try:
            path.unlink(missing_ok=True)
        except OSError:
            continue


def _is_over(path: Path, machine: str, process: int, start: int) -> bool:
    """Whether the process that wrote `path` no longer runs."""
    if machine != _machine():
        try:
            return time.time() - path.lstat().st_mtime > _OLDEST_FOREIGN
        except OSError:
            return False
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return True
    except (PermissionError, OverflowError):
        return False
    # Numbers of processes come again, in containers at once: the time of the start tells, where the
    # system tells it.
    return _start(process) not in (0, start)


@cache
def _machine() -> str:
    """Eight digits for the machine or container whose process numbers these are."""
    try:
        space = os.readlink("/proc/self/ns/pid")
    except OSError:
        space = ""
    return hashlib.sha256(f"{socket.gethostname()} {space}".encode()).hexdigest()[:8]


def _start(process: int) -> int:
    """Start of a process in clock ticks since the machine's; 0 where the system does not tell."""
    try:
        status = Path(f"/proc/{process}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return 0
    # The second field is the program's name in brackets and may hold anything.
    return int(status.rpartition(")")[2].split()[19])
