"""Cholesky factorisation of sparse symmetric positive definite matrices.

A factor serves many right-hand sides.

Three libraries serve, the fastest that is installed first: MKL's PARDISO (x86-64), CHOLMOD through
kvxopt, and scipy's SuperLU, which is always there. They give the same numbers to rounding; which
one runs is logged once.
"""

import ctypes
import functools
import importlib.metadata
import logging
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numba
import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg
from numpy.typing import NDArray

log = logging.getLogger(__name__)

#: Smallest pivot over the largest below which a matrix counts as singular; rounding leaves about
#: 1e-16.
_SINGULAR = 1e-13
#: Right-hand sides that CHOLMOD is given together: sparse copies of them stay small.
_COLUMNS = 8
#: MKL's number for Intel's own OpenMP runtime, which stands beside it; the GNU one may clash with
#: other wheels'.
_INTEL_OPENMP = 0


class SingularMatrixError(ArithmeticError):
    """The matrix is not positive definite: the structure can move freely or is not connected."""


class Factorisation(Protocol):
    """A factorised matrix A of order n."""

    def solve(self, b: NDArray[np.float64]) -> NDArray[np.float64]:
        """Solve A x = b for b of shape (n,) or (n, k); same shape."""
        ...


def factorise(A: sp.csr_array, *, fixed: NDArray[np.int64] | None = None) -> Factorisation:
    """Factorise a symmetric positive definite matrix with the fastest library at hand.

    Parameters
    ----------
    A : csr_array, shape (n, n)
        Symmetric, both triangles stored; positive definite without the rows and columns `fixed`.
    fixed : ndarray of int, optional
        Degrees of freedom left out: whatever stands in their rows of b, their rows of the solution
        are zero.

    Returns
    -------
    Factorisation
        Its ``solve`` takes one or many right-hand sides of n rows.

    Raises
    ------
    SingularMatrixError
        Where A is not positive definite.
    """
    if fixed is None or not len(fixed):
        return _factoriser()(upper_triangle(A, np.zeros(0, dtype=np.int64)))
    return _Partition(_factoriser()(upper_triangle(A, fixed)), fixed)


@dataclass(frozen=True, eq=False)
class _Partition:
    """The factor of the free degrees of freedom.

    Those held stand beside them as equations of their own.
    """

    factor: Factorisation
    fixed: NDArray[np.int64]

    def solve(self, b: NDArray[np.float64]) -> NDArray[np.float64]:
        """Solution of ``A x = b`` with zero at the fixed coordinates."""
        right = b.copy(order="F")
        right[self.fixed] = 0.0
        return self.factor.solve(right)


@functools.cache
def _factoriser() -> Callable[[sp.csr_array], Factorisation]:
    if _mkl_library() is not None:
        log.info("sparse factorisation: MKL PARDISO")
        return _Pardiso
    try:
        import kvxopt.cholmod  # noqa: F401
    except ImportError:
        log.warning(
            "sparse factorisation: neither MKL nor kvxopt is installed; scipy's SuperLU is used "
            "(slower)"
        )
        return _SuperLU
    log.info("sparse factorisation: CHOLMOD (MKL is not installed)")
    return _Cholmod


def superlu_solution(A: sp.csr_array, b: NDArray[np.float64]) -> NDArray[np.float64]:
    """The solution of ``A x = b`` by scipy's SuperLU, whichever libraries are installed.

    Parameters
    ----------
    A : csr_array, shape (n, n)
        Symmetric positive definite, both triangles stored.
    b : ndarray, shape (n,) or (n, k)
        Right-hand sides.

    Returns
    -------
    ndarray, shape of `b`
        The solution.

    Raises
    ------
    SingularMatrixError
        Where A is not positive definite.
    """
    return _SuperLU(upper_triangle(A, np.zeros(0, dtype=np.int64))).solve(b)


