"""Mesh files through meshio.

Gmsh .msh, VTK .vtu and Abaqus .inp, named surfaces as sets; other programs' meshes are read too, of
tetrahedra or of any solids.
"""

import re
import struct
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import meshio
import meshio.gmsh
import numpy as np
from numpy.typing import NDArray

from carrierflex.files.child_process import in_child, limited
from carrierflex.files.plain_files import check_plain_file
from carrierflex.files.shown_values import shortened
from carrierflex.files.whole_files import whole_file
from carrierflex.geometry.cad_surface_files import CadStatements
from carrierflex.geometry.cad_surfaces import SurfaceStatement
from carrierflex.geometry.given_meshes.foreign_files import (
    FORMATS,
    ForeignMesh,
    read_foreign_mesh,
    refuse_lost_groups,
)
from carrierflex.geometry.given_meshes.named_solids import GivenMesh, NamedSolids, named_solids
from carrierflex.geometry.given_meshes.other_entries import left_out
from carrierflex.geometry.given_meshes.solid_files import read_solid_mesh
from carrierflex.geometry.mesh_checks import check_mesh, check_solids
from carrierflex.geometry.pins import planets_of
from carrierflex.geometry.tet_mesh import (
    FACET_CORNERS,
    TET_EDGES,
    NamedSurfaces,
    TetMesh,
    boundary_facets,
)

#: Format of meshio's writer by suffix.
_FORMATS = {".msh": "gmsh22", ".vtu": "vtu", ".inp": "abaqus"}
_ABAQUS_WIDTH = 20
_TETRAHEDRA, _TRIANGLES = ("tetra10", "tetra"), ("triangle6", "triangle")
#: Facets of hexahedra and wedges, by meshio's names and by gmsh's.
_QUADRILATERALS = ("quad", "quad8", "quad9", "Quadrilateral")
#: What may stand beside solids and is left out.
_NO_SOLIDS = ("line", "line3", "vertex")
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


def read_mesh(
    path: Path, *, metres: float = 1.0, statements: CadStatements | None = None
) -> GivenMesh:
    """Read a mesh of solids with its groups.

    gmsh .msh, Abaqus .inp, Nastran .bdf, I-deas .unv or Salome .med. Bodies come from groups of
    elements, surfaces from groups of facets or of nodes, or from statements. Linear tetrahedra get
    mid-side nodes on their straight edges; where hexahedra or wedges are among the elements, all of
    them stay as they are.

    Parameters
    ----------
    path : Path
        Mesh file.
    metres : float
        Length unit of its coordinates [m].
    statements : CadStatements, optional
        Surfaces by axis, radius and station, the carrier's frame, and which groups of the file are
        which body.

    Returns
    -------
    TetMesh or NamedSolids
        Tetrahedra alone, ``symmetry_order`` 1 whatever symmetry the mesh has; or solids of any
        kind. Checked by :mod:`carrierflex.geometry.mesh_checks`.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is none of these files, is cut short, holds other elements or unnamed bodies, or a
        surface is not on the boundary; and from the checks: unit, unused nodes, detached pieces,
        inverted tetrahedra.
    """
    suffix = path.suffix.lower()
    if suffix != ".msh" and suffix not in FORMATS:
        raise ValueError(
            f"{path}: suffix {path.suffix!r}; expected .msh, the format that holds bodies and "
            f"surfaces, or one of {', '.join(FORMATS)}"
        )
    what = FORMATS.get(suffix, "a gmsh mesh (.msh)")
    size = check_plain_file(path, what, _MOST_BYTES, text=suffix == ".msh")
    if suffix == ".msh":
        points, blocks = in_child(_points_and_blocks, path, size, about=path, what="meshio")
        foreign = ForeignMesh(points, blocks, {})
    else:
        left_out(path)
        foreign = _without_unused_nodes(read_foreign_mesh(path, size))
    if _has_other_solids(foreign):
        return _read_solids(path, metres, statements)
    mesh = _from_blocks(foreign, path, statements)
    mesh = replace(mesh, points=_in_frame(metres * mesh.points, statements))
    check_mesh(mesh, str(path))
    facets = {name: boundary_facets(mesh.tets[cells]) for name, cells in mesh.bodies.items()}
    return replace(mesh, surfaces=_with_stated(mesh, facets, statements, str(path)))


