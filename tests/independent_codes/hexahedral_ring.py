"""A ring of hexahedra solved sector by sector with scikit-fem.

None of our elements, solvers or meshes takes part.

All sectors of a ring are alike, so a mode with n waves is known from one of them: its right face
moves as its left one does, turned by the sector's angle and by the phase ``exp(i n angle)``.
"""

import numpy as np
import scipy.sparse as sp
import skfem
from scipy.sparse.linalg import eigsh
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity


def ring_frequencies_hz(radii, length, material, cells, element, wave_numbers):
    """Lowest two frequencies [Hz] for each number of waves round the ring.

    Cells (around, radial, axial).
    """
    angle = 2.0 * np.pi / cells[0]
    K, M, nodes, positions = _sector(radii, length, material, cells, element)
    result = []
    for waves in wave_numbers:
        T = _cyclic_map(nodes, positions, angle, waves)
        K_n, M_n = ((T.conj().T @ A @ T).tocsc() for A in (K, M))
        K_n, M_n = (K_n + K_n.conj().T) / 2.0, (M_n + M_n.conj().T) / 2.0
        squares = eigsh(K_n, k=2, M=M_n, sigma=0.0, return_eigenvectors=False)
        result.append(np.sort(np.sqrt(squares)) / (2.0 * np.pi))
    return np.array(result)


def _sector(radii, length, material, cells, element):
    """Matrices of a cell's slice, dof numbers (n, 3) of its nodes, their angle, radius, height."""
    angle = 2.0 * np.pi / cells[0]
    straight = skfem.MeshHex.init_tensor(
        np.linspace(*radii, cells[1] + 1),
        np.linspace(0.0, length, cells[2] + 1),
        np.array([0.0, angle]),
    )
    r, height, turned = straight.p
    mesh = skfem.MeshHex(np.array([r * np.cos(turned), r * np.sin(turned), height]), straight.t)
    basis = skfem.Basis(mesh, skfem.ElementVector(element), intorder=3 if element.maxdeg < 4 else 5)
    K = linear_elasticity(*lame_parameters(material.E, material.nu)).assemble(basis)
    M = skfem.BilinearForm(lambda u, v, w: material.rho * dot(u, v)).assemble(basis)
    positions = np.round(basis.doflocs.T, 9)
    _, group = np.unique(positions, axis=0, return_inverse=True)
    nodes = np.argsort(group.ravel(), kind="stable").reshape(-1, 3)
    x, y, z = basis.doflocs[:, nodes[:, 0]]
    return K, M, nodes, np.stack([np.arctan2(y, x), np.hypot(x, y), z], axis=1)


def _cyclic_map(nodes, positions, angle, waves):
    """All degrees of freedom from those of the left face and the inside."""
    right = np.flatnonzero(np.abs(positions[:, 0] - angle) < 1e-7)
    left = np.flatnonzero(np.abs(positions[:, 0]) < 1e-7)
    left, right = (face[np.lexsort(np.round(positions[face, 1:], 7).T)] for face in (left, right))
    independent = np.setdiff1d(np.arange(len(nodes)), right)
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]]
    )
    blocks = [(nodes[independent], np.arange(len(independent)), np.eye(3, dtype=complex))]
    blocks.append(
        (nodes[right], np.searchsorted(independent, left), turn * np.exp(1j * waves * angle))
    )
    rows = []
    columns = []
    values = []
    for targets, sources, block in blocks:
        rows.append(np.repeat(targets, 3, axis=1).ravel())
        columns.append(np.tile(3 * sources[:, None] + np.arange(3), (1, 3)).ravel())
        values.append(np.tile(block.ravel(), len(sources)))
    shape = (nodes.size, 3 * len(independent))
    return sp.csr_array(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=shape
    )
