"""The ``carrierflex`` command.

One sub-command a workflow; errors in one line, exit codes for scripts.
"""

import functools
import importlib
import logging
import sys
from collections.abc import Callable
from typing import Any

#: Exit codes: a check failed, refused input, and interruption by the user (128 + SIGINT).
EXIT_FAILED, EXIT_REFUSED, EXIT_INTERRUPTED = 1, 2, 130

#: Module of the workflow behind each command, and what shows its result.
_COMMANDS = {
    "run": ("run", "summary_table"),
    "mesh": ("mesh_carrier", "quality_table"),
    "cad": ("write_cad", "cad_table"),
    "cad-faces": ("list_cad_faces", "cad_table"),
    "curves": ("compute_curves", "curve_table"),
    "reduce": ("reduce_body", "reduced_table"),
    "couplings": ("compare_couplings", "coupling_table"),
    "pin-fit": ("study_pin_fit", "pin_fit_table"),
    "export": ("export_body", "export_table"),
    "certificate": ("check_certificate", "certificate_table"),
    "simulate": ("simulate_load_case", "campaign_table"),
    "table-5": ("simulate_table_5", "table_5_table"),
    "export-fmu": ("export_fmu", "fmu_table"),
    "gear-life": ("estimate_gear_life", "gear_life_table"),
    "identify": ("identify_parameters", "estimate_table"),
    "diagnose": ("diagnose_campaign", "diagnosis_table"),
    "blind-check": ("run_blind_check", "blind_check_table"),
    "printed-tables": ("read_printed_tables", "printed_tables_table"),
}

_HELP = """From a planet carrier's parameters to a diagnosed gap between simulation and measurement.

All quantities are in SI units (m, kg, s, N, rad) unless a name says otherwise."""


def main() -> None:
    """Run the command line.

    The process ends with 0, 1 (a check failed), 2 (refused input) or 130 (interrupted).
    """
    logging.basicConfig(level=logging.ERROR, format="%(name)s: %(message)s")
    try:
        _application()(sys.argv[1:], exit_on_error=False, print_error=False)
    except KeyboardInterrupt:
        _end("interrupted; files that were finished are whole and stay", EXIT_INTERRUPTED)
    except ImportError as error:
        _end(
            f"a library is missing or does not load: {_one_line(error)}; `make` installs what is needed",
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

    from carrierflex.identification.estimate_files import software_name
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
    return " ".join(text.split()) or type(error).__name__


def _end(message: str, code: int) -> None:
    print(f"carrierflex: {message}", file=sys.stderr)
    sys.exit(code)


if __name__ == "__main__":
    main()
