"""Run the benchmarks and print one table of ratios: ``python -m benchmarks [NAMES...]``."""

import signal
import sys
import time
from pathlib import Path

from benchmarks.ratio import Failed, Ratio
from benchmarks.report import Report, ratio_table
from benchmarks.run import chosen, rows_of

#: Exit codes: a benchmark failed, refused input, and interruption by the user (128 + SIGINT).
EXIT_FAILED = 1
EXIT_REFUSED = 2
EXIT_INTERRUPTED = 130


def main(
    *names: str, quick: bool = False, json: Path | None = None, list_names: bool = False
) -> int:
    """Run benchmarks one after another; every ratio is of two values from the same run.

    A benchmark that fails is a row of the table, and the others go on; the exit code is then 1. An
    independent code that is not installed is a row too, and no failure.

    Parameters
    ----------
    names
        Benchmarks, or parts of their names; all of them where none is given.
    quick
        Smaller meshes and shorter records, in a few minutes; the same questions.
    json
        File for the rows with machine and versions, written anew after every row.
    list_names
        Print the names and run nothing.
    """
    try:
        modules = chosen(names)
        if list_names:
            print("\n".join(modules))
            return 0
        if json is not None:
            json.parent.mkdir(parents=True, exist_ok=True)
    except ValueError as error:
        print(error, file=sys.stderr)
        return EXIT_REFUSED
    except OSError as error:
        print(
            f"--json {json}: {error.strerror}; expected a file in a writable folder",
            file=sys.stderr,
        )
        return EXIT_REFUSED
    return run(modules, Report(quick, json))


def run(names: list[str], report: Report, package: str = "benchmarks") -> int:
    """Run the named modules of `package` into a report and print it; the exit code.

    What an interruption leaves is in the report's file, and on the screen.
    """
    report.save()
    code = 0
    try:
        for number, name in enumerate(names, start=1):
            print(f"{number} of {len(names)}: {name}", file=sys.stderr, flush=True)
            begin = time.perf_counter()
            for row in rows_of(f"{package}.{name}" if package else name, quick=report.quick):
                report.add(name, row)
                code = EXIT_FAILED if isinstance(row, Failed) else code
            report.end(name, time.perf_counter() - begin)
        report.complete = True
        report.save()
    except KeyboardInterrupt:
        report.save()  # the interruption may have come while the last row was written
        print("interrupted; what was measured stays", file=sys.stderr)
        code = EXIT_INTERRUPTED
    _show(report)
    return code


def _show(report: Report) -> None:
    from rich.console import Console

    console = Console(highlight=False)
    console.print(ratio_table(report.rows))
    console.print(f"\n{report.caption()}", markup=False)
    reached = [row.met for _, row in report.rows if isinstance(row, Ratio) and row.wanted]
    console.print(f"{sum(map(bool, reached))} of {len(reached)} wanted figures reached")
    total = sum(report.seconds.values())
    written = f"; written to {report.path}" if report.path else ""
    console.print(f"{len(report.seconds)} finished in {total:.0f} s{written}", markup=False)


if __name__ == "__main__":
    import cyclopts

    # A time limit of another program ends the run as the user would.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    app = cyclopts.App(name="benchmarks", suppress_keyboard_interrupt=False)
    app.default(main)
    sys.exit(app(sys.argv[1:], result_action="return_value"))
