"""Superelements of OpenFAST, read by readers after the published descriptions of both forms."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.spatial
from numpy.testing import assert_allclose, assert_array_equal

from carrierflex.reduction.exports.openfast_files import (
    GRAVITY,
    checks,
    superelement,
    write_openfast,
)
from carrierflex.reduction.modes.dense_modes import dense_modes
from carrierflex.reduction.pin_joints import PAPER_STIFFNESS, carrier_with_pins
from carrierflex.reduction.reduced_model import FREE_MOTIONS, MassProperties, ReducedModel
from carrierflex.reduction.reduced_static import pilot_compliance
from tests.reduction.exports.shuffled import shuffled

PILOT = "pin_1_midspan"


def blocks_of(path):
    """Tables of a file of ExtPtfm by the first words of their headings, as its source looks for.

    Written after ReadReducedFile, ReadConnFile and ReadFlexASCII of ExtPtfm_MCKF_IO.f90: a heading
    is a line that begins with ! and words in any case; the numbers follow.
    """
    tables, title = {}, ""
    for line in path.read_text().splitlines():
        if line.startswith("!"):
            if not line.lower().startswith("!dimension"):
                title = line[1:].strip().lower()
            if ":" in line:
                key, _, value = line[1:].partition(":")
                # The line below a heading is passed over: the first dimension counts.
                tables.setdefault(key.strip().lower(), value.strip())
        elif line.strip():
            tables.setdefault(title, []).append([float(cell) for cell in line.split()])
    return {k: np.array(v) if isinstance(v, list) else v for k, v in tables.items()}


def table(tables, words):
    (result,) = (
        value
        for name, value in tables.items()
        if name.startswith(words) and isinstance(value, np.ndarray)
    )
    return result


@pytest.fixture(scope="module")
def group(pin_reduction, flexible_reduction):
    return carrier_with_pins(flexible_reduction.model, pin_reduction.model, PAPER_STIFFNESS)


def rigid_block(m=2.0, centre=(1.0, 2.0, 3.0)):
    """A rigid body of one pilot, its matrices written by hand."""
    x, y, z = centre
    moment = m * np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    inertia = np.diag([40.0, 50.0, 60.0])
    M = np.block([[m * np.eye(3), -moment], [moment, inertia]])
    none = np.zeros((6, 6))
    labels = tuple(f"hub {c}" for c in ("Tx [m]", "Ty [m]", "Tz [m]", "Rx [rad]", "Ry [rad]", "Rz"))
    return ReducedModel(
        "block", none, M, none, labels, {"hub": np.zeros(3)}, {"hub": np.arange(6)}, (),
        np.zeros((0, 6)), MassProperties(m, np.array(centre), inertia),
    )  # fmt: skip


def test_a_rigid_block_has_the_entries_that_the_description_asks_for(tmp_path):
    body = superelement(rigid_block())
    write_openfast(body, tmp_path / "block.dat", "current")
    tables = blocks_of(tmp_path / "block_SE.dat")
    # By hand, m = 2 kg, centre (1, 2, 3) m: M(1,5) = m z, M(1,6) = -m y, M(2,6) = m x.
    assert_array_equal(table(tables, "mass")[0], [2.0, 0.0, 0.0, 0.0, 6.0, -4.0])
    assert_array_equal(table(tables, "mass")[1], [0.0, 2.0, 0.0, -6.0, 0.0, 2.0])
    # W_0(3) = -m g, W_0(4) = W_0(3) y, W_0(5) = -W_0(3) x; g = 9.80665.
    weight = -19.6133
    W_0 = table(tables, "weight constant")[0]
    assert_allclose(W_0, [0.0, 0.0, weight, 2.0 * weight, -weight, 0.0], rtol=1e-12)
    # (1,5) = W_0(3), (2,4) = -W_0(3), (4,4) and (5,5) = W_0(3) z, (6,4) = -W_0(3) x, (6,5) = .. y.
    expected = np.zeros((6, 6))
    expected[0, 4], expected[1, 3] = weight, -weight
    expected[3, 3] = expected[4, 4] = 3.0 * weight
    expected[5, 3], expected[5, 4] = -weight, -2.0 * weight
    assert_allclose(table(tables, "weight stiffness"), expected, rtol=1e-12)
    assert tables["dimension"] == "6"
    assert blocks_of(tmp_path / "block_Conn.dat")["nconn"] == "0"


@pytest.mark.parametrize("body", ["pin", "joined group"])
def test_both_forms_give_back_every_number(body, tmp_path, pin_reduction, group):
    model = shuffled(pin_reduction.model) if body == "pin" else group
    exported = superelement(model)
    for form in ("current", "flex5"):
        write_openfast(exported, tmp_path / f"{form}.dat", form)
        tables = blocks_of(tmp_path / f"{form}_SE.dat")
        for words, matrix in (
            ("mass", exported.M),
            ("stiffness", exported.K),
            ("damping", exported.C),
        ):
            assert_array_equal(table(tables, words), matrix)
        assert int(tables["dimension"]) == len(exported.M)
    lines = (tmp_path / "flex5_SE.dat").read_text().splitlines()
    assert "flex 5 format" in lines[1].lower()
    # Steps are nint(T / dt) + 1; a row holds time, n loads and the wave's elevation.
    steps = round(
        float(tables["total simulation time in file"])
        / float(tables["time increment in simulation"])
    )
    loads = table(tables, "loading")
    assert loads.shape == (steps + 1, len(exported.M) + 2)
    assert_allclose(loads[:, 1:-1], np.tile(exported.W_0, (steps + 1, 1)), rtol=1e-10)
    assert max(len(line) for line in lines[-2:]) < 4096
    points = blocks_of(tmp_path / "current_Conn.dat")
    assert int(points["nconn"]) == len(model.pilots) - 1
    assert_array_equal(table(points, "connections"), list(model.pilots.values())[1:])
    assert_array_equal(table(points, "displacement"), exported.displacement)


def test_openfasts_own_library_reads_the_current_form(tmp_path, pin_reduction):
    reading = pytest.importorskip("openfast_io.FAST_reader")
    exported = superelement(pin_reduction.model, PILOT)
    write_openfast(exported, tmp_path / "pin.dat", "current")
    reader = reading.InputReader_OpenFAST()
    reader.read_ExtPtfm(str(tmp_path / "pin.dat"))
    result = reader.fst_vt["ExtPtfm"]
    assert (result["RBMod"], result["NActiveDOFList"], result["HasUserForcing"]) == (2, -1, False)
    matrices = result["FlexASCII"]
    for key, matrix in (
        ("MassMatrix", exported.M),
        ("StiffnessMatrix", exported.K),
        ("DampingMatrix", exported.C),
        ("WeightConstant", exported.W_0[None]),
        ("WeightStiffness", exported.K_W),
    ):
        assert_array_equal(matrices[key], matrix)
    assert_array_equal(result["Connections"]["Displacement"], exported.displacement)


@pytest.mark.parametrize("body", ["pin", "joined group"])
def test_a_free_body_keeps_mass_six_free_motions_and_frequencies(body, pin_reduction, group):
    model = pin_reduction.model if body == "pin" else group
    exported = superelement(model)
    assert_array_equal(exported.K[:6], 0.0)
    for matrix in (exported.M, exported.K):
        assert_array_equal(matrix, matrix.T)
    figures = checks(exported)
    assert_allclose(figures["mass [kg]"], exported.M[2, 2], rtol=1e-9)
    assert figures["mass away from a rigid body's, relative"] < 1e-8
    # Frequencies of the free body: those of M_r and K_r with the interface's motion taken out.
    reduced = exported.M[6:, 6:] - exported.M[6:, :6] @ np.linalg.solve(
        exported.M[:6, :6], exported.M[:6, 6:]
    )
    result = scipy.linalg.eigh(exported.K[6:, 6:], reduced, eigvals_only=True)
    assert_allclose(result, dense_modes(model.K, model.M)[0][6:], rtol=1e-10)


def test_mass_and_centre_are_those_of_the_body(pin_reduction):
    model = pin_reduction.model
    figures = checks(superelement(model, PILOT))
    properties = model.mass_properties
    assert_allclose(figures["mass [kg]"], properties.mass, rtol=1e-9)
    arm = properties.centre - model.pilots[PILOT]
    result = [figures[f"centre of mass, {axis} [m]"] for axis in "xyz"]
    assert_allclose(result, arm, atol=1e-9)


def test_self_weight_is_what_gravity_does_to_the_turned_body(pin_reduction):
    exported = superelement(pin_reduction.model, PILOT)
    theta_x, theta_y = 1e-3, -2e-3
    q = np.zeros(len(exported.M))
    q[3], q[4] = theta_x, theta_y
    # Gravity in the frame of the interface, to first order, as an acceleration of its translation.
    turned = scipy.spatial.transform.Rotation.from_rotvec([theta_x, theta_y, 0.0])
    g = turned.inv().apply([0.0, 0.0, -GRAVITY])
    expected = exported.M[:, :3] @ g
    weight = np.abs(expected).max()
    assert_allclose(exported.W_0 - exported.K_W @ q, expected, atol=1e-5 * weight)
    assert np.abs(exported.K_W @ q).max() > 1e-4 * weight
    assert_allclose(exported.K_W[3:5, 6:], exported.K_W[6:, 3:5].T)


def test_a_held_body_has_its_stiffness_at_the_interface(pin_reduction):
    model = pin_reduction.model
    K = model.K.copy()
    rows = model.coordinates_of("pin_1_upwind")
    K[rows, rows] += [1e8, 1e8, 2e8, 1e6, 1e6, 3e6]
    grounded = replace(model, K=K, provenance={**model.provenance, FREE_MOTIONS: "0"})
    with pytest.raises(ValueError, match="meet a stiffness, and are free by its record"):
        superelement(replace(model, K=K), PILOT)
    exported = superelement(grounded, PILOT)
    first = 6 * list(grounded.pilots).index(PILOT)
    compliance = pilot_compliance(grounded, ())[first : first + 6, first : first + 6]
    assert_allclose(np.linalg.inv(exported.K[:6, :6]), compliance, rtol=1e-8, atol=1e-20)
    figures = checks(exported)
    assert_allclose(figures["stiffness in torsion about x [N m/rad]"], 1.0 / compliance[3, 3])
    result = scipy.linalg.eigh(exported.K, exported.M, eigvals_only=True)
    assert_allclose(result, dense_modes(grounded.K, grounded.M)[0], rtol=1e-9)
    assert_array_equal(exported.W_0, 0.0)


def test_what_openfast_cannot_take_is_refused(tmp_path, pin_reduction):
    model = pin_reduction.model
    exported = superelement(model)
    with pytest.raises(ValueError, match=r"a\.txt: suffix '\.txt'; expected \.dat"):
        write_openfast(exported, tmp_path / "a.txt", "current")
    with pytest.raises(ValueError, match="3 of its rigid motions are free; expected all six or no"):
        superelement(replace(model, provenance={FREE_MOTIONS: "3"}))
    n = 300
    wide = replace(exported, M=np.eye(n), K=np.eye(n), C=np.eye(n), W_0=np.zeros(n), K_W=np.eye(n))
    with pytest.raises(ValueError, match=r"300 coordinates .* write --format openfast"):
        write_openfast(wide, tmp_path / "a.dat", "flex5")
    assert not list(tmp_path.iterdir())
