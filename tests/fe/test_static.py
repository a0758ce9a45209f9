from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose

from carrierflex.fe.factorisation import SingularMatrixError
from carrierflex.fe.materials import BODY_MATERIALS, Material
from carrierflex.fe.static import AccuracyError, clamped_displacement
from carrierflex.fe.structural_model import structural_model
from tests.fe.box_meshes import box_mesh


@pytest.fixture(scope="module")
def shaft_face(flexible_mesh):
    return np.unique(flexible_mesh.surface("shaft_face"))


def test_clamped_nodes_stay_and_the_reaction_balances_force_and_moment(
    flexible_structure, shaft_face
):
    load = np.array([1.0, 20.0, -3.0, 4.0, -5.0, 6.0])
    f = flexible_structure.load_vector({"downwind_seat": load})[:, None]
    solution = clamped_displacement(flexible_structure, shaft_face, f)
    assert not solution.u.reshape(-1, 3)[shaft_face].any()
    # The pilot stands at x = 0.38 m: a force there has a moment about the origin.
    moment = load[3:] + np.cross([0.38, 0.0, 0.0], load[:3])
    assert_allclose(
        solution.reaction[:, 0], -np.concatenate([load[:3], moment]), rtol=0.0, atol=1e-8
    )
    assert solution.imbalance < 1e-10


def test_a_spring_to_ground_that_no_clamp_knows_is_found_out(flexible_structure, shaft_face):
    spring = sp.csr_array(
        (np.array([1e6]), ([3 * 5000], [3 * 5000])), shape=flexible_structure.K.shape
    )
    grounded = replace(flexible_structure, K=(flexible_structure.K + spring).tocsr())
    f = grounded.load_vector({"downwind_seat": np.array([1e3, 0.0, 0.0, 0.0, 0.0, 0.0])})[:, None]
    with pytest.raises(
        AccuracyError,
        match=r"flexible_carrier: load and reaction differ by .* expected less than 1e-09",
    ):
        clamped_displacement(grounded, shaft_face, f)


def test_a_body_held_at_one_node_is_refused(pin_structure):
    f = pin_structure.load_vector({"pin_1_midspan": np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])})[
        :, None
    ]
    with pytest.raises(SingularMatrixError, match="without rigid motion"):
        clamped_displacement(pin_structure, np.array([0]), f)


def test_input_arrays_stay_unchanged(pin_structure, one_pin_mesh):
    clamp = np.unique(one_pin_mesh.surface("pin_1_upwind"))
    f = pin_structure.load_vector({"pin_1_midspan": np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])})[
        :, None
    ]
    before = f.copy(), clamp.copy(), pin_structure.K.data.copy()
    clamped_displacement(pin_structure, clamp, f)
    for now, then in zip((f, clamp, pin_structure.K.data), before, strict=True):
        assert (now == then).all()


def test_a_load_at_an_unknown_pilot_is_refused(pin_structure):
    with pytest.raises(
        KeyError, match=r"pin has no pilot 'pin_2_midspan'; it has pin_1_upwind, pin_1_midspan"
    ):
        pin_structure.load_vector({"pin_2_midspan": np.zeros(6)})


def test_a_body_without_rim_has_no_sensors_and_a_carrier_has_two_rows_a_degree(
    pin_structure, flexible_structure
):
    assert pin_structure.sensors is None
    names = flexible_structure.sensors.names
    assert (len(names), names[0], names[359], names[360]) == (
        720,
        "rim_axial_000",
        "rim_axial_359",
        "rim_radial_000",
    )
    assert flexible_structure.sensors.rows.shape == (720, flexible_structure.n_dofs)


def test_a_structure_without_material_or_surface_is_refused(carrier, one_pin_mesh):
    with pytest.raises(ValueError, match="body 'pins' has no material"):
        structural_model(
            "pin", one_pin_mesh, carrier, (), materials={"carrier": BODY_MATERIALS["carrier"]}
        )
    with pytest.raises(KeyError, match="no surface 'shaft_face'"):
        structural_model("box", box_mesh((1, 1, 1), (1, 1, 1)), carrier, ("shaft_face",))


WRONG_MATERIALS = [
    ({"E": 0.0}, r"material m: E is 0.0 Pa; expected a positive Young's modulus"),
    ({"E": float("nan")}, r"material m: E is nan Pa"),
    ({"nu": 0.5}, r"material m: nu is 0.5; expected between -1 and 0.5"),
    ({"nu": -1.0}, r"material m: nu is -1.0"),
    ({"rho": -1.0}, r"material m: rho is -1.0 kg/m\^3; expected a positive density"),
    ({"E": 210e3}, r"material m: E = 210000.0 Pa and rho = 7850.0 kg/m\^3; expected SI units"),
    ({"rho": 7.85}, r"expected SI units"),
]


@pytest.mark.parametrize(("changed", "message"), WRONG_MATERIALS)
def test_impossible_materials_are_refused(changed, message):
    with pytest.raises(ValueError, match=message):
        Material(**{"name": "m", "E": 210e9, "nu": 0.3, "rho": 7850.0, **changed})


def test_lame_parameters_give_back_modulus_and_contraction():
    # Uniaxial stress: E = mu (3 lambda + 2 mu) / (lambda + mu), nu = lambda / 2 (lambda + mu).
    lam, mu = Material("m", E=210e9, nu=0.3, rho=7850.0).lame
    assert_allclose(mu * (3.0 * lam + 2.0 * mu) / (lam + mu), 210e9, rtol=1e-14)
    assert_allclose(lam / (2.0 * (lam + mu)), 0.3, rtol=1e-14)
