"""Static equilibrium of the stage at one carrier angle, and what the parts carry there."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np
import scipy.linalg
import scipy.optimize
from numpy.typing import NDArray

from carrierflex.simulation.stage.channels import Channels
from carrierflex.simulation.stage.contact_laws import (
    mesh_stiffness_at,
    play_force,
    play_stiffness,
    spline_force,
)
from carrierflex.simulation.stage.roller_contact import roller_load
from carrierflex.simulation.stage.stage_data import GRAVITY
from carrierflex.simulation.stage.stage_model import StageModel

#: Newton steps; meshes alone need three or four, bearings that float in their clearance some tens.
_MOST_ITERATIONS = 200
#: Residual that ends the iteration, over the largest load, each scaled by its coordinate's
#: stiffness.
_CONVERGED = 1e-11
#: Share of the stiffness of closed contacts that the first step adds to the true one.
_FLOATING = 1e-3
#: Share of a Newton step below which the next one has more of the linear stiffness added.
_CUT_SHORT = 0.5
#: Multiple of a Newton step that the search along it goes to.
_LONGEST_STEP = 1e4


class NotConvergedError(RuntimeError):
    """The contact iteration did not settle; the message holds the last change."""


@dataclass(frozen=True)
class SteadyLoad:
    """Loads that stand still in the fixed frame.

    Parameters
    ----------
    torque : float
        On the main shaft [N m]; the generator holds it.
    ntl_y, ntl_z : float
        Radial load [N], at ``MountingData.ntl_arm`` upwind of the main bearing.
    gravity : float
        Standard gravity; 0 for none [m/s^2].

    Raises
    ------
    ValueError
        Where a value is not finite.
    """

    torque: float
    ntl_y: float = 0.0
    ntl_z: float = 0.0
    gravity: float = GRAVITY

    def __post_init__(self) -> None:
        for name in ("torque", "ntl_y", "ntl_z", "gravity"):
            if not np.isfinite(getattr(self, name)):
                raise ValueError(f"{name} is {getattr(self, name)}; expected a finite number")


def mesh_amplitudes(channels: Channels) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Real and imaginary stiffness amplitudes of the six meshes, shape (6, n_harmonics + 1)."""
    amplitudes = np.array([mesh.amplitudes for mesh in channels.stiffness])
    return np.ascontiguousarray(amplitudes.real), np.ascontiguousarray(amplitudes.imag)


def frozen_stiffness(channels: Channels, angle: float | None) -> NDArray[np.float64]:
    """Stiffness of the six meshes at a carrier angle [rad], shape (6,) [N/m].

    Their means where the angle is None.
    """
    if angle is None:
        return np.array([mesh.mean for mesh in channels.stiffness])
    return mesh_stiffness_at(*mesh_amplitudes(channels), channels.mesh_teeth * angle)


