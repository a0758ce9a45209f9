"""Misalignment of planets, sun and ring that a kink of shaft and carrier makes in the whole stage.

Static equilibria over a turn, with and without the kink, with the flexible and with a rigid
carrier. Contact pressure and pitting life follow by equations 10 and 11 of the 2012 paper.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.involute_pair import InvolutePair
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.stage_data import StageData
from carrierflex.simulation.stage.tooth_contact import (
    MeshContact,
    ToothFlank,
    life_ratio,
    mesh_contact,
)

if TYPE_CHECKING:
    from carrierflex.simulation.stage.stage_body import StageBody
    from carrierflex.simulation.stage.statics import SteadyLoad

#: Carrier angle of the kink's axis [rad]: towards pin 1, whose meshes it misaligns by nearly all.
_KINK_AXIS = 0.0


@dataclass(frozen=True, eq=False)
class StageState:
    """Mean over a turn of the stage with one support, carrier and kink, in the carrier frame.

    Parameters
    ----------
    support, carrier : str
        In words.
    phi_PLC : float
        Kink of main shaft and carrier [rad].
    tilt : mapping of str to ndarray, shape (2,)
        Rotation about y and z [rad] by part.
    slope : ndarray, shape (2 p,)
        Misalignment of the sun's and the ring's meshes with p planets in the plane of action [rad].
    force : ndarray, shape (2 p,)
        Force along the tooth normal [N].
    """

    support: str
    carrier: str
    phi_PLC: float
    tilt: Mapping[str, NDArray[np.float64]]
    slope: NDArray[np.float64]
    force: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class KinkInMesh:
    """What the kink does to one kind of mesh.

    Parameters
    ----------
    support, carrier, mesh : str
        In words.
    common_slope : float
        Mean misalignment of its meshes without a kink [rad]: torque tilts all planets alike.
    added_slope : ndarray, shape (p,)
        What the kink adds, by planet [rad].
    pressure, pressure_with_kink : float
        Largest contact pressure of its meshes, the common misalignment taken up by a lead
        correction [Pa].
    uncorrected, uncorrected_with_kink : float
        The same without a lead correction [Pa].
    """

    support: str
    carrier: str
    mesh: str
    common_slope: float
    added_slope: NDArray[np.float64]
    pressure: float
    pressure_with_kink: float
    uncorrected: float
    uncorrected_with_kink: float

    @property
    def pressure_ratio(self) -> float:
        """Contact pressure with the kink over that without, lead corrected."""
        return self.pressure_with_kink / self.pressure

    @property
    def life_ratio(self) -> float:
        """Pitting life with the kink over that without, lead corrected."""
        return life_ratio(self.pressure_ratio)

    @property
    def worst(self) -> float:
        """The added misalignment that is largest in size [rad]."""
        return float(self.added_slope[np.abs(self.added_slope).argmax()])


def stage_states(
    bodies: Mapping[str, StageBody],
    supports: Mapping[str, StageData],
    phi_PLC: float,
    load: SteadyLoad,
) -> list[StageState]:
    """States of every support and carrier, without the kink and with it.

    Parameters
    ----------
    bodies : mapping of str to StageBody
        Elastic bodies by carrier.
    supports : mapping of str to StageData
        Stages by support.
    phi_PLC : float
        Kink [rad].
    load : SteadyLoad
        Load.

    Raises
    ------
    NotConvergedError
        Where a contact at rest does not settle.
    """
    return [
        _state((support, carrier, phi), body, data, load)
        for support, data in supports.items()
        for carrier, body in bodies.items()
        for phi in (0.0, phi_PLC)
    ]


def _state(
    name: tuple[str, str, float], body: StageBody, data: StageData, load: SteadyLoad
) -> StageState:

    from carrierflex.simulation.stage.part_loads import mesh_misalignment, part_loads, part_tilt
    from carrierflex.simulation.stage.quasi_static import quasi_static_turn
    from carrierflex.simulation.stage.stage_model import stage_model

    effects = StageEffects(phi_PLC=name[2], theta_PLC=_KINK_AXIS)
    model = stage_model(body, data, effects=effects, speed=0.0)
    c = quasi_static_turn(model, load).c
    wheels = ("sun", "ring", *(f"planet_{pin + 1}" for pin in range(body.n_planets)))
    tilt = {wheel: part_tilt(model, wheel, c).mean(axis=0) for wheel in wheels}
    force = part_loads(model, c).mesh_force[:, : 2 * body.n_planets].mean(axis=0)
    return StageState(*name, tilt, mesh_misalignment(model, c).mean(axis=0), force)


def kinks_in_meshes(
    states: Sequence[StageState], pairs: Mapping[str, InvolutePair], flank: ToothFlank
) -> list[KinkInMesh]:
    """Pressure of sun and ring meshes without and with the kink.

    Parameters
    ----------
    states : sequence of StageState
        From :func:`stage_states`.
    pairs : mapping of str to InvolutePair
        Gear pairs ``sun`` and ``ring``.
    flank : ToothFlank
        Modifications and stiffness.
    """
    return list(_kinks(states, pairs, flank))


def _kinks(
    states: Sequence[StageState], pairs: Mapping[str, InvolutePair], flank: ToothFlank
) -> Iterator[KinkInMesh]:
    for without, kinked in zip(states[::2], states[1::2], strict=True):
        for i, (mesh, pair) in enumerate(pairs.items()):
            n_planets = len(without.slope) // 2
            meshes = slice(n_planets * i, n_planets * (i + 1))
            common = float(without.slope[meshes].mean())
            pressures = [
                max(
                    contact_in_stage(
                        pair, flank, state.force[k], state.slope[k] - corrected
                    ).largest_pressure
                    for k in range(meshes.start, meshes.stop)
                )
                for corrected in (common, 0.0)
                for state in (without, kinked)
            ]
            added = kinked.slope[meshes] - without.slope[meshes]
            yield KinkInMesh(without.support, without.carrier, mesh, common, added, *pressures)


def contact_in_stage(
    pair: InvolutePair, flank: ToothFlank, normal_force: float, slope: float
) -> MeshContact:
    """Contact of a mesh that carries a force along its tooth normal [N], misaligned by slope."""
    tangential = normal_force * math.cos(pair.working_pressure_angle)
    tangential *= math.cos(pair.base_helix_angle)
    return mesh_contact(pair, flank, float(tangential), misalignment=float(slope))
