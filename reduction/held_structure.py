"""A free elastic body whose pilots are held or moved.

The saddle point behind every Craig-Bampton mode.

The problem is ``K u + Gᵀ λ = f``, ``G u = d`` with K of a free body (six rigid-body modes R) and G
the distributing couplings. Holding six degrees of freedom of three nodes makes K positive definite
without changing any self-equilibrated solution: their reactions are zero. So

    u = A (f - Gᵀ λ) + R a,   A = K_heldⁿ⁻⁶ inverse padded with zeros,
    S λ - H a = G A f - d,    S = G A Gᵀ,  H = G R,
    Hᵀ λ = Rᵀ f,

one sparse Cholesky factorisation, one block solve, and a dense system of 6 (pilots + 1) unknowns.
No penalty and no dense null space enters; docs/decisions/0003 compares it with factorising the
saddle point itself. Where symmetry splits the body (:mod:`carrierflex.fe.symmetry_blocks`), every
block is such a problem, with one or two rigid-body modes of its own.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.factorisation import Factorisation, SingularMatrixError, factorise
from carrierflex.fe.node_dofs import dofs_of
from carrierflex.fe.structural_model import StructuralModel
from carrierflex.fe.surface_integrals import rigid_body_modes
from carrierflex.fe.symmetry_blocks import SymmetryBlock


class Grounded(Protocol):
    """A free body, or a part of its problem, held statically determinately."""

    @property
    def rigid_modes(self) -> NDArray[np.float64]:
        """Rigid-body modes R, shape (n, k)."""
        ...

    def displacement(self, f: NDArray[np.float64]) -> NDArray[np.float64]:
        """Displacement ``A f`` of the grounded body, shape of `f`: (n,) or (n, k)."""
        ...


class Coupling(Protocol):
    """What is held or moved: ``G u = d``."""

    @property
    def G(self) -> sp.csr_array:  # noqa: N802 (the letter of the equation)
        """Coupling, shape (m, n)."""
        ...


@dataclass(frozen=True, eq=False)
class GroundedBody:
    """A free body held statically determinately: factorised once, whatever pilots are held later.

    Parameters
    ----------
    K : csr_array, shape (n, n)
        Stiffness of the free body [N/m].
    points : ndarray, shape (n_nodes, 3)
        Node coordinates [m].
    rigid_points : ndarray, shape (p, 3)
        Pilots of rigid couplings, whose six coordinates follow the nodes' among the n degrees of
        freedom.

    Raises
    ------
    SingularMatrixError
        On first use, where the body is not one connected piece.
    """

    K: sp.csr_array
    points: NDArray[np.float64]
    rigid_points: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3)))

    @cached_property
    def rigid_modes(self) -> NDArray[np.float64]:
        """Rigid-body modes R about the nodes' centre, shape (n, 6)."""
        return rigid_body_modes(self.points, self.rigid_points, self.points.mean(axis=0))

    def displacement(self, f: NDArray[np.float64]) -> NDArray[np.float64]:
        """Displacement ``A f`` of the grounded body, shape of `f`: (n,) or (n, k)."""
        return self._factor.solve(f)

    @cached_property
    def _factor(self) -> Factorisation:
        return factorise(self.K, fixed=statically_determinate_dofs(self.points))


@dataclass(frozen=True, eq=False)
class GroundedBlock:
    """One block of a symmetric body, held statically determinately.

    Parameters
    ----------
    block : SymmetryBlock
        The block.
    """

    block: SymmetryBlock

    @property
    def rigid_modes(self) -> NDArray[np.float64]:
        """The block's rigid-body modes R, shape (n, k)."""
        return self.block.rigid_modes

    def displacement(self, f: NDArray[np.float64]) -> NDArray[np.float64]:
        """Displacement ``A f`` of the grounded block, shape of `f`: (n,) or (n, k)."""
        return self._factor.solve(f)

    @cached_property
    def _factor(self) -> Factorisation:
        return factorise(self.block.K, fixed=_independent_rows(self.block.rigid_modes))


@dataclass(frozen=True, eq=False)
class GroundedMatrices:
    """A body of any degrees of freedom, held statically determinately where it is free.

    Rotations, translations and soft springs are scaled to one size before the factorisation.

    Parameters
    ----------
    K : csr_array, shape (n, n)
        Stiffness.
    rigid_modes : ndarray, shape (n, k)
        Motions that meet no stiffness; none of a body that is held to the ground.
    """

    K: sp.csr_array
    rigid_modes: NDArray[np.float64]

    def displacement(self, f: NDArray[np.float64]) -> NDArray[np.float64]:
        """Displacement ``A f`` of the grounded body, shape of `f`: (n,) or (n, k)."""
        scale = self._scale.reshape(-1, *[1] * (f.ndim - 1))
        return scale * self._factor.solve(scale * f)

    @cached_property
    def _scale(self) -> NDArray[np.float64]:
        return np.asarray(1.0 / np.sqrt(self.K.diagonal()))

    @cached_property
    def _factor(self) -> Factorisation:
        S = sp.diags_array(self._scale)
        scaled = sp.csr_array(S @ self.K @ S)
        scaled.sort_indices()
        return factorise(scaled, fixed=_independent_rows(self.rigid_modes))


