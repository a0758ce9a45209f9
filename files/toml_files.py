"""TOML files: read, with what is wrong with them in one line that names the file, and written.

A missing file, a folder, a file too large, not TOML, of another format or of a newer version is
refused before its keys are looked at. What the tables hold is checked all at once
(:func:`checked_document`): a file with five mistakes is corrected once, not five times.
"""

import math
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from carrierflex.files.plain_files import plain_content
from carrierflex.files.problems import ProblemsError, refuse
from carrierflex.files.shown_values import shortened, shown
from carrierflex.files.whole_files import whole_file

if TYPE_CHECKING:
    from carrierflex.files.toml_values import TomlTable

    Table = TypeVar("Table", bound=TomlTable)

#: What an editor of another encoding puts first: UTF-8 with a mark, UTF-16 of either byte order.
_BYTE_ORDER_MARKS = (b"\xef\xbb\xbf", b"\xff\xfe", b"\xfe\xff")

#: Sizes of numbers; powers of larger and smaller ones would leave the range of floats.
_LARGEST, _SMALLEST = 1e30, 1e-30
#: Parts of a key, as in ``rig.n_planets``; this program's files have three at most.
_MOST_PARTS = 20
_KEY_SEGMENT = r"""(?:(?<![\w-])[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+"""
_DEEP_KEY = re.compile(f"(?:{_KEY_SEGMENT}){{{_MOST_PARTS}}}")


@dataclass(frozen=True)
class TomlKind:
    """A kind of TOML file.

    Parameters
    ----------
    what : str
        The kind with its article, for messages: ``a parameter file``.
    most_bytes : int
        A larger file [bytes] is something else and is not read.
    format : str
        Value of the key ``format``; empty where the kind has no header.
    version : int
        Newest version of the format that is read.
    holds : str
        What such a file holds, told where the file is missing.
    """

    what: str
    most_bytes: int
    format: str = ""
    version: int = 1
    holds: str = ""

    @property
    def described(self) -> str:
        """The kind with what it holds, for somebody who has no such file yet."""
        return f"{self.what} (TOML with {self.holds})" if self.holds else f"{self.what} (TOML)"


def toml_document(path: Path, kind: TomlKind) -> dict[str, Any]:
    """Content of a TOML file.

    Parameters
    ----------
    path : Path
        File.
    kind : TomlKind
        What is expected of it; only `what` and `most_bytes` count here.

    Returns
    -------
    dict
        Tables, keys and values as they stand in the file.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is a folder or a device, too large, or not TOML in UTF-8 (with line and column).
    """
    content = _content(path, kind)
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        defect = f"byte 0x{content[error.start]:02x} in line {line} is no UTF-8 text"
        raise ValueError(
            f"{path}: not a TOML file: {defect}; expected {kind.what} in UTF-8",
        ) from error
    _refuse_costly(text, path)
    try:
        # Line ends of any system count, as in Python's text files.
        document = tomllib.loads(text.replace("\r\n", "\n").replace("\r", "\n"))
        refuse(_odd_numbers(document), str(path))
        return document
    except ProblemsError:
        raise
    except ValueError as error:
        # Numbers of thousands of digits raise a ValueError of their own.
        if str(error).startswith(str(path)):
            raise
        raise ValueError(f"{path}: not a TOML file: {' '.join(str(error).split())}") from error
    except RecursionError as error:
        raise ValueError(
            f"{path}: not a TOML file: lists or tables are nested too deep",
        ) from error


def checked_document(
    document: Mapping[str, Any],
    table: "type[Table]",
    file: str,
    *,
    version: int | None = None,
) -> "Table":
    """Content of a document as the tables of its kind; all that is wrong is refused in one error.

    Parameters
    ----------
    document : mapping
        Parsed TOML document.
    table : type of TomlTable
        The document's top table.
    file : str
        Name of the file, for the message.
    version : int, optional
        Version that the document states: keys that came later are refused by name.

    Returns
    -------
    TomlTable
        An instance of `table`.

    Raises
    ------
    ValueError
        Where keys are unknown or missing, values are not what the keys may hold, or values
        contradict each other.
    """
    from pydantic import ValidationError

    from carrierflex.files.toml_refusals import newer_keys_in, problems_in

    newer = newer_keys_in(document, table, version) if version else ()
    try:
        checked = table.model_validate(document)
    except ValidationError as error:
        refuse((*newer, *problems_in(error, document, table)), file)
        raise
    refuse(newer, file)
    return checked


