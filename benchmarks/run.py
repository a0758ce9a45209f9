"""The list of benchmarks, and how one is run: in a process of its own, row by row."""

import functools
import importlib
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path

from benchmarks.ratio import Absent, Failed, Row

#: Every benchmark, from the finite elements to the identification.
BENCHMARKS = (
    "assembly_against_scikit_fem",
    "reduction_stages",
    "distributing_against_rigid",
    "symmetric_reduction",
    "mesh_study_against_factorisation",
    "sensitivities_against_reductions",
    "cholmod_against_mkl",
    "given_matrices",
    "previews_of_cad_carriers",
    "reduction_against_exudyn",
    "reduction_against_calculix",
    "fixed_against_free_interface",
    "mounting_speed",
    "mounting_equal_error",
    "mounting_batch_and_record",
    "stage_speed",
    "stage_load_cases",
    "main_job_stages",
    "main_job_in_time",
    "stage_against_exudyn",
    "carrier_identification_speed",
    "bushing_identification_speed",
    "long_record_memory",
    "many_runs",
    "long_element_records",
    "start_up",
)

#: Packages that only comparisons need, by the name of the module that is imported.
_INDEPENDENT = {"exudyn": Absent("Exudyn", "the package exudyn is not installed")}

#: Seconds that an interrupted benchmark has to remove its temporary files.
_GRACE = 5.0


def chosen(names: Sequence[str], available: Sequence[str] = BENCHMARKS) -> list[str]:
    """Benchmarks whose name is, or contains, one of `names`; all of them where none is given.

    Raises
    ------
    ValueError
        Where a name fits no benchmark.
    """
    for name in names:
        if not any(name in candidate for candidate in available):
            raise ValueError(
                f"no benchmark {name!r}; expected one of {', '.join(available)}, or a part"
            )
    exact = [name for name in names if name in available]
    fragments = [name for name in names if name not in available]
    return [
        candidate
        for candidate in available
        if not names or candidate in exact or any(fragment in candidate for fragment in fragments)
    ]


def rows_of(module: str, *, quick: bool) -> Iterator[Row]:
    """Run one benchmark in a process of its own.

    Its peak memory is then its own, and one that the operating system kills takes no other with it.

    Parameters
    ----------
    module : str
        Module with a function ``ratios`` and its smaller arguments ``QUICK``.
    quick : bool
        Take the smaller arguments.

    Yields
    ------
    Ratio, Absent or Failed
        Each as soon as it is measured; the last is ``Failed`` where the benchmark raised or died.
    """
    # A fresh process: a forked one would inherit the memory and the threads of this one.
    context = get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_send_rows, args=(module, quick, sender))
    process.start()
    sender.close()
    try:
        yield from _received(receiver)
        process.join()
        if process.exitcode:
            yield Failed(f"its process ended with exit code {process.exitcode}")
    finally:
        process.join(_GRACE)
        process.terminate()
        process.join()


def _received(receiver: Connection) -> Iterator[Row]:
    while True:
        try:
            row: Row = receiver.recv()
        except EOFError:
            return
        yield row


def _send_rows(module: str, quick: bool, sender: Connection) -> None:
    """Body of the process: every row into the pipe, then what ended the benchmark."""
    # Temporary files go with either way to be stopped.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        for row in _guarded(module, quick):
            sender.send(row)
    except KeyboardInterrupt:
        sys.exit(130)
    finally:
        sender.close()


def _guarded(module: str, quick: bool) -> Iterator[Row]:
    """Rows of a benchmark; what it raises becomes its last row."""
    try:
        benchmark = importlib.import_module(module)
        yield from benchmark.ratios(**(benchmark.QUICK if quick else {}))
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        yield _INDEPENDENT.get(package, Failed(_one_line(error)))
    except Exception as error:
        yield Failed(_one_line(error))


def _one_line(error: Exception) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())}"


def run_alone(ratios: Callable[..., Iterator[Row]]) -> None:
    """Run one benchmark in this process with the arguments of the command line; print its table."""
    import cyclopts
    from rich.console import Console

    from benchmarks.report import ratio_table

    @functools.wraps(ratios)
    def shown(*arguments: object, **options: object) -> None:
        name = Path(sys.argv[0]).stem
        rows = [(name, row) for row in ratios(*arguments, **options)]
        Console(highlight=False).print(ratio_table(rows))

    cyclopts.run(shown)
