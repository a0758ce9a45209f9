"""How the boundary of the parametric carrier moves with each of its dimensions.

Every face is the zero of a signed distance ``φ(x; p)`` to a plane of constant x or a cylinder along
x. A node that stays on the face has the velocity V = dx/dp with

    ∇φ · V = -∂φ/∂p.

The derivatives by p are taken by a complex step (Squire and Trapp, SIAM Review 40, 1998, 110-112):
exact to rounding, and no dimension has to be changed. What the equations leave free, the tangential
motion within a face and the motion inside the solid, is left to
:func:`carrierflex.fe.shape_extension.extended_velocity`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.parameter_files import StageParameters
from carrierflex.geometry.parameters import CarrierParameters, PinParameters, half_sector_angle
from carrierflex.geometry.tet_mesh import TetMesh, boundary_facets

#: Complex step [m]: its square is nothing beside any dimension.
IMAGINARY_STEP = 1e-30
#: Distance [m] at which a node counts as lying on a face.
_ON = 1e-7
#: Dimensions that move the carrier without pins: solid, bearing seat and sensor circle.
CARRIER_DIMENSIONS = (
    "carrier.outer_radius", "carrier.upwind_plate_thickness", "carrier.downwind_plate_thickness",
    "carrier.plate_gap", "carrier.centre_distance", "carrier.pin_hole_diameter",
    "carrier.web_inner_radius", "carrier.planet_clearance_radius", "carrier.hub_outer_diameter",
    "carrier.hub_inner_diameter", "carrier.hub_length", "carrier.upwind_bearing_width",
    "carrier.seat_outer_diameter", "carrier.seat_inner_diameter", "carrier.seat_length",
    "carrier.sensor_radius",
)  # fmt: skip
#: Dimensions of the pins that are none of the carrier's: a pin's diameter is its hole's.
PIN_DIMENSIONS = ("pin.bearing_width",)
#: Dimensions that are one and the same, by the first: `StageParameters` refuses other values.
_THE_SAME = {
    "carrier.centre_distance": ("gear.centre_distance",),
    "carrier.pin_hole_diameter": ("pin.diameter",),
}

P = TypeVar("P")


@dataclass(frozen=True, eq=False)
class BoundaryMotion:
    """Velocity of boundary nodes along given directions, for k motions at once.

    Parameters
    ----------
    nodes : ndarray of int, shape (m,)
        A node for every direction; one on an edge comes once for each of its faces.
    normals : ndarray, shape (m, 3)
        Unit directions.
    rates : ndarray, shape (m, k)
        Velocity along them [m per unit of the parameter].
    """

    nodes: NDArray[np.int64]
    normals: NDArray[np.float64]
    rates: NDArray[np.float64]


def dimensions_of(*, pins: bool) -> tuple[str, ...]:
    """Dimensions that move a variant's mesh, as ``table.key`` of the parameter file."""
    return CARRIER_DIMENSIONS + (PIN_DIMENSIONS if pins else ())


def dimension_value(stage: StageParameters, dimension: str) -> float:
    """Value of a dimension ``table.key`` [m]."""
    table, key = dimension.split(".")
    return float(getattr(getattr(stage, table), key))


def with_step(stage: StageParameters, dimension: str, step: float) -> StageParameters:
    """Copy of `stage` with `step` [m] added to a dimension ``table.key``.

    Raises
    ------
    ValueError
        Where the dimensions then contradict each other.
    """
    return replace(
        stage,
        **{
            table: replace(getattr(stage, table), **changes)
            for table, changes in _stepped(stage, dimension, step).items()
        },
    )


def with_imaginary_step(stage: StageParameters, dimension: str) -> StageParameters:
    """Copy of `stage` with ``j IMAGINARY_STEP`` added to a dimension ``table.key``.

    Any function of dimensions that is analytic then has its derivative as imaginary part over the
    step. The copy is not checked: complex numbers have no order.
    """
    tables = _stepped(stage, dimension, 1j * IMAGINARY_STEP).items()
    return _unchecked(
        stage, **{name: _unchecked(getattr(stage, name), **changes) for name, changes in tables}
    )


