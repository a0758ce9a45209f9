"""MBDyn data read back by a parser of its own.

Groups complete, basis held, invariants those of nodal sums.
"""

import numpy as np
import pytest
import scipy.linalg
from numpy.testing import assert_allclose

from carrierflex.reduction.assembly import Joint, assembled
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.exports.mbdyn_files import write_mbdyn
from carrierflex.reduction.exports.ordered_body import held_body
from tests.reduction.exports.shuffled import shuffled
from tests.reduction.small_bar import bar


def read_fem(path):
    """Numbers of every record group, by the group's number; comments between are skipped."""
    groups, number = {}, None
    for line in path.read_text().splitlines():
        if line.startswith("** RECORD GROUP"):
            number = int(line.split("GROUP")[1].split(",")[0])
            groups[number] = []
        elif not line.startswith("**") and number is not None:
            groups[number] += [float(word) for word in line.split() if word != "REV0"]
    return {number: np.array(values) for number, values in groups.items()}


@pytest.fixture(scope="module")
def structure():
    return bar((3, 1, 1))


@pytest.fixture(scope="module")
def reduction(structure):
    return craig_bampton(structure, 3)


@pytest.fixture(params=["bar_start", "bar_end"])
def fixed_pilot(request):
    return request.param


@pytest.fixture
def groups(tmp_path, reduction, fixed_pilot):
    write_mbdyn(reduction.model, tmp_path / "bar.fem", pilot=fixed_pilot)
    return read_fem(tmp_path / "bar.fem")


@pytest.fixture
def basis(reduction, fixed_pilot):
    T = np.concatenate([reduction.Psi, reduction.modes.Phi], axis=1)
    return np.delete(T, reduction.model.coordinates_of(fixed_pilot), axis=1)


def test_groups_hold_the_held_body(groups, reduction, fixed_pilot):
    body, model = held_body(reduction.model, fixed_pilot), reduction.model
    n = len(body.K)
    assert groups[1].tolist() == [2, n, 0, 0, 0]
    assert groups[2].tolist() == [1, 2]
    points = np.array([groups[5], groups[6], groups[7]]).T
    assert_allclose(
        points, np.array(list(model.pilots.values())) - model.pilots[fixed_pilot], atol=1e-15
    )
    assert_allclose(groups[8].reshape(n, 2, 6), body.motion.transpose(2, 0, 1), atol=0.0)
    for number, matrix in ((9, body.M), (10, body.K), (13, body.D)):
        result = groups[number].reshape(n, n)
        assert_allclose(result, matrix, rtol=1e-15, atol=0.0)
    assert set(groups) == {*range(1, 3), *range(5, 11), *range(12, 19)}


def test_the_basis_holds_no_rigid_motion(groups, reduction, fixed_pilot):
    n = reduction.model.n_coordinates - 6
    K, M = groups[10].reshape(n, n), groups[9].reshape(n, n)
    scale = np.sqrt(np.outer(K.diagonal(), K.diagonal()))
    assert scipy.linalg.eigvalsh(K / scale)[0] > 1e-4
    assert (scipy.linalg.eigvalsh(M) > 0.0).all()
    shapes = groups[8].reshape(n, 2, 6)
    assert not shapes[:, list(reduction.model.pilots).index(fixed_pilot)].any()


def test_rigid_data_count_from_the_modal_node(groups, reduction, fixed_pilot):
    mass, model = reduction.model.mass_properties, reduction.model
    assert_allclose(groups[12][0], mass.mass, rtol=1e-15)
    assert_allclose(groups[12][1:4], mass.centre - model.pilots[fixed_pilot], atol=1e-15)
    assert_allclose(groups[12][4:].reshape(3, 3), mass.inertia, atol=1e-15)


def test_invariants_are_sums_over_the_nodes(groups, structure, basis, reduction, fixed_pilot):
    """Definitions of MBDyn, node by node, with the consistent mass between each two nodes."""
    m = structure.M.toarray()[0::3, 0::3]
    x, u = (
        structure.points - reduction.model.pilots[fixed_pilot],
        basis.reshape(len(structure.points), 3, -1),
    )
    n = u.shape[2]

    def tilde(vectors):
        return np.cross(vectors[..., None, :], np.eye(3)).swapaxes(-1, -2)

    x_tilde, u_tilde = tilde(x), tilde(u.swapaxes(1, 2))
    expected = {
        14: np.einsum("st,taj->aj", m, u),
        15: np.einsum("st,sab,tbj->aj", m, x_tilde, u, optimize=True),
        16: -np.einsum("st,sab,tjbc->ajc", m, x_tilde, u_tilde, optimize=True),
        17: np.einsum("st,sjab,tbk->ajk", m, u_tilde, u, optimize=True),
        18: np.einsum("st,sjab,tkbc->ajkc", m, u_tilde, u_tilde, optimize=True),
    }
    for number, value in expected.items():
        result = groups[number].reshape(value.shape)
        assert_allclose(
            result, value, rtol=0.0, atol=1e-12 * np.abs(value).max(), err_msg=f"group {number}"
        )
    assert n == 9


def test_the_header_states_units_frame_and_the_held_pilot(tmp_path, reduction):
    write_mbdyn(reduction.model, tmp_path / "bar.fem")
    text = (tmp_path / "bar.fem").read_text()
    for words in (
        "SI units: m, kg, s, N, rad",
        "body frame: x downwind",
        "Modal node: pilot bar_start, held",
    ):
        assert words in text
    # MBDyn reads comments into 255 characters.
    assert max(len(line) for line in text.splitlines() if line.startswith("**")) <= 80
    assert text.endswith("** END OF FILE\n")
    assert "** RECORD GROUP 8, MODE SHAPES" in text


def test_the_order_of_the_body_does_not_matter(tmp_path, reduction):
    write_mbdyn(reduction.model, tmp_path / "bar.fem")
    write_mbdyn(shuffled(reduction.model), tmp_path / "shuffled.fem")
    first, second = read_fem(tmp_path / "bar.fem"), read_fem(tmp_path / "shuffled.fem")
    for number, values in first.items():
        assert_allclose(
            second[number], values, rtol=1e-14, atol=1e-14 * np.abs(values).max(initial=1e-30)
        )


def test_what_cannot_be_written_is_refused_and_leaves_nothing(tmp_path, reduction):
    model = reduction.model
    with pytest.raises(KeyError, match="bar has no pilot 'middle'"):
        write_mbdyn(model, tmp_path / "bar.fem", pilot="middle")
    other = craig_bampton(bar(name="next", offset=0.3), 0).model
    both = assembled("both", [model, other], [Joint("bar_end", "next_start", 1e6, 1e6)])
    with pytest.raises(ValueError, match="both: pilots share coordinates"):
        write_mbdyn(both, tmp_path / "bar.fem")
    free = assembled("two", [model, other], [])
    with pytest.raises(
        ValueError, match="two has no inertia invariants, which floating-frame codes need"
    ):
        write_mbdyn(free, tmp_path / "bar.fem")
    assert not list(tmp_path.iterdir())
