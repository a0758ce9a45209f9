"""The commands as functions: a workflow's options and those of every command.

``getattr(called_commands, "cad-faces")`` is the command of that name: cyclopts asks so for the one
that is called, and for all of them where a script completes them.
"""

import contextlib
import importlib
import inspect
import math
import re
import sys
import time
from collections.abc import Callable
from typing import Annotated, Any

from cyclopts import Parameter

from carrierflex.workflows.shell.commands import COMMANDS, Command
from carrierflex.workflows.shell.shared_options import SharedOptions
from carrierflex.workflows.shell.shown_results import Done, show

#: Prefixes by power of ten.
_PREFIXES = {-9: "n", -6: "u", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
#: Units that take a prefix; of others the number stays.
_PREFIXED = {"m", "N", "N m", "N/m", "N m/rad", "N s/m", "rad", "Pa"}
_UNIT = re.compile(r"\[([^\]]+)\]")
#: Of a workflow's options, what every command has is given by :class:`SharedOptions`.
_GIVEN_BY_ALL = "quiet"
_UNCHANGED = SharedOptions()


def __getattr__(name: str) -> Callable[..., None]:
    if name not in COMMANDS:
        raise AttributeError(f"no command '{name}'")
    return called(name, COMMANDS[name])


def workflow_of(command: Command) -> Callable[..., Any]:
    """Workflow of a command; its module is light, what works is imported by its functions."""
    main: Callable[..., Any] = importlib.import_module(
        f"carrierflex.workflows.{command.workflow}"
    ).main
    return main


def options_of(main: Callable[..., Any]) -> dict[str, inspect.Parameter]:
    """Options of a workflow by name, with their types.

    What it returns may be of a library that help does without, and stays unread.
    """
    scope = inspect.unwrap(main).__globals__
    return {
        key: option.replace(annotation=eval(option.annotation, scope))
        if isinstance(option.annotation, str)
        else option
        for key, option in inspect.signature(main).parameters.items()
    }


def _as_typed(option: inspect.Parameter) -> inspect.Parameter:
    """The option as a command has it."""
    if option.kind is option.POSITIONAL_OR_KEYWORD:
        return option.replace(kind=option.POSITIONAL_ONLY)
    if option.default is True:
        off = f"--no-{option.name.replace('_', '-')}"
        return option.replace(annotation=Annotated[bool, Parameter(negative=off)])
    return option


def called(name: str, command: Command) -> Callable[..., None]:
    """Function with the options of a command and those of every command."""
    workflow = workflow_of(command)
    options_of_workflow = options_of(workflow)
    units = _units_of(inspect.getdoc(workflow) or "")
    parameters = [
        _with_shown_default(_as_typed(option), units.get(key))
        for key, option in options_of_workflow.items()
        if key != _GIVEN_BY_ALL
    ]
    shared_option = inspect.Parameter(
        "shared", inspect.Parameter.KEYWORD_ONLY, default=_UNCHANGED, annotation=SharedOptions
    )
    signature = inspect.Signature([*parameters, shared_option])

    def main(*arguments: Any, shared: SharedOptions = _UNCHANGED, **options: Any) -> None:
        shared.apply()
        given = inspect.signature(workflow).bind(*arguments, **options).arguments
        started = time.time()
        if _GIVEN_BY_ALL in options_of_workflow:
            options[_GIVEN_BY_ALL] = shared.quiet
        # A workflow may print; with --json nothing else may stand on standard output.
        aside = contextlib.redirect_stdout(sys.stderr) if shared.json else contextlib.nullcontext()
        with aside:
            result = workflow(*arguments, **options)
        if result is not None:
            show(Done(name, command, given, result, started), shared)

    main.__doc__ = inspect.getdoc(workflow)
    main.__annotations__ = {key: option.annotation for key, option in signature.parameters.items()}
    main.__signature__ = signature  # type: ignore[attr-defined]
    return main


def _units_of(docstring: str) -> dict[str, str]:
    """Unit by parameter of a NumPy docstring: what stands first in square brackets in its text."""
    units: dict[str, str] = {}
    names: list[str] = []
    for line in docstring.partition("Parameters\n----------\n")[2].splitlines():
        if line and not line.startswith(" "):
            names = [name.strip() for name in line.partition(" :")[0].split(",")]
            continue
        unit = _UNIT.search(line)
        if unit:
            units |= {name: unit[1] for name in names if name not in units}
    return units


def _with_shown_default(option: inspect.Parameter, unit: str | None) -> inspect.Parameter:
    """The option, its default shown with the unit where it is a number with one."""
    value = option.default
    if unit is None or isinstance(value, bool) or not isinstance(value, int | float):
        return option
    shown = Parameter(show_default=lambda default: said(default, unit))
    annotation: Any = Annotated[option.annotation, shown]
    return option.replace(annotation=annotation)


def said(value: float, unit: str) -> str:
    """A value with its unit, and as people say it.

    Examples
    --------
    >>> said(0.024, "m")
    '24 mm (0.024 m)'
    >>> said(360e3, "N m")
    '360 kN m (360000 N m)'
    >>> said(8.2, "s")
    '8.2 s'
    """
    plainly = f"{_number(value)} {unit}"
    if unit not in _PREFIXED or not math.isfinite(value) or value == 0.0:
        return plainly
    power = 3 * math.floor(math.log10(abs(value) * (1.0 + 1e-12)) / 3.0)
    if power == 0 or power not in _PREFIXES:
        return plainly
    return f"{_number(value / 10.0**power)} {_PREFIXES[power]}{unit} ({plainly})"


def _number(value: float) -> str:
    text = f"{value:.6g}"
    return f"{value:.0f}" if "e+" in text and abs(value) < 1e7 else text
