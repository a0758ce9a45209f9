"""Reduction, certificate and body file of a structural model, by what the options ask for."""

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from carrierflex.fe.materials import BODY_MATERIALS, Material
from carrierflex.fe.structural_model import StructuralModel
from carrierflex.geometry.given_meshes.named_solids import GivenMesh
from carrierflex.geometry.tet_mesh import TetMesh
from carrierflex.reduction.body_files import read_body, write_body
from carrierflex.reduction.certificate import Certificate, certify, certify_free_interface
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.free_interface import free_interface_reduction
from carrierflex.reduction.held_structure import Grounded
from carrierflex.reduction.mode_count import chosen_modes, response_of_body, wanted_frequency
from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.reduction.residual_vectors import body_loads
from carrierflex.reduction.shapes.body_shapes import body_shapes
from carrierflex.reduction.shapes.body_stresses import body_stresses
from carrierflex.workflows.cached_results import cached_files
from carrierflex.workflows.progress import Stages

#: Time of finite elements, reduction, certificate and file of the default carrier, measured.
REDUCTION_WEIGHTS = (0.1, 1.0, 1.2, 0.01)


def cached_body(
    out: Path,
    compute: Callable[[], object],
    *,
    use: bool,
    quiet: bool,
    inputs: Mapping[str, object],
) -> ReducedModel:
    """Body from the cache, with the notes that were told when it was computed, or computed now.

    Parameters are those of :func:`carrierflex.workflows.cached_results.cached_files`.
    """
    taken = cached_files({"body.h5": out}, compute, use=use, quiet=quiet, inputs=inputs)
    model = read_body(out)
    for text in json.loads(model.provenance.get("warnings", "[]")) if taken else ():
        Stages(1, quiet).tell(f"{model.name}: {text}")
    return model


def write_certified_body(
    structure: StructuralModel,
    grounded: Grounded,
    options: Mapping[str, Any],
    out: Path,
    *,
    stages: Stages,
    record: Callable[[int], dict[str, str]],
    mesh: GivenMesh | None = None,
    materials: Mapping[str, Material] = BODY_MATERIALS,
) -> None:
    """Reduce a body, certify it and write it.

    Parameters
    ----------
    structure : StructuralModel
        The body.
    grounded : Grounded
        The same, to be factorised once.
    options : mapping
        ``interface`` and ``residual_vectors``, and those that say how many modes are kept.
    out : Path
        File to write.
    stages : Stages
        Progress, three stages.
    record : callable
        Provenance of a body with a number of modes.
    mesh : TetMesh or NamedSolids, optional
        Mesh of the body; needed where the options ask for ``shapes`` or ``stresses`` on it.
    materials : mapping
        Its materials, by which the file keeps the stress on its boundary.

    Raises
    ------
    ValueError, SingularMatrixError, AccuracyError
        From the reduction; ValueError before it where stresses are asked for and the mesh has
        other elements than tetrahedra.
    """
    if options["stresses"] and not isinstance(mesh, TetMesh):
        raise ValueError(
            "--stresses is given, the mesh has other elements than quadratic tetrahedra; expected "
            "a mesh of tetrahedra: mesh the body anew, or leave the option out"
        )
    certificate: Callable[[], Certificate]
    with stages.stage(f"reduction of {structure.n_dofs} degrees of freedom"):
        rule = chosen_modes(response_of_body(structure, grounded), options)
        cut_off_hz = wanted_frequency(options)
        if options["interface"] == "free":
            free = free_interface_reduction(structure, rule, body=grounded)
            model = replace(free.model, provenance=record(len(free.modes.omega)))
            free = replace(free, model=model)
            basis = free.basis
            certificate = partial(certify_free_interface, structure, free, cut_off_hz=cut_off_hz)
        else:
            loads = body_loads(structure) if options["residual_vectors"] else None
            fixed = craig_bampton(structure, rule, residual_loads=loads, body=grounded)
            model = replace(fixed.model, provenance=record(len(fixed.modes.omega)))
            fixed = replace(fixed, model=model)
            basis = fixed.basis
            certificate = partial(
                certify, structure, fixed, cut_off_hz=cut_off_hz, note=stages.note
            )
    with stages.stage("certificate"):
        checks = certificate()
    with stages.stage(f"writing {out}"):
        shapes = stresses = None
        if mesh is not None and options["shapes"]:
            shapes = body_shapes(mesh, structure.nodal_displacement(basis))
        if isinstance(mesh, TetMesh) and options["stresses"]:
            stresses = body_stresses(mesh, structure.nodal_displacement(basis), materials)
        write_body(model, out, checks, shapes, stresses)
