"""Reading of TOML files, and what is wrong with them, in one line that names the file.

A missing file, a folder, a file too large, not TOML, of another format or of a newer version is
refused before its keys are looked at. What the tables hold is checked all at once
(:func:`checked_document`): a file with five mistakes is corrected once, not five times.
"""

import stat
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from carrierflex.files.problems import refuse
from carrierflex.files.shown_values import shown

if TYPE_CHECKING:
    from carrierflex.files.toml_values import TomlTable

    Table = TypeVar("Table", bound=TomlTable)

#: What an editor of another encoding puts first: UTF-8 with a mark, UTF-16 of either byte order.
_BYTE_ORDER_MARKS = (b"\xef\xbb\xbf", b"\xff\xfe", b"\xfe\xff")


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
    try:
        # Line ends of any system count, as in Python's text files.
        return tomllib.loads(text.replace("\r\n", "\n").replace("\r", "\n"))
    except ValueError as error:
        # Numbers of thousands of digits raise a ValueError of their own.
        raise ValueError(f"{path}: not a TOML file: {' '.join(str(error).split())}") from error
    except RecursionError as error:
        raise ValueError(
            f"{path}: not a TOML file: lists or tables stand too deep in one another",
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
        status = path.stat()
    except (FileNotFoundError, NotADirectoryError) as error:
        raise FileNotFoundError(f"{path}: no such file; expected {kind.described}") from error
    if stat.S_ISDIR(status.st_mode):
        raise ValueError(f"{path}: a folder; expected {kind.described}")
    if not stat.S_ISREG(status.st_mode):
        raise ValueError(f"{path}: a device or a pipe; expected {kind.described}")
    expected = f"expected {kind.what} of at most {kind.most_bytes} bytes"
    if status.st_size > kind.most_bytes:
        raise ValueError(f"{path}: {status.st_size} bytes; {expected}")
    with path.open("rb") as file:
        content = file.read(kind.most_bytes + 1)
    if len(content) > kind.most_bytes:
        # Files that the system makes as they are read state no size.
        raise ValueError(f"{path}: more bytes than it states; {expected}")
    if content.startswith(_BYTE_ORDER_MARKS):
        raise ValueError(
            f"{path}: not a TOML file: begins with a byte order mark; expected UTF-8 without one",
        )
    return content
