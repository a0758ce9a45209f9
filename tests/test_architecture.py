"""The project's direction, kept by reading the source.

Imports point left, few files know a library, nothing is long.
"""

import ast
from pathlib import Path

ROOT = Path(__file__).parents[1]
CHAIN = ("geometry", "fe", "reduction", "simulation", "identification", "diagnosis", "workflows")
TREES = {
    path.relative_to(ROOT): ast.parse(path.read_text(encoding="utf-8"))
    for package in CHAIN
    for path in sorted((ROOT / package).rglob("*.py"))
}
#: The modules of fe that hold no finite elements, and so may be imported right of reduction.
CURVES = {"carrierflex.fe.deflection_curves", "carrierflex.fe.curve_files"}


def imports():
    """Package, file name and imported module of every import, also of those inside functions."""
    for path, tree in TREES.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.Import):
                yield from ((path.parts[0], path.name, alias.name) for alias in node.names)
            elif isinstance(node, ast.ImportFrom):
                yield path.parts[0], path.name, "." * node.level + str(node.module)


def test_packages_import_only_from_packages_to_their_left():
    for package, _, name in imports():
        library = name.split(".")[0]
        assert library not in ("", "tests"), f"{package} imports {name}"
        if library in CHAIN:
            assert CHAIN.index(library) <= CHAIN.index(package), f"{package} imports {name}"
        if library == "fe" and package in ("simulation", "identification", "diagnosis"):
            assert name in CURVES, f"{package} imports {name}"


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


def test_files_have_at_most_300_lines_and_functions_40_without_docstring():
    for path, tree in TREES.items():
        assert (ROOT / path).read_text(encoding="utf-8").count("\n") <= 300, path
        for node in ast.walk(tree):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                docstring = node.body[0] if ast.get_docstring(node) else None
                lines = node.end_lineno - node.lineno + 1
                lines -= docstring.end_lineno - docstring.lineno + 1 if docstring else 0
                assert lines <= 40, f"{path}: {node.name} has {lines} lines"
