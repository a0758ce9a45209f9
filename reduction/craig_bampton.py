"""Craig-Bampton reduction of a structural model, pilots by distributing couplings.

After Craig and Bampton (1968).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.couplings import Pilot
from carrierflex.fe.dense_threads import one_dense_thread
from carrierflex.fe.rigid_fit import ALL_COMPONENTS
from carrierflex.fe.structural_model import StructuralModel
from carrierflex.reduction.ffrf_data import inertia_invariants
from carrierflex.reduction.fixed_interface_modes import FixedInterfaceModes, fixed_interface_modes
from carrierflex.reduction.held_structure import Grounded, HeldStructure, grounded
from carrierflex.reduction.modes.mode_orientation import oriented
from carrierflex.reduction.modes.mode_rules import ModeRule, modes_by_rule, rule_of
from carrierflex.reduction.reduced_model import (
    FREE_MOTIONS,
    PILOT_COORDINATES,
    MassProperties,
    ReducedModel,
)
from carrierflex.reduction.rigid_body_checks import rigid_mass_properties

#: Chosen, no damping being published for these parts: 2 % of critical on every fixed-interface
#: mode.
MODAL_DAMPING_RATIO = 0.02
_SIX = 6


#: A vector that is this small beside the answer it is what is left of holds nothing new [share of
#: strain energy].
_NEGLIGIBLE = 1e-10


@dataclass(frozen=True, eq=False)
class Reduction:
    """A reduced body with the basis that made it.

    Parameters
    ----------
    model : ReducedModel
        What simulation works with.
    body : Grounded
        The factorised body, for further solves; the largest part, let it go when they are done.
    Psi : ndarray, shape (n_dofs, m)
        Constraint modes.
    modes : FixedInterfaceModes
        Fixed-interface modes.
    residuals : FixedInterfaceModes
        Residual vectors with their pseudo-frequencies; often none.
    """

    model: ReducedModel
    body: Grounded
    Psi: NDArray[np.float64]
    modes: FixedInterfaceModes
    residuals: FixedInterfaceModes

    @property
    def basis(self) -> NDArray[np.float64]:
        """Displacement field of every coordinate, shape (n_dofs, n)."""
        return np.concatenate([self.Psi, self.modes.Phi, self.residuals.Phi], axis=1)


@one_dense_thread()
def craig_bampton(
    structure: StructuralModel,
    retained: int | ModeRule,
    *,
    provenance: Mapping[str, str] | None = None,
    damping_ratio: float = MODAL_DAMPING_RATIO,
    seed: int = 0,
    residual_loads: NDArray[np.float64] | None = None,
    body: Grounded | None = None,
) -> Reduction:
    """Reduce a body to its pilots and some fixed-interface modes.

    With ``T = [Ψ Φ]``: ``K_r = Tᵀ K T = diag(Ψᵀ K Ψ, Ω²)`` (constraint modes do no work on
    fixed-interface modes), ``M_r = Tᵀ M T`` and ``D_r = diag(0, 2 ζ Ω)``.

    Parameters
    ----------
    structure : StructuralModel
        Free body with pilots.
    retained : int or ModeRule
        Fixed-interface modes kept: at least this number, completed to whole groups of equal
        frequency, or what a rule says.
    provenance : mapping of str to str, optional
        Inputs and versions, kept with the result.
    damping_ratio : float
        Share ζ of critical damping on each fixed-interface mode.
    seed : int
        Seed of the Lanczos iteration's starting vector.
    residual_loads : ndarray, shape (n_dofs, k), optional
        Nodal forces whose static answer the basis is to hold exactly
        (:mod:`carrierflex.reduction.residual_vectors`).
    body : Grounded, optional
        The same body, factorised before.

    Returns
    -------
    Reduction
        Reduced body and basis.

    Raises
    ------
    SingularMatrixError, AccuracyError, ValueError
        From the factorisation and the eigenvalue problem.

    References
    ----------
    Craig and Bampton (1968), AIAA Journal 6(7), 1313-1319.
    """
    body = body or grounded(structure)
    fixed_interface = HeldStructure(body, structure.pilots)
    Psi, K_bb = fixed_interface.constraint_modes()
    modes = _kept_modes(
        fixed_interface, structure.M, rule_of(retained), rng=np.random.default_rng(seed)
    )
    residuals = _residual_vectors(fixed_interface, structure, modes, residual_loads)
    T = np.concatenate([Psi, modes.Phi, residuals.Phi], axis=1)
    omega = np.concatenate([modes.omega, residuals.omega])
    M_r = T.T @ (structure.M @ T)
    m, n = len(K_bb), T.shape[1]
    K_r, D_r = np.zeros((n, n)), np.zeros((n, n))
    K_r[:m, :m] = K_bb
    K_r[range(m, n), range(m, n)] = omega**2
    D_r[range(m, n), range(m, n)] = 2.0 * damping_ratio * omega
    sensors = structure.sensors
    model = ReducedModel(
        name=structure.name,
        K=K_r,
        M=(M_r + M_r.T) / 2.0,
        D=D_r,
        labels=coordinate_labels(
            (pilot.name for pilot in structure.pilots),
            modes.omega,
            residuals.omega,
            components=partial_components(structure.pilots),
        ),
        pilots={pilot.name: pilot.point for pilot in structure.pilots},
        pilot_coordinates=numbered_coordinates(structure.pilots),
        pilot_components=partial_components(structure.pilots),
        sensor_names=sensors.names if sensors else (),
        sensor_rows=sensors.rows @ T if sensors else np.zeros((0, n)),
        mass_properties=mass_properties(structure),
        provenance={**(provenance or {}), **freedom_record(structure)},
        ffrf=inertia_invariants(structure, T),
    )
    return Reduction(model, body, Psi, modes, residuals)


def numbered_coordinates(pilots: Sequence[Pilot]) -> dict[str, NDArray[np.int64]]:
    """Coordinates of every pilot in a reduced body: pilot by pilot, one a component."""
    ends = np.cumsum([0, *(len(pilot.components) for pilot in pilots)])
    return {
        pilot.name: np.arange(first, last)
        for pilot, first, last in zip(pilots, ends[:-1], ends[1:], strict=True)
    }


def partial_components(pilots: Sequence[Pilot]) -> dict[str, tuple[int, ...]]:
    """Components of the pilots that have fewer than six."""
    return {p.name: p.components for p in pilots if p.components != ALL_COMPONENTS}


def freedom_record(structure: StructuralModel) -> dict[str, str]:
    """Provenance of a body that is not free in all six rigid motions; nothing of others."""
    free = structure.free_motions
    return {} if free is None or free.shape[1] == _SIX else {FREE_MOTIONS: str(free.shape[1])}


def mass_properties(structure: StructuralModel) -> MassProperties:
    """Mass, centre and inertia from the mass matrix and the rigid motions, ``Rᵀ M R``."""
    R = structure.rigid_modes
    return rigid_mass_properties(R.T @ (structure.M @ R))


def coordinate_labels(
    pilots: Iterable[str],
    omega: NDArray[np.float64],
    residual_omega: NDArray[np.float64] | None = None,
    *,
    components: Mapping[str, tuple[int, ...]] | None = None,
) -> tuple[str, ...]:
    """Every coordinate of a reduced body in words.

    Its pilots' six each, or those of `components`; its modes and residual vectors with frequency
    [Hz].
    """
    fewer = components or {}
    moved = [
        f"{pilot} {PILOT_COORDINATES[i]}"
        for pilot in pilots
        for i in fewer.get(pilot, ALL_COMPONENTS)
    ]
    modes = [f"mode {i} ({w / (2.0 * np.pi):.1f} Hz)" for i, w in enumerate(omega, start=1)]
    residual = np.zeros(0) if residual_omega is None else residual_omega
    vectors = [
        f"residual vector {i} ({w / (2.0 * np.pi):.1f} Hz)" for i, w in enumerate(residual, start=1)
    ]
    return (*moved, *modes, *vectors)


def _kept_modes(
    fixed_interface: HeldStructure, M: sp.csr_array, rule: ModeRule, *, rng: np.random.Generator
) -> FixedInterfaceModes:
    """Fixed-interface modes that a rule keeps: whole groups of equal frequency."""

    def lowest_modes(n_modes: int) -> FixedInterfaceModes:
        return fixed_interface_modes(fixed_interface, M, n_modes, rng=rng)

    modes, count = modes_by_rule(rule, lowest_modes, M.shape[0])
    return FixedInterfaceModes(modes.Phi[:, :count], modes.omega[:count])


def _residual_vectors(
    fixed_interface: HeldStructure,
    structure: StructuralModel,
    modes: FixedInterfaceModes,
    loads: NDArray[np.float64] | None,
) -> FixedInterfaceModes:
    """Pseudo-modes that complete the kept modes to the exact static answer to some loads.

    ``U = K_held⁻¹ F``, less its part in the kept modes, ``U - Φ Φᵀ M U``, is orthonormalised by its
    own small eigenvalue problem: mass-normalised, stiffness diagonal, orthogonal to every kept mode
    in mass and stiffness.

    References
    ----------
    .. [1] R. R. Craig, A. J. Kurdila, "Fundamentals of Structural Dynamics", 2nd ed. (2006),
       section 17.
    """
    if loads is None or loads.shape[1] == 0:
        return FixedInterfaceModes(np.zeros((structure.n_dofs, 0)), np.zeros(0))
    U = fixed_interface.static_response(loads)
    energy = np.einsum("nk,nk->k", U, loads)
    U = U[:, energy > 0.0] / np.sqrt(energy[energy > 0.0])
    for _ in range(2):  # once more for the rounding of the first time
        U = U - modes.Phi @ (modes.Phi.T @ (structure.M @ U))
    K_u, M_u = U.T @ (structure.K @ U), U.T @ (structure.M @ U)
    sizes, directions = np.linalg.eigh((K_u + K_u.T) / 2.0)
    W = directions[:, sizes > _NEGLIGIBLE] / np.sqrt(sizes[sizes > _NEGLIGIBLE])
    if W.shape[1] == 0:
        return FixedInterfaceModes(np.zeros((structure.n_dofs, 0)), np.zeros(0))
    mu, Z = scipy.linalg.eigh(W.T @ M_u @ W)
    order = np.argsort(-mu)
    # Flexibility normalised vectors have the mass mu = 1 / omega².
    omega = 1.0 / np.sqrt(mu[order])
    return FixedInterfaceModes(oriented(U @ W @ Z[:, order] * omega, omega), omega)
