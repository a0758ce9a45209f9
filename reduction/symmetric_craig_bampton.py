"""The reduced model of a body with dihedral symmetry, from its half sector alone."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.dense_threads import one_dense_thread
from carrierflex.fe.half_sector_sensors import HalfSectorSensors
from carrierflex.fe.symmetry_blocks import HalfSector
from carrierflex.reduction.craig_bampton import MODAL_DAMPING_RATIO, coordinate_labels
from carrierflex.reduction.ffrf_data import FfrfData
from carrierflex.reduction.modes.mode_rules import ModeRule
from carrierflex.reduction.reduced_model import MassProperties, ReducedModel
from carrierflex.reduction.symmetric_reduction import SymmetricBasis, symmetric_basis


@dataclass(frozen=True, eq=False)
class SymmetricReduction:
    """A reduced body with the basis that made it.

    Parameters
    ----------
    model : ReducedModel
        What simulation works with.
    basis : SymmetricBasis
        Basis on the half sector.
    """

    model: ReducedModel
    basis: SymmetricBasis


@one_dense_thread()
def symmetric_craig_bampton(
    half: HalfSector,
    kept: int | ModeRule,
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
    kept : int or ModeRule
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
    basis = symmetric_basis(half, kept, seed=seed)
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
        sensor_names=sensors.names if sensors else (),
        sensor_rows=_sensor_rows(basis, sensors) if sensors else np.zeros((0, n)),
        mass_properties=_mass_properties(ffrf),
        provenance=dict(provenance or {}),
        ffrf=ffrf,
    )
    return SymmetricReduction(model, basis)


def _sensor_rows(basis: SymmetricBasis, sensors: HalfSectorSensors) -> NDArray[np.float64]:
    rows = sensors.rows @ basis.T
    for number in np.unique(sensors.images):
        on_image = sensors.images == number
        rows[on_image] = basis.on_image(int(number), rows[on_image])
    return np.asarray(rows)


def _mass_properties(ffrf: FfrfData) -> MassProperties:
    c = ffrf.centre
    return MassProperties(ffrf.mass, c, ffrf.J - ffrf.mass * (c @ c * np.eye(3) - np.outer(c, c)))
