"""Bodies of other programs: what they wrote, what their words mean, and what this program wrote."""

import io
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import pyyeti
import scipy.linalg
from numpy.testing import assert_allclose
from pyyeti import nastran
from pyyeti.nastran import bulk, op4

from carrierflex.fe.matrices.given_structure import given_body
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.exports.dmig_files import write_dmig
from carrierflex.reduction.exports.exudyn_files import write_exudyn
from carrierflex.reduction.exports.op4_files import write_op4
from carrierflex.reduction.exports.sid_files import write_sid
from carrierflex.reduction.exports.simscape_files import write_simscape
from carrierflex.reduction.imports.conversion_checks import conversion_checks
from carrierflex.reduction.imports.foreign_bodies import read_any_body
from carrierflex.reduction.rigid_body_checks import grounding
from tests.reduction.imports import sid_sample
from tests.reduction.small_bar import bar

NASTRAN = Path(pyyeti.__file__).parent / "tests"


@pytest.fixture(scope="module")
def structure():
    return bar((3, 1, 1), offset=0.1)


@pytest.fixture(scope="module")
def reduction(structure):
    return craig_bampton(structure, 3)


@pytest.fixture(scope="module")
def plate(tmp_path_factory):
    path = tmp_path_factory.mktemp("plate") / "plate.SID_FEM"
    path.write_text(sid_sample.sample())
    return read_any_body(path)


def same(imported, model, rtol):
    """Pilots, matrices (modes but for their sign) and mass of two bodies."""
    assert list(imported.pilots) == list(model.pilots)
    for name, point in model.pilots.items():
        assert_allclose(imported.pilots[name], point, atol=rtol)
    sign = np.ones(model.n_coordinates)
    modes = np.setdiff1d(np.arange(model.n_coordinates), model.pilot_rows)
    for row in modes:
        k = int(np.argmax(np.abs(model.M[row, model.pilot_rows])))
        sign[row] = np.sign(imported.M[row, k] * model.M[row, k])
    k, m = model.K.diagonal(), model.M.diagonal()
    for letter, diagonal in (("K", k), ("M", m), ("D", np.sqrt(k * m))):
        A, B = getattr(model, letter), getattr(imported, letter) * np.outer(sign, sign)
        difference = np.abs(A - B) / np.sqrt(np.outer(diagonal, diagonal))
        assert difference.max() < rtol, letter
    assert imported.mass_properties.mass == pytest.approx(model.mass_properties.mass, rel=rtol)
    assert_allclose(imported.mass_properties.centre, model.mass_properties.centre, atol=rtol)
    assert_allclose(
        imported.mass_properties.inertia,
        model.mass_properties.inertia,
        atol=rtol * np.abs(model.mass_properties.inertia).max(),
    )
    return sign


def test_standard_input_data_come_back_with_every_integral(tmp_path, reduction):
    for pilot in (None, "bar_end"):
        write_sid(reduction.model, tmp_path / "bar.SID_FEM", pilot=pilot)
        imported = read_any_body(tmp_path / "bar.SID_FEM")
        result, model = imported.model, reduction.model
        assert imported.losses == () == result.sensor_names
        assert result.name == "bar"
        sign = same(result, model, 1e-10)
        for name in ("first_moment", "second_moment", "N", "P", "Q"):
            expected, read = getattr(model.ffrf, name), getattr(result.ffrf, name)
            if name in ("N", "P"):
                read = read * sign
            if name == "Q":
                read = read * np.outer(sign, sign)
            assert_allclose(read, expected, atol=1e-10 * np.abs(expected).max(), err_msg=name)
        assert grounding(result) < 1e-10


def test_a_carrier_of_nine_pilots_comes_back_through_standard_input_data(
    tmp_path, flexible_reduction
):
    model = flexible_reduction.model
    write_sid(model, tmp_path / "carrier.SID_FEM")
    checks = conversion_checks(model, read_any_body(tmp_path / "carrier.SID_FEM").model)
    compared = {c.name: c.difference for c in checks if c.difference is not None}
    assert len([name for name in compared if name.startswith("frequency")]) == 7
    assert max(compared.values()) < 1e-10, compared


