"""The commands as functions: options as written, the workflow imported when it is called.

``getattr(called_commands, "cad-faces")`` is the command of that name: cyclopts asks so for the one
that is called, and for all of them where a script completes them.
"""

import contextlib
import gc
import importlib
import inspect
import sys
import time
from collections.abc import Callable
from typing import Any

from carrierflex.workflows.shell.commands import COMMANDS, Command
from carrierflex.workflows.shell.early_refusals import refuse_early
from carrierflex.workflows.shell.shared_options import SharedOptions
from carrierflex.workflows.shell.shown_defaults import units_of, with_shown_default
from carrierflex.workflows.shell.shown_results import Done, show
from carrierflex.workflows.shell.written_signatures import written_command

#: Of a workflow's own options, what every command has is given by :class:`SharedOptions`.
_GIVEN_BY_ALL = "quiet"
_UNCHANGED = SharedOptions()


def __getattr__(name: str) -> Callable[..., None]:
    if name not in COMMANDS:
        raise AttributeError(f"no command '{name}'")
    return called(name, COMMANDS[name])


def called(name: str, command: Command) -> Callable[..., None]:
    """Function with the options of a command and those of every command.

    Parameters
    ----------
    name : str
        What the user types.
    command : Command
        Its workflow and table.
    """
    written = written_command(f"carrierflex.workflows.{command.workflow}")
    own = written.signature.parameters
    takes_quiet = _GIVEN_BY_ALL in own
    shared_option = inspect.Parameter(
        "shared",
        inspect.Parameter.KEYWORD_ONLY,
        default=_UNCHANGED,
        annotation=SharedOptions,
    )
    units = units_of(written.docstring)
    parameters = [
        with_shown_default(option, units.get(key))
        for key, option in own.items()
        if key != _GIVEN_BY_ALL
    ]
    signature = inspect.Signature([*parameters, shared_option])

    def main(*arguments: Any, shared: SharedOptions = _UNCHANGED, **options: Any) -> None:
        shared.apply()
        given = written.signature.bind(*arguments, **options).arguments
        refuse_early(given)
        # Off while libraries were loaded (command_line).
        gc.enable()
        started = time.time()
        if takes_quiet:
            options[_GIVEN_BY_ALL] = shared.quiet
        workflow = importlib.import_module(f"carrierflex.workflows.{command.workflow}")
        # A workflow may print; with --json nothing else may stand on standard output.
        aside = contextlib.redirect_stdout(sys.stderr) if shared.json else contextlib.nullcontext()
        with aside:
            result = workflow.main(*arguments, **options)
        if result is not None:
            show(Done(name, command, given, result, started), shared)

    main.__doc__ = written.docstring
    main.__annotations__ = {key: option.annotation for key, option in signature.parameters.items()}
    main.__signature__ = signature  # type: ignore[attr-defined]
    return main
