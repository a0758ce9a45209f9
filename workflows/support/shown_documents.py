"""What ``--json`` prints: one document of a command that ended, another of one that did not.

The result is the command's own document where it writes one, and its figures otherwise: fields by
name, long arrays by their shape, smallest and largest value, what is not made of numbers by the
name of its kind.
"""

import importlib
import inspect
import types
from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any, Literal, TypedDict, Union, get_origin, get_type_hints

import numpy as np

from carrierflex.files.result_schemas import Schema, result_schema
from carrierflex.workflows.shell.commands import COMMANDS


class Range(TypedDict):
    """A long array."""

    shape: Annotated[Sequence[int], "Shape"]
    smallest: Annotated[float, "Smallest value"]
    largest: Annotated[float, "Largest value"]


class CommandResult(TypedDict):
    """What a command that has ended prints."""

    format: Annotated[Literal["carrierflex-result"], "Kind of the document"]
    version: Annotated[Literal[1], "Version of the format"]
    software: Annotated[str, "Name and version of this software"]
    command: Annotated[str, "Name of the command"]
    given: Annotated[Mapping[str, Any], "Its options as they were given, by name"]
    exit_code: Annotated[Literal[0, 1], "0; 1 where a check is not met"]
    met: Annotated[bool, "Whether all checks are met"]
    seconds: Annotated[float, "Time it took [s]"]
    written: Annotated[Sequence[str], "Files that it wrote"]
    result: Annotated[Any, "Its own document where it writes one; its figures otherwise"]


class CommandRefusal(TypedDict):
    """What a command that was refused, or interrupted, prints."""

    format: Annotated[Literal["carrierflex-refusal"], "Kind of the document"]
    version: Annotated[Literal[1], "Version of the format"]
    software: Annotated[str, "Name and version of this software"]
    command: Annotated[str | None, "Name of the command; null where there is none of that name"]
    exit_code: Annotated[Literal[2, 130, 143], "2 refused, 130 interrupted, 143 asked to end"]
    error: Annotated[str, "What is wrong, what was found and what is expected, in one line"]


def shown_schema(documents: Mapping[str, Any]) -> Schema:
    """Schema of both documents; the result of every command has one of its own.

    Parameters
    ----------
    documents : mapping of str to dict
        Schemas of the documents that commands write, by the name of the file.
    """
    schema = result_schema(CommandResult | CommandRefusal)
    by_command = []
    for name, command in COMMANDS.items():
        main = importlib.import_module(f"carrierflex.workflows.{command.workflow}").main
        shown = []
        if command.document:
            file = command.document.removesuffix(".json").replace("_", " ")
            schema["$defs"][command.document] = {"$id": command.document, **documents[file]}
            shown.append({"$ref": command.document})
        if not _always_writes(main, command.document):
            schema["$defs"][f"figures of {name}"] = {"$id": f"{name}-figures", **_figures(main)}
            shown.append({"$ref": f"{name}-figures"})
        by_command.append(
            {
                "if": {"properties": {"command": {"const": name}}},
                "then": {"properties": {"result": {"anyOf": shown}}},
            }
        )
    table = schema["$defs"]["CommandResult"]
    table["properties"]["command"]["enum"] = list(COMMANDS)
    table["allOf"] = by_command
    return schema


def _always_writes(main: Callable[..., Any], document: str) -> bool:
    """Whether a command writes its document whatever its options are."""
    signature = inspect.signature(main)
    out = signature.parameters.get("out")
    needs_folder = out is not None and out.default is inspect.Parameter.empty
    returned = get_type_hints(main)["return"]
    has_one_result = get_origin(returned) not in (Union, types.UnionType)
    return bool(document) and needs_folder and has_one_result


def _figures(main: Callable[..., Any]) -> Schema:
    """Schema of the figures of a workflow's result, from the type that it returns."""
    long_array = {key: value for key, value in result_schema(Range).items() if key != "required"}
    array = {"anyOf": [{"type": ["array", "number", "null"]}, long_array]}
    kind = {"type": "string", "description": "Kind of a value that is not made of numbers."}
    return result_schema(
        get_type_hints(main, include_extras=True)["return"],
        own={np.ndarray: array},
        other=kind,
    )
