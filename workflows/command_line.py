"""The ``carrierflex`` command.

One sub-command a workflow; errors in one line, exit codes for scripts.
"""

import difflib
import functools
import importlib
import io
import logging
import os
import re
import sys
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from carrierflex.files.shown_values import printable
from carrierflex.workflows.support.compiled_code import with_sound_cache
from carrierflex.workflows.support.interruption import (
    EXIT_INTERRUPTED,
    EXIT_TERMINATED,
    TerminationError,
    interrupt_on_sigterm,
)

if TYPE_CHECKING:
    import cyclopts

#: Exit codes: a check failed, refused input; :mod:`interruption` holds those of interruptions.
EXIT_FAILED = 1
EXIT_REFUSED = 2

#: Columns where the output is no terminal: more than any row has.
_WIDTH_OF_A_PIPE = 10_000


class _Command(NamedTuple):
    """A workflow and how it is shown, by name: nothing of it is imported before it is asked for."""

    workflow: str
    """Module below carrierflex.workflows whose `main` it is."""
    table: str
    """Module below carrierflex.workflows.screen and the function that shows the result."""
    help: str
    """First line of the workflow's docstring."""


_COMMANDS = {
    "run": _Command(
        "run",
        "job_story:job_story",
        "Do the whole chain for one planet carrier and leave every result in one folder.",
    ),
    "mesh": _Command(
        "geometry.mesh_carrier",
        "tables:quality_table",
        "Mesh the planet carrier with quadratic tetrahedra; write it with named surfaces as sets.",
    ),
    "cad": _Command(
        "geometry.write_cad",
        "tables:cad_table",
        "Write the parametric carrier as carrier.step (unit mm) and surfaces.toml, a template.",
    ),
    "cad-faces": _Command(
        "geometry.list_cad_faces",
        "tables:cad_table",
        "List the faces of a STEP file's solid: type, axis, radius, station and area, in metres.",
    ),
    "curves": _Command(
        "fe.compute_curves",
        "tables:curve_table",
        "Compute the rim's deflection curves by finite elements.",
    ),
    "reduce": _Command(
        "reduction.reduce_body",
        "tables:reduced_table",
        "Reduce a body to its pilot nodes and fixed-interface modes (Craig-Bampton).",
    ),
    "join": _Command(
        "reduction.join_rotating_group",
        "body_tables:joined_table",
        "Join main shaft, carrier and pins to one reduced body, the carrier tilted on the shaft.",
    ),
    "couplings": _Command(
        "fe.compare_couplings",
        "body_tables:coupling_table",
        "Bracket pilot stiffness and deflection curves between distributing and rigid couplings.",
    ),
    "pin-fit": _Command(
        "fe.study_pin_fit",
        "tables:pin_fit_table",
        "Sweep the pin fit from simply supported to rigid.",
    ),
    "export": _Command(
        "reduction.export_body",
        "tables:export_table",
        "Write a reduced body for another multibody code.",
    ),
    "certificate": _Command(
        "reduction.check_certificate",
        "tables:certificate_table",
        "Show the reduction certificate of a body file; the exit code is 1 where a check fails.",
    ),
    "simulate": _Command(
        "simulation.simulate_load_case",
        "simulation_tables:campaign_table",
        "Simulate the sensors in a set of load cases and write them as a campaign folder.",
    ),
    "table-5": _Command(
        "simulation.simulate_table_5",
        "simulation_tables:table_5_table",
        "Simulate the eight cases of the 2012 paper's table 5; compare with a simulated reference.",
    ),
    "order-one": _Command(
        "simulation.study_order_one",
        "simulation_tables:order_one_table",
        "Amplitude of order 1 at the axial sensors over the supports of carrier and housing.",
    ),
    "torsion": _Command(
        "simulation.compute_torsion",
        "simulation_tables:torsion_table",
        "Torsional stiffness of main shaft, gearbox and mounting.",
    ),
    "export-fmu": _Command(
        "simulation.export_fmu",
        "simulation_tables:fmu_table",
        "Export the linear mounting model as an FMI 2.0 co-simulation unit.",
    ),
    "gear-life": _Command(
        "simulation.estimate_gear_life",
        "simulation_tables:gear_life_table",
        "Contact pressure and pitting life of sun and ring mesh over the misalignment of a planet.",
    ),
    "cases": _Command(
        "copy_cases",
        "import_tables:cases_table",
        "List the cases that come along, or copy them to start from.",
    ),
    "parameters": _Command(
        "geometry.write_parameters",
        "import_tables:parameters_table",
        "Write every dimension with comment, unit, source and limits, and a dimensioned drawing.",
    ),
    "new-campaign": _Command(
        "identification.new_campaign",
        "import_tables:map_table",
        "Write a map of a logger's files, with guesses to look at: columns, units, clock, angles.",
    ),
    "import": _Command(
        "identification.import_records",
        "import_tables:imported_table",
        "Make a campaign folder of a logger's files and the map of their columns.",
    ),
    "schema": _Command(
        "show_schema",
        "import_tables:schema_page",
        "Show the JSON Schema of a kind of file: every key with its words, unit and range.",
    ),
    "completion": _Command(
        "complete_shell",
        "import_tables:completion_script",
        "Show the script that completes commands and options in a shell.",
    ),
    "check": _Command(
        "diagnosis.check_campaign",
        "diagnosis_tables:check_table",
        "Check a measurement campaign; the exit code is 0 without a finding, 1 with one.",
    ),
    "identify": _Command(
        "identification.identify_parameters",
        "tables:estimate_table",
        "Identify the motion of the planet carrier, or the bushings of the mounting.",
    ),
    "diagnose": _Command(
        "diagnosis.diagnose_campaign",
        "diagnosis_tables:diagnosis_table",
        "Diagnose the gap between a measurement campaign and its baseline simulation.",
    ),
    "compare": _Command(
        "diagnosis.compare_diagnoses",
        "diagnosis_tables:comparison_table",
        "Compare two diagnoses of one measurement, before and after the simulator changed.",
    ),
    "view": _Command(
        "view3d.view_file",
        "body_tables:view_table",
        "Write a page on which a body, deflection curves or the gap of a rim turn in space.",
    ),
    "blind-check": _Command(
        "diagnosis.run_blind_check",
        "score_tables:blind_check_table",
        "Diagnose sealed campaigns and score the answers.",
    ),
    "figures": _Command(
        "figures.draw_figures",
        "simulation_tables:figures_table",
        "Draw the figures of the 2011 and the 2012 paper by their numbers, with an index.",
    ),
    "printed-tables": _Command(
        "identification.read_printed_tables",
        "tables:printed_tables_table",
        "Derive rim deflection, phi_PLC and static saddle from tables 4 and 5 of the 2012 paper.",
    ),
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
    _print_in_any_encoding()
    _refuse_unknown_command(sys.argv[1:])
    try:
        with_sound_cache(
            lambda: application()(sys.argv[1:], exit_on_error=False, print_error=False)
        )
    except TerminationError:
        _end("asked to end; files that were finished are whole and stay", EXIT_TERMINATED)
    except KeyboardInterrupt:
        _end("interrupted; files that were finished are whole and stay", EXIT_INTERRUPTED)
    except ImportError as error:
        _end(
            f"a library is missing or does not load: {_one_line(error.__cause__ or error)}; `make` "
            "installs what is needed",
            EXIT_REFUSED,
        )
    except Exception as error:
        if type(error).__module__.startswith("cyclopts"):
            _end(f"{_one_line(error)} (carrierflex --help tells what is expected)", EXIT_REFUSED)
        if not isinstance(
            error, (ValueError, OSError, KeyError, ArithmeticError, RuntimeError, MemoryError)
        ):
            raise
        _end(_about_input(error, sys.argv[1:]), EXIT_REFUSED)


def _print_in_any_encoding() -> None:
    """Show what an encoding lacks as "?": finished work must not be refused for a sign."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def _refuse_unknown_command(arguments: list[str]) -> None:
    """Refuse a name that is no command; cyclopts would import every workflow to say so."""
    name = arguments[0] if arguments else "--help"
    if name in _COMMANDS or name.startswith("-"):
        return
    close = difflib.get_close_matches(name, _COMMANDS, n=1)
    instead = f'did you mean "{close[0]}"?' if close else f"expected one of {', '.join(_COMMANDS)}"
    _end(f'unknown command "{name}"; {instead} (carrierflex --help)', EXIT_REFUSED)


def application() -> "cyclopts.App":
    """The commands by name; only the workflow of the one that is called is imported.

    Late, so that a library that does not load is told in one line.
    """
    import cyclopts

    from carrierflex.files.versions import software_name

    app = cyclopts.App(
        name="carrierflex",
        help=_HELP,
        version=software_name,
        version_format="plaintext",
        suppress_keyboard_interrupt=False,
    )
    for name, command in _COMMANDS.items():
        app.command(
            f"carrierflex.workflows.{command.workflow}:main",
            name=name,
            help=command.help,
            result_action=functools.partial(_show, command.table),
        )
    return app


def _show(table: str, result: Any) -> None:
    """Show a workflow's result on the screen; a command's help has none."""
    if result is None:
        return
    from rich.console import Console
    from rich.text import Text

    module, function = table.split(":")
    tables = importlib.import_module(f"carrierflex.workflows.screen.{module}")
    # A pipe has no edge at which a table would be cut, or a schema broken.
    width = None if sys.stdout.isatty() or "COLUMNS" in os.environ else _WIDTH_OF_A_PIPE
    # Names in square brackets are names, no markup.
    console = Console(highlight=False, markup=False, width=width)
    shown = getattr(tables, function)(result)
    console.print(shown, soft_wrap=isinstance(shown, Text))
    # A certificate knows whether its checks are met; a result without such knowledge counts as met.
    if not getattr(result, "met", True):
        sys.exit(EXIT_FAILED)


def _about_input(error: Exception, arguments: list[str]) -> str:
    """Message of an error; where it names no file that is given, the first of them before it."""
    text = _one_line(error)
    # Errors of numpy and LAPACK; what this program raises itself says what it found.
    wordless = (OverflowError, ZeroDivisionError, FloatingPointError)
    if isinstance(error, wordless) or type(error).__name__ == "LinAlgError":
        text = (
            "its numbers leave no equations that can be solved; expected sizes that differ by "
            "less: units, masses and declared noise"
        )
    given = [
        Path(argument)
        for before, argument in pairwise(arguments)
        if before not in ("--out", "--save-law")
        and not argument.startswith("-")
        and Path(argument).exists()
    ]
    names = [name for path in given for name in (str(path), path.name, *_files_in(path))]
    if not given or "--" in text or any(_is_named(name, text) for name in names):
        return text
    return f"{given[0]}: {text}"


def _is_named(name: str, text: str) -> bool:
    """Whether a text holds a name as a word: a folder ``c`` is not named by every c."""
    return re.search(rf"(?<![\w.-]){re.escape(name)}(?![\w-])", text) is not None


def _files_in(path: Path) -> list[str]:
    return [entry.name for entry in path.iterdir()] if path.is_dir() else []


def _one_line(error: BaseException) -> str:
    # A KeyError's text is the repr of its message.
    text = str(error.args[0]) if isinstance(error, KeyError) and error.args else str(error)
    return text.strip() or type(error).__name__


def _end(message: str, code: int) -> None:
    print(f"carrierflex: {printable(message)}", file=sys.stderr)
    sys.exit(code)


if __name__ == "__main__":
    main()
