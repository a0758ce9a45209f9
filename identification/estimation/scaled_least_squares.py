"""Linear least squares in columns of unit length, with one tolerance for what the data determine.

Columns of a design differ by many powers of ten (a mass beside a stiffness beside a cubic
stiffness), so that a tolerance means the same for all only where the columns are scaled first.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

Array = NDArray[np.float64]

#: A direction whose singular value is below this share of the largest, columns of unit length, is
#: not determined: a condition number of 1e5 of the design, beyond which its normal equations keep
#: fewer than six digits.
DEPENDENT = 1e-10
#: Square of the share of such a direction from which an unknown is not determined either.
_SHARE_OF_DIRECTION = 1e-3


def column_lengths(gram: Array) -> Array:
    """Lengths of the columns behind a Gram matrix, shape (n,); one for a column of zeros.

    Parameters
    ----------
    gram : ndarray, shape (n, n)
        Products of the columns.

    Returns
    -------
    ndarray
        ``sqrt(diag(gram))``; a column of zeros stays one when it is scaled, and is not determined.
    """
    square = np.diag(gram)
    return np.sqrt(np.where(square > 0.0, square, 1.0))


def normal_solution(gram: Array, right: Array, *, ridge: float = 0.0) -> Array:
    """Minimum-norm solution of ``gram x = right`` in columns of unit length.

    Parameters
    ----------
    gram : ndarray, shape (n, n)
        ``A.T A`` of a design A.
    right : ndarray, shape (n,)
        ``A.T b``.
    ridge : float
        Share of every column's square that is added to the diagonal.

    Returns
    -------
    ndarray, shape (n,)
        x; zero along directions that the data do not determine (:data:`DEPENDENT`).
    """
    length = column_lengths(gram)
    scaled = gram / np.outer(length, length) + ridge * np.eye(length.size)
    solution = np.linalg.lstsq(scaled, right / length, rcond=DEPENDENT)[0]
    return np.asarray(solution / length)


def bounded_solution(gram: Array, right: Array, lower: Array, upper: Array) -> Array:
    """Solution of ``gram x = right`` within bounds, in columns of unit length.

    Parameters
    ----------
    gram : ndarray, shape (n, n)
        ``A.T A`` of a design A.
    right : ndarray, shape (n,)
        ``A.T b``.
    lower, upper : ndarray, shape (n,)
        Bounds, infinite where there is none.

    Returns
    -------
    ndarray, shape (n,)
        x of the least ``|A x - b|`` within the bounds.
    """
    free = normal_solution(gram, right)
    if np.all((free >= lower) & (free <= upper)):
        return free
    length = column_lengths(gram)
    values, vectors = np.linalg.eigh(gram / np.outer(length, length))
    root = np.sqrt(np.maximum(values, DEPENDENT * values[-1]))
    bounds = (lower * length, upper * length)
    rows, target = root[:, None] * vectors.T, vectors.T @ (right / length) / root
    return np.asarray(lsq_linear(rows, target, bounds).x / length)


def normal_inverse(gram: Array) -> Array:
    """Pseudo-inverse of a Gram matrix in columns of unit length, shape (n, n).

    Parameters
    ----------
    gram : ndarray, shape (n, n)
        ``A.T A`` of a design A.

    Returns
    -------
    ndarray
        Zero along directions that the data do not determine (:data:`DEPENDENT`).
    """
    length = column_lengths(gram)
    outer = np.outer(length, length)
    return np.asarray(np.linalg.pinv(gram / outer, rcond=DEPENDENT, hermitian=True) / outer)


def is_undetermined(gram: Array) -> NDArray[np.bool_]:
    """Which unknowns have a share in a direction that the data do not determine, shape (n,).

    Parameters
    ----------
    gram : ndarray, shape (n, n)
        ``A.T A`` of a design A.
    """
    length = column_lengths(gram)
    values, directions = np.linalg.eigh(gram / np.outer(length, length))
    still = directions[:, values < DEPENDENT * values.max(initial=0.0)]
    return np.asarray(np.square(still).sum(axis=1) > _SHARE_OF_DIRECTION)


def full_inverse(gram: Array) -> Array:
    """Inverse of a Gram matrix with every direction in it, shape (n, n).

    Parameters
    ----------
    gram : ndarray, shape (n, n)
        ``A.T A`` of a design A.

    Returns
    -------
    ndarray
        Where :func:`normal_inverse` is zero along a direction that the data do not determine, this
        one is as large as that direction is free; a direction that is singular to rounding is as
        free as rounding tells.
    """
    length = column_lengths(gram)
    outer = np.outer(length, length)
    squares, directions = np.linalg.eigh(gram / outer)
    least = length.size * np.finfo(np.float64).eps * squares[-1]
    return np.asarray((directions / np.maximum(squares, least)) @ directions.T / outer)


def design_solution(design: Array, target: Array) -> Array:
    """Minimum-norm least-squares solution of ``design x = target`` in columns of unit length.

    Keeps twice the digits of :func:`normal_solution`, where the design itself is at hand.

    Parameters
    ----------
    design : ndarray, shape (n_samples, n)
        Columns; also the square matrix of an instrumental-variable estimate.
    target : ndarray, shape (n_samples,)
        What they explain.

    Returns
    -------
    ndarray, shape (n,)
        x; zero for a column of zeros and along directions that the data do not determine.
    """
    length = np.linalg.norm(design, axis=0)
    length = np.where(length > 0.0, length, 1.0)
    solution = np.linalg.lstsq(design / length, target, rcond=DEPENDENT)[0]
    return np.asarray(solution / length)
