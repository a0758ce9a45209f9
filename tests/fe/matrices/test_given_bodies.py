"""Bodies of other programs' matrices: the same by every format, published examples, refusals.

The matrices are CalculiX's (ccx 2.20 of Debian) of our mesh, its printed numbers carried over into
the forms of programs that are not at hand.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import pyyeti
import scipy.io
import scipy.sparse as sp
from numpy.testing import assert_allclose, assert_array_equal
from pyyeti.nastran import bulk, n2p, op2, op4

from carrierflex.fe.materials import STEEL
from carrierflex.fe.matrices.given_structure import given_body
from carrierflex.fe.matrices.matrix_files import read_matrix
from carrierflex.fe.rigid_couplings import rigidly_coupled
from carrierflex.fe.structural_model import StructuralModel, with_equal_node_weights
from carrierflex.reduction.body_files import read_body, write_body
from carrierflex.reduction.certificate import certify
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.dynamic_stiffness import full_response
from carrierflex.reduction.exports.dmig_files import write_dmig
from carrierflex.reduction.exports.op4_files import write_op4
from carrierflex.reduction.exports.sid_files import write_sid
from carrierflex.reduction.free_interface import free_interface_reduction
from carrierflex.reduction.imports.foreign_bodies import read_any_body
from carrierflex.reduction.mechanisms import sound_grounding
from carrierflex.reduction.modes.dense_modes import dense_modes
from carrierflex.reduction.modes.mode_rules import Below
from carrierflex.reduction.reduced_static import pilot_compliance, static_coordinates
from tests.fe.matrices.written_formats import abaqus_coordinates, abaqus_input, harwell_boeing
from tests.independent_codes.calculix import needs_calculix
from tests.reduction.small_bar import bar

CSUPER = Path(pyyeti.__file__).parent / "tests" / "nas2cam_csuper"
HEADER = 'format = "carrierflex-interfaces"\nversion = 1\nname = "bar"\n'
ENDS = """
[[pilots]]
name = "start"
type = "distributing"
node_set = "start"
point = [0.0, 0.015, 0.025]
[[pilots]]
name = "end"
type = "distributing"
node_set = "end"
[[sensors]]
name = "tip"
nodes = [1]
direction = [0.0, 0.0, 2.0]
"""


def interfaces(folder, text, name="interfaces.toml"):
    path = folder / name
    path.write_text(HEADER + text)
    return path


def reduced(body, n_modes=6):
    return craig_bampton(body.structure, n_modes, body=sound_grounding(body))


def unmet(body, reduction, cut_off=None):
    """Checks of the certificate that are not met."""
    return [
        check
        for check in certify(body.structure, reduction, cut_off_hz=cut_off).checks
        if not check.met
    ]


def bodies_difference(first, second):
    """Largest relative difference of frequencies, pilot stiffness and frequency responses."""
    a, b = reduced(first), reduced(second)
    m = 6 * len(a.model.pilots)
    scale = np.sqrt(np.outer(*2 * [a.model.K.diagonal()[:m]]))
    figures = [
        np.abs(a.modes.omega / b.modes.omega - 1.0).max(),
        (np.abs(a.model.K - b.model.K)[:m, :m] / scale).max(),
    ]
    responses = [full_response(body.structure, r) for body, r in ((first, a), (second, b))]
    for share in (0.1, 0.5, 0.9):
        omega = share * float(a.modes.omega[2])
        (H, Y), (H_other, Y_other) = (r.at(omega, 6, with_rest=True) for r in responses)
        W = np.sqrt(a.model.K.diagonal()[:m])
        figures.append(
            np.abs((H - H_other) * np.outer(W, W)).max() / np.abs(H * np.outer(W, W)).max()
        )
        figures.append(np.abs((Y - Y_other) * W).max() / np.abs(Y * W).max())
    return max(figures)


@pytest.fixture(scope="module")
def printed(calculix_job):
    """Stiffness and mass as CalculiX prints them, rows in the order of the nodes."""
    return tuple(read_matrix(calculix_job / f"job.{s}", "stiffness").A for s in ("sti", "mas"))


@pytest.fixture(scope="module")
def by_calculix(calculix_job):
    path = interfaces(calculix_job, f'[nodes]\nfile = "mesh.inp"\n{ENDS}')
    return given_body(calculix_job / "job.sti", calculix_job / "job.mas", path)


def _op4(folder, K, M, form):
    for name, A in (("k", K), ("m", M)):
        op4.write(str(folder / f"{name}.op4"), {f"{name}aa": A.toarray()}, sparse=form)
    return "k.op4", "m.op4"


def _dmig(folder, K, M):
    index = [(node + 1, c) for node in range(K.shape[0] // 3) for c in (1, 2, 3)]
    import pandas as pd

    names = pd.MultiIndex.from_tuples(index, names=["id", "dof"])
    for name, A in (("k", K), ("m", M)):
        frame = pd.DataFrame(A.toarray(), index=names, columns=names)
        bulk.wtdmig(str(folder / f"{name}.pch"), {f"{name.upper()}AAX": frame})
    return "k.pch", "m.pch"


def _written(folder, form, K, M):
    if form in ("dense", "bigmat", "nonbigmat"):
        return _op4(folder, K, M, form)
    if form == "dmig":
        return _dmig(folder, K, M)
    for name, A in (("k", K), ("m", M)):
        if form == "npz":
            sp.save_npz(folder / f"{name}.npz", A)
        elif form == "rsa":
            harwell_boeing(folder / f"{name}.rsa", A, 17)
        elif form == "mm":
            scipy.io.mmwrite(folder / f"{name}.mm.mtx", sp.coo_matrix(A), precision=17)
            (folder / f"{name}.mm.mtx").rename(folder / f"{name}.mm")
        else:
            write = abaqus_input if form == "abaqus" else lambda p, A, n: abaqus_coordinates(p, A)
            write(folder / f"{name}.{form}.mtx", A, 3)
    suffix = {"abaqus": "abaqus.mtx", "coordinates": "coordinates.mtx"}.get(form, form)
    return f"k.{suffix}", f"m.{suffix}"


@needs_calculix
@pytest.mark.parametrize(
    "form", ["npz", "dense", "bigmat", "nonbigmat", "dmig", "rsa", "mm", "abaqus", "coordinates"]
)
def test_the_body_is_the_same_by_every_format(form, calculix_job, printed, by_calculix, tmp_path):
    K, M = printed
    files = _written(tmp_path, form, K, M)
    mesh = calculix_job / "mesh.inp"
    path = interfaces(tmp_path, f'[nodes]\nfile = "{mesh}"\n{ENDS}')
    body = given_body(*(tmp_path / name for name in files), path)
    if form == "dmig":
        # Ten digits: compared with the equally rounded matrices.
        text = {name: (tmp_path / name).read_text() for name in files}
        assert "D+" in text[files[0]]
        rounded = [_to_ten_digits(A) for A in (K, M)]
        for name, A in zip(("k.npz", "m.npz"), rounded, strict=True):
            sp.save_npz(tmp_path / name, A)
        by_calculix = given_body(tmp_path / "k.npz", tmp_path / "m.npz", path)
    assert bodies_difference(body, by_calculix) < 1e-10


def _to_ten_digits(A):
    rounded = A.copy()
    rounded.data = np.array([float(f"{value:.9e}") for value in A.data])
    return rounded


@needs_calculix
def test_the_body_is_that_of_our_own_couplings_on_the_same_matrices(by_calculix, steel_bar):
    K, M = by_calculix.structure.K, by_calculix.structure.M
    pilots = bar((3, 1, 1)).pilots
    points = [np.array([x, 0.015, 0.025]) for x in (0.0, 0.3)]
    given = [type(p)(n, x, p.G) for p, n, x in zip(pilots, ("start", "end"), points, strict=True)]
    ours = with_equal_node_weights(
        StructuralModel("bar", K, M, steel_bar.points, tuple(given)), steel_bar
    )
    a, b = craig_bampton(ours, 6), reduced(by_calculix)
    assert_allclose(b.model.K, a.model.K, rtol=1e-9, atol=1e-9 * np.abs(a.model.K).max())
    assert_allclose(b.model.ffrf.P, a.model.ffrf.P, atol=1e-9 * np.abs(a.model.ffrf.P).max())
    assert not unmet(by_calculix, b, 1000.0)
    assert not by_calculix.warnings


@needs_calculix
def test_rigid_pilots_are_those_of_our_own(calculix_job, by_calculix, steel_bar):
    text = ENDS.replace("distributing", "rigid")
    path = interfaces(calculix_job, f'[nodes]\nfile = "mesh.inp"\n{text}', "rigid.toml")
    body = given_body(calculix_job / "job.sti", calculix_job / "job.mas", path)
    structure = by_calculix.structure
    ours = rigidly_coupled(
        StructuralModel("bar", structure.K, structure.M, steel_bar.points, structure.pilots),
        steel_bar,
    )
    a, b = craig_bampton(ours, 6), reduced(body)
    m = 12
    assert_allclose(b.modes.omega, a.modes.omega, rtol=1e-9)
    size = np.sqrt(np.outer(*2 * [a.model.K.diagonal()[:m]]))
    # Two factorisations, of the plain and of the scaled matrix, whose condition is 1e7.
    assert (np.abs(b.model.K - a.model.K)[:m, :m] / size).max() < 1e-8
    assert_allclose(b.model.ffrf.J, a.model.ffrf.J, rtol=1e-9, atol=1e-12)
    assert not unmet(body, b, 1000.0)


@needs_calculix
@pytest.mark.parametrize(("length", "force"), [(1e-3, 1.0), (0.0254, 4.4482216152605)])
def test_units_change_no_body(length, force, printed, calculix_job, by_calculix, tmp_path):
    K, M = printed
    energy = force * length
    for name, A in (("k", K), ("m", M)):
        sp.save_npz(tmp_path / f"{name}.npz", A * (length**2 / energy))
    nodes = [
        [number + 1, *(point / length)] for number, point in enumerate(by_calculix.structure.points)
    ]
    members = {
        end: np.flatnonzero(np.abs(by_calculix.structure.points[:, 0] - x) < 1e-9) + 1
        for end, x in (("start", 0.0), ("end", 0.3))
    }
    text = ENDS.replace("[0.0, 0.015, 0.025]", str([0.0, 0.015 / length, 0.025 / length]))
    for end, numbers in members.items():
        text = text.replace(f'node_set = "{end}"', f"nodes = {numbers.tolist()}")
    units = f"[units]\nlength = {length}\nforce = {force}\n"
    listed = [[int(n), *map(float, p)] for n, *p in nodes]
    path = interfaces(tmp_path, f"{units}[nodes]\npositions = {listed}\n{text}")
    body = given_body(tmp_path / "k.npz", tmp_path / "m.npz", path)
    assert bodies_difference(body, by_calculix) < 1e-9
    wrong = interfaces(tmp_path, f"[nodes]\npositions = {listed}\n{text}", "wrong.toml")
    warned = given_body(tmp_path / "k.npz", tmp_path / "m.npz", wrong).warnings
    assert any("check the table [units]" in warning for warning in warned)


# Published examples


def small_files(folder, K, M, text):
    for name, A in (("k", K), ("m", M)):
        sp.save_npz(folder / f"{name}.npz", sp.csr_array(A))
    return given_body(folder / "k.npz", folder / "m.npz", interfaces(folder, text))


CHAIN_K = np.diag([2.0, 2, 2, 1]) - np.eye(4, k=1) - np.eye(4, k=-1)
CHAIN_M = np.diag([2.0, 2, 2, 1])
CHAIN = """[nodes]
positions = [[1, 0, 0, 0], [2, 1, 0, 0], [3, 2, 0, 0], [4, 3, 0, 0]]
dofs_per_node = 1
[[pilots]]
name = "end"
type = "nodes"
nodes = [4]
"""


def test_the_four_degrees_of_freedom_of_juliafem(tmp_path):
    # README of JuliaFEM/ModelReduction.jl (MIT): Mred [2.75 -1.20711; -1.20711 1],
    # Kred [0.25 0; 0 0.292893], the mode's sign being free.
    body = small_files(tmp_path, CHAIN_K, CHAIN_M, CHAIN)
    reduction = reduced(body, 1)
    assert_allclose(np.abs(reduction.model.M), [[2.75, 1.20711], [1.20711, 1.0]], atol=5e-6)
    assert_allclose(reduction.model.K, [[0.25, 0.0], [0.0, 0.292893]], atol=5e-7)
    assert reduction.model.labels[0] == "end Tx [m]"
    assert not unmet(body, reduction)
    assert reduced(body, 3).model.n_coordinates == 4
    with pytest.raises(ValueError, match="expected at most 3"):
        reduced(body, 4)


@pytest.mark.long
def test_the_fixed_base_frequencies_of_nx_nastran_are_reproduced(tmp_path):
    # inboard.asm, .op4: NX Nastran 9, in the wheel of pyyeti 1.4.7; grid 11 has directions of its
    # own. Printed by its cbcheck: 6.12935, 6.13013, 23.63188 Hz; mass 1.7551 lbf s^2/in.
    path = interfaces(
        tmp_path,
        f'[units]\nlength = 0.0254\nforce = 4.4482216152605\n[nodes]\nfile = "{CSUPER}/inboard.asm"'
        '\n[[pilots]]\nname = "grid"\ntype = "nodes"\nnodes = [3, 11, 19, 27]\n',
    )
    body = given_body(CSUPER / "inboard_mk.op4", CSUPER / "inboard_mk.op4", path)
    reduction = reduced(body, 8)
    hz = reduction.modes.omega / (2.0 * np.pi)
    assert_allclose(hz[:3], [6.12935, 6.13013, 23.63188], atol=5e-6)
    assert list(reduction.model.pilots) == ["grid_3", "grid_11", "grid_19", "grid_27"]
    assert not unmet(body, reduction)


def test_the_printed_frequencies_of_a_superelement_with_modal_coordinates(tmp_path):
    # Superelement 101 of nas2cam.op2, .op4 in the same wheel: 24 boundary and 22 modal degrees of
    # freedom, zero rows among them; printed by cbcheck: free 1.761979, 1.794351, 3.870072, 4.192421
    # Hz, fixed base 1.650, 1.650, 1.674, 1.675 Hz.
    model = op2.rdnas2cam(str(CSUPER / "nas2cam"))
    uset = model["uset"][101]
    at_boundary = n2p.mksetpv(uset, "a", "b")
    grids = [3, 11, 19, 27]
    rows = [[90_001 + i, "S"] for i in range(len(at_boundary))]
    T = np.eye(len(rows))
    for first, grid in zip(np.flatnonzero(at_boundary)[::6], grids, strict=True):
        axes = uset.loc[[(grid, dof) for dof in (4, 5, 6)], "x":"z"].to_numpy(dtype=float)
        for i, name in enumerate(("Tx", "Ty", "Tz", "Rx", "Ry", "Rz")):
            rows[first + i] = [grid, name]
        for three in (first, first + 3):
            T[three : three + 3, three : three + 3] = axes
    K, M = (T @ model[name][101] @ T.T for name in ("kaa", "maa"))
    positions = [[g, *map(float, uset.loc[(g, 1), "x":"z"])] for g in grids]
    text = f"[nodes]\npositions = {positions}\ndofs = {rows}\n"
    text += f'[[pilots]]\nname = "grid"\ntype = "nodes"\nnodes = {grids}\n'
    body = small_files(tmp_path, K, M, text.replace("'", '"'))
    reduction = reduced(body, 22)
    fixed = reduction.modes.omega[:4] / (2.0 * np.pi)
    assert_allclose(fixed, [1.650, 1.650, 1.674, 1.675], atol=6e-4)
    free = np.sqrt(dense_modes(reduction.model.K, reduction.model.M)[0][6:10]) / (2.0 * np.pi)
    assert_allclose(free, [1.761979, 1.794351, 3.870072, 4.192421], atol=6e-7)


# Pilots of fewer components, held bodies, nodes with rotations

BOUNDARY = """
[[pilots]]
name = "a"
type = "nodes"
nodes = [NA]
[[pilots]]
name = "b"
type = "nodes"
nodes = [NB]
components = ["Ty", "Tz"]
[[pilots]]
name = "c"
type = "nodes"
nodes = [NC]
"""


@pytest.fixture
def eight(printed, steel_bar, tmp_path):
    """Body with the boundary of MYSTRAN's CB-EXAMPLE-12: 123 at two grids, 23 at one."""
    points = steel_bar.points
    chosen = [
        int(np.flatnonzero(np.abs(points - position).max(axis=1) < 1e-9)[0]) + 1
        for position in ([0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.0, 0.03, 0.05])
    ]
    text = BOUNDARY
    for mark, number in zip(("NA", "NB", "NC"), chosen, strict=True):
        text = text.replace(mark, str(number))
    listed = [[i + 1, *map(float, p)] for i, p in enumerate(points)]
    K, M = printed
    return small_files(tmp_path, K, M, f"[nodes]\npositions = {listed}\n{text}")


