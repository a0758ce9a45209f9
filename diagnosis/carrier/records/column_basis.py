"""Columns of one sensor that all its columns are combinations of.

A tilt of the housing, its column at a sensor moved by 3 deg and an offset are one constant: of some
180 columns of a sensor fewer than half are different, in every run alike.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.carrier.records.columns import ColumnSource
from carrierflex.diagnosis.carrier.records.run_columns import some_samples
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.records import Run

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Part of a column of unit length that must lie off the others for it to be one of its own: those
#: that stand far off first, so that the weights of the rest are small. What is a combination misses
#: by rounding, 1e-13.
_OFF_THE_OTHERS = (1e-2, 1e-4, 1e-6, 1e-8)
#: Weights, columns of unit length, that are rounding.
_ROUNDING = 1e-11
#: Largest miss of a combination, over the largest value of its column in all runs.
_LARGEST_MISS = 1e-10
#: Samples at which the columns are compared, over all runs, and fewest of a run.
_SAMPLES = 2000
_FEWEST = 12


@dataclass(frozen=True, eq=False)
class ColumnBasis:
    """Basis of the columns of every sensor, the target left out; C channels, k - 1 columns.

    Parameters
    ----------
    members : sequence of ndarray of int
        Numbers of the columns in the basis of every channel, counted without the target.
    weights : ndarray, shape (C, k - 1, b)
        Every column by those of the basis; zero beyond a channel's own.
    largest : ndarray, shape (C, k - 1)
        Largest size of every column where it was looked at.
    """

    members: tuple[IntArray, ...]
    weights: FloatArray
    largest: FloatArray

    @property
    def size(self) -> int:
        """Columns of the largest basis."""
        return self.weights.shape[2]

    def holds(self, channel: int, rows: FloatArray) -> bool:
        """Whether columns, shape (k - 1, n), are the combinations that they are taken for."""
        members = self.members[channel]
        rows = rows[:, np.isfinite(rows).all(axis=0)]
        missed = rows - self.weights[channel, :, : members.size] @ rows[members]
        largest = np.maximum(self.largest[channel], np.abs(rows).max(axis=1, initial=0.0))
        limit = _LARGEST_MISS * largest
        return bool((np.abs(missed).max(axis=1, initial=0.0) <= limit).all())


def every_column(n_columns: int, n_channels: int) -> ColumnBasis:
    """Basis of all columns."""
    members = np.arange(n_columns)
    weights = np.broadcast_to(np.eye(n_columns), (n_channels, n_columns, n_columns))
    return ColumnBasis((members,) * n_channels, weights, np.zeros((n_channels, n_columns)))


def column_basis(
    runs: Sequence[Run], channels: Sequence[Channel], source: ColumnSource
) -> ColumnBasis:
    """Basis of the columns of every sensor at some samples of all runs.

    Parameters
    ----------
    runs : sequence of Run
        Records within their windows of use.
    channels : sequence of Channel
        Sensors.
    source : ColumnSource
        Columns.

    Returns
    -------
    ColumnBasis
        Earlier columns before later ones.
    """
    n_samples = max(_FEWEST, _SAMPLES // len(runs))
    members = []
    of_channels = []
    largest = []
    # Channel by channel: the columns of all of them are several times the records.
    some = some_samples(runs, source, n_samples)
    for channel in channels:
        table = some.rows(channel)
        table = table[:, np.isfinite(table).all(axis=0)]
        chosen, own = _combinations(table)
        members.append(chosen)
        of_channels.append(own)
        largest.append(np.abs(table).max(axis=1, initial=0.0))
    size = max(chosen.size for chosen in members)
    weights = np.zeros((len(channels), len(largest[0]), size))
    for c, own in enumerate(of_channels):
        weights[c, :, : own.shape[1]] = own
    return ColumnBasis(tuple(members), weights, np.array(largest))


def _combinations(rows: FloatArray) -> tuple[IntArray, FloatArray]:
    """Numbers of the rows in the basis, and every row by these."""
    length = np.linalg.norm(rows, axis=1)
    scaled = rows / np.where(length > 0.0, length, 1.0)[:, None]
    members: list[int] = []
    directions = np.empty((0, rows.shape[1]))
    off = scaled.copy()
    for limit in _OFF_THE_OTHERS:
        for k in range(len(scaled)):
            size = float(np.linalg.norm(off[k]))
            if size <= limit:
                continue
            members.append(k)
            direction = off[k] / size
            direction -= (directions @ direction) @ directions  # what rounding left
            direction /= np.linalg.norm(direction)
            directions = np.vstack([directions, direction])
            off -= np.outer(off @ direction, direction)
    chosen = np.array(sorted(members), dtype=np.int64)
    weights = np.linalg.lstsq(scaled[chosen].T, scaled.T, rcond=None)[0].T
    weights[np.abs(weights) < _ROUNDING] = 0.0
    weights[chosen] = np.eye(chosen.size)
    return chosen, weights * length[:, None] / length[chosen]
