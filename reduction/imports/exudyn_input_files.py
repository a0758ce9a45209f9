"""Bodies of Exudyn's FEMinterface, HDF5 of its file versions 3 and 4 (Exudyn 1.13.6).

The file holds nodes, full matrices, a basis and sets of nodes with weights. The basis and the six
rigid motions span the body; every set of three nodes or more, not in line, becomes a distributing
pilot at the weighted mean of its nodes.
"""

from pathlib import Path

import h5py
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.couplings import Pilot
from carrierflex.fe.point_couplings import AveragedDofs, point_coupling
from carrierflex.fe.structural_model import StructuralModel
from carrierflex.files.hdf5_datasets import PartError, checked_name, numbers, samples
from carrierflex.files.hdf5_trial import try_hdf5
from carrierflex.files.plain_files import check_plain_file
from carrierflex.files.shown_values import shown
from carrierflex.reduction.ffrf_data import ffrf_data
from carrierflex.reduction.imports.floating_frame import FrameBody, free_body
from carrierflex.reduction.imports.imported_body import ImportedBody

_EXPECTED = "a body of Exudyn (.hdf5)"
_MOST_BYTES = 20_000_000_000
_MOST_NODES, _MOST_MODES, _MOST_SETS = 5_000_000, 1_000, 500
_VERSIONS = (3, 4)
#: Three nodes hold a plane.
_FEWEST_NODES = 3
_NO_DAMPING = "Exudyn's file holds no damping: the body has none"


def read_exudyn(path: Path) -> ImportedBody:
    """Free body of a file that Exudyn's FEMinterface.SaveToFile wrote in HDF5.

    Raises
    ------
    FileNotFoundError, ValueError
        Where there is no such file, it is damaged, or holds no basis or no sets of nodes; one line
        that names the file and what to do in Exudyn.
    """
    check_plain_file(path, _EXPECTED, _MOST_BYTES)
    try_hdf5(path)
    try:
        with h5py.File(path, "r") as file:
            return _body(file, path)
    except PartError as error:
        raise ValueError(f"{path}: {error}") from error
    except (OSError, KeyError, TypeError, IndexError, AttributeError, RuntimeError) as error:
        reason = " ".join(str(error).split())[:400]
        raise ValueError(f"{path}: not a whole FEMinterface of Exudyn ({reason})") from error
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def _body(file: h5py.File, path: Path) -> ImportedBody:
    kind = _text(file, "type")
    if kind != "FEMinterface":
        raise PartError(
            f"type is {shown(kind)}; expected FEMinterface: an ObjectFFRFreducedOrderInterface "
            "names no interface; write fem.SaveToFile('body.hdf5') with its node sets"
        )
    version = int(numbers(file, "fileVersion", ()))
    if version not in _VERSIONS:
        raise PartError(f"fileVersion is {version}; expected 3 or 4: write it by Exudyn 1.13")
    shape = file["nodes/Position"].shape
    if len(shape) != 2 or not 0 < shape[0] <= _MOST_NODES:
        raise PartError(f"nodes/Position has shape {shape}; expected one row of three a node")
    points = numbers(file, "nodes/Position", (shape[0], 3))
    n = 3 * len(points)
    K, M = (_csr(file, name, n) for name in ("stiffnessMatrix", "massMatrix"))
    T = _basis(file, n)
    pilots = _pilots(file, points)
    structure = StructuralModel(path.stem, K, M, points, pilots)
    r = T.shape[1]
    body = FrameBody(
        name=path.stem,
        Ke=T.T @ (K @ T),
        De=np.zeros((r, r)),
        data=ffrf_data(structure, T),
        nodes=tuple(pilot.name for pilot in pilots),
        points=np.array([pilot.point for pilot in pilots]),
        motion=np.array([pilot.G @ T for pilot in pilots]),
    )
    return free_body(body, path.name, "exudyn", (_NO_DAMPING,))


def _csr(file: h5py.File, name: str, n: int) -> sp.csr_array:
    group = file[name]
    stored = [int(i) for i in numbers(group, "shape", (2,))]
    if stored != [n, n]:
        raise PartError(f"{name} states {stored}; expected {n} rows and columns, three a node")
    count = group["data"].shape
    data = numbers(group, "data", count if len(count) == 1 else (0,))
    indices = numbers(group, "indices", data.shape, "iu").astype(np.int64)
    starts = numbers(group, "indptr", (n + 1,), "iu").astype(np.int64)
    A = sp.csr_array((data, indices, starts), shape=(n, n))
    A.check_format(full_check=True)
    size = np.sqrt(np.abs(A.diagonal()))
    difference = sp.coo_array(A - A.T)
    if difference.nnz:
        i, j = difference.coords
        if (np.abs(difference.data) > 1e-6 * size[i] * size[j]).any():
            raise PartError(f"{name} is not symmetric; expected a symmetric matrix")
    return sp.csr_array((A + A.T) * 0.5)