@needs_calculix
def test_a_boundary_of_eight_degrees_of_freedom_reduces_and_is_certified(eight):
    reduction = reduced(eight, 8)
    model = reduction.model
    assert model.components_of("b") == (1, 2)
    assert [len(rows) for rows in model.pilot_coordinates.values()] == [3, 2, 3]
    assert model.labels[:5] == ("a Tx [m]", "a Ty [m]", "a Tz [m]", "b Ty [m]", "b Tz [m]")
    assert not unmet(eight, reduction, 500.0)
    # Eight boundary coordinates and six rigid motions: two ways to strain it.
    stiffness = np.linalg.eigvalsh(model.K[:8, :8])
    assert np.count_nonzero(stiffness > 1e-9 * stiffness[-1]) == 2
    with pytest.raises(ValueError, match=r"pilot 'b' has Ty .m., Tz .m. only; expected all six"):
        model.coordinates_of("b")


@needs_calculix
def test_fewer_components_come_back_from_the_file_and_from_nastran(eight, tmp_path):
    model = reduced(eight, 8).model
    write_body(model, tmp_path / "a.h5")
    again = read_body(tmp_path / "a.h5")
    assert again.pilot_components == {"a": (0, 1, 2), "b": (1, 2), "c": (0, 1, 2)}
    assert_allclose(again.K, model.K)
    write_op4(model, tmp_path / "a.op4")
    uset, _, b_set = bulk.asm2uset(str(tmp_path / "a.asm"))
    names = [(node, dof) for node, dof in uset.index.tolist() if node < 1000]
    assert names == [(1, 1), (1, 2), (1, 3), (2, 2), (2, 3), (3, 1), (3, 2), (3, 3)]
    assert np.count_nonzero(b_set) == 8
    write_dmig(model, tmp_path / "a.pch")
    frame = bulk.rddmig(str(tmp_path / "a.pch"))["kaax"]
    assert [name for name in frame.index.tolist() if name[0] < 1000] == names
    with pytest.raises(ValueError, match="expected all six"):
        write_sid(model, tmp_path / "a.SID_FEM")


