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


def shortened(text: str, most: int = _SHOWN) -> str:
    """Text of at most so many characters, cut where it is longer."""
    return text if len(text) <= most else text[: most - 3] + "..."


def literal(text: str) -> str:
    """Text for a matplotlib figure in which ``$`` begins no formula."""
    return text.replace("$", r"\$")


def printable(text: str, most: int = 2000) -> str:
    r"""Text for a terminal: one line, control characters as ``\x1b``, the middle of a long one cut.

    >>> print(printable("a" + chr(27) + "]0;b"))
    a\x1b]0;b
    """
    line = " ".join(text.split())
    line = "".join(sign if sign.isprintable() else repr(sign)[1:-1] for sign in line)
    return line if len(line) <= most else f"{line[: most // 2]} ... {line[-most // 2 :]}"
