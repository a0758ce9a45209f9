"""What the screens of element and mounting share, whatever their signatures are made of."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.simulation.force_effect import ForceEffect


def total_products(table: FloatArray, block: NDArray[np.int64]) -> FloatArray:
    """Products of the rows of a table over the samples of its blocks, shape (n_rows, n_rows).

    Parameters
    ----------
    table : ndarray, shape (n_rows, n) or (n_rows, n, n_channels)
        Target, baseline and signatures.
    block : ndarray of int, shape (n,)
        Block of every sample, negative where it belongs to none.
    """
    rows = table[:, block >= 0].reshape(len(table), -1)
    return np.asarray(rows @ rows.T)


def shape_starts(effects: Mapping[str, ForceEffect], name: str) -> tuple[float, ...]:
    """Shapes that the screen tries, over their scale; that scale alone for a law of the user's."""
    return effects[name].shape_starts if name in effects else (1.0,)
