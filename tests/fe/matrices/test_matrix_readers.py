"""Readers of other programs' matrices: what is printed comes back bit for bit, damage is told.

Files of other programs: CalculiX (ccx 2.20 of Debian) writes .sti, .mas, .dof and .mtx here; NX and
MSC Nastran wrote the .op4 and .pch files of pyyeti's wheel; scipy writes MatrixMarket, npz and the
unsymmetric Harwell-Boeing file.
"""

import re
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest
import pyyeti
import scipy.io
import scipy.sparse as sp
from numpy.testing import assert_allclose
from pyyeti.nastran import bulk, op4

from carrierflex.diagnosis.carrier.watch.state_files import read_state
from carrierflex.fe.matrices import node_files, op4_input_files
from carrierflex.fe.matrices.dmig_input_files import read_dmig
from carrierflex.fe.matrices.matrix_files import read_matrix
from carrierflex.fe.matrices.nastran_links import linked_pilots
from carrierflex.fe.matrices.node_files import read_dofs, read_nodes
from carrierflex.fe.matrices.stored_matrix import precision_note
from tests.fe.matrices.written_formats import (
    abaqus_coordinates,
    abaqus_input,
    harwell_boeing,
)
from tests.forked_readers import read_in_forks
from tests.independent_codes.calculix import needs_calculix

NASTRAN = Path(pyyeti.__file__).parent / "tests"
OP4 = NASTRAN / "nastran_op4_data"
RNG = np.random.default_rng(3)


@pytest.fixture(autouse=True)
def in_forks(monkeypatch):
    """Files are read in forks."""
    read_in_forks(monkeypatch, node_files, op4_input_files)


def symmetric(n=12, density=0.4):
    """Sparse symmetric matrix of numbers of all sizes, positive diagonal."""
    A = sp.random_array((n, n), density=density, rng=RNG).tocsr()
    A.data = RNG.standard_normal(A.nnz) * 10.0 ** RNG.integers(-12, 12, A.nnz)
    return sp.csr_array(A + A.T + sp.diags_array(np.abs(RNG.standard_normal(n)) + 1.0))


def same(stored, expected):
    """Whether every number is the same, to the last bit."""
    return np.array_equal(stored.toarray(), expected.toarray())


def printed(text, n):
    """Matrix of lines row, column, value, by Python's own reading of numbers."""
    A = np.zeros((n, n))
    for line in text.splitlines():
        row, column, value = line.split()
        A[int(row) - 1, int(column) - 1] = A[int(column) - 1, int(row) - 1] = float(value)
    return A


@needs_calculix
@pytest.mark.parametrize(("suffix", "quantity"), [("sti", "stiffness"), ("mas", "mass")])
def test_calculix_matrices_come_back_as_printed(suffix, quantity, calculix_job):
    path = calculix_job / f"job.{suffix}"
    result = read_matrix(path, quantity).A
    n = len(read_dofs(calculix_job / "job.dof"))
    assert n == 3 * len(read_nodes(calculix_job / "mesh.inp").numbers)
    np.testing.assert_array_equal(result.toarray(), printed(path.read_text(), n))
    # Not an empty comparison: fourteen digits, both triangles.
    assert result.nnz > 10 * n
    assert (result - result.T).nnz == 0


@needs_calculix
def test_the_element_form_of_a_substructure_comes_back_as_printed(calculix_substructure):
    path = calculix_substructure / "sub.mtx"
    stored = read_matrix(path, "stiffness")
    values = path.read_text().split("TYPE=STIFFNESS")[1].split("*")[0].replace(",", " ").split()
    A = np.zeros((9, 9))
    A[np.tril_indices(9)] = [float(value) for value in values]
    np.testing.assert_array_equal(np.tril(stored.A.toarray()), A)
    assert stored.dofs.nodes.tolist() == [5, 5, 5, 6, 6, 6, 7, 7, 7]
    assert stored.dofs.components.tolist() == [0, 1, 2] * 3