@needs_calculix
def test_a_body_held_to_the_ground_has_no_free_motions(printed, steel_bar, tmp_path):
    # As CalculiX and others write it where a boundary condition holds a face: without its rows.
    K, M = printed
    points = steel_bar.points
    rows = np.repeat(points[:, 0] > 1e-9, 3)
    tip = np.flatnonzero(np.abs(points[:, 0] - 0.3) < 1e-9) + 1
    listed = [[i + 1, *map(float, p)] for i, p in enumerate(points) if p[0] > 1e-9]
    text = f"[nodes]\npositions = {listed}\n" + (
        f'[[pilots]]\nname = "tip"\ntype = "distributing"\nnodes = {tip.tolist()}\n'
    )
    body = small_files(tmp_path, K[rows][:, rows], M[rows][:, rows], text)
    assert body.structure.free_motions.shape == (6, 0)
    assert "0 of six rigid motions are free" in body.warnings[0]
    reduction = reduced(body, 12)
    assert not unmet(body, reduction, 1000.0)
    # A cantilever under a force at its tip, by Bernoulli and Timoshenko with the wide side's
    # inertia; the coarse mesh is stiffer, the held end's lateral contraction too.
    force = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    q = static_coordinates(reduction.model, [], {"tip": force})
    inertia, area = 0.03 * 0.05**3 / 12.0, 0.03 * 0.05
    G = STEEL.E / (2.0 * (1.0 + STEEL.nu))
    expected = 0.3**3 / (3.0 * STEEL.E * inertia) + 0.3 / (5.0 / 6.0 * G * area)
    assert_allclose(q[2], expected, rtol=0.1)
    structure = body.structure
    G = structure.pilots[0].G.toarray()
    assert_allclose(q[2], G[2] @ np.linalg.solve(structure.K.toarray(), G[2]), rtol=1e-8)
    assert reduction.model.ffrf is None


