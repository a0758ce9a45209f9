"""Inertia invariants against their definitions and direct sums over the nodes.

And against those of Exudyn on the same matrices.
"""

from dataclasses import replace

import h5py
import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose

from carrierflex.fe.assembly import assemble_mass, assemble_stiffness
from carrierflex.fe.couplings import distributing_pilot
from carrierflex.fe.materials import STEEL
from carrierflex.fe.rigid_couplings import rigidly_coupled
from carrierflex.fe.structural_model import PIN_PILOTS, StructuralModel, structural_model
from carrierflex.fe.surface_integrals import rigid_motion
from carrierflex.geometry.dihedral import rotation_about_x
from carrierflex.reduction.assembly import Joint, assembled
from carrierflex.reduction.body_files import BodyFileError, read_body, write_body
from carrierflex.reduction.craig_bampton import craig_bampton, mass_properties
from carrierflex.reduction.exports.ordered_body import held_body
from carrierflex.reduction.ffrf_data import FfrfData, ffrf_data
from carrierflex.reduction.reduced_model import turned
from carrierflex.reduction.rigid_body_checks import geometric_rigid_modes
from tests.fe.box_meshes import box_mesh
from tests.reduction.small_bar import bar

INTEGRALS = ("first_moment", "second_moment", "N", "P", "Q")


@pytest.fixture(scope="module")
def structure():
    return bar((3, 1, 1))


@pytest.fixture(scope="module")
def basis(structure):
    """Any smooth and any rough field: the identities do not ask for modes."""
    x = structure.points
    rng = np.random.default_rng(7)
    bending = np.stack([-0.3 * x[:, 2], x[:, 0] ** 2, x[:, 0] * x[:, 1] + x[:, 2]], axis=1).ravel()
    return np.column_stack([bending, 0.05 * rng.standard_normal((x.size, 3))])


@pytest.fixture(scope="module")
def data(structure, basis):
    return ffrf_data(structure, basis)


def deformed(structure, T, q):
    """The same elements' mass at moved nodes: positions interpolate as displacements do."""
    return structure.points + (T @ q).reshape(-1, 3)


def nodal_inertia(structure, x):
    R = rigid_motion(x, np.zeros(3)).reshape(-1, 6)
    return (R.T @ (structure.M @ R))[3:, 3:]


def scale(matrix):
    return 1e-12 * np.abs(matrix).max()


def test_moments_are_the_mass_properties(structure, data):
    mass = mass_properties(structure)
    assert_allclose(data.mass, mass.mass, rtol=1e-12)
    assert_allclose(data.centre, mass.centre, atol=1e-13)
    c = data.centre
    about_centre = data.J - data.mass * (c @ c * np.eye(3) - np.outer(c, c))
    assert_allclose(about_centre, mass.inertia, atol=1e-12 * mass.inertia.max())


def test_rigid_motions_as_basis_give_mass_centre_and_inertia(structure):
    data = ffrf_data(structure, structure.rigid_modes)
    crossed = np.cross(np.eye(3), data.first_moment)
    assert_allclose(data.N, np.hstack([data.mass * np.eye(3), crossed.T]), atol=1e-12 * data.mass)
    assert_allclose(data.Cr[:3], crossed.T, atol=1e-12 * data.mass)
    assert_allclose(data.Cr[3:], data.J, atol=scale(data.J))
    assert_allclose(data.Me[3:, 3:], data.J, atol=scale(data.J))


def test_inertia_follows_a_rigid_rotation_to_first_order_and_a_translation_exactly(structure):
    data = ffrf_data(structure, structure.rigid_modes)
    for axis in range(3):
        spin = np.cross(np.eye(3)[axis], np.eye(3)).T
        assert_allclose(data.J1[..., 3 + axis], spin @ data.J - data.J @ spin, atol=scale(data.J))
    q, shift = np.zeros(6), np.array([0.2, -0.4, 0.7])
    q[:3] = shift
    moved = ffrf_data(replace(structure, points=structure.points + shift), structure.rigid_modes)
    assert_allclose(data.inertia(q), moved.J, atol=scale(moved.J))
    for integral in ("first_moment", "second_moment", "P"):
        assert_allclose(
            getattr(data.about(-shift), integral), getattr(moved, integral), atol=scale(moved.J)
        )


def test_trace_of_q_is_the_reduced_mass(structure, basis, data, flexible_reduction):
    assert_allclose(data.Me, basis.T @ (structure.M @ basis), atol=scale(data.Me))
    model = flexible_reduction.model
    weight = np.sqrt(np.outer(model.M.diagonal(), model.M.diagonal()))
    assert_allclose(model.ffrf.Me / weight, model.M / weight, atol=1e-11)


def test_reduced_rigid_motions_give_the_rigid_invariants(pin_reduction):
    model = pin_reduction.model
    rigid = model.ffrf.transformed(geometric_rigid_modes(model))
    data = model.ffrf
    assert_allclose(rigid.N[:, :3], data.mass * np.eye(3), atol=1e-8 * data.mass)
    assert_allclose(rigid.Cr[3:], data.J, atol=1e-8 * np.abs(data.J).max())
    assert_allclose(rigid.block(0, 0)[4, 4], data.second_moment[2, 2], rtol=1e-8)


