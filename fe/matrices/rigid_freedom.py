"""Which rigid motions a stiffness matrix leaves free, and which other motions, that it should not.

A model may be held to the ground, wholly or in part, or have no stiffness in some directions.
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from carrierflex.fe.factorisation import factorise
from carrierflex.fe.matrices.dof_layout import DofLayout

#: Force against a rigid motion, over the sum of its terms: below, it is rounding of the file
#: (single precision leaves 1e-7); above, something holds the body.
FREE = 1e-6
#: Share of the largest motion above which a node takes part in a mechanism.
_TAKES_PART = 0.3
#: Shift of the stiffness, over its diagonal, that makes it definite to find a mechanism.
_SHIFT = 1e-9
_STEPS = 6
#: Reweighted fits that lead from least squares to the least sum of powers.
_FITS = 30
#: Power of the absolute values: below one, a tie between two halves falls to one of them.
_POWER = 0.5
_SHOWN = 3
#: Singular value over the largest below which rigid motions of some nodes are dependent.
_RANK = 1e-8


def free_motions(K: sp.csr_array, R: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Combinations of rigid motions that meet no stiffness.

    Parameters
    ----------
    K : csr_array, shape (n, n)
        Stiffness.
    R : ndarray, shape (n, 6)
        Rigid motions.

    Returns
    -------
    V : ndarray, shape (6, k)
        ``R V`` are the motions that are free; the identity where all six are.
    ratio : float
        Largest force that remains of them, over the sum of its terms.
    """
    scale = np.linalg.norm(R, axis=0)
    scale[scale == 0.0] = 1.0
    unit = R / scale
    force = K @ unit
    terms = (abs(K) @ np.abs(unit)).max(axis=1)
    # Six rows of zeros, or directions would be missing where fewer rows have a stiffness.
    share = np.zeros((np.count_nonzero(terms > 0.0) + 6, 6))
    share[:-6] = force[terms > 0.0] / terms[terms > 0.0, None]
    present = np.linalg.svd(unit, full_matrices=False)
    # Motions that the model's directions cannot make are none: of a plane model, say.
    independent = present[1] > _RANK * max(present[1][0], np.finfo(float).tiny)
    basis = present[2][independent].T
    if not basis.shape[1]:
        return np.zeros((6, 0)), 0.0
    directions = basis @ np.linalg.svd(share @ basis, full_matrices=False)[2].T
    ratios = np.abs(share @ directions).max(axis=0, initial=0.0)
    free = ratios < FREE
    worst = float(ratios[free].max(initial=0.0))
    if free.all() and len(free) == 6:
        return np.eye(6), worst
    return directions[:, free] / scale[:, None], worst


def refuse_loose_parts(K: sp.csr_array, layout: DofLayout, n_free: int) -> None:
    """Refuse rows without stiffness, and parts that nothing connects with the rest.

    Parameters
    ----------
    K : csr_array, shape (n, n)
        Stiffness.
    layout : DofLayout
        Its degrees of freedom.
    n_free : int
        Rigid motions that the whole body is free in.

    Raises
    ------
    ValueError
        With the nodes.
    """
    empty = np.flatnonzero(~(K.diagonal() > 0.0))
    if len(empty):
        named = ", ".join(layout.names.named(int(row)) for row in empty[:_SHOWN])
        more = ", ..." if len(empty) > _SHOWN else ""
        raise ValueError(
            f"{len(empty)} degrees of freedom have no stiffness but mass or couplings ({named}"
            f"{more}): they move without strain; expected a stiffness on every one"
        )
    n_parts, component = connected_components(K + _same_node(layout), directed=False)
    if n_parts == 1:
        return
    if sum(_parts_freedom(K, layout, component, n_parts)) > n_free:
        sizes = np.bincount(component)
        small = component == int(sizes.argmin())
        raise ValueError(
            f"the matrices fall into {n_parts} parts that nothing connects; the smallest is "
            f"{described(layout, small)}: it moves without strain; expected one body"
        )


def _same_node(layout: DofLayout) -> sp.csr_array:
    """Links between the degrees of freedom of every node, which a plane frame need not have."""
    _, first, of_node = np.unique(layout.names.nodes, return_index=True, return_inverse=True)
    n = len(layout)
    return sp.csr_array((np.ones(n), (np.arange(n), first[of_node])), shape=(n, n))


def _parts_freedom(
    K: sp.csr_array, layout: DofLayout, component: NDArray[np.int32], n_parts: int
) -> Iterator[int]:
    """Free rigid motions of every part on its own."""
    order = np.argsort(component, kind="stable")
    starts = np.searchsorted(component[order], np.arange(n_parts + 1))
    scalar = layout.is_scalar
    for first, last in pairwise(starts):
        rows = order[first:last]
        if not scalar[rows].all():
            component_layout = layout.at(rows)
            R = component_layout.rigid_modes(component_layout.points.mean(axis=0))
            yield free_motions(sp.csr_array(K[rows][:, rows]), R)[0].shape[1]


def described(layout: DofLayout, chosen: NDArray[np.bool_]) -> str:
    """Count of the nodes of some degrees of freedom, and the first few of them."""
    nodes = np.unique(layout.names.nodes[chosen])
    shown = ", ".join(str(node) for node in nodes[:_SHOWN])
    more = ", ..." if len(nodes) > _SHOWN else ""
    return f"{len(nodes)} node{'s' if len(nodes) > 1 else ''} ({shown}{more})"


def described_mechanism(K: sp.csr_array, R: NDArray[np.float64], layout: DofLayout) -> str:
    """The motion beyond rigid ones that meets the least stiffness, in words: who takes part.

    Parameters
    ----------
    K : csr_array, shape (n, n)
        Stiffness, singular beyond R.
    R : ndarray, shape (n, k)
        Free rigid motions.
    layout : DofLayout
        The degrees of freedom.
    """
    diagonal = K.diagonal()
    factor = factorise(sp.csr_array(K + sp.diags_array(_SHIFT * diagonal)))
    root = np.sqrt(diagonal)
    Q = np.linalg.qr(R * root[:, None])[0]
    v = np.random.default_rng(0).standard_normal(len(root))
    for _ in range(_STEPS):
        v -= Q @ (Q.T @ v)
        v = root * factor.solve(root * v)
        v /= np.linalg.norm(v)
    motion = np.abs(_with_most_at_rest(v, Q) / root)
    most = int(motion.argmax())
    # Rotations and translations have no common measure: whoever moves like the one that moves most.
    alike = layout.is_rotation == layout.is_rotation[most]
    moves = alike & (motion > _TAKES_PART * motion[most])
    return (
        f"a mechanism: {described(layout, moves)} can move without strain, most of all "
        f"{layout.names.named(most)}"
    )


def _with_most_at_rest(v: NDArray[np.float64], Q: NDArray[np.float64]) -> NDArray[np.float64]:
    """A motion plus the rigid one after which most of the body rests: who is left takes part.

    The sum of powers of absolute values is the least, by reweighted least squares.
    """
    remaining = v
    if not Q.shape[1]:
        return remaining
    least = 1e-9 * float(np.abs(v).max())
    for _ in range(_FITS):
        weight = (np.abs(remaining) + least) ** (_POWER / 2.0 - 1.0)
        rigid = np.linalg.lstsq(weight[:, None] * Q, weight * v, rcond=None)[0]
        remaining = v - Q @ rigid
    return remaining