def _basis(file: h5py.File, n: int) -> NDArray[np.float64]:
    group = file.get("modeBasis")
    if not isinstance(group, h5py.Group) or "matrix" not in group:
        raise PartError(
            "no modeBasis; expected one: call ComputeHurtyCraigBamptonModes in Exudyn before "
            "SaveToFile, or give its matrices to carrierflex reduce"
        )
    shape = group["matrix"].shape
    if len(shape) != 2 or shape[0] != n or not 0 < shape[1] <= _MOST_MODES:
        raise PartError(f"modeBasis/matrix has shape {shape}; expected {n} rows and some columns")
    return numbers(group, "matrix", shape)


def _pilots(file: h5py.File, points: NDArray[np.float64]) -> tuple[Pilot, ...]:
    """A pilot for every set of nodes that can carry one."""
    group = file["nodeSets"]
    pilots = []
    for key in sorted(group, key=lambda word: int(word.removeprefix("item_") or 0))[:_MOST_SETS]:
        item = group[key]
        name = checked_name(_text(item, "Name"), key)
        nodes = _nodes(item, "NodeNumbers", len(points))
        if "PilotCoupling" in item:
            pilots.append(_stated_pilot(name, item, points))
        elif len(nodes) >= _FEWEST_NODES:
            stated = "NodeWeights" in item and item["NodeWeights"].shape == nodes.shape
            weights = numbers(item, "NodeWeights", nodes.shape) if stated else np.ones(len(nodes))
            pilots.append(_weighted_pilot(name, nodes, weights, points))
    if not pilots:
        raise PartError(
            "no node set of three nodes or more; expected the interfaces as node sets: "
            "fem.AddNodeSet before SaveToFile"
        )
    if len({pilot.name for pilot in pilots}) < len(pilots):
        raise PartError("two node sets have one name; expected different names")
    return tuple(pilots)


def _nodes(item: h5py.Group, name: str, n_nodes: int) -> NDArray[np.int64]:
    """Different numbers of nodes, from 0."""
    shape = item[name].shape
    if len(shape) != 1:
        raise PartError(f"{item.name}/{name} has shape {shape}; expected a list")
    nodes = numbers(item, name, shape, "iu").astype(np.int64)
    if len(nodes) and not 0 <= nodes.min() <= nodes.max() < n_nodes:
        raise PartError(f"{item.name}/{name} names none of the {n_nodes} nodes; expected 0 on")
    if len(np.unique(nodes)) < len(nodes):
        raise PartError(f"{item.name}/{name} names a node twice; expected different ones")
    return nodes


def _stated_pilot(name: str, item: h5py.Group, points: NDArray[np.float64]) -> Pilot:
    """Pilot with the coupling that this program wrote beside the weights."""
    nodes = _nodes(item, "PilotNodes", len(points))
    coupling = numbers(item, "PilotCoupling", (6, 3 * len(nodes)))
    return Pilot(name, numbers(item, "PilotPoint", (3,)), _on_all(coupling, nodes, points))


def _weighted_pilot(
    name: str, nodes: NDArray[np.int64], weights: NDArray[np.float64], points: NDArray[np.float64]
) -> Pilot:
    """Distributing pilot at the weighted mean of its nodes; nodes without a weight are left out."""
    used = weights > 0.0
    nodes, weights = nodes[used], weights[used]
    k = len(nodes)
    point = weights @ points[nodes] / weights.sum()
    dofs = AveragedDofs(
        points[nodes],
        np.repeat(np.arange(k), 3),
        np.tile(np.eye(3), (k, 1)),
        np.zeros(3 * k, dtype=np.bool_),
        np.repeat(weights, 3),
    )
    coupling = point_coupling(dofs, point, subject=f"node set {name!r}")
    return Pilot(name, point, _on_all(coupling, nodes, points))


def _on_all(
    coupling: NDArray[np.float64], nodes: NDArray[np.int64], points: NDArray[np.float64]
) -> sp.csr_array:
    """Coupling to the displacements of some nodes as one to those of all."""
    columns = (3 * nodes[:, None] + np.arange(3)).ravel()
    index = (np.repeat(np.arange(6), len(columns)), np.tile(columns, 6))
    shape = (6, points.size)
    return sp.csr_array(sp.coo_array((coupling.ravel(), index), shape=shape))


def _text(group: h5py.Group, name: str) -> str:
    value = samples(group, name).tolist()
    if isinstance(value, bytes):
        value = value.decode("utf-8", "replace")
    return value if isinstance(value, str) else ""
