"""RBE2 and RBE3 of Nastran bulk data as pilots: their reference nodes and what these couple.

The independent grid of an RBE2 is a rigid pilot, the reference grid of an RBE3 a distributing one.
Entries: MSC Nastran 2021 Quick Reference Guide.
"""

import re
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from carrierflex.fe.matrices.component_names import COMPONENT_NAMES
from carrierflex.fe.matrices.node_files import NodeTable, read_nodes
from carrierflex.files.plain_files import plain_content
from carrierflex.geometry.given_meshes.nastran_decks import bulk_entries

if TYPE_CHECKING:
    from carrierflex.fe.matrices.interface_tables import (
        DistributingTable,
        InterfacesDocument,
        RigidTable,
    )

SUFFIXES = (".bdf", ".nas", ".dat", ".pch")
_MOST_BYTES = 4_000_000_000
_EXPECTED = "Nastran bulk data with RBE2 or RBE3 entries"
_ALL = "123456"
#: Where the optional lists of an RBE3 begin.
_ENDS = ("UM", "ALPHA", "TREF")


def linked_pilots(
    path: Path, nodes: NodeTable | None = None
) -> "list[DistributingTable | RigidTable]":
    """Pilots at the reference nodes of every RBE2 and RBE3 of a deck, in the order of the file.

    Parameters
    ----------
    path : Path
        Bulk data with the links and the grids that they name.
    nodes : NodeTable, optional
        Its grids, where they are read already.

    Returns
    -------
    list of DistributingTable or RigidTable
        Tables as an interfaces file holds them, points in the deck's unit of length; named
        ``rbe2_N`` and ``rbe3_N`` after the element's number. Empty where the deck has none.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where a link names a grid that is not there, or couples in a way that no pilot has: an RBE2
        of fewer than six components, an RBE3 whose weights differ between directions.
    """
    content = plain_content(path, _EXPECTED, _MOST_BYTES)
    if not re.search(rb"(?im)^RBE[23]", content):
        return []
    nodes = nodes or read_nodes(path)
    try:
        links = (entry for entry in bulk_entries(content) if entry.name in ("RBE2", "RBE3"))
        pilots = [_pilot([entry.name, *entry.fields], nodes) for entry in links]
        counts = Counter(pilot.name for pilot in pilots)
        if counts and max(counts.values()) > 1:
            link = max(counts, key=counts.__getitem__).upper().replace("_", " ")
            raise ValueError(f"{link} is given twice; expected different element numbers")
        return pilots
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def with_linked_pilots(document: "InterfacesDocument", deck: Path) -> "InterfacesDocument":
    """Interfaces document with the links of a deck among its pilots, where it asks for them.

    Raises
    ------
    FileNotFoundError, ValueError
        As :func:`linked_pilots`, or where the deck is none of Nastran or has no link.
    """
    if not document.links:
        return document
    if deck.suffix.lower() not in SUFFIXES:
        raise ValueError(
            f"{deck}: links = true takes RBE2 and RBE3 of Nastran bulk data; expected a file of "
            f"suffix {', '.join(SUFFIXES)}, or tables [[pilots]]"
        )
    linked = linked_pilots(deck)
    if not linked:
        raise ValueError(f"{deck}: no RBE2 or RBE3; expected one at least, or tables [[pilots]]")
    return document.model_copy(update={"pilots": [*document.pilots, *linked]})


def _pilot(card: list[Any], nodes: NodeTable) -> "DistributingTable | RigidTable":
    name, fields = card[0], card[1:]
    number = _positive_integer(fields[0] if fields else "", f"{name}: element number")
    return (_rigid if name == "RBE2" else _distributing)(number, fields, nodes)