@pytest.mark.parametrize("form", ["dense", "bigmat", "nonbigmat"])
@pytest.mark.parametrize("endian", ["<", pytest.param(">", marks=pytest.mark.long)])
def test_binary_op4_comes_back_to_the_last_bit(form, endian, tmp_path):
    K, M = symmetric(), symmetric()
    path = tmp_path / "a.op4"
    matrices = {"kaa": K.toarray(), "maa": M.toarray(), "baa": np.zeros((1, 1))}
    op4.write(str(path), matrices, sparse=form, endian=endian)
    assert same(read_matrix(path, "stiffness").A, K)
    assert same(read_matrix(path, "mass").A, M)


@pytest.mark.long
@pytest.mark.parametrize("form", ["dense", "bigmat", "nonbigmat"])
def test_text_op4_comes_back_as_printed(form, tmp_path):
    K = symmetric()
    path = tmp_path / "a.op4"
    op4.write(str(path), {"kgg": K.toarray()}, sparse=form, binary=False, digits=17)
    assert same(read_matrix(path, "stiffness").A, K)


@pytest.mark.long
@pytest.mark.parametrize("form", ["bigmat", "nonbigmat", "dense"])
def test_nastrans_own_files_of_64_bit_words_are_read_as_pyyeti_does(form):
    path = OP4 / f"nas_large_dim_{form}_binary.op4"
    expected = op4.load(str(path), "matd22a", into="list", sparse=(True, sp.coo_matrix.tocoo))[1][0]
    result = sp.coo_array(read_matrix(path, "mass").A)
    assert result.shape == expected.shape == (10_000_001, 10_000_001)
    ours = sorted(zip(*result.coords, result.data, strict=True))
    theirs = sorted(zip(expected.row, expected.col, expected.data, strict=True))
    assert ours == [each for each in theirs if each[2] != 0.0]


def test_a_reduced_model_of_nx_nastran_is_read_as_pyyeti_does():
    path = NASTRAN / "nas2cam_csuper" / "inboard_mk.op4"
    expected = op4.read(str(path), into="dct")
    for quantity, name in (("stiffness", "kxx"), ("mass", "mxx")):
        result = read_matrix(path, quantity).A.toarray()
        np.testing.assert_array_equal(result, expected[name])


def test_dmig_of_nastran_is_read_as_pyyeti_does():
    path = NASTRAN / "nastran_dmig_data" / "matrix_factory.pch"
    text = path.read_text()
    expected = bulk.rddmig(str(path))
    tried = 0
    for name, frame in expected.items():
        header = re.search(rf"^DMIG    {name.upper():8s} +0 +(\d) +(\d)", text, re.MULTILINE)
        if frame.shape[0] != frame.shape[1] or header[1] not in "16" or header[2] not in "12":
            continue
        cards = "\n".join(_cards_of(text, name.upper()))
        stored = read_dmig(path, cards.encode(), "stiffness")
        index = [
            (int(n), int(c) + 1)
            for n, c in zip(stored.dofs.nodes, stored.dofs.components, strict=True)
        ]
        ours = stored.A.toarray()
        theirs = frame.reindex(index=index, columns=index, fill_value=0.0).to_numpy()
        np.testing.assert_array_equal(ours, theirs)
        tried += 1
    assert tried >= 2


def _cards_of(text, name):
    inside = False
    for line in text.splitlines():
        if line.startswith("DMIG"):
            inside = line[8:16].strip() == name
        if inside:
            yield line


