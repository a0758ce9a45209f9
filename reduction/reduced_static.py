"""Static answer of a reduced body held at some pilots."""

from collections.abc import Mapping, Sequence

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from carrierflex.reduction.reduced_model import ReducedModel

#: Pivot of a stiffness scaled to unit diagonal below which a motion counts as free: rounding leaves
#: about 1e-15.
_SINGULAR = 1e-13


def static_coordinates(
    model: ReducedModel, fixed_pilots: Sequence[str], loads: Mapping[str, NDArray[np.float64]]
) -> NDArray[np.float64]:
    """Coordinates q of K q = f with all six coordinates of `fixed_pilots` zero.

    Parameters
    ----------
    model : ReducedModel
        Body or assembly.
    fixed_pilots : sequence of str
        Pilots that do not move.
    loads : mapping of str to ndarray, shape (6,)
        Force [N] and moment [N m] at pilots that have all six coordinates.

    Returns
    -------
    ndarray, shape (n,)
        Reduced coordinates.

    Raises
    ------
    KeyError
        Where a pilot does not exist.
    LinAlgError
        Where the held pilots leave the body free to move.
    """
    f = load_vector(model, loads)
    fixed = np.concatenate(
        [np.zeros(0, dtype=np.int64), *(model.rows_of(pilot) for pilot in fixed_pilots)]
    )
    return constrained_solution(model, fixed, f, f"holding {', '.join(fixed_pilots)}")


def load_vector(
    model: ReducedModel, loads: Mapping[str, NDArray[np.float64]]
) -> NDArray[np.float64]:
    """Right-hand side f of loads at pilots, shape (n,); arguments as of static_coordinates."""
    f = np.zeros(model.n_coordinates)
    for pilot, load in loads.items():
        # Tied pilots share rows: add, never assign.
        np.add.at(f, model.coordinates_of(pilot), load)
    return f


def constrained_solution(
    model: ReducedModel, fixed: NDArray[np.int64], f: NDArray[np.float64], holding: str
) -> NDArray[np.float64]:
    """Coordinates q of K q = f, shape (n,) or (n, k), with single coordinates held at zero.

    Parameters
    ----------
    model : ReducedModel
        Body or assembly.
    fixed : ndarray of int
        Coordinates held at zero; an axial, radial or rotational support holds some of a pilot's
        six.
    f : ndarray, shape (n,) or (n, k)
        Right-hand sides [N, N m].
    holding : str
        What is held, in words, for the message of an error.

    Raises
    ------
    LinAlgError
        Where they leave the body free to move.
    """
    free = np.setdiff1d(np.arange(model.n_coordinates), fixed)
    q = np.zeros_like(f, dtype=np.float64)
    # Coordinates are translations, rotations and modal amplitudes: scale each to unit stiffness
    # before factorising.
    scale = 1.0 / np.sqrt(model.K.diagonal()[free])
    K = model.K[np.ix_(free, free)] * np.outer(scale, scale)
    column = scale.reshape(-1, *[1] * (f.ndim - 1))
    q[free] = column * scipy.linalg.cho_solve(_factor(K, model.name, holding), column * f[free])
    return q


def _factor(K: NDArray[np.float64], name: str, holding: str) -> tuple[NDArray[np.float64], bool]:
    """Cholesky factor of a stiffness with unit diagonal.

    Refused where a motion meets no more than rounding.
    """
    try:
        factor = scipy.linalg.cho_factor(K)
    except scipy.linalg.LinAlgError:
        smallest = 0.0
    else:
        smallest = float(factor[0].diagonal().min()) ** 2
    if not smallest > _SINGULAR:
        raise scipy.linalg.LinAlgError(
            f"{name}: {holding} does not fix every motion; expected a stiffness for each"
        )
    return factor


def pilot_compliance(model: ReducedModel, fixed_pilots: Sequence[str]) -> NDArray[np.float64]:
    """Static compliance of all pilot coordinates not held.

    Inverse stiffness with the modal coordinates free.

    Returns
    -------
    ndarray, shape (m, m)
        Pilots in the model's order, six rows each, without the held ones.
    """
    none = np.zeros(0, dtype=np.int64)
    rows, fixed = (
        np.concatenate(
            [none, *(model.rows_of(p) for p in model.pilots if (p in fixed_pilots) == is_held)]
        )
        for is_held in (False, True)
    )
    unit = np.zeros((model.n_coordinates, len(rows)))
    unit[rows, np.arange(len(rows))] = 1.0
    compliance = constrained_solution(model, fixed, unit, f"holding {', '.join(fixed_pilots)}")
    return compliance[rows]
