r"""Diagnoses exported campaigns with the code of any tree, case by case, in processes of their own.

Every worker imports the given tree and no other, on one thread; the time is the processor time of
the diagnosis alone, without start-up and imports, and without the report. Documents stay in
``FOLDER/answers_NAME/CASE``, one line a case in ``FOLDER/answers_NAME.jsonl``; the same command
again goes on where it was interrupted. `compare_answers` reads what this writes.

    python -m validation.run_tree --tree TREE --python TREE/.venv/bin/python \
        --cases FOLDER/campaigns/cases.jsonl --out FOLDER/answers_NAME.jsonl --jobs 2
"""

import argparse
import importlib
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import IO, Any

WHOLE, BY_CLASS = "whole", "by_class"
#: Modules that hold the two diagnoses; the first that a tree has is taken.
_WHOLE_MODULES = (
    "carrierflex.workflows.diagnosis.diagnose_campaign",
    "carrierflex.workflows.diagnose_campaign",
)
_BY_CLASS_MODULES = (
    "carrierflex.workflows.diagnosis.diagnose_case",
    "carrierflex.validation.diagnose_case",
    "validation.diagnose_case",
)
_NO_PACKAGES = ("build", "docs", "tests", "benchmarks", "tools", "carrierflex")


def run_tree(
    tree: Path,
    python: Path,
    rows: Sequence[dict[str, Any]],
    campaigns: Path,
    out: Path,
    *,
    jobs: int = 1,
    path: str = WHOLE,
    minutes: float = float("inf"),
) -> None:
    """Diagnose campaigns with one tree.

    Parameters
    ----------
    tree, python : Path
        Root of the checkout, and an interpreter that has what it depends on.
    rows : sequence of dict
        Cases: ``case``, ``kind``, ``family``, and ``folder`` below `campaigns`.
    campaigns : Path
        Folder of the campaigns.
    out : Path
        File of the answers (JSON lines), which is added to.
    jobs : int
        Worker processes.
    path : str
        WHOLE, as users run it, or BY_CLASS, without the search for laws.
    minutes : float
        No case is begun after this wall time.
    """
    finished = {row["case"] for row in read_lines(out)}
    written = [row for row in rows if (campaigns / row["folder"] / "campaign.toml").is_file()]
    waiting = iter([row for row in written if row["case"] not in finished])
    folder = out.with_suffix("")
    lock, ends = threading.Lock(), time.monotonic() + 60.0 * minutes
    with tempfile.TemporaryDirectory() as links, out.open("a", encoding="utf-8") as file:
        environment = _environment(tree, Path(links))

        def work() -> None:
            command = [str(python), str(Path(__file__).resolve()), "--worker", path, str(tree)]
            with subprocess.Popen(
                command,
                env=environment,
                cwd=links,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
            ) as worker:
                assert worker.stdin is not None
                assert worker.stdout is not None
                for row in _shared(waiting, lock, ends):
                    request = {
                        "campaign": str(campaigns / row["folder"]),
                        "out": str(folder / row["case"]),
                    }
                    _send(worker.stdin, request)
                    answer = worker.stdout.readline()
                    if not answer:
                        raise RuntimeError(f"{row['case']}: the worker ended")
                    with lock:
                        _send(file, row | {"path": path} | json.loads(answer))
                worker.stdin.close()

        threads = [threading.Thread(target=work) for _ in range(jobs)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()


def read_lines(path: Path) -> list[dict[str, Any]]:
    """Rows of a file of JSON lines; none where it does not exist."""
    if not path.is_file():
        return []
    lines = path.read_text(encoding="utf-8").splitlines()
    return [json.loads(line) for line in lines if line.strip()]


def _shared(rows: Iterator[Any], lock: threading.Lock, ends: float) -> Iterator[dict[str, Any]]:
    """Rows that several threads take in turn, until the time is over."""
    while time.monotonic() < ends:
        with lock:
            row = next(rows, None)
        if row is None:
            return
        yield row


def _send(file: IO[str], content: dict[str, Any]) -> None:
    file.write(json.dumps(content) + "\n")
    file.flush()


def _environment(tree: Path, links: Path) -> dict[str, str]:
    """Environment in which the tree's packages come first: its own links, or links made here."""
    if (tree / "carrierflex" / "diagnosis").exists():
        root = tree
    else:
        root = links
        package = links / "carrierflex"
        package.mkdir()
        for source in (tree / "carrierflex").glob("*.py"):
            (package / source.name).symlink_to(source)
        for source in tree.iterdir():
            if (source / "__init__.py").is_file() and source.name not in _NO_PACKAGES:
                (package / source.name).symlink_to(source)
    variables = dict.fromkeys(
        ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
    )
    found = os.pathsep.join([str(root), str(tree)])
    return os.environ | variables | {"PYTHONPATH": found}


def _worker(path: str, tree: Path) -> None:
    """Answer requests of standard input, one line each."""
    replies = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what a tree prints must not stand among the replies
    diagnose = _diagnosis(path)
    for name in ("carrierflex", "carrierflex.diagnosis"):
        origin = Path(str(importlib.import_module(name).__file__)).resolve()
        if not origin.is_relative_to(tree.resolve()):
            raise ImportError(f"{name} comes from {origin}; expected it below {tree}")
    for line in sys.stdin:
        request = json.loads(line)
        out = Path(request["out"])
        out.mkdir(parents=True, exist_ok=True)
        start, wall, error = time.process_time(), time.perf_counter(), None
        try:
            diagnose(Path(request["campaign"]), out)
        except Exception as raised:  # a failure is an answer too, and a wrong one
            error = f"{type(raised).__name__}: {raised}"
        seconds = {"cpu": time.process_time() - start, "wall": time.perf_counter() - wall}
        if error is None and (out / "times.json").is_file():
            error = json.loads((out / "times.json").read_text(encoding="utf-8"))["error"]
        _send(replies, {"seconds": seconds["cpu"], "wall": seconds["wall"], "error": error})


def _diagnosis(path: str) -> Callable[[Path, Path], object]:
    """The diagnosis of the tree that is imported."""
    if path == BY_CLASS:
        return _first_module(_BY_CLASS_MODULES).classify_case
    main = _first_module(_WHOLE_MODULES).main
    return lambda campaign, out: main(campaign, out=out, report=False, quiet=True)


def _first_module(names: Sequence[str]) -> Any:
    for name in names:
        try:
            return importlib.import_module(name)
        except ModuleNotFoundError as error:
            if error.name is None or not name.startswith(error.name):
                raise
    raise ImportError(f"the tree has none of the modules {', '.join(names)}")


def main() -> None:
    """Command line."""
    if sys.argv[1:2] == ["--worker"]:
        _worker(sys.argv[2], Path(sys.argv[3]))
        return
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tree", type=Path, required=True, help="root of the checkout")
    parser.add_argument("--python", type=Path, default=Path(sys.executable), help="interpreter")
    parser.add_argument("--cases", type=Path, required=True, help="list of the cases (cases.jsonl)")
    parser.add_argument("--out", type=Path, required=True, help="file of the answers (.jsonl)")
    parser.add_argument("--only", default="", help="only cases whose folder begins with this")
    parser.add_argument("--jobs", type=int, default=1, help="worker processes; default: 1")
    parser.add_argument("--limit", type=int, help="only the first so many of these")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="begin no case later")
    parser.add_argument("--by-class", action="store_true", help="without the search for laws")
    chosen = parser.parse_args()
    rows = [row for row in read_lines(chosen.cases) if row["folder"].startswith(chosen.only)]
    run_tree(
        chosen.tree.resolve(),
        chosen.python.absolute(),
        rows[: chosen.limit],
        chosen.cases.resolve().parent,
        chosen.out.absolute(),
        jobs=chosen.jobs,
        path=BY_CLASS if chosen.by_class else WHOLE,
        minutes=chosen.minutes,
    )


if __name__ == "__main__":
    main()
