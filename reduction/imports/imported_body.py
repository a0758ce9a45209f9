"""A body of another program, and what was lost on the way."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.reduction.certificate import FREE_MESH
from carrierflex.reduction.ffrf_data import FfrfData
from carrierflex.reduction.reduced_model import PILOT_COORDINATES, MassProperties, ReducedModel

#: Units of length [m] and force [N] by name; time is in seconds, the unit of mass follows.
UNIT_SYSTEMS = {"m-N": (1.0, 1.0), "mm-N": (1e-3, 1.0), "in-lbf": (0.0254, 4.4482216152605)}
#: Larger bodies are refused: a dense matrix of this order takes 0.5 GB.
MOST_COORDINATES = 8_000
_TRANSLATIONS = 3


@dataclass(frozen=True, eq=False)
class ImportedBody:
    """A body that another program wrote, in SI units.

    Parameters
    ----------
    model : ReducedModel
        The body.
    losses : tuple of str
        What the file and the body do not have in common, one line each.
    """

    model: ReducedModel
    losses: tuple[str, ...] = ()


def pilot_labels(pilots: Sequence[tuple[str, tuple[int, ...]]]) -> tuple[str, ...]:
    """Coordinates of pilots in words, from their names and components."""
    return tuple(
        f"{name} {PILOT_COORDINATES[i]}" for name, components in pilots for i in components
    )


def origin_of(source: str, format: str) -> dict[str, str]:
    """Provenance of a body that was read from a file of another program."""
    return {"converted_from": source, "format": format, FREE_MESH[0]: FREE_MESH[1]}


def in_si(model: ReducedModel, units: str) -> ReducedModel:
    """Body in SI units of one whose numbers are in another system of :data:`UNIT_SYSTEMS`.

    With the units L of length and F of force an energy is ``F L`` times its number, a displacement
    L times; rotations are in rad. Modal coordinates keep their frequencies and are scaled to unit
    mass in SI units.
    """
    L, F = UNIT_SYSTEMS[units]
    if L == F == 1.0:
        return model
    s = np.full(model.n_coordinates, 1.0 / np.sqrt(F * L))
    for name in model.pilots:
        moves = np.array(model.components_of(name)) < _TRANSLATIONS
        s[model.rows_of(name)] = np.where(moves, 1.0 / L, 1.0)
    K, M, D = (F * L * s[:, None] * A * s for A in (model.K, model.M, model.D))
    mass = model.mass_properties
    ffrf = None if model.ffrf is None else _invariants_in_si(model.ffrf, s, L, F)
    return replace(
        model,
        K=K,
        M=M,
        D=D,
        pilots={name: L * point for name, point in model.pilots.items()},
        sensor_rows=L * model.sensor_rows * s,
        mass_properties=MassProperties(F / L * mass.mass, L * mass.centre, F * L * mass.inertia),
        ffrf=ffrf,
    )


def _invariants_in_si(data: FfrfData, s: NDArray[np.float64], L: float, F: float) -> FfrfData:
    """Integrals of density, position and displacement field; the field is ``L T s`` in SI."""
    return FfrfData(
        F / L * data.mass,
        F * data.first_moment,
        F * L * data.second_moment,
        F * data.N * s,
        F * L * data.P * s,
        F * L * data.Q * np.outer(s, s),
    )
