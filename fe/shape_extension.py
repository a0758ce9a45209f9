"""The motion of a boundary extended into the solid, as that of an elastic body.

Of all velocities that move the boundary as stated, the one of least strain energy is taken: the
mesh is a uniform elastic body whose boundary nodes are driven along their normals and slide freely
across them. It is smooth inside the solid, and so are the elements' changes of shape.
"""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.assembly import assemble_stiffness
from carrierflex.fe.factorisation import factorise
from carrierflex.fe.materials import CAST_IRON
from carrierflex.geometry.shape_velocity import BoundaryMotion
from carrierflex.geometry.tet_mesh import TetMesh

#: Directions of one node count as one where the eigenvalue of ``Σ n nᵀ`` is below this share of
#: the largest: 8 degrees between two of them.
_ONE_DIRECTION = 5e-3


def extended_velocity(mesh: TetMesh, motion: BoundaryMotion) -> NDArray[np.float64]:
    """Velocity of all nodes for each of k motions of the boundary, shape (k, n, 3).

    ``K V = 0`` inside, with K of a uniform elastic body; on a boundary node ``n · V`` as stated, in
    the least-squares sense where it is stated more often than the node has directions.

    Parameters
    ----------
    mesh : TetMesh
        Quadratic tetrahedra, n nodes.
    motion : BoundaryMotion
        Velocities along the normals of its boundary; they hold it against rigid motion.

    Raises
    ------
    SingularMatrixError
        Where the boundary is left free to move as a whole.
    """
    n, k = len(mesh.points), motion.rates.shape[1]
    S, s = np.zeros((n, 3, 3)), np.zeros((n, 3, k))
    np.add.at(S, motion.nodes, motion.normals[:, :, None] * motion.normals[:, None, :])
    np.add.at(s, motion.nodes, motion.normals[:, :, None] * motion.rates[:, None, :])
    driven_nodes = np.unique(motion.nodes)
    sizes, directions = np.linalg.eigh(S[driven_nodes])
    Q, is_driven = np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3), dtype=np.bool_)
    Q[driven_nodes] = directions
    is_driven[driven_nodes] = sizes > _ONE_DIRECTION * sizes[:, -1:]
    # Motion along a node's directions: V = Q q.
    along = np.zeros((n, 3, k))
    along[driven_nodes] = np.einsum("nai,nak->nik", directions, s[driven_nodes])
    along[driven_nodes] /= np.where(sizes > 0.0, sizes, 1.0)[:, :, None]
    q = np.where(is_driven[:, :, None], along, 0.0).reshape(3 * n, k)
    turn = sp.csr_array(sp.bsr_array((Q, np.arange(n), np.arange(n + 1))))
    K = assemble_stiffness(mesh, dict.fromkeys(mesh.bodies, CAST_IRON))
    turned = sp.csr_array(turn.T @ K @ turn)
    free = np.flatnonzero(~is_driven.ravel())
    inside = sp.csr_array(turned[free])
    q[free] = -factorise(sp.csr_array(inside[:, free])).solve(inside @ q)
    return np.ascontiguousarray((turn @ q).reshape(n, 3, k).transpose(2, 0, 1))
