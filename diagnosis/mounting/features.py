"""Flexible residual model of a mounting.

Powers, rates and hysteresis of the loads, at each channel alone.
"""

from itertools import product

import numpy as np

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.mounting.records import MountingRecord

#: Half widths of the plays, as shares of a load's largest value.
_PLAYS = (0.05, 0.2)


def flexible_features(record: MountingRecord) -> list[FloatArray]:
    """What any law of the loads could add, each row of shape (n, n_channels).

    Parameters
    ----------
    record : MountingRecord
        Its loads.

    Returns
    -------
    list of ndarray
        Constant, powers, rates, plays and products with the torque; once for every channel.
    """
    loads = np.column_stack([record.inputs.torque, record.inputs.ntl_y, record.inputs.ntl_z])
    sizes = np.maximum(np.abs(loads).max(axis=0), np.finfo(float).tiny)
    features = [np.ones(len(loads))]
    for x in (loads / sizes).T:
        features += [x, x**2, x**3, x**5, np.gradient(x), *(_play(x, width) for width in _PLAYS)]
    features += [loads[:, 0] / sizes[0] * (loads[:, k] / sizes[k]) for k in (1, 2)]
    n_channels, rows = record.measured.shape[1], []
    for feature, channel in product(features, range(n_channels)):
        row = np.zeros((len(loads), n_channels))
        row[:, channel] = feature
        rows.append(row)
    return rows


def _play(x: FloatArray, width: float) -> FloatArray:
    """Play operator of half width `width`: follows x where it pushes, rests between."""
    y, value = np.empty(x.size), 0.0
    for k, own in enumerate(x.tolist()):
        value = min(max(value, own - width), own + width)
        y[k] = value
    return y
