"""Reduced bodies joined at coinciding pilots.

Translations tied, rotations sprung or tied (2012 paper, section 3.1).

The coordinates q of the assembly give those of all bodies, ``x = L q``. A joint may also hold its
second pilot at a given small motion relative to its first, ``x = L q + x0`` with x0 on that pilot's
coordinates alone: the bodies' statics ``K x = f`` then read ``Lᵀ K L q = Lᵀ f - Lᵀ K x0``, and a
sensor reads ``S x = S L q + S x0``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from carrierflex.reduction.reduced_model import MassProperties, ReducedModel

#: Pilots farther apart than this [m] are not one joint.
_SAME_POINT = 1e-6


@dataclass(frozen=True)
class Joint:
    """A tie of two pilots at one point.

    Translations equal, relative rotations against springs or tied as well.

    Raises
    ------
    ValueError
        Where a stiffness is negative.
    """

    first: str
    """Pilot on one body; keeps its translations."""
    second: str
    """Pilot on the other; its translations become the first's."""
    bending_stiffness: float
    """Against relative rotation about y and z [N m/rad]; infinite ties it."""
    torsional_stiffness: float
    """Against relative rotation about x, the pin's axis [N m/rad]; infinite ties it."""
    slides: bool = False
    """Whether the second body is free to slide along x in the first."""

    def __post_init__(self) -> None:
        for name in ("bending_stiffness", "torsional_stiffness"):
            if not getattr(self, name) >= 0.0:
                raise ValueError(
                    f"joint {self.first}-{self.second}: {name} is {getattr(self, name)}; expected "
                    "0 or more"
                )

    @property
    def stiffness(self) -> NDArray[np.float64]:
        """Against relative rotation about x, y and z [N m/rad], shape (3,)."""
        return np.array([self.torsional_stiffness, self.bending_stiffness, self.bending_stiffness])

    @property
    def tied(self) -> NDArray[np.bool_]:
        """Which of the pilots' six coordinates are tied, shape (6,)."""
        return np.concatenate([[not self.slides, True, True], np.isinf(self.stiffness)])


@dataclass(frozen=True, eq=False)
class ImposedMotion:
    """What a given relative motion in joints adds to an assembly of n coordinates.

    Parameters
    ----------
    load : ndarray, shape (n,)
        ``-Lᵀ K x0`` [N, N m], on the right-hand side for as long as the motion is there.
    sensor_offset : ndarray, shape (n_sensors,)
        ``S x0`` [m], to be added to the sensor rows' readings.
    pilot_offset : mapping of str to ndarray, shape (6,)
        x0: motion of each held pilot beyond its coordinates in the assembly [m, rad].
    stiffness_work : float
        ``x0ᵀ K x0`` [J], for the strain energy.
    """

    load: NDArray[np.float64]
    sensor_offset: NDArray[np.float64]
    pilot_offset: Mapping[str, NDArray[np.float64]]
    stiffness_work: float

    def strain_energy(self, K: NDArray[np.float64], q: NDArray[np.float64]) -> float:
        """Energy ``xᵀ K x / 2`` [J] in the bodies and joints, K and q (n,) being the assembly's."""
        return float(q @ K @ q / 2.0 - q @ self.load + self.stiffness_work / 2.0)


def assembled(name: str, bodies: Sequence[ReducedModel], joints: Sequence[Joint]) -> ReducedModel:
    """Join reduced bodies.

    Parameters
    ----------
    name : str
        Name of the assembly.
    bodies : sequence of ReducedModel
        Bodies in one frame, no two with a pilot or sensor of the same name.
    joints : sequence of Joint
        Ties between pilots of different bodies.

    Returns
    -------
    ReducedModel
        Coordinates of all bodies in their order, less the tied ones; every pilot keeps six
        coordinates.

    Raises
    ------
    ValueError
        Where names repeat, a pilot is tied twice or has fewer than six components, or the joined
        pilots are not at one point.
    KeyError
        Where a joint names a pilot that no body has.
    """
    pilots = _merged([body.pilots for body in bodies], "pilot")
    _merged([dict.fromkeys(body.sensor_names, np.zeros(0)) for body in bodies], "sensor")
    rows = _rows(bodies)
    L, row_of = _tie_matrix(sum(body.n_coordinates for body in bodies), joints, rows, pilots)
    K = scipy.linalg.block_diag(*(body.K for body in bodies))
    for joint in joints:
        _add_springs(K, rows[joint.first][3:], rows[joint.second][3:], joint)
    labels = [label for body in bodies for label in body.labels]
    first_rows = np.unique(row_of, return_index=True)[1]
    sensor_rows = [body.sensor_rows for body in bodies]
    return ReducedModel(
        name=name,
        K=L.T @ K @ L,
        M=L.T @ scipy.linalg.block_diag(*(body.M for body in bodies)) @ L,
        D=L.T @ scipy.linalg.block_diag(*(body.D for body in bodies)) @ L,
        labels=tuple(labels[row] for row in first_rows),
        pilots=pilots,
        pilot_coordinates={pilot: row_of[coordinates] for pilot, coordinates in rows.items()},
        sensor_names=tuple(sensor for body in bodies for sensor in body.sensor_names),
        sensor_rows=scipy.linalg.block_diag(*sensor_rows) @ L,
        mass_properties=_together([body.mass_properties for body in bodies]),
        provenance={
            f"{body.name}: {key}": value
            for body in bodies
            for key, value in body.provenance.items()
        },
    )


