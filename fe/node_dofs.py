"""Numbers of the degrees of freedom of nodes: x y z of a node after one another, node by node.

The package assembles its own matrices in this order (:mod:`carrierflex.fe.assembly`), so the
numbers follow from those of the nodes; here is the one statement of it outside compiled loops.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray


def dofs_of(nodes: ArrayLike) -> NDArray[np.int64]:
    """Degrees of freedom ``3 node + axis`` of nodes along x, y and z.

    Parameters
    ----------
    nodes : int or array_like of int, shape (...)
        Node numbers, from 0.

    Returns
    -------
    ndarray of int, shape (..., 3)
        One row a node; ``ravel`` puts them in the order of the matrices.
    """
    return 3 * np.asarray(nodes, dtype=np.int64)[..., None] + np.arange(3)