def read_toml(path: Path, kind: TomlKind, table: "type[Table]") -> "Table":
    """Read a TOML file of one kind.

    Parameters
    ----------
    path : Path
        File.
    kind : TomlKind
        What is expected of the file.
    table : type of TomlTable
        Its top table.

    Returns
    -------
    TomlTable
        An instance of `table`.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        As :func:`toml_document`, :func:`check_header` and :func:`checked_document`.
    """
    document = toml_document(path, kind)
    check_header(document, kind, str(path))
    return checked_document(document, table, str(path))


def write_toml(
    path: Path, kind: TomlKind, heading: Sequence[str], document: Mapping[str, Any]
) -> None:
    """Write a file of a kind: comments, format and version, then its keys.

    Parameters
    ----------
    path : Path
        File; an older one is replaced in one step.
    kind : TomlKind
        Kind with a header.
    heading : sequence of str
        Lines of comment.
    document : mapping
        Keys; those that are None are left out.

    Raises
    ------
    OSError
        Where it cannot be written.
    """
    # Late: most commands write no such file.
    import tomli_w

    header = {"format": kind.format, "version": kind.version}
    header |= {name: value for name, value in document.items() if value is not None}
    content = "\n".join((*heading, tomli_w.dumps(header)))
    with whole_file(path) as temporary:
        temporary.write_bytes(content.encode())


def check_header(document: Mapping[str, Any], kind: TomlKind, file: str) -> None:
    """Check format and version first: a newer file may hold keys that are unknown here.

    Raises
    ------
    ValueError
        Where they are missing, of another kind of file, or newer; `file` is named.
    """
    if not kind.format:
        return
    if "format" not in document:
        raise ValueError(f"{file}: missing key 'format'; expected '{kind.format}' for {kind.what}")
    if document["format"] != kind.format:
        defect = shown(document["format"])
        raise ValueError(
            f"{file}: key 'format' is {defect}; expected '{kind.format}' for {kind.what}",
        )
    if "version" not in document:
        raise ValueError(f"{file}: missing key 'version'; expected {kind.version}")
    version = document["version"]
    if isinstance(version, bool) or not isinstance(version, int) or version < 1:
        raise ValueError(f"{file}: key 'version' is {shown(version)}; expected {kind.version}")
    if version > kind.version:
        defect = f"key 'version' is {shown(version)}, written by a newer version"
        raise ValueError(f"{file}: {defect}; expected {kind.version}: update carrierflex")


def _content(path: Path, kind: TomlKind) -> bytes:
    """Bytes of a file of at most ``kind.most_bytes``."""
    try:
        content = plain_content(path, kind.what, kind.most_bytes)
    except FileNotFoundError as error:
        raise FileNotFoundError(f"{path}: no such file; expected {kind.described}") from error
    if content.startswith(_BYTE_ORDER_MARKS):
        raise ValueError(
            f"{path}: not a TOML file: begins with a byte order mark; expected UTF-8 without one",
        )
    return content


def _refuse_costly(text: str, path: Path) -> None:
    """Refuse keys of many parts: reading them takes the square of their length."""
    deep = _DEEP_KEY.search(text)
    if deep is not None:
        line = text.count("\n", 0, deep.start()) + 1
        raise ValueError(
            f"{path}: not a TOML file: a key of more than {_MOST_PARTS} parts in line {line}; "
            "expected keys of a few"
        )


def _odd_numbers(value: Any, where: tuple[str, ...] = ()) -> Iterator[str]:
    """One text for every number beyond 64 bits, or beyond what any quantity in SI units is."""
    if isinstance(value, dict):
        for name, item in value.items():
            yield from _odd_numbers(item, (*where, shortened(name)))
    elif isinstance(value, list):
        for item in value:
            yield from _odd_numbers(item, where)
    elif isinstance(value, int) and not -(2**63) <= value < 2**63:
        yield f"key '{'.'.join(where)}' is {shown(value)}; expected a whole number of 64 bits"
    elif isinstance(value, float) and math.isfinite(value):
        size = abs(value)
        if size > _LARGEST:
            yield f"key '{'.'.join(where)}' is {value:g}; expected a number of {_LARGEST:g} at most"
        elif 0.0 < size < _SMALLEST:
            yield f"key '{'.'.join(where)}' is {value:g}; expected 0, or {_SMALLEST:g} at least"