@pytest.mark.parametrize("wide", [True, False])
def test_dmig_keeps_the_digits_that_it_prints(wide, tmp_path):
    if wide:
        text = (
            "DMIG    K              0       6       2       0\n"
            "DMIG*   K                              1               1\n"
            "*                      1               1 1.234567891D+05\n"
            "*                      2               2-7.000000001D-03\n"
            "DMIG*   K                              2               2\n"
            "*                      2               2 9.876543211D+05\n"
        )
    else:
        text = "DMIG,K,0,6,2,0\nDMIG,K,1,1,,1,1,1.2345+5\n,2,2,-7.00-3\nDMIG,K,2,2,,2,2,9.9D5\n"
    path = tmp_path / "a.pch"
    path.write_text(text)
    stored = read_matrix(path, "stiffness")
    expected = (
        [[1.234567891e5, -7.000000001e-3], [-7.000000001e-3, 9.876543211e5]]
        if wide
        else [[1.2345e5, -7.00e-3], [-7.00e-3, 9.9e5]]
    )
    np.testing.assert_array_equal(stored.A.toarray(), expected)
    assert stored.dofs.named(1) == "node 2 Ty"


@pytest.mark.parametrize("digits", [8, 17])
def test_harwell_boeing_comes_back_as_printed(digits, tmp_path):
    K = symmetric()
    path = tmp_path / "k.rsa"
    rounded = harwell_boeing(path, K, digits)
    assert same(read_matrix(path, "stiffness").A, rounded)


def test_numbers_without_a_blank_between_them_are_told_apart(tmp_path):
    K = sp.csr_array(np.array([[2e100, -1e100], [-1e100, 2e100]]))
    path = tmp_path / "k.rsa"
    harwell_boeing(path, K, 8, width=15)
    assert re.search(r"\d-1\.0", path.read_text())
    assert same(read_matrix(path, "stiffness").A, K)


def test_scipys_unsymmetric_harwell_boeing_file_is_read(tmp_path):
    K = symmetric()
    path = tmp_path / "k.hb"
    scipy.io.hb_write(str(path), sp.csc_matrix(K))
    expected = scipy.io.hb_read(str(path))
    assert same(read_matrix(path, "stiffness").A, sp.csr_array(expected))


def test_both_listed_forms_of_abaqus_come_back_as_printed(tmp_path):
    K = symmetric()
    abaqus_input(tmp_path / "a.mtx", K, 3)
    abaqus_coordinates(tmp_path / "b.mtx", K)
    first, second = (read_matrix(tmp_path / name, "stiffness") for name in ("a.mtx", "b.mtx"))
    assert same(first.A, K)
    assert same(second.A, K)
    assert first.dofs.named(4) == "node 2 Ty"
    assert second.dofs is None


@pytest.mark.parametrize("symmetry", ["symmetric", "general"])
def test_matrix_market_comes_back_as_printed(symmetry, tmp_path):
    K = symmetric()
    path = tmp_path / "k.mtx"
    scipy.io.mmwrite(str(path), sp.coo_matrix(K), symmetry=symmetry, precision=17)
    assert same(read_matrix(path, "stiffness").A, K)


@pytest.mark.parametrize("layout", [sp.csr_array, sp.csc_array, sp.coo_array])
@pytest.mark.parametrize("triangle", [False, True])
def test_npz_comes_back_to_the_last_bit(layout, triangle, tmp_path):
    K = symmetric()
    path = tmp_path / "k.npz"
    sp.save_npz(path, layout(sp.triu(K) if triangle else K))
    assert same(read_matrix(path, "stiffness").A, K)


