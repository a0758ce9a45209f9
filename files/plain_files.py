"""What is asked of a file before it is read: that it is one, and that it is not too large.

A pipe keeps its reader waiting for ever, a device never ends, and a file with holes states a size
that nobody wrote.
"""

import os
import stat
from pathlib import Path

#: Bytes that are read of a file that states fewer.
_UNSTATED = 10_000_000


def check_plain_file(path: Path, expected: str, most_bytes: int, *, text: bool = False) -> int:
    """Refuse what is not a file of reasonable size.

    Parameters
    ----------
    path : Path
        File; links are followed.
    expected : str
        What it should be, for the message: ``a CSV file of deflection curves``.
    most_bytes : int
        Largest size [bytes].
    text : bool
        Refuse holes: text has none.

    Returns
    -------
    int
        Size [bytes].

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is a folder, a pipe or a device, too large, or full of holes.
    """
    try:
        status = path.stat()
    except (FileNotFoundError, NotADirectoryError) as error:
        raise FileNotFoundError(f"{path}: no such file; expected {expected}") from error
    except (OSError, ValueError) as error:
        # Circles of links, names that are too long, NUL in the name.
        reason = getattr(error, "strerror", None) or str(error)
        raise ValueError(f"{path}: {reason}; expected {expected}") from error
    if stat.S_ISDIR(status.st_mode):
        raise ValueError(f"{path}: a folder; expected {expected}")
    if not stat.S_ISREG(status.st_mode):
        raise ValueError(f"{path}: a device or a pipe; expected {expected}")
    if status.st_size > most_bytes:
        raise ValueError(
            f"{path}: {status.st_size} bytes; expected {expected} of at most {most_bytes} bytes"
        )
    if text and _has_holes(path, status.st_size):
        raise ValueError(f"{path}: has a gap without stored data; expected {expected}")
    return status.st_size


def plain_content(path: Path, expected: str, most_bytes: int) -> bytes:
    """Content of a text file that :func:`check_plain_file` accepts; never more than `most_bytes`.

    Raises
    ------
    FileNotFoundError, ValueError
        As :func:`check_plain_file`, and where the file cannot be read.
    """
    size = check_plain_file(path, expected, most_bytes, text=True)
    # Reading takes the memory that it is allowed before it knows what there is.
    most = min(most_bytes, max(size, _UNSTATED))
    try:
        with path.open("rb") as file:
            content = file.read(most + 1)
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror}; expected {expected}") from error
    if len(content) > most:
        # Files that the system makes as they are read state no size.
        raise ValueError(f"{path}: more bytes than it states; expected {expected}")
    return content


def _has_holes(path: Path, size: int) -> bool:
    with path.open("rb") as file:
        try:
            return os.lseek(file.fileno(), 0, os.SEEK_HOLE) < size
        except OSError:
            return False
