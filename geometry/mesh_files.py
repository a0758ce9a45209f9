"""Mesh files through meshio.

Gmsh .msh, VTK .vtu and Abaqus .inp, named surfaces as sets; .msh is read back.
"""

import re
import struct
from pathlib import Path

import meshio
import meshio.gmsh
import numpy as np
from numpy.typing import NDArray

from carrierflex.files.child_process import in_child, limited
from carrierflex.files.plain_files import check_plain_file
from carrierflex.files.shown_values import shortened
from carrierflex.files.whole_files import whole_file
from carrierflex.geometry.mesh_checks import check_mesh
from carrierflex.geometry.tet_mesh import TetMesh, boundary_facets

#: Format of meshio's writer by suffix.
_FORMATS = {".msh": "gmsh22", ".vtu": "vtu", ".inp": "abaqus"}
_ABAQUS_WIDTH = 20
#: Largest mesh file that is read [bytes]: some ten million nodes.
_MOST_BYTES = 4_000_000_000


def write_mesh(mesh: TetMesh, path: Path) -> None:
    """Write `mesh` in the format of the file's suffix; coordinates in metres.

    ``.msh``: bodies and surfaces as physical groups. ``.vtu``: cell data ``body``, point data
    ``surface: <name>``. ``.inp``: C3D10 elements, element sets for bodies, node sets for surfaces.

    Raises
    ------
    ValueError
        Where the suffix is none of the three.
    OSError
        Where the folder cannot be written.
    """
    check_mesh_path(path)
    builders = {".msh": _for_gmsh, ".vtu": _for_vtk, ".inp": _for_abaqus}
    with whole_file(path) as temporary:
        options = {"float_fmt": _abaqus_number(mesh)} if path.suffix == ".inp" else {}
        meshio.write(
            temporary, builders[path.suffix](mesh), file_format=_FORMATS[path.suffix], **options
        )
        if path.suffix == ".inp":
            _name_plain_element(temporary)


def check_mesh_path(path: Path) -> None:
    """Raise ValueError where the file's suffix names no format that :func:`write_mesh` knows."""
    if path.suffix not in _FORMATS:
        raise ValueError(f"{path}: suffix {path.suffix!r}; expected one of {', '.join(_FORMATS)}")


def _abaqus_number(mesh: TetMesh) -> str:
    """Format of coordinates in at most twenty characters.

    It is the widest number that Abaqus and CalculiX read.

    Fixed point keeps 17 decimals below 10 m, 5e-18 m; an exponent would leave 14 digits.
    """
    before_point = len(str(int(np.abs(mesh.points).max(initial=0.0))))
    return f".{_ABAQUS_WIDTH - 2 - before_point}f"


def _name_plain_element(path: Path) -> None:
    """Name the plain quadratic tetrahedron.

    Meshio writes C3D10MH, a modified hybrid formulation, for ten nodes.
    """
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("TYPE=C3D10MH", "TYPE=C3D10", 1), encoding="utf-8")


def _body_numbers(mesh: TetMesh) -> np.ndarray:
    numbers = np.zeros(len(mesh.tets), dtype=np.int64)
    for number, elements in enumerate(mesh.bodies.values(), start=1):
        numbers[elements] = number
    return numbers


def _for_gmsh(mesh: TetMesh) -> meshio.Mesh:
    cells: list[tuple[str, np.ndarray]] = [("tetra10", mesh.tets)]
    tags = [_body_numbers(mesh)]
    field_data = {name: np.array([number, 3]) for number, name in enumerate(mesh.bodies, start=1)}
    for number, (name, facets) in enumerate(mesh.surfaces.items(), start=len(mesh.bodies) + 1):
        cells.append(("triangle6", facets))
        tags.append(np.full(len(facets), number))
        field_data[name] = np.array([number, 2])
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    return meshio.Mesh(mesh.points, cells, cell_data=data, field_data=field_data)


def _for_vtk(mesh: TetMesh) -> meshio.Mesh:
    marks = {}
    for name, facets in mesh.surfaces.items():
        marks[f"surface: {name}"] = np.isin(np.arange(len(mesh.points)), facets).astype(np.uint8)
    return meshio.Mesh(
        mesh.points,
        [("tetra10", mesh.tets)],
        point_data=marks,
        cell_data={"body": [_body_numbers(mesh)]},
    )


def _for_abaqus(mesh: TetMesh) -> meshio.Mesh:
    return meshio.Mesh(
        mesh.points,
        [("tetra10", mesh.tets)],
        point_sets={name: np.unique(facets) for name, facets in mesh.surfaces.items()},
        cell_sets={name: [elements] for name, elements in mesh.bodies.items()},
    )


