"""Change one operator at a time in the modules that decide, and list what no test notices.

Every comparison is turned round (``<`` to ``>=``, ``==`` to ``!=``, ``in`` to ``not in``; beside a
whole number ``<`` to ``<=`` too), ``and`` and ``or`` are exchanged, a plus made a minus and back, a
sign or a ``not`` left out, a text emptied: a literal with a space, such as the reason of a verdict.
Each changed module meets its own tests in a process of its own; it is killed where they fail or do
not end. Run it with ``.venv/bin/python -P tools/mutate_decisions.py`` (names of modules after it:
those alone). The exit code is 1 where one survives that is not listed as equivalent.
"""

import ast
import contextlib
import copy
import importlib.util
import multiprocessing
import os
import resource
import shutil
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
#: Modules and the tests that state their behaviour.
TESTS = {
    "diagnosis/classes/decision.py": (
        "tests/diagnosis/classes/test_decision.py",
        "tests/diagnosis/classes/test_shape_decision.py",
    ),
    "diagnosis/classes/answer.py": (
        "tests/diagnosis/classes/test_answer.py",
        "tests/diagnosis/classes/test_laws.py",
        "tests/diagnosis/classes/test_law_sets.py",
    ),
    "diagnosis/verdict.py": ("tests/diagnosis/test_verdict.py",),
    "diagnosis/line_verdict.py": ("tests/diagnosis/test_line_verdict.py",),
    "diagnosis/classes/shares.py": ("tests/diagnosis/classes/test_shares.py",),
    "diagnosis/element/answer.py": (
        "tests/diagnosis/element/test_answer_of_table.py",
        "tests/diagnosis/element/test_loops_in_answers.py",
        "tests/diagnosis/element/test_element_shown.py",
    ),
    "diagnosis/mounting/answer.py": ("tests/diagnosis/mounting/test_sparsest_classes.py",),
    "diagnosis/inference/law_fits.py": (
        "tests/diagnosis/inference/test_law_fits.py",
        "tests/diagnosis/inference/test_selection.py",
    ),
    "diagnosis/diagnose.py": (
        "tests/diagnosis/test_parts_of_diagnosis.py",
        "tests/diagnosis/inference/test_separating_trial.py",
    ),
    "diagnosis/baseline_check.py": (
        "tests/diagnosis/wiring/test_wiring_rules.py",
        "tests/diagnosis/wiring/test_gain_rules.py",
    ),
}
#: What changes no answer, by file name, and why.
EQUIVALENT: dict[tuple[str, str], str] = {
    (
        "law_fits.py",
        "_SEED + self.thresholds.seed -> _SEED - self.thresholds.seed",
    ): "numbers a stream of draws: another stream has another number too, and none decides",
}
#: Of its processor, and by the clock of a busy machine: tests that take longer do not end.
_SECONDS, _BY_CLOCK = 60, 1200.0
#: Of the packages that are changed those that load all that the tests of a module need.
_LOAD_ALL = ("carrierflex.diagnosis.diagnose", "carrierflex.diagnosis.kinds")
_TURNED: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.GtE,
    ast.GtE: ast.Lt,
    ast.Gt: ast.LtE,
    ast.LtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
}
_MOVED: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
}
_SIGNS: dict[type[ast.operator], type[ast.operator]] = {ast.Add: ast.Sub, ast.Sub: ast.Add}


@dataclass(frozen=True)
class Mutant:
    """A module with one operator changed.

    Parameters
    ----------
    module : str
        Its path below the root.
    line : int
        Where the change is.
    before, after : str
        The expression.
    text : str
        The whole module.
    """

    module: str
    line: int
    before: str
    after: str
    text: str

    @property
    def change(self) -> str:
        """The change in words."""
        return f"{self.before} -> {self.after}"


def mutants(module: str) -> Iterator[Mutant]:
    """Every mutant of a module."""
    tree = ast.parse((ROOT / module).read_text(encoding="utf-8"))
    passed = _parts_and_docstrings(tree)
    for node in ast.walk(tree):
        if id(node) in passed:
            continue
        for changed in _changes(node):
            before = ast.unparse(node)
            original = copy.copy(node.__dict__)
            node.__dict__.update(changed)
            yield Mutant(module, original["lineno"], before, ast.unparse(node), ast.unparse(tree))
            node.__dict__.update(original)


def _parts_and_docstrings(tree: ast.Module) -> set[int]:
    """Literals that are no text of their own: parts of a formatted one, and docstrings."""
    nodes = list(ast.walk(tree))
    literals = [
        literal for node in nodes if isinstance(node, ast.JoinedStr) for literal in node.values
    ]
    return {id(node.value) for node in nodes if isinstance(node, ast.Expr)} | set(map(id, literals))


def _is_text(node: ast.AST) -> bool:
    """Whether an expression is a sentence or a part of one, as against an id or a format."""
    literals = node.values if isinstance(node, ast.JoinedStr) else [node]
    values = [literal.value for literal in literals if isinstance(literal, ast.Constant)]
    return any(isinstance(value, str) and " " in value for value in values)