BAD = [
    ("a.sti", b"1 1 2.0\n1 2\n", "expected 3 a line"),
    ("a.sti", b"1 1 2.0\n1 2 x\n", "hold 'x'; expected numbers"),
    ("a.sti", b"0 1 2.0\n", "row 0 of a matrix"),
    ("a.sti", b"1 1 1e999\n", "not finite"),
    ("a.sti", b"1 99999999999 1\n", "expected at most"),
    ("a.mtx", b"%%MatrixMarket matrix coordinate pattern general\n1 1 1\n1 1\n", "pattern"),
    ("a.mtx", b"%%MatrixMarket matrix coordinate real general\n9 9 99\n1 1 1\n", "a line an entry"),
    (
        "a.mtx",
        b"%%MatrixMarket matrix coordinate real symmetric\n1 1 1\n1 1 2.0\0\n",
        "the entries",
    ),
    ("a.mm", b"%%MatrixMarket matrix coordinate real general\n2 2 2\n1 1 1\n", "states 2"),
    ("a.mm", b"%%MatrixMarket matrix coordinate real general\n2 2 1\n1.5 1 1\n", "hold 1.5"),
    ("a.rsa", b"t\n 1\n CSA 3 3 3\n(1I1)\n", "type 'CSA'"),
    ("a.npz", b"PK", "not a complete npz"),
    ("a.pch", b"GRID,1\n", "no matrix"),
    ("a.op4", b"\0" * 40, "output4"),
    ("a.full", b"x", "ansys-mapdl-reader"),
    ("a.xyz", b"x", "expected one of"),
    ("a.mtx", b"*USER ELEMENT, NODES=1\n1\n*MATRIX, TYPE=STIFFNESS\n1.\n", "ELEMENT NODES"),
    ("a.mtx", b"*USER ELEMENT, NODES=1\n** ELEMENT NODES\n** 5\n1,2\n,\n", "has no number"),
]


@pytest.mark.parametrize(("name", "content", "message"), BAD)
def test_what_cannot_be_read_is_told_in_one_line_with_the_file(name, content, message, tmp_path):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(ValueError, match=re.escape(message)) as caught:
        read_matrix(path, "stiffness")
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_npz_whose_array_has_no_readable_head_is_refused(tmp_path):
    """numpy reads the head of an array as Python, whose tokenizer has an error of its own."""
    head = b"{'descr': '<f8', (".ljust(53) + b"\n"
    content = b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head
    with zipfile.ZipFile(tmp_path / "k.npz", "w") as archive:
        archive.writestr("format.npy", content)
    with pytest.raises(ValueError, match=r"k\.npz: "):
        read_matrix(tmp_path / "k.npz", "stiffness")
    with pytest.raises(ValueError, match=r"k\.npz: is no state of a watch"):
        read_state(tmp_path / "k.npz", None, None, "key")


@pytest.mark.parametrize("layout", ["csr", "csc", "coo"])
def test_an_npz_that_unpacks_to_far_more_than_its_size_is_refused_unread(layout, tmp_path):
    """Explicit zeros pack a thousand to one."""
    n, names = 2_000_000, ("row", "col") if layout == "coo" else ("indices", "indptr")
    arrays = {name: np.zeros(n, np.int32) for name in names} | {"data": np.zeros(n)}
    np.savez_compressed(
        tmp_path / "k.npz", format=layout.encode(), shape=np.array([9, 9]), **arrays
    )
    with pytest.raises(ValueError, match=r"k\.npz: its arrays unpack to 32\d+ bytes from \d+;"):
        read_matrix(tmp_path / "k.npz", "stiffness")


def test_a_mass_of_equal_points_packs_well_and_is_read(tmp_path):
    M = sp.csr_array(sp.eye_array(200_000)) * 0.5
    sp.save_npz(tmp_path / "m.npz", M)
    assert (read_matrix(tmp_path / "m.npz", "mass").A - M).nnz == 0


def test_a_binary_file_that_states_more_than_it_holds_is_refused(tmp_path):
    path = tmp_path / "a.op4"
    op4.write(str(path), {"kaa": symmetric().toarray()})
    content = bytearray(path.read_bytes())
    content[4:12] = struct.pack("<ii", 20_000_000, 20_000_000)
    for damaged in (bytes(content), path.read_bytes()[:-30]):
        path.write_bytes(damaged)
        with pytest.raises(ValueError, match=r"a\.op4: "):
            read_matrix(path, "stiffness")


