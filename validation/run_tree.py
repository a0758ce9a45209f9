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
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO, Any

#: Modules that hold the diagnosis; the first that a tree has is taken.
_MODULES = (
    "carrierflex.workflows.diagnosis.diagnose_campaign",
    "carrierflex.workflows.diagnose_campaign",
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
            command = [str(python), str(Path(__file__).resolve()), "--worker", str(tree)]
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
                        _send(file, row | json.loads(answer))
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
    search_path = os.pathsep.join([str(root), str(tree)])
    return os.environ | variables | {"PYTHONPATH": search_path}


def _worker(tree: Path) -> None:
    """Answer requests of standard input, one line each."""
    replies = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what a tree prints must not stand among the replies
    diagnose = _diagnosis()
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
            diagnose(Path(request["campaign"]), out=out, report=False, quiet=True)
        except Exception as raised:  # a failure is an answer too, and a wrong one
            error = f"{type(raised).__name__}: {raised}"
        seconds = {"cpu": time.process_time() - start, "wall": time.perf_counter() - wall}
        _send(replies, {"seconds": seconds["cpu"], "wall": seconds["wall"], "error": error})


def _diagnosis() -> Any:
    """Function ``main`` of the tree that is imported."""
    for name in _MODULES:
        try:
            return importlib.import_module(name).main
        except ModuleNotFoundError as error:
            if error.name is None or not name.startswith(error.name):
                raise
    raise ImportError(f"the tree has none of the modules {', '.join(_MODULES)}")


def main() -> None:
    """Command line."""
    if sys.argv[1:2] == ["--worker"]:
        _worker(Path(sys.argv[2]))
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
    chosen = parser.parse_args()
    rows = [row for row in read_lines(chosen.cases) if row["folder"].startswith(chosen.only)]
    run_tree(
        chosen.tree.resolve(),
        chosen.python.absolute(),
        rows[: chosen.limit],
        chosen.cases.resolve().parent,
        chosen.out.absolute(),
        jobs=chosen.jobs,
        minutes=chosen.minutes,
    )


if __name__ == "__main__":
    main()
