"""The main shaft's mesh.

A tube with the carrier's dihedral symmetry, layer by layer along its axis.
"""

import math
from typing import Any

import gmsh

from carrierflex.geometry.dihedral import completed
from carrierflex.geometry.half_sector import (
    MeshingError,
    extracted,
    on_cut_planes,
    quiet_geometry,
    refuse_useless_size,
)
from carrierflex.geometry.main_shaft_parameters import MainShaftParameters
from carrierflex.geometry.named_surfaces import with_main_shaft_surfaces
from carrierflex.geometry.parameters import CarrierParameters, half_sector_angle
from carrierflex.geometry.quality import check_quality
from carrierflex.geometry.tet_mesh import TetMesh

#: Layers are this many element edges long: nothing changes quickly along a plain shaft.
_LAYER_OVER_SIZE = 2.0
#: Fewest elements around the half sector: coarser ones bulge out of the bore.
_FEWEST_AROUND = 2


def main_shaft_mesh(carrier: CarrierParameters, shaft: MainShaftParameters, size: float) -> TetMesh:
    """Mesh the main shaft in the carrier's frame.

    Parameters
    ----------
    carrier : CarrierParameters
        Dimensions [m] that place the joint.
    shaft : MainShaftParameters
        Dimensions [m].
    size : float
        Edge length of the elements in the cross-section [m]; along the axis they are at most twice
        as long.

    Returns
    -------
    TetMesh
        Body ``main_shaft`` with dihedral symmetry, so that torsion and bending do not couple;
        surfaces ``coupling_flange``, ``main_bearing_seat`` and ``carrier_joint``.

    Raises
    ------
    ValueError
        Where `size` is useless or the shaft does not fit the carrier.
    MeshingError, InvertedElementError
        From meshing and from the quality check.
    """
    refuse_useless_size(size)
    shaft.check_fits(carrier)
    with quiet_geometry() as geometry:
        try:
            half = _half_sector(geometry, carrier, shaft, size)
        except MeshingError:
            raise
        except Exception as error:
            raise MeshingError(
                f"gmsh could not mesh the main shaft at size {size} m: {error}"
            ) from error
    check_quality(half)
    return with_main_shaft_surfaces(completed(half, carrier.n_planets), carrier, shaft)


def _half_sector(
    geometry: Any, carrier: CarrierParameters, shaft: MainShaftParameters, size: float
) -> TetMesh:
    """Mesh the shaft's sector from a pin's plane to a web's.

    Its flange's face, swept to the seat, along it and on to the joint.
    """
    occ = gmsh.model.occ
    start = shaft.flange_x(carrier)
    angle, bore = half_sector_angle(carrier.n_planets), shaft.inner_diameter / 2.0
    section = [(2, _section(start, (bore, shaft.outer_diameter / 2.0), angle))]
    for end in (*shaft.bearing_seat_x(carrier), shaft.joint_x(carrier)):
        layers = math.ceil((end - start) / (_LAYER_OVER_SIZE * size))
        swept = occ.extrude(section, end - start, 0.0, 0.0, numElements=[layers], recombine=False)
        section, start = [swept[0]], end
    geometry.synchronize()
    for option in ("Mesh.MeshSizeMin", "Mesh.MeshSizeMax"):
        gmsh.option.setNumber(option, size)
    _subdivide_bore(bore, math.ceil(angle * bore / size))
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(2)
    return on_cut_planes(extracted(lambda volume: "main_shaft"), carrier.n_planets)


def _section(x: float, radii: tuple[float, float], angle: float) -> int:
    """Ring sector from 0 to `angle` in the plane at `x`; its number in gmsh."""
    occ = gmsh.model.occ
    inner, outer = radii
    s, c = math.sin(angle), math.cos(angle)
    centre = occ.addPoint(x, 0.0, 0.0)
    a, b = (occ.addPoint(x, 0.0, r) for r in (inner, outer))
    d, e = (occ.addPoint(x, -r * s, r * c) for r in (outer, inner))
    lines = [
        occ.addLine(a, b),
        occ.addCircleArc(b, centre, d),
        occ.addLine(d, e),
        occ.addCircleArc(e, centre, a),
    ]
    face = occ.addPlaneSurface([occ.addCurveLoop(lines)])
    occ.remove([(0, centre)])
    return int(face)


def _subdivide_bore(radius: float, n_elements: int) -> None:
    """Give the arcs of the bore enough elements, whatever the size asked for."""
    n = max(_FEWEST_AROUND, n_elements)
    reach = radius + 1e-6
    for dimension, curve in gmsh.model.getEntities(1):
        x_low, y_low, z_low, x_high, y_high, z_high = gmsh.model.getBoundingBox(dimension, curve)
        inside = max(abs(value) for value in (y_low, y_high, z_low, z_high)) < reach
        if inside and x_high - x_low < 1e-6:
            gmsh.model.mesh.setTransfiniteCurve(curve, n + 1)
