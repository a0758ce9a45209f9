"""A damaged HDF5 file is read in a process of its own before it is read here.

One changed byte can keep the HDF5 library in a loop that no signal ends, Ctrl-C among them. The
trial costs a start of Python, so that a file that stays as it is, or that this process wrote, is
tried once.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import h5py

from carrierflex.files.child_process import in_child, limited
from carrierflex.files.hdf5_datasets import samples

#: Processor time that a small file may take [s]; a megabyte has a second more.
_SECONDS = 5
_sound: set[tuple[str, int, int, int]] = set()


def try_hdf5(path: Path) -> None:
    """Read all of a file in a process with limits of time and memory.

    Errors that the library itself reports are no concern here: the reader meets them too.

    Parameters
    ----------
    path : Path
        An existing file.

    Raises
    ------
    ValueError
        Where the reading does not end, takes far more memory than the file has, or brings the
        library down; one line that names the file.
    """
    if _state(path) not in _sound:
        size = path.stat().st_size
        in_child(_read_all, path, size, _SECONDS + size // 1_000_000, about=path, what="HDF5")
        skip_trial(path)


def skip_trial(path: Path) -> None:
    """Take a file for sound as it is now: this program has just written it."""
    _sound.add(_state(path))


def _state(path: Path) -> tuple[str, int, int, int]:
    status = path.stat()
    return str(path.resolve()), status.st_ino, status.st_size, status.st_mtime_ns


def _read_all(path: Path, size: int, seconds: int) -> None:
    with limited(seconds, 500_000_000 + 100 * size), _reported(), h5py.File(path, "r") as file:
        with _reported():
            dict(file.attrs)
        file.visititems(_read_member)


def _read_member(name: str, member: h5py.Group | h5py.Dataset) -> None:
    with _reported():
        dict(member.attrs)
        # Numbers in one piece are a plain stretch of the file: nothing in them leads astray.
        if isinstance(member, h5py.Dataset) and (member.chunks or member.dtype.hasobject):
            samples(member.parent, name.rpartition("/")[2])


@contextmanager
def _reported() -> Iterator[None]:
    """Pass over what the library reports of damage; memory that it takes is a concern here."""
    try:
        yield
    except MemoryError:
        raise
    except Exception:
        return
