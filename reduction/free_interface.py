"""A second basis with the same interface.

Free modes and residual flexibility (Rubin; Craig and Chang).

Modes of the free body take the place of those with the pilots held; what the left-out ones would
answer to forces at the pilots is kept as residual attachment modes. Statics at the pilots are
exact, as in the Craig-Bampton basis.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.structural_model import StructuralModel
from carrierflex.reduction.craig_bampton import (
    MODAL_DAMPING_RATIO,
    coordinate_labels,
    freedom_record,
    mass_properties,
    numbered_coordinates,
    partial_components,
)
from carrierflex.reduction.ffrf_data import inertia_invariants
from carrierflex.reduction.free_modes import FreeModes, full_free_modes
from carrierflex.reduction.held_structure import Grounded, grounded
from carrierflex.reduction.modes.mode_rules import ModeRule, modes_by_rule, rule_of
from carrierflex.reduction.reduced_model import ReducedModel


@dataclass(frozen=True, eq=False)
class FreeInterfaceReduction:
    """A reduced body with its basis.

    Parameters
    ----------
    model : ReducedModel
        What simulation works with.
    basis : ndarray, shape (n_dofs, n)
        Displacement field of every coordinate: pilots, rigid-body modes, free elastic modes.
    body : Grounded
        The factorised body.
    modes : FreeModes
        Free elastic modes kept.
    """

    model: ReducedModel
    basis: NDArray[np.float64]
    body: Grounded
    modes: FreeModes


def free_interface_reduction(
    structure: StructuralModel,
    retained: int | ModeRule,
    *,
    provenance: Mapping[str, str] | None = None,
    damping_ratio: float = MODAL_DAMPING_RATIO,
    seed: int = 0,
    body: Grounded | None = None,
) -> FreeInterfaceReduction:
    """Reduce a body to its pilots, six rigid-body modes and some free elastic modes.

    With rigid modes R, free modes Φ and ``Ψ = A_e Gᵀ - Φ Ω⁻² Φᵀ Gᵀ``, the answer to pilot forces
    under inertia relief less the kept modes' share: ``u = R a + Φ q + Ψ p``. Pilot motions ``d = G
    u`` take the place of p through ``S = G Ψ``: ``u = Ψ S⁻¹ d + (R - Ψ S⁻¹ G R) a + (Φ - Ψ S⁻¹ G Φ)
    q``. With ``a = a' + P d``, P the rigid motion that fits the pilots best, a rigid motion of the
    pilots moves the body with a' and q at zero, as in the Craig-Bampton basis: weight is the
    reduced mass times the pilots' rigid acceleration. Stiffness and mass are projected in full.

    Parameters
    ----------
    structure : StructuralModel
        Free body with pilots by distributing couplings.
    retained : int or ModeRule
        Free elastic modes kept: at least this number, completed to whole groups of equal frequency,
        or what a rule says.
    provenance : mapping of str to str, optional
        Inputs and versions, kept with the result.
    damping_ratio : float
        Share of critical damping on each kept free mode.
    seed : int
        Seed of the Lanczos iteration's starting block.
    body : Grounded, optional
        The same body, factorised before.

    Returns
    -------
    FreeInterfaceReduction
        Reduced body with six physical coordinates a pilot, as the Craig-Bampton one, and the basis.

    Raises
    ------
    SingularMatrixError, AccuracyError
        From the factorisation and the eigenvalue problem.

    References
    ----------
    .. [1] S. Rubin, "Improved component-mode representation for structural dynamic analysis", AIAA
       Journal 13 (1975).
    .. [2] R. R. Craig, C.-J. Chang, "On the use of attachment modes in substructure coupling for
       dynamic analysis" (1977).
    """
    body = body or grounded(structure)
    M, G = structure.M, sp.csr_array(sp.vstack([pilot.G for pilot in structure.pilots]))
    free = _kept_free_modes(structure, body, rule_of(retained), rng=np.random.default_rng(seed))
    R = body.rigid_modes @ _mass_orthonormal(body.rigid_modes, M)
    forces = G.T.toarray()
    Psi = _relieved(body, M @ R, R, forces) - free.Phi @ (
        (free.Phi.T @ forces) / free.omega[:, None] ** 2
    )
    modes = np.concatenate([R, free.Phi], axis=1)
    attached = np.linalg.solve((G @ Psi).T, Psi.T).T
    inner = modes - attached @ (G @ modes)
    n_rigid = R.shape[1]
    rigid_fit = np.linalg.pinv(G @ R)
    T = np.concatenate([attached + inner[:, :n_rigid] @ rigid_fit, inner], axis=1)
    K_r, M_r = T.T @ (structure.K @ T), T.T @ (M @ T)
    if G.shape[0] == n_rigid:
        # As many coordinates of pilots as rigid motions are these: their stiffness is rounding.
        K_r[:n_rigid], K_r[:, :n_rigid] = 0.0, 0.0
    damped = T.T @ (M @ free.Phi)
    omega = np.concatenate([np.zeros(n_rigid), free.omega])
    sensors = structure.sensors
    model = ReducedModel(
        name=structure.name,
        K=(K_r + K_r.T) / 2.0,
        M=(M_r + M_r.T) / 2.0,
        D=(damped * (2.0 * damping_ratio * free.omega)) @ damped.T,
        labels=coordinate_labels(
            (pilot.name for pilot in structure.pilots),
            omega,
            components=partial_components(structure.pilots),
        ),
        pilots={pilot.name: pilot.point for pilot in structure.pilots},
        pilot_coordinates=numbered_coordinates(structure.pilots),
        pilot_components=partial_components(structure.pilots),
        sensor_names=sensors.names if sensors else (),
        sensor_rows=sensors.rows @ T if sensors else np.zeros((0, T.shape[1])),
        mass_properties=mass_properties(structure),
        provenance={**(provenance or {}), **freedom_record(structure)},
        ffrf=inertia_invariants(structure, T),
    )
    return FreeInterfaceReduction(model, T, body, free)


def _relieved(
    body: Grounded, MR: NDArray[np.float64], R: NDArray[np.float64], forces: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Elastic response to forces that the body's own inertia balances.

    It is free of rigid motion; R is mass-orthonormal.
    """
    u = body.displacement(forces - MR @ (R.T @ forces))
    return u - R @ (MR.T @ u)


def _mass_orthonormal(R: NDArray[np.float64], M: sp.csr_array) -> NDArray[np.float64]:
    """Combination of rigid motions that makes their mass matrix the identity, shape (6, 6)."""
    return np.asarray(scipy.linalg.inv(scipy.linalg.cholesky(R.T @ (M @ R), lower=False)))


def _kept_free_modes(
    structure: StructuralModel, body: Grounded, rule: ModeRule, *, rng: np.random.Generator
) -> FreeModes:
    """Lowest elastic modes of the free body that a rule keeps: whole groups of equal frequency."""

    def lowest_modes(n_modes: int) -> FreeModes:
        return full_free_modes(structure.M, body, n_modes, rng=rng)

    modes, count = modes_by_rule(rule, lowest_modes, structure.n_dofs)
    return FreeModes(modes.Phi[:, :count], modes.omega[:count])
