"""Static equilibrium of the stage at one carrier angle, and what the parts carry there."""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numba
import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from carrierflex.simulation.stage.channels import Channels
from carrierflex.simulation.stage.contact_laws import (
    mesh_stiffness_at,
    play_force,
    play_stiffness,
    spline_force,
)
from carrierflex.simulation.stage.roller_contact import RollerSet, roller_load
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
#: Multiple of a Newton step that the search along it goes to, and what ends the search: halvings,
#: or the change of the energy over that at its start.
_LONGEST_STEP, _BISECTIONS, _LOWEST = 1e4, 60, 1e-3


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
    turning = _too_much(channels, angle)
    of = _contact(channels, angle, k, turning)
    _contact_forces(of, delta, force, tangent)
    return force, tangent


class _Contact(NamedTuple):
    """Laws of the channels at one carrier angle, in the order of the channels."""

    angle: float
    reference: NDArray[np.float64]
    flanks: NDArray[np.float64]
    gaps: NDArray[np.float64]
    turning: NDArray[np.float64]
    """Stiffness that the linear part has too much, of mount and unequal bearings."""
    clearance: NDArray[np.float64]
    rollers: RollerSet
    splines: NDArray[np.float64]


def _contact(
    channels: Channels, angle: float, k: NDArray[np.float64], turning: NDArray[np.float64]
) -> _Contact:
    return _Contact(
        float(angle),
        channels.reference,
        channels.of_flanks(k),
        channels.gaps,
        turning,
        channels.clearance,
        channels.rollers,
        channels.splines,
    )


def _too_much(channels: Channels, angle: float | NDArray[np.float64]) -> NDArray[np.float64]:
    """Stiffness that the linear part has too much at carrier angles [rad], shape (..., t, t)."""
    R = channels.turned(angle)
    return np.asarray(channels.K_mean - R.swapaxes(-1, -2) @ channels.K_fixed @ R)


@numba.njit(cache=True)
def _contact_forces(
    of: _Contact,
    delta: NDArray[np.float64],
    force: NDArray[np.float64],
    tangent: NDArray[np.float64],
) -> None:
    """Forces of the channels beyond the linear part, and their tangent, in place."""
    for j in range(len(of.gaps)):
        i = 1 + j
        stiffness = of.flanks[j] if delta[i] > of.gaps[j] else 0.0
        force[i] = of.reference[i] * delta[i] - stiffness * (delta[i] - of.gaps[j])
        tangent[i, i] = of.reference[i] - stiffness
    first = 1 + len(of.gaps)
    turning = slice(first, first + len(of.turning))
    tangent[turning, turning] = of.turning
    force[turning] = of.turning @ delta[turning]
    first += len(of.turning)
    for clearance in of.clearance:
        y, z, closed = delta[first], delta[first + 1], of.reference[first]
        fy, fz, _ = play_force(y, z, clearance)
        yy, yz, zz = play_stiffness(y, z, clearance)
        force[first], force[first + 1] = closed * (y - fy), closed * (z - fz)
        tangent[first, first], tangent[first, first + 1] = closed * (1.0 - yy), -closed * yz
        tangent[first + 1, first], tangent[first + 1, first + 1] = -closed * yz, closed * (1.0 - zz)
        first += 2
    rolling_force, rolling_tangent = np.zeros(4), np.zeros((4, 4))
    for b in range(len(of.rollers.directions)):
        rolling = slice(first, first + 4)
        roller_load(of.rollers, b, delta[rolling], of.angle, rolling_force, rolling_tangent)
        force[rolling] = of.reference[rolling] * delta[rolling] - rolling_force
        tangent[rolling, rolling] = np.diag(of.reference[rolling]) - rolling_tangent
        first += 4
    for closed, clearance, friction in of.splines:
        twist, y, z = delta[first : first + 3]
        fy, fz, yy, yz, zy, zz, y_L, z_L = spline_force(
            y, z, closed, clearance, friction * abs(twist)
        )
        by_twist = friction * np.sign(twist)
        first += 1
        force[first], force[first + 1] = closed * y - fy, closed * z - fz
        tangent[first, first - 1], tangent[first + 1, first - 1] = -y_L * by_twist, -z_L * by_twist
        tangent[first, first], tangent[first, first + 1] = closed - yy, -yz
        tangent[first + 1, first], tangent[first + 1, first + 1] = -zy, closed - zz
        first += 2


def turning_force(
    model: StageModel, load: SteadyLoad, angle: float | NDArray[np.float64]
) -> NDArray[np.float64]:
    """Generalised force of all loads at carrier angles, shape (..., n); the generator holds."""
    f = model.loads
    turns = np.asarray(angle)[..., None]
    c = np.cos(turns)
    s = np.sin(turns)
    # Of the rotating terms the Coriolis force of the drive's own speed is there at rest.
    force = load.torque * f.torque + f.constant - model.speed * model.G[:, 0]
    force = force - load.gravity * (s * f.weight_y + c * f.weight_z)
    force = (
        force
        + (c * load.ntl_y + s * load.ntl_z) * f.radial_y
        + (c * load.ntl_z - s * load.ntl_y) * f.radial_z
    )
    return np.asarray(force - force[..., :1] / f.generator[0] * f.generator)


