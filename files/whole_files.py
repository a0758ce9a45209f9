"""Files that appear whole or not at all: written under another name, then renamed."""

import hashlib
import os
import re
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NoReturn

from carrierflex.files.temporary_names import remove_abandoned, unfinished_name


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give a temporary name beside `path`, of the same suffix.

    Rename it to `path` when the block ends well. What killed processes left of the same file is
    removed first.

    Parameters
    ----------
    path : Path
        File to write; an older one is replaced in one step.

    Yields
    ------
    Path
        Name to write to; removed where the block raises or is interrupted.

    Raises
    ------
    OSError
        Where the file cannot be written (disk full, no permission); the message names it.
    """
    remove_abandoned(path.parent, path.name)
    temporary = path.with_name(unfinished_name(path.name))
    try:
        with errors_naming(path, temporary):
            yield temporary
            os.replace(temporary, path)
    finally:
        with suppress(OSError):
            temporary.unlink()


def file_digest(path: Path) -> str:
    """SHA-256 of a file in hexadecimal digits."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def check_file_writable(path: Path) -> None:
    """Make sure before long work that a file can be written at its end.

    Raises
    ------
    OSError
        Where it is a folder, or the folder it is to stand in is missing or cannot be written.
    """
    if path.is_dir():
        raise OSError(f"{path}: is a folder; expected the name of a file to write")
    try:
        # Without a name: nobody's file is touched.
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        raise OSError(
            f"{path}: cannot be written ({error.strerror}); expected a file in a writable folder"
        ) from error


def refuse_existing(*paths: Path) -> None:
    """Refuse to write where a file is that may have been edited since.

    Parameters
    ----------
    *paths : Path
        Files that are to be written.

    Raises
    ------
    ValueError
        With the first that exists.
    """
    for path in paths:
        if path.exists():
            raise ValueError(
                f"{path}: exists already; an existing file is not overwritten; give another name "
                "to --out"
            )


def refuse_foreign(path: Path, *marks: str) -> None:
    """Refuse to replace a file that this program did not write.

    Parameters
    ----------
    path : Path
        File that is to be written.
    *marks : str
        Words that a file of its kind holds where this program wrote it; one of comments may be
        broken over lines.

    Raises
    ------
    FileExistsError
        Where there is a file without them.
    OSError
        Where there is a folder.
    """
    if path.is_dir():
        check_file_writable(path)
    if not path.is_file():
        return
    content = path.read_bytes()
    wanted = [mark.encode() for mark in marks if mark.encode() not in content]
    if wanted and not all(word in re.sub(rb"[\s$*]+", b" ", content) for word in wanted):
        refuse_to_replace(path)


def refuse_foreign_files(marks: Mapping[Path, str]) -> None:
    """Refuse to begin work whose files would be in the way of others.

    Parameters
    ----------
    marks : mapping of Path to str
        Words of each file that is to be written, as of :func:`refuse_foreign`.

    Raises
    ------
    FileExistsError, OSError
        Where there is a file without its words, or a folder.
    """
    for path, mark in marks.items():
        refuse_foreign(path, mark)


def refuse_to_replace(path: Path) -> NoReturn:
    """Refuse a file that is in the way.

    Raises
    ------
    FileExistsError
        Always.
    """
    raise FileExistsError(
        f"{path}: is there already and is no file of this kind that carrierflex wrote; it is "
        "not replaced: choose another name or folder by --out, or move it"
    )


@contextmanager
def errors_naming(path: Path, temporary: Path) -> Iterator[None]:
    """Tell errors of writing `temporary` as those of the file that it is to become.

    Parameters
    ----------
    path, temporary : Path
        File that the user asked for; name that it is written under.

    Raises
    ------
    OSError
        In place of one about `temporary`, or about no file at all.
    """
    try:
        yield
    except (OSError, RuntimeError) as error:
        reason = _reason(error, temporary)
        if reason is None:
            raise
        raise OSError(f"{path}: cannot be written ({reason})") from error


def _reason(error: OSError | RuntimeError, temporary: Path) -> str | None:
    """What the system says against writing; None where the error is about another file."""
    if isinstance(error, OSError):
        if error.filename is not None and Path(os.fsdecode(error.filename)) != temporary:
            return None
        return os.strerror(error.errno) if error.errno else " ".join(str(error).split())
    # HDF5 tells a full disk in the text of a RuntimeError when the file is closed.
    errno = re.search(r"errno = (\d+)", str(error))
    return os.strerror(int(errno[1])) if errno else None