def test_the_public_plate_has_the_mass_and_the_frequencies_that_its_file_prints(plate):
    model = plate.model
    assert list(model.pilots) == ["node_1"]
    # Corners and a node: three modes are too few for six coordinates each.
    assert len(model.sensor_names) == 12
    assert "node_2, node_12, node_26, node_78" in plate.losses[0]
    assert "no inertia invariants" in plate.losses[-1]
    mass = model.mass_properties
    # By hand: m c = mdCM; Jxy = -2.95574 about the origin is -∫ρxy, of the plate -m/4 · 1 · 1.3.
    assert_allclose(mass.centre, [4.54426076880 / 9.0824, 5.90753809120 / 9.0824, 0.0], rtol=1e-12)
    c = mass.centre
    about_origin = mass.inertia + mass.mass * (c @ c * np.eye(3) - np.outer(c, c))
    assert about_origin[0, 1] == pytest.approx(-2.95574, rel=1e-12)
    assert about_origin[0, 1] == pytest.approx(-9.0824 / 4.0 * 1.3, rel=0.002)
    # Held by its four corners, it vibrates as the tool that wrote it says.
    corners = [*np.eye(9)[:3], *model.sensor_rows[:9]]
    Z = scipy.linalg.null_space(np.array(corners), rcond=1e-8)
    squares = scipy.linalg.eigh(Z.T @ model.K @ Z, Z.T @ model.M @ Z, eigvals_only=True)
    assert_allclose(np.sqrt(squares) / (2 * np.pi), sid_sample.FREQUENCIES_HZ, atol=1e-3)


def test_the_free_plate_is_that_of_its_integrals_put_together_by_hand(plate):
    m, f, n = sid_sample.MASS, sid_sample.FIRST_MOMENT, 9
    cross = np.array([[0, -f[2], f[1]], [f[2], 0, -f[0]], [-f[1], f[0], 0]])
    xx, yy, zz, xy, xz, yz = sid_sample.J
    J = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    M = np.zeros((n, n))
    M[:6, :6] = np.block([[m * np.eye(3), -cross], [cross, J]])
    M[6:, :6] = np.hstack([sid_sample.CT, sid_sample.CR])
    M[:6, 6:] = M[6:, :6].T
    M[6:, 6:] = np.eye(3)
    K = scipy.linalg.block_diag(np.zeros((6, 6)), sid_sample.KE)
    expected = scipy.linalg.eigh((K + K.T) / 2, M, eigvals_only=True)
    result = scipy.linalg.eigh(plate.model.K, plate.model.M, eigvals_only=True)
    assert_allclose(result[6:], expected[6:], rtol=1e-8)
    assert np.abs(result[:6]).max() < 1e-8 * result[6]


def test_a_body_of_exudyn_comes_back(tmp_path, structure, reduction):
    FEM = pytest.importorskip("exudyn.FEM")
    undamped = replace(reduction.model, D=np.zeros_like(reduction.model.D))
    write_exudyn(structure, reduction, tmp_path / "bar.hdf5")
    imported = read_any_body(tmp_path / "bar.hdf5")
    assert imported.losses == ("Exudyn's file holds no damping: the body has none",)
    same(imported.model, undamped, 1e-10)
    # Exudyn loads it and writes it again.
    fem = FEM.FEMinterface()
    fem.LoadFromFile(str(tmp_path / "bar.hdf5"))
    fem.SaveToFile(str(tmp_path / "again.hdf5"))
    same(read_any_body(tmp_path / "again.hdf5").model, undamped, 1e-10)


def test_a_basis_that_exudyn_computed_spans_the_body_it_has_there(tmp_path, structure, reduction):
    FEM = pytest.importorskip("exudyn.FEM")
    write_exudyn(structure, reduction, tmp_path / "bar.hdf5")
    fem = FEM.FEMinterface()
    fem.LoadFromFile(str(tmp_path / "bar.hdf5"))
    for entry in fem.nodeSets:
        for key in ("PilotPoint", "PilotNodes", "PilotCoupling"):
            del entry[key]
        used = np.array(entry["NodeWeights"]) > 1e-12
        for key in ("NodeNumbers", "NodeWeights"):
            entry[key] = np.array(entry[key])[used]
    fem.ComputeHurtyCraigBamptonModes(
        boundaryNodesList=[entry["NodeNumbers"] for entry in fem.nodeSets],
        boundaryNodesWeights=[entry["NodeWeights"] for entry in fem.nodeSets],
        nEigenModes=4,
        computationMode=FEM.HCBstaticModeSelection.RBE3,
        verboseMode=0,
    )
    fem.SaveToFile(str(tmp_path / "hcb.hdf5"))
    model = read_any_body(tmp_path / "hcb.hdf5").model
    assert list(model.pilots) == ["bar_start", "bar_end"]
    cms = FEM.ObjectFFRFreducedOrderInterface(fem)
    # In the frame, at rest, from Exudyn's own integrals.
    n = cms.massMatrixReduced.shape[0]
    M = np.zeros((6 + n, 6 + n))
    M[:3, :3], M[3:6, 3:6], M[6:, 6:] = cms.Mtt, cms.inertiaLocal, cms.massMatrixReduced
    M[:3, 3:6] = -cms.totalMass * cms.chiUtilde
    M[:3, 6:], M[3:6, 6:] = cms.mPhitTPsi, -cms.mXRefTildePsi
    M = np.triu(M) + np.triu(M, 1).T
    M[6:, 6:] = cms.massMatrixReduced
    K = scipy.linalg.block_diag(np.zeros((6, 6)), cms.stiffnessMatrixReduced)
    values = np.sort(np.real(scipy.linalg.eigvals(K, M)))
    result = scipy.linalg.eigh(model.K, model.M, eigvals_only=True)
    assert_allclose(np.sqrt(result[6:10]), np.sqrt(values[6:10]), rtol=1e-5)
    assert model.mass_properties.mass == pytest.approx(cms.totalMass, rel=1e-12)
    assert grounding(model) < 1e-7