def frame_matrices():
    """Two beams of equal section in a right angle, nodes with all six components; lumped masses."""
    E = 2.1e11
    G = 8e10
    A = 1e-3
    I_b = 1e-7
    J = 2e-7
    length = 0.5
    a = E * A / length
    t = G * J / length
    b = E * I_b / length**3
    one = np.zeros((12, 12))
    for i, k in ((0, a), (3, t)):
        one[np.ix_([i, i + 6], [i, i + 6])] = k * np.array([[1, -1], [-1, 1]])
    bending = b * np.array(
        [
            [12, 6 * length, -12, 6 * length],
            [6 * length, 4 * length**2, -6 * length, 2 * length**2],
            [-12, -6 * length, 12, -6 * length],
            [6 * length, 2 * length**2, -6 * length, 4 * length**2],
        ]
    )
    one[np.ix_([1, 5, 7, 11], [1, 5, 7, 11])] = bending
    signs = np.outer([1, -1, 1, -1], [1, -1, 1, -1])
    one[np.ix_([2, 4, 8, 10], [2, 4, 8, 10])] = bending * signs
    turn = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    T = np.kron(np.eye(4), turn)
    K = np.zeros((18, 18))
    K[:12, :12] += one
    K[6:, 6:] += T.T @ one @ T
    M = np.kron(np.diag([2.0, 3.0, 1.5]), np.diag([1, 1, 1, 0.0, 0.0, 0.0]))
    M[3:6, 3:6] = 0.01 * np.eye(3)
    return K, M


