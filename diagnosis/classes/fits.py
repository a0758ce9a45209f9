"""Penalised least squares on products of columns, some coefficients at least zero."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product
from types import EllipsisType

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs, dtrtrs
from scipy.optimize import nnls

from carrierflex.diagnosis.classes.gram_table import ColumnGroup, GramTable, IntArray
from carrierflex.diagnosis.comparison.problem import FloatArray

#: Rounding of a product of columns of unit energy.
_ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class ClassModel:
    """Columns of one fit, their penalty and which coefficients are at least zero.

    Parameters
    ----------
    columns : ndarray of int, shape (n,)
        Places in the table, the baseline's first.
    penalty : ndarray, shape (n, n)
        Quadratic penalty.
    is_nonnegative : ndarray of bool, shape (n,)
        Coefficients that are >= 0.
    """

    columns: IntArray
    penalty: FloatArray
    is_nonnegative: np.ndarray

    @cached_property
    def free_first(self) -> tuple[IntArray, int]:
        """Order of the coefficients with those first that may be negative, and their number."""
        free = ~self.is_nonnegative
        order = np.concatenate([np.flatnonzero(free), np.flatnonzero(self.is_nonnegative)])
        return order, int(np.count_nonzero(free))


def class_model(
    table: GramTable,
    groups: Sequence[str],
    ridges: Sequence[float],
    *,
    jitter: float,
    further: IntArray | None = None,
) -> ClassModel:
    """Model of the baseline with some groups, each at its own ridge.

    Parameters
    ----------
    table : GramTable
        Products.
    groups : sequence of str
        Groups of columns.
    ridges : sequence of float
        Weight of each group's penalty.
    jitter : float
        Ridge on every class column.
    further : ndarray of int, optional
        Columns of laws, which are not penalised.

    Returns
    -------
    ClassModel
        Ready to be fitted.
    """
    members: list[ColumnGroup] = [table.groups[name] for name in groups]
    laws = np.empty(0, dtype=np.int64) if further is None else further
    columns = np.concatenate([table.base, laws, *(member.columns for member in members)])
    penalty = np.zeros((columns.size, columns.size))
    nonnegative = np.zeros(columns.size, dtype=bool)
    first = table.n_base + laws.size
    energy = table.total[columns, columns].max(initial=0.0)
    diagonal = np.full(columns.size, jitter)
    diagonal[: table.n_base] = _ROUNDING * energy
    diagonal[table.n_base : first] = jitter * energy
    for member, ridge in zip(members, ridges, strict=True):
        own = slice(first, first + member.columns.size)
        penalty[own, own] = ridge * member.penalty
        nonnegative[own] = member.is_nonnegative
        first = own.stop
    penalty[np.diag_indices(columns.size)] += diagonal
    return ClassModel(columns, penalty, nonnegative)


def products_of(gram: FloatArray, model: ClassModel, blocks: IntArray | None = None) -> FloatArray:
    """Products of the target and a model's columns, from those of all columns of a table.

    Parameters
    ----------
    gram : ndarray, shape (..., n_table, n_table)
        Products of all columns of the table, the target first.
    model : ClassModel
        Columns.
    blocks : ndarray of int, optional
        Which along the first axis; all of them where it is left out.

    Returns
    -------
    ndarray, shape (..., 1 + n, 1 + n)
        The target first, then the model's columns in their order.
    """
    places = np.concatenate([[0], model.columns])
    n_blocks = gram.shape[:-2] if blocks is None else blocks.shape
    chosen: IntArray | EllipsisType = ... if blocks is None else blocks
    found = np.empty((*n_blocks, places.size, places.size))
    # Groups stand together in a table: slices are copied several times as fast as single places.
    own = stretches(np.arange(places.size), places)
    for (rows, from_rows), (columns, from_columns) in product(own, repeat=2):
        found[..., rows, columns] = gram[chosen, from_rows, from_columns]
    return found


def stretches(first: IntArray, second: IntArray) -> list[tuple[slice, slice]]:
    """Pairs of places as slices, each of pairs that follow each other on both sides.

    Parameters
    ----------
    first, second : ndarray of int, shape (n,)
        Places, pair by pair.
    """
    cuts = np.flatnonzero((np.diff(first) != 1) | (np.diff(second) != 1)) + 1
    ends = pairwise([0, *cuts.tolist(), first.size])
    return [
        (slice(int(first[a]), int(first[b - 1]) + 1), slice(int(second[a]), int(second[b - 1]) + 1))
        for a, b in ends
    ]


def coefficients(products: FloatArray, model: ClassModel) -> FloatArray:
    """Coefficients c that minimise ``|target - columns c|² + c' P c``, some c >= 0.

    The free coefficients are projected out of the products first; what remains is a small problem
    of non-negative least squares.

    Parameters
    ----------
    products : ndarray, shape (1 + n, 1 + n)
        Products of the target and the model's columns (:func:`products_of`).
    model : ClassModel
        Columns and penalty.

    Returns
    -------
    ndarray, shape (n,)
        In the order of the model's columns.

    References
    ----------
    .. [1] C. L. Lawson, R. J. Hanson, "Solving Least Squares Problems" (1974), chapter 23.
    """
    if not model.columns.size:
        return np.empty(0)
    A = products[1:, 1:] + model.penalty
    b = products[1:, 0]
    order, n_free = model.free_first
    if n_free == b.size:
        return _solved(_factor(A), b)
    if not n_free:
        return _nonnegative(A, b)
    A, b = A[order[:, None], order], b[order]
    factor = _factor(A[:n_free, :n_free])
    coupling = _solved(factor, A[:n_free, n_free:])
    schur = A[n_free:, n_free:] - A[n_free:, :n_free] @ coupling
    bound = _nonnegative(schur, b[n_free:] - coupling.T @ b[:n_free])
    found = np.empty(b.size)
    found[order[n_free:]] = bound
    found[order[:n_free]] = _solved(factor, b[:n_free]) - coupling @ bound
    return found


def squares_left(products: FloatArray, c: FloatArray) -> FloatArray:
    """Sum of squares that coefficients leave, shape (...).

    Parameters
    ----------
    products : ndarray, shape (..., 1 + n, 1 + n)
        Products of the target and the columns, such as those of each block.
    c : ndarray, shape (n,)
        Coefficients.
    """
    weights = np.concatenate([[1.0], -c])
    return np.asarray((products @ weights) @ weights)


def squares_of_each(products: FloatArray, C: FloatArray) -> FloatArray:
    """Sums of squares that several fits leave of the same products, shape (n_fits, n_blocks).

    The products are read once for all fits: of many blocks they are larger than a cache.

    Parameters
    ----------
    products : ndarray, shape (n_blocks, 1 + n, 1 + n)
        Products of the target and the columns of each block.
    C : ndarray, shape (n_fits, n)
        Coefficients of each fit.
    """
    weights = np.column_stack([np.ones(len(C)), -C])
    rows = (products.reshape(-1, weights.shape[1]) @ weights.T).reshape(*products.shape[:2], -1)
    return np.einsum("bif,fi->fb", rows, weights)


def _factor(A: FloatArray) -> FloatArray:
    """Lower Cholesky factor; a rounding more on the diagonal where A is singular to rounding.

    LAPACK directly: a table is hundreds of small solves, of which checks take half of the time.
    """
    factor, failed = dpotrf(A, lower=1)
    if not failed:
        return np.asarray(factor)
    # Columns that are zero in the records of a fit take the coefficient zero.
    rounding = _ROUNDING * (float(np.diag(A).max()) or 1.0)
    for lift in (rounding * 100.0**k for k in range(7)):
        factor, failed = dpotrf(A + lift * np.eye(len(A)), lower=1)
        if not failed:
            return np.asarray(factor)
    raise ArithmeticError(f"the products of {len(A)} columns are not positive: table is corrupt")


def _solved(factor: FloatArray, b: FloatArray) -> FloatArray:
    """``A^-1 b`` from the lower factor of A."""
    return np.asarray(dpotrs(factor, b, lower=1)[0])


def _nonnegative(A: FloatArray, b: FloatArray) -> FloatArray:
    """Minimiser of ``c' A c / 2 - b' c`` for c >= 0."""
    size = np.sqrt(np.maximum(np.diag(A), _ROUNDING))
    L = _factor(A / np.outer(size, size))
    right = dtrtrs(L, b / size, lower=1)[0]
    return nnls(L.T, right, maxiter=30 * b.size)[0] / size
