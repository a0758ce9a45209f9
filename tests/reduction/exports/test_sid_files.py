"""Standard input data read back by a parser of its own.

Index orders, signs, and nodal sums of what the words mean.
"""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.surface_integrals import rigid_motion
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.exports.ordered_body import held_body
from carrierflex.reduction.exports.sid_files import held_modes, write_sid
from tests.reduction.exports.shuffled import shuffled
from tests.reduction.small_bar import bar

ENTRY = re.compile(r"^\s*(.+?)\s*=\s*(.+?)\s*$")
INDEX = re.compile(r"(m[01])\(([ \d,]+)\)")


def read_sid(path):
    """Header line, plain entries, blocks of the body and blocks of every node.

    Body's by name, nodes' by number and name.
    """
    lines = path.read_text().splitlines()
    plain = {}
    blocks = {}
    nodes = {}
    node = None
    block = None
    for line in lines[1:]:
        words, entry = line.split(), ENTRY.match(line)
        if entry is None:
            if words == ["end", "node"]:
                node = None
            elif words[0] != "end" and words[0] not in ("part", "new", "refmod", "frame"):
                block = (blocks if node is None else nodes[node]).setdefault(words[0], {})
            elif words[0] == "end":
                block = None
            continue
        key, value = entry.groups()
        index = INDEX.match(key)
        if index:
            indices = tuple(int(number) - 1 for number in index[2].split(","))
            block[index[1]][indices] = float(value.replace("D", "E"))
        elif block is not None:
            block[key] = int(value)
            if key == "structure":
                block["m0"] = (
                    np.eye(block["nrow"])
                    if value == "4"
                    else np.zeros((block["nrow"], block["ncol"]))
                )
                block["m1"] = np.zeros((block["nrow"], block["nq"], block["ncol"]))
        elif key == "new node":
            node = int(value)
            nodes[node] = {}
        else:
            plain[key] = value
    return lines[0], plain, blocks, nodes


@pytest.fixture(scope="module")
def structure():
    return bar((3, 1, 1))


@pytest.fixture(scope="module")
def reduction(structure):
    return craig_bampton(structure, 3)


@pytest.fixture(scope="module")
def written(tmp_path_factory, reduction):
    path = tmp_path_factory.mktemp("sid") / "bar.SID_FEM"
    frequencies = write_sid(reduction.model, path)
    return path, frequencies


@pytest.fixture(scope="module")
def blocks(written):
    return read_sid(written[0])[2]


@pytest.fixture(scope="module")
def modes(reduction):
    """Mode shapes (n, 3, 9) on all nodes."""
    T = np.concatenate([reduction.Psi, reduction.modes.Phi], axis=1)[:, 6:]
    _, V = held_modes(held_body(reduction.model))
    return (T @ V).reshape(-1, 3, V.shape[1])


def near(actual, expected):
    assert_allclose(actual, expected, rtol=0.0, atol=1e-11 * np.abs(expected).max())


def test_first_line_and_refmod(written, reduction):
    first, plain, _, nodes = read_sid(written[0])
    assert first.split()[:2] == ["2", "9"]
    for words in (
        "SI units: m, kg, s, N, rad",
        "body frame: x downwind",
        "held pilot bar_start",
        "1 bar_start, 2 bar_end",
    ):
        assert words in first
    assert float(plain["mass"].replace("D", "E")) == pytest.approx(
        reduction.model.mass_properties.mass, rel=1e-14
    )
    assert plain["nelastq"] == "9"
    assert plain["ielastq (   1)"] == f"Eigen Mode    1 : {written[1][0]:14.6f} Hz"
    assert sorted(nodes) == [1, 2]


def test_first_moment_is_mass_times_centre_and_its_change_the_translation_coupling(
    blocks, reduction
):
    mass = reduction.model.mass_properties
    assert_allclose(blocks["mdCM"]["m0"][:, 0], mass.mass * mass.centre, atol=1e-13)
    assert (blocks["mdCM"]["m1"][:, :, 0] == blocks["Ct"]["m0"].T).all()


def test_inertia_is_a_column_of_six_with_the_tensors_signs(tmp_path):
    # Off its axis the bar has products of inertia: Jxy = -∫ρxy < 0 where x and y are positive, Jyz
    # > 0 where z is not.
    model = craig_bampton(moved(bar(), [0.1, 0.2, -0.3]), 1).model
    write_sid(model, tmp_path / "bar.SID_FEM")
    J = read_sid(tmp_path / "bar.SID_FEM")[2]["J"]["m0"][:, 0]
    mass = model.mass_properties
    c = mass.centre
    full = mass.inertia + mass.mass * (c @ c * np.eye(3) - np.outer(c, c))
    assert_allclose(
        J, [full[0, 0], full[1, 1], full[2, 2], full[0, 1], full[0, 2], full[1, 2]], rtol=1e-10
    )
    assert J[3] < 0.0 < J[5]


def moved(structure, shift):
    from dataclasses import replace

    pilots = tuple(replace(pilot, point=pilot.point + shift) for pilot in structure.pilots)
    return replace(structure, points=structure.points + np.array(shift), pilots=pilots)


