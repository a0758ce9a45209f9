"""What teeth, pins and bearings carry, from coordinates over time."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.pins import pin_angles
from carrierflex.simulation.stage.channels import ROLLING_ROWS
from carrierflex.simulation.stage.contact_laws import mesh_stiffness_over, spline_force
from carrierflex.simulation.stage.roller_contact import roller_loads
from carrierflex.simulation.stage.stage_data import EXPONENT
from carrierflex.simulation.stage.stage_model import StageModel
from carrierflex.simulation.stage.statics import mesh_amplitudes


@dataclass(frozen=True, eq=False)
class PartLoads:
    """Loads of the stage's parts over N instants.

    Parameters
    ----------
    mesh_force : ndarray, shape (N, 4 p)
        Force along the normal [N] of p planets: drive flanks of the sun, of the ring, then coast
        flanks.
    pin_force : ndarray, shape (N, p, 3)
        Force of each planet on its pin [N]: x, radial (away from the axis), tangential (along
        increasing angle).
    pin_moment : ndarray, shape (N, p, 3)
        Moment on the pin [N m] about the same directions.
    """

    mesh_force: NDArray[np.float64]
    pin_force: NDArray[np.float64]
    pin_moment: NDArray[np.float64]

    @property
    def load_share(self) -> NDArray[np.float64]:
        """Each planet's share of the tangential pin forces, shape (N, p)."""
        tangential = self.pin_force[:, :, 2]
        return np.asarray(tangential / tangential.sum(axis=1, keepdims=True))

    @property
    def pin_load(self) -> NDArray[np.float64]:
        """Size of the load across each pin [N], shape (N, p)."""
        return np.asarray(np.linalg.norm(self.pin_force[:, :, 1:], axis=2))

    def row_forces(self, spacing: float) -> NDArray[np.float64]:
        """Force of each planet's upwind and downwind row across the pin [N], shape (N, p, 2, 2).

        ``F / 2 +- x × M / h`` of pin force F, pin moment M and rows ``h = spacing`` [m] apart;
        radial and tangential.
        """
        radial, tangential = self.pin_moment[:, :, 1], self.pin_moment[:, :, 2]
        apart = np.stack([tangential, -radial], axis=2) / spacing
        middle = 0.5 * self.pin_force[:, :, 1:]
        return np.stack([middle - apart, middle + apart], axis=2)

    def row_load(self, spacing: float) -> NDArray[np.float64]:
        """Size of :meth:`row_forces` [N], shape (N, p, 2)."""
        return np.asarray(np.linalg.norm(self.row_forces(spacing), axis=3))


def part_loads(model: StageModel, c: NDArray[np.float64]) -> PartLoads:
    """Loads from coordinates c, shape (N, n), the first of which is the carrier angle."""
    channels = model.channels
    delta = c @ channels.B - channels.free
    real, imag = mesh_amplitudes(channels)
    k = mesh_stiffness_over(real, imag, channels.mesh_teeth * c[:, 0])
    penetration = np.maximum(delta[:, channels.meshes] - channels.gaps, 0.0)
    slices = channels.of_flanks(k) * penetration
    n_planets = model.layout.n_planets
    mesh = slices.reshape(len(c), 2, -1, 2 * n_planets).sum(axis=2).reshape(len(c), -1)
    force, moment = np.zeros((len(c), n_planets, 3)), np.zeros((len(c), n_planets, 3))
    for i, angle in enumerate(pin_angles(n_planets)):
        load = spring_load(model, f"planet_{i + 1}", c)
        if len(channels.rollers.directions):
            rolling = delta[:, channels.rolling.start + 4 * i + np.arange(4)]
            load[:, ROLLING_ROWS] = roller_loads(channels.rollers, i, rolling, delta[:, 0])[0]
        axes = np.array(
            [
                [1.0, 0.0, 0.0],
                [0.0, -np.sin(angle), np.cos(angle)],
                [0.0, -np.cos(angle), -np.sin(angle)],
            ]
        )
        force[:, i], moment[:, i] = load[:, :3] @ axes.T, load[:, 3:] @ axes.T
    return PartLoads(mesh, force, moment)