@pytest.mark.parametrize(("suffix", "write", "rtol"), [
    ("op4", write_op4, 1e-13), ("mat", write_simscape, 1e-14), ("bdf", write_dmig, 3e-9)
])  # fmt: skip
def test_matrices_come_back(tmp_path, reduction, suffix, write, rtol):
    write(reduction.model, tmp_path / f"bar.{suffix}")
    imported = read_any_body(tmp_path / f"bar.{suffix}")
    same(imported.model, reduction.model, rtol)
    assert imported.model.labels == reduction.model.labels
    assert imported.model.ffrf is None
    assert "no inertia invariants" in imported.losses[0]


def test_places_of_grids_do_not_ground_the_body(tmp_path, reduction):
    # A third of a metre: eight decimals of a place would leave 1e-8 of the softest stiffness.
    shift = np.array([1.0 / 3.0, 2.0 / 3.0, -1.0 / 7.0])
    model = reduction.model
    moved = replace(model, pilots={name: p + shift for name, p in model.pilots.items()})
    write_op4(moved, tmp_path / "bar.op4")
    assert grounding(read_any_body(tmp_path / "bar.op4").model) < 1e-11


def test_places_that_no_body_has_are_of_the_files_beside_the_matrices_too(tmp_path, reduction):
    write_op4(reduction.model, tmp_path / "bar.op4")
    deck = tmp_path / "bar.asm"
    grid = re.search(r"(?m)^GRID\*.*?1(?: +)0 (\S+)", deck.read_text())
    text = deck.read_text()
    deck.write_text(text[: grid.start(1)] + "1e308".ljust(len(grid[1])) + text[grid.end(1) :])
    with pytest.raises(ValueError, match=r"bar\.op4, with bar\.asm and bar\.pch: its numbers make"):
        read_any_body(tmp_path / "bar.op4")


@pytest.mark.long
def test_a_superelement_of_nastran_has_the_modes_that_pyyeti_finds():
    path = NASTRAN / "nas2cam_csuper" / "inboard.op4"
    model = read_any_body(path).model
    assert list(model.pilots) == ["grid_3", "grid_11", "grid_19", "grid_27"]
    modes = np.setdiff1d(np.arange(32), model.pilot_rows)
    eigenvalues = scipy.linalg.eigh(
        model.K[np.ix_(modes, modes)], model.M[np.ix_(modes, modes)], eigvals_only=True
    )
    # As the run of Nastran prints them for this superelement.
    assert_allclose(np.sqrt(eigenvalues[:3]) / (2 * np.pi), [6.12935, 6.13013, 23.63188], rtol=2e-6)
    # Mass and centre by pyyeti, in the grids' own directions.
    uset, _ = nastran.bulk2uset(str(path.with_suffix(".asm")))
    stored = op4.OP4().load(str(path))
    rigid = nastran.rbgeom_uset(uset)
    M = rigid.T @ stored["mxx"][0][:24, :24] @ rigid
    assert model.mass_properties.mass == pytest.approx(M[0, 0], rel=1e-10)
    assert_allclose(model.mass_properties.centre, [M[1, 5], M[2, 3], M[0, 4]] / M[0, 0], atol=1e-6)


