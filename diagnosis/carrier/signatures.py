"""Signatures of the carrier effects for the screen.

Derivatives of the signals by every parameter, at the baseline.
"""

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.carrier.cards import ONE_CHANNEL
from carrierflex.diagnosis.carrier.columns import CEILING_COLUMN
from carrierflex.diagnosis.carrier.model import CarrierModel
from carrierflex.diagnosis.carrier.sums import CarrierSums
from carrierflex.diagnosis.comparison.problem import BLACK_BOX, Effects, Signatures

FloatArray = NDArray[np.float64]


def carrier_signatures(
    model: CarrierModel, records: CarrierSums, candidates: Effects, base: FloatArray
) -> Signatures:
    """Gram matrix of target, baseline's regressors, signatures and the flexible model by piece.

    Parameters
    ----------
    model : CarrierModel
        Weights.
    records : CarrierSums
        Products of the columns.
    candidates : tuple of str
        Effects beside the baseline.
    base : ndarray, shape (p,)
        Parameters of the fitted baseline, at which effects of a sensor are linearised.

    Returns
    -------
    Signatures
        Residual, baseline, effects by variant, then each channel's flexible features.
    """
    contained_choice = {own: 0 for own in model.contained if own in ONE_CHANNEL}
    W, D = model.weights((), contained_choice, base)
    # The target less the parts that are no parameter's: another simulator's prediction.
    target = -(W - np.einsum("rcpk,p->rck", D, base))
    target[..., 0] += 1.0
    rows, owners, variants = [target[:, :, None], D], [], []
    for effect in candidates:
        for variant in model.variants(effect):
            slopes = _slopes(model, effect, variant, base, contained_choice)
            rows.append(slopes)
            owners += [effect] * slopes.shape[2]
            variants += [variant] * slopes.shape[2]
    table = np.concatenate(rows, axis=2)
    features = records.book.of_owner(CEILING_COLUMN)
    n_channels = len(model.channels)
    gram = np.array(
        [
            _piece_gram(table[r], own, features)
            for r, own in zip(records.run_of_segment, records.gram, strict=True)
        ]
    )
    n_ceiling = n_channels * len(features)
    owners += [BLACK_BOX] * n_ceiling
    variants += [()] * n_ceiling
    return Signatures(gram, D.shape[2], tuple(owners), tuple(variants))


def _slopes(
    model: CarrierModel,
    effect: str,
    variant: tuple[float, ...],
    base: FloatArray,
    contained: dict[str, int],
) -> FloatArray:
    """Derivatives of the signals by an effect's amplitudes, shape (n_runs, n_channels, n_amplitudes, k)."""
    choice = {**contained, **({effect: int(variant[0])} if effect in ONE_CHANNEL else {})}
    own = [p for p in model.parameters((effect,), choice)[base.size :]]
    value = [variant[0] if p.shape else 0.0 for p in own]
    _, D = model.weights((effect,), choice, np.concatenate([base, value]))
    amplitudes = [base.size + k for k, p in enumerate(own) if not p.shape]
    return D[:, :, amplitudes]


def _piece_gram(table: FloatArray, gram: FloatArray, features: list[int]) -> FloatArray:
    """Products of the rows of one piece, the flexible features of every channel after them."""
    n_channels, n_rows, _ = table.shape
    size = n_rows + n_channels * len(features)
    result = np.zeros((size, size))
    for c in range(n_channels):
        products = table[c] @ gram[c]
        result[:n_rows, :n_rows] += products @ table[c].T
        place = slice(n_rows + c * len(features), n_rows + (c + 1) * len(features))
        result[:n_rows, place] = products[:, features]
        result[place, :n_rows] = products[:, features].T
        result[place, place] = gram[c][np.ix_(features, features)]
    return result
