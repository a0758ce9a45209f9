"""How much do the couplings decide? Pilot stiffness and rim deflection with distributing and with rigid couplings.

A distributing coupling (RBE3) lets the surface deform, a rigid one (RBE2) forbids it: the truth of a fitted part lies between.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fe.carrier_curves import CASES, UNIT_TORQUE, flexible_cases, sensor_curve, stiff_cases
from fe.deflection_curves import DeflectionCurve
from fe.rigid_couplings import rigidly_coupled
from fe.structural_model import StructuralModel
from geometry.carrier_mesh import DEFAULT_SIZE
from geometry.parameter_files import read_parameters
from reduction.held_structure import GroundedBody, HeldStructure
from workflows.named_bodies import body_structure
from workflows.outputs import prepared_folder, save_json, versions
from workflows.progress import Stages


@dataclass(frozen=True, eq=False)
class CouplingBracket:
    """Both bounds for one carrier variant, the shaft face held through its pilot.

    Parameters
    ----------
    pilots : tuple of str
        Pilots that were loaded.
    stiffness : ndarray, shape (2, n_pilots, 6)
        Force over own motion of each pilot coordinate [N/m, N m/rad]: distributing, rigid.
    curves : tuple of DeflectionCurve
        Torque curve: distributing, rigid.
    """

    pilots: tuple[str, ...]
    stiffness: NDArray[np.float64]
    curves: tuple[DeflectionCurve, DeflectionCurve]


def main(
    *, out: Path, size: float = DEFAULT_SIZE, parameters: Path | None = None, quiet: bool = False
) -> dict[str, CouplingBracket]:
    """Bracket pilot stiffness and deflection curves between distributing and rigid couplings; writes couplings.json.

    Parameters
    ----------
    out
        Output folder.
    size
        Element edge length [m].
    parameters
        TOML file with the tables [carrier], [pin], [gear], dimensions in metres; what it leaves out keeps its default.
    quiet
        Show no progress.

    Returns
    -------
    dict
        Bracket by variant. Rigid couplings are never softer; a narrow bracket means that the coupling hardly matters.
    """
    stage = read_parameters(parameters)
    prepared_folder(out)
    stages = Stages(2, quiet)
    brackets = {}
    for variant in ("flexible", "stiff"):
        with stages.stage(f"{variant} carrier with both couplings"):
            cases = flexible_cases(stage.carrier, stage.gear) if variant == "flexible" else stiff_cases(stage.gear)
            mesh, soft = body_structure(f"{variant}_carrier", stage, size)
            bounds = [
                _bound(variant, structure, cases[CASES.index("both")])
                for structure in (soft, rigidly_coupled(soft, mesh))
            ]
            (k_soft, curve_soft), (k_rigid, curve_rigid) = bounds
            brackets[variant] = CouplingBracket(
                tuple(pilot.name for pilot in soft.pilots[1:]), np.array([k_soft, k_rigid]), (curve_soft, curve_rigid)
            )
    save_json(out / "couplings.json", {"size": size, "brackets": brackets, "versions": versions()})
    return brackets


def _bound(
    name: str, structure: StructuralModel, load: dict[str, NDArray[np.float64]]
) -> tuple[NDArray[np.float64], DeflectionCurve]:
    """Own stiffness of every pilot but the first, which is held, and the torque curve."""
    body = GroundedBody(structure.K, structure.points, structure.rigid_points)
    held = HeldStructure(body, structure.pilots[:1])
    forces = np.concatenate(
        [*(pilot.G.T.toarray() for pilot in structure.pilots[1:]), structure.load_vector(load)[:, None]], axis=1
    )
    u = held.solve(forces, np.zeros((6, forces.shape[1])))[0]
    stiffness = np.array(
        [1.0 / (pilot.G @ u[:, 6 * i : 6 * i + 6]).diagonal() for i, pilot in enumerate(structure.pilots[1:])]
    )
    assert structure.sensors is not None
    readings = structure.sensors.rows @ u[:, -1]
    return stiffness, sensor_curve(name, readings, UNIT_TORQUE, structure.sensors.radius)
