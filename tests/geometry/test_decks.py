"""Decks of other programs: the same body however its cards are written, nothing dropped unsaid."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.matrices import node_files
from carrierflex.fe.matrices.interface_files import read_interfaces
from carrierflex.fe.matrices.node_files import numbers_in_turn, read_nodes
from carrierflex.fe.solids.given_solids import solid_body
from carrierflex.geometry.given_meshes import foreign_files
from carrierflex.geometry.given_meshes.solid_files import REFERENCE_NODES, read_solid_mesh
from carrierflex.geometry.mesh_files import read_mesh
from tests.forked_readers import read_in_forks

#: Nodes of one element of 0.1 m as Nastran numbers them: edges along the axis before the far end.
HEX = 0.1 * REFERENCE_NODES["hexahedron20"][[*range(12), *range(16, 20), *range(12, 16)]]
INTERFACES = """format = "carrierflex-interfaces"
version = 1
name = "block"
[materials.{group}]
E = 2.1e11
nu = 0.3
rho = 7800.0
[[pilots]]
name = "root"
type = "rigid"
nodes = [1, 2, 3, 4]
[[pilots]]
name = "tip"
type = "rigid"
nodes = [5, 6, 7, 8]
"""


@pytest.fixture(autouse=True)
def in_forks(monkeypatch):
    """Decks are read in forks."""
    read_in_forks(monkeypatch, foreign_files, node_files)


def card(name, fields, form):
    """One entry in fields of 8 or 16 characters, or between commas."""
    if form == "tabs":
        return card(name, fields, "free").replace("0000", "").replace(",", "\t")
    if form == "mixed":
        first = card(name, fields[:8], "blank")
        return first + card("*", fields[8:], "long").replace("**", "*") if fields[8:] else first
    if form == "long free":
        words = [str(field) for field in fields]
        rows = [",".join(words[i : i + 4]) for i in range(0, len(words), 4)]
        return f"{name}*," + "\n*,".join(rows) + "\n"
    if form == "remarks":
        return card(name, fields, "plus").replace("\n", " $ a, 1\n")
    width, n = (16, 4) if form == "long" else (8, 8)
    words = [f"{field:.6f}" if isinstance(field, float) else str(field) for field in fields]
    lines = [words[i : i + n] for i in range(0, len(words), n)]
    if form == "free":
        return "".join(
            ",".join([name if not i else "", *line]) + "\n" for i, line in enumerate(lines)
        )
    head = {"long": "*", "plus": "+", "blank": ""}[form]
    first = name + "*" * (form == "long")
    return "".join(
        f"{head if i else first:8s}" + "".join(f"{word:>{width}s}" for word in line) + "\n"
        for i, line in enumerate(lines)
    )


def deck(form, *, comment="", more=""):
    grids = "".join(card("GRID", [n, "", *map(float, xyz)], form) for n, xyz in enumerate(HEX, 1))
    element = card("CHEXA", [7, 1, *range(1, 21)], form).replace("\n", f"\n{comment}")
    return f"SOL 103\nCEND\nBEGIN BULK\n{grids}{element}{more}ENDDATA\n"


def abaqus(more="", *, element_set="*ELSET, ELSET=ALL\n1\n"):
    positions = 0.1 * REFERENCE_NODES["hexahedron20"]
    nodes = "".join(f"{n}, {x:.3f}, {y:.3f}, {z:.3f}\n" for n, (x, y, z) in enumerate(positions, 1))
    return (
        f"*NODE\n{nodes}*ELEMENT, TYPE=C3D20\n1, {', '.join(map(str, range(1, 11)))},\n"
        f"{', '.join(map(str, range(11, 21)))}\n{element_set}{more}"
    )


def body_of(path, group):
    toml = path.with_suffix(".toml")
    toml.write_text(INTERFACES.format(group=group))
    return solid_body(path, read_interfaces(toml))


@pytest.mark.parametrize(
    ("form", "comment"),
    [
        *((form, "") for form in ("plus", "blank", "long", "free")),
        *((form, "") for form in ("tabs", "mixed", "long free", "remarks")),
        ("blank", "$ comment\n\n"),
    ],
)
def test_a_hexahedron_of_20_nodes_is_one_however_its_lines_go_on(form, comment, tmp_path):
    path = tmp_path / "block.bdf"
    path.write_text(deck(form, comment=comment))
    mesh = read_solid_mesh(path)
    ((kind, group, nodes),) = mesh.blocks
    assert (kind, group) == ("hexahedron20", "1")
    assert_allclose(mesh.points[nodes[0]], 0.1 * REFERENCE_NODES["hexahedron20"], atol=1e-9)
    body = body_of(path, "1")
    assert body.warnings == ()
    along_x = body.structure.rigid_modes[:, 0]
    assert along_x @ body.structure.M @ along_x == pytest.approx(7.8, rel=1e-6)


def test_a_quadratic_wedge_is_not_taken_for_a_linear_one(tmp_path):
    path = tmp_path / "wedge.bdf"
    path.write_text(deck("blank", more=card("CPENTA", [8, 1, *range(1, 16)], "blank")))
    with pytest.raises(ValueError, match=r"wedge\.bdf: 1 elements of type wedge15; expected tetra"):
        read_solid_mesh(path)


def test_grids_of_a_cylindrical_system_stand_where_it_says(tmp_path):
    system = "CORD2C,5,0,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\n"
    grids = "".join(
        f"GRID,{n},5,{np.hypot(x, y):.6f},{np.degrees(np.arctan2(y, x)):.6f},{z:.6f}\n"
        for n, (x, y, z) in enumerate(HEX, 1)
    )
    path = tmp_path / "round.bdf"
    element = card("CHEXA", [7, 1, *range(1, 21)], "free")
    path.write_text(f"BEGIN BULK\n{system}{grids}{element}ENDDATA\n")
    assert_allclose(read_solid_mesh(path).points, HEX, atol=1e-6)
    path.write_text(f"BEGIN BULK\n{grids}{element}ENDDATA\n")
    with pytest.raises(ValueError, match="names a coordinate system that is not there"):
        read_solid_mesh(path)


def test_elements_with_odd_counts_or_absent_nodes_are_refused_by_number(tmp_path):
    path = tmp_path / "odd.bdf"
    path.write_text(deck("free", more=card("CTETRA", [9, 1, *range(1, 8)], "free")))
    with pytest.raises(ValueError, match=r"odd\.bdf: CTETRA 9 has 7 nodes; expected 4 or 10"):
        read_solid_mesh(path)
    path.write_text(deck("free", more=card("CTETRA", [9, 1, 1, 2, 3, 99], "free")))
    with pytest.raises(ValueError, match="names node 99, which no GRID of this file has"):
        read_solid_mesh(path)


def test_an_element_number_that_two_elements_have_is_refused(tmp_path):
    path = tmp_path / "twice.bdf"
    path.write_text(deck("free", more=card("CTETRA", [7, 2, 1, 2, 3, 5], "free")))
    with pytest.raises(ValueError, match="CTETRA 7 has the number of another element; expected"):
        read_solid_mesh(path)


def test_nothing_behind_enddata_is_read_and_a_byte_order_mark_hides_no_card(tmp_path):
    behind = card("CHEXA", [8, 1, *range(1, 21)], "free") + "CONM2,9,5,,50.\n"
    path = tmp_path / "block.bdf"
    text = deck("plus").partition("BEGIN BULK\n")[2]
    path.write_text("\ufeff" + text + behind, encoding="utf-8")
    mesh = read_solid_mesh(path)
    assert len(mesh.points) == 20
    assert [len(nodes) for _, _, nodes in mesh.blocks] == [1]


@pytest.mark.parametrize(
    ("more", "refused"),
    [
        ("  CONM2,200,5,,50.0\n", "line ' CONM2,200,5,,50.0' begins with blanks; .*column 1"),
        (" CHEXA  ,8,1\n", "line ' CHEXA ,8,1' begins with blanks"),
        ("GRID*  " + "21".rjust(17) + "\n+       1.\n", "line '[+] 1.' has fields of 8 .* of 16"),
        ("GRID\t21\t\t0.100000\t0.\t0.\n", "'GRID.*' has a tab behind a full field"),
        ("=,*1,=,*0.1\n", "line '=,.1,=,.0.1' repeats an entry"),
        ("RBE2,9,1,123456,2,3,4,5,6,7,8\n", "line 'RBE2,.*' has 10 fields behind .* at most 8"),
        ("RBE2,9,1,123456,2,3,4,5,6,+A\n+B,7\n", "line '[+]B,7' follows .* goes on in 'A'"),
    ],
)
def test_cards_that_would_be_dropped_are_refused_with_their_line(more, refused, tmp_path):
    path = tmp_path / "block.bdf"
    path.write_text(deck("free", more=more))
    with pytest.raises(ValueError, match=rf"block\.bdf: the .*{refused}"):
        read_solid_mesh(path)
    with pytest.raises(ValueError, match=rf"block\.bdf: the .*{refused}"):
        read_nodes(path)


def test_entries_of_an_included_file_are_not_passed_over(tmp_path):
    path = tmp_path / "block.bdf"
    path.write_text(deck("free", more="include 'masses.bdf'\n"))
    for read in (read_solid_mesh, read_mesh, read_nodes):
        with pytest.raises(ValueError, match=r"masses\.bdf'.*: other files are not read; expected"):
            read(path)


SHELL = card("PSHELL", [2, 1, 0.01], "plus") + card("CQUAD4", [100, 2, 1, 2, 3, 4], "plus")


@pytest.mark.parametrize(
    ("more", "refused"),
    [
        (SHELL, "1 CQUAD4;"),
        (card("CONM2", [200, 5, "", 50.0], "free"), "1 CONM2;"),
        (card("CELAS2", [201, 1e8, 5, 3], "plus") * 2 + SHELL, "2 CELAS2, 1 CQUAD4;"),
        (card("CBAR", [202, 3, 1, 2, 0.0, 1.0, 0.0], "long"), "1 CBAR;"),
    ],
)
def test_stiffness_and_mass_beside_solids_are_refused_with_kind_and_count(more, refused, tmp_path):
    path = tmp_path / "mixed.bdf"
    path.write_text(deck("plus", more=more))
    for read in (read_solid_mesh, read_mesh):
        with pytest.raises(ValueError, match=rf"mixed\.bdf: {refused} .*--stiffness and --mass"):
            read(path)


def test_masses_of_an_earlier_section_are_refused_as_its_grids_are_read(tmp_path):
    path = tmp_path / "super.bdf"
    path.write_text(deck("plus", more="CONM2,200,5,,50.0\nBEGIN BULK SUPER=1\n"))
    with pytest.raises(ValueError, match=r"super\.bdf: 1 CONM2;"):
        read_solid_mesh(path)


def test_links_and_facets_without_thickness_are_told(tmp_path):
    path = tmp_path / "linked.bdf"
    facet = card("CQUAD4", [100, 2, 1, 2, 3, 4], "plus")
    path.write_text(deck("plus", more=facet + card("RBE2", [300, 1, 123456, 5, 6], "free")))
    assert body_of(path, "1").warnings == (
        "left out: 1 CQUAD4, to which the file gives no thickness",
        "left out: 1 RBE2; pilots of the interfaces file replace links",
    )


@pytest.mark.parametrize(
    ("more", "refused"),
    [
        (
            "*ELEMENT, TYPE=S4, ELSET=SKIN\n100, 1, 2, 3, 4\n*SHELL SECTION, ELSET=SKIN\n0.01\n",
            "1 S4;",
        ),
        ("*Element, type=MASS, elset=M\n100, 5\n101, 6\n*MASS, ELSET=M\n25.0\n", "2 MASS;"),
        ("*ELEMENT,TYPE=SPRINGA,ELSET=S\n100, 5, 6\n", "1 SPRINGA;"),
        ("*ELEMENT, TYPE=B31, ELSET=B\n** beams\n100, 5, 6\n", "1 B31;"),
    ],
)
def test_an_abaqus_deck_is_refused_likewise(more, refused, tmp_path):
    path = tmp_path / "mixed.inp"
    path.write_text(abaqus(more))
    for read in (read_solid_mesh, read_mesh):
        with pytest.raises(ValueError, match=rf"mixed\.inp: {refused} .*--stiffness and --mass"):
            read(path)


def test_an_abaqus_element_number_that_occurs_twice_is_refused(tmp_path):
    path = tmp_path / "twice.inp"
    path.write_text(abaqus("*ELEMENT, TYPE=C3D4\n2, 1, 2, 3, 5\n1, 1, 2, 3, 6\n"))
    with pytest.raises(ValueError, match="TYPE=C3D4: element 1 occurs twice; expected every one"):
        read_solid_mesh(path, numbers_in_turn)


@pytest.mark.parametrize(
    ("more", "refused"),
    [
        ("*NONSTRUCTURAL MASS, ELSET=ALL, UNITS=TOTAL MASS\n50.\n", "1 .NONSTRUCTURAL MASS;"),
        ("*ELGEN, ELSET=ALL\n1, 3, 10, 1\n", "1 .ELGEN; .* nothing is generated"),
        ("*Elcopy, element shift=10, old set=ALL\n", "1 .ELCOPY;"),
        ("*INCLUDE, INPUT=more.inp\n", "1 .INCLUDE; .*other files are not read"),
        ("*ELEMENT, TYPE=C3D20, INPUT=more.txt\n", "1 .ELEMENT, INPUT;"),
    ],
)
def test_masses_and_elements_that_keywords_make_or_fetch_are_refused(more, refused, tmp_path):
    path = tmp_path / "made.inp"
    path.write_text(abaqus(more))
    with pytest.raises(ValueError, match=rf"made\.inp: {refused}"):
        read_solid_mesh(path, numbers_in_turn)


TURNED = "0., 0., 0.\n0., 0., 0., 0., 0., 1., 90.\n"


@pytest.mark.parametrize(
    ("more", "refused"),
    [
        ("*SYSTEM\n0., 0., 0., 0., 1., 0.\n", "'.SYSTEM'; expected every node in .NODE"),
        ("*Node, system=C\n21, 1., 90., 0.\n", "'.Node, system=C'; expected every node in .NODE"),
        ("*NODE, INPUT=more.txt\n", "'.NODE, INPUT=more.txt'; expected every node"),
        ("*NGEN, NSET=A\n1, 5\n", "'.NGEN, NSET=A'; expected every node"),
        ("*NCOPY, CHANGE NUMBER=9, OLD SET=A, SHIFT\n", "'.NCOPY, CHANGE"),
        (f"*PART, NAME=P\n*INSTANCE, NAME=P-1, PART=P\n{TURNED}", "NAME=P-1, .*moves its part"),
        ("*INSTANCE, NAME=A\n*END INSTANCE\n*INSTANCE, NAME=B\n", "NAME=B' is the second one"),
        ("*PART, NAME=P\n*PART, NAME=Q\n", "NAME=Q' is the second one; .*without parts and"),
    ],
)
def test_nodes_that_keywords_make_or_move_are_refused(more, refused, tmp_path):
    path = tmp_path / "moved.inp"
    path.write_text(abaqus(more))
    for read in (read_solid_mesh, read_mesh, read_nodes):
        with pytest.raises(ValueError, match=rf"moved\.inp: .*{refused}"):
            read(path)


def test_one_instance_that_does_not_move_its_part_is_read(tmp_path):
    path = tmp_path / "block.inp"
    instance = "*END PART\n*INSTANCE, NAME=P-1, PART=P\n0., 0., 0.\n*END INSTANCE\n"
    # As Windows and Fortran write it.
    text = f"\ufeff{abaqus(instance).replace('0.100', '0.1D0')}"
    path.write_text(text.replace("*NODE", "*PART, NAME=P\n*NODE"), encoding="utf-8")
    mesh = read_solid_mesh(path, numbers_in_turn)
    assert_allclose(mesh.points, 0.1 * REFERENCE_NODES["hexahedron20"], atol=1e-9)
    path.write_text(text, encoding="utf-8")
    assert_allclose(read_nodes(path).points, mesh.points)


ASSEMBLY = """*ASSEMBLY, NAME=A
*INSTANCE, NAME=P-1, PART=P
*END INSTANCE
*NODE
1, 9., 9., 9.
*NSET, NSET=POINT
1
*NSET, NSET=FACE, INSTANCE=P-1
1, 2, 3, 4
*END ASSEMBLY
"""


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("TYPE=C3D20\n", "TYPE=C3D20,\nELSET=ALL\n"),
        ("*NODE\n", "* Node , NSET=EACH\n"),
        ("0.000, 0.000, 0.000\n", "\n"),
        ("0.100, 0.000, 0.000\n", "0.100\n"),
        ("0.000, 0.100, 0.000\n", ", 0.100,\n"),
        ("\n4, ", "\n*NODE\n4, "),
        ("*ELSET, ELSET=ALL\n1\n", f"*ELSET, ELSET=ALL\n1\n{ASSEMBLY}"),
    ],
)
def test_nodes_of_a_deck_are_the_same_however_they_are_written(old, new, tmp_path):
    path = tmp_path / "block.inp"
    text = abaqus()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    mesh = read_solid_mesh(path, numbers_in_turn)
    ((_, group, nodes),) = mesh.blocks
    assert group == "ALL"
    assert_allclose(mesh.points[nodes[0]], 0.1 * REFERENCE_NODES["hexahedron20"], atol=1e-9)
    table = read_nodes(path)
    assert_allclose(table.points, 0.1 * REFERENCE_NODES["hexahedron20"], atol=1e-9)
    assert "POINT" not in table.sets


def test_elements_may_stand_before_the_nodes(tmp_path):
    path = tmp_path / "block.inp"
    nodes, elements = abaqus().split("*ELEMENT")
    path.write_text(f"*ELEMENT{elements}{nodes}")
    assert_allclose(
        read_solid_mesh(path, numbers_in_turn).points, 0.1 * REFERENCE_NODES["hexahedron20"]
    )


@pytest.mark.parametrize(
    ("more", "refused"),
    [
        ("*NODE\n5, 0., 0., 0.7\n", "node 5 occurs twice; expected every node once"),
        ("*ELEMENT, TYPE=C3D4\n2, 1, 2, 3, 99\n", "names number 99, which nothing of this file"),
        ("*NODE\n21, 0., 0., 0., 0., 1.\n", "line '21, .*' of .NODE has more than four"),
        ("*NSET, NSET=X, GENERATE\n1, 999999999999\n", "GENERATE with '1, 999.*; expected first"),
    ],
)
def test_nodes_twice_and_numbers_of_nothing_are_refused(more, refused, tmp_path):
    path = tmp_path / "odd.inp"
    path.write_text(abaqus(more))
    with pytest.raises(ValueError, match=rf"odd\.inp: .*{refused}"):
        read_solid_mesh(path, numbers_in_turn)


def test_shells_without_a_section_and_couplings_of_a_deck_are_told(tmp_path):
    path = tmp_path / "skin.inp"
    path.write_text(
        abaqus("*ELEMENT, TYPE=S4, ELSET=SKIN\n100, 1, 2, 3, 4\n101, 5,\n6, 7, 8\n*RIGID BODY\n")
    )
    assert body_of(path, "ALL").warnings == (
        "left out: 2 S4, to which the file gives no thickness",
        "left out: 1 *RIGID BODY; pilots of the interfaces file replace links",
    )


@pytest.mark.parametrize("limits", ["1, 2", "1, 2, 1", "1, 1\n2, 2", "1, 1, 1\n** rest\n2, 2\n"])
def test_a_generated_set_takes_first_and_last_alone_and_several_lines(limits, tmp_path):
    path = tmp_path / "block.inp"
    deck = abaqus(element_set=f"*ELSET, GENERATE, ELSET=ALL\n{limits}\n")
    second = deck[deck.index("1, 1, 2") : deck.index("*ELSET")].replace("1, 1, 2", "2, 1, 2", 1)
    # A comment between the elements ended their list.
    path.write_text(deck.replace("*ELSET", f"** second\n{second}*ELSET", 1))
    ((kind, group, nodes),) = read_solid_mesh(path, numbers_in_turn).blocks
    assert (kind, group, len(nodes)) == ("hexahedron20", "ALL", 2)
    for wrong in ("1, 2, 1, 4", "2, 1, -1", "1, 2, 0"):
        path.write_text(deck.replace(limits, wrong))
        with pytest.raises(ValueError, match=f"GENERATE with '{wrong}'; expected first, last and"):
            read_solid_mesh(path, numbers_in_turn)


@pytest.mark.parametrize("content", ["", "1, 2, 3\n", "** a comment alone\n"])
def test_a_deck_without_a_keyword_is_refused_by_its_name(content, tmp_path, monkeypatch):
    monkeypatch.setattr(foreign_files, "in_child", lambda read, *given, about, what: read(*given))
    (tmp_path / "empty.inp").write_text(content)
    with pytest.raises(ValueError, match=r"empty\.inp: "):
        read_solid_mesh(tmp_path / "empty.inp")
