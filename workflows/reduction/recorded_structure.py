"""The finite elements of a body file.

They are made again from the inputs recorded with it, and compared with the body.
"""

import json
from pathlib import Path

import numpy as np

from carrierflex.fe.structural_model import (
    StructuralModel,
)
from carrierflex.files.shown_values import shortened
from carrierflex.geometry.main_shaft_parameters import MainShaftParameters
from carrierflex.geometry.parameter_files import StageParameters
from carrierflex.geometry.parameters import CarrierParameters, GearData, PinParameters
from carrierflex.geometry.tet_mesh import TetMesh
from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.workflows.fe.bodies import body_structure, given_structure
from carrierflex.workflows.geometry.carrier_files import CarrierFiles, located
from carrierflex.workflows.reduction.reduce_matrices import MatrixFiles

#: A body made again is the same where its pilots' stiffness and mass differ by less than this,
#: relatively.
_SAME_BODY = 1e-6
#: Choices with which a body is made again.
_USUAL = {"coupling": "rbe3", "interface": "fixed"}
_RECORDED = ("parameters", "size", "modes")


def recorded_structure(
    model: ReducedModel, body_folder: Path = Path()
) -> tuple[TetMesh | None, StructuralModel, int]:
    """Mesh, structure and number of fixed-interface modes of a body that carrierflex reduce wrote.

    A body of another program's matrices, or of other solids than tetrahedra, has none to draw.
    Files that are no longer at their place are looked up in `body_folder`, the body file's folder.

    Raises
    ------
    FileNotFoundError, ValueError
        Where the inputs are not recorded, couplings or basis were not the usual ones, or the
        carrier's files are gone or changed.
    """
    if "matrix_files" in model.provenance:
        return (None, *_of_matrices(model, body_folder))
    missing = [key for key in _RECORDED if key not in model.provenance]
    choices = [
        json.loads(model.provenance.get(name, f'"{usual}"')) for name, usual in _USUAL.items()
    ]
    if missing or choices != list(_USUAL.values()):
        other = ", ".join(
            f"--{name} {choice}" for name, choice in zip(_USUAL, choices, strict=True)
        )
        what = f"does not record {', '.join(missing)}" if missing else f"was reduced with {other}"
        raise ValueError(
            f"{model.name}: the body file {what}; expected one of carrierflex reduce --coupling "
            "rbe3 --interface fixed: "
            "Exudyn needs the finite elements, which are made again from its inputs"
        )
    stage, size, n_modes = recorded_inputs(model)
    if "carrier_files" in model.provenance:
        variant = model.name.removesuffix("_carrier")
        files = CarrierFiles.recorded(
            located(json.loads(model.provenance["carrier_files"]), body_folder)
        )
        mesh = files.mesh(variant, size)
        structure, _ = given_structure(variant, mesh, files.materials())
        return mesh if isinstance(mesh, TetMesh) else None, structure, n_modes
    mesh, structure = body_structure(model.name, stage, size)
    return mesh, structure, n_modes


def _of_matrices(model: ReducedModel, body_folder: Path) -> tuple[StructuralModel, int]:
    """Structure and number of modes of a body of matrix files, read again."""
    choices = {"interface": '"fixed"', "residual_vectors": "false"}
    other = [name for name, usual in choices.items() if model.provenance.get(name) != usual]
    if other:
        raise ValueError(
            f"{model.name}: the body was reduced with --{other[0].replace('_', '-')}; expected "
            "--interface fixed and no residual vectors: Exudyn needs the basis, which is made again"
        )
    try:
        record = located(json.loads(model.provenance["matrix_files"]), body_folder)
        files, n_modes = MatrixFiles.recorded(record), int(model.provenance["modes"])
    except (TypeError, KeyError, AttributeError, RecursionError) as error:
        raise ValueError(
            f"{model.name}: the inputs recorded in the body file cannot be read; expected those "
            "that carrierflex reduce wrote"
        ) from error
    return files.body().structure, n_modes


def recorded_inputs(model: ReducedModel) -> tuple[StageParameters, float, int]:
    """Parameters, element size [m] and number of modes that a body was made with."""
    try:
        inputs = {key: json.loads(model.provenance[key]) for key in _RECORDED}
        tables = inputs["parameters"]
        stage = StageParameters(
            CarrierParameters(**tables["carrier"]),
            PinParameters(**tables["pin"]),
            GearData(**tables["gear"]),
            # Absent from files written before there was a main shaft; no other body depends on it.
            MainShaftParameters(**tables.get("main_shaft", {})),
        )
        return stage, float(inputs["size"]), int(inputs["modes"])
    except (TypeError, KeyError, ValueError, AttributeError, RecursionError) as error:
        reason = shortened(" ".join(str(error).split()))
        raise ValueError(
            f"{model.name}: the inputs recorded in the body file cannot be read ({reason}); "
            "expected those that carrierflex reduce wrote"
        ) from error


def differences_from(model: ReducedModel, again: ReducedModel) -> dict[str, float]:
    """Relative difference of pilots' stiffness and mass between a body file and a rebuilt body.

    Raises
    ------
    ValueError
        Where it is not the same body.
    """
    if again.labels != model.labels:
        raise ValueError(
            f"{model.name}: the body made again has other coordinates; expected this program's own "
            "body file"
        )
    rows = np.ix_(*2 * (np.arange(6 * len(model.pilots)),))
    differences = {}
    for letter, actual, expected in (
        ("K", again.K[rows], model.K[rows]),
        ("M", again.M[rows], model.M[rows]),
    ):
        scale = np.sqrt(np.outer(expected.diagonal(), expected.diagonal()))
        differences[letter] = float(np.abs((actual - expected) / scale).max())
    if max(differences.values()) > _SAME_BODY:
        raise ValueError(
            f"{model.name}: the body made again differs from the file by "
            f"{max(differences.values()):.1e}; expected less "
            f"than {_SAME_BODY:.0e}: reduce it again with this version"
        )
    return differences