def imposed_motion(
    bodies: Sequence[ReducedModel],
    joints: Sequence[Joint],
    motions: Mapping[str, NDArray[np.float64]],
) -> ImposedMotion:
    """Load and sensor offset of given relative motions in the joints of an assembly.

    Exact to first order.

    Parameters
    ----------
    bodies, joints
        Those of :func:`assembled`.
    motions : mapping of str to ndarray, shape (6,)
        By the joint's second pilot: its translation [m] and rotation [rad] relative to the first,
        in the bodies' frame.

    Raises
    ------
    ValueError
        Where no joint has that second pilot, or the motion is along a coordinate that the joint
        does not tie.
    """
    pilots = _merged([body.pilots for body in bodies], "pilot")
    n = sum(body.n_coordinates for body in bodies)
    rows = _rows(bodies)
    L, _ = _tie_matrix(n, joints, rows, pilots)
    x0 = np.zeros(n)
    for pilot, motion in motions.items():
        joint = next((joint for joint in joints if joint.second == pilot), None)
        if joint is None:
            raise ValueError(
                f"no joint has {pilot!r} as its second pilot; expected one that holds the motion"
            )
        if any(other.first == pilot for other in joints):
            raise ValueError(
                f"pilot {pilot} carries a further joint, which would have to follow; expected the "
                "last of a chain"
            )
        if np.any(np.asarray(motion)[~joint.tied] != 0.0):
            raise ValueError(
                f"joint {joint.first}-{pilot}: a motion is imposed along a coordinate that is free "
                "or sprung; expected zero there, or an infinite stiffness"
            )
        x0[rows[pilot]] = motion
    # No springs here: a spring acts on coordinates that are not tied, and those carry no imposed
    # motion.
    K_x0 = scipy.linalg.block_diag(*(body.K for body in bodies)) @ x0
    S = scipy.linalg.block_diag(*(body.sensor_rows for body in bodies))
    offsets = {pilot: x0[rows[pilot]] for pilot in motions}
    return ImposedMotion(-L.T @ K_x0, S @ x0, offsets, float(x0 @ K_x0))


def _rows(bodies: Sequence[ReducedModel]) -> dict[str, NDArray[np.int64]]:
    """Rows of every pilot's coordinates among those of all bodies."""
    rows: dict[str, NDArray[np.int64]] = {}
    offset = 0
    for body in bodies:
        rows |= {pilot: body.coordinates_of(pilot) + offset for pilot in body.pilots}
        offset += body.n_coordinates
    return rows


def _merged(
    mappings: Sequence[Mapping[str, NDArray[np.float64]]], kind: str
) -> dict[str, NDArray[np.float64]]:
    merged: dict[str, NDArray[np.float64]] = {}
    for mapping in mappings:
        repeated = merged.keys() & mapping.keys()
        if repeated:
            raise ValueError(
                f"two bodies have a {kind} named {sorted(repeated)[0]!r}; expected different names"
            )
        merged.update(mapping)
    return merged


def _tie_matrix(
    n: int,
    joints: Sequence[Joint],
    rows: dict[str, NDArray[np.int64]],
    pilots: dict[str, NDArray[np.float64]],
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Matrix L (n, n_kept) from kept to all coordinates, and the kept one of each of all n."""
    representative = np.arange(n)
    for joint in joints:
        for pilot in (joint.first, joint.second):
            if pilot not in rows:
                raise KeyError(f"no body has a pilot {pilot!r}; there are {', '.join(rows)}")
        gap = float(np.linalg.norm(pilots[joint.first] - pilots[joint.second]))
        if gap > _SAME_POINT:
            raise ValueError(
                f"pilots {joint.first} and {joint.second} are {gap:.3g} m apart; expected one point"
            )
        tied = rows[joint.second][joint.tied]
        if (representative[tied] != tied).any():
            raise ValueError(f"pilot {joint.second} is tied twice; expected one joint a pilot")
        representative[tied] = rows[joint.first][joint.tied]
    # A chain of joints may be given in any order: follow it to its end.
    while (representative[representative] != representative).any():
        representative = representative[representative]
    first_rows, row_of = np.unique(representative, return_inverse=True)
    L = np.zeros((n, len(first_rows)))
    L[np.arange(n), row_of] = 1.0
    return L, row_of


def _add_springs(
    K: NDArray[np.float64], a: NDArray[np.int64], b: NDArray[np.int64], joint: Joint
) -> None:
    # Tied rotations need no spring.
    stiffness = np.where(np.isinf(joint.stiffness), 0.0, joint.stiffness)
    K[a, a] += stiffness
    K[b, b] += stiffness
    K[a, b] -= stiffness
    K[b, a] -= stiffness


def _together(bodies: list[MassProperties]) -> MassProperties:
    mass = sum(body.mass for body in bodies)
    centre = sum((body.mass * body.centre for body in bodies), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for body in bodies:
        r = body.centre - centre
        inertia += body.inertia + body.mass * (r @ r * np.eye(3) - np.outer(r, r))
    return MassProperties(mass, centre, inertia)
