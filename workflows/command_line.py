"""The ``carrierflex`` command.

One sub-command a workflow; errors in one line, exit codes for scripts.
"""

import functools
import importlib
import logging
import sys
from collections.abc import Callable
from typing import Any

from carrierflex.files.shown_values import printable
from carrierflex.workflows.support.interruption import (
    EXIT_INTERRUPTED,
    EXIT_TERMINATED,
    TerminationError,
    interrupt_on_sigterm,
)

#: Exit codes: a check failed, refused input; :mod:`interruption` holds those of interruptions.
EXIT_FAILED = 1
EXIT_REFUSED = 2

#: Module of the workflow behind each command, and what shows its result.
_COMMANDS = {
    "run": ("run", "summary_table"),
    "mesh": ("geometry.mesh_carrier", "quality_table"),
    "cad": ("geometry.write_cad", "cad_table"),
    "cad-faces": ("geometry.list_cad_faces", "cad_table"),
    "curves": ("fe.compute_curves", "curve_table"),
    "reduce": ("reduction.reduce_body", "reduced_table"),
    "join": ("reduction.join_rotating_group", "joined_table"),
    "couplings": ("fe.compare_couplings", "coupling_table"),
    "pin-fit": ("fe.study_pin_fit", "pin_fit_table"),
    "export": ("reduction.export_body", "export_table"),
    "certificate": ("reduction.check_certificate", "certificate_table"),
    "simulate": ("simulation.simulate_load_case", "campaign_table"),
    "table-5": ("simulation.simulate_table_5", "table_5_table"),
    "torsion": ("simulation.compute_torsion", "torsion_table"),
    "export-fmu": ("simulation.export_fmu", "fmu_table"),
    "gear-life": ("simulation.estimate_gear_life", "gear_life_table"),
    "identify": ("identification.identify_parameters", "estimate_table"),
    "diagnose": ("diagnosis.diagnose_campaign", "diagnosis_table"),
    "blind-check": ("diagnosis.run_blind_check", "blind_check_table"),
    "printed-tables": ("identification.read_printed_tables", "printed_tables_table"),
}

_HELP = """From a planet carrier's parameters to a diagnosed gap between simulation and measurement.

All quantities are in SI units (m, kg, s, N, rad) unless a name says otherwise."""


def main() -> None:
    """Run the command line.

    The process ends with 0, 1 (a check failed), 2 (refused input), 130 (interrupted by Ctrl-C) or
    143 (asked to end by SIGTERM).
    """
    logging.basicConfig(level=logging.ERROR, format="%(name)s: %(message)s")
    interrupt_on_sigterm()
    try:
        _application()(sys.argv[1:], exit_on_error=False, print_error=False)
    except TerminationError:
        _end("asked to end; files that were finished are whole and stay", EXIT_TERMINATED)
    except KeyboardInterrupt:
        _end("interrupted; files that were finished are whole and stay", EXIT_INTERRUPTED)
    except ImportError as error:
        _end(
            f"a library is missing or does not load: {_one_line(error)}; `make` installs what is "
            "needed",
            EXIT_REFUSED,
        )
    except Exception as error:
        if type(error).__module__.startswith("cyclopts"):
            _end(f"{_one_line(error)} (carrierflex --help tells what is expected)", EXIT_REFUSED)
        if not isinstance(
            error, (ValueError, OSError, KeyError, ArithmeticError, RuntimeError, MemoryError)
        ):
            raise
        _end(_one_line(error), EXIT_REFUSED)


def _application() -> Any:
    """Import the workflows and register them.

    Late, so that a library that does not load is told in one line.
    """
    import cyclopts

    from carrierflex.files.versions import software_name
    from carrierflex.workflows.screen import tables

    app = cyclopts.App(
        name="carrierflex", help=_HELP, version=software_name, suppress_keyboard_interrupt=False
    )
    for name, (module, table) in _COMMANDS.items():
        workflow = importlib.import_module(f"carrierflex.workflows.{module}").main
        app.command(_shown_by(getattr(tables, table), workflow), name=name)
    return app


def _shown_by(table: Callable[[Any], Any], workflow: Callable[..., Any]) -> Callable[..., None]:
    """Workflow with the same signature that shows its result on the screen."""

    @functools.wraps(workflow)
    def shown(*arguments: Any, **options: Any) -> None:
        from rich.console import Console

        result = workflow(*arguments, **options)
        Console(highlight=False).print(table(result))
        # A certificate knows whether its checks are met; a result without such knowledge counts as
        # met.
        if not getattr(result, "met", True):
            sys.exit(EXIT_FAILED)

    return shown


def _one_line(error: BaseException) -> str:
    # A KeyError's text is the repr of its message.
    text = str(error.args[0]) if isinstance(error, KeyError) and error.args else str(error)
    return text.strip() or type(error).__name__


def _end(message: str, code: int) -> None:
    print(f"carrierflex: {printable(message)}", file=sys.stderr)
    sys.exit(code)


if __name__ == "__main__":
    main()