FRAME = """[nodes]
positions = [[1, 0, 0, 0], [2, 0.5, 0, 0], [3, 0.5, 0.5, 0]]
[[pilots]]
name = "foot"
type = "nodes"
nodes = [1]
[[pilots]]
name = "tip"
type = "nodes"
nodes = [3]
components = ["Tx", "Ty", "Tz"]
"""


def test_nodes_with_rotations_and_without_inertia_reduce(tmp_path):
    K, M = frame_matrices()
    body = small_files(tmp_path, K, M, FRAME)
    assert body.structure.free_motions.shape == (6, 6)
    reduction = reduced(body, 3)
    assert not unmet(body, reduction)
    # The tip under a force across both legs, the foot held: bending of both, torsion of the first.
    compliance = pilot_compliance(reduction.model, ["foot"])[2, 2]
    E = 2.1e11
    G = 8e10
    I_b = 1e-7
    J = 2e-7
    length = 0.5
    expected = 2 * length**3 / (3 * E * I_b) + length**3 / (G * J)
    assert_allclose(compliance, expected, rtol=1e-10)


def test_lists_of_entries_end_with_the_last_row_that_is_not_empty(tmp_path):
    """Rotations of node 3 without inertia: the list of the mass ends three rows early."""
    K, M = frame_matrices()
    M[15:] = M[:, 15:] = 0.0
    for name, A in (("k", K), ("m", M)):
        entries = sp.coo_array(A)
        lines = zip(*entries.coords, entries.data, strict=True)
        text = "".join(f"{i + 1} {j + 1} {float(value)!r}\n" for i, j, value in lines)
        (tmp_path / f"{name}.sti").write_text(text)
    path = interfaces(tmp_path, FRAME)
    body = given_body(tmp_path / "k.sti", tmp_path / "m.sti", path)
    assert_array_equal(
        body.structure.M.toarray(), small_files(tmp_path, K, M, FRAME).structure.M.toarray()
    )


