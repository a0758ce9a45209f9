"""The planetary stage's equations of motion in the carrier frame.

Constant matrices, turning loads, contact channels.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.problems import refuse
from carrierflex.geometry.dihedral import rotation_about_x
from carrierflex.simulation.stage.channels import Channels, stage_channels
from carrierflex.simulation.stage.coordinate_layout import CoordinateLayout
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.springs import Spring, mount_matrices, stage_springs
from carrierflex.simulation.stage.stage_body import StageBody
from carrierflex.simulation.stage.stage_data import StageData

#: Force that the rigid drive motion may meet, over the largest stiffness on its way: rounding
#: leaves 1e-13.
_GROUNDED = 1e-9
#: Turns of a (6, 6) matrix, by angles that average a function of orders up to two exactly.
_TURNS = tuple(
    np.kron(np.eye(2), rotation_about_x(angle)) for angle in 2.0 * np.pi * np.arange(8) / 8
)


@dataclass(frozen=True, eq=False)
class Loads:
    """Generalised forces in the coordinates c, shapes (n,); y and z in the carrier frame.

    Parameters
    ----------
    torque : ndarray
        Of 1 N m on the main shaft.
    generator : ndarray
        Of 1 N m on the generator, about +x.
    weight_y, weight_z : ndarray
        Of an acceleration of 1 m/s^2 along y or z.
    radial_y, radial_z : ndarray
        Of 1 N along y or z where the radial load acts.
    constant : ndarray
        Misalignment, free elongations, and ``Omega^2 J M r_0``, which with the Coriolis force of
        the drive's speed, ``-2 Omega^2 J M r_0``, is the centrifugal force.
    """

    torque: NDArray[np.float64]
    generator: NDArray[np.float64]
    weight_y: NDArray[np.float64]
    weight_z: NDArray[np.float64]
    radial_y: NDArray[np.float64]
    radial_z: NDArray[np.float64]
    constant: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class StageModel:
    """``M c'' + (C + Omega G) c' + K c = f + B lambda(Bᵀ c, Bᵀ c', theta)``.

    With c = (theta, y) and ``q = L c``.

    Parameters
    ----------
    layout : CoordinateLayout
        Where every coordinate stands.
    effects : StageEffects
        What departs from the nominal stage.
    speed : float
        Carrier speed that the small rotating terms are taken at [rad/s].
    L : ndarray, shape (n, n)
        All coordinates q from c: first column the rigid drive motion, the others a unit each.
    K, M, C, G : ndarray, shape (n, n)
        Stiffness with mean mesh stiffness, mass, damping of generator and mount (modal damping
        comes on top), and the antisymmetric matrix of Coriolis forces at `speed`.
    loads : Loads
        Load vectors.
    channels : Channels
        Meshes, mount and clearances.
    springs : mapping of str to Spring
        Linear connections, for their loads; rows of q.
    """

    layout: CoordinateLayout
    effects: StageEffects
    speed: float
    L: NDArray[np.float64]
    K: NDArray[np.float64]
    M: NDArray[np.float64]
    C: NDArray[np.float64]
    G: NDArray[np.float64]
    loads: Loads
    channels: Channels
    springs: Mapping[str, Spring] = field(default_factory=dict)

    @property
    def data(self) -> StageData:
        """Data of the rigid parts."""
        return self.layout.data

    @property
    def labels(self) -> tuple[str, ...]:
        """Coordinates c in words.

        The carrier angle, then those of q without the rotation it replaces.
        """
        dropped = _seat_rotation(self.layout)
        return (
            "carrier angle [rad]",
            *(label for i, label in enumerate(self.layout.labels) if i != dropped),
        )


def stage_model(
    body: StageBody,
    data: StageData | None = None,
    *,
    effects: StageEffects | None = None,
    speed: float,
) -> StageModel:
    """Assemble the stage.

    Parameters
    ----------
    body : StageBody
        Carrier, pins and main shaft.
    data : StageData, optional
        Rigid parts, springs, gears.
    effects : StageEffects, optional
        Departures from the nominal stage.
    speed : float
        Mean carrier speed [rad/s], for Coriolis and centrifugal terms.

    Returns
    -------
    StageModel
        Equations of motion.

    Raises
    ------
    ValueError
        Where the body is bound to the ground or to a part that the drive motion moves against it,
        or the speed is not finite; where the gears cannot have so many planets, or an effect has
        another number of them.
    """
    if not np.isfinite(speed):
        raise ValueError(f"carrier speed is {speed} rad/s; expected a finite number")
    data, effects = data or StageData(), effects or StageEffects()
    refuse(data.gear.assembly_conflicts(body.n_planets))
    layout = CoordinateLayout(body, data)
    springs = stage_springs(layout, effects)
    K, M, constant = _elastic(layout, springs, effects)
    K_mount, C_mount = mount_matrices(data.mounting, layout.centre("housing"))
    H = layout.rows["housing"]
    K[np.ix_(H, H)] += _averaged(K_mount)
    L = _split(layout)
    channels = stage_channels(
        layout, effects, springs, (K_mount, C_mount), (_averaged(K_mount), _averaged(C_mount)), L
    )
    _refuse_grounded(K, layout.drive_motion)
    C = np.zeros_like(K)
    C[np.ix_(H, H)] += _averaged(C_mount)
    generator = layout.rows["generator"][0]
    C[generator, generator] += data.chain.generator_constant
    spin_stiffness, Coriolis, centrifugal = _rotating_terms(layout, M, speed, L)
    mesh = channels.B[:, channels.meshes]
    K_c = _congruent(K, L) + spin_stiffness + (mesh * channels.reference[channels.meshes]) @ mesh.T
    K_c[0], K_c[:, 0] = 0.0, 0.0
    loads = _loads(layout, M, L, L.T @ constant + centrifugal)
    return StageModel(
        layout,
        effects,
        speed,
        L,
        K_c,
        _congruent(M, L),
        _congruent(C, L),
        Coriolis,
        loads,
        channels,
        springs,
    )


def _elastic(
    layout: CoordinateLayout, springs: Mapping[str, Spring], effects: StageEffects
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Stiffness and mass of body, parts, parallel stages and springs, and the constant force."""
    n = layout.n
    body = layout.body
    data = layout.data
    K = np.zeros((n, n))
    M = np.zeros((n, n))
    force = np.zeros(n)
    n_body = body.model.n_coordinates
    K[:n_body, :n_body], M[:n_body, :n_body] = body.model.K, body.model.M
    force[:n_body] = body.misalignment_load @ effects.misalignment
    for name, rigid in layout.rigid_bodies.items():
        inertia = [rigid.polar_inertia, rigid.transverse_inertia, rigid.transverse_inertia]
        M[layout.rows[name], layout.rows[name]] = [rigid.mass] * 3 + inertia
    chain = data.chain
    for shaft in ("low_speed", "intermediate", "high_speed", "generator"):
        M[layout.rows[shaft][0], layout.rows[shaft][0]] = getattr(chain, f"{shaft}_inertia")
    hub = body.model.coordinates_of(layout.hub)
    arm = layout.arm_at_hub(data.mounting.coupling_arm)
    moment = data.mounting.coupling_mass * arm
    M[np.ix_(hub, hub)] += _point_mass(data.mounting.coupling_mass, moment, moment * arm)
    M[hub[3], hub[3]] += data.mounting.rotor_inertia
    for spring in springs.values():
        K += spring.G.T @ (spring.stiffness[:, None] * spring.G)
        force += spring.G.T @ (spring.stiffness * spring.free)
    return K, M, force