@pytest.mark.may_skip
def test_the_full_file_of_ansys_reader_is_read():
    """The file that comes with ansys-mapdl-reader 0.56: a beam of 321 nodes by Ansys."""
    examples = pytest.importorskip("ansys.mapdl.reader.examples")
    path = Path(examples.__file__).parent / "file.full"
    K, M = read_matrix(path, "stiffness"), read_matrix(path, "mass")
    assert K.dofs is not None
    assert K.A.shape == M.A.shape == (963, 963)
    assert np.array_equal(np.unique(K.dofs.nodes), np.arange(1, 322))
    assert np.array_equal(K.dofs.components, np.tile([0, 1, 2], 321))
    assert (K.A - K.A.T).nnz == (M.A - M.A.T).nnz == 0
    # No negative energy.
    assert np.linalg.eigvalsh(K.A.toarray()).min() > -1e-9 * abs(K.A).max()
    assert M.A.diagonal().min() >= 0.0
    assert M.A.sum() > 0.0


def test_one_of_every_pair_in_any_order_is_a_triangle_and_both_are_not(tmp_path):
    K = sp.coo_array(symmetric())
    order = np.random.default_rng(3).permutation(K.shape[0])
    # A triangle of renumbered rows lies on both sides of the diagonal.
    once = sp.coo_array(sp.tril(K))
    rows, columns = order[once.coords[0]], order[once.coords[1]]
    wanted = sp.csr_array(K)[np.argsort(order)][:, np.argsort(order)].toarray()
    n = K.shape[0]
    sp.save_npz(tmp_path / "k.npz", sp.csr_array((once.data, (rows, columns)), shape=(n, n)))
    assert_allclose(read_matrix(tmp_path / "k.npz", "stiffness").A.toarray(), wanted, rtol=0.0)
    lines = [
        f"{i // 6 + 1}, {i % 6 + 1}, {j // 6 + 1}, {j % 6 + 1}, {value!r}"
        for i, j, value in zip(rows.tolist(), columns.tolist(), once.data.tolist(), strict=True)
    ]
    (tmp_path / "k.mtx").write_text("\n".join(lines))
    assert_allclose(read_matrix(tmp_path / "k.mtx", "stiffness").A.toarray(), wanted, rtol=0.0)
    # A general matrix of which one pair alone stands twice is not mirrored.
    general = "%%MatrixMarket matrix coordinate real general\n3 3 4\n1 2 1\n2 1 2\n3 1 3\n2 3 4\n"
    (tmp_path / "general.mtx").write_text(general)
    A = read_matrix(tmp_path / "general.mtx", "stiffness").A.toarray()
    assert_allclose(A, [[0, 1, 0], [2, 0, 4], [3, 0, 0]])


@pytest.mark.parametrize(
    ("name", "content", "entry"),
    [
        ("k.sti", "1 1 2.0\n2 2 2.0\n2 1 1.0\n2 1 1.0\n", "row 2 and column 1"),
        (
            "k.mtx",
            "3,1, 3,1, 2.0\n3,2, 3,2, 2.0\n3,2, 3,2, 2.0\n",
            "row node 3 Ty and column node 3",
        ),
        (
            "k.mm",
            "%%MatrixMarket matrix coordinate real symmetric\n2 2 3\n1 1 1\n2 2 1\n1 1 1\n",
            "row 1 and column 1",
        ),
        (
            "k.pch",
            "DMIG,K,0,6,2,0\nDMIG,K,1,1,,1,1,2.0\n,2,1,1.0\nDMIG,K,1,1,,2,1,1.0\n",
            "row node 2 Tx and column node 1 Tx",
        ),
    ],
)
def test_an_entry_that_a_file_lists_twice_is_refused(name, content, entry, tmp_path):
    (tmp_path / name).write_text(content)
    with pytest.raises(ValueError, match=f"the entry of {entry}.* occurs twice; expected every on"):
        read_matrix(tmp_path / name, "stiffness")