def test_inertia_is_that_of_the_deformed_mesh(structure, basis, data):
    q = np.array([0.3, -0.8, 0.5, 1.1])
    expected = nodal_inertia(structure, deformed(structure, basis, q))
    assert_allclose(data.inertia(q), expected, atol=scale(expected))
    step = 1e-6
    for j, unit in enumerate(np.eye(4)):
        slope = (data.inertia(step * unit) - data.inertia(-step * unit)) / (2.0 * step)
        assert_allclose(data.J1[..., j], slope, atol=1e-7 * np.abs(data.J).max())


def test_kinetic_energy_is_the_sum_over_the_nodes(structure, basis, data):
    rng = np.random.default_rng(3)
    for _ in range(5):
        q, q_dot = rng.standard_normal((2, 4))
        velocity, omega = rng.standard_normal((2, 3))
        x = deformed(structure, basis, q)
        v = velocity + np.cross(omega, x) + (basis @ q_dot).reshape(-1, 3)
        expected = 0.5 * v.ravel() @ (structure.M @ v.ravel())
        assert_allclose(data.kinetic_energy(q, q_dot, velocity, omega), expected, rtol=1e-12)


def test_gyroscopic_and_centrifugal_terms_are_those_of_nodal_accelerations(structure, basis, data):
    rng = np.random.default_rng(5)
    q, q_dot = rng.standard_normal((2, 4))
    omega = rng.standard_normal(3)
    x, x0 = deformed(structure, basis, q), structure.points

    def force(acceleration):
        return structure.M @ acceleration.ravel()

    coriolis = force(2.0 * np.cross(omega, (basis @ q_dot).reshape(-1, 3)))
    moment = rigid_motion(x0, np.zeros(3)).reshape(-1, 6)[:, 3:].T @ coriolis
    assert_allclose(np.einsum("abj,j,b->a", data.Gr, q_dot, omega), moment, atol=scale(moment))
    generalised = basis.T @ coriolis
    assert_allclose(
        np.einsum("iaj,j,a->i", data.Ge, q_dot, omega), generalised, atol=scale(generalised)
    )
    centrifugal = basis.T @ force(np.cross(omega, np.cross(omega, x)))
    wx, wy, wz = omega
    products = np.array([wx * wx, wy * wy, wz * wz, wx * wy, wy * wz, wx * wz])
    assert_allclose(
        (data.Oe + np.einsum("ikc,k->ic", data.Oe1, q)) @ products,
        centrifugal,
        atol=scale(centrifugal),
    )
    turning = (data.Cr + np.einsum("jka,k->ja", data.Cr1, q)).T
    about = rigid_motion(x, np.zeros(3)).reshape(-1, 6)[:, 3:].T @ (structure.M @ basis)
    assert_allclose(turning, about, atol=scale(about))


def test_invariants_equal_those_of_exudyn(structure, basis, data):
    pytest.importorskip("exudyn")
    from exudyn.FEM import FEMinterface, ObjectFFRFreducedOrderInterface

    fem = FEMinterface()
    fem.nodes = {"Position": structure.points}
    fem.massMatrix, fem.stiffnessMatrix = sp.csr_matrix(structure.M), sp.csr_matrix(structure.K)
    fem.modeBasis = {"matrix": basis, "type": "NormalModes"}
    fem.surface = [{"Name": "none", "Trigs": np.zeros((0, 3), dtype=int)}]
    theirs = ObjectFFRFreducedOrderInterface(fem)
    trace = np.eye(3)[:, :, None, None] * np.trace(data.blocks)
    ours = {
        "totalMass": data.mass,
        "chiU": data.centre,
        "inertiaLocal": data.J,
        "massMatrixReduced": data.Me,
        "mPhitTPsi": data.N,
        "mXRefTildePsi": -data.Cr.T,
        "mXRefTildePsiTilde": np.hstack(list(np.moveaxis(data.Gr, 2, 0))) / 2.0,
        "mPsiTildePsi": data.Cr1.transpose(0, 2, 1).reshape(-1, 4),
        "mPsiTildePsiTilde": (trace - data.blocks).transpose(2, 1, 3, 0).reshape(12, 12),
    }
    for name, value in ours.items():
        result = np.asarray(getattr(theirs, name))
        assert_allclose(value, result, rtol=0.0, atol=1e-12 * np.abs(result).max(), err_msg=name)


def test_a_rigid_coupling_keeps_the_integrals(one_pin_mesh, carrier):
    free = structural_model("pin", one_pin_mesh, carrier, PIN_PILOTS)
    rigid = rigidly_coupled(replace(free, pilots=free.pilots[::2]), one_pin_mesh)
    T = np.random.default_rng(2).standard_normal((rigid.n_dofs, 3))
    result, expected = ffrf_data(rigid, T), ffrf_data(free, rigid.L @ T)
    assert_allclose(result.mass, expected.mass, rtol=1e-12)
    for integral in INTEGRALS:
        value = getattr(expected, integral)
        assert_allclose(
            getattr(result, integral), value, atol=1e-11 * np.abs(value).max(), err_msg=integral
        )


