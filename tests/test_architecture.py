"""The project's direction, kept by reading the source.

Imports point left, few files know a library, nothing is long.
"""

import ast
import tomllib
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
CHAIN = (
    "files",
    "geometry",
    "fe",
    "reduction",
    "simulation",
    "identification",
    "diagnosis",
    "blind_check",
    "workflows",
)
#: Not installed: they may import everything, and nothing of the chain imports them.
BESIDE_THE_CHAIN = ("benchmarks", "examples", "studies")
IMPORT_NAME = "carrierflex"
KINDS = ("carrier", "element", "mounting")
#: What every kind is made of: it knows none of them.
BELOW_THE_KINDS = ("comparison", "inference", "gap")
MOST_LEVELS = 4
#: Far above what clear code comes out at: lengths are a sign, not an aim.
MOST_LINES_OF_A_FILE = 400
MOST_LINES_OF_A_FUNCTION = 60
MOST_FILES_IN_A_ROOM = 16
MOST_FILES_IN_A_FOLDER = 30
#: The modules of fe that hold no finite elements, and so may be imported right of reduction.
CURVES = {"carrierflex.fe.deflection_curves", "carrierflex.fe.curve_files"}


@cache
def trees():
    """Syntax tree of every file; not at import, where every process of the tests would read all."""
    return {
        path.relative_to(ROOT): ast.parse(path.read_text(encoding="utf-8"))
        for package in CHAIN
        for path in sorted((ROOT / package).rglob("*.py"))
    }


def module_of(path):
    """Name of a file's module below the import name.

    ``carrierflex.diagnosis.carrier`` for ``diagnosis/carrier/__init__.py``.
    """
    return ".".join((IMPORT_NAME, *path.with_suffix("").parts)).removesuffix(".__init__")


@cache
def modules():
    return {module_of(path) for path in trees()}


def imported_names(tree):
    """Dotted names that a file imports, also inside functions.

    Members of a module with the module before them.
    """
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "an import is relative; expected absolute names"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def module_behind(name):
    """The project's module that a dotted name leads to; None for other libraries."""
    while name and name not in modules():
        name = name.rpartition(".")[0]
    return name or None


@cache
def graph_of_imports():
    """Modules of the project that each of them imports."""
    return {
        module_of(path): {module_behind(name) for name in imported_names(tree)}
        - {None, module_of(path)}
        for path, tree in trees().items()
    }


def imports():
    """Package, file name and imported module of every import, also of those inside functions."""
    for path, tree in trees().items():
        for name in imported_names(tree):
            yield path.parts[0], path.name, module_behind(name) or name


def room_of(module):
    """Room of a module of the diagnosis.

    Its sub-folder, or the file itself where it stands outside all rooms.
    """
    return (*module.split("."), "diagnosis")[2]


def test_packages_import_only_from_packages_to_their_left():
    for package, _, name in imports():
        library, _, inside = name.partition(".")
        assert library not in ("tests", *BESIDE_THE_CHAIN, *CHAIN), f"{package} imports {name}"
        if library != IMPORT_NAME:
            continue
        stage = inside.split(".")[0]
        assert CHAIN.index(stage) <= CHAIN.index(package), f"{package} imports {name}"
        if stage == "fe" and package in ("simulation", "identification", "diagnosis"):
            assert name in CURVES, f"{package} imports {name}"


def test_no_circle_between_any_two_files():
    try:
        TopologicalSorter(graph_of_imports()).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def test_no_circle_between_studies_and_examples():
    graph = {}
    for folder in ("examples", "studies"):
        for path in (ROOT / folder).glob("*.py"):
            names = set(imported_names(ast.parse(path.read_text(encoding="utf-8"))))
            modules_of_names = {name.rpartition(".")[0] for name in names}
            graph[f"{folder}.{path.stem}"] = names | modules_of_names
    TopologicalSorter(graph).prepare()


