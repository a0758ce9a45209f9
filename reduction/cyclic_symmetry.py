"""How far a reduced body is from the symmetry of its part.

Reduced matrices under the rotation by the pins' pitch.
"""

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from carrierflex.geometry.dihedral import rotation_about_x
from carrierflex.geometry.pins import planets_of
from carrierflex.reduction.dynamic_stiffness import LOSS_FACTOR
from carrierflex.reduction.reduced_model import ReducedModel

#: Distance [m] within which a rotated pilot counts as lying on another.
_SAME_POINT = 1e-6
#: Squared modal frequency over the highest below which a modal coordinate is a rigid motion.
_RIGID = 1e-12
#: Growth rates at which the modal part is compared.
_N_SIGMA = 8


def pilot_rotation(model: ReducedModel) -> NDArray[np.float64] | None:
    """Permutation and rotation of the pilots' coordinates under the rotation by a pitch about x.

    None where the pilots do not map, or have fewer than six components.

    Returns
    -------
    ndarray, shape (6 p, 6 p), or None
        Q such that a motion q of the body, turned by the pins' pitch, is Q q.
    """
    if model.pilot_components:
        return None
    R = rotation_about_x(2.0 * np.pi / planets_of(model.pilots))
    names = list(model.pilots)
    points = np.array([model.pilots[name] for name in names])
    Q = np.zeros((6 * len(names), 6 * len(names)))
    for i, point in enumerate(points):
        distance = np.linalg.norm(points - R @ point, axis=1)
        j = int(distance.argmin())
        if distance[j] > _SAME_POINT:
            return None
        for first in (0, 3):
            Q[6 * j + first : 6 * j + first + 3, 6 * i + first : 6 * i + first + 3] = R
    return Q


def asymmetry_ppm(model: ReducedModel) -> float | None:
    """Largest change of the pilots' static stiffness and mass under the rotation.

    In parts per million.

    Every entry is compared over the geometric mean of its two diagonal entries. None where the
    pilots do not map onto one another.
    """
    Q = pilot_rotation(model)
    if Q is None:
        return None
    rows = model.pilot_rows
    return max(_change_ppm(matrix[np.ix_(rows, rows)], Q) for matrix in (model.K, model.M))


def modal_asymmetry_ppm(model: ReducedModel) -> float | None:
    """Largest change under the rotation of what the modes add to the pilots' dynamics.

    In parts per million. How the modes follow the rotation is not known, but what they do to the
    pilots is: with ``Z(σ) = K + σ M``, positive definite where the body grows as ``exp(√σ t)``
    instead of vibrating, the pilots' ``Z_bb - Z_bq Z_qq⁻¹ Z_qb`` of a symmetric body does not
    change. Half of a degenerate pair among the modes changes it.

    Returns
    -------
    float or None
        Largest of σ = ω² from the lowest to the highest modal frequency; entries compared as in
        :func:`asymmetry_ppm`. None where the pilots do not map onto one another or there are no
        modes.
    """
    Q, b = pilot_rotation(model), model.pilot_rows
    q = np.setdiff1d(np.arange(model.n_coordinates), b)
    if Q is None or not len(q):
        return None
    omega_squared = scipy.linalg.eigh(
        model.K[np.ix_(q, q)], model.M[np.ix_(q, q)], eigvals_only=True
    )
    elastic = omega_squared[omega_squared > _RIGID * omega_squared[-1]]
    largest = 0.0
    for sigma in np.geomspace(elastic[0], elastic[-1], _N_SIGMA):
        Z = model.K + sigma * model.M
        modal_flexibility = Z[np.ix_(b, q)] @ np.linalg.solve(Z[np.ix_(q, q)], Z[np.ix_(q, b)])
        largest = max(largest, _change_ppm(Z[np.ix_(b, b)] - modal_flexibility, Q))
    return largest


def unlike_response(model: ReducedModel, frequency_hz: float) -> float | None:
    """How unlike pilots answer that the rotation maps onto one another, up to a frequency.

    Receptance of each pilot to its own forces and moments, with hysteretic damping, beside that of
    its image: ``|W (R H_ii Rᵀ - H_jj) W| / |W H_jj W|`` in Frobenius norms, W the square root of
    the static stiffness, over the pilots and 20 frequencies.

    Returns
    -------
    float or None
        Largest of them; None where the pilots do not map onto one another.
    """
    Q, b = pilot_rotation(model), model.pilot_rows
    if Q is None:
        return None
    W = np.sqrt(model.K.diagonal()[b])
    largest = 0.0
    for omega in 2.0 * np.pi * np.linspace(0.05, 1.0, 20) * frequency_hz:
        Z = (1.0 + 1j * LOSS_FACTOR) * model.K - omega**2 * model.M
        scale = 1.0 / np.sqrt(model.K.diagonal() + omega**2 * model.M.diagonal())
        H = (np.linalg.inv(Z * np.outer(scale, scale)) * np.outer(scale, scale))[np.ix_(b, b)]
        difference, expected = (Q @ H @ Q.T - H) * np.outer(W, W), H * np.outer(W, W)
        for first in range(0, len(b), 6):
            block = np.s_[first : first + 6, first : first + 6]
            share = np.linalg.norm(difference[block]) / np.linalg.norm(expected[block])
            largest = max(largest, float(share))
    return largest


def _change_ppm(A: NDArray[np.float64], Q: NDArray[np.float64]) -> float:
    scale = np.sqrt(np.outer(np.abs(A.diagonal()), np.abs(A.diagonal())))
    # The only pilot of a free body has no stiffness to compare with.
    change = np.divide(np.abs(Q @ A @ Q.T - A), scale, out=np.zeros_like(A), where=scale > 0.0)
    return 1e6 * float(change.max())