@pytest.mark.long
def test_directions_of_nodes_are_turned_to_those_of_the_model(tmp_path):
    K, M = frame_matrices()
    axes = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    T = np.eye(18)
    for first in (12, 15):
        T[first : first + 3, first : first + 3] = axes
    for name, A in (("k", K), ("m", M)):
        sp.save_npz(tmp_path / f"{name}.npz", sp.csr_array(T.T @ A @ T))
    (tmp_path / "n.bdf").write_text(
        "CORD2R,10,,0.,0.,0.,1.,0.,0.\n,0.,1.,0.\n"
        "GRID,1,,0.,0.,0.\nGRID,2,,0.5,0.,0.\nGRID,3,,0.5,0.5,0.,10\n"
    )
    text = FRAME.replace(FRAME.splitlines()[1], 'file = "n.bdf"')
    turned = given_body(tmp_path / "k.npz", tmp_path / "m.npz", interfaces(tmp_path, text))
    straight = small_files(tmp_path, K, M, FRAME)
    assert_allclose(turned.structure.K.toarray(), straight.structure.K.toarray(), atol=1e-4)
    assert_allclose(reduced(turned, 3).modes.omega, reduced(straight, 3).modes.omega, rtol=1e-9)


# Refusals


def refused(folder, K, M, text, message):
    with pytest.raises(ValueError, match=message) as caught:
        sound_grounding(small_files(folder, K, M, text))
    assert "\n" not in str(caught.value)


def test_matrices_that_make_no_body_are_refused_in_one_line(tmp_path):
    K, M = frame_matrices()
    unsymmetric = K.copy()
    unsymmetric[0, 6] *= 1.1
    refused(tmp_path, unsymmetric, M, FRAME, "not symmetric: .* at node 1 Tx, node 2 Tx")
    refused(tmp_path, K, M[:12, :12], FRAME, "stiffness has 18 rows, the mass 12")
    refused(tmp_path, K, 0.0 * M, FRAME, "no positive mass")
    refused(tmp_path, M, K, FRAME, "are stiffness and mass interchanged")
    refused(tmp_path, K[:17, :17], M[:17, :17], FRAME, "17 rows without names, the model 3 nodes")
    loose = K.copy()
    loose[17] = loose[:, 17] = 0.0
    with_inertia = M.copy()
    with_inertia[17, 17] = 1.0
    refused(tmp_path, loose, with_inertia, FRAME, "no stiffness but mass .*node 3 Rz")
    apart = np.kron(np.eye(2), K)
    both = FRAME.replace(
        "0.5, 0.5, 0]]", "0.5, 0.5, 0], [4, 9, 0, 0], [5, 9.5, 0, 0], [6, 9.5, 1, 0]]"
    )
    refused(
        tmp_path, apart, np.kron(np.eye(2), M), both, "2 parts that nothing connects; .* 3 nodes"
    )
    unknown = FRAME.replace("nodes = [3]", "nodes = [7]")
    refused(tmp_path, K, M, unknown, "node 7 is none of the model")
    lone = FRAME.split("[[pilots]]")
    refused(tmp_path, K, M, lone[0] + "[[pilots]]" + lone[2], "still moves freely in 3 ways")
    doubled = FRAME.replace('"tip"', '"toe"').replace("nodes = [3]", "nodes = [1]")
    refused(tmp_path, K, M, doubled, "cannot move independently")


