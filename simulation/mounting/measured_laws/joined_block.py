"""Both blocks of the housing as one: a law in the plane of a bushing couples y and z."""

import numpy as np
from scipy.linalg import block_diag

from carrierflex.simulation.mounting.equations import Array, Block


def joined_block(vertical: Block, horizontal: Block, tables: Array) -> Block:
    """Block of all coordinates whose elements follow measured laws.

    Parameters
    ----------
    vertical, horizontal : Block
        Blocks that do not know of one another; the horizontal one counts its single element, the
        deflection in y that both bushings share, for both.
    tables : ndarray
        Packed laws, see
        :func:`carrierflex.simulation.mounting.measured_laws.bushing_laws.packed_laws`.

    Returns
    -------
    Block
        Elements: starboard and port in z, then starboard and port in y.
    """
    n_vertical = len(vertical.names)
    n_horizontal = len(horizontal.names)
    rows = np.zeros((4, n_vertical + n_horizontal))
    rows[:2, :n_vertical] = vertical.rows
    rows[2:, n_vertical:] = horizontal.rows
    return Block(
        names=(*vertical.names, *horizontal.names),
        M=block_diag(vertical.M, horizontal.M),
        C=block_diag(vertical.C, horizontal.C),
        K=block_diag(vertical.K, horizontal.K),
        G=np.vstack([vertical.G, horizontal.G]),
        rows=rows,
        weights=np.tile(vertical.weights, 2),
        fluid=vertical.fluid,
        law=vertical.law,
        preload=np.concatenate([vertical.preload, np.tile(horizontal.preload, 2)]),
        output=np.hstack([vertical.output, horizontal.output]),
        user_law=vertical.user_law,
        tables=tables,
    )
