"""The lines of a map as fields to fill in: one value changes, comments and order stay."""

import json
import re
import tomllib
from collections.abc import Iterator
from typing import Any, NamedTuple

from carrierflex.identification.logs.map_tables import OPEN

_TABLE = re.compile(r"\[+([\w.]+)\]+")
_LINE = re.compile(r"(# )?(\w+) = (.+)")
#: Column at which a map's comments begin.
_COMMENT_AT = 44


class MapLine(NamedTuple):
    """A key of a map, or an example of one that is commented out."""

    number: int
    """Line of the text, from 0."""
    table: str
    """Table that it is in; empty before the first."""
    nth: int
    """Which of the tables of this name, from 0."""
    key: str
    value: Any
    raw: str
    """The value as it is written."""
    words: str
    """Comment behind it."""
    is_given: bool
    """Whether the line is no comment."""

    @property
    def is_open(self) -> bool:
        """Whether the user has to say what it is."""
        return self.is_given and bool(self.value == OPEN)

    @property
    def text(self) -> str:
        """Value as a field shows it; empty where it is not given."""
        if not self.is_given or self.is_open:
            return ""
        return self.value if isinstance(self.value, str) else self.raw


def map_lines(text: str) -> Iterator[MapLine]:
    """Keys of a map in their order, examples that are commented out included."""
    table, counts = "", {"": 0}
    for number, line in enumerate(text.splitlines()):
        if head := _TABLE.match(line):
            table = head[1]
            counts[table] = counts.get(table, -1) + 1
        elif match := _LINE.match(line):
            # The comment begins at the first '#' before which there is a value: texts may hold one.
            for sign in re.finditer(r"\s*#\s*|\s*$", match[3]):
                raw, words = match[3][: sign.start()], match[3][sign.end() :]
                value = _parsed(raw)
                if value is not None:
                    at = (number, table, counts[table])
                    yield MapLine(*at, match[2], value, raw, words, not match[1])
                    break


def with_value(text: str, line: MapLine, given: str) -> str:
    """Map with another value in one line.

    Parameters
    ----------
    text : str
        Map.
    line : MapLine
        One of its lines.
    given : str
        What the user wrote: text where the line holds text, else a number, list or flag of TOML.
        Nothing makes the line an example again, or open where it was open.
    """
    is_text = isinstance(line.value, str) and not line.is_open
    raw = given if _parsed(given) is not None and not is_text else _quoted(given)
    if not given:
        raw = line.raw
    begin = "" if given or line.is_open else "# "
    words = f"  # {line.words}" if line.words else ""
    lines = text.splitlines()
    lines[line.number] = f"{f'{begin}{line.key} = {raw}':<{_COMMENT_AT}}{words}".rstrip()
    return "\n".join([*lines, ""])


def with_key(text: str, above: MapLine, key: str, raw: str) -> str:
    """Map with one more key, in the line below another of its table."""
    lines = text.splitlines()
    lines.insert(above.number + 1, f"{key} = {raw}")
    return "\n".join([*lines, ""])


def _parsed(raw: str) -> Any:
    """Value of TOML; None where it is none."""
    try:
        return tomllib.loads(f"x = {raw}")["x"]
    except tomllib.TOMLDecodeError:
        return None


def _quoted(text: str) -> str:
    # JSON's strings are TOML's, but for one sign.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
