"""Blocks of an Abaqus or CalculiX deck: a keyword with its options, and the lines below it."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from carrierflex.files.shown_values import shown
from carrierflex.geometry.given_meshes.nastran_decks import BYTE_ORDER_MARK

_COORDINATES = 3


@dataclass(frozen=True)
class DeckBlock:
    """A keyword and its data.

    Parameters
    ----------
    line : str
        Line of the keyword, with those that it goes on in.
    data : bytes
        Lines below it, without comments.
    """

    line: str
    data: bytes

    @cached_property
    def name(self) -> str:
        """Keyword in capitals, with single blanks: ``*SOLID SECTION``."""
        return f"*{' '.join(self.line.partition(',')[0][1:].upper().split())}"

    @cached_property
    def settings(self) -> dict[str, str]:
        """Options in capitals without blanks, and their values as they are written."""
        options = (option.partition("=") for option in self.line.split(",")[1:])
        return {key.replace(" ", "").upper(): value.strip() for key, _, value in options}


def deck_blocks(content: bytes) -> Iterator[DeckBlock]:
    """Blocks of a deck, without nodes and sets of the assembly, which have numbers of their own.

    Parameters
    ----------
    content : bytes
        The deck.
    """
    text = content.removeprefix(BYTE_ORDER_MARK)
    text = re.sub(rb"(?m)^[ \t]*\*\*[^\r\n]*\r?\n?", b"", text)
    # A keyword's line that ends with a comma goes on in the next one.
    marks = list(re.finditer(rb"(?m)^[ \t]*(\*(?:[^\r\n]*,[ \t]*\r?\n)*[^\r\n]*)", text))
    ends = [*(mark.start() for mark in marks[1:]), len(text)]
    of_assembly = False
    # A file without a keyword has an end and no mark.
    for mark, end in zip(marks, ends, strict=False):
        line = " ".join(mark[1].decode("latin-1").split("\n"))
        block = DeckBlock(line.replace("\r", ""), text[mark.end() : end])
        if block.name in ("*ASSEMBLY", "*END INSTANCE"):
            of_assembly = True
        elif block.name in ("*INSTANCE", "*END ASSEMBLY"):
            of_assembly = False
        is_set = block.name == "*NSET" and "INSTANCE" not in block.settings
        if not (of_assembly and (block.name == "*NODE" or is_set)):
            yield block


def full_rows(data: bytes) -> bytes:
    """Number and three coordinates of every node, a line each; what is left out is zero.

    Parameters
    ----------
    data : bytes
        Lines below ``*NODE``.

    Raises
    ------
    ValueError
        Where a line has more numbers.
    """
    lines = [line for line in data.split(b"\n") if line.strip()]
    if {line.count(b",") for line in lines} == {_COORDINATES} and not re.search(rb",\s*,", data):
        if not any(line.rstrip().endswith(b",") for line in lines):
            return b"\n".join(lines)
    rows = []
    for line in lines:
        cells = line.strip().removesuffix(b",").split(b",") if b"," in line else line.split()
        if len(cells) > _COORDINATES + 1:
            raise ValueError(
                f"the line {shown(line.decode('latin-1').strip())} of *NODE has more than four "
                "numbers; expected number, x, y, z"
            )
        cells = [cell if cell.strip() else b"0" for cell in cells]
        rows.append(b",".join([*cells, *[b"0"] * (_COORDINATES + 1 - len(cells))]))
    return b"\n".join(rows)
