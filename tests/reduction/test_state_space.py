"""A, B, C, D of a body: eigenvalues and frequency response are those of its matrices."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.io
from numpy.testing import assert_allclose, assert_array_equal

from carrierflex.reduction.exports.state_space_files import write_state_space
from carrierflex.reduction.pin_joints import PAPER_STIFFNESS, carrier_with_pins
from carrierflex.reduction.reduced_model import FREE_MOTIONS, MassProperties, ReducedModel
from carrierflex.reduction.state_space import body_state_space

#: Low frequencies, where free motion rules, to above the first elastic modes.
HZ = np.array([10.0, 60.0, 137.0, 800.0, 4e3])


@pytest.fixture(scope="module")
def bodies(pin_reduction, flexible_reduction):
    pin, carrier = pin_reduction.model, flexible_reduction.model
    group = carrier_with_pins(carrier, pin, PAPER_STIFFNESS)
    return {"pin": pin, "carrier": carrier, "joined group": group}


def direct_response(model, hz):
    """Pilots and sensors per load at the pilots, by one solve a frequency, shape (p, m)."""
    w = 2.0 * np.pi * hz
    Z = model.K + 1j * w * model.D - w**2 * model.M
    s = 1.0 / np.sqrt(np.abs(Z.diagonal()))
    rows = list(dict.fromkeys(model.pilot_rows.tolist()))
    unit = np.eye(model.n_coordinates)[:, rows]
    q = s[:, None] * np.linalg.solve(Z * np.outer(s, s), s[:, None] * unit)
    return np.vstack([q[rows], model.sensor_rows @ q])


def one_mass(m=2.0, c=3.0, k=5e4):
    """A mass held by a spring and a damper along x."""
    one = np.eye(1)
    return ReducedModel(
        "mass", k * one, m * one, c * one, ("point Tx [m]",), {"point": np.zeros(3)},
        {"point": np.array([0])}, ("probe",), 2.0 * one,
        MassProperties(m, np.zeros(3), np.eye(3)), {FREE_MOTIONS: "0"},
        pilot_components={"point": (0,)},
    )  # fmt: skip


def test_a_mass_on_a_spring_has_the_response_of_the_formula():
    system = body_state_space(one_mass())
    w = 2.0 * np.pi * HZ
    expected = 1.0 / (5e4 - 2.0 * w**2 + 3j * w)
    H = system.frequency_response(HZ)
    assert_allclose(H[:, 0, 0], expected, rtol=1e-12)
    assert_allclose(H[:, 1, 0], 2.0 * expected, rtol=1e-12)
    roots = np.roots([2.0, 3.0, 5e4])
    assert_allclose(
        np.sort_complex(np.linalg.eigvals(system.A)), np.sort_complex(roots), rtol=1e-12
    )
    assert (system.inputs.units, system.outputs.units) == (("N",), ("m", "m"))


@pytest.mark.parametrize("body", ["pin", "carrier", "joined group"])
def test_frequency_response_is_that_of_the_bodys_matrices(body, bodies):
    H = body_state_space(bodies[body]).frequency_response(HZ)
    for result, hz in zip(H, HZ, strict=True):
        expected = direct_response(bodies[body], hz)
        # Translations and rotations are compared at the size that each output has.
        error = np.linalg.norm(result - expected, axis=1) / np.linalg.norm(expected, axis=1)
        assert error.max() < 1e-8


def distance_to_root(model, root):
    """How far a number is from the nearest root of K + λ D + λ² M, by one Newton step."""
    s = 1.0 / np.sqrt(model.M.diagonal())
    K, D, M = (s[:, None] * X * s for X in (model.K, model.D, model.M))
    U, _, Vh = np.linalg.svd(K + root * D + root**2 * M)
    u, v = U[:, -1].conj(), Vh[-1].conj()
    Z = K + root * D + root**2 * M
    return abs((u @ Z @ v) / (u @ (D + 2.0 * root * M) @ v))


@pytest.mark.parametrize("body", ["pin", "carrier", "joined group"])
def test_eigenvalues_are_roots_of_the_bodys_matrices(body, bodies):
    model = bodies[body]
    roots = np.linalg.eigvals(body_state_space(model).A)
    assert np.count_nonzero(np.abs(roots) < 1.0) == 12  # six free motions, position and velocity
    elastic = roots[roots.imag > 1.0]
    assert len(elastic) == model.n_coordinates - 6
    for root in elastic[np.argsort(np.abs(elastic))][:: max(len(elastic) // 12, 1)]:
        assert distance_to_root(model, root) < 1e-10 * abs(root)


def test_six_free_motions_are_double_integrators(pin_reduction):
    system = body_state_space(pin_reduction.model)
    n = len(system.A) // 2
    assert_array_equal(system.A[n:, :6], 0.0)
    force = np.zeros(len(system.inputs.names))
    force[system.inputs.names.index("load at pin_1_midspan Tx")] = 1.0
    # Newton: far below the first mode, acceleration is force over mass.
    row = system.outputs.names.index("pin_1_midspan Tx")
    w = 2.0 * np.pi * 10.0
    H = (system.frequency_response(np.array([10.0]))[0] @ force)[row]
    mass = pin_reduction.model.mass_properties.mass
    assert_allclose(-(w**2) * H.real, 1.0 / mass, rtol=1e-4)


def test_tied_pilots_are_one_input(bodies):
    group = bodies["joined group"]
    names = body_state_space(group).inputs.names
    assert len(set(names)) == len(names) == len(np.unique(group.pilot_rows))


def test_a_motion_without_mass_is_refused(pin_reduction):
    M = pin_reduction.model.M.copy()
    M[-1], M[:, -1] = 0.0, 0.0
    with pytest.raises(ValueError, match=r"1 motions have stiffness and no mass.* reduce again"):
        body_state_space(replace(pin_reduction.model, M=M))


def test_a_body_that_is_held_and_recorded_as_free_is_refused(pin_reduction):
    K = pin_reduction.model.K.copy()
    K[0, 0] += 1e6
    with pytest.raises(ValueError, match="5 motions meet no stiffness, and 6 are free by"):
        body_state_space(replace(pin_reduction.model, K=K))


@pytest.mark.parametrize("suffix", [".mat", ".npz"])
def test_files_hold_matrices_names_and_units(suffix, tmp_path, pin_reduction):
    system = body_state_space(pin_reduction.model)
    path = tmp_path / f"pin{suffix}"
    write_state_space(system, path)
    if suffix == ".mat":
        result = scipy.io.loadmat(path, simplify_cells=True)["model"]
    else:
        result = dict(np.load(path))
    for letter in "ABCD":
        assert_array_equal(result[letter], getattr(system, letter))
    assert tuple(result["input_names"]) == system.inputs.names
    assert tuple(result["input_units"]) == system.inputs.units
    assert tuple(result["output_names"]) == system.outputs.names
    assert len(result["state_names"]) == len(system.A)
    assert str(result["units"]) == "SI units: m, kg, s, N, rad"


def test_python_control_has_the_same_poles_and_response():
    control = pytest.importorskip("control")
    system = body_state_space(one_mass())
    other = system.to_control()
    assert_allclose(np.sort_complex(other.poles()), np.sort_complex(np.linalg.eigvals(system.A)))
    w = 2.0 * np.pi * 137.0
    assert_allclose(
        control.evalfr(other, 1j * w), system.frequency_response(np.array([137.0]))[0], rtol=1e-10
    )
    assert other.input_labels == ["load at point Tx [N]"]
    assert other.output_labels == ["point Tx [m]", "probe [m]"]
