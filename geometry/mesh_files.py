"""Mesh files through meshio: gmsh .msh, VTK .vtu and Abaqus .inp, named surfaces as sets."""

from pathlib import Path

import meshio
import numpy as np

from geometry.tet_mesh import TetMesh
from geometry.whole_files import whole_file

#: Format of meshio's writer by suffix.
_FORMATS = {".msh": "gmsh22", ".vtu": "vtu", ".inp": "abaqus"}


def write_mesh(mesh: TetMesh, path: Path) -> None:
    """Write `mesh` in the format of the file's suffix; coordinates in metres.

    ``.msh``: bodies and surfaces as physical groups. ``.vtu``: cell data ``body``, point data ``surface: <name>``.
    ``.inp``: C3D10 elements, element sets for bodies, node sets for surfaces.

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
        meshio.write(temporary, builders[path.suffix](mesh), file_format=_FORMATS[path.suffix])
        if path.suffix == ".inp":
            _name_plain_element(temporary)


def check_mesh_path(path: Path) -> None:
    """Raise ValueError where the file's suffix names no format that :func:`write_mesh` knows."""
    if path.suffix not in _FORMATS:
        raise ValueError(f"{path}: suffix {path.suffix!r}; expected one of {', '.join(_FORMATS)}")


def _name_plain_element(path: Path) -> None:
    """Name the plain quadratic tetrahedron: meshio writes C3D10MH, a modified hybrid formulation, for ten nodes."""
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
        mesh.points, [("tetra10", mesh.tets)], point_data=marks, cell_data={"body": [_body_numbers(mesh)]}
    )


def _for_abaqus(mesh: TetMesh) -> meshio.Mesh:
    return meshio.Mesh(
        mesh.points,
        [("tetra10", mesh.tets)],
        point_sets={name: np.unique(facets) for name, facets in mesh.surfaces.items()},
        cell_sets={name: [elements] for name, elements in mesh.bodies.items()},
    )
