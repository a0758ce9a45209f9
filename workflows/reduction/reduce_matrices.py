"""How a body gets in whose stiffness and mass another finite element program made.

A good answer: the certificate is met, and the body of the same model by another format is the same.
"""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from carrierflex.files.versions import provenance
from carrierflex.reduction.body_files import read_body
from carrierflex.reduction.craig_bampton import freedom_record
from carrierflex.reduction.mechanisms import sound_grounding
from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.workflows.reduction.certified_body import (
    REDUCTION_WEIGHTS,
    write_certified_body,
)
from carrierflex.workflows.support.cached_results import cached_files
from carrierflex.workflows.support.matrix_inputs import MatrixFiles
from carrierflex.workflows.support.progress import Stages

#: Options that belong to meshes of this program, with the value that says nothing.
MESH_OPTIONS: Mapping[str, object] = {
    "body": None,
    "variant": "flexible",
    "coupling": "rbe3",
    "parameters": None,
    "step": None,
    "surfaces": None,
    "mesh": None,
    "assembly": "compiled",
    "by_symmetry": False,
    "shapes": False,
    "preview": False,
}
_CHOICES = ("interface", "residual_vectors")
_NUMBERS = ("up_to", "modes", "max_frequency", "frf_tolerance", "frf_up_to")


def refuse_mesh_options(options: Mapping[str, Any]) -> None:
    """Refuse options that say how a mesh is made, beside matrices that are given.

    Raises
    ------
    ValueError
        Naming the first of them.
    """
    given = [name for name, nothing in MESH_OPTIONS.items() if options[name] != nothing]
    if given:
        raise ValueError(
            f"--{given[0].replace('_', '-')} is given beside --stiffness; expected matrices or a "
            "mesh: pilots and couplings of matrices stand in --interfaces"
        )


def main(
    files: MatrixFiles, options: Mapping[str, Any], out: Path, *, cache: bool, quiet: bool
) -> ReducedModel:
    """Reduce the body of matrix files, certify it and write it.

    Parameters
    ----------
    files
        Stiffness, mass and interfaces.
    options
        How many modes are kept, and which.
    out
        Body file to write.
    cache
        Take a body that was reduced from the same inputs before, and keep a new one.
    quiet
        Show no progress.

    Returns
    -------
    ReducedModel
        The body as written.
    """
    chosen = {name: options[name] for name in (*_CHOICES, *_NUMBERS)}
    inputs = {"kind": "reduced matrices", "files": files.digests(), **chosen}
    compute = partial(_reduce, files, options, out, quiet=quiet)
    cached_files({"body.h5": out}, compute, use=cache, quiet=quiet, inputs=inputs)
    return read_body(out)


def _reduce(files: MatrixFiles, options: Mapping[str, Any], out: Path, *, quiet: bool) -> None:
    stages = Stages(4, quiet, REDUCTION_WEIGHTS, timed_from=1)
    with stages.stage(f"matrices of {files.stiffness}"):
        body = files.body()
        grounded = sound_grounding(body)
    for warning in body.warnings:
        stages.tell(f"{body.structure.name}: {warning}")

    def record(n_modes: int) -> dict[str, str]:
        """Inputs that make the body again."""
        choices = {name: options[name] for name in _CHOICES} | {"modes": n_modes}
        if options["modes"] not in (None, n_modes):
            choices["modes_asked_for"] = options["modes"]
        return provenance(**{**files.inputs(body), **choices}) | freedom_record(body.structure)

    write_certified_body(body.structure, grounded, options, out, stages=stages, record=record)
