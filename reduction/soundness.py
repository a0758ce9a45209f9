"""Whether matrices that come from a file can be those of a body.

A file may be whole and hold no body: matrices that are not symmetric, masses below zero, another
mass than it states. Simulation and exports would use them without a word.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.reduction.rigid_body_checks import (
    geometric_rigid_modes,
    grounding,
    rigid_mass_properties,
)

#: Rounding of sums over finite elements, over the largest entry.
_SYMMETRIC = 1e-8
#: Eigenvalues of matrices scaled to unit diagonal: zero is met to this.
_NOT_NEGATIVE = -1e-6
#: Relative difference between the mass of M and the stated one; both are integrals over one mesh.
_SAME_MASS = 1e-3
#: Force against a rigid motion [m or rad] above which geometry does not tell the rigid motion.
_FREE = 1e-3
#: Matrices up to this size are asked for their eigenvalues: seconds.
_MOST_EIGENVALUES = 3000


def refuse_unsound(model: ReducedModel) -> None:
    """Refuse matrices that no elastic body has.

    Raises
    ------
    ValueError
        Where K, M or D is not symmetric, K or M has negative eigenvalues, the mass is not positive,
        or M moved as a rigid body has another one.
    """
    for problem in _problems(model):
        raise ValueError(problem)


def _problems(model: ReducedModel) -> Iterator[str]:
    for letter, matrix in (("K", model.K), ("M", model.M), ("D", model.D)):
        largest = np.abs(matrix).max(initial=0.0)
        asymmetry = np.abs(matrix - matrix.T).max(initial=0.0)
        if asymmetry > _SYMMETRIC * largest:
            yield (
                f"{letter} differs from its transpose by {asymmetry:.3g}, its largest entry is "
                f"{largest:.3g}; expected a symmetric matrix"
            )
    mass = model.mass_properties.mass
    if not mass > 0.0:
        yield f"mass_properties/mass is {mass:.6g} kg; expected a positive mass"
    for letter, matrix in (("K", model.K), ("M", model.M)):
        least = _least_eigenvalue(matrix)
        if least < _NOT_NEGATIVE:
            yield (
                f"{letter}, scaled to unit diagonal, has the eigenvalue {least:.3g}; expected none "
                "below zero"
            )
    if model.pilots and (model.K.diagonal() > 0.0).all() and grounding(model) < _FREE:
        R = geometric_rigid_modes(model)
        moved = rigid_mass_properties(R.T @ model.M @ R).mass
        if abs(moved / mass - 1.0) > _SAME_MASS:
            yield (
                f"M moved as a rigid body has the mass {moved:.6g} kg, mass_properties/mass is "
                f"{mass:.6g} kg; expected the same"
            )


def _least_eigenvalue(matrix: NDArray[np.float64]) -> float:
    """Least eigenvalue of a matrix scaled to unit diagonal; of large ones the least sign of it."""
    diagonal = matrix.diagonal()
    if matrix.size == 0:
        return 0.0
    if (diagonal < 0.0).any() or len(matrix) > _MOST_EIGENVALUES:
        return float(np.sign(diagonal).min())
    scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    return float(np.linalg.eigvalsh(matrix * np.outer(scale, scale))[0])
