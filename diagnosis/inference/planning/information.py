"""How large a cause must be to be seen, and what another cause leaves of its signal.

With P the products of the signatures beside the baseline over the noise's variance, amplitudes u of
cause a leave a signal of energy ``u' P_aa u``, and the refitted cause b leaves of it

    E_ab(u) = u' (P_aa - P_ab P_bb^+ P_ba) u,

the squared Mahalanobis distance between both causes. Its root over that of the number of samples is
an RMS in floors of noise, the measure of the diagnosis's own rules.
"""

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.inference.planning.table import MeasuredGram, Signature
from carrierflex.diagnosis.inference.thresholds import Thresholds

FloatArray = NDArray[np.float64]

#: Directions of a signature that the baseline leaves less of than this share of the clearest are
#: not seen, and say nothing of what another cause makes of them.
_UNSEEN = 1e-6
#: Standard deviations that 97.5 % of a normal distribution lie above, as the diagnosis asks of the
#: draws in which an effect must shrink the gap.
_DEVIATIONS = 1.96
#: Parts of the record of which one at a time is held out: as many as the conditions of a short
#: campaign.
_FOLDS = 4


def visible_multiple(n_parameters: int) -> float:
    """Root of the energy from which a cause with so many amplitudes shrinks the held-out gap.

    Of K folds each is predicted by amplitudes from the others: held out, a signal of energy E
    gains ``E - q K / (K - 1)`` noise variances, with a variance of ``4 E + 2 q``. The diagnosis
    asks for a gain in 97.5 % of its draws, so that the energy n² solves

        n² - q K / (K - 1) = 1.96 sqrt(4 n² + 2 q).

    Parameters
    ----------
    n_parameters : int
        Amplitudes q that are fitted.

    Returns
    -------
    float
        n; 4.3 for one amplitude.

    Examples
    --------
    >>> [round(visible_multiple(q), 1) for q in (1, 2, 14)]
    [4.3, 4.6, 6.9]
    """
    lost = n_parameters * _FOLDS / (_FOLDS - 1.0)
    # E² - (2 lost + 4 z²) E + lost² - 2 q z² = 0; the larger root has a positive gain.
    half = lost + 2.0 * _DEVIATIONS**2
    constant = lost**2 - 2.0 * n_parameters * _DEVIATIONS**2
    return float(np.sqrt(half + np.sqrt(half**2 - constant)))


def named_gap(thresholds: Thresholds) -> float:
    """RMS of the gap, in floors, below which the diagnosis calls records at the noise floor."""
    return float(np.sqrt(thresholds.floor_ratio - 1.0))


def seen_directions(measured: MeasuredGram, signature: Signature) -> FloatArray:
    """Amplitudes that leave one noise variance each, at right angles to each other.

    Parameters
    ----------
    measured : MeasuredGram
        Campaign.
    signature : Signature
        Effect.

    Returns
    -------
    ndarray, shape (m, k)
        Directions U with ``U P U' = 1``; none where the baseline leaves nothing.
    """
    own = list(signature.columns)
    values, vectors = np.linalg.eigh(measured.projected[np.ix_(own, own)])
    floor = _UNSEEN * max(float(measured.square[own].max()), np.finfo(float).tiny)
    keep = values > max(_UNSEEN * values.max(), floor)
    return np.asarray((vectors[:, keep] / np.sqrt(values[keep])).T)


def left_by(measured: MeasuredGram, cause: Signature, rivals: tuple[Signature, ...]) -> FloatArray:
    """Products of what the rival's best-fitting variant leaves of a cause, one matrix a variant.

    Parameters
    ----------
    measured : MeasuredGram
        Campaign.
    cause : Signature
        Cause with k columns.
    rivals : tuple of Signature
        Variants of one rival.

    Returns
    -------
    ndarray, shape (n_variants, k, k)
        ``P_aa - P_ab P_bb^+ P_ba``.
    """
    own, projected = list(cause.columns), measured.projected
    left = []
    for rival in rivals:
        columns = list(rival.columns)
        length = np.sqrt(np.maximum(measured.square[columns], np.finfo(float).tiny))
        gram = projected[np.ix_(columns, columns)] / np.outer(length, length)
        mixed = projected[np.ix_(own, columns)] / length
        inverse = np.linalg.pinv(gram, rcond=_UNSEEN, hermitian=True)
        left.append(projected[np.ix_(own, own)] - mixed @ inverse @ mixed.T)
    return np.array(left)


def left_energy(
    measured: MeasuredGram, cause: Signature, amplitudes: FloatArray, rivals: tuple[Signature, ...]
) -> float:
    """Energy that a refitted rival leaves of given amplitudes, its best variant taken.

    Parameters
    ----------
    measured : MeasuredGram
        Campaign.
    cause : Signature
        Cause.
    amplitudes : ndarray, shape (k,)
        Its amplitudes.
    rivals : tuple of Signature
        Variants of the rival.
    """
    left = left_by(measured, cause, rivals)
    return max(0.0, float(np.einsum("i,vij,j->v", amplitudes, left, amplitudes).min()))


def least_left_energy(
    measured: MeasuredGram,
    cause: Signature,
    directions: FloatArray,
    rivals: tuple[Signature, ...],
) -> float:
    """Energy that a refitted rival leaves of the amplitudes it imitates best.

    ``min over |c| = 1 of E_ab(c' U)`` with U the directions: at directions of one noise variance
    each it is the squared sine of the smallest angle between both signatures.

    Parameters
    ----------
    measured : MeasuredGram
        Campaign.
    cause : Signature
        Cause.
    directions : ndarray, shape (m, k)
        Amplitudes of unit energy.
    rivals : tuple of Signature
        Variants of the rival.
    """
    if directions.size == 0:
        return 0.0
    left = directions @ left_by(measured, cause, rivals) @ directions.T
    return max(0.0, float(np.linalg.eigvalsh(left)[:, 0].min()))
