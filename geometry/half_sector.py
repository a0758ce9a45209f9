"""One half sector of the carrier, meshed with gmsh: 60 degrees of three planets, 45 of four.

It reaches from a pin's meridional plane to a web's.

The half sector is the carrier's smallest part under its dihedral symmetry: mirrored and rotated
it gives the whole (:mod:`carrierflex.geometry.dihedral`), with cut faces that match
because they are their own mirror images.
"""

import math
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import gmsh
import numpy as np
import pygmsh
from numpy.typing import NDArray

from carrierflex.geometry.carrier_solid import carrier_solid, solid_cylinder
from carrierflex.geometry.parameters import (
    CarrierParameters,
    PinParameters,
    half_sector_angle,
)
from carrierflex.geometry.tet_mesh import TetMesh

#: gmsh numbers the last two mid-side nodes of a quadratic tetrahedron the other way round.
_FROM_GMSH_TET10 = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]
_GMSH_TET10 = 11
#: HXT: the fastest of gmsh's algorithms on this geometry; the frontal one gave inverted curved
#: elements.
_HXT = 10
#: Signals whose handlers gmsh replaces when it is opened.
_REPLACED_BY_GMSH = (signal.SIGINT, signal.SIGPIPE)
#: A wedge that reaches past every carrier [m].
_FAR = 10.0


class MeshingError(RuntimeError):
    """gmsh could not build or mesh the geometry."""


def carrier_half_sector(
    carrier: CarrierParameters, size: float, *, pin: PinParameters | None = None
) -> TetMesh:
    """Mesh the half sector of the carrier, with half a bonded pin where `pin` is given.

    Parameters
    ----------
    carrier : CarrierParameters
        Dimensions [m].
    size : float
        Edge length of the elements [m].
    pin : PinParameters, optional
        With it, half of pin 1 is part of the mesh and shares the nodes of its bores (the paper's
        stiff variant); without it the bores are empty (the flexible variant).

    Returns
    -------
    TetMesh
        Bodies ``carrier`` and, with a pin, ``pins``; no surfaces yet.

    Raises
    ------
    ValueError
        Where `size` is not positive or the pin does not fit the carrier.
    MeshingError
        Where gmsh fails; the message holds gmsh's last error.
    """
    refuse_useless_size(size)
    circles = [(0.0, 0.0, carrier.sensor_radius)]
    circles += [(x, 0.0, carrier.hub_outer_diameter / 2.0) for x in carrier.upwind_bearing_x]
    # Where a pin hole notches hub or seat, the bore must still end at the plate's face.
    plate_faces = (carrier.upwind_bore_x[0], carrier.downwind_bore_x[1])
    circles += [(x, carrier.centre_distance, carrier.pin_hole_radius) for x in plate_faces]
    with quiet_geometry() as geometry:
        carrier_parts = carrier_solid(geometry, carrier, (0.0,))
        wedge = _wedge(geometry, half_sector_angle(carrier.n_planets))
        solids = [geometry.boolean_intersection([*carrier_parts, wedge])[0]]
        if pin is not None:
            pin.check_fits(carrier)
            solids.append(_pin_solid(geometry, carrier, pin))
            circles += _bearing_circles(carrier, pin)
        return _meshed(geometry, carrier, solids, circles=circles, size=size)


def pin_half(carrier: CarrierParameters, pin: PinParameters, size: float) -> TetMesh:
    """Mesh the half of pin 1 on the side of increasing angle.

    Its bores and bearing seat are marked by element edges.

    Parameters and errors are those of :func:`carrier_half_sector`; the only body is ``pins``.
    """
    refuse_useless_size(size)
    pin.check_fits(carrier)
    circles = _bearing_circles(carrier, pin)
    for x in (carrier.upwind_bore_x[1], carrier.downwind_bore_x[0]):
        circles.append((x, carrier.centre_distance, pin.diameter / 2.0))
    with quiet_geometry() as geometry:
        return _meshed(
            geometry, carrier, [_pin_solid(geometry, carrier, pin)], circles=circles, size=size
        )


@contextmanager
def quiet_geometry() -> Iterator[Any]:
    """Open pygmsh's OpenCASCADE session without gmsh's messages.

    Python's own handling of signals stays: gmsh puts the system's in its place, which ends the
    process on the spot at an interrupt, and without a word where it writes to a process that has
    ended; and it does not put Python's back. Only the main thread can.
    """
    session = pygmsh.occ.Geometry(init_argv=["carrierflex", "-v", "0"])
    with _kept_handlers() as put_back, session as geometry:
        put_back()
        yield geometry


@contextmanager
def _kept_handlers() -> Iterator[Callable[[], None]]:
    """Handlers of this process's signals after the block; what is given puts them back in it."""
    in_main_thread = threading.current_thread() is threading.main_thread()
    handlers = {number: signal.getsignal(number) for number in _REPLACED_BY_GMSH}

    def put_back() -> None:
        if in_main_thread:
            for number, handler in handlers.items():
                signal.signal(number, handler)

    try:
        yield put_back
    finally:
        put_back()


def refuse_useless_size(size: float) -> None:
    """Raise ValueError where `size` [m] is no usable element edge length.

    Usable is what a part of a gearbox can be meshed with, from carriers of 0.02 m on.
    """
    if not (math.isfinite(size) and 0.0002 <= size <= 0.2):
        raise ValueError(
            f"mesh size is {size!r} m; expected an edge length between 0.0002 and 0.2 m"
        )


