"""Signatures of the carrier effects for the screen.

Derivatives of the signals by every parameter, at the baseline.
"""

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.carrier.model import CarrierModel
from carrierflex.diagnosis.carrier.records.sums import CarrierSums
from carrierflex.diagnosis.carrier.signature_rows import (
    column_products,
    effect_rows,
    rows_at,
    segments_of,
)
from carrierflex.diagnosis.comparison.problem import Effects, FeatureBlocks, Signatures
from carrierflex.identification.campaign.campaign import Campaign

FloatArray = NDArray[np.float64]

#: Groups of segments whose products are kept apart: as many as the screen holds out in turn.
_GROUPS = 4


def carrier_signatures(
    model: CarrierModel,
    campaign: Campaign,
    records: CarrierSums,
    candidates: Effects,
    base: FloatArray,
) -> Signatures:
    """Gram matrix of target, baseline's regressors, signatures and the flexible model.

    Another pass over the records: the flexible features of every channel would more than double the
    sums by segment.

    Parameters
    ----------
    model : CarrierModel
        Weights.
    campaign : Campaign
        Records.
    records : CarrierSums
        Segments.
    candidates : tuple of str
        Effects beside the baseline.
    base : ndarray, shape (p,)
        Parameters of the fitted baseline, at which effects of a sensor are linearised.

    Returns
    -------
    Signatures
        Residual, baseline, effects by variant, and each channel's flexible features beside them.
    """
    rows = effect_rows(model, candidates, base)
    n_channels, n_features = len(campaign.channels), model.source.n_flexible
    n_groups = min(_GROUPS, len(records.segments))
    gram = np.zeros((n_groups, rows.size, rows.size))
    cross = np.zeros((n_groups, n_channels, rows.size, n_features))
    square = np.zeros((n_groups, n_channels, n_features, n_features))
    for run, channel, segment, block in segments_of(model, campaign, records):
        group = segment % _GROUPS
        numbers, weights = rows_at(rows.groups, run, channel, len(block.rows))
        columns, flexible, mixed = column_products(block, model.source.flexible_rows(block.inputs))
        rows_by_columns = weights @ columns
        gram[group][np.ix_(numbers, numbers)] += rows_by_columns @ weights.T
        cross[group, channel, numbers] += weights @ mixed
        square[group, channel] += flexible
    return Signatures(gram, rows.n_base, rows.owners, rows.variants, FeatureBlocks(cross, square))