def test_of_several_abaqus_matrices_the_name_says_which_one(tmp_path):
    path = tmp_path / "both.mtx"
    text = "*MATRIX INPUT, NAME={}\n1,1, 1,1, 2.0\n*MATRIX INPUT, NAME={}\n1,1, 1,1, 3.0\n"
    path.write_text("*MATRIX ASSEMBLE, STIFFNESS=K_1, MASS=M_1\n" + text.format("K_1", "M_1"))
    assert read_matrix(path, "stiffness").A.toarray() == 2.0
    assert read_matrix(path, "mass").A.toarray() == 3.0
    path.write_text(text.format("K_1", "K_2"))
    with pytest.raises(ValueError, match=r"both\.mtx: matrices 'K_1', 'K_2'; expected one, or one"):
        read_matrix(path, "stiffness")


@pytest.mark.parametrize(
    ("option", "advice"),
    [("SCALE FACTOR=2.0", "SCALEFACTOR=2.0 is .*: multiply"), ("INPUT=a.mtx", "give that file")],
)
def test_options_that_make_another_matrix_are_refused(option, advice, tmp_path):
    path = tmp_path / "k.mtx"
    entries = "" if option.startswith("INPUT") else "1,1, 1,1, 2.0\n"
    path.write_text(f"*MATRIX INPUT, NAME=K, {option}\n{entries}")
    with pytest.raises(ValueError, match=rf"k\.mtx: \*MATRIX INPUT, NAME=K, .*{advice}"):
        read_matrix(path, "stiffness")
    path.write_text("*MATRIX INPUT, NAME=K, SCALE FACTOR=1.0\n1,1, 1,1, 2.0\n")
    assert read_matrix(path, "stiffness").A.toarray() == 2.0


def test_a_dense_array_is_told_how_it_becomes_a_sparse_matrix(tmp_path):
    np.savez(tmp_path / "k.npz", K=np.eye(3))
    with pytest.raises(ValueError, match=r"k\.npz: holds 'K', a dense array .*save_npz\(file"):
        read_matrix(tmp_path / "k.npz", "stiffness")


def test_entries_behind_enddata_are_no_part_of_a_matrix(tmp_path):
    path = tmp_path / "k.pch"
    text = "DMIG,K,0,6,2\nDMIG,K,1,1,,1,1,2.0 $ kept\n"
    path.write_text(f"{text}ENDDATA\n{text}")
    assert read_matrix(path, "stiffness").A.toarray() == 2.0


ASSEMBLY = """SEBULK,101,EXTOP4,,MANUAL,,,101
SECONCT,101,0,,NO
,3,3,19,19,110,110
GRID,3,0,600.,0.,300.,0
GRID,19,0,600.,300.,0.,0
SPOINT,110
"""


@pytest.mark.parametrize(
    ("extrn", "rows"),
    [
        ("EXTRN,3,123456,19,123,110,0", [(3, i) for i in range(6)] + [(19, i) for i in range(3)]),
        (
            "EXTRN,3,1246,19,123456,110,0",
            [(3, i) for i in (0, 1, 3, 5)] + [(19, i) for i in range(6)],
        ),
        ("EXTRN,19,2,3,13,110,0", [(19, 1), (3, 0), (3, 2)]),
    ],
)
def test_an_assembly_has_the_components_that_its_punch_file_says(extrn, rows, tmp_path):
    (tmp_path / "body.asm").write_text(ASSEMBLY)
    with pytest.raises(FileNotFoundError, match=r"body\.pch: no such file; expected the punch fil"):
        read_nodes(tmp_path / "body.asm")
    (tmp_path / "body.pch").write_text("$ no such entry\n")
    with pytest.raises(ValueError, match=r"body\.pch: .*no EXTRN entry"):
        read_nodes(tmp_path / "body.asm")
    (tmp_path / "body.pch").write_text(extrn + "\n")
    table = read_nodes(tmp_path / "body.asm")
    assert table.numbers.tolist() == [3, 19]
    assert_allclose(table.points, [[600.0, 0.0, 300.0], [600.0, 300.0, 0.0]])
    assert not table.frames
    assert list(zip(table.dofs.nodes, table.dofs.components, strict=True)) == [*rows, (110, -1)]


