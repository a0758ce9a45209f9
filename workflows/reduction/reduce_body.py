"""Which few coordinates stand for the elastic body.

Writes a Craig-Bampton body for a multibody simulation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from carrierflex.files.versions import provenance
from carrierflex.files.whole_files import refuse_foreign
from carrierflex.geometry.parameter_files import StageParameters, read_parameters
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages

if TYPE_CHECKING:
    from carrierflex.fe.assembly import Assembly
    from carrierflex.fe.structural_model import StructuralModel
    from carrierflex.geometry.given_meshes.named_solids import GivenMesh
    from carrierflex.reduction.reduced_model import ReducedModel
    from carrierflex.workflows.fe.cost_preview import CostPreview
    from carrierflex.workflows.geometry.carrier_files import CarrierFiles


def main(
    *,
    out: Path,
    body: Literal["carrier", "pin", "main_shaft"] | None = None,
    stiffness: Path | None = None,
    mass: Path | None = None,
    interfaces: Path | None = None,
    variant: Literal["stiff", "flexible"] = "flexible",
    coupling: Literal["rbe3", "rbe3-nodes", "rbe2"] = "rbe3",
    interface: Literal["fixed", "free"] = "fixed",
    up_to: float | None = None,
    modes: int | None = None,
    modes_below: float | None = None,
    frf_tolerance: float | None = None,
    residual_vectors: bool = False,
    size: float | None = None,
    parameters: Path | None = None,
    step: Path | None = None,
    surfaces: Path | None = None,
    mesh: Path | None = None,
    length_unit: Literal["m", "mm", "inch"] = "m",
    assembly: Literal["compiled", "scikit-fem"] = "compiled",
    symmetry: bool = True,
    shapes: bool = False,
    stresses: bool = False,
    preview: bool = False,
    cache: bool = True,
    quiet: bool = False,
) -> ReducedModel | CostPreview:
    """Reduce a body to its pilot nodes and fixed-interface modes (Craig-Bampton).

    The body comes with a certificate.

    Parameters
    ----------
    out
        File to write (.h5): matrices, labels, pilots, sensors.

        K, M, D, labels of every coordinate, pilots, sensor rows, mass properties, provenance; SI
        units.
    body
        The body to reduce, in the carrier's frame.

        carrier: the planet carrier; pin: planet pin 1; main_shaft: the main shaft. Required unless
        matrices are given.
    stiffness
        Stiffness matrix of another program, instead of --body.

        Nastran .op4 or DMIG .pch, Abaqus .mtx, CalculiX .sti, Harwell-Boeing .rsa .hb .matrix,
        MatrixMarket .mtx .mm, scipy .npz, Ansys .full (docs/matrices.md).
    mass
        Mass matrix beside it; may be the same file.
    interfaces
        TOML file: units, nodes, pilots of the matrices.

        It also states the sensors. Beside --mesh: with the materials, pilots and sensors of any
        solids (tetrahedra, hexahedra, wedges).
    variant
        Carrier: pins bonded, or no pins.

        stiff: pins bonded, pilots at the pins' mid-spans; flexible: no pins, pilots at the six
        bores.
    coupling
        Of the pilots to their surfaces.

        rbe3: distributing by area, the surface can deform; rbe3-nodes: the same with equal weights
        on all nodes, as preprocessors write it; rbe2: rigid. The truth of a fitted part lies
        between rbe3 and rbe2.
    interface
        Modes: pilots held, or free (Rubin).

        fixed: modes with the pilots fixed (Craig-Bampton); free: free modes of the body and
        residual flexibility (Rubin), far closer at the same size where most pilots stay free
        (docs/reduction.md), but not read by every code.
    up_to
        Frequency [Hz] of use; default: 750.

        Keeps the fixed-interface modes below four times that, or the free modes below twice that;
        the certificate covers the same range.
    modes
        Number of modes instead.

        A group of equal frequency is complete, so 20 may become 21.
    modes_below
        Keep the modes below this frequency [Hz] instead.
    frf_tolerance
        Largest error of the frequency response instead (0.01: 1 %).

        Keeps the fewest modes whose frequency response at pilots and sensors differs from the full
        body's by at most this share up to the frequency of --up-to; 4 % structural loss in both.
    residual_vectors
        Add the static answer to weight and rotation.

        Adds what the modes lack of the static answer to weight in x, y and z and to centrifugal
        force, up to four coordinates. Loads at pilots (torque, tilting moment) are exact without
        them.
    size
        Element edge length [m]; default: 0.03, of a STEP file by the wall.

        Of a STEP file 0.66 of the solid's mean wall (twice its volume over its surface), less where
        webs are thin.
    parameters
        TOML file with dimensions [m] and materials.

        Tables [carrier], [pin], [gear], [main_shaft]; a missing key has its default.
    step
        STEP file of the carrier without pins.

        It replaces the parametric carrier; any length unit.
    surfaces
        TOML file: surfaces of the STEP or mesh file.

        carrierflex cad writes one to start from. A mesh whose groups have the surfaces' names needs
        none.
    mesh
        Mesh file: .msh, .inp, .bdf, .unv, .med.

        Tetrahedra, hexahedra or wedges of the carrier's variant, instead of the parametric carrier;
        without --body and with --interfaces any body.
    length_unit
        Of the mesh.

        The unit of other bodies is in their interfaces file.
    assembly
        Of K and M.

        compiled: element loops of this program; scikit-fem: its forms, the same matrices, about
        fifty times slower.
    symmetry
        Compute the carrier from its half sector.

        The half sector is used where coupling, interface and assembly are the defaults and there
        are no residual vectors: the same numbers and certificate in less than half the time and
        memory. --no-symmetry: from the whole mesh.
    shapes
        Keep what carrierflex view needs.

        The body's surface and every coordinate's displacement on it, 12 bytes a surface corner and
        coordinate (5 MB for the default carrier, 18 MB at 0.015 m).
    stresses
        Keep what carrierflex simulate --stress needs.

        The stress at the corner nodes of the body's surface for one unit of every coordinate, 24
        bytes a node and coordinate (10 MB for the default carrier); tetrahedra only.
    preview
        Only show what the work will cost.
    cache
        Take a body computed from the same inputs before, and store a new one.
    quiet
        Show no progress.

    Returns
    -------
    ReducedModel
        The body as written.
    """
    from carrierflex.workflows.geometry.carrier_files import CarrierFiles
    from carrierflex.workflows.reduction import reduce_matrices
    from carrierflex.workflows.reduction.reduce_matrices import MatrixFiles

    matrices = MatrixFiles.of_options(stiffness, mass, interfaces, None if body else mesh)
    files = CarrierFiles(step, surfaces, {} if mesh is None else {variant: mesh}, length_unit)
    # Every option that changes the body is part of the key under which it is kept.
    options = {
        "body": body, "variant": variant, "coupling": coupling, "interface": interface,
        "up_to": up_to, "modes": modes,
        "modes_below": modes_below, "frf_tolerance": frf_tolerance,
        "residual_vectors": residual_vectors, "assembly": assembly, "shapes": shapes,
        "symmetry": symmetry, "stresses": stresses,
    }  # fmt: skip
    _refuse_contradictions(out, options)
    refuse_foreign(out, "carrierflex-body")
    if matrices is not None:
        is_mesh = mesh is not None and stiffness is None
        given = {
            "parameters": parameters, "step": step, "surfaces": surfaces,
            "mesh": None if is_mesh else mesh,
        }  # fmt: skip
        reduce_matrices.refuse_mesh_options({**options, **given, "preview": preview})
        prepared_folder(out.parent)
        return reduce_matrices.main(matrices, options, out, cache=cache, quiet=quiet)
    stage = read_parameters(parameters)
    _refuse_other_bodies(files, options)
    edge = files.element_size(size)
    if preview:
        return _cost(stage, edge, files, options)
    prepared_folder(out.parent)
    return _kept_or_computed(out, stage, edge, files, options, cache=cache, quiet=quiet)


def _kept_or_computed(
    out: Path,
    stage: StageParameters,
    size: float,
    files: CarrierFiles,
    options: Mapping[str, Any],
    *,
    cache: bool,
    quiet: bool,
) -> ReducedModel:
    """Body from the cache where the same one was reduced before, computed otherwise."""
    from carrierflex.workflows.fe.cost_preview import tell
    from carrierflex.workflows.reduction.certified_body import cached_body

    def compute() -> None:
        tell(lambda: _cost(stage, size, files, options), quiet=quiet)
        if _by_symmetry(files, options):
            _reduce_by_symmetry(out, stage, size, options, quiet=quiet)
        else:
            _reduce(out, stage, size, files, options, quiet=quiet)

    inputs = {
        "kind": "reduced body",
        "parameters": stage,
        "size": size,
        "files": files.digests(),
        **options,
    }
    return cached_body(out, compute, use=cache, quiet=quiet, inputs=inputs)


def _cost(
    stage: StageParameters, size: float, files: CarrierFiles, options: Mapping[str, Any]
) -> CostPreview:
    from carrierflex.workflows.fe.bodies import body_name
    from carrierflex.workflows.fe.cost_preview import reduction_cost

    return reduction_cost(
        body_name(options["body"], options["variant"]),
        stage,
        size,
        n_modes=options["modes"],
        files=files,
        by_symmetry=_by_symmetry(files, options),
    )


def _by_symmetry(files: CarrierFiles, options: Mapping[str, Any]) -> bool:
    from carrierflex.workflows.reduction.half_sector_bodies import serves_half_sector

    return serves_half_sector(options, files_given=files.given)


def _refuse_other_bodies(files: CarrierFiles, options: Mapping[str, Any]) -> None:
    body = options["body"]
    if body is None:
        raise ValueError(
            "--body is missing; expected carrier, pin or main_shaft, or matrices of another "
            "program: --stiffness, --mass and --interfaces"
        )
    if files.given and body != "carrier":
        raise ValueError(
            f"--body is {body}, a STEP or mesh file is given; expected --body carrier: files hold "
            "the carrier"
        )


def _refuse_contradictions(out: Path, options: Mapping[str, Any]) -> None:
    if out.suffix != ".h5":
        raise ValueError(f"{out}: suffix {out.suffix!r}; expected .h5")
    numbers = ("up_to", "modes", "modes_below", "frf_tolerance")
    given = [name for name in numbers if options[name] is not None]
    if len(given) > 1 and given != ["up_to", "frf_tolerance"]:
        names = " and ".join(f"--{name.replace('_', '-')}" for name in given)
        raise ValueError(f"{names} are both given; expected one of them")
    if given == ["frf_tolerance"]:
        raise ValueError("--frf-tolerance is given without --up-to; expected both")
    other = "frf_tolerance" in given or options["residual_vectors"] or options["coupling"] == "rbe2"
    if options["interface"] == "free" and other:
        raise ValueError(
            "--interface free keeps modes by number or frequency at distributing couplings; "
            "expected --coupling rbe3 or rbe3-nodes, and no --frf-tolerance or --residual-vectors"
        )


def _reduce(
    out: Path,
    stage: StageParameters,
    size: float,
    files: CarrierFiles,
    options: Mapping[str, Any],
    *,
    quiet: bool,
) -> None:
    from carrierflex.fe.materials import BODY_MATERIALS
    from carrierflex.reduction.held_structure import grounded
    from carrierflex.workflows.fe.carrier_variants import FINITE_ELEMENTS
    from carrierflex.workflows.geometry.carrier_files import mesh_warnings
    from carrierflex.workflows.reduction.certified_body import (
        REDUCTION_WEIGHTS,
        write_certified_body,
    )

    stages = Stages(4, quiet, REDUCTION_WEIGHTS, timed_from=1)
    body, variant, coupling = (options[name] for name in ("body", "variant", "coupling"))
    with stages.stage(f"finite elements of {size:.4g} m"):
        assembly = FINITE_ELEMENTS[options["assembly"]].assembly
        mesh, structure = _structure(
            body, variant, stage, size, coupling=coupling, files=files, assembly=assembly
        )
    # A free mesh has no symmetry to certify.
    origin: dict[str, Any] = {}
    if files.given:
        origin = {"carrier_files": files.record(), "symmetry_order": 1}
        if warnings := mesh_warnings(mesh):
            origin["warnings"] = warnings
            for text in warnings:
                stages.tell(text)
    record = partial(_record, stage, size, options, **origin)
    write_certified_body(
        structure,
        grounded(structure),
        options,
        out,
        stages=stages,
        record=record,
        mesh=mesh,
        materials=files.materials() if files.given else BODY_MATERIALS,
    )


def _reduce_by_symmetry(
    out: Path, stage: StageParameters, size: float, options: Mapping[str, Any], *, quiet: bool
) -> None:
    from carrierflex.reduction.body_files import write_body
    from carrierflex.reduction.shapes.body_shapes import body_shapes
    from carrierflex.reduction.shapes.body_stresses import body_stresses
    from carrierflex.workflows.fe.bodies import body_mesh, body_name
    from carrierflex.workflows.reduction.certified_body import REDUCTION_WEIGHTS
    from carrierflex.workflows.reduction.half_sector_bodies import certified_half_sector

    name = body_name(options["body"], options["variant"])
    stages = Stages(4, quiet, REDUCTION_WEIGHTS, timed_from=1)
    reduction, certificate = certified_half_sector(name, stage, size, options, stages=stages)
    record = _record(stage, size, options, len(reduction.basis.omega), by_symmetry=True)
    with stages.stage(f"writing {out}"):
        shapes = stress_rows = None
        if options["shapes"] or options["stresses"]:
            mesh = body_mesh(name, stage, size)
            fields = reduction.basis.whole_body(mesh.points)
            shapes = body_shapes(mesh, fields) if options["shapes"] else None
            stress_rows = body_stresses(mesh, fields) if options["stresses"] else None
        model = replace(reduction.model, provenance=record)
        write_body(model, out, certificate, shapes, stress_rows)


def _record(
    stage: StageParameters, size: float, options: Mapping[str, Any], n_modes: int, **more: Any
) -> dict[str, str]:
    """Inputs that make the body again, its number of modes among them."""
    chosen = ("body", "variant", "coupling", "interface", "assembly")
    choices = {name: options[name] for name in chosen} | {"modes": n_modes} | more
    if options["modes"] not in (None, n_modes):
        choices["modes_asked_for"] = options["modes"]
    return provenance(parameters=stage, size=size, **choices)


def _structure(
    body: str,
    variant: str,
    stage: StageParameters,
    size: float,
    *,
    coupling: str,
    files: CarrierFiles,
    assembly: Assembly,
) -> tuple[GivenMesh, StructuralModel]:
    from carrierflex.fe.rigid_couplings import rigidly_coupled
    from carrierflex.fe.structural_model import with_equal_node_weights
    from carrierflex.workflows.fe.bodies import body_name, body_structure, given_structure

    mesh: GivenMesh
    if files.given:
        mesh = files.mesh(variant, size)
        structure, _ = given_structure(variant, mesh, files.materials(), assembly)
    else:
        mesh, structure = body_structure(body_name(body, variant), stage, size, assembly)
    if coupling == "rbe3-nodes":
        return mesh, with_equal_node_weights(structure, mesh)
    return mesh, structure if coupling == "rbe3" else rigidly_coupled(structure, mesh)
