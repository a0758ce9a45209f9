"""Static equilibrium of the stage at one carrier angle, and what the parts carry there."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy.linalg
import scipy.optimize
from numpy.typing import NDArray

from carrierflex.simulation.stage.channels import Channels
from carrierflex.simulation.stage.contact_laws import mesh_stiffness_at, play_force, play_stiffness
from carrierflex.simulation.stage.roller_contact import roller_load
from carrierflex.simulation.stage.stage_model import GRAVITY, StageModel

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
        Radial load at the dynamometer coupling [N].
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
    n_meshes = len(channels.stiffness)
    for j, line in enumerate(channels.lines):
        channel = 1 + j
        stiffness, penetration = k[j % n_meshes], delta[channel] - line.gap
        touching = penetration > 0.0
        force[channel] = channels.reference[channel] * delta[channel] - (
            stiffness * penetration if touching else 0.0
        )
        tangent[channel, channel] = channels.reference[channel] - (stiffness if touching else 0.0)
    turning, R = channels.turning, channels.turned(angle)
    tangent[turning, turning] = channels.K_mean - R.T @ channels.K_fixed @ R
    force[turning] = tangent[turning, turning] @ delta[turning]
    for i, clearance in enumerate(channels.clearance):
        first = channels.clearances.start + 2 * i
        y, z = delta[first : first + 2]
        stiffness = channels.reference[first]
        fy, fz, _ = play_force(y, z, clearance)
        yy, yz, zz = play_stiffness(y, z, clearance)
        force[first : first + 2] = stiffness * np.array([y - fy, z - fz])
        tangent[first : first + 2, first : first + 2] = stiffness * np.array(
            [[1.0 - yy, -yz], [-yz, 1.0 - zz]]
        )
    own_force, own_tangent = np.zeros(4), np.zeros((4, 4))
    for b in range(len(channels.rollers.directions)):
        rolling = slice(channels.rolling.start + 4 * b, channels.rolling.start + 4 * b + 4)
        roller_load(channels.rollers, b, delta[rolling], angle, own_force, own_tangent)
        force[rolling] = channels.reference[rolling] * delta[rolling] - own_force
        tangent[rolling, rolling] = np.diag(channels.reference[rolling]) - own_tangent
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
    n_meshes = len(channels.stiffness)
    drive = channels.meshes.start + np.arange(n_meshes)
    stiffness[drive + n_meshes] = stiffness[drive]
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


def static_coordinates(
    model: StageModel, load: SteadyLoad, angle: float = 0.0, *, mean_stiffness: bool = False
) -> NDArray[np.float64]:
    """Coordinates c of the stage at rest in its turning frame: ``K_yy y = f + B lambda(Bᵀ y)``.

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

    Returns
    -------
    ndarray, shape (n,)
        Coordinates; the first is `angle`.

    Raises
    ------
    NotConvergedError
        Where the contact iteration does not settle.
    ValueError
        Where a coordinate meets no stiffness, or centrifugal forces outweigh one.
    """
    K = model.K[1:, 1:]
    B = model.channels.B[1:]
    channels = model.channels
    _refuse_free(model)
    scale = 1.0 / np.sqrt(K.diagonal())
    k = frozen_stiffness(channels, None if mean_stiffness else angle)
    f = turning_force(model, load, angle)[1:]
    try:
        y = scale * scipy.linalg.solve(K * np.outer(scale, scale), scale * f, assume_a="pos")
    except scipy.linalg.LinAlgError as error:
        raise ValueError(
            f"at {model.speed:.4g} rad/s a motion of the stage besides the drive's meets no "
            "stiffness; expected a speed below "
            "the first critical one"
        ) from error
    size = np.abs(scale * f).max()
    kept, closed = _FLOATING, np.diag(_closed_stiffness(channels))
    for _ in range(_MOST_ITERATIONS):
        force, tangent = channel_forces(channels, B.T @ y - channels.free, angle, k)
        residual = K @ y - f - B @ force
        if np.abs(scale * residual).max() <= _CONVERGED * size:
            return np.concatenate([[angle], y])
        # A part that floats in its clearances meets no stiffness; what is added of the linear one
        # moves it into contact.
        stiffness = (K + B @ (kept * closed - tangent) @ B.T) * np.outer(scale, scale)
        change = -scale * scipy.linalg.solve(stiffness, scale * residual, assume_a="sym")
        linear = float(change @ (residual + B @ force)), float(change @ K @ change)
        slope = partial(
            _slope, channels, (B.T @ y - channels.free, B.T @ change), linear, (angle, k)
        )
        length = _lowest(slope)
        y = y + length * change
        # A step cut short had too little stiffness added; any other may do with less.
        kept = float(np.clip(kept * (10.0 if length < _CUT_SHORT else 0.03), 1e-12, 1.0))
    raise NotConvergedError(
        f"contact at rest leaves a residual of {np.abs(scale * residual).max() / size:.1e} after "
        f"{_MOST_ITERATIONS} steps"
    )
