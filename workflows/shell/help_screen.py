"""The help of a command in two columns, without frames: it fits on one screen.

Of a description of several paragraphs it shows the first; the others with ``--help --verbose``.
"""

import sys
import textwrap
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cyclopts.help import HelpEntry, HelpPanel
    from rich.console import Console, ConsoleOptions

#: Columns that names take at most; a longer name has its line for itself.
_NAMES = 25
#: Lines do not grow over this, however wide the screen is.
_WIDEST = 120


class HelpScreen:
    """What cyclopts calls for the usage line and for every group of entries."""

    def render_usage(self, console: "Console", options: "ConsoleOptions", usage: object) -> None:
        """Print how a command is called."""
        _print(console, f"Usage: {usage}")

    def __call__(self, console: "Console", options: "ConsoleOptions", panel: "HelpPanel") -> None:
        """Print the entries of a group below its title."""
        if panel.entries:
            rows = {_names(entry): _text(entry) for entry in panel.entries}
            _print(console, table(str(panel.title), rows, console.width))


def show_in_one_paragraph(
    console: "Console", options: "ConsoleOptions", panel: "HelpPanel"
) -> None:
    """Print the entries of a group, each with its text in brackets."""
    entries = [f"{_names(entry)} ({_text(entry)})" for entry in panel.entries]
    rows = {"": ", ".join(entries)}
    _print(console, table(str(panel.title), rows, console.width).replace("\n    ", "\n  "))


def table(title: str, rows: Mapping[str, str], width: int) -> str:
    """Names and texts in two columns below a title, in lines of at most `width` columns.

    Examples
    --------
    >>> print(table("Model", {"cad": "Write it.", "mesh": "Mesh it with tetrahedra."}, 24))
    Model:
      cad   Write it.
      mesh  Mesh it with
            tetrahedra.
    """
    names_width = min(max(map(len, rows), default=0), _NAMES) + 2
    text_width = max(min(width, _WIDEST) - names_width - 2, _NAMES // 2)
    lines = [f"{title}:"]
    for names, text in rows.items():
        texts = textwrap.wrap(text, text_width, break_on_hyphens=False) or [""]
        if len(names) >= names_width:
            lines.append(f"  {names}")
        else:
            lines.append(f"  {names:<{names_width}}{texts.pop(0)}".rstrip())
        lines += [" " * (names_width + 2) + line for line in texts]
    return "\n".join(lines)


def _print(console: "Console", text: str) -> None:
    console.print(text, markup=False, highlight=False, soft_wrap=True)


def _names(entry: "HelpEntry") -> str:
    if entry.positional_label:
        return str(entry.positional_label)
    return ", ".join(entry.display_labels_with_metavar)


def _text(entry: "HelpEntry") -> str:
    """Description, choices and default, in one paragraph."""
    notes = [
        "[required]" if entry.required else "",
        f"[{' | '.join(entry.choices)}]" if entry.choices else "",
        f"[default: {_default(entry)}]" if _default(entry) else "",
    ]
    text = _plain(entry.description)
    if "--verbose" not in sys.argv:
        text = text.partition("\n\n")[0]
    return " ".join([*text.split(), *filter(None, notes)])


def _default(entry: "HelpEntry") -> str:
    """Default as a user writes it; empty for flags, empty texts and empty lists."""
    text = "" if entry.default in (None, "False", "True") else str(entry.default)
    if text.startswith("(") and text.endswith(")"):
        text = text[1:-1].rstrip(",").replace("'", "")
    return "" if text == '""' else text


def _plain(description: Any) -> str:
    shown = getattr(description, "primary_renderable", description)
    return str(getattr(shown, "plain", shown) or "")
