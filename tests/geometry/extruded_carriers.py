"""The parametric carrier in hexahedra and wedges: one plane mesh, extruded layer by layer along x.

The carrier is a stack of prisms, so one plane mesh that has the edges of all of them, cut at their
stations, is a mesh of it: what a preprocessor sweeps. Quadrilaterals give hexahedra, triangles that
were left over wedges.
"""

import math
from itertools import pairwise

import gmsh
import meshio
import numpy as np

from carrierflex.geometry.given_meshes.solid_files import REFERENCE_NODES, matching_nodes
from carrierflex.geometry.half_sector import quiet_geometry
from carrierflex.geometry.pins import pin_angles

#: Kinds by the number of nodes of the plane element: linear, serendipity, complete.
KINDS = {3: "wedge", 4: "hexahedron", 8: "hexahedron20", 9: "hexahedron27"}
#: meshio's (VTK's) places of the 27-node hexahedron's nodes behind the first twenty.
_VTK_MIDDLES = np.array(
    [(0, 1, 1), (2, 1, 1), (1, 0, 1), (1, 2, 1), (1, 1, 0), (1, 1, 2), (1, 1, 1)]
) / 2.0  # fmt: skip


def extruded_carrier(carrier, size, kind, *, pin=None, all_quadrilaterals=True):
    """Points (n, 3) and blocks (kind, body, nodes) of a carrier.

    With `pin`, bonded pins of the bores' radius are the body ``pins``. `kind` is one of
    "hexahedron", "hexahedron20" and "hexahedron27"; with `all_quadrilaterals` false, some
    elements of the first are wedges.
    """
    flat, faces = _plane_mesh(carrier, size, kind, all_quadrilaterals)
    stations = _stations(carrier, pin, size)
    levels = stations if kind == "hexahedron" else _with_middles(stations)
    step = 1 if kind == "hexahedron" else 2
    points = np.array([(x, *yz) for x in levels for yz in flat])
    blocks = {}
    for layer, x in enumerate((stations[1:] + stations[:-1]) / 2.0):
        for nodes in faces:
            columns = _columns(nodes.shape[1], step)
            centre = flat[nodes[:, :4]].mean(axis=1)
            if nodes.shape[1] == 3:
                centre = flat[nodes].mean(axis=1)
            for body, inside in _bodies_at(carrier, pin, x, centre).items():
                level = (step * layer + columns[:, 0]) * len(flat)
                elements = nodes[inside][:, columns[:, 1]] + level
                if len(elements):
                    blocks.setdefault((KINDS[nodes.shape[1]], body), []).append(elements)
    merged = [(k, body, np.concatenate(pieces)) for (k, body), pieces in blocks.items()]
    used = np.unique(np.concatenate([nodes.ravel() for _, _, nodes in merged]))
    row = np.full(len(points), -1)
    row[used] = np.arange(len(used))
    return points[used], [(k, body, row[nodes]) for k, body, nodes in merged]


def _plane_mesh(carrier, size, kind, all_quadrilaterals):
    """Nodes (n, 2) as (y, z) and elements by number of nodes, all circles among their edges."""
    with quiet_geometry():
        occ = gmsh.model.occ
        radii = (
            carrier.hub_inner_diameter / 2.0, carrier.hub_outer_diameter / 2.0,
            carrier.seat_inner_diameter / 2.0, carrier.seat_outer_diameter / 2.0,
            carrier.web_inner_radius, carrier.sensor_radius, carrier.outer_radius,
        )  # fmt: skip
        discs = [(2, occ.addDisk(0.0, 0.0, 0.0, r, r)) for r in sorted(set(radii))]
        for angle in pin_angles(carrier.n_planets):
            y, z = _off(carrier, angle)
            # The pocket bounds the webs, which end at their inner radius.
            rim, inside, pocket = (
                (2, occ.addDisk(*centre, 0.0, radius, radius))
                for centre, radius in (
                    ((0.0, 0.0), carrier.outer_radius), ((0.0, 0.0), carrier.web_inner_radius),
                    ((y, z), carrier.planet_clearance_radius),
                )
            )  # fmt: skip
            discs += occ.intersect([pocket], occ.cut([rim], [inside])[0])[0]
            discs.append((2, occ.addDisk(y, z, 0.0, *2 * (carrier.pin_hole_radius,))))
        occ.fragment(discs[:1], discs[1:])
        occ.synchronize()
        for name, value in (
            # Halving every edge makes three quadrilaterals of a triangle that was left over.
            ("Mesh.MeshSizeMax", size * (2.0 if all_quadrilaterals else 1.0)),
            ("Mesh.MeshSizeFromCurvature", 16.0), ("Mesh.RecombineAll", 1.0),
            ("Mesh.RecombinationAlgorithm", 0.0),
            ("Mesh.SubdivisionAlgorithm", float(all_quadrilaterals)),
            ("Mesh.SecondOrderIncomplete", float(kind == "hexahedron20")),
        ):  # fmt: skip
            gmsh.option.setNumber(name, value)
        gmsh.model.mesh.generate(2)
        gmsh.model.mesh.setOrder(1 if kind == "hexahedron" else 2)
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        row = np.zeros(int(tags.max()) + 1, dtype=np.int64)
        row[tags] = np.arange(len(tags))
        types, _, nodes = gmsh.model.mesh.getElements(2)
        counts = [gmsh.model.mesh.getElementProperties(t)[3] for t in types]
        faces = [row[n].reshape(-1, c) for n, c in zip(nodes, counts, strict=True)]
        flat = coordinates.reshape(-1, 3)[:, :2]
        return flat, [_turned(flat, nodes_of_kind) for nodes_of_kind in faces]


