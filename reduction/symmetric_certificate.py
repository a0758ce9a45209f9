"""The certificate of a body with dihedral symmetry, by the blocks of its half sector.

Its lines and limits are those of :mod:`carrierflex.reduction.certificate`. Nothing of the reduction
is used but its result: every block is assembled and factorised again, and its full answer compared
with what the reduced matrices say of displacements of that kind. Static stiffness, mass and moments
of the left-out modes of the whole body are sums over the blocks, ``Σ_j X_j A_b X_jᵀ``, X_j the
pilots' coordinates of partner j.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.dense_threads import one_dense_thread
from carrierflex.fe.symmetry_blocks import SymmetryBlock, symmetry_block
from carrierflex.reduction.certificate import (
    Certificate,
    FreeModeErrors,
    compliance_checks,
    compliance_errors_of_stiffness,
    fixed_interface_cut_off,
    free_mode_checks,
    free_mode_errors,
    inner_checks,
    response_checks,
    stiffness_of_fields,
)
from carrierflex.reduction.dynamic_stiffness import FullResponse, response_of_fields
from carrierflex.reduction.held_structure import GroundedBlock, HeldStructure
from carrierflex.reduction.symmetric_craig_bampton import SymmetricBasis, SymmetricReduction

#: Free modes computed at first of a block; more where the last of them lies below the cut-off.
_FREE_MODES = 4


@one_dense_thread()
def certify_by_blocks(
    reduction: SymmetricReduction,
    *,
    cut_off_hz: float | None = None,
    seed: int = 0,
    note: Callable[[str, float], None] = lambda text, share: None,
) -> Certificate:
    """Compare a body reduced from its half sector with the full one, and check it in itself.

    Parameters
    ----------
    reduction : SymmetricReduction
        The reduced body with its basis.
    cut_off_hz : float, optional
        Frequency up to which the body is used; by default a quarter of the highest fixed-interface
        frequency kept.
    seed : int
        Seed of the starting blocks of the free modes.
    note : callable
        Told each block with the share of the work that is done.

    Returns
    -------
    Certificate
        The lines of :func:`carrierflex.reduction.certificate.certify`.
    """
    basis, model = reduction.basis, reduction.model
    if cut_off_hz is None:
        cut_off_hz = fixed_interface_cut_off(basis.omega)
    kinds = basis.half.group.representations
    blocks = []
    for number, kind in enumerate(kinds):
        note(f"displacements of kind {kind.name}", number / len(kinds))
        blocks.append(_compared(symmetry_block(basis.half, kind), reduction, cut_off_hz, seed))
    checks = compliance_checks(
        compliance_errors_of_stiffness(model, np.sum([block.K_full for block in blocks], axis=0))
    )
    checks += free_mode_checks(
        FreeModeErrors.together([block.free_modes for block in blocks]), cut_off_hz
    )
    if cut_off_hz:
        response = _of_whole_body([block.response for block in blocks], reduction)
        checks += response_checks(response, cut_off_hz)
    return Certificate(cut_off_hz, (*checks, *inner_checks(model, cut_off_hz)))


def response_by_blocks(reduction: SymmetricReduction) -> FullResponse:
    """Frequency response of the full body, and of its reduction from the half sector."""
    half, responses = reduction.basis.half, []
    for kind in half.group.representations:
        block = symmetry_block(half, kind)
        responses.append(_response(block, GroundedBlock(block), reduction))
    return _of_whole_body(responses, reduction)


@dataclass(frozen=True, eq=False)
class _Compared:
    """What a block leaves once its factor is gone; pilots in the whole body's coordinates."""

    K_full: NDArray[np.float64]
    free_modes: FreeModeErrors
    response: FullResponse


def _compared(
    block: SymmetryBlock,
    reduction: SymmetricReduction,
    cut_off_hz: float,
    seed: int,
) -> _Compared:
    basis, model, body = reduction.basis, reduction.model, GroundedBlock(block)
    X, d = block.pilot_coordinates, block.representation.dimension
    Psi, modes = basis.on_block(block)
    V = _first_partner(block, basis)
    K_r, M_r = V.T @ model.K @ V, V.T @ model.M @ V
    m = Psi.shape[1]
    K_full = stiffness_of_fields(block.K, block.G, Psi, K_r[:m, :m])
    free = free_mode_errors(
        block.M,
        body,
        (K_r, M_r),
        np.concatenate([Psi, modes.Phi], axis=1),
        cut_off_hz,
        n_modes=_FREE_MODES * d,
        seed=seed,
    )
    return _Compared(_on_pilots(K_full, X), free.repeated(d), _response(block, body, reduction))


