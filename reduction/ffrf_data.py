# ruff: noqa: N802 - the names are the letters of the standard input data
"""Inertia invariants of a reduced body for codes with a floating frame of reference.

A point x of the body moves as ``x + T(x) q`` in a frame that itself moves. Everything that the
frame's motion meets of the body's mass lies in six integrals, of which all terms of the equations
of motion are combinations:

``m = ∫ ρ``, ``∫ ρ x``, ``∫ ρ x xᵀ``, ``N = ∫ ρ T``, ``P_ab = ∫ ρ x_a T_b``, ``Q_ab = ∫ ρ T_aᵀ
T_b``.

The element mass is one scalar matrix for x, y and z, so the sums over nodes with it are these
integrals, not approximations. The letters of the combinations are those of Wallrapp's standard
input data; frame and origin are the body's own.
"""

import logging
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from carrierflex.reduction.scalar_mass import (
    UnequalMassError,
    displacements,
    positions,
    scalar_mass,
    uniform,
)

if TYPE_CHECKING:
    from carrierflex.fe.structural_model import StructuralModel

log = logging.getLogger(__name__)

#: Rigid motions of a free body.
_ALL_MOTIONS = 6

#: Pairs of axes in the order in which symmetric quantities are kept: xx yy zz xy yz xz.
AXIS_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))
#: Cross products, ``(a × b)_i = ε_ijk a_j b_k``.
_EPSILON = np.zeros((3, 3, 3))
_EPSILON[[0, 1, 2], [1, 2, 0], [2, 0, 1]] = 1.0
_EPSILON[[0, 2, 1], [2, 1, 0], [1, 0, 2]] = -1.0


