"""Carriers as a CAD program would hand them over: fillets, chamfers, bolt holes, oil bores, keyway.

Made by gmsh's OpenCASCADE from the parametric carrier.
"""

import math
from dataclasses import dataclass, replace

import gmsh
import numpy as np

from carrierflex.geometry.cad_surface_files import write_cad_statements
from carrierflex.geometry.carrier_solid import carrier_solid
from carrierflex.geometry.half_sector import quiet_geometry
from carrierflex.geometry.parameters import CarrierParameters, PinParameters
from carrierflex.geometry.pins import pin_angles

#: The default carrier with a hub that leaves room for a fillet at its root.
PLAIN = CarrierParameters(hub_outer_diameter=0.43)
#: 2.3 MW class: rim 0.72 m, three pins at 0.50 m; made up.
LARGE = CarrierParameters(
    outer_radius=0.72, upwind_plate_thickness=0.10, downwind_plate_thickness=0.07, plate_gap=0.36,
    centre_distance=0.50, pin_hole_diameter=0.22, web_inner_radius=0.38,
    planet_clearance_radius=0.34, hub_outer_diameter=0.70, hub_inner_diameter=0.48,
    hub_length=0.18, upwind_bearing_width=0.08, seat_outer_diameter=0.60, seat_inner_diameter=0.42,
    seat_length=0.09, sensor_radius=0.69,
)  # fmt: skip
FOUR = replace(
    PLAIN, n_planets=4, planet_clearance_radius=0.175, pin_hole_diameter=0.13, sensor_radius=0.412
)
FIVE = replace(FOUR, n_planets=5, planet_clearance_radius=0.145)


@dataclass(frozen=True)
class Features:
    """What the parametric carrier does not have; lengths in metres, 0 for none."""

    fillet: float = 0.0
    chamfer: float = 0.0
    bolts: int = 0
    bolt_diameter: float = 0.033
    oil_bore: float = 0.0
    keyway: bool = False
    moved: bool = False


#: Ten solids: name, dimensions, features.
SOLIDS = {
    "large_with_fillet_and_12_m30": (LARGE, Features(fillet=0.020, bolts=12, moved=True)),
    "fillet_chamfer_bolts": (PLAIN, Features(fillet=0.010, chamfer=0.004, bolts=8)),
    "bolts_oil_keyway": (PLAIN, Features(bolts=12, bolt_diameter=0.02, oil_bore=0.01, keyway=True)),
    "fillet_oil_moved": (PLAIN, Features(fillet=0.015, oil_bore=0.012, moved=True)),
    "chamfer_keyway_moved": (PLAIN, Features(chamfer=0.006, keyway=True, moved=True)),
    "four_with_fillet_and_bolts": (FOUR, Features(fillet=0.012, bolts=8, moved=True)),
    "four_with_chamfer_oil_keyway": (FOUR, Features(chamfer=0.004, oil_bore=0.01, keyway=True)),
    "five_with_bolts_and_oil": (FIVE, Features(bolts=10, bolt_diameter=0.022, oil_bore=0.008)),
    "five_with_fillet_chamfer_moved": (FIVE, Features(fillet=0.01, chamfer=0.003, moved=True)),
    "large_with_everything": (
        LARGE, Features(fillet=0.02, chamfer=0.006, bolts=12, oil_bore=0.016, keyway=True)
    ),
}  # fmt: skip
#: Where a moved solid's origin lies; its axis runs along z, its pin 1 along -x.
ORIGIN = (0.25, -0.1, 0.4)


def write_solid(name, folder):
    """STEP file (mm) and surfaces file of one of the ten solids."""
    carrier, features = SOLIDS[name]
    step, surfaces = folder / f"{name}.step", folder / f"{name}.toml"
    with quiet_geometry() as geometry:
        gmsh.option.setString("Geometry.OCCTargetUnit", "M")
        angles = [float(angle) for angle in pin_angles(carrier.n_planets)]
        carrier_solid(geometry, carrier, angles)
        geometry.synchronize()
        _add(carrier, features, angles)
        if features.moved:
            solids = gmsh.model.getEntities(3)
            gmsh.model.occ.rotate(solids, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -math.pi / 2.0)
            gmsh.model.occ.translate(solids, *ORIGIN)
            gmsh.model.occ.synchronize()
        gmsh.write(str(step))
    write_cad_statements(surfaces, carrier, PinParameters(diameter=carrier.pin_hole_diameter))
    if features.moved:
        text = surfaces.read_text()
        text = text.replace("origin = [0.0, 0.0, 0.0]", f"origin = {list(ORIGIN)}")
        text = text.replace("axis = [1.0, 0.0, 0.0]", "axis = [0.0, 0.0, 1.0]")
        surfaces.write_text(text.replace("pin_1 = [0.0, 0.0, 1.0]", "pin_1 = [-1.0, 0.0, 0.0]"))
    return step, surfaces


def _add(carrier, features, angles):
    occ = gmsh.model.occ
    if features.fillet:
        _at_circle(0.0, carrier.hub_outer_diameter / 2.0, features.fillet, occ.fillet)
    if features.chamfer:
        _chamfer(0.0, carrier.outer_radius, features.chamfer)
    tools = []
    middle = (carrier.hub_inner_diameter + carrier.hub_outer_diameter) / 4.0
    for k in range(features.bolts):
        angle = 2.0 * math.pi * k / features.bolts
        y, z = -middle * math.sin(angle), middle * math.cos(angle)
        length = 0.6 * carrier.hub_length
        radius = features.bolt_diameter / 2.0
        tools.append((3, occ.addCylinder(-carrier.hub_length, y, z, length, 0.0, 0.0, radius)))
    if features.oil_bore:
        for angle in angles:
            e = np.array([0.0, -math.sin(angle), math.cos(angle)])
            start = carrier.centre_distance * e + [carrier.upwind_plate_thickness / 2.0, 0.0, 0.0]
            along = (carrier.outer_radius - carrier.centre_distance + 0.01) * e
            tools.append((3, occ.addCylinder(*start, *along, features.oil_bore / 2.0)))
    if features.keyway:
        bore = carrier.hub_inner_diameter / 2.0
        length = 0.7 * carrier.hub_length
        start = (-carrier.hub_length, -0.02, bore - 0.02)
        tools.append((3, occ.addBox(*start, length, 0.04, 0.032)))
    if tools:
        occ.cut(gmsh.model.getEntities(3), tools)
    occ.synchronize()


def _at_circle(x, radius, size, operation):
    """Round the edge that runs along a circle about the axis."""
    ((_, solid),) = gmsh.model.getEntities(3)
    operation([solid], [tag for _, tag in _circle_edges(x, radius)], [size])
    gmsh.model.occ.synchronize()


def _chamfer(x, radius, size):
    ((_, solid),) = gmsh.model.getEntities(3)
    edges = [tag for _, tag in _circle_edges(x, radius)]
    faces = [int(gmsh.model.getAdjacencies(1, edge)[0][0]) for edge in edges]
    gmsh.model.occ.chamfer([solid], edges, faces, [size])
    gmsh.model.occ.synchronize()


def _circle_edges(x, radius):
    for dimension, tag in gmsh.model.getEntities(1):
        low, high = gmsh.model.getParametrizationBounds(1, tag)
        points = np.array(gmsh.model.getValue(1, tag, np.linspace(low[0], high[0], 9)))
        points = points.reshape(-1, 3)
        on_circle = np.abs(np.hypot(points[:, 1], points[:, 2]) - radius) < 1e-6
        if on_circle.all() and (np.abs(points[:, 0] - x) < 1e-6).all():
            yield dimension, tag
