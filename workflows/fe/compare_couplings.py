"""How much the couplings decide.

Pilot stiffness and rim deflection with distributing and with rigid couplings.

A distributing coupling (RBE3) lets the surface deform, a rigid one (RBE2) forbids it: the truth of
a fitted part lies between.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypedDict

from carrierflex.files.json_files import save_json
from carrierflex.files.versions import Versions, versions
from carrierflex.geometry.parameter_files import read_parameters
from carrierflex.workflows.fe.compute_curves import GivenFile
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages

if TYPE_CHECKING:
    from carrierflex.reduction.coupling_bracket import CouplingBracket


def main(
    *,
    out: Path,
    size: float | None = None,
    parameters: Path | None = None,
    step: Path | None = None,
    surfaces: Path | None = None,
    flexible_mesh: Path | None = None,
    stiff_mesh: Path | None = None,
    length_unit: Literal["m", "mm", "inch"] = "m",
    quiet: bool = False,
) -> dict[str, CouplingBracket]:
    """Bracket stiffness and curves between distributing and rigid couplings.

    Writes couplings.json.

    Parameters
    ----------
    out
        Folder to write: couplings.json.
    size
        Element edge length [m]; default: 0.03; of a STEP file 0.66 of the solid's mean wall (twice
        its volume over its surface), less where webs are thin.
    parameters
        TOML file with the tables [carrier], [pin], [gear], dimensions in metres; a missing key has
        its default. four_planets: a bundled set.
    step
        STEP file with the carrier without pins, instead of the parametric carrier; any length unit.
    surfaces
        TOML file that states the surfaces of the STEP or mesh files.
    flexible_mesh
        Mesh file (.msh, .inp, .bdf, .unv, .med; tetrahedra, hexahedra, wedges) of the carrier
        without pins, instead of the parametric carrier.
    stiff_mesh
        Mesh file of the same kinds of the carrier with bonded pins.
    length_unit
        Unit of the mesh files' coordinates.
    quiet
        Show no progress.

    Returns
    -------
    dict
        Bracket by variant: stiffness of every pilot, and the rim's curve with nothing, one group of
        pilots and everything rigid. Rigid couplings are never softer; a narrow bracket means that
        the coupling hardly matters.
    """
    stage = read_parameters(parameters)

    from carrierflex.reduction.coupling_bracket import coupling_bracket
    from carrierflex.workflows.fe.bodies import built_carrier
    from carrierflex.workflows.fe.carrier_variants import default_gear_notes
    from carrierflex.workflows.geometry.carrier_files import (
        CarrierFiles,
        mesh_warnings,
        meshes_of_variants,
    )

    meshes = meshes_of_variants(flexible_mesh, stiff_mesh)
    files = CarrierFiles(step, surfaces, meshes, length_unit)
    record = files.record()
    edge = files.element_size(size)
    prepared_folder(out)
    stages = Stages(2, quiet)
    brackets = {}
    warnings: list[str] = []
    for variant in ("flexible", "stiff"):
        with stages.stage(f"{variant} carrier with both couplings"):
            built = built_carrier(variant, stage, edge, files)
            if files.given:
                warnings += mesh_warnings(built.mesh)
                warnings += default_gear_notes(built.gear)
            curve_name = "delta_f" if variant == "flexible" else "delta_s"
            brackets[variant] = coupling_bracket(
                curve_name, built.mesh, built.structure, built.cases["both"]
            )
    # One line for both variants where they warn alike.
    for text in dict.fromkeys(warnings):
        stages.tell(text)
    changes = {
        bracket.curve_name: {rigid: bracket.curve_change(rigid) for rigid in bracket.all_curves}
        for bracket in brackets.values()
    }
    content = {
        "size": edge, "curve_change": changes, "brackets": brackets, "files": record,
        "versions": versions(),
    }  # fmt: skip
    save_json(out / "couplings.json", content)
    return brackets


class CouplingsDocument(TypedDict):
    """couplings.json, written by couplings."""

    size: Annotated[float, "Element edge length [m]"]
    curve_change: Annotated[
        Mapping[str, Mapping[str, float]], "RMS change of the curve by what is rigid, by curve"
    ]
    brackets: Annotated[
        Mapping[str, Mapping[str, Any]], "Stiffness of pilots and curves by variant"
    ]
    files: Annotated[Mapping[str, GivenFile], "Files by role; empty without any"]
    versions: Versions