def test_inertia_changes_with_the_modes_as_that_of_the_deformed_mesh(blocks, structure, modes):
    step = 1e-6
    for j in range(modes.shape[2]):
        slopes = []
        for sign in (1.0, -1.0):
            R = rigid_motion(structure.points + sign * step * modes[..., j], np.zeros(3)).reshape(
                -1, 6
            )
            slopes.append((R.T @ (structure.M @ R))[3:, 3:])
        slope = (slopes[0] - slopes[1]) / (2.0 * step)
        expected = [slope[a, b] for a, b in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        assert_allclose(
            blocks["J"]["m1"][:, j, 0], expected, atol=1e-7 * np.abs(blocks["J"]["m1"]).max()
        )


def test_inertia_forces_are_those_of_a_rotating_mesh(blocks, structure, modes):
    rng = np.random.default_rng(11)
    n = modes.shape[2]
    q, q_dot = rng.standard_normal((2, n)) * 0.1
    omega = rng.standard_normal(3)
    x0, T = structure.points, modes.reshape(-1, n)
    x = x0 + modes @ q

    def force(acceleration):
        return structure.M @ acceleration.ravel()

    wx, wy, wz = omega
    # Columns of Oe: xx yy zz xy yz xz.
    products = np.array([wx * wx, wy * wy, wz * wz, wx * wy, wy * wz, wx * wz])
    Oe = blocks["Oe"]["m0"] + np.einsum("ikc,k->ic", blocks["Oe"]["m1"], q)
    near(Oe @ products, T.T @ force(np.cross(omega, np.cross(omega, x))))
    coriolis = force(2.0 * np.cross(omega, modes @ q_dot))
    near(np.einsum("ija,j,a->i", blocks["Ge"]["m0"].reshape(n, n, 3), q_dot, omega), T.T @ coriolis)
    arm = rigid_motion(x0, np.zeros(3)).reshape(-1, 6)[:, 3:]
    near(
        np.einsum("bja,j,a->b", blocks["Gr"]["m0"].reshape(3, n, 3), q_dot, omega), arm.T @ coriolis
    )
    Cr = blocks["Cr"]["m0"] + np.einsum("jka,k->ja", blocks["Cr"]["m1"], q)
    near(Cr.T, rigid_motion(x, np.zeros(3)).reshape(-1, 6)[:, 3:].T @ (structure.M @ T))
    near(blocks["Me"]["m0"], T.T @ (structure.M @ T))


def test_stiffness_and_damping_are_those_of_the_modes(blocks, structure, modes, written):
    T = modes.reshape(-1, modes.shape[2])
    assert_allclose(
        blocks["Ke"]["m0"], T.T @ (structure.K @ T), atol=1e-8 * blocks["Ke"]["m0"].max()
    )
    assert_allclose(np.sqrt(blocks["Ke"]["m0"].diagonal()) / (2.0 * np.pi), written[1], rtol=1e-12)
    assert (np.diff(written[1]) >= 0.0).all()
    assert written[1][0] > 10.0  # no rigid motion is left
    assert np.linalg.eigvalsh(blocks["De"]["m0"]).min() > -1e-9


def test_nodes_move_as_the_pilots_do(written, structure, modes, reduction):
    nodes = read_sid(written[0])[3]
    for number, pilot in enumerate(structure.pilots, start=1):
        motion = pilot.G @ modes.reshape(-1, modes.shape[2])
        result = nodes[number]
        assert_allclose(result["origin"]["m0"][:, 0], pilot.point, atol=1e-15)
        scale = 1e-8 * np.abs(modes).max()
        assert_allclose(result["origin"]["m1"][:, :, 0], motion[:3], atol=scale)
        assert_allclose(result["phi"]["m0"], motion[:3], atol=scale)
        assert_allclose(result["psi"]["m0"], motion[3:], atol=scale)
        # Axes of the node: AP = I + psi~, so that its first column turns by psi × e_x.
        for column in range(3):
            turned = np.cross(result["psi"]["m0"].T, np.eye(3)[column]).T
            assert_allclose(
                result["AP"]["m1"][:, :, column],
                turned,
                atol=1e-13 * max(np.abs(turned).max(), 1.0),
            )
    assert not nodes[1]["phi"]["m0"].any()


def test_file_orders_of_the_first_order_entries_are_row_mode_column(written):
    text = written[0].read_text()
    indices = re.findall(
        r"m1\( *(\d+), *(\d+), *(\d+)\)", text.split("  mdCM")[1].split("end mdCM")[0]
    )
    assert {(int(a) <= 3, int(c)) for a, _, c in indices} == {(True, 1)}
    assert max(int(b) for _, b, _ in indices) > 3


def test_the_order_of_the_body_does_not_matter(tmp_path, reduction, written):
    assert_allclose(
        write_sid(shuffled(reduction.model), tmp_path / "bar.SID_FEM"), written[1], rtol=1e-9
    )


def test_another_held_pilot_gives_other_modes_of_the_same_body(tmp_path, reduction, written):
    frequencies = write_sid(reduction.model, tmp_path / "bar.SID_FEM", pilot="bar_end")
    # The bar is its own mirror image: held at either end it vibrates alike.
    assert_allclose(frequencies[:2], written[1][:2], rtol=0.05)
    assert "held pilot bar_end" in (tmp_path / "bar.SID_FEM").read_text()
