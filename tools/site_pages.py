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
LOG_FORMATS = ROOT / "identification" / "logs" / "log_formats.py"
EXPORT_FORMATS = ROOT / "reduction" / "exports" / "export_formats.py"
IN_PYTHON = ROOT / "carrierflex" / "__init__.py"


def on_files(files: Files, *, config: Any) -> Files:
    """Add the pages that follow from the source."""
    pages = {"decisions/index.md": decisions_page(), "reference/tools.md": tools_page()}
    for page, text in pages.items():
        files.append(File.generated(config, page, content=text))
    return files


def on_page_markdown(markdown: str, *, page: Any, **_: Any) -> str:
    """Page with the section that follows from the source at its end."""
    sections = {
        "commands.md": every_command,
        "python.md": every_name,
        "performance.md": every_comparison,
        "glossary.md": theory,
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


def tools_page() -> str:
    """Which tool, which command: the lists of formats that are read and written."""
    lines = [
        "# Which tool, which command",
        "",
        "## Records of loggers, test systems and simulators",
        "",
        "`carrierflex new-campaign --kind KIND --from FILES --out map.toml`, then "
        "`carrierflex import FILES --map map.toml --out campaign` ([import](../import.md)); "
        "another simulator's prediction: `--simulated FILES`.",
        "",
        "| tool | file | what is taken | install | files of the tests by |",
        "|---|---|---|---|---|",
        "| loggers, spreadsheets, OpenFAST (`.out`) | text, any other suffix | every dialect | - | "
        "twelve loggers of the tests |",
    ]
    for suffixes, _, tools, taken, checked, *extra in _entries(LOG_FORMATS, "LOG_FORMATS"):
        names = ", ".join(f"`{suffix}`" for suffix in suffixes)
        install = f"`pip install 'carrierflex[{extra[0]}]'`" if extra else "-"
        lines.append(f"| {tools} | {names} | {taken} | {install} | {checked} |")
    lines += ["", "Not read:", "", "| file | why | what to do |", "|---|---|---|"]
    lines += [f"| {what} | {why} | {do} |" for what, why, do in _entries(LOG_FORMATS, "NOT_READ")]
    lines += [
        "",
        "## Bodies and linear models",
        "",
        "`carrierflex export BODY --format FORMAT --out FILE` ([exports]"
        "(../matrices.md#bodies-and-linear-models-for-other-programs)); BODY is a file of any row "
        "with suffixes under *read*, `--units mm-N` where it is in millimetres. Mounting and "
        "stage, nonlinear, as units of FMI 2.0 and 3.0: `carrierflex fmu` "
        "([co-simulation](../mounting_model.md#co-simulation)).",
        "",
        "| tool | format | written | read back by | read | what is taken | files of the tests by |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, tools, files, checked, *read in _entries(EXPORT_FORMATS, "EXPORT_FORMATS"):
        suffixes, taken, tried = read or ((), "-", "-")
        listed = ", ".join(f"`{suffix}`" for suffix in suffixes) or "-"
        lines.append(f"| {tools} | `{name}` | {files} | {checked} | {listed} | {taken} | {tried} |")
    lines += ["", "Not read as a body:", "", "| file | why | what to do |", "|---|---|---|"]
    for suffixes, what, why, do in _entries(EXPORT_FORMATS, "NOT_READ"):
        listed = ", ".join(f"`{suffix}`" for suffix in suffixes)
        lines.append(f"| {what} ({listed}) | {why} | {do} |")
    lines += [
        "",
        "Matrices of finite element programs go in by `carrierflex reduce --stiffness` "
        "([matrices](../matrices.md)), solids by `carrierflex cad-surfaces` ([CAD](../cad.md)). A "
        "gearbox in REXS (`.rexs`, `.rexsj`, `.rexsz`) becomes dimensions and a stage case by "
        "`carrierflex cases --rexs`; `carrierflex simulate --rexs` takes results back "
        "([stage](../stage_model.md#a-gearbox-in-rexs)).",
        "",
    ]
    return "\n".join(lines)


def _entries(path: Path, name: str) -> list[Any]:
    """Arguments of every entry of a list in a module, or the entries themselves."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    (value,) = (
        node.value
        for node in tree.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == name
    )
    assert isinstance(value, ast.Tuple)
    return [
        [ast.literal_eval(argument) for argument in entry.args]
        if isinstance(entry, ast.Call)
        else ast.literal_eval(entry)
        for entry in value.elts
    ]


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


def theory() -> str:
    """What each module computes and where it comes from: modules whose docstrings name sources."""
    lines = [
        "## Theory and its sources",
        "",
        "Docstrings of the modules have equations and signs; these modules name their sources.",
    ]
    for package in PACKAGES:
        lines += ["", f"### {package}", ""]
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
    references = []
    for node in ast.walk(tree):
        if not isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            continue
        below = (ast.get_docstring(node) or "").partition("References\n----------\n")[2]
        text = " ".join(below.split("\n\n")[0].split())
        if text:
            references.append(text.replace("[", "\\[").replace("*", "\\*"))
    return references