def _read_solids(path: Path, metres: float, statements: CadStatements | None) -> NamedSolids:
    """Read a mesh that has other solids than tetrahedra."""
    solids = read_solid_mesh(path).without_unused_nodes()
    of_group = {} if statements is None else statements.body_of_group
    groups = {group: of_group.get(group, group) for _, group, _ in solids.blocks}
    bodies = _named_bodies(groups.values(), path)
    mesh = named_solids(solids, {group: bodies[name] for group, name in groups.items()}, str(path))
    mesh = replace(mesh, points=_in_frame(metres * mesh.points, statements))
    check_solids(mesh, str(path))
    facets = {body: mesh.boundary(body) for body in mesh.bodies}
    return replace(mesh, surfaces=_with_stated(mesh, facets, statements, str(path)))


def _in_frame(points: NDArray[np.float64], statements: CadStatements | None) -> NDArray[np.float64]:
    """Points of the file [m] in the carrier's frame."""
    if statements is None:
        return points
    return np.asarray((points - statements.frame.origin) @ statements.frame.rotation.T)


def _has_other_solids(mesh: ForeignMesh) -> bool:
    """Whether there are others than tetrahedra, whatever they are."""
    kinds = {kind.split(" ")[0] for kind, _, _ in mesh.blocks}
    return bool(kinds - {*_TETRAHEDRA, *_TRIANGLES, *_QUADRILATERALS, *_NO_SOLIDS})


def _without_unused_nodes(mesh: ForeignMesh) -> ForeignMesh:
    """Copy with the nodes of tetrahedra alone: reference points and nodes of beams left out."""
    solids = [nodes.ravel() for kind, _, nodes in mesh.blocks if kind in _TETRAHEDRA]
    used = np.unique(np.concatenate(solids)) if solids else np.zeros(0, dtype=np.int64)
    row = np.full(len(mesh.points), -1, dtype=np.int64)
    row[used] = np.arange(len(used))
    blocks = [
        (kind, name, row[nodes])
        for kind, name, nodes in mesh.blocks
        if kind not in _TRIANGLES or (row[nodes] >= 0).all()
    ]
    node_sets = {name: row[nodes][row[nodes] >= 0] for name, nodes in mesh.node_sets.items()}
    return ForeignMesh(mesh.points[used], blocks, node_sets)