class _SuperLU:
    def __init__(self, upper: sp.csr_array) -> None:
        A = upper + sp.triu(upper, 1).T
        try:
            self._lu = scipy.sparse.linalg.splu(
                sp.csc_array(A),
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
        except RuntimeError as error:
            raise SingularMatrixError(_not_definite(A.shape[0], "SuperLU", error)) from error
        _refuse_small_pivots(self._lu.U.diagonal(), "SuperLU")

    def solve(self, b: NDArray[np.float64]) -> NDArray[np.float64]:
        """Solution of ``A x = b``."""
        return self._lu.solve(np.ascontiguousarray(b))


class _Cholmod:
    def __init__(self, upper: sp.csr_array) -> None:
        from kvxopt import cholmod, matrix, spmatrix

        A = sp.coo_array(upper)
        sparse = spmatrix(matrix(A.data), matrix(A.col), matrix(A.row), size=A.shape)
        self._factor = cholmod.symbolic(sparse)
        try:
            cholmod.numeric(sparse, self._factor)
            root = np.array(cholmod.diag(self._factor)).ravel()
        except (ArithmeticError, ValueError) as error:
            raise SingularMatrixError(_not_definite(A.shape[0], "CHOLMOD", error)) from error
        _refuse_small_pivots(root * np.abs(root), "CHOLMOD")

    def solve(self, b: NDArray[np.float64]) -> NDArray[np.float64]:
        """Solution of ``A x = b``."""
        from kvxopt import cholmod, matrix, sparse

        right = np.asfortranarray(b.reshape(len(b), -1))
        x = np.empty_like(right, order="F")
        # Its solve for dense sides takes one column at a time, that for sparse ones four.
        for first in range(0, right.shape[1], _COLUMNS):
            columns = slice(first, first + _COLUMNS)
            answer = cholmod.spsolve(self._factor, sparse(matrix(right[:, columns])))
            x[:, columns] = np.array(matrix(answer))
        return x.reshape(b.shape)


def _refuse_small_pivots(pivots: NDArray[np.float64], library: str) -> None:
    """Raise where a pivot is negative or only rounding keeps it from zero.

    The measure is its size beside the largest pivot.
    """
    if not pivots.min() > _SINGULAR * pivots.max():
        raise SingularMatrixError(
            _not_definite(len(pivots), library, f"smallest pivot {pivots.min():.1e}")
        )


def _not_definite(order: int, library: str, cause: object) -> str:
    return (
        f"the matrix of order {order} is not positive definite ({library}: {cause}); "
        "expected a structure without rigid motion and without detached bodies"
    )


class _Pardiso:
    """MKL's PARDISO called through ctypes.

    Upper triangle, METIS order, no refinement, all right-hand sides at once.
    """

    _REAL_SPD = 2

    def __init__(self, upper: sp.csr_array) -> None:
        self._n = upper.shape[0]
        self._values = np.ascontiguousarray(upper.data, dtype=np.float64)
        self._rows = np.ascontiguousarray(upper.indptr, dtype=np.int32)
        self._columns = np.ascontiguousarray(upper.indices, dtype=np.int32)
        self._handle = np.zeros(64, dtype=np.int64)
        self._iparm = np.zeros(64, dtype=np.int32)
        # 1 no defaults; 2 METIS; 8 no iterative refinement; 24 two-level parallel factorisation; 35
        # zero-based.
        for index, value in ((1, 1), (2, 2), (8, 0), (24, 1), (35, 1)):
            self._iparm[index - 1] = value
        empty = np.zeros(1)
        error = self._call(12, empty, empty, 1)
        if error:
            self._release()
            raise SingularMatrixError(_not_definite(self._n, "PARDISO", f"error {error}"))

    def solve(self, b: NDArray[np.float64]) -> NDArray[np.float64]:
        """Solution of ``A x = b``."""
        right = np.asfortranarray(b, dtype=np.float64)
        x = np.empty_like(right, order="F")
        error = self._call(33, right, x, 1 if b.ndim == 1 else b.shape[1])
        if error:
            raise ArithmeticError(f"PARDISO could not solve: error {error}")
        return x

    def _call(
        self, phase: int, b: NDArray[np.float64], x: NDArray[np.float64], n_right: int
    ) -> int:
        library = _mkl_library()
        assert library is not None

        def integer(value: int) -> Any:
            return ctypes.byref(ctypes.c_int32(value))

        error = ctypes.c_int32(0)
        library.pardiso(
            self._handle.ctypes.data_as(ctypes.c_void_p),
            integer(1), integer(1), integer(self._REAL_SPD), integer(phase), integer(self._n),
            self._values.ctypes.data_as(ctypes.c_void_p),
            self._rows.ctypes.data_as(ctypes.c_void_p),
            self._columns.ctypes.data_as(ctypes.c_void_p),
            integer(0), integer(n_right),
            self._iparm.ctypes.data_as(ctypes.c_void_p), integer(0),
            b.ctypes.data_as(ctypes.c_void_p), x.ctypes.data_as(ctypes.c_void_p),
            ctypes.byref(error),
        )  # fmt: skip
        return error.value

    def _release(self) -> None:
        empty = np.zeros(1)
        self._call(-1, empty, empty, 1)

    def __del__(self) -> None:
        # While the interpreter shuts down ctypes is half gone; the memory goes with the process.
        if (
            not sys.is_finalizing()
            and getattr(self, "_handle", None) is not None
            and self._handle.any()
        ):
            self._release()


@functools.cache
def _mkl_library() -> ctypes.CDLL | None:
    """MKL's single dynamic library from the `mkl` package, or None where it is not installed."""
    file = _packaged_library("mkl", "libmkl_rt.so")
    if file is None:
        return None
    try:
        library = ctypes.CDLL(str(file), mode=ctypes.RTLD_GLOBAL)
    except OSError as error:
        log.warning("MKL is installed but does not load (%s)", error)
        return None
    library.MKL_Set_Threading_Layer(_INTEL_OPENMP)
    threads = _packaged_library("intel-openmp", "libiomp5.so")
    if threads is not None:
        # Its threads would spin for 0.2 s after every solve, on the cores that the work between two
        # solves needs.
        ctypes.CDLL(str(threads)).kmp_set_blocktime(0)
    return library


def _packaged_library(package: str, name: str) -> Path | None:
    """File of a shared library that a Python package brings along, or None."""
    try:
        files = importlib.metadata.files(package) or []
    except importlib.metadata.PackageNotFoundError:
        return None
    return next(
        (Path(str(file.locate())).resolve() for file in files if file.name.startswith(name)), None
    )


def upper_triangle(A: sp.csr_array, fixed: NDArray[np.int64]) -> sp.csr_array:
    """Upper triangle of a symmetric matrix without the rows and columns `fixed`.

    Of those, the diagonal entry alone stays.

    Parameters
    ----------
    A : csr_array, shape (n, n)
        Symmetric, both triangles stored.
    fixed : ndarray of int
        Degrees of freedom that the others shall not see.

    Returns
    -------
    csr_array, shape (n, n)
        Sorted, with a diagonal entry in every row, be it zero: one pass over A, no other copy of
        it.
    """
    A = A if A.has_sorted_indices else A.sorted_indices()
    is_fixed = np.zeros(A.shape[0], dtype=np.bool_)
    is_fixed[fixed] = True
    indptr = _row_starts(A.indptr, A.indices, is_fixed)
    indices, data = np.empty(indptr[-1], dtype=np.int32), np.empty(indptr[-1])
    _fill(A.indptr, A.indices, A.data, is_fixed, indptr, indices, data)
    upper = sp.csr_array((data, indices, indptr), shape=A.shape)
    upper.has_sorted_indices = True
    return upper


@numba.njit(cache=True)
def _row_starts(
    indptr: NDArray[np.int32], indices: NDArray[np.int32], fixed: NDArray[np.bool_]
) -> NDArray[np.int32]:
    starts = np.zeros(len(indptr), dtype=np.int32)
    for row in range(len(fixed)):
        count = 1
        for entry in range(indptr[row], indptr[row + 1]):
            column = indices[entry]
            if column > row and not fixed[row] and not fixed[column]:
                count += 1
        starts[row + 1] = starts[row] + count
    return starts


@numba.njit(cache=True)
def _fill(
    indptr: NDArray[np.int32],
    indices: NDArray[np.int32],
    values: NDArray[np.float64],
    fixed: NDArray[np.bool_],
    starts: NDArray[np.int32],
    columns: NDArray[np.int32],
    data: NDArray[np.float64],
) -> None:
    for row in range(len(fixed)):
        here = starts[row]
        columns[here], data[here] = row, 0.0
        for entry in range(indptr[row], indptr[row + 1]):
            column = indices[entry]
            if column == row:
                data[starts[row]] += values[entry]
            elif column > row and not fixed[row] and not fixed[column]:
                here += 1
                columns[here], data[here] = column, values[entry]