def _stepped(stage: StageParameters, dimension: str, step: Any) -> dict[str, dict[str, Any]]:
    """New values by table and key, of the dimension and of those that are the same."""
    changes: dict[str, dict[str, Any]] = {}
    for name in (dimension, *_THE_SAME.get(dimension, ())):
        table, key = name.split(".")
        changes.setdefault(table, {})[key] = getattr(getattr(stage, table), key) + step
    return changes


def _unchecked(values: P, **changes: Any) -> P:
    copy = object.__new__(type(values))
    copy.__dict__.update(values.__dict__, **changes)
    return copy


def parametric_motion(
    half: TetMesh, stage: StageParameters, dimensions: Sequence[str]
) -> BoundaryMotion:
    """Motion of a half sector's boundary per unit change of each dimension.

    Nodes on the cut planes stay on them. Nodes on the edges that bound a bearing's seat or carry
    the sensor circle follow these, and those on the sensor circle keep their angle: the recovery
    rows then stay what they are.

    Parameters
    ----------
    half : TetMesh
        Half sector of :mod:`carrierflex.geometry.carrier_mesh`.
    stage : StageParameters
        Its dimensions.
    dimensions : sequence of str
        Which ones move it, as ``table.key``.

    Raises
    ------
    ValueError
        Where a facet of the boundary lies on no face of the carrier.
    """
    pins = "pins" in half.bodies
    facets = np.concatenate([boundary_facets(half.tets[cells]) for cells in half.bodies.values()])
    corners, points = half.points[facets], half.points
    faces = _faces(stage.carrier)
    moved = [with_imaginary_step(stage, dimension) for dimension in dimensions]
    moved_faces = [_faces(one.carrier) for one in moved]
    on_some = np.zeros(len(facets), dtype=np.bool_)
    rows = []
    nodes_of = {}
    for name, face in faces.items():
        on = face.holds(corners).all(axis=1)
        on_some |= on
        nodes_of[name] = nodes = np.unique(facets[on])
        rates = [faces[name].distance(points[nodes]).imag for faces in moved_faces]
        rows.append((nodes, face.normals(points[nodes]), _rates(rates, nodes)))
    if not on_some.all():
        raise ValueError(
            f"{np.count_nonzero(~on_some)} of {len(facets)} facets of the mesh's boundary lie on "
            "no face of the carrier; expected the mesh of these dimensions"
        )
    # Edges imprinted on a face: they move with a plane or cylinder that is no face there.
    imprints = _imprints(stage.carrier, stage.pin, pins=pins)
    moved_imprints = [_imprints(one.carrier, one.pin, pins=pins) for one in moved]
    for number, (name, edge) in enumerate(imprints):
        nodes = nodes_of[name][edge.holds(points[nodes_of[name]])]
        rates = [edges[number][1].distance(points[nodes]).imag for edges in moved_imprints]
        normals = edge.normals(points[nodes])
        rows.append((nodes, normals, _rates(rates, nodes)))
        if isinstance(edge, _Cylinder):
            tangents = np.cross([1.0, 0.0, 0.0], normals)
            rows.append((nodes, tangents, np.zeros((len(nodes), len(dimensions)))))
    return BoundaryMotion(
        np.concatenate([nodes for nodes, _, _ in rows]),
        np.concatenate([normals for _, normals, _ in rows]),
        np.concatenate([rates for _, _, rates in rows]),
    )


def _rates(steps: Sequence[NDArray[np.float64]], nodes: NDArray[np.int64]) -> NDArray[np.float64]:
    """``-∂φ/∂p``, shape (n, k), from the imaginary distances of the nodes after each step."""
    return -np.reshape(steps, (len(steps), len(nodes))).T / IMAGINARY_STEP