def read_mesh(path: Path) -> TetMesh:
    """Read a gmsh file of quadratic tetrahedra.

    Bodies from its physical volumes, surfaces from its physical surfaces.

    Returns
    -------
    TetMesh
        Checked by :func:`carrierflex.geometry.mesh_checks.check_mesh`; ``symmetry_order`` 1,
        whatever symmetry the mesh has.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is no gmsh file, is cut short, holds other elements or unnamed bodies, or a surface
        is not on the boundary; and from the checks: unit, unused nodes, detached pieces, inverted
        elements.
    """
    if path.suffix != ".msh":
        raise ValueError(
            f"{path}: suffix {path.suffix!r}; expected .msh, the format that holds bodies and "
            "surfaces"
        )
    size = check_plain_file(path, "a gmsh mesh (.msh)", _MOST_BYTES, text=True)
    points, blocks = in_child(_points_and_blocks, path, size, about=path, what="meshio")
    mesh = _from_blocks(points, blocks, path)
    check_mesh(mesh, str(path))
    return mesh


def _points_and_blocks(
    path: Path, size: int
) -> tuple[NDArray[np.float64], list[tuple[str, str, NDArray[np.int64]]]]:
    """Points and named parts of a gmsh mesh of `size` bytes."""
    try:
        with limited(30 + size // 500_000, 100_000_000 + 60 * size):
            _refuse_cut_short(path)
            gmsh_mesh = meshio.gmsh.read(path)
            blocks = _named_blocks(gmsh_mesh)
    except (
        meshio.ReadError,
        ValueError,
        KeyError,
        IndexError,
        TypeError,
        struct.error,
        EOFError,
        MemoryError,
    ) as error:
        reason = shortened(" ".join(str(error).split())) or type(error).__name__
        raise ValueError(
            f"{path}: not a complete gmsh mesh ({reason}); expected .msh of version 2.2 or 4.1, "
            "whole, with physical groups"
        ) from error
    return gmsh_mesh.points, blocks


def _refuse_cut_short(path: Path) -> None:
    """Raise ValueError where the file's last section is not closed.

    Meshio only warns of that, on the screen.
    """
    content = path.read_bytes()
    closed = re.search(rb"\$End(\w+)\s*\Z", content)
    if closed is None or not re.search(rb"^\$" + closed.group(1) + rb"\s*$", content, re.MULTILINE):
        raise ValueError("the last section is not closed by $End...: cut short")


def _named_blocks(gmsh_mesh: meshio.Mesh) -> list[tuple[str, str, NDArray[np.int64]]]:
    """Element type, physical group's name and node numbers of the parts of the mesh.

    The name is empty where a part has none.
    """
    names = {
        (int(dimension), int(number)): name
        for name, (number, dimension) in gmsh_mesh.field_data.items()
    }
    tags = gmsh_mesh.cell_data.get(
        "gmsh:physical", [np.zeros(len(block.data), dtype=np.int64) for block in gmsh_mesh.cells]
    )
    blocks = []
    for block, numbers in zip(gmsh_mesh.cells, tags, strict=True):
        for number in np.unique(numbers):
            name = names.get((block.dim, int(number)), "")
            blocks.append((block.type, name, block.data[numbers == number].astype(np.int64)))
    return blocks


def _from_blocks(
    points: NDArray[np.float64], blocks: list[tuple[str, str, NDArray[np.int64]]], path: Path
) -> TetMesh:
    solids: dict[str, list[NDArray[np.int64]]] = {}
    faces: dict[str, list[NDArray[np.int64]]] = {}
    for kind, name, nodes in blocks:
        if kind == "tetra10":
            solids.setdefault(name, []).append(nodes)
        elif kind == "triangle6" and name:
            faces.setdefault(name, []).append(nodes)
        elif kind not in ("triangle6", "line3", "vertex"):
            raise ValueError(
                f"{path}: {len(nodes)} elements of type {kind}; expected quadratic tetrahedra "
                "(tetra10) only"
            )
    if not solids or "" in solids:
        what = (
            "no quadratic tetrahedra"
            if not solids
            else "tetrahedra without a physical volume's name"
        )
        raise ValueError(
            f"{path}: {what}; expected all of them in physical volumes such as 'carrier' and 'pins'"
        )
    parts = {name: np.concatenate(nodes) for name, nodes in solids.items()}
    edges = np.cumsum([0, *(len(part) for part in parts.values())])
    bodies = {name: np.arange(edges[i], edges[i + 1]) for i, name in enumerate(parts)}
    outside = [boundary_facets(part) for part in parts.values()]
    surfaces = {
        name: _outward(np.concatenate(nodes), outside, f"{path}: surface {name!r}")
        for name, nodes in faces.items()
    }
    return TetMesh(
        np.asarray(points, dtype=np.float64), np.concatenate(list(parts.values())), surfaces, bodies
    )


def _outward(
    facets: NDArray[np.int64], outside: list[NDArray[np.int64]], what: str
) -> NDArray[np.int64]:
    """The same facets as the first body has them that all of them bound, normals outward."""
    for of_body in outside:
        row = {
            tuple(corners): i for i, corners in enumerate(np.sort(of_body[:, :3], axis=1).tolist())
        }
        rows = [row.get(tuple(corners), -1) for corners in np.sort(facets[:, :3], axis=1).tolist()]
        if min(rows) >= 0:
            return of_body[rows]
    raise ValueError(
        f"{what}: {len(facets)} facets, not all of them on the boundary of one body; expected "
        "boundary facets"
    )