GRIDS = "GRID*                  1                             0.0             0.0*\n{}*{:>23}\n"


@pytest.mark.parametrize(
    "text",
    [
        GRIDS.format("", 2.0),
        GRIDS.format("$ comment\n", 2.0),
        "GRID,1,,0.,0.,2.\nENDDATA\nGRID,2\n",
    ],
)
def test_a_grid_has_three_coordinates_and_stands_before_enddata(text, tmp_path):
    path = tmp_path / "nodes.bdf"
    path.write_text(text)
    table = read_nodes(path)
    assert table.numbers.tolist() == [1]
    assert_allclose(table.points, [[0.0, 0.0, 2.0]])


@pytest.mark.parametrize("defaults", ["GRDSET,,5\n", "GRDSET,,,,,,5\n"])
def test_systems_of_grdset_are_refused(defaults, tmp_path):
    path = tmp_path / "nodes.bdf"
    path.write_text(f"CORD2R,5,0,0.,0.,-2.,0.,0.,1.\n,1.,0.,0.\n{defaults}GRID,1,,0.,0.,2.\n")
    with pytest.raises(ValueError, match=r"nodes\.bdf: GRDSET gives coordinate system 5 to grids"):
        read_nodes(path)


@pytest.mark.parametrize(
    ("keyword", "what"),
    [
        ("*Transform, nset=rim, type=C\n0., 0., 0., 0., 0., 1.\n", "directions of their own"),
        ("*SYSTEM\n0., 0., 0., 0., 1., 0.\n", "in rectangular coordinates"),
        ("*SYSTEM\n.5, 0., 0.\n", "in rectangular coordinates"),
    ],
)
def test_systems_of_an_abaqus_deck_beside_matrices_are_refused(keyword, what, tmp_path):
    path = tmp_path / "nodes.inp"
    for text in (f"{keyword}*NODE\n1, 0., 0., 2.\n", f"*NODE, nset=rim\n1, 0., 0., 2.\n{keyword}"):
        path.write_text(text)
        with pytest.raises(ValueError, match=rf"nodes\.inp: .*{what}"):
            read_nodes(path)


def of_digits(digits):
    """Matrix as a file of so many digits holds it."""
    K = symmetric()
    K.data = np.array([float(f"{value:.{digits - 1}e}") for value in K.data])
    return K


@pytest.mark.parametrize(
    ("digits", "warning"),
    [(4, "has 4 significant digits"), (6, "has 6 significant digits"), (9, ""), (17, "")],
)
def test_few_digits_of_a_stiffness_are_named(digits, warning):
    note = precision_note(of_digits(digits))
    assert warning in note
    assert bool(note) == bool(warning)


def test_single_precision_is_named_and_round_numbers_are_not():
    K = symmetric()
    K.data = K.data.astype(np.float32).astype(np.float64)
    assert "single precision" in precision_note(K)
    assert precision_note(sp.csr_array(4.0 * np.eye(6) - np.eye(6, k=1) - np.eye(6, k=-1))) == ""


def test_a_link_of_a_deck_that_is_given_twice_is_refused(tmp_path):
    grids = "GRID,1,,0.,0.,0.\nGRID,2,,0.,1.,0.\nGRID,3,,0.,0.,1.\nGRID,9,,0.,.3,.3\n"
    deck = tmp_path / "links.bdf"
    deck.write_text(grids + 2 * "RBE3,7,,9,123456,1.0,123,1,2\n+,3\n")
    with pytest.raises(ValueError, match=r"links\.bdf: RBE3 7 is given twice"):
        linked_pilots(deck)
