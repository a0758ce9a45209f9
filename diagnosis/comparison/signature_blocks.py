"""What the screens of element and mounting share, whatever their signatures are made of."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.simulation.force_effect import ForceEffect


def products_by_block(
    table: FloatArray, block: NDArray[np.int64], n_blocks: int
) -> list[FloatArray]:
    """Gram matrix of the rows of a table in every block of its record.

    Parameters
    ----------
    table : ndarray, shape (n_rows, n) or (n_rows, n, n_channels)
        Target, baseline, signatures and flexible features.
    block : ndarray of int, shape (n,)
        Block of every sample; samples of none count nowhere.
    n_blocks : int
        Blocks of the record.

    Returns
    -------
    list of ndarray, shape (n_rows, n_rows)
        One a block.
    """
    parts = [table[:, block == number].reshape(len(table), -1) for number in range(n_blocks)]
    return [part @ part.T for part in parts]


def shape_starts(effects: Mapping[str, ForceEffect], name: str) -> tuple[float, ...]:
    """Shapes that the screen tries, over their scale; that scale alone for a law of the user's."""
    return effects[name].shape_starts if name in effects else (1.0,)