def test_rigid_surfaces_with_elements_between_them_share_their_mass():
    # Two elements deep and short: mass joins the two surfaces, whose sums of positions then differ
    # by transposition.
    mesh = box_mesh((0.1, 0.2, 0.3), (1, 2, 2))
    mesh.points[:] += [0.3, -0.7, 0.4]
    materials = {"carrier": STEEL}
    pilots = tuple(
        distributing_pilot(mesh, end, np.array([x, 0.1, -0.2]))
        for end, x in (("start", 0.3), ("end", 0.5))
    )
    K, M = assemble_stiffness(mesh, materials), assemble_mass(mesh, materials)
    free = StructuralModel("box", K, M, mesh.points, pilots)
    rigid = rigidly_coupled(free, mesh)
    assert abs(rigid.M[-12:-6, -6:]).max() > 0.0
    T = np.random.default_rng(2).standard_normal((rigid.n_dofs, 3))
    result, expected = ffrf_data(rigid, T), ffrf_data(free, rigid.L @ T)
    for integral in INTEGRALS:
        value = getattr(expected, integral)
        assert_allclose(
            getattr(result, integral), value, atol=1e-12 * np.abs(value).max(), err_msg=integral
        )


def test_a_mass_that_differs_between_axes_is_refused(structure, basis):
    M = structure.M.tolil()
    M[0, 0] *= 2.0
    with pytest.raises(
        ValueError, match=r"bar: the mass matrix differs between axes \(yy against xx\); expected"
    ):
        ffrf_data(replace(structure, M=sp.csr_array(M)), basis)


def test_wrong_shapes_are_refused(data, pin_reduction):
    with pytest.raises(
        ValueError, match=r"inertia invariant P has shape \(3, 4\); expected \(3, 3, 4\) for 4"
    ):
        replace(data, P=data.N)
    with pytest.raises(
        ValueError, match="pin: inertia invariants of 4 coordinates; expected 22, one a label"
    ):
        held_body(replace(pin_reduction.model, ffrf=data))


def test_a_turned_body_has_the_invariants_of_the_turned_mesh(structure, basis, data):
    angle = 0.7
    R = rotation_about_x(angle)
    there = (basis.reshape(-1, 3, 4).transpose(0, 2, 1) @ R.T).transpose(0, 2, 1).reshape(-1, 4)
    expected = ffrf_data(replace(structure, points=structure.points @ R.T), there)
    result = data.turned(R)
    for integral in INTEGRALS:
        value = getattr(expected, integral)
        assert_allclose(
            getattr(result, integral), value, atol=1e-12 * np.abs(value).max(), err_msg=integral
        )


def test_a_turned_model_keeps_mass_and_invariants_together(pin_reduction):
    model = turned(
        pin_reduction.model, 0.7, {f"pin_1_{p}": p for p in ("upwind", "midspan", "downwind")}
    )
    weight = np.sqrt(np.outer(model.M.diagonal(), model.M.diagonal()))
    assert_allclose(model.ffrf.Me / weight, model.M / weight, atol=1e-11)
    rigid = model.ffrf.transformed(geometric_rigid_modes(model))
    assert_allclose(rigid.Cr[3:], model.ffrf.J, atol=1e-8 * np.abs(model.ffrf.J).max())


def test_invariants_come_back_from_a_body_file(tmp_path, pin_reduction):
    write_body(pin_reduction.model, tmp_path / "pin.h5")
    result = read_body(tmp_path / "pin.h5").ffrf
    assert isinstance(result, FfrfData)
    assert result.mass == pin_reduction.model.ffrf.mass
    for integral in INTEGRALS:
        assert (getattr(result, integral) == getattr(pin_reduction.model.ffrf, integral)).all()
    write_body(replace(pin_reduction.model, ffrf=None), tmp_path / "pin.h5")
    assert read_body(tmp_path / "pin.h5").ffrf is None


@pytest.mark.parametrize(("integral", "shape"), [("Q", (6, 3, 3)), ("P", (3, 3)), ("mass", (1,))])
def test_wrong_invariants_in_a_body_file_are_refused(tmp_path, pin_reduction, integral, shape):
    path = tmp_path / "pin.h5"
    write_body(pin_reduction.model, path)
    with h5py.File(path, "r+") as file:
        del file[f"ffrf/{integral}"]
        file[f"ffrf/{integral}"] = np.zeros(shape)
    with pytest.raises(BodyFileError, match=rf"pin\.h5: /ffrf/{integral} has shape"):
        read_body(path)


def test_an_assembly_has_no_invariants_of_its_own():
    first, second = (
        craig_bampton(bar(), 2).model,
        craig_bampton(bar(name="next", offset=0.3), 2).model,
    )
    assert (
        assembled("both", [first, second], [Joint("bar_end", "next_start", 1e6, 1e6)]).ffrf is None
    )