def _point_mass(mass: float, moment: float, inertia: float) -> NDArray[np.float64]:
    """Mass matrix (6, 6) of a point mass at the distance moment/mass upwind of its pilot."""
    M = np.diag([mass, mass, mass, 0.0, inertia, inertia])
    # At x = -arm: u_y = y - arm rz, u_z = z + arm ry.
    M[1, 5] = M[5, 1] = -moment
    M[2, 4] = M[4, 2] = moment
    return M


def _averaged(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean over a turn of a (6, 6) matrix of the fixed frame as the carrier frame sees it."""
    return sum((R.T @ matrix @ R for R in _TURNS), np.zeros((6, 6))) / len(_TURNS)


def _seat_rotation(layout: CoordinateLayout) -> int:
    return int(layout.body.model.coordinates_of("upwind_seat")[3])


def _split(layout: CoordinateLayout) -> NDArray[np.float64]:
    """Matrix L: carrier angle along the drive motion in place of the upwind seat's rotation."""
    retained = np.delete(np.arange(layout.n), _seat_rotation(layout))
    L = np.zeros((layout.n, layout.n))
    L[:, 0] = layout.drive_motion
    L[retained, np.arange(1, layout.n)] = 1.0
    return L


def _congruent(X: NDArray[np.float64], L: NDArray[np.float64]) -> NDArray[np.float64]:
    """``Lᵀ X L`` of a symmetric X; but for its first column L only selects."""
    rows = L[:, 1:].argmax(axis=0)
    r = L[:, 0]
    of_drive = X @ r
    Y = np.empty_like(X)
    Y[0, 0] = r @ of_drive
    Y[0, 1:] = Y[1:, 0] = of_drive[rows]
    Y[1:, 1:] = X[np.ix_(rows, rows)]
    return Y


def _refuse_grounded(K: NDArray[np.float64], drive: NDArray[np.float64]) -> None:
    force = np.abs(K @ drive) / (np.abs(K) @ np.abs(drive)).max()
    if force.max() > _GROUNDED:
        raise ValueError(
            f"turning the drive train meets a force, {force.max():.1e} of its stiffness; expected "
            "a body that turns freely "
            "(its pilots or its stiffness do not fit the stage)"
        )


def _rotating_terms(
    layout: CoordinateLayout, M: NDArray[np.float64], speed: float, L: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Centrifugal stiffness, Coriolis matrix and constant force of the drive motion, in c.

    The centrifugal stiffness is ``Omega^2 J M J``.
    """
    n = layout.n
    spin_stiffness = np.zeros((n, n))
    Coriolis = np.zeros((n, n))
    force = np.zeros(n)
    if speed == 0.0:
        return spin_stiffness, Coriolis, force
    J = layout.turning
    S = L[:, 1:]
    r = layout.drive_motion
    spin_stiffness[1:, 1:] = speed**2 * S.T @ J @ M @ J @ S
    Coriolis[1:, 1:] = speed * S.T @ (M @ J + J @ M) @ S
    inward = S.T @ (J @ (M @ r))
    Coriolis[1:, 0], Coriolis[0, 1:] = 2.0 * speed * inward, -2.0 * speed * inward
    force[1:] = speed**2 * inward
    return spin_stiffness, Coriolis, force


def _loads(
    layout: CoordinateLayout,
    M: NDArray[np.float64],
    L: NDArray[np.float64],
    constant: NDArray[np.float64],
) -> Loads:
    hub = layout.body.model.coordinates_of(layout.hub)
    arm = layout.arm_at_hub(layout.data.mounting.ntl_arm)

    def unit(*entries: tuple[int, float]) -> NDArray[np.float64]:
        """Unit loads on rows of the unreduced coordinates, as independent coordinates see them."""
        f = np.zeros(layout.n)
        for row, value in entries:
            f[row] = value
        return L.T @ f

    weight = M @ layout.translations
    # A radial force at x = -arm: moment (-arm, 0, 0) × F.
    return Loads(
        torque=unit((hub[3], 1.0)),
        generator=unit((layout.rows["generator"][0], 1.0)),
        weight_y=L.T @ weight[:, 1],
        weight_z=L.T @ weight[:, 2],
        radial_y=unit((hub[1], 1.0), (hub[5], -arm)),
        radial_z=unit((hub[2], 1.0), (hub[4], arm)),
        constant=constant,
    )
