"""Displacement of a body of a million unknowns in 5 GB, where a factorisation takes some 15.

Conjugate gradients whose preconditioner are Chebyshev steps on the quadratic elements about a
factorisation of the linear ones on the same corners (Adams et al., J. Comput. Phys. 188, 2003).
"""

import numpy as np
import scipy.sparse as sp

from carrierflex.fe.factorisation import factorise
from carrierflex.geometry.tet_mesh import TET_EDGES

#: Ratio of the largest to the smallest eigenvalue that the smoother damps, and its steps.
BAND, STEPS = 12.0, 3
MOST_ITERATIONS = 100


def linear_to_quadratic(mesh):
    """Values at all nodes of fields that are linear in the elements, from those at the corners."""
    corners = np.unique(mesh.tets[:, :4])
    column = np.full(len(mesh.points), -1)
    column[corners] = np.arange(len(corners))
    middles, first = np.unique(mesh.tets[:, 4:], return_index=True)
    element, side = np.divmod(first, 6)
    ends = np.take_along_axis(mesh.tets[element], np.array(TET_EDGES)[side], axis=1)
    start, end = mesh.points[ends[:, 0]], mesh.points[ends[:, 1]]
    along = end - start
    # Mid-side nodes at re-entrant edges do not stand in the middle.
    share = ((mesh.points[middles] - start) * along).sum(axis=1) / (along**2).sum(axis=1)
    rows = np.concatenate([corners, middles, middles])
    columns = column[np.concatenate([corners, ends[:, 0], ends[:, 1]])]
    values = np.concatenate([np.ones(len(corners)), 1.0 - share, share])
    P = sp.csr_array((values, (rows, columns)), shape=(len(mesh.points), len(corners)))
    return sp.kron(P, sp.eye_array(3), format="csr")


def two_level_displacement(mesh, K, fixed, loads, *, rtol):
    """Solution u of K u = f with `fixed` held, to a residual of `rtol` of f; columns together."""
    free = np.ones((K.shape[0], 1))
    free[fixed] = 0.0
    P = sp.csr_array(sp.diags_array(free[:, 0]) @ linear_to_quadratic(mesh))
    coarse = sp.csr_array(P.T @ (K @ P))
    # Corners that are held have empty rows.
    coarse = factorise(sp.csr_array(coarse + sp.diags_array((coarse.diagonal() == 0.0) * 1.0)))
    D = _node_blocks_inverse(K, free)

    def stiffness(x):
        return (K @ x) * free

    def scaled(r):
        return np.einsum("nij,njc->nic", D, r.reshape(len(D), 3, -1)).reshape(r.shape)

    highest = 1.2 * _largest_eigenvalue(lambda x: scaled(stiffness(x)), free)
    middle, half = (1.0 + 1.0 / BAND) * highest / 2.0, (1.0 - 1.0 / BAND) * highest / 2.0

    def smoothed(x, r):
        """Chebyshev steps from x, whose residual is r: new x and its residual."""
        rho, step = half / middle, scaled(r) / middle
        for _ in range(STEPS):
            x, r = x + step, r - stiffness(step)
            after = 1.0 / (2.0 * middle / half - rho)
            step = after * rho * step + 2.0 * after / half * scaled(r)
            rho = after
        return x, r

    def preconditioned(r):
        x, residual = smoothed(np.zeros_like(r), r)
        correction = P @ coarse.solve(P.T @ residual)
        return smoothed(x + correction, residual - stiffness(correction))[0]

    return _conjugate_gradients(stiffness, loads * free, preconditioned, rtol)


def _node_blocks_inverse(K, free):
    """Inverse of K's 3 x 3 blocks on the diagonal, zero where a node is held."""
    n = K.shape[0] // 3
    blocks = np.empty((n, 3, 3))
    for axis in range(3):
        for other in range(3):
            entries = K.diagonal(other - axis)
            first = axis + min(other - axis, 0)
            blocks[:, axis, other] = entries[first::3][:n]
    fixed = (1.0 - free.reshape(n, 3))[:, :, None] * np.eye(3)
    both_free = free.reshape(n, 3, 1) * free.reshape(n, 1, 3)
    return np.linalg.inv(blocks * both_free + fixed) * both_free


def _largest_eigenvalue(operator, free):
    x = np.random.default_rng(0).standard_normal(free.shape) * free
    for _ in range(30):
        x = operator(x / np.linalg.norm(x))
    return float(np.linalg.norm(x))


def _conjugate_gradients(A, b, preconditioned, rtol):
    u, r = np.zeros_like(b), b
    z = preconditioned(r)
    p, rz = z, (r * z).sum(axis=0)
    for _ in range(MOST_ITERATIONS):
        q = A(p)
        length = rz / (p * q).sum(axis=0)
        u, r = u + length * p, r - length * q
        if (np.linalg.norm(r, axis=0) < rtol * np.linalg.norm(b, axis=0)).all():
            return u
        z = preconditioned(r)
        before, rz = rz, (r * z).sum(axis=0)
        p = z + rz / before * p
    raise ArithmeticError(f"no residual of {rtol} in {MOST_ITERATIONS} iterations")
