"""CalculiX on the same quadratic tetrahedra.

The stiffness matrix entry by entry, and the rim's curve under torque.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.assembly import assemble_mass, assemble_stiffness
from carrierflex.fe.carrier_curves import flexible_cases, stiff_cases
from carrierflex.fe.materials import BODY_MATERIALS
from carrierflex.fe.rigid_couplings import rigidly_coupled
from carrierflex.reduction.held_structure import GroundedBody, HeldStructure
from tests.fe.box_meshes import round_bar
from tests.independent_codes.calculix import (
    needs_calculix,
    printed_displacement,
    run_calculix,
    stored_matrix,
)

pytestmark = needs_calculix

STORE_MATRICES = ["*STEP", "*FREQUENCY, SOLVER=MATRIXSTORAGE", "1", "*END STEP"]


def curved_bar(request):
    return round_bar(0.05, 0.1, 2)


def pin(request):
    return request.getfixturevalue("one_pin_mesh")


@pytest.mark.parametrize("body", [curved_bar, pin])
def test_the_stiffness_matrix_is_calculixs(body, request, tmp_path):
    mesh = body(request)
    run_calculix(tmp_path, mesh, BODY_MATERIALS, STORE_MATRICES)
    theirs = stored_matrix(tmp_path, "sti", len(mesh.points))
    ours = assemble_stiffness(mesh, BODY_MATERIALS)
    # The file has 14 digits.
    assert np.abs((ours - theirs).data).max() < 1e-12 * np.abs(ours.data).max()


def test_the_mass_matrix_weighs_the_same_but_is_integrated_otherwise(tmp_path):
    # CalculiX takes four points for the mass of a C3D10 (exact to degree 2), we take enough for
    # products of shapes.
    mesh = round_bar(0.05, 0.1, 2)
    run_calculix(tmp_path, mesh, BODY_MATERIALS, STORE_MATRICES)
    theirs = stored_matrix(tmp_path, "mas", len(mesh.points))
    ours = assemble_mass(mesh, BODY_MATERIALS)
    assert_allclose(ours.sum(), theirs.sum(), rtol=1e-12)
    assert 0.1 < np.abs((ours - theirs).data).max() / np.abs(ours.data).max() < 0.5


def rigid_bodies(pilots, n_nodes):
    """Reference and rotation node of every pilot, and the lines that tie its surface to them."""
    references = {pilot.name: n_nodes + 2 * i + 1 for i, pilot in enumerate(pilots)}
    lines = ["*NODE"]
    for pilot in pilots:
        coordinates = ",".join(f"{x:.12f}" for x in pilot.point)
        lines += [
            f"{references[pilot.name]},{coordinates}",
            f"{references[pilot.name] + 1},{coordinates}",
        ]
    for name, reference in references.items():
        lines.append(f"*RIGID BODY, NSET={name}, REF NODE={reference}, ROT NODE={reference + 1}")
    return references, lines


def concentrated_loads(load, references):
    lines = ["*CLOAD"]
    for name, components in load.items():
        for i, value in enumerate(components):
            lines.append(f"{references[name] + i // 3},{i % 3 + 1},{value:.12e}")
    return lines


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("variant", ["flexible", "stiff"])
def test_the_torque_curve_with_rigid_couplings_is_calculixs(
    variant, request, tmp_path, carrier, gear
):
    mesh = request.getfixturevalue(f"{variant}_mesh")
    structure = request.getfixturevalue(f"{variant}_structure")
    cases = flexible_cases(carrier, gear) if variant == "flexible" else stiff_cases(gear, 3)
    load = cases["both"]

    references, ties = rigid_bodies(structure.pilots[1:], len(mesh.points))
    assert structure.pilots[0].name == "shaft_face"
    step = [
        "*STEP",
        "*STATIC",
        "*BOUNDARY",
        "shaft_face,1,3",
        *concentrated_loads(load, references),
    ]
    step += ["*NODE PRINT, NSET=rim_face", "U", "*END STEP"]
    run_calculix(tmp_path, mesh, BODY_MATERIALS, [*ties, *step])
    theirs = structure.sensors.rows @ printed_displacement(tmp_path, len(mesh.points)).ravel()

    rigid = rigidly_coupled(structure, mesh)
    constrained = HeldStructure(
        GroundedBody(rigid.K, rigid.points, rigid.rigid_points), rigid.pilots[:1]
    )
    u = constrained.solve(rigid.load_vector(load)[:, None], np.zeros((6, 1)))[0]
    ours = (rigid.sensors.rows @ u)[:, 0]
    for kind in (slice(0, 360), slice(360, 720)):
        # 0.1 % is wanted; the printed table has seven digits, 3e-6 is measured.
        assert np.abs(ours[kind] - theirs[kind]).max() < 1e-5 * np.abs(theirs[kind]).max()
    # Not a comparison of zeros: about 0.1 um for 1 kN m.
    assert np.abs(theirs[:360]).max() > 1e-8