@dataclass(frozen=True)
class _Plane:
    """Points at one distance from the origin along a unit normal."""

    normal: tuple[float, float, float]
    station: Any

    def distance(self, points: NDArray[np.float64]) -> NDArray[Any]:
        return points @ np.array(self.normal) - self.station + 0j

    def holds(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        return np.asarray(np.abs(self.distance(points).real) < _ON)

    def normals(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.tile(self.normal, (len(points), 1))


@dataclass(frozen=True)
class _Cylinder:
    """Points at the distance `radius` from the line (y, z) = (0, centre), from x[0] to x[1]."""

    radius: Any
    centre: Any
    x: tuple[Any, Any]

    def distance(self, points: NDArray[np.float64]) -> NDArray[Any]:
        off = np.sqrt(points[..., 1] ** 2 + (points[..., 2] - self.centre) ** 2 + 0j)
        return np.asarray(off - self.radius)

    def holds(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        low, high = np.real(self.x)
        between = (points[..., 0] > low - _ON) & (points[..., 0] < high + _ON)
        return np.asarray(between & (np.abs(self.distance(points).real) < _ON))

    def normals(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        arm = points * [0.0, 1.0, 1.0] - [0.0, 0.0, float(np.real(self.centre))]
        return np.asarray(arm / np.linalg.norm(arm, axis=-1, keepdims=True))


_Face = _Plane | _Cylinder


def _across(x: Any) -> _Plane:
    """Plane of constant x."""
    return _Plane((1.0, 0.0, 0.0), x)


def _faces(p: CarrierParameters) -> dict[str, _Face]:
    """Faces of the half sector: those of :mod:`carrierflex.geometry.carrier_solid`, cut planes."""
    end_a, (start_b, end_b) = p.upwind_bore_x[1], p.downwind_bore_x
    seat_end = end_b + p.seat_length
    angle = half_sector_angle(p.n_planets)
    return {
        "hub end": _across(-p.hub_length),
        "upwind face": _across(0.0),
        "inner face upwind": _across(end_a),
        "inner face downwind": _across(start_b),
        "downwind face": _across(end_b),
        "seat end": _across(seat_end),
        "rim": _Cylinder(p.outer_radius, 0.0, (0.0, end_b)),
        "web inside": _Cylinder(p.web_inner_radius, 0.0, (end_a, start_b)),
        "planet pocket": _Cylinder(p.planet_clearance_radius, p.centre_distance, (end_a, start_b)),
        "hub": _Cylinder(p.hub_outer_diameter / 2.0, 0.0, (-p.hub_length, 0.0)),
        "hub bore": _Cylinder(p.hub_inner_diameter / 2.0, 0.0, (-p.hub_length, end_a)),
        "seat": _Cylinder(p.seat_outer_diameter / 2.0, 0.0, (end_b, seat_end)),
        "seat bore": _Cylinder(p.seat_inner_diameter / 2.0, 0.0, (start_b, seat_end)),
        # The holes are drilled past hub and seat; a bonded pin goes on between the plates.
        "pin hole": _Cylinder(
            p.pin_hole_diameter / 2.0, p.centre_distance, (-p.hub_length, seat_end)
        ),
        "pin plane": _Plane((0.0, 1.0, 0.0), 0.0),
        "web plane": _Plane((0.0, float(np.cos(angle)), float(np.sin(angle))), 0.0),
    }


def _imprints(p: CarrierParameters, pin: PinParameters, *, pins: bool) -> list[tuple[str, _Face]]:
    """Edges that :mod:`carrierflex.geometry.half_sector` imprints: face, and what they lie on."""
    circle = _Cylinder(p.sensor_radius, 0.0, (0.0, 0.0))
    edges: list[tuple[str, _Face]] = [("upwind face", circle)]
    edges += [("hub", _across(x)) for x in p.upwind_bearing_x]
    edges += [("pin hole", _across(x)) for x in (0.0, p.downwind_bore_x[1])]
    if pins:
        middle = p.upwind_plate_thickness + p.plate_gap / 2.0
        reach = pin.bearing_width / 2.0
        edges += [("pin hole", _across(x)) for x in (middle - reach, middle + reach)]
    return edges