def _bearing_circles(
    carrier: CarrierParameters, pin: PinParameters
) -> list[tuple[float, float, float]]:
    """Circles that bound the planet bearings' seat on the pin.

    Each as (x, distance of the centre from the axis, radius) [m].
    """
    middle = carrier.upwind_plate_thickness + carrier.plate_gap / 2.0
    ends = (middle - pin.bearing_width / 2.0, middle + pin.bearing_width / 2.0)
    return [(x, carrier.centre_distance, pin.diameter / 2.0) for x in ends]


def _wedge(geometry: Any, angle: float) -> Any:
    """Everything between the meridional planes at 0 and at `angle` [rad]."""
    s, c = math.sin(angle), math.cos(angle)
    corners = [[-_FAR, 0.0, 0.0], [-_FAR, 0.0, _FAR], [-_FAR, -_FAR * s, _FAR * c]]
    return geometry.extrude(geometry.add_polygon(corners), [2.0 * _FAR, 0.0, 0.0])[1]


def _pin_solid(geometry: Any, carrier: CarrierParameters, pin: PinParameters) -> Any:
    x = (0.0, carrier.length_between_faces)
    pin_cylinder = solid_cylinder(geometry, x, pin.diameter / 2.0, (0.0, carrier.centre_distance))
    wedge = _wedge(geometry, half_sector_angle(carrier.n_planets))
    return geometry.boolean_intersection([pin_cylinder, wedge])[0]


def _imprint(
    solids: list[Any],
    circles: list[tuple[float, float, float]],
    angle_from_axis: float,
) -> None:
    """Cut the solids' faces along circles, and the solids along the faces they share.

    Circles about the carrier's axis end at `angle_from_axis` [rad].
    """
    occ = gmsh.model.occ
    arcs = []
    for x, centre, radius in circles:
        # A circle about the pin is cut in half by the plane at 0 deg; one about the axis ends at
        # the web's plane.
        angle = math.pi if centre else angle_from_axis
        start = occ.addPoint(x, 0.0, centre + radius)
        half = occ.addPoint(
            x, -radius * math.sin(angle / 2.0), centre + radius * math.cos(angle / 2.0)
        )
        end = occ.addPoint(x, -radius * math.sin(angle), centre + radius * math.cos(angle))
        arcs.append((1, occ.addCircleArc(start, half, end, center=False)))
    occ.fragment([(3, solid._id) for solid in solids], arcs)
    occ.synchronize()


def _meshed(
    geometry: Any,
    carrier: CarrierParameters,
    solids: list[Any],
    *,
    circles: list[tuple[float, float, float]],
    size: float,
) -> TetMesh:
    for option in ("Mesh.MeshSizeMin", "Mesh.MeshSizeMax"):
        gmsh.option.setNumber(option, size)
    gmsh.option.setNumber("Mesh.Algorithm3D", _HXT)
    try:
        geometry.synchronize()
        _imprint(solids, circles, half_sector_angle(carrier.n_planets))
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2)
        mesh = extracted(lambda volume: "pins" if _is_pin(volume, carrier) else "carrier")
        return on_cut_planes(mesh, carrier.n_planets)
    except Exception as error:
        raise MeshingError(
            f"gmsh could not mesh the half sector at size {size} m: {error}"
        ) from error


def extracted(body_of: Callable[[int], str]) -> TetMesh:
    """Copy nodes and elements out of gmsh, numbered from 0 without gaps.

    Parameters
    ----------
    body_of : callable
        Name of the body that a gmsh volume belongs to.
    """
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    all_points = coordinates.reshape(-1, 3)
    row = np.zeros(int(tags.max()) + 1, dtype=np.int64)
    row[tags] = np.arange(len(tags))
    blocks: dict[str, list[NDArray[np.int64]]] = {}
    for _, volume in gmsh.model.getEntities(3):
        types, _, nodes = gmsh.model.mesh.getElements(3, volume)
        for kind, numbers in zip(types, nodes, strict=True):
            if kind != _GMSH_TET10:
                raise MeshingError(
                    f"gmsh returned element type {kind}; expected quadratic tetrahedra "
                    f"({_GMSH_TET10})"
                )
            tets = row[numbers.astype(np.int64)].reshape(-1, 10)[:, _FROM_GMSH_TET10]
            blocks.setdefault(body_of(volume), []).append(tets)
    # In the order of their names, whatever the order of gmsh's volumes.
    by_body = {name: np.concatenate(blocks[name]) for name in sorted(blocks)}
    used, compact = np.unique(np.concatenate(list(by_body.values())), return_inverse=True)
    edges = np.cumsum([0, *(len(cells) for cells in by_body.values())])
    bodies = {name: np.arange(edges[i], edges[i + 1]) for i, name in enumerate(by_body)}
    return TetMesh(all_points[used], compact.reshape(-1, 10), {}, bodies)


def _is_pin(volume: int, carrier: CarrierParameters) -> bool:
    _, _, z_low, _, _, z_high = gmsh.model.getBoundingBox(3, volume)
    reach = carrier.pin_hole_radius + 1e-6
    return z_low > carrier.centre_distance - reach and z_high < carrier.centre_distance + reach


def on_cut_planes(mesh: TetMesh, n_planets: int) -> TetMesh:
    """Move nodes within rounding of a cut plane onto it, so that mirror images coincide exactly.

    The planes are those of a half sector: of pin 1, and of the web beside it.
    """
    points = mesh.points
    angle = half_sector_angle(n_planets)
    s, c = math.sin(angle), math.cos(angle)
    snapped = points.copy()
    snapped[np.abs(points[:, 1]) < 1e-9, 1] = 0.0
    # Distance from the web's plane, whose tangential normal is t(angle) = (0, -cos, -sin).
    distance = -c * points[:, 1] - s * points[:, 2]
    near = np.abs(distance) < 1e-9
    snapped[near] -= distance[near, None] * np.array([0.0, -c, -s])
    return replace(mesh, points=snapped)