def test_no_kind_imports_another_and_nothing_below_the_kinds_knows_one():
    for module, imported in graph_of_imports().items():
        if not module.startswith("carrierflex.diagnosis."):
            continue
        others = {
            room_of(name) for name in imported if name.startswith("carrierflex.diagnosis.")
        } & set(KINDS)
        room = room_of(module)
        if room in KINDS:
            assert others <= {room}, f"{module} imports {others}"
        elif room != "kinds":
            assert not others, (
                f"{module} imports {others}; only carrierflex.diagnosis.kinds lists the kinds"
            )


def test_inference_knows_no_gap_and_no_report():
    allowed = {"inference", "comparison"}
    for module, imported in graph_of_imports().items():
        if module.startswith("carrierflex.diagnosis.inference."):
            rooms = {
                room_of(name) for name in imported if name.startswith("carrierflex.diagnosis.")
            }
            assert rooms <= allowed, f"{module} imports from {rooms - allowed}"


def test_nothing_below_the_list_of_kinds_names_a_kind():
    for path, tree in trees().items():
        if path.parts[0] != "diagnosis" or path.parts[1] not in BELOW_THE_KINDS:
            continue
        named = {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant)} & set(
            KINDS
        )
        assert not named, f"{path} names {named}"


def levels_of(graph):
    """Level of every node: 1 where it imports nothing.

    Otherwise one more than the highest level it imports.
    """
    levels = {}
    for node in TopologicalSorter(graph).static_order():
        levels[node] = 1 + max((levels[other] for other in graph.get(node, ())), default=0)
    return levels


def test_rooms_of_the_diagnosis_stand_on_at_most_four_levels():
    rooms = {}
    for module, imported in graph_of_imports().items():
        if module.startswith("carrierflex.diagnosis."):
            inside = {
                room_of(name) for name in imported if name.startswith("carrierflex.diagnosis.")
            }
            rooms.setdefault(room_of(module), set()).update(inside - {room_of(module)})
    levels = levels_of(rooms)
    assert max(levels.values()) <= MOST_LEVELS, levels


def test_no_folder_holds_more_files_than_one_can_take_in():
    counts = {}
    for path in trees():
        counts[path.parent] = counts.get(path.parent, 0) + 1
    for folder, count in counts.items():
        most = MOST_FILES_IN_A_ROOM if folder.parts[0] == "diagnosis" else MOST_FILES_IN_A_FOLDER
        assert count <= most, f"{folder} holds {count} files"


def test_each_library_of_meshes_and_pictures_has_one_place():
    for package, file, name in imports():
        library = name.split(".")[0]
        assert library != "skfem" or package == "fe", f"{package}/{file} imports {name}"
        assert library not in ("pygmsh", "gmsh") or package == "geometry", (
            f"{package}/{file} imports {name}"
        )
        assert library not in ("pyvista", "vtk") or file == "view.py", (
            f"{package}/{file} imports {name}"
        )


def test_nothing_is_too_long_to_be_read_in_one_go():
    for path, tree in trees().items():
        assert (ROOT / path).read_text(encoding="utf-8").count("\n") <= MOST_LINES_OF_A_FILE, path
        for node in ast.walk(tree):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                docstring = node.body[0] if ast.get_docstring(node) else None
                lines = node.end_lineno - node.lineno + 1
                lines -= docstring.end_lineno - docstring.lineno + 1 if docstring else 0
                assert lines <= MOST_LINES_OF_A_FUNCTION, f"{path}: {node.name} has {lines} lines"


def test_every_package_is_installed_below_the_import_name():
    listed = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"][
        "setuptools"
    ]["packages"]
    packages = {module_of(path) for path in trees() if path.name == "__init__.py"}
    assert set(listed) == {IMPORT_NAME, *packages}
    assert all(path.parent / "__init__.py" in trees() for path in trees())


def test_every_decision_has_a_number_of_its_own_and_its_title_says_it():
    decisions = sorted((ROOT / "docs" / "decisions").glob("*.md"))
    numbers = [path.name[:4] for path in decisions]
    assert numbers == [f"{n:04d}" for n in range(1, len(decisions) + 1)]
    for path, number in zip(decisions, numbers, strict=True):
        title = path.read_text(encoding="utf-8").splitlines()[0]
        assert number in title, path.name
