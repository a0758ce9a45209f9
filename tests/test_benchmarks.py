"""The command of the benchmarks, on stubs: no benchmark is run here."""

import ast
import json
import subprocess
import sys
import textwrap
from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console

from benchmarks.__main__ import EXIT_FAILED, EXIT_INTERRUPTED, main, run
from benchmarks.ratio import DIFFERENCE, SPEED, TIME, Absent, Failed, Ratio, at_least, at_most
from benchmarks.report import Report, ratio_table
from benchmarks.run import BENCHMARKS, chosen

FOLDER = Path(__file__).parents[1] / "benchmarks"

#: Opening of a stub benchmark.
OPENING = """
from benchmarks.ratio import TIME, Ratio
QUICK = {"size": 1.0}
"""
GOOD = """
def ratios(size=4.0):
    yield Ratio("a body", TIME, size, "a peer", 8.0)
"""


@pytest.fixture
def stub(tmp_path, monkeypatch):
    """Write a benchmark that the processes of the runner can import."""
    monkeypatch.syspath_prepend(tmp_path)

    def write(name, text):
        (tmp_path / f"{name}.py").write_text(OPENING + textwrap.dedent(text))
        return name

    return write


def report_of(names, path, *, quick=True):
    """Exit code and JSON of a run of stubs."""
    code = run(names, Report(quick, path), package="")
    return code, json.loads(path.read_text())


def function_of(module):
    """Syntax tree of a module and its function ``ratios``, None without one."""
    tree = ast.parse((FOLDER / f"{module}.py").read_text(encoding="utf-8"))
    functions = [node for node in tree.body if isinstance(node, ast.FunctionDef)]
    return tree, next((node for node in functions if node.name == "ratios"), None)


def test_every_module_that_yields_ratios_is_listed_by_the_command(capsys):
    modules = [path.stem for path in FOLDER.glob("*.py")]
    benchmarks = {name for name in modules if function_of(name)[1] is not None}
    assert main(list_names=True) == 0
    assert set(capsys.readouterr().out.split()) == benchmarks
    assert len(benchmarks) >= 14


@pytest.mark.parametrize("name", BENCHMARKS)
def test_quick_arguments_are_arguments_of_the_benchmark(name):
    tree, function = function_of(name)
    assert f"python -m benchmarks.{name}" in ast.get_docstring(tree)
    assignments = [node for node in tree.body if isinstance(node, ast.Assign)]
    [quick] = [node for node in assignments if ast.unparse(node.targets[0]) == "QUICK"]
    arguments = {argument.arg for argument in [*function.args.args, *function.args.kwonlyargs]}
    assert set(ast.literal_eval(quick.value)) <= arguments


def test_a_ratio_above_one_always_means_that_ours_is_better():
    assert Ratio("", TIME, 2.0, "peer", 6.0).ratio == 3.0
    assert Ratio("", SPEED, 6.0, "peer", 2.0).ratio == 3.0
    assert Ratio("", TIME, 2.0).ratio is None


def test_what_is_wanted_is_wanted_of_the_ratio_or_else_of_the_value():
    assert Ratio("", TIME, 2.0, "peer", 6.0, at_least(3)).met
    assert not Ratio("", TIME, 2.0, "peer", 5.0, at_least(3)).met
    assert Ratio("", DIFFERENCE, 1e-13, "peer", None, at_most(1e-12)).met
    assert not Ratio("", DIFFERENCE, float("nan"), "peer", None, at_most(1e-12)).met
    assert Ratio("", TIME, 2.0).met is None


def test_benchmarks_are_chosen_by_name_and_by_part():
    assert chosen([]) == list(BENCHMARKS)
    names = chosen(["mounting_speed", "assembly"])
    assert names == ["assembly_against_scikit_fem", "mounting_speed"]
    # A name that is also a part of another chooses itself only.
    assert chosen(["speed"], ["speed", "stage_speed"]) == ["speed"]


def test_an_unknown_name_is_refused_in_one_line(capsys):
    with pytest.raises(ValueError, match="no benchmark 'nonsense'; expected one of assembly"):
        chosen(["nonsense"])
    assert main("nonsense") == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize("width", [80, 120])
