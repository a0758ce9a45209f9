"""Pages of the site that follow from the source: commands, Python names, the list of decisions.

mkdocs calls `on_files`; nothing of carrierflex is imported.
"""

import ast
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]
COMMANDS = ROOT / "workflows" / "shell" / "commands.py"
IN_PYTHON = ROOT / "carrierflex" / "__init__.py"


def on_files(files: Files, *, config: Any) -> Files:
    """Add the pages that follow from the source."""
    pages = {
        "reference/commands.md": commands_page(),
        "reference/python.md": python_page(),
        "decisions/index.md": decisions_page(),
    }
    for place, text in pages.items():
        files.append(File.generated(config, place, content=text))
    return files


def commands_page() -> str:
    """Every command with the docstring of its workflow."""
    tree = ast.parse(COMMANDS.read_text(encoding="utf-8"))
    table = next(
        node.value
        for node in tree.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "COMMANDS"
    )
    assert isinstance(table, ast.Dict)
    lines = ["# Commands", "", "`carrierflex COMMAND --help` tells the same on the screen.", ""]
    for key, value in zip(table.keys, table.values, strict=True):
        assert isinstance(key, ast.Constant)
        assert isinstance(value, ast.Call)
        workflow = ast.literal_eval(value.args[0])
        lines += [
            f"## carrierflex {key.value}",
            "",
            f"::: carrierflex.workflows.{workflow}.main",
            "    options: {show_root_heading: false, show_root_toc_entry: false}",
            "",
        ]
    return "\n".join(lines)


def python_page() -> str:
    """What ``import carrierflex as cf`` offers."""
    tree = ast.parse(IN_PYTHON.read_text(encoding="utf-8"))
    modules = next(
        ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "_MODULES"
    )
    lines = ["# Python", "", "What `import carrierflex as cf` offers.", ""]
    for module, names in modules.items():
        for name in sorted(names, key=str.lower):
            lines += [f"::: carrierflex.workflows.in_python.{module}.{name}", ""]
    return "\n".join(lines)


def decisions_page() -> str:
    """The decisions by number."""
    lines = ["# Decisions", ""]
    for path in sorted((ROOT / "docs" / "decisions").glob("0*.md")):
        title = path.read_text(encoding="utf-8").splitlines()[0].lstrip("# ")
        lines.append(f"- [{title}]({path.name})")
    return "\n".join(lines) + "\n"