@dataclass(frozen=True, eq=False)
class FfrfData:
    """Inertia invariants of a body of r reduced coordinates about the origin of its frame.

    Parameters
    ----------
    mass : float
        ``m = ∫ ρ`` [kg].
    first_moment : ndarray, shape (3,)
        ``∫ ρ x`` [kg m].
    second_moment : ndarray, shape (3, 3)
        ``∫ ρ x xᵀ`` [kg m^2].
    N : ndarray, shape (3, r)
        ``∫ ρ T`` [kg].
    P : ndarray, shape (3, 3, r)
        ``P[a, b] = ∫ ρ x_a T_b`` [kg m].
    Q : ndarray, shape (6, r, r)
        ``∫ ρ T_aᵀ T_b`` [kg] for the axes of :data:`AXIS_PAIRS`; the other three are transposes,
        see :meth:`block`.

    Raises
    ------
    ValueError
        Where shapes contradict each other.

    References
    ----------
    Shabana (2020), Dynamics of Multibody Systems, 5th ed., chapter 5. Wallrapp (1994), Mechanics of
    Structures and Machines 22(3), 315-337. Schwertassek and Wallrapp (1999), Dynamik flexibler
    Mehrkörpersysteme, chapter 6.
    """

    mass: float
    first_moment: NDArray[np.float64]
    second_moment: NDArray[np.float64]
    N: NDArray[np.float64]
    P: NDArray[np.float64]
    Q: NDArray[np.float64]

    def __post_init__(self) -> None:
        r = self.N.shape[-1]
        expected = {
            "first_moment": (3,),
            "second_moment": (3, 3),
            "N": (3, r),
            "P": (3, 3, r),
            "Q": (6, r, r),
        }
        for name, shape in expected.items():
            if getattr(self, name).shape != shape:
                raise ValueError(
                    f"inertia invariant {name} has shape {getattr(self, name).shape}; expected "
                    f"{shape} for {r} coordinates"
                )

    @property
    def n_coordinates(self) -> int:
        """Number of reduced coordinates r."""
        return int(self.N.shape[1])

    def block(self, a: int, b: int) -> NDArray[np.float64]:
        """``Q_ab = ∫ ρ T_aᵀ T_b`` [kg] for any two axes, shape (r, r)."""
        return (
            self.Q[AXIS_PAIRS.index((a, b))]
            if (a, b) in AXIS_PAIRS
            else self.Q[AXIS_PAIRS.index((b, a))].T
        )

    @cached_property
    def blocks(self) -> NDArray[np.float64]:
        """All nine blocks, shape (3, 3, r, r)."""
        return np.array([[self.block(a, b) for b in range(3)] for a in range(3)])

    @property
    def centre(self) -> NDArray[np.float64]:
        """Centre of mass of the undeformed body [m].

        Shape (3,).
        """
        return self.first_moment / self.mass

    @property
    def Me(self) -> NDArray[np.float64]:
        """Reduced mass ``∫ ρ Tᵀ T``, shape (r, r)."""
        return self.Q[0] + self.Q[1] + self.Q[2]

    @property
    def Ct(self) -> NDArray[np.float64]:
        """Coupling with the frame's translation ``∫ ρ Tᵀ``, shape (r, 3).

        Also the first order of m c.
        """
        return self.N.T

    @property
    def Cr(self) -> NDArray[np.float64]:
        """Coupling with the frame's rotation ``∫ ρ (x × T_j)``, shape (r, 3)."""
        return np.einsum("abc,bcj->ja", _EPSILON, self.P)

    @cached_property
    def Cr1(self) -> NDArray[np.float64]:
        """Change of Cr with the deformation.

        ``[j, k] = ∫ ρ (T_k × T_j)``, shape (r, r, 3): row j, coordinate k.
        """
        return np.einsum("abc,bckj->jka", _EPSILON, self.blocks)

    @property
    def J(self) -> NDArray[np.float64]:
        """Inertia of the undeformed body about the origin [kg m^2], shape (3, 3)."""
        return _inertia(self.second_moment)

    @property
    def J1(self) -> NDArray[np.float64]:
        """First order of the inertia: ``J(q) = J + J1 q + ...``, shape (3, 3, r)."""
        return _inertia(self.P + self.P.transpose(1, 0, 2))

    @property
    def Gr(self) -> NDArray[np.float64]:
        """Gyroscopic moments ``Gr_j = -2 ∫ ρ x~ T~_j``, shape (3, 3, r).

        The moment is ``Σ_j Gr_j q̇_j ω``.
        """
        # Of two cross products, x × (T × ω) = (T xᵀ - x·T I) ω.
        return 2.0 * _inertia(self.P).transpose(1, 0, 2)

    @property
    def Ge(self) -> NDArray[np.float64]:
        """Gyroscopic forces ``Ge_j = -2 ∫ ρ Tᵀ T~_j``, shape (r, 3, r).

        The force is ``Σ_j Ge_j q̇_j ω``.
        """
        return 2.0 * self.Cr1.transpose(0, 2, 1)

    @property
    def Oe(self) -> NDArray[np.float64]:
        """Centrifugal forces ``∫ ρ Tᵀ ω~ ω~ x = Oe ω_q``, shape (r, 6).

        Ω_q are the products of :data:`AXIS_PAIRS`.
        """
        return _centrifugal(self.P).T

    @property
    def Oe1(self) -> NDArray[np.float64]:
        """First order of the centrifugal forces in the coordinates q, shape (r, r, 6).

        ``Oe(q)[i] = Oe[i] + Σ_k q_k Oe1[i, k]``.
        """
        return _centrifugal(self.blocks).transpose(2, 1, 0)

    def second_moment_at(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """``∫ ρ (x + T q) (x + T q)ᵀ`` [kg m^2] of the deformed body.

        Shape (3, 3), for coordinates q of shape (r,).
        """
        mixed = self.P @ q
        return (
            self.second_moment
            + mixed
            + mixed.T
            + np.einsum("abjk,j,k->ab", self.blocks, q, q, optimize=True)
        )

    def inertia(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """Inertia of the deformed body about the origin [kg m^2], exact.

        Shape (3, 3), for coordinates q of shape (r,).

        Constant, linear and quadratic in q.
        """
        return _inertia(self.second_moment_at(q))

    def kinetic_energy(
        self,
        q: NDArray[np.float64],
        q_dot: NDArray[np.float64],
        velocity: NDArray[np.float64],
        omega: NDArray[np.float64],
    ) -> float:
        """Kinetic energy [J] of the deforming body in a moving frame.

        Velocity of the frame's origin [m/s] and ω [rad/s] in the frame's axes.
        """
        moment = self.first_moment + self.N @ q
        Cr = self.Cr + np.einsum("jka,k->ja", self.Cr1, q)
        rigid = 0.5 * self.mass * velocity @ velocity + velocity @ np.cross(omega, moment)
        turning = 0.5 * omega @ self.inertia(q) @ omega + q_dot @ Cr @ omega
        return float(rigid + turning + q_dot @ self.Ct @ velocity + 0.5 * q_dot @ self.Me @ q_dot)

    def about(self, origin: NDArray[np.float64]) -> "FfrfData":
        """Invariants about another origin [m], axes kept: positions become ``x - origin``.

        `origin` has the shape (3,).
        """
        c = np.asarray(origin, dtype=np.float64)
        crossed = np.outer(c, self.first_moment)
        return FfrfData(
            self.mass,
            self.first_moment - self.mass * c,
            self.second_moment - crossed - crossed.T + self.mass * np.outer(c, c),
            self.N,
            self.P - c[:, None, None] * self.N,
            self.Q,
        )

    def transformed(self, V: NDArray[np.float64]) -> "FfrfData":
        """Invariants of the coordinates η with ``q = V η``, V of shape (r, s)."""
        Q = np.array([V.T @ block @ V for block in self.Q])
        return FfrfData(self.mass, self.first_moment, self.second_moment, self.N @ V, self.P @ V, Q)

    def turned(self, R: NDArray[np.float64]) -> "FfrfData":
        """Invariants of the body turned by the rotation R, in the frame that stays.

        R has the shape (3, 3).

        Coordinates kept.
        """
        blocks = np.einsum("ai,bj,ijkl->abkl", R, R, self.blocks, optimize=True)
        return FfrfData(
            self.mass,
            R @ self.first_moment,
            R @ self.second_moment @ R.T,
            R @ self.N,
            np.einsum("ai,bj,ijk->abk", R, R, self.P, optimize=True),
            np.array([blocks[a, b] for a, b in AXIS_PAIRS]),
        )


def _inertia(second: NDArray[np.float64]) -> NDArray[np.float64]:
    """``tr(S) I - S`` of second moments S, further axes carried along."""
    identity = np.eye(3).reshape(3, 3, *(1,) * (second.ndim - 2))
    return identity * np.trace(second) - second


def _centrifugal(moment: NDArray[np.float64]) -> NDArray[np.float64]:
    """Factors of ω_a ω_b in ``∫ ρ Tᵀ ω~ ω~ x`` from ``∫ ρ x_a T_b``, the six pairs first."""
    trace = np.trace(moment)
    return np.array(
        [moment[a, a] - trace if a == b else moment[a, b] + moment[b, a] for a, b in AXIS_PAIRS]
    )


def ffrf_data(structure: "StructuralModel", T: NDArray[np.float64]) -> FfrfData:
    """Inertia invariants from a body's consistent mass matrix and the basis of its reduction.

    Parameters
    ----------
    structure : StructuralModel
        Body; its mass matrix is one scalar matrix repeated for the three axes.
    T : ndarray, shape (n_dofs, r)
        Basis: displacement of the degrees of freedom from the reduced coordinates.

    Returns
    -------
    FfrfData
        Invariants about the origin of the body's frame.

    Raises
    ------
    UnequalMassError
        Where the mass matrix differs between axes, as rotary masses may make it.
    """
    S, unit = scalar_mass(structure), uniform(structure)
    x, T_axes = positions(structure), displacements(structure, T)
    S_unit, S_x = S @ unit, S @ x
    S_T = [S @ T_b for T_b in T_axes]
    Q = np.array([T_axes[a].T @ S_T[b] for a, b in AXIS_PAIRS])
    Q[:3] = (Q[:3] + Q[:3].transpose(0, 2, 1)) / 2.0
    return FfrfData(
        mass=float(unit @ S_unit),
        first_moment=x.T @ S_unit,
        second_moment=x.T @ S_x,
        N=np.array([S_unit @ T_b for T_b in T_axes]),
        P=np.array([[S_x[:, a] @ T_b for T_b in T_axes] for a in range(3)]),
        Q=Q,
    )


def inertia_invariants(structure: "StructuralModel", T: NDArray[np.float64]) -> FfrfData | None:
    """Inertia invariants of a body, None where it has none.

    A body that is held to the ground, that has nodes without three translations, or whose mass is
    not that of solids or of rigid points, as matrices of other programs may have it, is no body for
    a floating frame.

    Parameters
    ----------
    structure, T
        As :func:`ffrf_data` takes them.
    """
    free = structure.free_motions
    if structure.layout is not None or (free is not None and free.shape[1] < _ALL_MOTIONS):
        return None
    try:
        return ffrf_data(structure, T)
    except UnequalMassError as error:
        log.warning("%s; no inertia invariants for floating frames", error)
        return None
