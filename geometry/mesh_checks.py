"""Checks of a mesh that came from outside.

Unit, nodes without element, separate pieces, inverted elements.
"""

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from carrierflex.geometry.given_meshes.named_solids import NamedSolids
from carrierflex.geometry.quality import InvertedElementError, MeshQuality, check_quality
from carrierflex.geometry.tet_mesh import TetMesh

#: Sizes of a part of a wind turbine's gearbox [m]: one of ten metres is in millimetres, one of two
#: centimetres in kilometres.
_LARGEST, _SMALLEST = 10.0, 0.02
_SHOWN = 4


def check_mesh(mesh: TetMesh, where: str) -> MeshQuality:
    """Measure `mesh` and refuse what would make its matrices meaningless.

    Parameters
    ----------
    mesh : TetMesh
        One connected body, or bodies that share nodes.
    where : str
        What the messages call it: the file's name.

    Raises
    ------
    ValueError
        Where it has no elements, is not in metres, has nodes that no element uses, or falls into
        separate pieces.
    InvertedElementError
        Where an element is inverted.
    """
    if not len(mesh.tets):
        raise ValueError(f"{where}: no elements; expected quadratic tetrahedra")
    refuse_wrong_unit(np.ptp(mesh.points, axis=0), where)
    _refuse_unused_nodes(mesh, where)
    _refuse_pieces(mesh.points, [mesh.tets], where)
    try:
        return check_quality(mesh)
    except InvertedElementError as error:
        raise InvertedElementError(f"{where}: {error}") from error


def check_solids(mesh: NamedSolids, where: str) -> None:
    """Refuse solids of any kind that are not in metres or fall into separate pieces.

    Parameters
    ----------
    mesh : NamedSolids
        One connected body, or bodies that share nodes.
    where : str
        What the messages call it: the file's name.

    Raises
    ------
    ValueError
        As :func:`check_mesh`; elements turned inside out are found where matrices are made.
    """
    refuse_wrong_unit(np.ptp(mesh.points, axis=0), where)
    _refuse_pieces(mesh.points, [nodes for _, _, nodes in mesh.blocks], where)


def refuse_wrong_unit(extent: NDArray[np.float64], where: str) -> None:
    """Raise ValueError where the extent along x, y, z says that lengths are not in metres."""
    largest = float(extent.max())
    if largest > _LARGEST:
        raise ValueError(
            f"{where}: {largest:.4g} m across, as if millimetres were taken for metres; expected "
            f"coordinates in metres, {_SMALLEST} to {_LARGEST} m in all"
        )
    if largest < _SMALLEST:
        raise ValueError(
            f"{where}: {largest:.4g} m across; expected coordinates in metres, {_SMALLEST} to "
            f"{_LARGEST} m in all"
        )


def _refuse_unused_nodes(mesh: TetMesh, where: str) -> None:
    used = np.zeros(len(mesh.points), dtype=np.bool_)
    used[mesh.tets] = True
    unused = np.flatnonzero(~used)
    if len(unused):
        first = ", ".join(map(str, unused[:_SHOWN])) + (", ..." if len(unused) > _SHOWN else "")
        raise ValueError(
            f"{where}: {len(unused)} of {len(used)} nodes belong to no element (numbers {first}, "
            "from 0), and would move without stiffness; expected nodes of elements only"
        )


def _refuse_pieces(
    points: NDArray[np.float64], blocks: Sequence[NDArray[np.int64]], where: str
) -> None:
    """Raise ValueError where elements, blocks of node numbers (k, m), fall into separate pieces."""
    n = len(points)
    rows = np.concatenate([np.repeat(nodes[:, 0], nodes.shape[1] - 1) for nodes in blocks])
    columns = np.concatenate([nodes[:, 1:].ravel() for nodes in blocks])
    graph = sp.coo_array((np.ones(rows.size, dtype=np.int8), (rows, columns)), shape=(n, n))
    n_pieces, piece = connected_components(graph, directed=False)
    if n_pieces == 1:
        return
    of_element = np.concatenate([piece[nodes[:, 0]] for nodes in blocks])
    centres = np.concatenate([points[nodes].mean(axis=1) for nodes in blocks])
    sizes = np.bincount(of_element)
    shown = []
    for number in np.argsort(-sizes)[:_SHOWN]:
        x, y, z = centres[of_element == number].mean(axis=0)
        shown.append(f"{sizes[number]} elements about ({x:.3f}, {y:.3f}, {z:.3f}) m")
    raise ValueError(
        f"{where}: the mesh falls into {n_pieces} detached pieces "
        f"({'; '.join(shown)}{'; ...' if n_pieces > _SHOWN else ''}); expected one piece whose "
        "parts share their nodes"
    )