def grounded(structure: StructuralModel) -> Grounded:
    """A body held statically determinately, whatever its degrees of freedom."""
    if structure.layout is None and structure.free_motions is None:
        return GroundedBody(structure.K, structure.points, structure.rigid_points)
    R = structure.rigid_modes
    if structure.free_motions is not None:
        R = R @ structure.free_motions
    return GroundedMatrices(structure.K, R)


def _independent_rows(R: NDArray[np.float64]) -> NDArray[np.int64]:
    """The unknowns that rigid motions move most independently: leading pivots of Rᵀ."""
    if not R.shape[1]:
        return np.zeros(0, dtype=np.int64)
    order = scipy.linalg.qr((R / np.abs(R).max(axis=0)).T, mode="r", pivoting=True)[1]
    return np.asarray(order[: R.shape[1]], dtype=np.int64)


@dataclass(frozen=True, eq=False)
class HeldStructure:
    """Body with pilots that are held or moved; solves for displacement and pilot reactions.

    Parameters
    ----------
    body : Grounded
        The body, or a block of it; its factor serves any choice of pilots.
    pilots : sequence of Coupling
        Pilots that are held or moved; they must hold the body's rigid motions.
    """

    body: Grounded
    pilots: Sequence[Coupling]

    def solve(
        self, f: NDArray[np.float64], d: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Displacement u and reactions λ under nodal forces `f` and pilot motions `d`.

        u has the shape (n, k), λ the shape (m, k).

        ``-λ`` are the forces and moments that hold the pilots.
        """
        Af = self.body.displacement(f)
        right = np.concatenate([self._couplings @ Af - d, self.body.rigid_modes.T @ f])
        lagrange, a = self._split(right)
        Af -= self._response_to_couplings @ lagrange
        Af += self.body.rigid_modes @ a
        return Af, lagrange

    def static_response(self, f: NDArray[np.float64]) -> NDArray[np.float64]:
        """Displacement (n, k) under nodal forces `f` (n, k), every pilot held."""
        return self.solve(f, np.zeros((self._couplings.shape[0], f.shape[1])))[0]

    def constraint_modes(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Constraint modes Ψ, shape (n, m), and the pilots' static stiffness, shape (m, m).

        The stiffness is ``Ψᵀ K Ψ = -λ``.
        """
        m = self._couplings.shape[0]
        lagrange, a = self._split(
            np.concatenate([-np.eye(m), np.zeros((self.body.rigid_modes.shape[1], m))])
        )
        stiffness = -(lagrange + lagrange.T) / 2.0
        return self.body.rigid_modes @ a - self._response_to_couplings @ lagrange, stiffness

    def _split(self, right: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Solve the dense system for the reactions λ and the rigid motion a."""
        solution = scipy.linalg.lu_solve(self._dense_factor, right)
        m = self._couplings.shape[0]
        return solution[:m], solution[m:]

    @cached_property
    def _couplings(self) -> sp.csr_array:
        """G of all pilots, shape (m, n)."""
        return sp.csr_array(sp.vstack([pilot.G for pilot in self.pilots]))

    @cached_property
    def _response_to_couplings(self) -> NDArray[np.float64]:
        """A Gᵀ, shape (n, m)."""
        return self.body.displacement(self._couplings.T.toarray())

    @cached_property
    def _dense_factor(self) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
        S = self._couplings @ self._response_to_couplings
        H = self._couplings @ self.body.rigid_modes
        m, k = H.shape
        self._refuse_free_motion(H)
        matrix = np.zeros((m + k, m + k))
        matrix[:m, :m] = (S + S.T) / 2.0
        matrix[:m, m:] = -H
        matrix[m:, :m] = H.T
        return scipy.linalg.lu_factor(matrix)

    def _refuse_free_motion(self, H: NDArray[np.float64]) -> None:
        """Refuse pilots that leave a rigid motion of the body free; `H` are their motions in it."""
        k = H.shape[1]
        rank = int(np.linalg.matrix_rank(H)) if k else 0
        if rank < k:
            raise SingularMatrixError(
                f"what is held holds {rank} of {k} rigid motions of the body; expected pilots "
                "whose components hold all of them"
            )


def statically_determinate_dofs(points: NDArray[np.float64]) -> NDArray[np.int64]:
    """Six degrees of freedom that hold a body against rigid motion without constraining it.

    They belong to three nodes far apart.

    The first node is held in x y z, the second across the line to it, the third across their plane;
    directions are the coordinate axes that serve best.
    """
    first = int(np.argmax(np.linalg.norm(points - points.mean(axis=0), axis=1)))
    along = points - points[first]
    second = int(np.argmax(np.linalg.norm(along, axis=1)))
    direction = along[second] / np.linalg.norm(along[second])
    across = np.cross(along, direction)
    third = int(np.argmax(np.linalg.norm(across, axis=1)))
    normal = across[third] / np.linalg.norm(across[third])
    line_axis = int(np.argmax(np.abs(direction)))
    plane_axis = int(np.argmax(np.abs(normal)))
    across_the_line = np.delete(dofs_of(second), line_axis)
    return np.concatenate([dofs_of(first), across_the_line, dofs_of(third)[[plane_axis]]])
