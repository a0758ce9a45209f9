"""The reduced model of a body with dihedral symmetry, from its half sector alone."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.spatial
from numpy.typing import NDArray

from carrierflex.fe.dense_threads import one_dense_thread
from carrierflex.fe.half_sector_sensors import HalfSectorSensors
from carrierflex.fe.symmetry_blocks import HalfSector, SymmetryBlock, symmetry_block
from carrierflex.geometry.dihedral_group import IrreducibleRepresentation
from carrierflex.reduction.craig_bampton import MODAL_DAMPING_RATIO, coordinate_labels
from carrierflex.reduction.ffrf_data import FfrfData, ffrf_data
from carrierflex.reduction.fixed_interface_modes import FixedInterfaceModes, fixed_interface_modes
from carrierflex.reduction.held_structure import GroundedBlock, HeldStructure
from carrierflex.reduction.modes.mode_rules import ModeRule, modes_by_rule, rule_of
from carrierflex.reduction.reduced_model import MassProperties, ReducedModel

#: Distance [m] within which a node counts as the image of another.
_SAME_POINT = 1e-8
#: Modes looked for in every block beyond its share, so that a second look is rarely needed.
_SPARE_MODES = 3


@dataclass(frozen=True, eq=False)
class SymmetricBasis:
    """Craig-Bampton basis of a body with dihedral symmetry, held on its half sector.

    Behind the pilots' columns of T stand the modes' partners, `kinds` in the order of the modes.
    """

    half: HalfSector
    K_bb: NDArray[np.float64]
    omega: NDArray[np.float64]
    T: NDArray[np.float64]
    motions: NDArray[np.float64]
    kinds: tuple[IrreducibleRepresentation, ...]

    def mode_columns(self, kind: IrreducibleRepresentation) -> NDArray[np.int64]:
        """Columns of T of the modes that follow `kind`, shape (k, d)."""
        ends = np.cumsum([len(self.K_bb), *(each.dimension for each in self.kinds)])
        first = [end for end, each in zip(ends, self.kinds, strict=False) if each is kind]
        return np.array(first, dtype=np.int64)[:, None] + np.arange(kind.dimension)

    def on_block(self, block: SymmetryBlock) -> tuple[NDArray[np.float64], FixedInterfaceModes]:
        """Constraint modes and kept modes of a block, as its unknowns."""
        m, columns = len(self.K_bb), self.mode_columns(block.representation)
        Psi = block.unknowns(self.T[:, :m] @ block.pilot_coordinates)
        Phi = block.unknowns(self.T[:, columns.T].transpose(1, 0, 2))
        return Psi, FixedInterfaceModes(Phi, self.omega[columns[:, 0] - m])

    def on_image(self, number: int, rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """Turn `rows` (..., m + k), read from the half sector, into those of its image."""
        return np.asarray(rows @ self.motions[number].T)

    def on_images(
        self, images: NDArray[np.int64], rows: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Turn rows (n, m + k), read from the half sector, each into that of its own image."""
        turned = np.empty_like(rows)
        for number in np.unique(images):
            on_image = images == number
            turned[on_image] = self.on_image(int(number), rows[on_image])
        return turned

    def inertia_invariants(self) -> FfrfData:
        """Inertia invariants of the whole body: those of all images of the half sector."""
        half_sector = ffrf_data(self.half.structure, self.T)
        images = [
            half_sector.turned(rho).transformed(Q.T)
            for rho, Q in zip(self.half.group.motions, self.motions, strict=True)
        ]
        return FfrfData(
            mass=sum(image.mass for image in images),
            first_moment=np.sum([image.first_moment for image in images], axis=0),
            second_moment=np.sum([image.second_moment for image in images], axis=0),
            N=np.sum([image.N for image in images], axis=0),
            P=np.sum([image.P for image in images], axis=0),
            Q=np.sum([image.Q for image in images], axis=0),
        )

    def whole_body(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Basis at the nodes of the whole body, shape (3 n, m + k)."""
        tree = scipy.spatial.KDTree(points)
        field = np.full((len(points), 3, self.T.shape[1]), np.nan)
        on_nodes = self.T.reshape(-1, 3, self.T.shape[1])
        for number, rho in enumerate(self.half.group.motions):
            distance, node = tree.query(self.half.structure.points @ rho.T)
            if distance.max() > _SAME_POINT:
                raise ValueError(
                    f"a node of the half sector's image {number} lies {distance.max():.1e} m from "
                    "the nearest node; expected the nodes of the body that the half sector belongs "
                    "to"
                )
            field[node] = np.einsum("ab,nbc->nac", rho, self.on_image(number, on_nodes))
        if np.isnan(field).any():
            raise ValueError(
                "the body has nodes that are no images of the half sector's; expected the images "
                "of it and no more"
            )
        return field.reshape(-1, self.T.shape[1])


@dataclass(frozen=True, eq=False)
class SymmetricReduction:
    """A reduced body with the basis that made it.

    Parameters
    ----------
    model : ReducedModel
        What simulation works with.
    basis : SymmetricBasis
        Basis on the half sector.
    sensors : HalfSectorSensors
        Sensors of the whole body; may be none.
    """

    model: ReducedModel
    basis: SymmetricBasis
    sensors: HalfSectorSensors


@one_dense_thread()
def symmetric_craig_bampton(
    half: HalfSector,
    retained: int | ModeRule,
    *,
    sensors: HalfSectorSensors | None = None,
    provenance: Mapping[str, str] | None = None,
    damping_ratio: float = MODAL_DAMPING_RATIO,
    seed: int = 0,
) -> SymmetricReduction:
    """Reduce a body with dihedral symmetry.

    The result is that of :func:`carrierflex.reduction.craig_bampton.craig_bampton`.

    Modes of one frequency are the partners of a pair, even and odd about pin 1's meridional plane,
    where the whole body's path turns them as
    :mod:`carrierflex.reduction.modes.mode_orientation` says.

    Parameters
    ----------
    half : HalfSector
        The body's half sector.
    retained : int or ModeRule
        Fixed-interface modes kept: at least this number, completed to whole groups of equal
        frequency, or what a rule says.
    sensors : HalfSectorSensors, optional
        Sensors of the whole body.
    provenance : mapping of str to str, optional
        Inputs and versions, kept with the result.
    damping_ratio : float
        Share ζ of critical damping on each fixed-interface mode.
    seed : int
        Seed of the Lanczos iterations' starting blocks.

    Raises
    ------
    SingularMatrixError, AccuracyError, ValueError
        From the factorisations and the eigenvalue problems.
    """
    if sensors is None:
        sensors = HalfSectorSensors(
            (), sp.csr_array((0, half.structure.n_dofs)), np.zeros(0, dtype=np.int64)
        )
    basis = _symmetric_basis(half, retained, seed=seed)
    m, n = len(basis.K_bb), basis.T.shape[1]
    ffrf = basis.inertia_invariants()
    omega = basis.omega
    K, D = np.zeros((n, n)), np.zeros((n, n))
    K[:m, :m] = basis.K_bb
    K[range(m, n), range(m, n)] = omega**2
    D[range(m, n), range(m, n)] = 2.0 * damping_ratio * omega
    names = tuple(half.pilots)
    model = ReducedModel(
        name=half.structure.name,
        K=K,
        M=(ffrf.Me + ffrf.Me.T) / 2.0,
        D=D,
        labels=coordinate_labels(names, omega),
        pilots=dict(half.pilots),
        pilot_coordinates={name: np.arange(6 * i, 6 * i + 6) for i, name in enumerate(names)},
        sensor_names=sensors.names,
        sensor_rows=basis.on_images(sensors.images, sensors.rows @ basis.T),
        mass_properties=_mass_properties(ffrf),
        provenance=dict(provenance or {}),
        ffrf=ffrf,
    )
    return SymmetricReduction(model, basis, sensors)


def _mass_properties(ffrf: FfrfData) -> MassProperties:
    c = ffrf.centre
    return MassProperties(ffrf.mass, c, ffrf.J - ffrf.mass * (c @ c * np.eye(3) - np.outer(c, c)))


@dataclass(frozen=True, eq=False)
class _SolvedBlock:
    """Rest of a block once its factor is gone: fields of its d partners on the half sector."""

    kind: IrreducibleRepresentation
    X: NDArray[np.float64]
    K_bb: NDArray[np.float64]
    Psi: NDArray[np.float64]
    omega: NDArray[np.float64]
    Phi: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class _SolvedBody:
    """All blocks, and the lowest frequencies of the body that they give for certain."""

    blocks: list[_SolvedBlock]
    omega: NDArray[np.float64]


def _symmetric_basis(
    half: HalfSector, retained: int | ModeRule, *, seed: int = 0
) -> SymmetricBasis:
    """Craig-Bampton basis of a body with dihedral symmetry."""

    def lowest_modes(n_modes: int) -> _SolvedBody:
        return _with_lowest_modes(half, n_modes, seed)

    most = len(half.group.motions) * half.structure.n_dofs
    body, n_modes = modes_by_rule(rule_of(retained), lowest_modes, most)
    solved, chosen = body.blocks, _lowest(body.blocks, n_modes)
    n_half, pilots = half.structure.n_dofs, half.pilot_motions
    T_pilots = np.zeros((n_half, pilots.shape[1]))
    K_bb = np.zeros(pilots.shape[1:])
    for solution in solved:
        for Psi, X in zip(solution.Psi, solution.X, strict=True):
            T_pilots += Psi @ X.T
            K_bb += X @ solution.K_bb @ X.T
    T_modes = [solved[b].Phi[:, :, i].T for b, i in chosen]
    kinds = [solved[b].kind for b, _ in chosen]
    return SymmetricBasis(
        half=half,
        K_bb=(K_bb + K_bb.T) / 2.0,
        omega=np.array(
            [solved[b].omega[i] for b, i in chosen for _ in range(solved[b].kind.dimension)]
        ),
        T=np.concatenate([T_pilots, *T_modes], axis=1),
        kinds=tuple(kinds),
        motions=np.array(
            [
                scipy.linalg.block_diag(Q, *(kind.matrices[number] for kind in kinds))
                for number, Q in enumerate(pilots)
            ]
        ),
    )


def _solved(
    half: HalfSector, kind: IrreducibleRepresentation, n_modes: int, seed: int
) -> _SolvedBlock:
    """Static and dynamic solution of one block; nothing of its own size outlives the call."""
    block = symmetry_block(half, kind)
    fixed_interface = HeldStructure(GroundedBlock(block), (block,))
    Psi, K_bb = fixed_interface.constraint_modes()
    modes = fixed_interface_modes(
        fixed_interface, block.M, n_modes, rng=np.random.default_rng(seed)
    )
    return _SolvedBlock(
        kind,
        block.pilot_coordinates,
        K_bb,
        block.partners(Psi),
        modes.omega,
        block.partners(modes.Phi),
    )


def _with_lowest_modes(half: HalfSector, n_modes: int, seed: int) -> _SolvedBody:
    """All blocks, each with a mode at or above the highest of the lowest `n_modes` of the body."""
    kinds, images = half.group.representations, len(half.group.motions)
    shares = [-(-n_modes * kind.dimension // images) + _SPARE_MODES for kind in kinds]
    counts = shares if n_modes else [0] * len(kinds)
    solved = [_solved(half, kind, n, seed) for kind, n in zip(kinds, counts, strict=True)]
    while True:
        have = np.sort(
            np.concatenate(
                [np.repeat(solution.omega, solution.kind.dimension) for solution in solved]
            )
        )
        if not n_modes:
            return _SolvedBody(solved, have)
        highest = have[n_modes - 1] if len(have) >= n_modes else np.inf
        if all(solution.omega[-1] >= highest for solution in solved):
            return _SolvedBody(solved, have[:n_modes])
        solved = [
            solution
            if solution.omega[-1] >= highest
            else _solved(half, solution.kind, 2 * len(solution.omega), seed)
            for solution in solved
        ]


def _lowest(solved: list[_SolvedBlock], n_modes: int) -> list[tuple[int, int]]:
    """Block and number of the modes that make up the lowest `n_modes`, ascending."""
    modes = sorted(
        (omega, b, i) for b, solution in enumerate(solved) for i, omega in enumerate(solution.omega)
    )
    counts = np.cumsum([solved[b].kind.dimension for _, b, _ in modes])
    return (
        [(b, i) for _, b, i in modes[: int(np.searchsorted(counts, n_modes)) + 1]]
        if n_modes
        else []
    )