def _rigid(number: int, fields: list[Any], nodes: NodeTable) -> "RigidTable":
    from carrierflex.fe.matrices.interface_tables import RigidTable

    what = f"RBE2 {number}"
    grid, components, *listed = [*fields[1:], "", ""]
    if _digits(components, what) != _ALL:
        raise ValueError(
            f"{what} couples components {_digits(components, what)}; expected 123456: a rigid "
            "pilot takes its nodes along in all of them; write a pilot of the interfaces file in "
            "its place"
        )
    # A number with a point is the coefficient of thermal expansion.
    members = _members([word for word in listed if not isinstance(word, float)], what)
    return RigidTable(
        name=f"rbe2_{number}", type="rigid", nodes=members, point=_point(grid, nodes, what)
    )


def _distributing(number: int, fields: list[Any], nodes: NodeTable) -> "DistributingTable":
    from carrierflex.fe.matrices.interface_tables import DistributingTable

    what = f"RBE3 {number}"
    # Number, blank, reference grid, its components; then weight, components, grids ...
    grid, follows, *rest = [*fields[2:], "", ""]
    end = next((i for i, word in enumerate(rest) if str(word).upper() in _ENDS), len(rest))
    groups: list[tuple[float, str, list[Any]]] = []
    words = [word for word in rest[:end] if word != ""]
    while words:
        first = words.pop(0)
        if not isinstance(first, float) or not words:
            raise ValueError(
                f"{what}: {str(first)[:20]!r} where a weight should be; expected weight, "
                "components and grids in turn, the weight with a point"
            )
        averaged = _digits(words.pop(0), what)
        count = next((i for i, word in enumerate(words) if isinstance(word, float)), len(words))
        groups.append((first, averaged, words[:count]))
        words = words[count:]
    averages = {averaged for _, averaged, _ in groups}
    if len(averages) != 1:
        raise ValueError(
            f"{what} averages components {', '.join(sorted(averages)) or 'none'}; expected the "
            "same of all its grids: write a pilot of the interfaces file in its place"
        )
    members: list[int] = []
    weights: list[float] = []
    for weight, _, listed in groups:
        listed_nodes = _members(listed, what)
        members += listed_nodes
        weights += [weight] * len(listed_nodes)
    return DistributingTable(
        name=f"rbe3_{number}",
        type="distributing",
        nodes=members,
        weights=weights,
        point=_point(grid, nodes, what),
        averaged=_names(averages.pop()),
        components=_names(_digits(follows, what)),
    )


def _members(words: list[Any], what: str) -> list[int]:
    """Numbers of grids, ``first THRU last`` among them."""
    members: list[int] = []
    words = [word for word in words if word != ""]
    at = 0
    while at < len(words):
        if str(words[at]).upper() == "THRU" and members and at + 1 < len(words):
            last = _positive_integer(words[at + 1], what)
            if not 0 < last - members[-1] < 2_000_000:
                raise ValueError(
                    f"{what}: grids {members[-1]} THRU {last}; expected ascending ones"
                )
            members += range(members[-1] + 1, last + 1)
            at += 2
        else:
            members.append(_positive_integer(words[at], what))
            at += 1
    if not members:
        raise ValueError(f"{what} names no grid; expected those that it couples")
    return members


def _point(word: Any, nodes: NodeTable, what: str) -> tuple[float, float, float]:
    grid = _positive_integer(word, f"{what}: reference grid")
    row = int(np.searchsorted(nodes.numbers, grid))
    if row == len(nodes.numbers) or nodes.numbers[row] != grid:
        raise ValueError(f"{what}: no GRID {grid} in the file; expected its reference node")
    x, y, z = nodes.points[row].tolist()
    return x, y, z


def _digits(word: Any, what: str) -> str:
    digits = "".join(sorted(set(str(word).strip())))
    if not digits or set(digits) - set(_ALL):
        raise ValueError(f"{what}: components {str(word)[:20]!r}; expected digits 1 to 6")
    return digits


def _names(digits: str) -> list[Any]:
    return [COMPONENT_NAMES[int(digit) - 1] for digit in digits]


def _positive_integer(word: Any, what: str) -> int:
    if not isinstance(word, int) or not 0 < word < 2**40:
        raise ValueError(f"{what} is {str(word)[:20]!r}; expected a whole number")
    return word