def _changes(node: ast.AST) -> Iterator[dict[str, object]]:
    """Members of a node that make a mutant of it."""
    if isinstance(node, ast.Compare):
        for position, operator in enumerate(node.ops):
            ends = (node.left, *node.comparators)[position : position + 2]
            counts = any(
                isinstance(operand, ast.Constant) and type(operand.value) is int for operand in ends
            )
            for table in (_TURNED, _MOVED) if counts else (_TURNED,):
                if type(operator) in table:
                    ops = list(node.ops)
                    ops[position] = table[type(operator)]()
                    yield {"ops": ops}
    elif isinstance(node, ast.BoolOp):
        yield {"op": ast.Or() if isinstance(node.op, ast.And) else ast.And()}
    elif isinstance(node, ast.BinOp | ast.AugAssign) and type(node.op) in _SIGNS:
        yield {"op": _SIGNS[type(node.op)]()}
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield {"op": ast.UAdd()}
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        # Twice not is the truth of what it stood before.
        yield {"operand": ast.UnaryOp(ast.Not(), node.operand)}
    elif _is_text(node):
        yield {"values": []} if isinstance(node, ast.JoinedStr) else {"value": ""}


def is_killed(mutant: Mutant, folder: Path) -> bool:
    """Whether the tests of a module notice a mutant of it.

    Parameters
    ----------
    mutant : Mutant
        Mutant.
    folder : Path
        Copy of the packages below their import name.
    """
    target = folder / "carrierflex" / mutant.module
    target.write_text(mutant.text, encoding="utf-8")
    process = multiprocessing.get_context("fork").Process(
        target=_tested, args=(folder, TESTS[mutant.module])
    )
    process.start()
    process.join(_BY_CLOCK)
    is_alive = process.is_alive()
    if is_alive:
        process.kill()
        process.join()
    shutil.copy(ROOT / mutant.module, target)
    return is_alive or process.exitcode != 0


def _tested(folder: Path, tests: tuple[str, ...]) -> None:
    """Run tests against the packages of a folder; the exit code is pytest's."""
    resource.setrlimit(resource.RLIMIT_CPU, (_SECONDS, _SECONDS))
    paths = f"pythonpath={folder} {ROOT}"
    # Neither fixtures of all tests nor a message that nobody reads: a mutant takes half a second.
    quick = ("-x", "-q", "--noconftest", "--assert=plain", "-p", "no:cacheprovider")
    options = (*quick, "-o", paths, "--rootdir", str(ROOT))
    with Path(os.devnull).open("w") as nothing, contextlib.redirect_stdout(nothing):
        os.dup2(nothing.fileno(), 2)
        code = pytest.main([*options, *(str(ROOT / test) for test in tests)])
    os._exit(int(code))


def linked_packages(folder: Path) -> None:
    """Packages below their import name: those that are changed as copies, the others as links."""
    top = folder / "carrierflex"
    top.mkdir()
    changed = {Path(module).parts[0] for module in TESTS}
    for package in (ROOT / "carrierflex").iterdir():
        if package.name == "__pycache__":
            continue
        if package.name in changed:
            ignored = shutil.ignore_patterns("__pycache__")
            shutil.copytree(package.resolve(), top / package.name, ignore=ignored)
        else:
            (top / package.name).symlink_to(package.resolve())


def load_unchanged(folder: Path) -> None:
    """Load all that stays as it is once, for all processes that are forked.

    The packages that are changed are compiled here once, all but the modules that are changed: a
    compiled one stands for every text of its size and second.
    """
    sys.path.insert(0, str(folder))
    for name in _LOAD_ALL:
        importlib.import_module(name)
    sys.dont_write_bytecode = True
    for module in TESTS:
        source = folder / "carrierflex" / module
        Path(importlib.util.cache_from_source(source)).unlink(missing_ok=True)
    changed = {f"carrierflex.{Path(module).parts[0]}" for module in TESTS}
    for name in [loaded for loaded in sys.modules if ".".join(loaded.split(".")[:2]) in changed]:
        del sys.modules[name]


def main() -> int:
    """Try every mutant and print the survivors."""
    chosen = list(_chosen(sys.argv[1:]))
    os.chdir(ROOT)
    counts = {}
    survivors = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        linked_packages(folder)
        load_unchanged(folder)
        for module in chosen:
            candidates = list(mutants(module))
            plain = Mutant(module, 0, "", "", (ROOT / module).read_text(encoding="utf-8"))
            if is_killed(plain, folder):
                raise SystemExit(f"{module}: its tests fail without any change")
            alive = [mutant for mutant in candidates if not is_killed(mutant, folder)]
            counts[module] = (len(candidates), len(alive))
            survivors += alive
    return _printed(counts, survivors)


def _chosen(names: list[str]) -> Iterator[str]:
    """Modules of some file names; all of them without names."""
    if not names:
        yield from TESTS
    for name in names:
        matches = [module for module in TESTS if name in (module, Path(module).name)]
        if len(matches) != 1:
            raise SystemExit(
                f"'{name}' names {len(matches)} modules; expected one of {list(TESTS)}"
            )
        yield from matches


def _printed(counts: dict[str, tuple[int, int]], survivors: list[Mutant]) -> int:
    """Print both tables; 1 where a survivor is not listed as equivalent."""
    print("| module | mutants | killed | equivalent | survive |\n|---|---|---|---|---|")
    known = [
        survivor
        for survivor in survivors
        if (Path(survivor.module).name, survivor.change) in EQUIVALENT
    ]
    for module, (total, alive) in counts.items():
        listed = sum(survivor.module == module for survivor in known)
        print(f"| {module} | {total} | {total - alive} | {listed} | {alive - listed} |")
    print("\n| module | line | change | why it changes nothing |\n|---|---|---|---|")
    for survivor in survivors:
        reason = EQUIVALENT.get((Path(survivor.module).name, survivor.change), "**survives**")
        print(f"| {survivor.module} | {survivor.line} | `{survivor.change}` | {reason} |")
    return int(len(known) < len(survivors))


if __name__ == "__main__":
    sys.exit(main())
