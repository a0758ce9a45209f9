"""Rim curves of the carrier under a torque of 1 kN m: axial, then radial.

Pins are bonded, absent, or have a fit.

Statics of the parts that CalculiX solved are joined by their flexibilities: bores and pin ends
share their mean translation, and a spring joins their mean turns.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from validation.independent_carrier.calculix_elements import (
    ANTISYMMETRIC,
    SYMMETRIC,
    Elastic,
    displacement,
    stiffness,
)
from validation.independent_carrier.section_mesh import (
    DRAWN,
    HALF_SECTOR,
    LAYERS,
    N_PLANETS,
    PIN,
    Dimensions,
    FloatArray,
    Section,
    section_mesh,
)
from validation.independent_carrier.stack import (
    Stack,
    facets_on,
    stack,
    stations,
    surface_moments,
)

ComplexArray = NDArray[np.complex128]
Mask = NDArray[np.bool_]

UNIT_TORQUE = 1000.0
#: Orders 0, 3 ... 30 of the rim: a torque that loads all pins alike makes no others.
ORDERS = N_PLANETS * np.arange(11)
#: Teeth, pressure and helix angle of the gears (2012 paper, table 3).
_SUN_TEETH, _PLANET_TEETH = 21, 39
_PRESSURE, _HELIX = math.radians(20.0), math.radians(7.5)
#: EN-GJS-700-2 and steel, as the project's drawing has them.
CAST_IRON, STEEL = Elastic(176e9, 0.275), Elastic(210e9, 0.3)
_CLASSES = (SYMMETRIC, ANTISYMMETRIC)
#: Mirrors a rigid motion at the pin's plane y = 0.
_MIRROR = np.diag([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
#: Motions up to this one are moves, those after it turns.
_LAST_MOVE = 2
#: Rows of both ends among those of a pin's stiffness.
_ENDS = [0, 1, 2, 6, 7, 8]
#: The rim's samples over a half sector.
_SAMPLES = 180


@dataclass(frozen=True)
class Carrier:
    """A carrier as made: dimensions [m] and materials."""

    dimensions: Dimensions = field(default_factory=lambda: dict(DRAWN))
    cast_iron: Elastic = CAST_IRON
    steel: Elastic = STEEL

    @property
    def materials(self) -> dict[str, Elastic]:
        """Material by body."""
        return {"CARRIER": self.cast_iron, "PINS": self.steel}


@dataclass(frozen=True, eq=False)
class _Pilot:
    """Mean rigid motion of a surface of pin 1, its half lying on the half sector."""

    B: FloatArray
    Z: FloatArray

    def force(self, load: FloatArray) -> FloatArray:
        """Nodal forces, shape (n, 3), of a load (6,) on the whole surface."""
        return np.asarray((self.B.T @ np.linalg.solve(self.Z, load)).reshape(-1, 3))

    def motion(self, u: FloatArray, motions: tuple[int, ...]) -> FloatArray:
        """Motions of one class of the displacements u, shape (k, n, 3): (k, 3)."""
        both = np.zeros((6, len(u)))
        both[list(motions)] = 2.0 * (self.B @ u.reshape(len(u), -1).T)[list(motions)]
        return np.asarray(np.linalg.solve(self.Z, both).T[:, list(motions)])


class TruthCarrier:
    """The parts of one carrier, meshed once.

    Parameters
    ----------
    carrier : Carrier
        What is made.
    size : float
        Edge length of the elements [m].
    """

    def __init__(self, carrier: Carrier, size: float) -> None:
        self.carrier, self.size = carrier, size
        self.d = carrier.dimensions
        self.x = stations(self.d)
        self.section: Section = section_mesh(self.d, size)

    def _stack(self, bodies: dict[str, tuple[str, ...]]) -> Stack:
        return stack(self.section, self.d, bodies, self.size)

    def bonded(self) -> ComplexArray:
        """Orders of the rim, shape (2, 11), pins bonded into their bores, shaft face held."""
        mesh = self._stack({"CARRIER": LAYERS, "PINS": (PIN,)})
        pilot = self._bore_pilot(mesh, "PINS", "midspan")
        force, moment = _pin_load(self.d)
        rim = mesh.on_plane(0.0, self.d["sensor_radius"], self.d["sensor_radius"])
        fixed = np.zeros(mesh.points.shape, dtype=bool)
        fixed[self._shaft_face(mesh)] = True
        K = stiffness(mesh, self.carrier.materials)
        total = np.zeros((2, len(ORDERS)), dtype=np.complex128)
        for motions, load in ((ANTISYMMETRIC, force), (SYMMETRIC, moment)):
            u = displacement(mesh, K, motions, fixed, pilot.force(load)[None])
            total += _orders(mesh, rim, u, motions)[0]
        return total

    def flexible(self, *, clamped: bool = True) -> "FlexibleCarrier":
        """Answer of the carrier without pins to unit loads on its bores.

        Its shaft face is held node by node, or by its mean motion alone.
        """
        mesh = self._stack({"CARRIER": LAYERS})
        pilots = [self._bore_pilot(mesh, "CARRIER", plate) for plate in ("plate_a", "plate_b")]
        shaft = self._shaft_face(mesh)
        rim = mesh.on_plane(0.0, self.d["sensor_radius"], self.d["sensor_radius"])
        K = stiffness(mesh, self.carrier.materials)
        flexibility, orders = [], []
        for motions in _CLASSES:
            fixed = np.zeros(mesh.points.shape, dtype=bool)
            forces = [pilot.force(np.eye(6)[c]) for pilot in pilots for c in motions]
            if clamped:
                fixed[shaft] = True
            else:
                mean = _MeanMotion(mesh, shaft, 0 if motions == SYMMETRIC else 3)
                forces = [mean.balanced(force) for force in forces]
                fixed[mean.support] = True
            u = displacement(mesh, K, motions, fixed, np.array(forces))
            if not clamped:
                u = mean.removed(u)
            flexibility.append(np.concatenate([p.motion(u, motions) for p in pilots], axis=1).T)
            orders.append(_orders(mesh, rim, u, motions))
        return FlexibleCarrier(self.d, tuple(flexibility), tuple(orders))

    def pin_stiffness(self) -> tuple[FloatArray, FloatArray]:
        """Stiffness of the pin at its upwind end, middle and downwind end, by class: (9, 9)."""
        mesh = self._stack({"PINS": (PIN,)})
        sections = ("plate_a", "midspan", "plate_b")
        pilots = {name: self._bore_pilot(mesh, "PINS", name) for name in sections}
        K = stiffness(mesh, self.carrier.materials)
        result = []
        for motions in _CLASSES:
            index = list(motions)
            # Motion of the other two that follows the upwind end rigidly.
            follow = [
                _carried(_middle(self.d, name) - _middle(self.d, "plate_a"))
                for name in sections[1:]
            ]
            forces = []
            for name, carried in zip(sections[1:], follow, strict=True):
                for c in motions:
                    unit = np.eye(6)[c]
                    forces.append(
                        pilots[name].force(unit) - pilots["plate_a"].force(carried.T @ unit)
                    )
            u = displacement(mesh, K, motions, _three_points(mesh, motions), np.array(forces))
            first = pilots["plate_a"].motion(u, motions)
            A = np.concatenate([-carried[np.ix_(index, index)] for carried in follow])
            others = np.concatenate(
                [pilots[name].motion(u, motions) for name in sections[1:]], axis=1
            )
            F = (others + first @ A.T).T
            reach = np.concatenate([A, np.eye(6)], axis=1)
            result.append(reach.T @ np.linalg.solve((F + F.T) / 2.0, reach))
        return result[0], result[1]

    def _bore_pilot(self, mesh: Stack, body: str, name: str) -> _Pilot:
        """Mean motion of a bore, or of the pin's face, of pin 1: half of it lies on the stack."""
        facets = facets_on(mesh.wedges[body], mesh.on_bore(self.d, self.x[name]))
        B, Z = surface_moments(mesh.points, facets, _middle(self.d, name))
        return _Pilot(B, Z + _MIRROR @ Z @ _MIRROR)

    def _shaft_face(self, mesh: Stack) -> Mask:
        inner, outer = (self.d[f"hub_{side}_diameter"] / 2.0 for side in ("inner", "outer"))
        return mesh.on_plane(-self.d["hub_length"], inner, outer)