def _turned(flat, faces):
    """Faces that turn about +x, as extruded elements need them."""
    corners = flat[faces[:, : 3 if faces.shape[1] == 3 else 4]]
    after = np.roll(corners, -1, axis=1)
    area = (corners[..., 0] * after[..., 1] - corners[..., 1] * after[..., 0]).sum(axis=1)
    backward = {3: [0, 2, 1], 4: [0, 3, 2, 1], 8: [0, 3, 2, 1, 7, 6, 5, 4]}
    backward[9] = [*backward[8], 8]
    turned = faces.copy()
    turned[area < 0.0] = faces[area < 0.0][:, backward[faces.shape[1]]]
    return turned


def _columns(n_nodes, step):
    """Level (0 to step) and plane node of every node of the extruded element, shape (m, 2)."""
    if n_nodes == 3:
        return np.array([(level, i) for level in (0, 1) for i in range(3)])
    corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=float)
    plane = np.concatenate([corners, (corners + np.roll(corners, -1, axis=0)) / 2.0, [(0.5, 0.5)]])
    wanted = REFERENCE_NODES[KINDS[n_nodes]].copy()
    if n_nodes == 9:
        wanted[20:] = _VTK_MIDDLES
    flat_node = [int(matching_nodes(plane, p[None, :2])[0]) for p in wanted]
    return np.column_stack([np.rint(step * wanted[:, 2]).astype(int), flat_node])


def _stations(carrier, pin, size):
    """Stations of the layers: those at which the section changes, and more in between."""
    end = carrier.length_between_faces
    given = [
        -carrier.hub_length, *carrier.upwind_bearing_x, 0.0, carrier.upwind_plate_thickness,
        carrier.downwind_bore_x[0], end, end + carrier.seat_length,
    ]  # fmt: skip
    if pin is not None:
        middle = carrier.pin_stations[1]
        given += [middle - pin.bearing_width / 2.0, middle + pin.bearing_width / 2.0]
    given = sorted(given)
    pieces = [np.linspace(a, b, 1 + math.ceil((b - a) / size))[:-1] for a, b in pairwise(given)]
    return np.concatenate([*pieces, given[-1:]])


def _with_middles(stations):
    both = np.empty(2 * len(stations) - 1)
    both[::2] = stations
    both[1::2] = (stations[1:] + stations[:-1]) / 2.0
    return both


def _bodies_at(p, pin, x, centres):
    """Which plane elements are part of each body at station x, by their centres (n, 2)."""
    r = np.hypot(*centres.T)
    to_pin = np.min(
        [np.linalg.norm(centres - _off(p, v), axis=1) for v in pin_angles(p.n_planets)], axis=0
    )
    end_a, start_b, end_b = p.upwind_plate_thickness, *p.downwind_bore_x
    if x < 0.0:
        inner, outer = p.hub_inner_diameter / 2.0, p.hub_outer_diameter / 2.0
    elif x < end_a:
        inner, outer = p.hub_inner_diameter / 2.0, p.outer_radius
    elif x < start_b:
        inner, outer = p.web_inner_radius, p.outer_radius
    elif x < end_b:
        inner, outer = p.seat_inner_diameter / 2.0, p.outer_radius
    else:
        inner, outer = p.seat_inner_diameter / 2.0, p.seat_outer_diameter / 2.0
    between = end_a < x < start_b
    hole = p.planet_clearance_radius if between else p.pin_hole_radius
    bodies = {"carrier": (r > inner) & (r < outer) & (to_pin > hole)}
    if pin is not None and 0.0 < x < end_b:
        bodies["pins"] = to_pin < p.pin_hole_radius
    return bodies


def _off(p, angle):
    return -p.centre_distance * math.sin(angle), p.centre_distance * math.cos(angle)


def write_extruded(path, carrier, size, kind, **options):
    """Mesh file (.msh, .inp) of :func:`extruded_carrier`, bodies as groups, no surfaces."""
    points, blocks = extruded_carrier(carrier, size, kind, **options)
    cells = [(kind, nodes) for kind, _, nodes in blocks]
    names = list(dict.fromkeys(body for _, body, _ in blocks))
    if path.suffix == ".inp":
        sets = {
            name: [
                np.arange(len(nodes)) if body == name else np.zeros(0, dtype=np.int64)
                for _, body, nodes in blocks
            ]
            for name in names
        }
        meshio.write(path, meshio.Mesh(points, cells, cell_sets=sets), float_fmt=".14e")
        return path
    tags = [np.full(len(nodes), 1 + names.index(body)) for _, body, nodes in blocks]
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    field_data = {name: np.array([1 + number, 3]) for number, name in enumerate(names)}
    mesh = meshio.Mesh(points, cells, cell_data=data, field_data=field_data)
    meshio.write(path, mesh, file_format="gmsh22")
    return path
