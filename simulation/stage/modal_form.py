"""The stage in the modes of its linear part.

Diagonal mass and stiffness, the form that a time step works with.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from carrierflex.simulation.stage.channels import Channels
from carrierflex.simulation.stage.roller_contact import RollerSet
from carrierflex.simulation.stage.stage_model import StageModel

#: Turn over a step [rad] above which a mode answers statically. To a force at the angular frequency
#: w its answer is then off by ``(w/omega)^2``: 0.5 % at 1 ms and three times the mesh frequency.
_FASTEST = 10.0
#: Damping over critical below which two modes are not coupled: rounding of their shapes.
_UNCOUPLED = 1e-11


@dataclass(frozen=True, eq=False)
class ModalStage:
    """Normal modes of the stage with mean mesh stiffness.

    Parameters
    ----------
    model : StageModel
        The equations.
    Phi : ndarray, shape (n, k)
        Modes in the coordinates c, mass-normalised, the free drive motion first, then ascending.
    omega : ndarray, shape (k,)
        Angular frequencies [rad/s]; the first is zero.
    D : ndarray, shape (k, k)
        Damping: structural on the diagonal, generator, mount and Coriolis forces full.
    R : ndarray, shape (n, n - k)
        Modes without inertia over their frequency: ``R Rᵀ`` is their flexibility.
    lag : float
        Damping over stiffness of those [s].
    """

    model: StageModel
    Phi: NDArray[np.float64]
    omega: NDArray[np.float64]
    D: NDArray[np.float64]
    R: NDArray[np.float64]
    lag: float = 0.0

    @property
    def structural_damping(self) -> NDArray[np.float64]:
        """``2 zeta omega`` of every mode [1/s], shape (n,)."""
        return 2.0 * self.model.data.damping_ratio * self.omega

    @property
    def forces(self) -> NDArray[np.float64]:
        """Columns of the channels and loads: torque, generator, weight, radial load, constant."""
        loads = self.model.loads
        vectors = (
            loads.torque, loads.generator, loads.weight_y, loads.weight_z, loads.radial_y,
            loads.radial_z, loads.constant,
        )  # fmt: skip
        return np.column_stack([self.model.channels.B, *vectors])

    @property
    def answer(self) -> NDArray[np.float64]:
        """Columns ``Rᵀ f`` of :attr:`forces`; what resists the mean speed is in the constant."""
        model, forces = self.model, self.forces
        forces[:, -1] -= model.speed * (model.C + model.G)[:, 0]
        return np.asarray(self.R.T @ forces)

    @property
    def motion(self) -> NDArray[np.float64]:
        """Coordinates c of unit modes, then of unit forces on the modes without inertia."""
        return np.vstack([self.Phi.T, self.answer.T @ self.R.T])


def modal_stage(model: StageModel) -> ModalStage:
    """Normal modes of the stage.

    The free drive motion is split off exactly, ``x_0 = e_0 / sqrt(M_00)``; the others solve ``K_yy
    x = omega^2 M' x`` with ``M' = M_yy - M_y0 M_0y / M_00``, as the inverse problem ``M' x = mu
    K_yy x``, which keeps the low frequencies accurate.

    Raises
    ------
    ValueError
        Where the stiffness leaves another motion free or the mass is not positive.
    """
    K, M = model.K[1:, 1:], model.M
    reduced = M[1:, 1:] - np.outer(M[1:, 0], M[0, 1:]) / M[0, 0]
    scale = 1.0 / np.sqrt(K.diagonal())
    try:
        factor = scipy.linalg.cholesky(K * np.outer(scale, scale), lower=True)
    except scipy.linalg.LinAlgError as error:
        raise ValueError(
            "the stage has a motion besides the drive's that meets no stiffness; expected none"
        ) from error
    inner = scipy.linalg.solve_triangular(factor, scale[:, None] * reduced * scale, lower=True)
    inner = scipy.linalg.solve_triangular(factor, inner.T, lower=True)
    mu, V = scipy.linalg.eigh((inner + inner.T) / 2.0)
    if not mu[0] > 0.0:
        raise ValueError(
            f"the stage's mass has an eigenvalue of {mu[0]:.2e} relative to its stiffness; "
            "expected positive ones"
        )
    mu, V = mu[::-1], V[:, ::-1]
    modes = (
        scale[:, None]
        * scipy.linalg.solve_triangular(factor, V, lower=True, trans="T")
        / np.sqrt(mu)
    )
    n = len(M)
    Phi = np.zeros((n, n))
    Phi[0, 0] = 1.0 / np.sqrt(M[0, 0])
    Phi[1:, 1:] = modes
    Phi[0, 1:] = -(M[0, 1:] @ modes) / M[0, 0]
    omega = np.concatenate([[0.0], 1.0 / np.sqrt(mu)])
    D = Phi.T @ (model.C + model.G) @ Phi + np.diag(2.0 * model.data.damping_ratio * omega)
    return ModalStage(model, Phi, omega, D, np.zeros((n, 0)))


def resolved(stage: ModalStage, h: float) -> ModalStage:
    """The same modes, those that a step of `h` [s] does not resolve without inertia.

    They have the damping of the fastest: less than their own, which lets no force lag.
    """
    fast = stage.omega * h > _FASTEST
    return replace(
        stage,
        Phi=stage.Phi[:, ~fast],
        omega=stage.omega[~fast],
        D=stage.D[np.ix_(~fast, ~fast)],
        R=stage.Phi[:, fast] / stage.omega[fast],
        lag=2.0 * stage.model.data.damping_ratio / stage.omega.max(),
    )


def grouped(stage: ModalStage) -> ModalStage:
    """The same modes, those that damping couples next to each other: a step takes each group alone.

    A stage of equal planets has two, one with the torsion of the drive.
    """
    order = np.argsort(_group_of_modes(stage), kind="stable")
    return replace(
        stage, Phi=stage.Phi[:, order], omega=stage.omega[order], D=stage.D[np.ix_(order, order)]
    )


def _group_of_modes(stage: ModalStage) -> NDArray[np.int64]:
    """Group of every mode, shape (n,): coupled by damping over critical above `_UNCOUPLED`."""
    size = np.maximum(stage.omega, stage.omega[stage.omega > 0.0].min())
    coupled = np.abs(stage.D) > _UNCOUPLED * np.sqrt(np.outer(size, size))
    return connected_components(coupled)[1].astype(np.int64)


class StepMatrices(NamedTuple):
    """Constants of the compiled time step; modal unless it says.

    ``n`` modes with inertia, ``m`` channels, ``l = 7`` loads.
    """

    h: float
    """Step [s]."""
    stiffness: NDArray[np.float64]
    """omega^2, shape (n,)."""
    structural: NDArray[np.float64]
    """2 zeta omega, shape (n,)."""
    groups: NDArray[np.int64]
    """First mode and number of modes of every group that damping couples, shape (g, 2)."""
    A_inverse: NDArray[np.float64]
    """Inverse of ``2/h + D + h/2 omega^2``: the groups' blocks, each by columns."""
    B: NDArray[np.float64]
    """Channels, shape (m, n)."""
    A_inverse_B: NDArray[np.float64]
    """Answer of the mid-step velocity to a unit channel force, shape (m, n)."""
    W_columns: NDArray[np.float64]
    """The same seen by the channels, by columns, shape (m, m)."""
    P: NDArray[np.float64]
    """Loads: torque, generator, weight y z, radial y z, constant, shape (l, n)."""
    S: NDArray[np.float64]
    """Motions of channels and loads by their forces on modes without inertia, (m + l, m + l)."""
    lag: float
    """Damping over stiffness of those modes [s]."""
    generator_constant: float
    """K of the paper's eq. 9 [N m s]."""
    reference: NDArray[np.float64]
    """Stiffness of each channel in the linear part [N/m], shape (m,)."""
    real: NDArray[np.float64]
    """Mesh stiffness amplitudes, real parts, shape (6, n_harmonics + 1)."""
    imag: NDArray[np.float64]
    """Imaginary parts."""
    gaps: NDArray[np.float64]
    """Play of the flanks or their slices [m]."""
    shares: NDArray[np.float64]
    """Share of its mesh's stiffness that each has."""
    clearance: NDArray[np.float64]
    """Play of the loose bearings [m]."""
    rollers: RollerSet
    """Rollers of the planet bearings."""
    splines: NDArray[np.float64]
    """Stiffness [N/m], clearance [m] and friction per twist [N/rad] of the sun's spline, (s, 3)."""
    K_turning: NDArray[np.float64]
    """Stiffness of mount and unequal bearings beyond the linear part, carrier frame, (5, t, t):
    a constant, then cos, sin of the carrier angle and of twice it."""
    C_turning: NDArray[np.float64]
    """The same, damping."""
    C_mean: NDArray[np.float64]
    """Damping of them that the linear part has, (t, t)."""
    blocks: NDArray[np.int64]
    """First channel and number of channels whose forces depend on each other, shape (b, 2)."""
    mesh_teeth: float
    """Mesh periods a turn."""
    gravity: float
    """[m/s^2]."""


