"""Stiffness, mass, pilots and sensors of one body: what statics and reduction start from."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.assembly import Assembly, assemble_stiffness_and_mass
from carrierflex.fe.couplings import Pilot, distributing_pilot, weighted_pilot
from carrierflex.fe.load_cases import PilotLoad, radial
from carrierflex.fe.materials import BODY_MATERIALS, Material
from carrierflex.fe.matrices.dof_layout import DofLayout
from carrierflex.fe.pilot_overlaps import refuse_dependent_pilots
from carrierflex.fe.rim_circle import rim_recovery
from carrierflex.fe.surface_integrals import rigid_body_modes
from carrierflex.geometry.carrier_interface import CarrierInterface
from carrierflex.geometry.parameters import CarrierParameters
from carrierflex.geometry.pins import pin_angles
from carrierflex.geometry.tet_mesh import NamedSurfaces, TetMesh

#: Angles of the sensor circle: one degree apart.
N_SENSOR_ANGLES = 360


@dataclass(frozen=True, eq=False)
class Sensors:
    """Recovery rows of a body's sensors.

    Parameters
    ----------
    names : tuple of str
        ``rim_axial_000`` ... ``rim_axial_359``, then ``rim_radial_000`` ...: displacement of the
        rim's material point at that carrier-frame angle [deg].
    radius : float
        Radius of the circle [m].
    rows : csr_array, shape (n_sensors, n_dofs)
        Recovery matrix: sensor displacement [m] from nodal displacement [m].
    """

    names: tuple[str, ...]
    radius: float
    rows: sp.csr_array


@dataclass(frozen=True, eq=False)
class StructuralModel:
    """One free elastic body.

    Parameters
    ----------
    name : str
        Name of the body, as in ``flexible_carrier``.
    K, M : csr_array, shape (n_dofs, n_dofs)
        Stiffness [N/m] and mass [kg] of the free body, three degrees of freedom a node.
    points : ndarray, shape (n, 3)
        Node coordinates [m].
    pilots : tuple of Pilot
        Interface, in the order of the reduced coordinates.
    sensors : Sensors or None
        Recovery rows; None for a body without sensors.
    rigid_points : ndarray, shape (p, 3)
        Pilots of rigid couplings [m], whose six coordinates follow the nodes' among the degrees of
        freedom; none by default.
    L : csr_array or None, shape (3 n_all, n_dofs)
        Displacement of all nodes of the mesh from the degrees of freedom; None where these are the
        nodes' own.
    layout : DofLayout or None
        Degrees of freedom where some node has others than its three translations (or all six of a
        rigid point); None where none has.
    free_motions : ndarray, shape (6, k), or None
        Combinations of rigid motions that nothing holds; None where that is all six.
    """

    name: str
    K: sp.csr_array
    M: sp.csr_array
    points: NDArray[np.float64]
    pilots: tuple[Pilot, ...]
    sensors: Sensors | None = None
    rigid_points: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3)))
    L: sp.csr_array | None = None
    layout: DofLayout | None = None
    free_motions: NDArray[np.float64] | None = None

    @property
    def rigid_modes(self) -> NDArray[np.float64]:
        """Rigid motions about the origin, shape (n_dofs, 6)."""
        if self.layout is not None:
            return self.layout.rigid_modes(np.zeros(3))
        return rigid_body_modes(self.points, self.rigid_points, np.zeros(3))

    def nodal_displacement(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Displacement of all nodes of the mesh, three rows a node.

        From the degrees of freedom, shape (n_dofs,) or (n_dofs, k).
        """
        return u if self.L is None else self.L @ u

    @property
    def n_dofs(self) -> int:
        """Number of degrees of freedom."""
        return int(self.K.shape[0])

    def load_vector(self, loads: Mapping[str, PilotLoad]) -> NDArray[np.float64]:
        """Nodal forces of loads at pilots, ``f = Σ Gᵀ F`` [N], shape (n_dofs,).

        Raises
        ------
        KeyError, ValueError
            Where a load names a pilot that the body does not have, or acts on a motion that the
            pilot does not couple.
        """
        f = np.zeros(self.n_dofs)
        pilots = {pilot.name: pilot for pilot in self.pilots}
        for name, load in loads.items():
            if name not in pilots:
                raise KeyError(f"{self.name} has no pilot {name!r}; it has {', '.join(pilots)}")
            f += pilots[name].nodal_forces(load)
        return f


def carrier_pilot_points(
    carrier: CarrierParameters | CarrierInterface,
) -> dict[str, NDArray[np.float64]]:
    """Pilot positions [m] by surface name: shaft face, bearing seats, bores, pin mid-spans."""
    if isinstance(carrier, CarrierInterface):
        return dict(carrier.points)
    seat_x = carrier.length_between_faces + carrier.seat_length / 2.0
    points = {
        "shaft_face": np.array([-carrier.hub_length, 0.0, 0.0]),
        "upwind_seat": np.array([-carrier.hub_length / 2.0, 0.0, 0.0]),
        "downwind_seat": np.array([seat_x, 0.0, 0.0]),
    }
    for number, angle in enumerate(pin_angles(carrier.n_planets), start=1):
        axis = carrier.centre_distance * radial(float(angle))
        for section, x in zip(("upwind", "midspan", "downwind"), carrier.pin_stations, strict=True):
            points[f"pin_{number}_{section}"] = axis + np.array([x, 0.0, 0.0])
    return points


