"""The plain path through scikit-fem and the compiled one: same matrices, same displacement."""

import numpy as np
import pytest
import skfem
from numpy.testing import assert_allclose
from skfem.models.elasticity import lame_parameters, linear_elasticity

from carrierflex.fe.assembly import assemble_stiffness_and_mass
from carrierflex.fe.materials import BODY_MATERIALS, CAST_IRON
from carrierflex.fe.scikit_fem_path import (
    displacement_by_scikit_fem,
    mass_form,
    stiffness_and_mass_by_scikit_fem,
    stiffness_form,
)
from carrierflex.fe.static import clamped_displacement
from tests.fe.box_meshes import round_bar


@pytest.mark.parametrize("mesh", ["stiff_half", "bar"])
def test_compiled_matrices_equal_scikit_fems_on_curved_elements(mesh, request):
    mesh = round_bar(0.05, 0.1, 1) if mesh == "bar" else request.getfixturevalue(mesh)
    ours = assemble_stiffness_and_mass(mesh, BODY_MATERIALS)
    reference = stiffness_and_mass_by_scikit_fem(mesh, BODY_MATERIALS)
    for matrix, expected in zip(ours, reference, strict=True):
        # Rounding of another order of summation.
        assert abs(matrix - expected).max() < 1e-12 * abs(expected).max()


def test_our_weak_forms_are_scikit_fems_model_of_elasticity_and_the_mass_of_the_volume():
    mesh = round_bar(0.05, 0.1, 1)
    quadratic = skfem.MeshTet2(
        np.ascontiguousarray(mesh.points.T), np.ascontiguousarray(mesh.tets.T)
    )
    basis = skfem.Basis(quadratic, skfem.ElementVector(skfem.ElementTetP2()), intorder=4)
    K = stiffness_form(*CAST_IRON.lame).assemble(basis)
    model = linear_elasticity(*lame_parameters(CAST_IRON.E, CAST_IRON.nu)).assemble(basis)
    assert abs(K - model).max() < 1e-12 * abs(model).max()
    along_z = np.zeros(basis.N)
    along_z[basis.nodal_dofs[2]] = 1.0
    along_z[basis.edge_dofs[2]] = 1.0
    M = mass_form(CAST_IRON.rho).assemble(basis)
    volume = skfem.Functional(lambda w: 1.0 + 0.0 * w.x[0]).assemble(basis)
    assert_allclose(along_z @ (M @ along_z), CAST_IRON.rho * volume, rtol=1e-12)


def test_scikit_fems_solution_is_that_of_the_compiled_path(pin_structure, one_pin_mesh):
    clamp = one_pin_mesh.surface("pin_1_upwind")
    load = pin_structure.load_vector({"pin_1_downwind": np.array([1e3, 2e3, 0.0, 0.0, 10.0, 0.0])})
    loads = np.stack([load, -2.0 * load], axis=1)
    ours = clamped_displacement(pin_structure, clamp, loads)
    theirs = clamped_displacement(pin_structure, clamp, loads, solver=displacement_by_scikit_fem)
    assert np.abs(ours.u).max() > 0.0
    # Two factorisations of a matrix of condition 1e7.
    assert_allclose(theirs.u, ours.u, rtol=0.0, atol=1e-8 * np.abs(ours.u).max())
    assert_allclose(theirs.reaction, ours.reaction, rtol=0.0, atol=1e-8 * np.abs(load).max())
