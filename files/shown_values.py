"""Values of a file as its messages show them: on one line, cut where they are long."""

from typing import Any

#: Characters of a value that a message shows.
_SHOWN = 80


def shown(value: Any) -> str:
    """Value as it stands in a TOML file, on one line and cut to 80 characters."""
    if isinstance(value, bool):
        return "true" if value else "false"
    try:
        text = repr(value)
    except (ValueError, RecursionError):
        # A hexadecimal number of thousands of digits.
        return "too long to be shown"
    return shortened(" ".join(text.split()))


def shortened(text: str) -> str:
    """Text of at most 80 characters, cut where it is longer."""
    return text if len(text) <= _SHOWN else text[: _SHOWN - 3] + "..."
