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
import shutil
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
from carrierflex.workflows.shell.commands import (
    COMMANDS,
    GROUPS,
    HOLDERS,
    RELATED,
    RENAMED,
    command_in,
)
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

All quantities are in SI units (m, kg, s, N, rad) unless a name says otherwise.
--out names the file or the folder to write; the suffix of a file says its format."""


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
            _end(_about_options(error, sys.argv[1:]), EXIT_REFUSED)
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
    first = arguments[0] if arguments else "--help"
    if first in HOLDERS:
        subcommands = {name.split()[1]: name for name in COMMANDS if name.startswith(f"{first} ")}
        second = arguments[1] if len(arguments) > 1 else "--help"
        if not second.startswith("-") and second not in subcommands:
            _refuse_name(
                f"{first} {second}",
                second,
                subcommands,
                [*subcommands],
                f"carrierflex {first} --help",
            )
    elif not first.startswith("-") and first not in COMMANDS:
        if first in RENAMED:
            new = RENAMED[first]
            _end(f'"{first}" is now "{new}" (carrierflex {new} --help)', EXIT_REFUSED)
        names = {name.split()[-1]: name for name in COMMANDS} | {name: name for name in HOLDERS}
        shown = [name for group in GROUPS.values() for name in group]
        _refuse_name(first, first, names, shown, "carrierflex --help")


def _refuse_name(
    called: str, word: str, names: dict[str, str], shown: list[str], help_line: str
) -> None:
    """Refuse a command; `names` are those of commands by the word that may have been meant."""
    close = difflib.get_close_matches(word, names, n=1)
    instead = (
        f'did you mean "{names[close[0]]}"?' if close else f"expected one of {', '.join(shown)}"
    )
    _end(f'unknown command "{called}"; {instead} ({help_line})', EXIT_REFUSED)


@interruptible()
def _run(arguments: list[str]) -> None:
    application()(arguments, exit_on_error=False, print_error=False)


def application(*, shows_related: bool = False) -> "cyclopts.App":
    """The commands by name; of the workflows that of the called one alone is imported.

    Late, so that a library that does not load is told in one line. What the first help leaves out
    is of no concern to a shell: it completes `shows_related` names too.
    """
    import cyclopts

    from carrierflex.workflows.shell.help_screen import HelpScreen

    app = cyclopts.App(
        name="carrierflex",
        help=_HELP,
        version=_version,
        version_format="plaintext",
        # Markup of other kinds would be read by libraries that take a fifth of the time of help.
        help_format="plaintext",
        help_formatter=HelpScreen(),
        # A flag that is off has no --no- form; `called_commands` gives one to those that are on.
        default_parameter=cyclopts.Parameter(negative=()),
        suppress_keyboard_interrupt=False,
    )
    app["--help"].group = app["--version"].group = cyclopts.Group("Options")
    groups: dict[str, cyclopts.Group] = {}
    for title, names in GROUPS.items():
        groups |= dict.fromkeys(names, cyclopts.Group.create_ordered(title))
    shown = [*groups, *COMMANDS]
    holders = {
        name: cyclopts.App(
            name=name,
            help=text,
            help_epilogue=_related(name),
            version_flags=(),
            sort_key=shown.index(name),
            group=groups[name],
        )
        for name, text in HOLDERS.items()
    }
    for holder in holders.values():
        app.command(holder)
    for name, command in COMMANDS.items():
        holder_name, _, subcommand = name.rpartition(" ")
        (holders[holder_name] if holder_name else app).command(
            f"carrierflex.workflows.shell.called_commands:{name}",
            name=subcommand,
            help=command.help,
            help_epilogue=_related(name),
            sort_key=shown.index(name),
            group=groups.get(name),
            show=shows_related or bool(holder_name) or name in groups,
        )
    return app


def _related(name: str) -> str:
    """Last lines of a help: commands that belong to this one."""
    from carrierflex.workflows.shell.help_screen import table

    rows = {f"carrierflex {other}": COMMANDS[other].help for other in RELATED.get(name, ())}
    return table("Related", rows, shutil.get_terminal_size().columns) if rows else ""


def _about_options(error: Exception, arguments: list[str]) -> str:
    """What is wrong with the options of a line, and where they are explained."""
    text = _one_line(error)
    unknown = re.match(r"Unknown option: (--[\w-]+)", text)
    if unknown and unknown[1] in RENAMED:
        text = f"{unknown[1]} is now {RENAMED[unknown[1]]}"
    called = command_in(arguments)
    return f"{text} (carrierflex {called + ' ' if called else ''}--help)"


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

        show_refusal(command_in(sys.argv[1:]), printable(message), code)
    sys.exit(code)


if __name__ == "__main__":
    main()