def test_a_mechanism_is_refused_with_the_nodes_that_move(tmp_path):
    # Legs joined by a hinge about z: each turns about node 2 without strain.
    _, M = frame_matrices()
    M = np.diag(np.r_[np.diag(M), 0.01])
    refused(tmp_path, hinged_frame(), M, HINGED, r"a mechanism: \d nodes .* most of all node \d Rz")


def hinged_frame():
    """The frame with a rotation about z of its own, node 4, for the second leg's end at node 2."""
    K, _ = frame_matrices()
    # Node 2's own block of the second leg: rigid motions of the leg meet no force.
    motion = np.eye(6)
    motion[0, 5], motion[2, 3] = -0.5, 0.5
    second = np.zeros((12, 12))
    second[:6, 6:] = K[6:12, 12:]
    second[6:, :6] = K[12:, 6:12]
    second[6:, 6:] = K[12:, 12:]
    second[:6, :6] = -K[6:12, 12:] @ motion
    K_hinged = np.zeros((19, 19))
    K_hinged[:18, :18] = K
    K_hinged[6:18, 6:18] -= second
    rows = [6, 7, 8, 9, 10, 18, *range(12, 18)]
    K_hinged[np.ix_(rows, rows)] += second
    return K_hinged


HINGED = FRAME.replace(
    "[[pilots]]",
    "dofs = ["
    + ", ".join(f'[{n}, "{c}"]' for n in (1, 2, 3) for c in ("Tx", "Ty", "Tz", "Rx", "Ry", "Rz"))
    + ', [4, "Rz"]]\n[[pilots]]',
    1,
).replace("[3, 0.5, 0.5, 0]]", "[3, 0.5, 0.5, 0], [4, 0.5, 0, 0]]")


def lumped_frame(tmp_path, ends="[1, 9]"):
    """An L of eight beam elements, masses of its nodes alone, a pilot at either end."""
    points = [[i / 4.0, 0.0, 0.0] for i in range(5)] + [[1.0, i / 4.0, 0.0] for i in range(1, 5)]
    K, M = np.zeros((54, 54)), np.zeros(54)
    for i in range(8):
        a, b = np.array(points[i]), np.array(points[i + 1])
        length = float(np.linalg.norm(b - a))
        local = beam_stiffness(length)
        x = (b - a) / length
        axes = np.array([x, np.cross([0.0, 0.0, 1.0], x), [0.0, 0.0, 1.0]])
        T = np.kron(np.eye(4), axes)
        rows = np.arange(6 * i, 6 * i + 12)
        K[np.ix_(rows, rows)] += T.T @ local @ T
        for node in (i, i + 1):
            M[6 * node : 6 * node + 3] += 7800.0 * 4e-4 * length / 2.0
    listed = [[n, *point] for n, point in enumerate(points, 1)]
    text = f"[nodes]\npositions = {listed}\ndofs_per_node = 6\n"
    text += f'[[pilots]]\nname = "end"\ntype = "nodes"\nnodes = {ends}\n'
    return small_files(tmp_path, K, np.diag(M), text)


def beam_stiffness(length, E=2.1e11, G=8.0e10, side=0.02):
    """Euler-Bernoulli beam of square section, twelve coordinates."""
    A, I_yy = side**2, side**4 / 12.0
    K = np.zeros((12, 12))
    for i, value in ((0, E * A / length), (3, G * 2.0 * I_yy / length)):
        K[np.ix_([i, i + 6], [i, i + 6])] = value * np.array([[1.0, -1.0], [-1.0, 1.0]])
    L = length
    bend = np.array(
        [[12.0, 6 * L, -12.0, 6 * L], [6 * L, 4 * L**2, -6 * L, 2 * L**2],
         [-12.0, -6 * L, 12.0, -6 * L], [6 * L, 2 * L**2, -6 * L, 4 * L**2]]
    ) * E * I_yy / L**3  # fmt: skip
    for rows, sign in (([1, 5, 7, 11], 1.0), ([2, 4, 8, 10], -1.0)):
        S = np.diag([1.0, sign, 1.0, sign])
        K[np.ix_(rows, rows)] += S @ bend @ S
    return K