def step_matrices(stage: ModalStage, h: float, gravity: float) -> StepMatrices:
    """Constants of a step of `h` [s] under `gravity` [m/s^2]."""
    model = stage.model
    channels = stage.model.channels
    A = np.diag(2.0 / h + 0.5 * h * stage.omega**2) + stage.D
    # Rows grow with omega^2: scale before inverting.
    scale = 1.0 / np.sqrt(A.diagonal())
    A_inverse = scale[:, None] * np.linalg.inv(A * np.outer(scale, scale)) * scale
    m = channels.B.shape[1]
    B, P = np.split(np.ascontiguousarray(stage.forces.T @ stage.Phi), [m])
    S = stage.answer.T @ stage.answer
    amplitudes = np.array([mesh.amplitudes for mesh in channels.stiffness])
    W = B @ A_inverse @ B.T + S[:m, :m] / (stage.lag + 0.5 * h)
    # One group where they are not sorted.
    member = _group_of_modes(stage)
    sorted_modes = (np.diff(member) >= 0).all()
    sizes = np.bincount(member) if sorted_modes else np.array([len(member)])
    groups = np.column_stack([np.cumsum(sizes) - sizes, sizes])
    K_turning, C_turning = _turning_series(model)
    return StepMatrices(
        h=h,
        stiffness=stage.omega**2,
        structural=stage.structural_damping,
        groups=groups,
        A_inverse=np.concatenate([A_inverse[i : i + n, i : i + n].T.ravel() for i, n in groups]),
        B=B,
        A_inverse_B=np.ascontiguousarray((A_inverse @ B.T).T),
        W_columns=np.ascontiguousarray(W.T),
        P=P,
        S=S,
        lag=stage.lag,
        generator_constant=model.data.chain.generator_constant,
        reference=channels.reference,
        real=np.ascontiguousarray(amplitudes.real),
        imag=np.ascontiguousarray(amplitudes.imag),
        gaps=channels.gaps,
        shares=channels.shares,
        clearance=channels.clearance,
        rollers=channels.rollers,
        splines=channels.splines,
        K_turning=K_turning,
        C_turning=C_turning,
        C_mean=channels.C_mean,
        blocks=_blocks(channels),
        mesh_teeth=float(channels.mesh_teeth),
        gravity=gravity,
    )


