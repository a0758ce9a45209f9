"""JSON and text files, whole or not at all; numbers that JSON does not know become null."""

import dataclasses
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from carrierflex.files.plain_files import plain_content
from carrierflex.files.shown_values import shown
from carrierflex.files.whole_files import refuse_foreign, refuse_to_replace, whole_file


def plain(value: Any) -> Any:
    """Copy of `value` made of what JSON knows; floats that are not finite become null."""
    if type(value) is float:
        return value if math.isfinite(value) else None
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {
            field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value)
        }
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        is_finite = value.dtype.kind in "biuf" and np.isfinite(value).all()
        return value.tolist() if is_finite else plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, np.integer):
        return int(value)
    if isinstance(value, (float, np.floating)):
        return float(value) if np.isfinite(value) else None
    return value if isinstance(value, (str, int)) or value is None else str(value)


def read_json(path: Path, expected: str, most_bytes: int = 100_000_000) -> Any:
    """Content of a JSON file.

    Parameters
    ----------
    path : Path
        File.
    expected : str
        What it should be, for the message: ``a list of seals``.
    most_bytes : int
        A larger file [bytes] is something else and is not read.

    Raises
    ------
    ValueError
        Where there is no such file, it is a folder or a device, too large, or not JSON; one line
        that names the file.
    """
    try:
        content = plain_content(path, expected, most_bytes)
        return json.loads(content.decode("utf-8"))
    except FileNotFoundError as error:
        raise ValueError(str(error)) from error
    except RecursionError as error:
        raise ValueError(f"{path}: is nested too deep; expected {expected}") from error
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        reason = " ".join(str(error).split())
        raise ValueError(f"{path}: not JSON ({reason}); expected {expected}") from error
    except ValueError as error:
        # Whole numbers of thousands of digits raise a ValueError of their own.
        if str(path) in str(error):
            raise
        raise ValueError(f"{path}: not JSON ({error}); expected {expected}") from error


def read_document(
    path: Path, expected: str, name: str, version: int, most_bytes: int = 100_000_000
) -> dict[str, Any]:
    """Content of a JSON file that states a format and its version.

    Parameters
    ----------
    path, expected, most_bytes
        As of :func:`read_json`.
    name, version : str, int
        Its format, and the newest version of it that is known.

    Raises
    ------
    ValueError
        Where the file is missing, no JSON, of another format, or written by a newer version.
    """
    document = read_json(path, expected, most_bytes)
    stated = document.get("format") if isinstance(document, dict) else None
    if stated != name:
        raise ValueError(f"{path}: key 'format' is {shown(stated)}; expected '{name}'")
    number = document.get("version")
    if not isinstance(number, int) or isinstance(number, bool) or number < 1:
        raise ValueError(f"{path}: key 'version' is {shown(number)}; expected {version}")
    if number > version:
        raise ValueError(
            f"{path}: key 'version' is {number}, written by a newer version; expected {version}: "
            "update carrierflex"
        )
    return dict(document)


def save_json(path: Path, content: object) -> None:
    """Write `content`, made plain, as indented JSON."""
    save_plain_json(path, plain(content))


def save_plain_json(path: Path, content: object, indent: int | None = 2) -> None:
    """Write what :func:`plain` made as JSON.

    With an indent it is written piece by piece, no text of it in memory. Long tables of numbers are
    read by no one: without an indent they take one line, whose text is made at once, by compiled
    code.

    Raises
    ------
    FileExistsError
        Where a file is in the way that has none of the keys of `content`.
    """
    if path.is_file() and isinstance(content, dict) and not _has_key_of(path, content):
        refuse_to_replace(path)
    with whole_file(path) as file, file.open("w", encoding="utf-8") as text:
        if indent is None:
            text.write(json.dumps(content, ensure_ascii=False))
        else:
            json.dump(content, text, indent=indent, ensure_ascii=False)
        text.write("\n")


def save_text(path: Path, text: str) -> None:
    """Write text; one that names this program replaces only a file that does too."""
    if "carrierflex" in text:
        refuse_foreign(path, "carrierflex")
    with whole_file(path) as file:
        file.write_text(text, encoding="utf-8")


def _has_key_of(path: Path, content: Mapping[str, object]) -> bool:
    """Whether a file is an older version of what is to be written, or empty."""
    if path.stat().st_size == 0:
        return True
    try:
        old = json.loads(path.read_bytes())
    except (ValueError, RecursionError):
        return False
    return isinstance(old, dict) and (not old or not content or bool(old.keys() & content.keys()))