@pytest.mark.long
def test_units_of_a_file_scale_the_body(tmp_path, reduction):
    model = reduction.model
    in_mm = replace(
        model,
        K=model.K / 1e3, M=model.M / 1e3, D=model.D / 1e3,
        pilots={name: 1e3 * point for name, point in model.pilots.items()},
    )  # fmt: skip
    # Newtons and millimetres: N/mm, t; rotations N mm; the modes keep unit mass.
    s = np.ones(model.n_coordinates)
    for name in model.pilots:
        s[model.rows_of(name)[3:]] = 1e3
    s[np.setdiff1d(np.arange(len(s)), model.pilot_rows)] = np.sqrt(1e3)
    in_mm = replace(in_mm, **{x: getattr(in_mm, x) * np.outer(s, s) for x in "KMD"})
    write_simscape(in_mm, tmp_path / "bar.mat")
    same(read_any_body(tmp_path / "bar.mat", "mm-N").model, model, 1e-12)


LINKED = """GRID,901,,{a},0.,0.
GRID,902,,{b},0.,0.
RBE3,11,,901,123456,1.0,123,{start}
{other}
"""


def linked_deck(structure, path, other):
    """The bar's own matrices as DMIG by pyyeti, its nodes, and links at its ends."""
    n = len(structure.points)
    ids = [(node + 1, axis) for node in range(n) for axis in (1, 2, 3)]
    index = pd.MultiIndex.from_tuples(ids, names=["id", "dof"])
    cards = io.StringIO()
    bulk.wtgrids(cards, range(1, n + 1), 0, structure.points, 0, form="{:16.9E}")
    matrices = {"KAAX": structure.K, "MAAX": structure.M}
    bulk.wtdmig(cards, {k: pd.DataFrame(A.toarray(), index, index) for k, A in matrices.items()})
    x = structure.points[:, 0]
    ends = [np.flatnonzero(np.isclose(x, at)) + 1 for at in (x.min(), x.max())]
    start, end = (_continued(nodes) for nodes in ends)
    words = LINKED.format(a=x.min(), b=x.max(), start=start, other=other.format(end=end))
    path.write_text(cards.getvalue() + words)
    return ends


def _continued(nodes):
    """Numbers of nodes over lines of a card with commas."""
    words = [str(node) for node in nodes]
    return ",".join(words[:1]) + "".join(
        f"\n+,{','.join(words[i : i + 8])}" for i in range(1, len(words), 8)
    )


@pytest.mark.long
def test_reference_nodes_of_rbe3_are_pilots_and_nothing_is_lost(tmp_path, structure):
    linked_deck(structure, tmp_path / "bar.bdf", "RBE3,12,,902,123456,1.0,123,{end}")
    model = read_any_body(tmp_path / "bar.bdf").model
    assert list(model.pilots) == ["rbe3_11", "rbe3_12"]
    assert_allclose(model.pilots["rbe3_12"], [0.4, 0.0, 0.0])
    assert model.n_coordinates == structure.n_dofs
    K, M = structure.K.toarray(), structure.M.toarray()
    full = scipy.linalg.eigh(K, M, eigvals_only=True)
    result = scipy.linalg.eigh(model.K, model.M, eigvals_only=True)
    assert_allclose(result[6:20], full[6:20], rtol=1e-6)
    assert model.n_free_motions == 6
    # What ten digits of the nodes' stiffness leave of the pilots' softest one.
    assert grounding(model) < 1e-5


@pytest.mark.long
def test_links_are_the_pilots_of_an_interfaces_file(tmp_path, structure):
    ends = linked_deck(structure, tmp_path / "bar.bdf", "RBE2,12,902,123456,{end}")
    result = read_any_body(tmp_path / "bar.bdf").model
    head = 'format = "carrierflex-interfaces"\nversion = 1\nname = "bar"\n'
    nodes = '[nodes]\nfile = "bar.bdf"\n'
    tables = (
        f"[[pilots]]\nname = 'rbe3_11'\ntype = 'distributing'\nnodes = {ends[0].tolist()}\n"
        f"[[pilots]]\nname = 'rbe2_12'\ntype = 'rigid'\nnodes = {ends[1].tolist()}\n"
    )
    (tmp_path / "links.toml").write_text(head + "links = true\n" + nodes)
    (tmp_path / "tables.toml").write_text(head + nodes + tables)
    deck = tmp_path / "bar.bdf"
    linked, stated = (
        craig_bampton(given_body(deck, deck, tmp_path / f"{name}.toml").structure, 3).model
        for name in ("links", "tables")
    )
    assert list(linked.pilots) == ["rbe3_11", "rbe2_12"] == list(result.pilots)
    size = np.sqrt(np.outer(stated.K.diagonal()[:12], stated.K.diagonal()[:12]))
    for model in (linked, result):
        assert (np.abs(model.K[:12, :12] - stated.K[:12, :12]) / size).max() < 1e-5
