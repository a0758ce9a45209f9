"""Checked tables of a TOML document: every unknown, missing or wrong key is named in one line."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Value:
    """What a key may hold.

    Parameters
    ----------
    description : str
        The expectation in words, for the message.
    accepts : callable
        True for a value that is allowed.
    """

    description: str
    accepts: Callable[[Any], bool]


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _is_count(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_text(value: Any) -> bool:
    return isinstance(value, str) and value.strip() != "" and "\n" not in value


def _is_list_of(accepts: Callable[[Any], bool]) -> Callable[[Any], bool]:
    return lambda value: isinstance(value, list) and all(accepts(item) for item in value)


TEXT = Value("a non-empty string on one line", _is_text)
NUMBER = Value("a finite number", _is_number)
POSITIVE = Value("a positive number", lambda value: _is_number(value) and value > 0)
NOT_NEGATIVE = Value("a number >= 0", lambda value: _is_number(value) and value >= 0)
COUNT = Value("a whole number >= 0", lambda value: _is_count(value) and value >= 0)
POSITIVE_COUNT = Value("a whole number >= 1", lambda value: _is_count(value) and value >= 1)
FLAG = Value("true or false", lambda value: isinstance(value, bool))
TEXTS = Value("a list of strings", _is_list_of(_is_text))
THREE_POSITIVE = Value(
    "three positive numbers",
    lambda value: _is_list_of(POSITIVE.accepts)(value) and len(value) == 3,
)
TABLE = Value("a table", lambda value: isinstance(value, dict))
TABLES = Value(
    "at least one table",
    lambda value: _is_list_of(lambda item: isinstance(item, dict))(value) and len(value) > 0,
)


def one_of(*choices: str) -> Value:
    """Accept one of a few strings."""
    return Value(
        "one of " + ", ".join(choices), lambda value: isinstance(value, str) and value in choices
    )


def checked_table(
    table: Mapping[str, Any],
    where: str,
    *,
    required: Mapping[str, Value],
    optional: Mapping[str, Value] | None = None,
) -> dict[str, Any]:
    """Copy of `table` after its keys and values are checked.

    Parameters
    ----------
    table : mapping
        One table of a TOML document.
    where : str
        File and table, for the message: ``campaign.toml, [rig]``.
    required, optional : mapping of str to Value
        Keys that must and keys that may stand in the table.

    Returns
    -------
    dict
        The same keys and values.

    Raises
    ------
    ValueError
        Where a key is unknown or missing, or a value is not what the key may hold.
    """
    optional = optional or {}
    known = [*required, *optional]
    for key in table:
        if key not in known:
            raise ValueError(f"{where}: unknown key '{key}'; expected only {', '.join(known)}")
    for key, value in required.items():
        if key not in table:
            raise ValueError(f"{where}: missing key '{key}'; expected {value.description}")
    for key, value in table.items():
        expected = required.get(key) or optional[key]
        if not expected.accepts(value):
            raise ValueError(
                f"{where}: key '{key}' is {_short(value)}; expected {expected.description}"
            )
    return dict(table)


def _short(value: Any) -> str:
    """Show the value as text of at most 80 characters."""
    text = repr(value).replace("\n", " ")
    return text if len(text) <= 80 else text[:77] + "..."
