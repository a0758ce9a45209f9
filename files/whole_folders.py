"""Folders that appear whole or not at all, also where they replace an older one.

Linux exchanges two folders in one step (``renameat2``), so a kill at any moment leaves the old or
the new one. File systems that cannot do that leave a moment with neither; the old folder then waits
under a hidden name and :func:`taken_up` puts it back at the next start.
"""

import ctypes
import errno
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from carrierflex.files.temporary_names import (
    OLD,
    abandoned,
    remove_abandoned,
    unfinished_name,
)

_CURRENT_FOLDER = -100  # AT_FDCWD of fcntl.h
_EXCHANGE = 2  # RENAME_EXCHANGE of linux/fs.h
#: Answers of systems and file systems that cannot exchange.
_CANNOT = (errno.ENOSYS, errno.EINVAL, errno.EOPNOTSUPP, errno.EPERM)


@contextmanager
def whole_folder(folder: Path) -> Iterator[Path]:
    """Give a new folder beside `folder`; it takes the place of `folder` when the block ends well.

    Parameters
    ----------
    folder : Path
        Folder to write; an older one is replaced with everything in it.

    Yields
    ------
    Path
        Folder to write into; removed where the block raises or is interrupted.
    """
    new = unfinished_folder(folder)
    try:
        yield new
        _put_in_place(new, folder)
    finally:
        shutil.rmtree(new, ignore_errors=True)


def unfinished_folder(folder: Path) -> Path:
    """Make a new hidden folder beside `folder`, named after it; the caller removes it."""
    new = folder.with_name(unfinished_name(folder.name))
    new.mkdir(parents=True)
    return new


@contextmanager
def scratch_folder(path: Path) -> Iterator[Path]:
    """Folder for what is needed while `path` is written; removed when the block ends.

    It stands beside `path`: what a killed process leaves of it goes with the next writing of
    `path`, while the system's folder for temporary files is nobody's to clear.
    """
    folder = unfinished_folder(path)
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def taken_up(folder: Path) -> None:
    """Finish what killed processes began at `folder`.

    An older folder that waits to be replaced comes back where nothing stands in its place;
    everything else that they left beside `folder` is removed.
    """
    if not os.path.lexists(folder):
        for old in list(abandoned(folder.parent, folder.name, OLD))[-1:]:
            os.rename(old, folder)
    remove_abandoned(folder.parent, folder.name, OLD)
    remove_abandoned(folder.parent, folder.name)


def check_writable(folder: Path) -> None:
    """Create a folder where it is missing, and make sure that files can be written into it.

    Raises
    ------
    OSError
        Where it is a file or cannot be written; the message is one line.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        # Without a name, or under a new one: nobody's file is touched.
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise OSError(
            f"{folder}: cannot write into this output folder ({error.strerror}); expected a "
            "writable --out"
        ) from error


def _put_in_place(new: Path, folder: Path) -> None:
    """Let `new` take the place of `folder`; whichever is to go is left under the other name."""
    if not folder.exists():
        os.replace(new, folder)
        return
    if _exchanged(new, folder):
        return
    old = folder.with_name(unfinished_name(folder.name, OLD))
    try:
        os.replace(folder, old)
        os.replace(new, folder)
    except BaseException:
        if old.exists() and not folder.exists():
            os.replace(old, folder)
        raise
    shutil.rmtree(old)


def _exchanged(one: Path, other: Path) -> bool:
    """Exchange two folders in one step; False where the system cannot."""
    rename = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    if rename is None:
        return False
    names = os.fsencode(one), os.fsencode(other)
    if rename(_CURRENT_FOLDER, names[0], _CURRENT_FOLDER, names[1], _EXCHANGE) == 0:
        return True
    number = ctypes.get_errno()
    if number in _CANNOT:
        return False
    raise OSError(number, os.strerror(number), str(other))