@pytest.mark.parametrize("rule", [21, Below(1e4), Below(800.0)])
def test_a_body_of_lumped_masses_keeps_all_its_modes_and_is_written(rule, tmp_path):
    body = lumped_frame(tmp_path)
    reduction = craig_bampton(body.structure, rule, body=sound_grounding(body))
    n = 21 if rule == 21 or rule.frequency_hz > 7e3 else len(reduction.modes.omega)
    assert len(reduction.modes.omega) == n
    # Masses alone: the flexibility of the held nodes against the dense solution.
    inner = np.arange(6, 48)
    K, m = body.structure.K.toarray()[np.ix_(inner, inner)], body.structure.M.diagonal()[inner]
    root = np.sqrt(m[m > 0])
    flexible = np.linalg.inv(K)[np.ix_(m > 0, m > 0)] * np.outer(root, root)
    exact = 1.0 / np.sqrt(np.linalg.eigvalsh(flexible)[::-1])
    assert len(exact) == 21
    assert_allclose(reduction.modes.omega, exact[:n], rtol=1e-8)
    write_body(reduction.model, tmp_path / "frame.h5")
    assert_allclose(read_body(tmp_path / "frame.h5").K, reduction.model.K)
    assert not unmet(body, reduction)


def test_more_modes_than_masses_are_refused_in_words(tmp_path):
    with pytest.raises(ValueError, match="expected at most 21 for this body, which has no more mo"):
        reduced(lumped_frame(tmp_path), 22)


@pytest.mark.long
def test_a_superelement_with_a_pilot_of_three_components_comes_back(tmp_path):
    body = lumped_frame(tmp_path)
    first, second = body.structure.pilots
    three = replace(second, G=second.G[:3], components=(0, 1, 2))
    structure = replace(body.structure, pilots=(first, three))
    model = craig_bampton(structure, 4, body=sound_grounding(body)).model
    write_op4(model, tmp_path / "a.op4")
    text = '[nodes]\nfile = "a.asm"\n[[pilots]]\nname = "a"\ntype = "nodes"\nnodes = [1, 2]\n'
    back = given_body(tmp_path / "a.op4", tmp_path / "a.op4", interfaces(tmp_path, text, "b.toml"))
    assert back.structure.K.shape == model.K.shape == (13, 13)
    assert_allclose(back.structure.K.toarray(), model.K, atol=1e-12 * np.abs(model.K).max())
    assert_allclose(back.structure.M.toarray(), model.M, atol=1e-12 * np.abs(model.M).max())
    assert [pilot.components for pilot in back.structure.pilots] == [tuple(range(6)), (0, 1, 2)]


@pytest.mark.parametrize("n_modes", [1, 4, 10])
def test_free_modes_beside_one_pilot_leave_it_without_stiffness(n_modes, tmp_path):
    body = lumped_frame(tmp_path, ends="[9]")
    free = free_interface_reduction(body.structure, n_modes, body=sound_grounding(body))
    assert_array_equal(free.model.K[:6], 0.0)
    K, M = body.structure.K.toarray(), body.structure.M.diagonal()
    root = np.sqrt(M[M > 0])
    inner = M > 0
    Kc = K[inner][:, inner] - K[inner][:, ~inner] @ np.linalg.solve(
        K[~inner][:, ~inner], K[~inner][:, inner]
    )
    exact = np.sqrt(np.linalg.eigvalsh(Kc / np.outer(root, root))[6 : 6 + n_modes])
    assert_allclose(free.modes.omega[:n_modes], exact, rtol=1e-8)
    write_body(free.model, tmp_path / "free.h5")
    read_body(tmp_path / "free.h5")


@pytest.mark.long
@pytest.mark.parametrize("n_modes", [0, 4, 10])
def test_a_free_body_with_one_pilot_has_a_certificate(n_modes, tmp_path):
    body = lumped_frame(tmp_path, ends="[9]")
    reduction = reduced(body, n_modes)
    checks = certify(body.structure, reduction).checks
    assert all(np.isfinite(check.reached) for check in checks)
    assert {check.name: check.met for check in checks}["grounding over own stiffness"]
    write_body(reduction.model, tmp_path / "one.h5", certify(body.structure, reduction))
    read_body(tmp_path / "one.h5")
    # No row of its pilot has a stiffness: all six motions are free in what comes back as well.
    write_op4(reduction.model, tmp_path / "one.op4")
    assert read_any_body(tmp_path / "one.op4").model.n_free_motions == 6