def structural_model(
    name: str,
    mesh: TetMesh,
    carrier: CarrierParameters | CarrierInterface,
    pilots: tuple[str, ...],
    *,
    materials: Mapping[str, Material] = BODY_MATERIALS,
    assembly: Assembly = assemble_stiffness_and_mass,
) -> StructuralModel:
    """Assemble a body and couple its pilots; a body with a rim face gets the sensor circle's rows.

    Parameters
    ----------
    name : str
        Name of the body.
    mesh : TetMesh
        Mesh with the surfaces that `pilots` names.
    carrier : CarrierParameters or CarrierInterface
        Dimensions that place the pilots [m], or the pilots' places read off the mesh.
    pilots : tuple of str
        Surfaces to couple, in the order the reduced coordinates will have.
    materials : mapping
        Material of every body of the mesh.
    assembly : callable
        What makes K and M of mesh and materials.

    Returns
    -------
    StructuralModel
        The free body.

    Raises
    ------
    KeyError, ValueError
        Where a surface is missing or cannot hold a pilot, pilots on shared nodes are dependent, or
        a body has no material.
    """
    return coupled_model(name, mesh, carrier, pilots, lambda: assembly(mesh, materials))


def coupled_model(
    name: str,
    mesh: NamedSurfaces,
    carrier: CarrierParameters | CarrierInterface,
    pilots: tuple[str, ...],
    matrices: Callable[[], tuple[sp.csr_array, sp.csr_array]],
) -> StructuralModel:
    """:func:`structural_model` of a mesh of any elements, `matrices` making its K and M."""
    points = carrier_pilot_points(carrier)
    coupled = tuple(distributing_pilot(mesh, surface, points[surface]) for surface in pilots)
    refuse_dependent_pilots(coupled, mesh.points)
    sensors = rim_sensors(mesh, carrier.sensor_radius) if "rim_face" in mesh.surfaces else None
    K, M = matrices()
    return StructuralModel(name, K, M, mesh.points, coupled, sensors)


def with_equal_node_weights(structure: StructuralModel, mesh: NamedSurfaces) -> StructuralModel:
    """Copy of a body whose pilots average the nodes of their surfaces with equal weights.

    Preprocessors write RBE3 that way.

    Corner and mid-side nodes count alike, so that the coupling depends on the mesh;
    :func:`structural_model` weighs by area.

    Parameters
    ----------
    structure : StructuralModel
        Body with distributing pilots.
    mesh : NamedSurfaces
        Its mesh.

    Raises
    ------
    KeyError, ValueError
        As :func:`carrierflex.fe.couplings.weighted_pilot`.
    """
    pilots = (
        weighted_pilot(
            mesh, pilot.name, pilot.point, np.ones(len(np.unique(mesh.surface(pilot.name))))
        )
        for pilot in structure.pilots
    )
    return replace(structure, pilots=tuple(pilots))


def sensor_names() -> tuple[str, ...]:
    """Names of the sensor circle's rows: axial, then radial displacement at every angle [deg]."""
    return tuple(
        f"rim_{kind}_{degree:03d}"
        for kind in ("axial", "radial")
        for degree in range(N_SENSOR_ANGLES)
    )


def rim_sensors(mesh: NamedSurfaces, radius: float) -> Sensors:
    """Sensor circle of a whole body, its radius in metres."""
    angles = 2.0 * np.pi * np.arange(N_SENSOR_ANGLES) / N_SENSOR_ANGLES
    axial, radial_rows = rim_recovery(mesh, radius, angles)
    return Sensors(sensor_names(), radius, sp.csr_array(sp.vstack([axial, radial_rows])))


#: Pilots that every carrier has.
_ON_THE_AXIS = ("shaft_face", "upwind_seat", "downwind_seat")


def flexible_carrier_pilots(n_planets: int) -> tuple[str, ...]:
    """Interface of the carrier without pins."""
    sides = ("upwind", "downwind")
    pins = range(1, n_planets + 1)
    return (*_ON_THE_AXIS, *(f"pin_{pin}_{side}" for pin in pins for side in sides))


def stiff_carrier_pilots(n_planets: int) -> tuple[str, ...]:
    """Interface of the carrier with bonded pins."""
    return (*_ON_THE_AXIS, *(f"pin_{pin}_midspan" for pin in range(1, n_planets + 1)))


#: Interface of pin 1 alone; the other pins are the same body turned.
PIN_PILOTS = ("pin_1_upwind", "pin_1_midspan", "pin_1_downwind")