def _points_and_blocks(
    path: Path, size: int
) -> tuple[NDArray[np.float64], list[tuple[str, str, NDArray[np.int64]]]]:
    """Points and named parts of a gmsh mesh of `size` bytes."""
    try:
        with limited(30 + size // 500_000, 100_000_000 + 60 * size):
            _refuse_cut_short(path)
            refuse_lost_groups(path)
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


def _from_blocks(mesh: ForeignMesh, path: Path, statements: CadStatements | None) -> TetMesh:
    solids: dict[str, list[NDArray[np.int64]]] = {}
    faces: dict[str, list[NDArray[np.int64]]] = {}
    of_group = {} if statements is None else statements.body_of_group
    for kind, name, nodes in mesh.blocks:
        if kind in _TETRAHEDRA:
            solids.setdefault(of_group.get(name, name), []).append(nodes)
        elif kind in _TRIANGLES and name:
            faces.setdefault(name, []).append(nodes)
        elif kind not in (*_TRIANGLES, *_NO_SOLIDS):
            raise ValueError(
                f"{path}: {len(nodes)} elements of type {kind}; expected quadratic tetrahedra "
                "(tetra10) or linear ones (tetra) only"
            )
    tets_of_body = {name: np.concatenate(nodes) for name, nodes in _bodies(solids, path).items()}
    edges = np.cumsum([0, *(len(block) for block in tets_of_body.values())])
    bodies = {name: np.arange(edges[i], edges[i + 1]) for i, name in enumerate(tets_of_body)}
    points, tets = np.asarray(mesh.points, np.float64), np.concatenate(list(tets_of_body.values()))
    if tets.shape[1] == 4:
        points, tets = quadratic_tetrahedra(points, tets)
    outside = [boundary_facets(tets[elements]) for elements in bodies.values()]
    surfaces = {
        name: _outward(np.concatenate(nodes), outside, f"{path}: surface {name!r}")
        for name, nodes in faces.items()
    }
    for name, nodes in mesh.node_sets.items():
        candidates = (of_body[np.isin(of_body[:, :3], nodes).all(axis=1)] for of_body in outside)
        # Bodies that share a surface have its facets twice; they are those of the first.
        facets = next((block for block in candidates if len(block)), None)
        if facets is not None:
            surfaces.setdefault(name, facets)
    return TetMesh(points, tets, surfaces, bodies)


def _bodies(
    solids: dict[str, list[NDArray[np.int64]]], path: Path
) -> dict[str, list[NDArray[np.int64]]]:
    """Tetrahedra by body: as named; those of one group in a foreign file are the carrier."""
    orders = {nodes.shape[1] for blocks in solids.values() for nodes in blocks}
    if len(orders) > 1:
        raise ValueError(
            f"{path}: linear and quadratic tetrahedra; expected one of the two throughout"
        )
    if not solids:
        raise ValueError(
            f"{path}: no quadratic tetrahedra; expected all of them in physical volumes such as "
            "'carrier' and 'pins'"
        )
    names = _named_bodies(solids, path)
    return {names[name]: nodes for name, nodes in solids.items()}


def _named_bodies(groups: Collection[str], path: Path) -> dict[str, str]:
    """Body of every group of elements: as named; the only one of a foreign file is the carrier."""
    if len(set(groups)) == 1 and path.suffix.lower() in FORMATS:
        return dict.fromkeys(groups, "carrier")
    if "" in groups:
        raise ValueError(
            f"{path}: elements without a physical volume's name; expected all of them in physical "
            "volumes such as 'carrier' and 'pins'"
        )
    unknown = sorted(set(groups) - {"carrier", "pins", "main_shaft"})
    if unknown:
        raise ValueError(
            f"{path}: groups of elements {', '.join(map(repr, unknown))}; expected 'carrier' and "
            "'pins', or [mesh.bodies] of the surfaces file saying which is which"
        )
    return {name: name for name in groups}


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


def _with_stated(
    mesh: NamedSurfaces,
    boundary: Mapping[str, NDArray[np.int64]],
    statements: CadStatements | None,
    where: str,
) -> dict[str, NDArray[np.int64]]:
    """Named surfaces of a mesh and those that are stated."""
    if statements is None:
        return dict(mesh.surfaces)
    if "carrier" not in boundary:
        raise ValueError(
            f"{where}: bodies {', '.join(map(repr, boundary))}; expected 'carrier' and, bonded, "
            "'pins', or [mesh.bodies] of the surfaces file saying which group of elements is which"
        )
    surfaces = dict(mesh.surfaces)
    for statement in statements.surfaces:
        surfaces[statement.name] = _stated_facets(
            mesh.points, boundary, statement, statements.tolerance, where
        )
    if "pins" in boundary and not any(name.endswith("_midspan") for name in surfaces):
        if statements.bearing_width is None:
            raise ValueError(
                f"{where}: no surface pin_1_midspan among its groups, and the surfaces file has no "
                "[pin] bearing_width; expected one of the two for the carrier with bonded pins"
            )
        for seat in _seats(mesh.points, surfaces, statements, statements.bearing_width):
            surfaces[seat.name] = _stated_facets(
                mesh.points, boundary, seat, statements.tolerance, where
            )
    return surfaces


def _seats(
    points: NDArray[np.float64],
    surfaces: Mapping[str, NDArray[np.int64]],
    statements: CadStatements,
    width: float,
) -> Iterator[SurfaceStatement]:
    """Seats of the planet bearings of a `width` [m], half-way between bores that are stated."""
    stated = {statement.name for statement in statements.surfaces}
    for number in range(1, planets_of(stated) + 1):
        names = [f"pin_{number}_{side}" for side in ("upwind", "downwind")]
        if not stated.issuperset(names):
            continue
        bore = statements.named(names[0])
        ends = [points[np.unique(surfaces[name])] @ bore.direction for name in names]
        first, last = sorted((float(end.min()), float(end.max())) for end in ends)
        middle, gap = (first[1] + last[0]) / 2.0, last[0] - first[1]
        if not width < gap:
            raise ValueError(
                f"[pin] bearing_width is {width} m; expected less than the {gap:.4g} m between the "
                f"bores of pin {number}"
            )
        window = (middle - width / 2.0, middle + width / 2.0)
        yield replace(bore, name=f"pin_{number}_midspan", window=window)


def _stated_facets(
    points: NDArray[np.float64],
    boundary: Mapping[str, NDArray[np.int64]],
    statement: SurfaceStatement,
    tolerance: float,
    where: str,
) -> NDArray[np.int64]:
    """Boundary facets whose corners all lie on the stated plane or cylinder, in its window."""
    body = "pins" if statement.name.endswith("_midspan") else "carrier"
    if body not in boundary:
        raise ValueError(
            f"{where}: surface {statement.name!r} is stated of a mesh without a body 'pins'; "
            "expected it of the carrier with bonded pins only"
        )
    facets = boundary[body]
    corners = points[facets[:, : FACET_CORNERS[facets.shape[1]]]]
    along = corners @ statement.direction
    radius = np.linalg.norm(np.cross(corners - statement.point, statement.direction), axis=2)
    measured, inside = (along, radius) if statement.kind == "plane" else (radius, along)
    low, high = statement.window
    on = (np.abs(measured - statement.size) <= tolerance).all(axis=1)
    if statement.name == "rim_face":
        _refuse_crossed_circle(inside[on], low, tolerance, where)
    within = (inside >= low - tolerance) & (inside <= high + tolerance)
    stated = facets[on & within.all(axis=1)]
    if not len(stated):
        raise ValueError(
            f"{where}: no facet lies on surface {statement.name!r}, the {statement}, within "
            f"{tolerance:g} m; expected one that element edges bound"
        )
    return stated


def _refuse_crossed_circle(
    radii: NDArray[np.float64], circle: float, tolerance: float, where: str
) -> None:
    """Refuse facets of the rim's plane, radii (k, m) of their corners, that the circle cuts."""
    crossed = (radii.min(axis=1) < circle - tolerance) & (radii.max(axis=1) > circle + tolerance)
    if crossed.any():
        outside = radii[radii > circle + tolerance].min()
        raise ValueError(
            f"{where}: {int(crossed.sum())} facets of surface 'rim_face' lie across its inner "
            f"radius of {circle:.6g} m, the sensors' circle; expected element edges along it (the "
            f"mesh's next nodes outside lie at {outside:.6g} m)"
        )


def quadratic_tetrahedra(
    points: NDArray[np.float64], tets: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Nodes and quadratic tetrahedra of linear ones.

    Linear tetrahedra are far too stiff in bending; with nodes in their edges the same body is
    computed as well as its flat faces allow.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Nodes [m].
    tets : ndarray of int, shape (m, 4)
        Corners.

    Returns
    -------
    points : ndarray, shape (n + n_edges, 3)
        The nodes and, after them, the middles of all edges.
    tets : ndarray of int, shape (m, 10)
        In the order of :data:`carrierflex.geometry.tet_mesh.TET_EDGES`.
    """
    ends = np.sort(tets[:, np.array(TET_EDGES)], axis=2)
    edges, number = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
    middles = points[edges].mean(axis=1)
    of_element = len(points) + number.reshape(len(tets), len(TET_EDGES))
    return np.concatenate([points, middles]), np.concatenate([tets, of_element], axis=1)