def _turning_series(model: StageModel) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Stiffness and damping of what stands still beyond the linear part, over the carrier angle.

    ``R.T K R`` has no wave shorter than half a turn: five angles give its series exactly. The
    velocity in the fixed frame, seen from the carrier's, is ``x' + Omega J x``.
    """
    channels = model.channels
    angles = 2.0 * np.pi / 5.0 * np.arange(5)
    waves = [np.ones(5), np.cos(angles), np.sin(angles), np.cos(2.0 * angles), np.sin(2.0 * angles)]
    weights = np.array([wave / (wave @ wave) for wave in waves])
    R = np.array([channels.turned(angle) for angle in angles])
    C = R.transpose(0, 2, 1) @ channels.C_fixed @ R
    K = R.transpose(0, 2, 1) @ channels.K_fixed @ R + model.speed * C @ channels.quarter_turn
    K_turning = np.tensordot(weights, K - channels.K_mean, axes=1)
    return K_turning, np.tensordot(weights, C - channels.C_mean, axes=1)


def _blocks(channels: Channels) -> NDArray[np.int64]:
    """First channel and size of every group whose forces depend on each other's motions."""
    sizes = [1 + len(channels.lines), len(channels.K_fixed)]
    sizes += len(channels.clearance) * [2]
    sizes += len(channels.rollers.directions) * [4]
    sizes += len(channels.splines) * [3]
    return np.column_stack([np.cumsum([0, *sizes[:-1]]), sizes])