def _closed_stiffness(channels: Channels) -> NDArray[np.float64]:
    """Stiffness of every channel with its contact closed [N/m], shape (m,).

    The linear part's, on both flanks of a tooth.
    """
    stiffness = channels.reference.copy()
    n_drive = len(channels.lines) // 2
    drive = channels.meshes.start + np.arange(n_drive)
    stiffness[drive + n_drive] = stiffness[drive]
    return stiffness


@numba.njit(cache=True)
def _settled(
    of: _Contact,
    free: NDArray[np.float64],
    W: NDArray[np.float64],
    rows: NDArray[np.float64],
    closed: NDArray[np.float64],
    enough: float,
    lambda_: NDArray[np.float64],
) -> float:
    """Newton's method for the forces ``lambda(free + W lambda)``, in place; the last residual.

    `rows` takes forces of the channels to the residual that ends at `enough`. Each step goes to the
    lowest energy along it: the energy is convex, its slope rises.
    """
    m = len(free)
    force, trial = np.zeros(m), np.zeros(m)
    tangent, ignored = np.zeros((m, m)), np.zeros((m, m))
    added, residual = _FLOATING, np.inf
    for _ in range(_MOST_ITERATIONS):
        delta = free + W @ lambda_
        _contact_forces(of, delta, force, tangent)
        residual = np.abs(rows @ (lambda_ - force)).max()
        if residual <= enough:
            break
        # A part that floats in its clearances meets no stiffness; what is added of the linear one
        # moves it into contact.
        matrix = -tangent @ W
        for i in range(m):
            matrix[i] += added * closed[i] * W[i]
            matrix[i, i] += 1.0
        change = -np.linalg.solve(matrix, lambda_ - force)
        moved = W @ change
        start, per_length = moved @ lambda_, moved @ change
        first = start - force @ moved
        low, high, length = 0.0, 1.0, 1.0
        _contact_forces(of, delta + moved, trial, ignored)
        slope = start + per_length - trial @ moved
        if abs(slope) > 0.1 * abs(first):
            while slope < 0.0 and high < _LONGEST_STEP:
                low, high = high, 2.0 * high
                _contact_forces(of, delta + high * moved, trial, ignored)
                slope = start + high * per_length - trial @ moved
            if slope > 0.0 > first:
                for _ in range(_BISECTIONS):
                    length = 0.5 * (low + high)
                    _contact_forces(of, delta + length * moved, trial, ignored)
                    slope = start + length * per_length - trial @ moved
                    if abs(slope) <= _LOWEST * abs(first):
                        break
                    if slope > 0.0:
                        high = length
                    else:
                        low = length
        lambda_ += length * change
        # A step cut short had too little stiffness added; any other may do with less.
        added = min(max(added * (10.0 if length < _CUT_SHORT else 0.03), 1e-12), 1.0)
    return residual


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
    factor : tuple
        Cholesky factor of the scaled stiffness ``K_yy``.
    scale : ndarray, shape (n - 1,)
        One over the square root of its diagonal.
    Z : ndarray, shape (n - 1, m)
        Answer to unit channel forces, ``K_yy^-1 B``.
    W : ndarray, shape (m, m)
        The same seen by the channels, ``Bᵀ Z``.
    """

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
    return LinearStatics(factor, scale, Z, B.T @ Z)


def static_coordinates(
    model: StageModel,
    load: SteadyLoad,
    angle: float = 0.0,
    *,
    mean_stiffness: bool = False,
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
    starts = None if start is None else start[None]
    return static_turn(
        model, load, np.array([angle]), mean_stiffness=mean_stiffness, starts=starts
    )[0]


def static_turn(
    model: StageModel,
    load: SteadyLoad,
    angles: NDArray[np.float64],
    *,
    mean_stiffness: bool = False,
    starts: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:
    """Coordinates of :func:`static_coordinates` at many carrier angles, shape (N, n).

    Parameters
    ----------
    model, load, mean_stiffness
        As there.
    angles : ndarray, shape (N,)
        Carrier angles [rad].
    starts : ndarray, shape (N, n), optional
        Coordinates of equilibria that are close.

    Raises
    ------
    NotConvergedError, ValueError
        As there.
    """
    linear = linear_statics(model)
    channels = model.channels
    W = linear.W
    B = channels.B[1:]
    rows = linear.scale[:, None] * B
    closed = _closed_stiffness(channels)
    F = turning_force(model, load, angles)[:, 1:]
    Y = linear.answer(F.T).T
    free = Y @ B - channels.free
    size = np.abs(linear.scale * F).max(axis=1)
    mean, turning = frozen_stiffness(channels, None), _too_much(channels, angles)
    for i, angle in enumerate(angles):
        k = mean if mean_stiffness else frozen_stiffness(channels, angle)
        lambda_ = np.zeros(len(W))
        if starts is not None:
            near = B.T @ starts[i, 1:] - channels.free
            lambda_ = channel_forces(channels, near, angle, k)[0]
        of = _contact(channels, angle, k, turning[i])
        residual = _settled(of, free[i], W, rows, closed, _CONVERGED * size[i], lambda_)
        if residual > _CONVERGED * size[i]:
            raise NotConvergedError(
                f"contact at rest leaves a residual of {residual / size[i]:.1e} after "
                f"{_MOST_ITERATIONS} steps"
            )
        Y[i] += linear.Z @ lambda_
    return np.column_stack([angles, Y])