@dataclass(frozen=True, eq=False)
class FlexibleCarrier:
    """Carrier without pins: motion C of its bores and orders of its rim per unit load on them.

    Each by class, of loads on the upwind bore, then on the downwind one.
    """

    d: Dimensions
    C: tuple[FloatArray, ...]
    orders: tuple[ComplexArray, ...]

    def without_pins(self) -> ComplexArray:
        """Orders of the rim, shape (2, 11): pins as if simply supported."""
        x1, x_m, x2 = (_middle(self.d, name)[0] for name in ("plate_a", "midspan", "plate_b"))
        force, moment = _pin_load(self.d)
        upwind, couple = (x2 - x_m) / (x2 - x1), moment[4] / (x2 - x1)
        along_z = np.array([0.0, couple, 0.0, 0.0, -couple, 0.0])
        along_y = force[1] * np.array([upwind, 0.0, 0.0, 1.0 - upwind, 0.0, 0.0])
        return np.asarray(
            np.tensordot(along_z, self.orders[0], 1) + np.tensordot(along_y, self.orders[1], 1)
        )

    def with_pins(self, pin: tuple[FloatArray, FloatArray], stiffness: float) -> ComplexArray:
        """Orders of the rim, shape (2, 11): pins of a fit [N m/rad], infinite for a rigid one.

        Bore and spring follow one another, so that their flexibilities add up.
        """
        force, moment = _pin_load(self.d)
        total = np.zeros((2, len(ORDERS)), dtype=np.complex128)
        for k, (motions, load) in enumerate(zip(_CLASSES, (moment, force), strict=True)):
            springs = [1.0 / stiffness if c > _LAST_MOVE else 0.0 for c in motions]
            bed = np.linalg.inv(self.C[k] + np.diag(2 * springs))
            K, f = pin[k].copy(), np.zeros(9)
            K[np.ix_(_ENDS, _ENDS)] += bed
            f[3:6] = load[list(motions)]
            total += np.tensordot(bed @ np.linalg.solve(K, f)[_ENDS], self.orders[k], 1)
        return total


