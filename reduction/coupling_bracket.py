"""Pilot stiffness and rim deflection of a carrier between distributing and rigid couplings.

A distributing coupling (RBE3) lets the surface deform, a rigid one (RBE2) forbids it: the truth of
a fitted part lies between.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.carrier_curves import UNIT_TORQUE, sensor_curve
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.fe.load_cases import PilotLoad
from carrierflex.fe.rigid_couplings import rigidly_coupled
from carrierflex.fe.structural_model import StructuralModel
from carrierflex.geometry.tet_mesh import NamedSurfaces
from carrierflex.reduction.held_structure import GroundedBody, HeldStructure

#: Pilots that are made rigid one group at a time, by a part of their names.
_GROUPS = {"shaft face": "shaft_face", "bearing seats": "_seat", "pins": "pin_"}


@dataclass(frozen=True, eq=False)
class CouplingBracket:
    """Both bounds for one carrier, the shaft face held through its pilot.

    Parameters
    ----------
    curve_name : str
        Curve that the torque gives, ``delta_f`` (flexible) or ``delta_s`` (stiff).
    pilots : tuple of str
        Pilots that were loaded.
    stiffness : ndarray, shape (2, n_pilots, 6)
        Force over its own motion of each pilot coordinate [N/m, N m/rad]: distributing, rigid.
    curves : tuple of DeflectionCurve
        Torque curve: distributing, rigid.
    rigid_groups : dict of str to DeflectionCurve
        Torque curve with one group of pilots rigid, the others distributing: shaft face, bearing
        seats, pins.
    """

    curve_name: str
    pilots: tuple[str, ...]
    stiffness: NDArray[np.float64]
    curves: tuple[DeflectionCurve, DeflectionCurve]
    rigid_groups: dict[str, DeflectionCurve]

    @property
    def all_curves(self) -> dict[str, DeflectionCurve]:
        """Torque curves by what is rigid: nothing, each group, everything."""
        return {"nothing": self.curves[0], **self.rigid_groups, "everything": self.curves[1]}

    def curve_change(self, rigid: str) -> float:
        """RMS of what making `rigid` rigid adds to the axial curve.

        Relative to the RMS of the distributing curve.
        """
        soft = self.curves[0].axial
        return float(np.linalg.norm(self.all_curves[rigid].axial - soft) / np.linalg.norm(soft))


def coupling_bracket(
    curve_name: str, mesh: NamedSurfaces, soft: StructuralModel, load: Mapping[str, PilotLoad]
) -> CouplingBracket:
    """Bound the pilots' stiffness and the torque curve by distributing and by rigid couplings.

    Parameters
    ----------
    curve_name : str
        Name of the torque curve.
    mesh : NamedSurfaces
        Mesh of the carrier.
    soft : StructuralModel
        The carrier with distributing pilots, the shaft face's first, and the sensor circle.
    load : mapping of str to ndarray, shape (6,)
        Load at the pilots for a torque of 1 kN m.

    Returns
    -------
    CouplingBracket
        Rigid couplings are never softer.
    """
    structures = [_constrained(structure) for structure in (soft, rigidly_coupled(soft, mesh))]
    stiffness = np.array([_pilot_stiffness(*pair) for pair in structures])
    curve_soft, curve_rigid = (_curve(curve_name, *pair, load) for pair in structures)
    names = [pilot.name for pilot in soft.pilots]
    groups = {
        group: _curve(
            curve_name,
            *_constrained(rigidly_coupled(soft, mesh, tuple(n for n in names if marker in n))),
            load,
        )
        for group, marker in _GROUPS.items()
    }
    return CouplingBracket(
        curve_name, tuple(names[1:]), stiffness, (curve_soft, curve_rigid), groups
    )


def _constrained(structure: StructuralModel) -> tuple[StructuralModel, HeldStructure]:
    """The body with its first pilot, the shaft face's, held."""
    body = GroundedBody(structure.K, structure.points, structure.rigid_points)
    return structure, HeldStructure(body, structure.pilots[:1])


def _pilot_stiffness(structure: StructuralModel, clamped: HeldStructure) -> NDArray[np.float64]:
    """Force over its own motion of every pilot coordinate but those of the pilot that is held."""
    pilots = structure.pilots[1:]
    forces = np.concatenate([pilot.G.T.toarray() for pilot in pilots], axis=1)
    u = clamped.solve(forces, np.zeros((6, forces.shape[1])))[0]
    return np.array(
        [1.0 / (pilot.G @ u[:, 6 * i : 6 * i + 6]).diagonal() for i, pilot in enumerate(pilots)]
    )


def _curve(
    name: str, structure: StructuralModel, clamped: HeldStructure, load: Mapping[str, PilotLoad]
) -> DeflectionCurve:
    """Rim deflection under the torque's load."""
    u = clamped.solve(structure.load_vector(load)[:, None], np.zeros((6, 1)))[0]
    assert structure.sensors is not None
    return sensor_curve(
        name, structure.sensors.rows @ u[:, 0], UNIT_TORQUE, structure.sensors.radius
    )
