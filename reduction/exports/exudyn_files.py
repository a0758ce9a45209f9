"""Finite elements and reduction basis for Exudyn's FEMinterface, HDF5 of its file version 4.

Exudyn reduces itself: it wants nodes, full matrices and the basis on all nodes, which a reduced
body does not hold. So this export starts from the structure and its reduction. The basis leaves one
pilot out, because Exudyn's floating frame already has the six rigid motions; the frame then follows
that pilot.
"""

from pathlib import Path

import h5py
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.couplings import Pilot
from carrierflex.fe.structural_model import StructuralModel
from carrierflex.files.whole_files import whole_file
from carrierflex.geometry.tet_mesh import TetMesh, boundary_facets
from carrierflex.reduction.craig_bampton import Reduction
from carrierflex.reduction.exports.ordered_body import FRAME, UNITS, header

_FILE_VERSION = 4


def write_exudyn(
    structure: StructuralModel,
    reduction: Reduction,
    path: Path,
    *,
    mesh: TetMesh | None = None,
    pilot: str | None = None,
) -> None:
    """Write a body for ``FEMinterface.LoadFromFile``.

    Parameters
    ----------
    structure : StructuralModel
        Body with distributing pilots.
    reduction : Reduction
        Its Craig-Bampton reduction.
    path : Path
        File of suffix .hdf5, by which Exudyn knows the format.
    mesh : TetMesh, optional
        Its mesh: elements and outer surface, for drawing.
    pilot : str, optional
        Pilot that the floating frame follows; the first by default.

    Raises
    ------
    ValueError
        Where the suffix is another, the body is held to the ground or has nodes of other degrees of
        freedom, or surfaces follow rigid pilots, whose nodes have no rows in the
        matrices.
    KeyError
        Where the body has no such pilot.
    """
    if path.suffix != ".hdf5":
        raise ValueError(f"{path}: suffix {path.suffix!r}; expected .hdf5")
    if len(structure.rigid_points):
        raise ValueError(
            f"{structure.name}: its pilots hold their surfaces rigid, and Exudyn needs every "
            "node's mass and stiffness; expected distributing couplings (rbe3)"
        )
    if structure.layout is not None or structure.free_motions is not None:
        raise ValueError(
            f"{structure.name}: Exudyn takes free bodies whose nodes have three translations each; "
            "expected one"
        )
    model = reduction.model
    fixed_pilot = next(iter(model.pilots)) if pilot is None else pilot
    free = np.setdiff1d(np.arange(model.n_coordinates), model.coordinates_of(fixed_pilot))
    T = reduction.basis[:, free]
    statement = (
        "; ".join(header(model)) + f"; pilot {fixed_pilot} held, its columns left out of the basis"
    )
    with whole_file(path) as temporary, h5py.File(temporary, "w") as file:
        _dictionary(file, "metaData", {"source": statement, "units": UNITS, "frame": FRAME})
        _dictionary(file, "nodes", {"Position": structure.points})
        _matrix(file, "massMatrix", structure.M)
        _matrix(file, "stiffnessMatrix", structure.K)
        _dictionary(file, "modeBasis", {"matrix": T, "type": "HCBmodes"})
        _array(file, "eigenValues", reduction.modes.omega**2)
        _list(file, "nodeSets", [_node_set(pilot) for pilot in structure.pilots])
        _list(file, "elementSets", [])
        _list(file, "elements", [{"Name": structure.name, "Tet10": mesh.tets}] if mesh else [])
        _list(file, "surface", [_surface(mesh)] if mesh else [])
        _dictionary(file, "postProcessingModes", {})
        _number(file, "fileVersion", _FILE_VERSION)
        _text(file, "type", "FEMinterface")


def _node_set(pilot: Pilot) -> dict[str, object]:
    """Nodes of a pilot's surface with their share of its translation along x, each once.

    Weights of single nodes are not the surface's integrals: the pilot's place and its coupling to
    the three displacements of its nodes stand beside them, which Exudyn passes over and this
    program reads.
    """
    # The row of the pilot's Tx: the nodes' x displacements count; where the pilot stands off its
    # surface's centre, y and z have weights of the rotation beside them.
    share = sp.coo_array(pilot.G[[0]][:, 0::3])
    used = share.data != 0.0
    nodes = np.unique(pilot.G.indices // 3)
    columns = (3 * nodes[:, None] + np.arange(3)).ravel()
    return {
        "Name": pilot.name,
        "NodeNumbers": share.coords[1][used],
        "NodeWeights": share.data[used],
        "type": "boundary",
        "PilotPoint": pilot.point,
        "PilotNodes": nodes,
        "PilotCoupling": pilot.G[:, columns].toarray(),
    }


def _surface(mesh: TetMesh) -> dict[str, object]:
    facets = boundary_facets(mesh.tets)
    return {"Name": "outside", "Trigs": facets[:, :3], "Trigs6": facets}


def _dictionary(parent: h5py.Group, name: str, items: dict[str, object]) -> None:
    group = parent.create_group(name)
    group.attrs["datatype"] = "dict"
    for key, value in items.items():
        if isinstance(value, str):
            _text(group, key, value)
        else:
            _array(group, key, np.asarray(value))


def _list(parent: h5py.Group, name: str, items: list[dict[str, object]]) -> None:
    group = parent.create_group(name)
    group.attrs["datatype"] = "list"
    for number, item in enumerate(items):
        _dictionary(group, f"item_{number}", item)


def _array(parent: h5py.Group, name: str, values: NDArray[np.float64]) -> None:
    parent[name] = values
    parent[name].attrs["datatype"] = "ndarray"


def _number(parent: h5py.Group, name: str, value: int) -> None:
    parent[name] = value
    parent[name].attrs["datatype"] = "int"


def _text(parent: h5py.Group, name: str, value: str) -> None:
    parent.create_dataset(name, data=value, dtype=h5py.string_dtype())
    parent[name].attrs["datatype"] = "str"


def _matrix(parent: h5py.Group, name: str, A: sp.csr_array) -> None:
    csr = sp.csr_matrix(A)
    group = parent.create_group(name)
    group.attrs["datatype"] = "csr_matrix"
    arrays = {
        "data": csr.data,
        "indices": csr.indices,
        "indptr": csr.indptr,
        "shape": np.array(csr.shape),
    }
    for key, value in arrays.items():
        group[key] = value
