"""A matrix as a file of another program holds it, and the names of its degrees of freedom."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.matrices.component_names import COMPONENT_NAMES

#: Component of a scalar point: a modal coordinate of a superelement, without place or direction.
SCALAR = -1
#: Matrices of more degrees of freedom than this are refused before memory is taken for them.
MOST_DOFS = 30_000_000
#: Matrices of more stored entries than this are refused.
MOST_ENTRIES = 2_000_000_000
_FIRST = 100
#: Entries whose digits are looked at; fewer different ones tell nothing; few digits.
_MOST_LOOKED_AT, _FEWEST_VALUES, _FEW_DIGITS = 10_000, 8, 6


@dataclass(frozen=True, eq=False)
class DofNames:
    """Node and component of every degree of freedom.

    Parameters
    ----------
    nodes : ndarray of int, shape (n,)
        Numbers that the program gives its nodes.
    components : ndarray of int, shape (n,)
        0 to 5: translations and rotations along x, y, z; :data:`SCALAR` for a scalar point.
    """

    nodes: NDArray[np.int64]
    components: NDArray[np.int64]

    def __len__(self) -> int:
        """Number of degrees of freedom."""
        return len(self.nodes)

    @property
    def keys(self) -> NDArray[np.int64]:
        """One number a degree of freedom, ascending by node, then component."""
        return self.nodes * 8 + self.components + 1

    def named(self, dof: int) -> str:
        """A degree of freedom in words: ``node 17 Ty``."""
        component = int(self.components[dof])
        if component == SCALAR:
            return f"scalar point {self.nodes[dof]}"
        return f"node {self.nodes[dof]} {COMPONENT_NAMES[component]}"

    def at(self, rows: NDArray[np.int64]) -> "DofNames":
        """Names of some of the degrees of freedom, in the order of `rows`."""
        return DofNames(self.nodes[rows], self.components[rows])


def names_of_keys(keys: NDArray[np.int64]) -> DofNames:
    """Names behind :attr:`DofNames.keys`."""
    return DofNames(keys // 8, keys % 8 - 1)


@dataclass(frozen=True, eq=False)
class StoredMatrix:
    """A symmetric matrix as a file holds it, both triangles.

    Parameters
    ----------
    A : csr_array, shape (n, n)
        Entries as printed, in the file's units.
    dofs : DofNames or None
        Names of rows and columns; None where the file has none.
    states_order : bool
        Whether the file says how many rows there are. A list of entries does not: its rows end
        with the last entry.
    """

    A: sp.csr_array
    dofs: DofNames | None = None
    states_order: bool = True


def from_entries(
    rows: NDArray[np.int64], columns: NDArray[np.int64], values: NDArray[np.float64], n: int
) -> sp.csr_array:
    """Matrix of entries that are listed one by one; one of every pair alone is mirrored.

    Parameters
    ----------
    rows, columns : ndarray of int, shape (k,)
        From 0; what is listed twice is added.
    values : ndarray, shape (k,)
        Entries.
    n : int
        Order of the matrix.

    Raises
    ------
    ValueError
        Where an index is none of the matrix, or a value is not finite.
    """
    if n > MOST_DOFS or len(values) > MOST_ENTRIES:
        raise ValueError(
            f"states {n} degrees of freedom and {len(values)} entries; expected at most "
            f"{MOST_DOFS} and {MOST_ENTRIES}"
        )
    for what, index in (("row", rows), ("column", columns)):
        if len(index) and not (index.min() >= 0 and index.max() < n):
            wrong = int(index[(index < 0) | (index >= n)][0]) + 1
            raise ValueError(f"{what} {wrong} of a matrix of order {n}; expected 1 to {n}")
    refuse_not_finite(values)
    if _lists_every_pair_once(rows, columns, n):
        off = rows != columns
        rows, columns = (
            np.concatenate([rows, columns[off]]),
            np.concatenate([columns, rows[off]]),
        )
        values = np.concatenate([values, values[off]])
    return sp.csr_array(sp.coo_array((values, (rows, columns)), shape=(n, n)))


def refuse_twice(
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    n: int,
    names: DofNames | None = None,
) -> None:
    """Refuse a list in which an entry occurs twice; an entry and its mirror are two.

    Parameters
    ----------
    rows, columns : ndarray of int, shape (k,)
        From 0.
    n : int
        Order of the matrix.
    names : DofNames, optional
        Names of rows and columns, for the message.

    Raises
    ------
    ValueError
        With the first entry that occurs twice.
    """
    entries = np.sort(rows * n + columns)
    again = np.flatnonzero(np.diff(entries) == 0)
    if len(again):
        at = [int(index) for index in divmod(entries[again[0]], n)]
        row, column = (str(i + 1) if names is None else names.named(i) for i in at)
        raise ValueError(
            f"the entry of row {row} and column {column} occurs twice; expected every one once: "
            "delete what the file lists again"
        )


def _lists_every_pair_once(
    rows: NDArray[np.int64], columns: NDArray[np.int64], n: int
) -> np.bool_ | bool:
    """Whether no entry off the diagonal has its mirror: a triangle, of whatever order of nodes."""
    below, above = rows > columns, rows < columns
    if not below.any() or not above.any():
        return True
    lower, upper = rows[below] * n + columns[below], columns[above] * n + rows[above]
    # The first ones tell most full matrices without the whole search.
    return not (np.isin(lower, upper[:_FIRST]).any() or np.isin(lower, upper).any())


def precision_note(A: sp.csr_array) -> str:
    """What the number of digits of a matrix leaves of a body; empty where there are enough."""
    values = np.unique(np.abs(A.data[A.data != 0.0]))[:_MOST_LOOKED_AT]
    # A few round numbers are those of a small example.
    if len(values) < _FEWEST_VALUES:
        return ""
    scale = 10.0 ** np.floor(np.log10(values))
    for digits in range(1, _FEW_DIGITS + 1):
        rounded = np.round(values / scale, digits - 1) * scale
        if np.allclose(rounded, values, rtol=1e-12, atol=0.0):
            return (
                f"the stiffness has {digits} significant digits, and rounding may leave a body "
                "that is not held together; expected 9 digits at least: write it in large fields "
                "or in binary"
            )
    if (values.astype(np.float32) == values).all():
        return (
            "the stiffness is in single precision: a certificate's limits of 1e-8 may not be met; "
            "expected double precision where the program offers it"
        )
    return ""


def refuse_not_finite(values: NDArray[np.float64]) -> None:
    """Raise ValueError where an entry is not finite."""
    if not np.isfinite(values).all():
        count = int(np.count_nonzero(~np.isfinite(values)))
        raise ValueError(f"{count} entries are not finite; expected finite numbers")
