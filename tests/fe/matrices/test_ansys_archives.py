"""Nodes, components and solids of Ansys archives."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.materials import Material
from carrierflex.fe.matrices.node_files import read_nodes
from carrierflex.fe.solids.solid_matrices import solid_matrices
from carrierflex.geometry.given_meshes.solid_files import read_solid_mesh
from tests.fe.matrices.ansys_sample import ARCHIVE

STEEL = Material("steel", 2.1e11, 0.3, 7850.0)
LIGHT = Material("light", 7e10, 0.33, 2700.0)


@pytest.fixture
def archive(tmp_path):
    path = tmp_path / "model.cdb"
    path.write_text(ARCHIVE)
    return path


def test_nodes_and_components_are_those_of_the_archive(archive):
    nodes = read_nodes(archive)
    assert nodes.numbers.tolist() == [1, 2, 3, 4, 5, 6, 7, 8, 10]
    # What a line leaves out is zero; the last node's z follows without a blank.
    assert nodes.points[1].tolist() == [1.0, 0.0, 0.0]
    assert nodes.points[-1].tolist() == [0.25, 0.25, -1.0]
    # A negative number ends a range.
    assert nodes.sets["START"].tolist() == [1, 2, 3, 4]
    assert nodes.sets["TIP"].tolist() == [5, 6, 7, 10]


def test_solids_have_the_mass_of_their_volumes(archive):
    mesh = read_solid_mesh(archive)
    assert [(kind, group, len(nodes)) for kind, group, nodes in mesh.blocks] == [
        ("hexahedron", "1", 1),
        ("tetra", "2", 1),
    ]
    _, M = solid_matrices(mesh, {"1": STEEL, "2": LIGHT})
    # A cube, and a tetrahedron on half of its face.
    assert_allclose(M[0::3, 0::3].sum(), 7850.0 + 2700.0 / 6.0, rtol=1e-12)
    assert sorted(mesh.numbers[mesh.node_sets["TIP"]]) == [5, 6, 7, 10]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("ET,       1,185", "ET,       1,181"), r"elements beside solids: 2 of type 181"),
        (("ET,       1,185\n", ""), "2 of type that no ET states"),
        (("      -1\nCMBLOCK,START", "CMBLOCK,START"), "expected a whole number"),
        (("(3i8,6e20.13)", "(free)"), r"line 7: '\(free\)'; expected a format as"),
        (("EBLOCK,19,SOLID", "EBLOCK,10,,"), "EBLOCK without SOLID"),
        (("       7       8\n", "       7      11\n"), "names node 11"),
        (("10      10      10      10\n", "10      10      10       4\n"), "element 2 has 8 nodes"),
    ],
)  # fmt: skip
def test_what_is_no_archive_of_solids_is_refused(archive, change, message):
    archive.write_text(ARCHIVE.replace(*change))
    with pytest.raises(ValueError, match=message) as caught:
        read_solid_mesh(archive)
    assert str(caught.value).startswith(f"{archive}: ")


def test_nodes_with_directions_of_their_own_are_refused(archive):
    turned = " 0.0000000000000E+00 1.0000000000000E+00 1.0000000000000E+00"
    archive.write_text(ARCHIVE.replace(turned + "\n", turned + " 9.0000000000000E+01\n", 1))
    with pytest.raises(ValueError, match=r"node 8 has directions of its own \(NROTAT\)"):
        read_nodes(archive)


@pytest.mark.may_skip
def test_the_beam_that_comes_with_ansys_reader_is_read():
    """HexBeam.cdb of ansys-mapdl-reader 0.55: 1 x 1 x 5, 2700 kg/m^3, 40 elements of type 186."""
    examples = pytest.importorskip("ansys.mapdl.reader.examples")
    mesh = read_solid_mesh(Path(examples.__file__).parent / "HexBeam.cdb")
    ((kind, group, nodes),) = mesh.blocks
    assert (kind, group, nodes.shape) == ("hexahedron20", "1", (40, 20))
    _, M = solid_matrices(mesh, {"1": LIGHT})
    assert_allclose(M[0::3, 0::3].sum(), 2700.0 * 5.0, rtol=1e-10)
    assert len(mesh.node_sets["NCOMP2"]) == 98
    assert np.isfinite(mesh.points).all()