def _first_partner(block: SymmetryBlock, basis: SymmetricBasis) -> NDArray[np.float64]:
    """Reduced coordinates of the first partner in those of the whole body, shape (n, m + k)."""
    X, columns = block.pilot_coordinates[0], basis.mode_columns(block.representation)[:, 0]
    m, n = X.shape[1], basis.T.shape[1]
    V = np.zeros((n, m + len(columns)))
    V[: len(X), :m] = X
    V[columns, range(m, m + len(columns))] = 1.0
    return V


def _response(
    block: SymmetryBlock,
    body: GroundedBlock,
    reduction: SymmetricReduction,
) -> FullResponse:
    """Response of a block: pilots in the whole body's coordinates, one mode a partner.

    Sensors are read where their rows are, on the half sector.
    """
    X, d = block.pilot_coordinates, block.representation.dimension
    n_sensors = len(reduction.sensors.names)
    Psi, modes = reduction.basis.on_block(block)
    K_bb = X[0].T @ reduction.basis.K_bb @ X[0]
    scale = np.sqrt(block.representation.share)
    rows = sp.csr_array(sp.block_diag([reduction.sensors.rows] * d) @ block.T * scale)
    response = response_of_fields(HeldStructure(body, (block,)), block.M, Psi, K_bb, modes, rows)

    def read(rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """Readings of the partners (..., d n_sensors, m) under the pilots' own coordinates."""
        by_partner = rows.reshape(*rows.shape[:-2], d, n_sensors, rows.shape[-1])
        return np.asarray(np.einsum("...jsm,jpm->...sp", by_partner, X))

    k = len(modes.omega)
    modal = response.sensors_modal.reshape(d, n_sensors, k)
    return FullResponse(
        K_bb=_on_pilots(response.K_bb, X),
        M_bb=_on_pilots(response.M_bb, X),
        omega=np.repeat(modes.omega, d),
        L=np.einsum("im,jpm->ijp", response.L, X).reshape(k * d, len(X[0])),
        moments=np.array([_on_pilots(moment, X) for moment in response.moments]),
        sensors_static=read(response.sensors_static),
        sensors_modal=modal.transpose(1, 2, 0).reshape(n_sensors, k * d),
        sensor_moments=read(response.sensor_moments),
    )


def _on_pilots(A: NDArray[np.float64], X: NDArray[np.float64]) -> NDArray[np.float64]:
    """A block's matrix (m, m) as its share of the whole body's, ``Σ_j X_j A X_jᵀ``."""
    return np.asarray(np.einsum("jpm,mn,jqn->pq", X, A, X, optimize=True))


def _of_whole_body(blocks: list[FullResponse], reduction: SymmetricReduction) -> FullResponse:
    """Sum of the blocks, modes in the order of the basis, sensors turned to where they are."""
    basis, sensors = reduction.basis, reduction.sensors
    m = len(basis.K_bb)
    kinds = basis.half.group.representations
    order = np.concatenate([basis.mode_columns(kind).ravel() for kind in kinds]) - m
    L, modal = np.zeros((len(order), m)), np.zeros((len(sensors.names), len(order)))
    L[order] = np.concatenate([block.L for block in blocks])
    modal[:, order] = np.concatenate([block.sensors_modal for block in blocks], axis=1)

    def turned(rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """Readings under pilots and modes, at the images that hold the sensors."""
        return basis.on_images(sensors.images, np.concatenate([rows, modal], axis=1))

    static = np.sum([block.sensors_static for block in blocks], axis=0)
    moments = np.sum([block.sensor_moments for block in blocks], axis=0)
    readings = turned(static)
    return FullResponse(
        K_bb=np.sum([block.K_bb for block in blocks], axis=0),
        M_bb=np.sum([block.M_bb for block in blocks], axis=0),
        omega=basis.omega,
        L=L,
        moments=np.sum([block.moments for block in blocks], axis=0),
        sensors_static=readings[:, :m],
        sensors_modal=readings[:, m:],
        sensor_moments=np.array([turned(moment)[:, :m] for moment in moments]),
    )
