"""All modes of small dense matrices, also where some coordinates have stiffness and no mass."""

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

#: Shift of the stiffness by mass, over the ratio of their largest entries: it makes motions without
#: stiffness definite and is subtracted again.
_SHIFT = 1e-6
#: Eigenvalue of the mass, over the largest, below which a mode has none.
_MASSLESS = 1e-12


def dense_modes(
    K: NDArray[np.float64], M: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Modes of ``K q = ω² M q``, mass-normalised.

    Parameters
    ----------
    K, M : ndarray, shape (n, n)
        Stiffness and mass, symmetric, not negative; no motion without both.

    Returns
    -------
    omega_squared : ndarray, shape (k,)
        Squared angular frequencies [1/s^2], ascending; about zero for rigid motions. Fewer than n
        where coordinates have no mass.
    q : ndarray, shape (n, k)
        Modes with ``qᵀ M q = I``.
    """
    size = M.diagonal()
    if (size > 0.0).all():
        # Frequencies do not matter to all callers, accuracy does: coordinates are scaled to unit
        # mass before the eigenvalue problem.
        scale = 1.0 / np.sqrt(size)
        try:
            omega_squared, q = scipy.linalg.eigh(
                K * np.outer(scale, scale), M * np.outer(scale, scale)
            )
            return omega_squared, scale[:, None] * q
        except scipy.linalg.LinAlgError:
            # Not definite: some combination has no mass.
            pass
    shift = _SHIFT * K.diagonal().max() / size.max()
    definite = K + shift * M
    scale = 1.0 / np.sqrt(definite.diagonal())
    theta, q = scipy.linalg.eigh(M * np.outer(scale, scale), definite * np.outer(scale, scale))
    massive = np.flatnonzero(theta > _MASSLESS * theta[-1])[::-1]
    return 1.0 / theta[massive] - shift, scale[:, None] * q[:, massive] / np.sqrt(theta[massive])
