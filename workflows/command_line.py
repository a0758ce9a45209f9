"""The ``carrierflex`` command.

One sub-command a workflow; errors in one line, exit codes for scripts.
"""

import difflib
import errno
import io
import logging
import os
import re
import resource
import sys
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

from carrierflex.files.shown_values import printable
from carrierflex.workflows.compiled_code import with_sound_cache
from carrierflex.workflows.interruption import (
    EXIT_INTERRUPTED,
    EXIT_TERMINATED,
    TerminationError,
    interruptible,
)
from carrierflex.workflows.shell.commands import COMMANDS, GROUPS
from carrierflex.workflows.shell.logs import SHOWN, show_errors

if TYPE_CHECKING:
    import cyclopts

#: Exit code of refused input; :mod:`interruption` holds those of interruptions.
EXIT_REFUSED = 2
EXIT_UNREAD = 128 + 13  # SIGPIPE
#: Address space [bytes] with which every library loads, and a small body is reduced.
_LEAST_MEMORY = 1_500_000_000
#: What the loader of libraries and the system say where memory is refused.
_NO_MEMORY = ("failed to map segment", "annot allocate memory", "can't start new thread")

#: Under the name of the package also where this file itself is run.
log = logging.getLogger("carrierflex.workflows.command_line")

_HELP = """From a planet carrier's parameters to a diagnosed gap between simulation and measurement.

All quantities are in SI units (m, kg, s, N, rad) unless a name says otherwise."""


def main() -> None:
    """Run the command line.

    The process ends with 0, 1 (a check failed), 2 (refused input), 130 (interrupted by Ctrl-C),
    141 (nobody reads what it prints) or 143 (asked to end by SIGTERM).
    """
    _replace_closed_streams()
    show_errors()
    _print_in_any_encoding()
    _refuse_unknown_command(sys.argv[1:])
    _refuse_little_memory()
    try:
        with_sound_cache(lambda: _run(sys.argv[1:]))
        sys.stdout.flush()
    except BrokenPipeError:
        # As programs that SIGPIPE ends: `| head` has read what it wanted.
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        sys.exit(EXIT_UNREAD)
    except TerminationError:
        _end("terminated; finished files are complete and remain", EXIT_TERMINATED)
    except KeyboardInterrupt:
        _end("interrupted; finished files are complete and remain", EXIT_INTERRUPTED)
    except ImportError as error:
        if _lacks_memory(error):
            _end(_about_memory(error), EXIT_REFUSED)
        _end(
            f"a library is missing or does not load: {_one_line(error.__cause__ or error)}; `make` "
            "installs what is needed",
            EXIT_REFUSED,
        )
    except Exception as error:
        if type(error).__module__.startswith("cyclopts"):
            _end(f"{_one_line(error)} (see carrierflex --help)", EXIT_REFUSED)
        if not isinstance(
            error, (ValueError, OSError, KeyError, ArithmeticError, RuntimeError, MemoryError)
        ):
            raise
        if _lacks_memory(error):
            _end(_about_memory(error), EXIT_REFUSED)
        _end(_about_input(error, sys.argv[1:]), EXIT_REFUSED)


def _refuse_little_memory() -> None:
    """Refuse a limit at which the algebra's library waits for ever to be given its buffers."""
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit != resource.RLIM_INFINITY and limit < _LEAST_MEMORY:
        _end(
            f"memory is limited to {limit / 1e6:.0f} MB by `ulimit -v`; expected at least "
            f"{_LEAST_MEMORY / 1e6:.0f} MB: raise the limit",
            EXIT_REFUSED,
        )


def _lacks_memory(error: BaseException) -> bool:
    """Whether memory was refused: to an array, a thread, or a library that was to be loaded."""
    causes = [error, error.__cause__, error.__context__]
    return any(
        isinstance(cause, MemoryError)
        or getattr(cause, "errno", None) == errno.ENOMEM
        or any(words in str(cause) for words in _NO_MEMORY)
        for cause in causes
        if cause is not None
    )


def _about_memory(error: BaseException) -> str:
    reason = _one_line(error)
    said = f" ({reason})" if reason != type(error).__name__ else ""
    return (
        f"memory does not suffice{said}; expected a smaller model, as by a larger --size, or more "
        "memory: close other programs, or raise the limit that `ulimit -v` shows"
    )


def _replace_closed_streams() -> None:
    """Open what a caller closed (``>&-``), or the first result file would take its number."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), "w"))


def _print_in_any_encoding() -> None:
    """Show what an encoding lacks as "?": finished work must not be refused for a sign."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def _refuse_unknown_command(arguments: list[str]) -> None:
    """Refuse a name that is no command; cyclopts would import every workflow to say so."""
    name = arguments[0] if arguments else "--help"
    if name in COMMANDS or name.startswith("-"):
        return
    close = difflib.get_close_matches(name, COMMANDS, n=1)
    instead = f'did you mean "{close[0]}"?' if close else f"expected one of {', '.join(COMMANDS)}"
    _end(f'unknown command "{name}"; {instead} (carrierflex --help)', EXIT_REFUSED)


@interruptible()
def _run(arguments: list[str]) -> None:
    application()(arguments, exit_on_error=False, print_error=False)


def application() -> "cyclopts.App":
    """The commands by name; of the workflows that of the called one alone is imported.

    Late, so that a library that does not load is told in one line.
    """
    import cyclopts

    app = cyclopts.App(
        name="carrierflex",
        help=_HELP,
        version=_version,
        version_format="plaintext",
        # Markup of other kinds would be read by libraries that take a fifth of the time of help.
        help_format="plaintext",
        default_parameter=cyclopts.Parameter(negative_iterable=()),
        suppress_keyboard_interrupt=False,
    )
    app["--help"].group = app["--version"].group = cyclopts.Group("Options")
    for title, names in GROUPS.items():
        group = cyclopts.Group.create_ordered(title)
        for name in names:
            app.command(
                f"carrierflex.workflows.shell.called_commands:{name}",
                name=name,
                help=COMMANDS[name].help,
                group=group,
            )
    return app


def _version() -> str:
    from carrierflex.files.versions import installed

    return installed()


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
        if before not in ("--out", "--save-law", "--log-file")
        and not argument.startswith("-")
        and Path(argument).exists()
    ]
    names = [name for path in given for name in (str(path), path.name, *_files_in(path))]
    # A file that is absent, or in the way, is named by its error.
    names_it = isinstance(error, (FileNotFoundError, FileExistsError)) or "--" in text
    if not given or names_it or any(_is_named(name, text) for name in names):
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
    # For the log file; the line on the screen has no logger's name.
    log.error(message, extra=SHOWN)
    print(f"carrierflex: {printable(message)}", file=sys.stderr)
    if "--json" in sys.argv[1:]:
        # Late: with it comes what help and refusals can do without.
        from carrierflex.workflows.shell.shown_results import show_refusal

        show_refusal(sys.argv[1] if sys.argv[1] in COMMANDS else None, printable(message), code)
    sys.exit(code)


if __name__ == "__main__":
    main()
