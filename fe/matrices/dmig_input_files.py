"""Direct matrix input (DMIG) of Nastran, as its punch file holds it: entries by grid and component.

Fields of 8 or 16 characters or free ones with commas; a symmetric matrix stores one triangle, null
columns are left out. pyyeti reads the same into dense matrices; here they stay sparse.
"""

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.matrices.stored_matrix import (
    SCALAR,
    DofNames,
    StoredMatrix,
    from_entries,
    names_of_keys,
    refuse_twice,
)
from carrierflex.fe.matrices.text_numbers import numbers, whole_numbers
from carrierflex.files.shown_values import shown
from carrierflex.geometry.given_meshes.nastran_decks import bulk_entries

#: Form numbers: square and symmetric.
_SQUARE, _SYMMETRIC = 1, 6
#: First letters of names.
_LETTERS = {"stiffness": "K", "mass": "M", "damping": "B"}
#: Nastran lets an exponent stand without its letter: 1.0-5.
_BARE_EXPONENT = re.compile(r"(?<=[\d.])([-+])(?=\d)")


def read_dmig(path: Path, content: bytes, quantity: str) -> StoredMatrix:
    """Matrix of a punch file.

    Where there are several, the one whose name begins with K (stiffness) or M (mass).

    Parameters
    ----------
    path : Path
        The file, for messages.
    content : bytes
        Its content.
    quantity : str
        ``stiffness``, ``mass`` or ``damping``.

    Raises
    ------
    ValueError
        Where there is no such matrix, or it is not real and square.
    """
    try:
        cards: dict[str, list[list[str]]] = {}
        for entry in bulk_entries(content):
            if entry.name == "DMIG":
                cards.setdefault(entry.words[0].upper(), []).append(entry.words)
        name = chosen_name(list(cards), quantity)
        return _matrix(cards[name])
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def chosen_name(names: list[str], quantity: str) -> str:
    """Name of the matrix of a file with several: its first letter is K, M or B (damping).

    Raises
    ------
    ValueError
        Where there is none, or more than one.
    """
    letter = _LETTERS[quantity]
    candidates = names if len(names) == 1 else [n for n in names if n.upper().startswith(letter)]
    if len(candidates) != 1:
        listed = "matrices " + ", ".join(shown(name) for name in names[:20])
        raise ValueError(
            f"{listed if names else 'no matrix'}; expected one, or one whose name begins with "
            f"{letter} ({quantity})"
        )
    return candidates[0]


def _matrix(cards: list[list[str]]) -> StoredMatrix:
    header, *columns = cards
    if header[1] != "0":
        raise ValueError(f"matrix {shown(header[0])} has no header; expected DMIG NAME 0 FORM TYPE")
    form, kind = (int(word) if word.isdigit() else 0 for word in (header[2], header[3]))
    if form not in (_SQUARE, _SYMMETRIC) or kind not in (1, 2):
        raise ValueError(
            f"matrix {shown(header[0])} has form {shown(header[2])} and type {shown(header[3])}; "
            "expected form 6 or 1 (square) and type 1 or 2 (real)"
        )
    points: list[str] = []
    values: list[str] = []
    for column in columns:
        # The entries of a column: grid, component, real part, imaginary part.
        entries = column[4:]
        for at in range(0, len(entries) - 2, 4):
            if entries[at]:
                points += [column[1], column[2] or "0", entries[at], entries[at + 1] or "0"]
                values.append(entries[at + 2])
    index = whole_numbers(numbers(" ".join(points).encode("latin-1", "replace"), "grids"), "grids")
    table = index.reshape(-1, 4)
    parsed = numbers(" ".join(map(_plain, values)).encode("latin-1", "replace"), "the entries")
    if len(parsed) != len(table):
        raise ValueError(f"{len(parsed)} values for {len(table)} entries; expected one each")
    keys = np.stack([_keys(table[:, 2], table[:, 3]), _keys(table[:, 0], table[:, 1])])
    names, inverse = np.unique(keys, return_inverse=True)
    rows, columns_of = inverse.reshape(2, -1)
    dofs = names_of_keys(names)
    refuse_twice(rows, columns_of, len(names), dofs)
    return StoredMatrix(from_entries(rows, columns_of, parsed, len(names)), dofs)


def _plain(word: str) -> str:
    """A number with its exponent's letter."""
    return _BARE_EXPONENT.sub(r"E\1", word)


def _keys(grids: NDArray[np.int64], components: NDArray[np.int64]) -> NDArray[np.int64]:
    if components.size and components.max() > 6:
        raise ValueError(f"component {components.max()}; expected 1 to 6, or 0 of a scalar point")
    return DofNames(grids, np.where(components == 0, SCALAR, components - 1)).keys
