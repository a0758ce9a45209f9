"""The project's direction, kept by reading the source.

Imports point left, without circles of files or folders; few files know a library.
"""

import ast
import importlib
import subprocess
import sys
import tomllib
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

from setuptools import find_packages

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
BESIDE_THE_CHAIN = ("benchmarks", "examples", "studies", "validation")
IMPORT_NAME = "carrierflex"
KINDS = ("carrier", "element", "mounting")
#: What every kind is made of: it knows none of them.
BELOW_THE_KINDS = ("comparison", "inference", "gap")
#: The modules of fe that hold no finite elements, and so may be imported right of reduction.
CURVES = {"carrierflex.fe.deflection_curves", "carrierflex.fe.curve_files"}
#: Imports from folder to folder, below the import name, that close a circle: the fewest to turn
#: round or to move. No entry may be added; one that closes no circle any more has to go.
IMPORTS_THAT_CLOSE_A_CIRCLE = {
    ("blind_check.truth", "blind_check"),
    ("blind_check.truth", "blind_check.truth.carrier"),
    ("blind_check.truth", "blind_check.truth.element"),
    ("blind_check.truth", "blind_check.truth.mounting"),
    ("blind_check.truth.carrier", "blind_check"),
    ("blind_check.truth.element", "blind_check"),
    ("blind_check.truth.mounting", "blind_check"),
    ("diagnosis.carrier", "diagnosis.carrier.classes"),
    ("fe", "fe.matrices"),
    ("geometry", "geometry.cad_recognition"),
    ("geometry", "geometry.given_meshes"),
    ("identification.estimation", "identification.carrier"),
    ("simulation", "simulation.carrier.measured_laws"),
    ("simulation", "simulation.stage"),
    ("simulation.carrier", "simulation.carrier.effects"),
    ("simulation.carrier", "simulation.carrier.measured_laws"),
    ("simulation.mounting.measured_laws", "simulation.mounting"),
    ("simulation.stage", "simulation.mounting"),
}


@cache
def trees(folders=CHAIN):
    """Syntax tree of every file; not at import, where every process of the tests would read all."""
    return {
        path.relative_to(ROOT): ast.parse(path.read_text(encoding="utf-8"))
        for folder in folders
        for path in sorted((ROOT / folder).rglob("*.py"))
    }


def module_of(path):
    """Name of a file's module, in a stage below the import name.

    ``carrierflex.diagnosis.carrier`` for ``diagnosis/carrier/__init__.py``.
    """
    below = (IMPORT_NAME,) if path.parts[0] in CHAIN else ()
    return ".".join((*below, *path.with_suffix("").parts)).removesuffix(".__init__")


def with_benchmarks():
    """Syntax trees of the stages and of the benchmarks, which import them."""
    return trees() | trees(("benchmarks",))


@cache
def modules():
    return {module_of(path) for path in with_benchmarks()}


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
        for path, tree in with_benchmarks().items()
    }


@cache
def graph_of_folders():
    """Folders that the files of each folder import; those of its sub-folders stand apart."""
    folders = {module_of(path): module_of(path.parent) for path in with_benchmarks()}
    graph = {}
    for module, imported in graph_of_imports().items():
        graph.setdefault(folders[module], set()).update(folders[name] for name in imported)
    return {folder: imported - {folder} for folder, imported in graph.items()}


def circle_in(graph, *, without=()):
    """Nodes of one circle of a graph, some of its edges left out; none where there is no circle."""
    edges = {
        node: {other for other in imported if (node, other) not in without}
        for node, imported in graph.items()
    }
    try:
        TopologicalSorter(edges).prepare()
    except CycleError as error:
        return error.args[1]
    return []


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
    assert not circle_in(graph_of_imports())


def test_no_circle_between_any_two_folders_but_those_known():
    known = {
        (f"{IMPORT_NAME}.{folder}", f"{IMPORT_NAME}.{imported}")
        for folder, imported in IMPORTS_THAT_CLOSE_A_CIRCLE
    }
    assert not circle_in(graph_of_folders(), without=known)
    for entry in known:
        assert circle_in(graph_of_folders(), without=known - {entry}), f"to be removed: {entry}"


def test_a_circle_is_found():
    graph = {"a": {"b"}, "b": {"c"}, "c": {"a"}}
    assert set(circle_in(graph)) == {"a", "b", "c"}
    assert not circle_in(graph, without={("c", "a")})


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
    allowed = {"inference", "comparison", "kind"}
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


def test_the_import_name_holds_a_link_to_every_stage():
    links = {
        path.name: path.readlink() for path in (ROOT / IMPORT_NAME).iterdir() if path.is_symlink()
    }
    assert links == {package: Path("..", package) for package in CHAIN}


def test_every_package_and_the_mark_of_types_are_installed():
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    setup = tomllib.loads(text)["tool"]["setuptools"]
    installed = find_packages(str(ROOT), include=setup["packages"]["find"]["include"])
    packages = {module_of(path) for path in trees() if path.name == "__init__.py"}
    assert set(installed) == {IMPORT_NAME, *packages}
    assert all(path.parent / "__init__.py" in trees() for path in trees())
    assert "py.typed" in setup["package-data"][IMPORT_NAME]
    assert (ROOT / IMPORT_NAME / "py.typed").is_file()


def test_tests_and_the_processes_that_they_start_run_the_code_of_this_checkout(tmp_path):
    assert Path(importlib.import_module("carrierflex.files").__file__).is_relative_to(ROOT)
    program = "import carrierflex.files; print(carrierflex.files.__file__)"
    command = [sys.executable, "-P", "-c", program]
    started = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert Path(started.stdout.strip()) == ROOT / IMPORT_NAME / "files" / "__init__.py"


def test_every_decision_has_a_number_of_its_own_and_its_title_says_it():
    decisions = sorted((ROOT / "docs" / "decisions").glob("*.md"))
    numbers = [path.name[:4] for path in decisions]
    assert numbers == [f"{n:04d}" for n in range(1, len(decisions) + 1)]
    for path, number in zip(decisions, numbers, strict=True):
        title = path.read_text(encoding="utf-8").splitlines()[0]
        assert number in title, path.name