def mesh_misalignment(model: StageModel, c: NDArray[np.float64]) -> NDArray[np.float64]:
    """Slope of the gap of each mesh over the face width in the plane of action, over N instants.

    ``n · ((rotation of the planet - rotation of the mate) x e_x)``: positive where the flanks part
    downwind.

    Parameters
    ----------
    model : StageModel
        The stage.
    c : ndarray, shape (N, n)
        Coordinates.

    Returns
    -------
    ndarray, shape (N, 2 p)
        Slopes of the drive flanks of p planets [rad]: of the sun, then of the ring.
    """
    rows, q = model.layout.rows, c[:, 1:] @ model.L[:, 1:].T
    slopes = np.zeros((len(c), len(model.channels.stiffness)))
    for i, line in enumerate(model.channels.lines[: slopes.shape[1]]):
        turned = q[:, rows[f"planet_{line.planet}"][3:]] - q[:, rows[line.mate][3:]]
        slopes[:, i] = np.cross(turned, [1.0, 0.0, 0.0]) @ line.normal
    return slopes


def part_tilt(model: StageModel, body: str, c: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation of a rigid part about y and z of the carrier frame over N instants.

    Parameters
    ----------
    model : StageModel
        The stage.
    body : str
        ``sun``, ``ring``, ``housing`` or ``planet_i``.
    c : ndarray, shape (N, n)
        Coordinates.

    Returns
    -------
    ndarray, shape (N, 2)
        Rotations [rad].
    """
    rows = model.layout.rows[body][4:6]
    return np.asarray(c[:, 1:] @ model.L[rows, 1:].T)


def spring_load(model: StageModel, name: str, c: NDArray[np.float64]) -> NDArray[np.float64]:
    """Force of a spring that resists its elongation, over N instants.

    Parameters
    ----------
    model : StageModel
        The stage.
    name : str
        A spring of :func:`carrierflex.simulation.stage.springs.stage_springs`; of planets on
        rollers it has what the linear part keeps.
    c : ndarray, shape (N, n)
        Coordinates.

    Returns
    -------
    ndarray, shape (N, m)
        Forces [N] and moments [N m] in the carrier frame, positive where the elongation is.
    """
    spring, channels = model.springs[name], model.channels
    # The drive motion does not stretch a bearing; leave the large angle out of the sums.
    stretch = c[:, 1:] @ (spring.G @ model.L[:, 1:]).T - spring.free
    if name in channels.bearings:
        r = np.linalg.norm(stretch[:, 1:3], axis=1, keepdims=True)
        stretch[:, 1:3] *= np.maximum(1.0 - spring.clearance / np.maximum(r, spring.clearance), 0.0)
    load = stretch * spring.stiffness
    if name == "sun" and len(channels.splines):
        stiffness, clearance, friction = channels.splines[0]
        limits = friction * np.abs((c @ channels.B - channels.free)[:, channels.rubbing.start])
        for instant, limit in enumerate(limits):
            y, z = stretch[instant, 1:3]
            load[instant, 1:3] = spline_force(y, z, stiffness, clearance, limit)[:2]
    if name in channels.unequal:
        first = 6 + 2 * channels.unequal.index(name)
        pair = channels.K_fixed[first : first + 2, first : first + 2]
        turns = np.array(
            [channels.turned(angle)[first : first + 2, first : first + 2] for angle in c[:, 0]]
        )
        load[:, 1:3] = np.einsum("nji,jk,nkl,nl->ni", turns, pair, turns, stretch[:, 1:3])
    return np.asarray(load)


def roller_forces(model: StageModel, c: NDArray[np.float64]) -> NDArray[np.float64]:
    """Force of every roller on its races, N instants [N], shape (N, p, n_rollers, rows * slices).

    Slices of each roller stand in the order of
    :attr:`carrierflex.simulation.stage.roller_bearing.RollerBearingData.slices`, row by row; a
    model with springs for bearings has none and gives shape (N, 0, 1, 1).
    """
    channels, rollers = model.channels, model.channels.rollers
    delta = c @ channels.B - channels.free
    motion = delta[:, channels.rolling].reshape(len(c), -1, 4)
    y, z, ry, rz = (motion[:, :, i, None] for i in range(4))
    start = np.arctan2(rollers.directions[..., 1], rollers.directions[..., 0])
    phi = start + rollers.cage * c[:, 0, None, None]
    middle, slope = np.sin(phi) * y - np.cos(phi) * z, np.sin(phi) * rz + np.cos(phi) * ry
    approach = middle[..., None] + slope[..., None] * rollers.x - rollers.gap
    return np.asarray(rollers.stiffness[:, None, :] * np.maximum(approach, 0.0) ** EXPONENT)
