"""How does the rim deflect under drive torque? Two peaks a planet with bonded pins, one without."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypedDict

from carrierflex.fe.curve_files import read_curves, write_curves
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.fe.mesh_limits import MeshError
from carrierflex.fe.view import curves_figure
from carrierflex.files.json_files import plain, read_json, save_json
from carrierflex.files.versions import Versions, versions
from carrierflex.geometry.parameter_files import Dimensions, StageParameters, read_parameters
from carrierflex.workflows.cached_results import cached_files
from carrierflex.workflows.fe.default_curves import MESH_ERROR_FILE
from carrierflex.workflows.outputs import prepared_folder, save_figure
from carrierflex.workflows.progress import Stages

if TYPE_CHECKING:
    from carrierflex.geometry.parameters import GearData
    from carrierflex.workflows.fe.carrier_variants import SolvedCarrier
    from carrierflex.workflows.fe.cost_preview import CostPreview
    from carrierflex.workflows.geometry.carrier_files import CarrierFiles

_CURVES = "deflection_curves.csv"
_PICTURE = "deflection_curves.png"
_INPUTS = "inputs.json"


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
    assembly: Literal["compiled", "scikit-fem"] = "compiled",
    mesh_error: bool = False,
    derivatives: bool = False,
    preview: bool = False,
    cache: bool = True,
    quiet: bool = False,
) -> dict[str, DeflectionCurve] | CostPreview:
    """Compute the rim's deflection curves by finite elements.

    Writes deflection_curves.csv (theta_deg; delta_s, delta_f in m per kN m of drive torque; g_s,
    g_f in m per N on pin 1; the radial ones beside them), deflection_curves.png and inputs.json.

    Parameters
    ----------
    out
        Folder to write: deflection_curves.csv, its picture, inputs.json.
    size
        Element edge length [m]; default: 0.03; of a STEP file 0.66 of the solid's mean wall (twice
        its volume over its surface), less where webs are thin.
    parameters
        TOML file with the tables [carrier], [pin], [gear], dimensions in metres; a missing key has
        its default. four_planets: a bundled set.
    step
        STEP file with the carrier without pins, instead of the parametric carrier; any length unit.
    surfaces
        TOML file that states the surfaces of the STEP or mesh files; carrierflex cad writes one to
        start from. A mesh whose groups have the surfaces' names needs none.
    flexible_mesh
        Mesh file (.msh, .inp, .bdf, .unv, .med; tetrahedra, hexahedra, wedges) of the carrier
        without pins, instead of the parametric carrier.
    stiff_mesh
        Mesh file of the same kinds of the carrier with bonded pins.
    length_unit
        Unit of the mesh files' coordinates.
    assembly
        compiled: element loops compiled, a sparse factorisation library solves; scikit-fem: its
        forms and scipy's solver do both, the same numbers some fifty times slower.
    mesh_error
        Also compute the curves with elements 0.8 and 1.25 times as large, and write the distance of
        each order from its limit at vanishing element size (mesh_error.json); parametric carrier
        only.
    derivatives
        Also write what a rigid pin fit adds to delta_f, and the derivatives of both by every
        dimension, or named surface of a file along its normal [m per kN m and m], and material
        constant, which a campaign with [rig.tolerances] needs.
    preview
        Only show what the work will cost.
    cache
        Reuse stored curves of the same inputs, and store new ones.
    quiet
        Show no progress.

    Returns
    -------
    dict
        The four curves by name. A good answer has two peaks a planet in delta_s, one in delta_f,
        and orders N, 2 N, 3 N ... of N planets only.
    """
    stage = read_parameters(parameters)

    from carrierflex.workflows.fe.cost_preview import curves_cost, tell
    from carrierflex.workflows.geometry.carrier_files import CarrierFiles, meshes_of_variants

    meshes = meshes_of_variants(flexible_mesh, stiff_mesh)
    files = CarrierFiles(step, surfaces, meshes, length_unit)
    edge = files.element_size(size)
    inputs = {
        "kind": "deflection curves", "stage": stage, "size": edge, "files": files.digests(),
        "assembly": assembly, "mesh_error": mesh_error, "derivatives": derivatives,
    }  # fmt: skip
    if mesh_error and files.given:
        raise ValueError(
            "--mesh-error is given with a STEP or mesh file; expected the parametric carrier: run "
            "curves with several --size (or meshes) and compare them"
        )
    if preview:
        return curves_cost(stage, edge, files)
    prepared_folder(out)

    def compute() -> None:
        tell(lambda: curves_cost(stage, edge, files), quiet=quiet)
        _compute(out, stage, edge, files, assembly, quiet=quiet)
        if derivatives:
            _add_derivatives(out / _CURVES, stage, edge, files, quiet=quiet)
        if mesh_error:
            _write_mesh_error(out / MESH_ERROR_FILE, stage, edge, quiet=quiet)

    names = (_CURVES, _PICTURE, _INPUTS, *((MESH_ERROR_FILE,) if mesh_error else ()))
    results = {name: out / name for name in names}
    cached_files(results, compute, use=cache, quiet=quiet, inputs=inputs)
    radius = float(read_json(out / _INPUTS, "the inputs of the curves")["sensor_radius"])
    return read_curves(out / _CURVES, radius=radius)


def _add_derivatives(
    path: Path, stage: StageParameters, size: float, files: CarrierFiles, *, quiet: bool
) -> None:
    """Add the derivatives of a drawing to its file of curves."""
    from carrierflex.geometry.carrier_mesh import flexible_half_sector
    from carrierflex.geometry.tet_mesh import TetMesh
    from carrierflex.reduction.drawing_derivatives import drawn_curves, given_drawn_curves

    stages = Stages(1, quiet)
    with stages.stage("derivatives"):
        if files.given:
            mesh = files.mesh("flexible", size)
            if not isinstance(mesh, TetMesh):
                raise ValueError(
                    "the flexible carrier's mesh has hexahedra or wedges; expected tetrahedra "
                    "alone for --derivatives"
                )
            materials = files.materials()
            drawn = given_drawn_curves(mesh, stage, size, materials=materials, note=stages.note)
        else:
            half = flexible_half_sector(stage.carrier, size)
            drawn = drawn_curves(half, stage, size, note=stages.note)
    write_curves(path, {**read_curves(path), **drawn})


def _compute(
    out: Path,
    stage: StageParameters,
    size: float,
    files: CarrierFiles,
    assembly: str,
    *,
    quiet: bool,
) -> None:
    from carrierflex.fe.carrier_curves import named_curves
    from carrierflex.workflows.fe.carrier_variants import (
        FINITE_ELEMENTS,
        default_gear_notes,
        solved_carrier,
    )
    from carrierflex.workflows.geometry.carrier_files import mesh_warnings

    stages = Stages(3, quiet)
    finite_elements = FINITE_ELEMENTS[assembly]
    with stages.stage(f"flexible carrier, elements of {size:.4g} m"):
        flexible = solved_carrier("flexible", stage, size, files, finite_elements)
    with stages.stage(f"stiff carrier, elements of {size:.4g} m"):
        stiff = solved_carrier("stiff", stage, size, files, finite_elements)
    _refuse_different_carriers(flexible, stiff)
    # One line for both variants where they warn alike.
    notes = [*mesh_warnings(flexible.mesh), *mesh_warnings(stiff.mesh)]
    gear = flexible.gear
    if files.given:
        notes += default_gear_notes(gear)
    for text in dict.fromkeys(notes):
        stages.tell(text)
    with stages.stage("files"):
        curves = named_curves(stiff.deflection, flexible.deflection)
        write_curves(out / _CURVES, curves)
        n_planets = flexible.n_planets
        save_figure(out / _PICTURE, curves_figure(curves["delta_s"], curves["delta_f"], n_planets))
        radius = curves["delta_s"].radius
        content = {
            "size": size,
            # Of a given carrier the other dimensions are not known.
            "stage": {"gear": _gear_of_the_loads(gear)} if files.given else plain(stage),
            "files": files.record(),
            "assembly": assembly,
            "sensor_radius": radius,
        }
        save_json(out / _INPUTS, {**content, "versions": versions()})


def _write_mesh_error(path: Path, stage: StageParameters, size: float, *, quiet: bool) -> None:
    from carrierflex.fe.mesh_limits import mesh_errors

    stages = Stages(1, quiet)
    with stages.stage("error of the mesh, by two more of them"):
        errors = mesh_errors(stage, size, note=stages.note)
    largest: dict[str, MeshError] = {}
    for one in errors:
        largest[one.curve] = max(one, largest.get(one.curve, one), key=lambda error: error.share)
    for one in largest.values():
        stages.tell(
            f"{one.curve}: order {one.order} is {100.0 * (one.amplitude / one.limit - 1.0):+.1f} % "
            "off its limit at elements of no size (standard error "
            f"{100.0 * one.standard_error / one.limit:.1f} %)"
        )
    save_json(path, {"size": size, "errors": errors, "versions": versions()})


def _gear_of_the_loads(gear: GearData) -> dict[str, float]:
    """What of the gear sets the forces on the pins."""
    names = ("pressure_angle", "helix_angle", "centre_distance", "sun_teeth", "planet_teeth")
    return {name: getattr(gear, name) for name in names}


def _refuse_different_carriers(flexible: SolvedCarrier, stiff: SolvedCarrier) -> None:
    radii = [variant.deflection.curves["both"].radius for variant in (flexible, stiff)]
    if abs(radii[0] - radii[1]) > 1e-6:
        raise ValueError(
            f"the flexible carrier's sensor circle has radius {radii[0]:.6g} m, the stiff one's "
            f"{radii[1]:.6g} m; expected two "
            "variants of one carrier"
        )
    if flexible.n_planets != stiff.n_planets:
        raise ValueError(
            f"the flexible carrier has {flexible.n_planets} pins, the stiff one "
            f"{stiff.n_planets}; expected two variants of one carrier"
        )


class GivenFile(TypedDict):
    """A file that a result was made from."""

    file: Annotated[str, "Its path"]
    sha256: Annotated[str, "Its digest"]


class CurveInputsDocument(TypedDict):
    """inputs.json, written by curves."""

    size: Annotated[float, "Element edge length [m]"]
    stage: Dimensions
    files: Annotated[Mapping[str, GivenFile], "Files by role; empty without any"]
    assembly: Annotated[str, "What assembled and solved"]
    sensor_radius: Annotated[float, "Radius of the sensors' circle [m]"]
    versions: Versions


class MeshErrorDocument(TypedDict):
    """mesh_error.json, written by curves."""

    size: Annotated[float, "Element edge length of the curves [m]"]
    errors: Annotated[Sequence[MeshError], "One a curve and order"]
    versions: Versions
