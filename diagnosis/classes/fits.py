"""Penalised least squares on products of columns, some coefficients at least zero."""

from collections.abc import Sequence
from dataclasses import dataclass

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


def products_of(gram: FloatArray, model: ClassModel) -> FloatArray:
    """Products of the target and a model's columns, from those of all columns of a table.

    Parameters
    ----------
    gram : ndarray, shape (..., n_table, n_table)
        Products of all columns of the table, the target first.
    model : ClassModel
        Columns.

    Returns
    -------
    ndarray, shape (..., 1 + n, 1 + n)
        The target first, then the model's columns in their order.
    """
    places = np.concatenate([[0], model.columns])
    return np.asarray(gram[..., places[:, None], places])


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
    n, free = np.flatnonzero(model.is_nonnegative), np.flatnonzero(~model.is_nonnegative)
    if not n.size:
        return _solved(_factor(A), b)
    if not free.size:
        return _nonnegative(A, b)
    # One copy of each part: rows first and columns then would copy twice.
    beside = A[free[:, None], n]
    factor = _factor(A[free[:, None], free])
    coupling = _solved(factor, beside)
    schur = A[n[:, None], n] - beside.T @ coupling
    right = b[n] - coupling.T @ b[free]
    found = np.empty(b.size)
    found[n] = _nonnegative(schur, right)
    found[free] = _solved(factor, b[free]) - coupling @ found[n]
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


def _factor(A: FloatArray) -> FloatArray:
    """Lower Cholesky factor; a rounding more on the diagonal where A is singular to rounding.

    LAPACK directly: a table is hundreds of small solves, of which checks take half of the time.
    """
    rounding = _ROUNDING * float(np.diag(A).max())
    for lift in (0.0, *(rounding * 100.0**k for k in range(7))):
        factor, failed = dpotrf(A + lift * np.eye(len(A)) if lift else A, lower=1)
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
