"""Pages and sections of the site that follow from the source.

Commands, Python names, decisions, comparisons with others, theory with its sources.

mkdocs calls the functions named `on_...`; nothing of carrierflex is imported.
"""

import ast
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]
BENCHMARKS = ROOT / "benchmarks"
PACKAGES = (
    "geometry",
    "fe",
    "reduction",
    "simulation",
    "identification",
    "diagnosis",
    "blind_check",
)
COMMANDS = ROOT / "workflows" / "shell" / "commands.py"
IN_PYTHON = ROOT / "carrierflex" / "__init__.py"


def on_files(files: Files, *, config: Any) -> Files:
    """Add the pages that follow from the source."""
    pages = {"decisions/index.md": decisions_page(), "reference/theory.md": theory_page()}
    for place, text in pages.items():
        files.append(File.generated(config, place, content=text))
    return files


def on_page_markdown(markdown: str, *, page: Any, **_: Any) -> str:
    """Page with the section that follows from the source at its end."""
    sections = {
        "commands.md": every_command,
        "python.md": every_name,
        "performance.md": every_comparison,
    }
    section = sections.get(page.file.src_uri)
    return markdown if section is None else f"{markdown}\n\n{section()}"


def every_command() -> str:
    """Every command with the docstring of its workflow."""
    tree = ast.parse(COMMANDS.read_text(encoding="utf-8"))
    table = next(
        node.value
        for node in tree.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "COMMANDS"
    )
    assert isinstance(table, ast.Dict)
    lines = ["## Every command", "", "`carrierflex COMMAND --help` shows the same text.", ""]
    for key, value in zip(table.keys, table.values, strict=True):
        assert isinstance(key, ast.Constant)
        assert isinstance(value, ast.Call)
        workflow = ast.literal_eval(value.args[0])
        lines += [
            f"### carrierflex {key.value}",
            "",
            f"::: carrierflex.workflows.{workflow}.main",
            "    options: {show_root_heading: false, show_root_toc_entry: false}",
            "",
        ]
    return "\n".join(lines)


def every_name() -> str:
    """What ``import carrierflex as cf`` offers."""
    tree = ast.parse(IN_PYTHON.read_text(encoding="utf-8"))
    modules = next(
        ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "_MODULES"
    )
    lines = ["## Every name of `import carrierflex as cf`", ""]
    for module, names in modules.items():
        for name in sorted(names, key=str.lower):
            lines += [
                f"::: carrierflex.workflows.in_python.{module}.{name}",
                "    options: {heading_level: 3}",
                "",
            ]
    return "\n".join(lines)


def decisions_page() -> str:
    """The decisions by number."""
    lines = ["# Decisions", ""]
    for path in sorted((ROOT / "docs" / "decisions").glob("0*.md")):
        title = path.read_text(encoding="utf-8").splitlines()[0].lstrip("# ")
        lines.append(f"- [{title}]({path.name})")
    return "\n".join(lines) + "\n"


def every_comparison() -> str:
    """Every comparison with another code or method, what it asks, and its command."""
    lines = ["## Comparison with other codes", "", "| what is compared | command |", "|---|---|"]
    for path in sorted(BENCHMARKS.glob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        if any(isinstance(node, ast.FunctionDef) and node.name == "ratios" for node in tree.body):
            lines.append(f"| {_first_line(tree)} | `make bench ONLY={path.stem}` |")
    return "\n".join(
        [
            *lines,
            "",
            "Other comparisons: [the mounting and Exudyn](mounting_model.md#speed), [table 5 in "
            "Exudyn](papers.md#table-5), [couplings and bases of the reduction](reduction.md), "
            "[matrices of CalculiX and others](matrices.md), [diagnoses and two plain "
            "methods](validation.md#others-can-enter). Tests compare with CalculiX and Code_Aster "
            "too (`tests/independent_codes`).",
            "",
        ]
    )


def theory_page() -> str:
    """What each module computes and where it comes from: modules whose docstrings name sources."""
    lines = [
        "# Theory and its sources",
        "",
        "Docstrings of the modules have equations and signs; these modules name their sources.",
    ]
    for package in PACKAGES:
        lines += ["", f"## {package}", ""]
        for path in sorted((ROOT / package).rglob("*.py")):
            tree = ast.parse(path.read_text(encoding="utf-8"))
            sources = sorted(set(_sources(tree)))
            if sources:
                name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
                lines.append(f"- `{name}`: {_first_line(tree)}")
                lines += [f"    - {source}" for source in sources]
    return "\n".join(lines) + "\n"


def _first_line(tree: ast.Module) -> str:
    return (ast.get_docstring(tree) or "").partition("\n")[0].replace("|", "\\|")


def _sources(tree: ast.Module) -> list[str]:
    """Text below "References" in the docstrings of a module, its classes and functions."""
    found = []
    for node in ast.walk(tree):
        if not isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            continue
        below = (ast.get_docstring(node) or "").partition("References\n----------\n")[2]
        text = " ".join(below.split("\n\n")[0].split())
        if text:
            found.append(text.replace("[", "\\[").replace("*", "\\*"))
    return found