def _middle(d: Dimensions, name: str) -> FloatArray:
    """Point of the pin's axis half-way along the bore or seat [m]."""
    return np.array([sum(stations(d)[name]) / 2.0, 0.0, d["centre_distance"]])


def _pin_load(d: Dimensions) -> tuple[FloatArray, FloatArray]:
    """Load of the torque on the middle of pin 1, each shape (6,): its force, the helix's moment."""
    a = d["centre_distance"]
    force = UNIT_TORQUE / (N_PLANETS * a)
    axial = force / 2.0 / math.cos(_PRESSURE) * math.tan(_HELIX)
    pitch = 2.0 * a * _PLANET_TEETH / (_SUN_TEETH + _PLANET_TEETH)
    return force * np.eye(6)[1], -pitch * axial * np.eye(6)[4]


class _MeanMotion:
    """Mean motion of the shaft face along x or about it, by which a carrier is held."""

    def __init__(self, mesh: Stack, face: Mask, motion: int) -> None:
        B, Z = surface_moments(mesh.points, facets_on(mesh.wedges["CARRIER"], face), np.zeros(3))
        self.mean = (B[motion] / Z[motion, motion]).reshape(-1, 3)
        y, z = mesh.points[:, 1], mesh.points[:, 2]
        still = np.zeros_like(y)
        self.rigid = np.stack([still + 1, still, still] if motion == 0 else [still, -z, y], axis=1)
        node = int(np.flatnonzero(face & mesh.on_pin_plane)[0])
        self.support = (node, 0 if motion == 0 else 1)

    def balanced(self, force: FloatArray) -> FloatArray:
        """The force and the traction on the face that balances it."""
        return force - self.mean * float(np.sum(self.rigid * force))

    def removed(self, u: FloatArray) -> FloatArray:
        """Displacements less their mean motion of the face."""
        return u - np.einsum("kni,ni->k", u, self.mean)[:, None, None] * self.rigid


def _carried(arm: FloatArray) -> FloatArray:
    """Motion of a point at the arm that follows a rigid motion, shape (6, 6)."""
    G = np.eye(6)
    for c, axis in enumerate(np.eye(3)):
        G[:3, 3 + c] = np.cross(axis, arm)
    return G


def _three_points(mesh: Stack, motions: tuple[int, ...]) -> Mask:
    """Support of a free pin, on its plane of symmetry, that takes no force of balanced loads."""
    fixed = np.zeros(mesh.points.shape, dtype=bool)
    x, _, z = mesh.points.T
    plane = np.flatnonzero(mesh.on_pin_plane)
    first = plane[np.argmin(x[plane] + z[plane])]
    last = plane[np.argmax(x[plane] - z[plane])]
    high = plane[np.argmin(x[plane] - z[plane])]
    if motions == SYMMETRIC:
        fixed[first, [0, 2]] = fixed[last, 2] = True
    else:
        fixed[[first, last, high], 1] = True
    return fixed


def _orders(mesh: Stack, rim: Mask, u: FloatArray, motions: tuple[int, ...]) -> ComplexArray:
    """Amplitudes c of ``Re(c exp(j order angle))`` at the rim, axial then radial: (k, 2, 11)."""
    nodes = np.flatnonzero(rim)
    angle = np.arctan2(-mesh.points[nodes, 1], mesh.points[nodes, 2])
    nodes, angle = nodes[np.argsort(angle)], np.sort(angle)
    outwards = np.array([np.zeros_like(angle), -np.sin(angle), np.cos(angle)]).T
    along = np.stack([u[:, nodes, 0], np.einsum("kni,ni->kn", u[:, nodes], outwards)], axis=1)
    samples = HALF_SECTOR * np.arange(_SAMPLES + 1) / _SAMPLES
    edge = 2 * np.clip(
        np.searchsorted(angle[::2], samples, side="right") - 1, 0, len(angle) // 2 - 1
    )
    values = np.zeros((*along.shape[:2], len(samples)))
    for i in range(3):
        shape = np.ones_like(samples)
        for j in range(3):
            if j != i:
                shape *= (samples - angle[edge + j]) / (angle[edge + i] - angle[edge + j])
        values += shape * along[..., edge + i]
    sign = 1.0 if motions == SYMMETRIC else -1.0
    pitch = np.concatenate([values[..., :-1], sign * values[..., :0:-1]], axis=-1)
    c = np.fft.rfft(pitch)[..., : len(ORDERS)] * 2.0 / pitch.shape[-1]
    c[..., 0] /= 2.0
    return np.asarray(c)