def test_the_table_holds_every_row_whole_at_any_usual_width(width):
    long = "hydro-dynamic, damping of the paper, with noise"
    exudyn = "Exudyn, our condensed equations"
    rows = [
        (BENCHMARKS[0], Ratio(long, TIME, 0.0812, "scikit-fem", 2.37, at_least(20), "of three")),
        (BENCHMARKS[0], Ratio("K", DIFFERENCE, 4e-16, "scikit-fem", None, at_most(1e-12))),
        (BENCHMARKS[6], Ratio("b", SPEED, 520237.0, exudyn, 24618.0, at_least(100))),
        (BENCHMARKS[6], Absent("CalculiX", "no command ccx")),
        (BENCHMARKS[7], Failed("ValueError: broken")),
    ]
    out = StringIO()
    Console(file=out, width=width, highlight=False).print(ratio_table(rows))
    text = out.getvalue()
    numbers = ["0.0812 s", "29.2", "4.0e-16", "520237 s/s", "21.1"]
    wanted = [">= 20 yes", "<= 1e-12 yes", ">= 100 no"]
    reasons = ["CalculiX", "no command ccx", "ValueError: broken", "failed"]
    for cell in [*BENCHMARKS[6:8], *numbers, *wanted, *reasons]:
        assert cell in text, cell
    assert "…" not in text
    assert max(map(len, text.splitlines())) <= width


def test_the_file_holds_ratios_machine_and_versions(stub, tmp_path):
    code, content = report_of([stub("good", GOOD)], tmp_path / "bench.json")
    assert code == 0
    assert content["schema"] == 1
    assert content["complete"] is True
    assert content["machine"]["cores"] >= 1
    assert content["versions"]["numpy"]
    assert content["seconds"]["good"] > 0.0
    [row] = content["rows"]
    assert row["benchmark"] == "good"
    assert row["state"] == "measured"
    # The size of a quick run.
    assert (row["value"], row["peer_value"], row["ratio"]) == (1.0, 8.0, 8.0)


def test_a_run_that_is_not_quick_takes_the_benchmarks_own_sizes(stub, tmp_path):
    _, content = report_of([stub("good", GOOD)], tmp_path / "bench.json", quick=False)
    assert content["rows"][0]["ratio"] == 2.0


def test_one_that_fails_leaves_the_rows_of_the_others(stub, tmp_path, capsys):
    failing = """
    def ratios(size):
        yield Ratio("before", TIME, size)
        raise ValueError("two\\nlines")
    """
    dying = """
    import os
    def ratios(size):
        os._exit(9)
        yield
    """
    names = [stub("failing", failing), stub("dying", dying), stub("good", GOOD)]
    code, content = report_of(names, tmp_path / "bench.json")
    assert code == EXIT_FAILED
    assert content["complete"] is True
    rows = [(row["benchmark"], row["state"], row.get("reason")) for row in content["rows"]]
    assert rows == [
        ("failing", "measured", None),
        ("failing", "failed", "ValueError: two lines"),
        ("dying", "failed", "its process ended with exit code 9"),
        ("good", "measured", None),
    ]
    assert "ValueError: two lines" in capsys.readouterr().out


def test_an_independent_code_that_is_not_installed_is_absent_and_no_failure(stub, tmp_path):
    absent = """
    def ratios(size):
        raise ModuleNotFoundError("No module named 'exudyn'", name="exudyn.FEM")
        yield
    """
    code, content = report_of([stub("absent", absent)], tmp_path / "bench.json")
    assert code == 0
    assert content["rows"][0]["state"] == "absent"
    assert content["rows"][0]["peer"] == "Exudyn"


def test_an_interrupted_run_keeps_what_was_measured(stub, tmp_path):
    path = tmp_path / "bench.json"
    # The interruption comes once the row has arrived; before that there is nothing to keep.
    interrupting = f"""
    import os, pathlib, signal, tempfile, time
    def ratios(size):
        with tempfile.TemporaryDirectory(dir={str(tmp_path)!r}, prefix="record"):
            yield Ratio("before", TIME, size)
            while "before" not in pathlib.Path({str(path)!r}).read_text():
                time.sleep(0.01)
            os.kill(os.getppid(), signal.SIGINT)
            time.sleep(60)
    """
    # In a process of its own: an interruption that comes late must not end the tests.
    runner = f"""
    import pathlib, signal, sys
    if __name__ == "__main__":
        signal.signal(signal.SIGINT, signal.default_int_handler)
        sys.path[:0] = [{str(tmp_path)!r}, {str(FOLDER.parent)!r}]
        from benchmarks import run as benchmark_run
        from benchmarks.__main__ import run
        from benchmarks.report import Report
        benchmark_run._GRACE = 0.1
        report = Report(True, pathlib.Path({str(path)!r}))
        sys.exit(run(["interrupting", "good"], report, package=""))
    """
    stub("interrupting", interrupting)
    stub("good", GOOD)
    script = tmp_path / "runner.py"
    script.write_text(textwrap.dedent(runner))
    result = subprocess.run([sys.executable, str(script)], capture_output=True, check=False)
    assert result.returncode == EXIT_INTERRUPTED, result.stderr
    content = json.loads(path.read_text())
    assert content["complete"] is False
    assert [row["case"] for row in content["rows"]] == ["before"]
    assert not list(tmp_path.glob("record*")), "the benchmark's temporary files stayed"
    assert not list(tmp_path.glob(".part*"))