def channel_forces(
    channels: Channels, delta: NDArray[np.float64], angle: float, k: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Forces beyond the linear part at rest, and their tangent.

    Parameters
    ----------
    channels : Channels
        Channels.
    delta : ndarray, shape (m,)
        Motions of the channels.
    angle : float
        Carrier angle [rad].
    k : ndarray, shape (6,)
        Stiffness of the meshes [N/m].

    Returns
    -------
    force : ndarray, shape (m,)
        ``lambda``.
    tangent : ndarray, shape (m, m)
        ``d lambda / d delta``.
    """
    force, tangent = np.zeros(len(delta)), np.zeros((len(delta), len(delta)))
    flanks, gaps = channels.meshes, np.array([line.gap for line in channels.lines])
    penetration = delta[flanks] - gaps
    stiffness = np.where(penetration > 0.0, channels.of_flanks(k), 0.0)
    reference = channels.reference[flanks]
    force[flanks] = reference * delta[flanks] - stiffness * penetration
    tangent[flanks, flanks] = np.diag(reference - stiffness)
    turning, R = channels.turning, channels.turned(angle)
    tangent[turning, turning] = channels.K_mean - R.T @ channels.K_fixed @ R
    force[turning] = tangent[turning, turning] @ delta[turning]
    for i, clearance in enumerate(channels.clearance):
        first = channels.clearances.start + 2 * i
        y, z = delta[first : first + 2]
        closed = channels.reference[first]
        fy, fz, _ = play_force(y, z, clearance)
        yy, yz, zz = play_stiffness(y, z, clearance)
        force[first : first + 2] = closed * np.array([y - fy, z - fz])
        tangent[first : first + 2, first : first + 2] = closed * np.array(
            [[1.0 - yy, -yz], [-yz, 1.0 - zz]]
        )
    own_force, own_tangent = np.zeros(4), np.zeros((4, 4))
    for b in range(len(channels.rollers.directions)):
        rolling = slice(channels.rolling.start + 4 * b, channels.rolling.start + 4 * b + 4)
        roller_load(channels.rollers, b, delta[rolling], angle, own_force, own_tangent)
        force[rolling] = channels.reference[rolling] * delta[rolling] - own_force
        tangent[rolling, rolling] = np.diag(channels.reference[rolling]) - own_tangent
    for i, (closed, clearance, friction) in enumerate(channels.splines):
        twist = channels.rubbing.start + 3 * i
        y, z = delta[twist + 1 : twist + 3]
        fy, fz, yy, yz, zy, zz, y_L, z_L = spline_force(
            y, z, closed, clearance, friction * abs(delta[twist])
        )
        force[twist + 1 : twist + 3] = closed * y - fy, closed * z - fz
        by_twist = friction * np.sign(delta[twist])
        tangent[twist + 1, twist : twist + 3] = -y_L * by_twist, closed - yy, -yz
        tangent[twist + 2, twist : twist + 3] = -z_L * by_twist, -zy, closed - zz
    return force, tangent


def turning_force(model: StageModel, load: SteadyLoad, angle: float) -> NDArray[np.float64]:
    """Generalised force of all loads at a carrier angle, shape (n,); the generator holds."""
    f = model.loads
    c = np.cos(angle)
    s = np.sin(angle)
    # Of the rotating terms the Coriolis force of the drive's own speed is there at rest.
    force = load.torque * f.torque + f.constant - model.speed * model.G[:, 0]
    force = force - load.gravity * (s * f.weight_y + c * f.weight_z)
    force = (
        force
        + (c * load.ntl_y + s * load.ntl_z) * f.radial_y
        + (c * load.ntl_z - s * load.ntl_y) * f.radial_z
    )
    return force - force[0] / f.generator[0] * f.generator


def _closed_stiffness(channels: Channels) -> NDArray[np.float64]:
    """Stiffness of every channel with its contact closed [N/m], shape (m,).

    The linear part's, on both flanks of a tooth.
    """
    stiffness = channels.reference.copy()
    n_drive = len(channels.lines) // 2
    drive = channels.meshes.start + np.arange(n_drive)
    stiffness[drive + n_drive] = stiffness[drive]
    return stiffness


def _slope(
    channels: Channels,
    motion: tuple[NDArray[np.float64], NDArray[np.float64]],
    linear: tuple[float, float],
    operating_point: tuple[float, NDArray[np.float64]],
    t: float,
) -> float:
    """Change of the energy with a step's length `t`, channels ``motion[0] + t motion[1]``."""
    force, _ = channel_forces(channels, motion[0] + t * motion[1], *operating_point)
    return float(linear[0] + t * linear[1] - force @ motion[1])


def _lowest(slope: Callable[[float], float]) -> float:
    """Length of a Newton step at which the energy along it is lowest.

    The energy is convex, its `slope` rises.
    """
    start, end = slope(0.0), slope(1.0)
    if abs(end) <= 0.1 * abs(start):
        return 1.0
    upper = 1.0
    while slope(upper) < 0.0 and upper < _LONGEST_STEP:
        upper *= 2.0
    return (
        float(scipy.optimize.brentq(slope, 0.0, upper, xtol=1e-12))
        if slope(upper) > 0.0 > start
        else 1.0
    )


def _refuse_free(model: StageModel) -> None:
    """Raise ValueError naming a coordinate besides the drive's that meets no stiffness."""
    free = np.flatnonzero(~(model.K.diagonal()[1:] > 0.0))
    if len(free):
        raise ValueError(
            f"'{model.labels[1 + free[0]]}' meets no stiffness; expected some, see [bearings] and "
            "[mounting]"
        )


@dataclass(frozen=True, eq=False)
class LinearStatics:
    """Linear part of the stage at rest, factorised once for many loads and angles.

    Parameters
    ----------
    model : StageModel
        The stage.
    factor : tuple
        Cholesky factor of the scaled stiffness ``K_yy``.
    scale : ndarray, shape (n - 1,)
        One over the square root of its diagonal.
    Z : ndarray, shape (n - 1, m)
        Answer to unit channel forces, ``K_yy^-1 B``.
    W : ndarray, shape (m, m)
        The same seen by the channels, ``Bᵀ Z``.
    """

    model: StageModel
    factor: tuple[NDArray[np.float64], bool]
    scale: NDArray[np.float64]
    Z: NDArray[np.float64]
    W: NDArray[np.float64]

    def answer(self, force: NDArray[np.float64]) -> NDArray[np.float64]:
        """Answer ``K_yy^-1 f`` to forces, shape (n - 1,) or (n - 1, k)."""
        scaled = (force.T * self.scale).T
        return np.asarray((scipy.linalg.cho_solve(self.factor, scaled).T * self.scale).T)


@lru_cache(maxsize=1)
def linear_statics(model: StageModel) -> LinearStatics:
    """Factorise the linear part of a stage at rest; that of the last model is returned again.

    Raises
    ------
    ValueError
        Where a coordinate meets no stiffness, or centrifugal forces outweigh one.
    """
    _refuse_free(model)
    K = model.K[1:, 1:]
    B = model.channels.B[1:]
    scale = 1.0 / np.sqrt(K.diagonal())
    try:
        factor = scipy.linalg.cho_factor(K * np.outer(scale, scale))
    except scipy.linalg.LinAlgError as error:
        raise ValueError(
            f"at {model.speed:.4g} rad/s a motion of the stage besides the drive's meets no "
            "stiffness; expected a speed below the first critical one"
        ) from error
    Z = scale[:, None] * scipy.linalg.cho_solve(factor, scale[:, None] * B)
    return LinearStatics(model, factor, scale, Z, B.T @ Z)


def static_coordinates(
    model: StageModel,
    load: SteadyLoad,
    angle: float = 0.0,
    *,
    mean_stiffness: bool = False,
    linear: LinearStatics | None = None,
    start: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:
    """Coordinates c of the stage at rest in its turning frame: ``K_yy y = f + B lambda(Bᵀ y)``.

    The channels' forces are the unknowns: ``y = K_yy^-1 (f + B lambda)`` leaves
    ``lambda = lambda(delta_free + W lambda)``.

    Parameters
    ----------
    model : StageModel
        The stage.
    load : SteadyLoad
        Loads; the generator's torque follows.
    angle : float
        Carrier angle [rad].
    mean_stiffness : bool
        Use the meshes' mean stiffness instead of the one at `angle`.
    linear : LinearStatics, optional
        Of this model, where many equilibria are sought; made here where it is missing.
    start : ndarray, shape (n,), optional
        Coordinates of an equilibrium that is close, of this stage or of another; without contact
        by default.

    Returns
    -------
    ndarray, shape (n,)
        Coordinates; the first is `angle`.

    Raises
    ------
    NotConvergedError
        Where the contact iteration does not settle.
    ValueError
        As :func:`linear_statics`.
    """
    linear = linear or linear_statics(model)
    channels = model.channels
    scale = linear.scale
    W = linear.W
    B = channels.B[1:]
    k = frozen_stiffness(channels, None if mean_stiffness else angle)
    f = turning_force(model, load, angle)[1:]
    y_free = linear.answer(f)
    delta_free = B.T @ y_free - channels.free
    size = np.abs(scale * f).max()
    lambda_ = np.zeros(len(W))
    if start is not None:
        lambda_ = channel_forces(channels, B.T @ start[1:] - channels.free, angle, k)[0]
    kept = _FLOATING
    closed = np.diag(_closed_stiffness(channels))
    unit = np.eye(len(W))
    for _ in range(_MOST_ITERATIONS):
        delta = delta_free + W @ lambda_
        force, tangent = channel_forces(channels, delta, angle, k)
        residual = scale * (B @ (lambda_ - force))
        if np.abs(residual).max() <= _CONVERGED * size:
            return np.concatenate([[angle], y_free + linear.Z @ lambda_])
        # A part that floats in its clearances meets no stiffness; what is added of the linear one
        # moves it into contact.
        change = -np.linalg.solve(unit + (kept * closed - tangent) @ W, lambda_ - force)
        moved = W @ change
        energy = float(moved @ lambda_), float(moved @ change)
        length = _lowest(partial(_slope, channels, (delta, moved), energy, (angle, k)))
        lambda_ = lambda_ + length * change
        # A step cut short had too little stiffness added; any other may do with less.
        kept = float(np.clip(kept * (10.0 if length < _CUT_SHORT else 0.03), 1e-12, 1.0))
    raise NotConvergedError(
        f"contact at rest leaves a residual of {np.abs(residual).max() / size:.1e} after "
        f"{_MOST_ITERATIONS} steps"
    )
