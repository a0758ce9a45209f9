"""JSON files that are written: their content and their schema, from the types they are made of.

A file is a :func:`json_table` or a ``TypedDict`` whose values are plain or dataclasses, as
:func:`json_files.plain` writes them: arrays and tuples are lists, a number that is not finite is
null. The words of a key are those of its annotation, ``Annotated[float, "RMS [m]"]``, or of the
docstring of its dataclass.
"""

import ast
import dataclasses
import inspect
import re
import sys
import types
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import (
    Annotated,
    Any,
    Literal,
    NotRequired,
    Union,
    get_args,
    get_origin,
    get_type_hints,
    is_typeddict,
)

import numpy as np

Schema = dict[str, Any]

#: What is not finite is null.
_NUMBER: Schema = {"type": ["number", "null"]}
_PLAIN: dict[Any, Schema] = {
    bool: {"type": "boolean"},
    int: {"type": "integer"},
    float: _NUMBER,
    np.float64: _NUMBER,
    str: {"type": "string"},
    Path: {"type": "string"},
    type(None): {"type": "null"},
    np.ndarray: {"type": "array"},
    Any: {},
    object: {},
}
_LISTS = (list, tuple, Sequence, frozenset)
_TABLES = (dict, Mapping)


def result_schema(
    document: Any, *, given: Mapping[Any, Schema] | None = None, other: Schema | None = None
) -> Schema:
    """JSON Schema (draft 2020-12) of a file that holds one document.

    Parameters
    ----------
    document : type
        Its ``TypedDict``, or a union of several.
    given : mapping of type to dict, optional
        Schemas of types that the document holds in a form of its own.
    other : dict, optional
        Schema of values of types that no JSON file holds; they are refused without.

    Returns
    -------
    dict
        Every key of every table is required, but those that the document says may be absent; other
        keys are refused.

    Raises
    ------
    TypeError
        Where a value is of a type that no JSON file holds.

    Examples
    --------
    >>> from typing import TypedDict
    >>> class Size(TypedDict):
    ...     size: Annotated[float, "Edge length of the elements [m]"]
    >>> result_schema(Size)["properties"]["size"]
    {'type': ['number', 'null'], 'description': 'Edge length of the elements [m].'}
    """
    definitions = _Definitions({**_PLAIN, **(given or {})}, other)
    top = _schema(document, definitions)
    tables = definitions.tables
    if "$ref" in top:
        top = tables.pop(top["$ref"].rpartition("/")[2])
    return ({"$defs": tables} if tables else {}) | top


def json_table(
    name: str,
    words: str,
    fields: Mapping[type, str],
    /,
    optional: str = "",
    **keys: tuple[Any, str],
) -> Any:
    """Type of a table of a JSON file: fields of results, with their words, and further keys.

    Parameters
    ----------
    name, words : str
        Name in a schema; what the table is.
    fields : mapping of type to str
        Dataclasses and the names of their fields that are written, with blanks between.
    optional : str
        Keys that may be absent.
    **keys : tuple of (type, str)
        Other keys: type and words; ``[T]`` is a list of T. A type ``Literal["a"]`` of one value is
        also its content.
    """
    written = [
        (field, Any, dataclasses.field(metadata={"of": source}))
        for source, names in fields.items()
        for field in names.split()
    ]
    written += [
        (key, _described(hint, text, key in optional.split()), dataclasses.field())
        for key, (hint, text) in keys.items()
    ]
    return dataclasses.make_dataclass(
        name, written, namespace={"__doc__": words, "__module__": __name__}
    )


def _described(hint: Any, words: str, is_optional: bool) -> Any:
    described: Any = Annotated
    described = described[Sequence[hint[0]] if isinstance(hint, list) else hint, words]
    return NotRequired[described] if is_optional else described


def json_content(table: Any, *values: Any, **keys: Any) -> dict[str, Any]:
    """Content of a table: given keys, constants, then what the values hold; None where none does.

    Parameters
    ----------
    table : type
        As of :func:`json_table`.
    *values : objects
        Results that hold its fields; the first that has one counts.
    **keys : objects
        Keys that are not written as the values hold them.

    Examples
    --------
    >>> Size = json_table("Size", "A size.", {}, a=(Literal["x"], "Kind"), b=([int], "Numbers"))
    >>> json_content(Size, b=[1])
    {'a': 'x', 'b': [1]}
    """
    content: dict[str, Any] = {}
    for field in dataclasses.fields(table):
        hint = next(iter(get_args(field.type)), None)
        choices = get_args(hint) if get_origin(hint) is Literal else ()
        if field.name in keys:
            content[field.name] = keys[field.name]
        elif len(choices) == 1:
            content[field.name] = choices[0]
        else:
            of = (value for value in values if hasattr(value, field.name))
            content[field.name] = getattr(next(of, None), field.name, None)
    return content


def type_hints(annotated: Any) -> dict[str, Any]:
    """Types of a class or function by name, also those that its module imports for checkers alone.

    Parameters
    ----------
    annotated : class or function
        Its module may hold imports below ``if TYPE_CHECKING:``, which are made here.
    """
    module = sys.modules[annotated.__module__]
    # What is defined there may build on what the module imports itself.
    late = dict(vars(module))
    for node in ast.parse(inspect.getsource(module)).body:
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            exec(compile(ast.Module(node.body, []), annotated.__module__, "exec"), late)
    return get_type_hints(annotated, localns=late, include_extras=True)


@dataclasses.dataclass
class _Definitions:
    """Schemas of plain values and of all others, and the tables met so far by name."""

    plain: Mapping[Any, Schema]
    other: Schema | None
    tables: dict[str, Schema] = dataclasses.field(default_factory=dict)
    types: dict[str, Any] = dataclasses.field(default_factory=dict)


def _schema(value: Any, definitions: _Definitions) -> Schema:
    """Schema of one value; tables are added to the definitions and referred to."""
    if value in definitions.plain:
        return dict(definitions.plain[value])
    origin = get_origin(value)
    arguments = get_args(value)
    if origin is Annotated:
        return {**_schema(arguments[0], definitions), "description": f"{arguments[1]}."}
    if origin is Literal:
        return {"enum": list(arguments)}
    if origin is NotRequired:
        return _schema(arguments[0], definitions)
    if origin in (Union, types.UnionType):
        return {"anyOf": [_schema(argument, definitions) for argument in arguments]}
    if origin in _LISTS:
        return _list(arguments, definitions)
    if origin in _TABLES:
        return {"type": "object", "additionalProperties": _schema(arguments[1], definitions)}
    if origin is np.ndarray:
        return dict(definitions.plain[np.ndarray])
    if is_typeddict(value) or dataclasses.is_dataclass(value):
        return _reference(value, definitions)
    if definitions.other is None:
        raise TypeError(f"{value!r} is no type of a JSON file")
    return dict(definitions.other)


def _reference(table: Any, definitions: _Definitions) -> Schema:
    name = table.__name__
    if definitions.types.setdefault(name, table) is not table:
        raise TypeError(f"{table!r} and {definitions.types[name]!r} have one name in a schema")
    if name not in definitions.tables:
        definitions.tables[name] = {}
        definitions.tables[name] = _table(table, definitions)
    return {"$ref": f"#/$defs/{name}"}


def _list(arguments: tuple[Any, ...], definitions: _Definitions) -> Schema:
    """Lists of any length, or of as many values as a tuple has."""
    of_any_length = len(arguments) == 1 or arguments[-1] is Ellipsis
    if of_any_length:
        return {"type": "array", "items": _schema(arguments[0], definitions)}
    items = [_schema(argument, definitions) for argument in arguments]
    return {"type": "array", "prefixItems": items, "minItems": len(items), "maxItems": len(items)}


def _table(table: Any, definitions: _Definitions) -> Schema:
    hints = type_hints(table)
    words = _words(inspect.getdoc(table) or "")
    if is_typeddict(table):
        required = [name for name in hints if name in table.__required_keys__]
    else:
        fields = {field.name: field.metadata.get("of") for field in dataclasses.fields(table)}
        hints = {name: type_hints(of)[name] if of else hints[name] for name, of in fields.items()}
        required = [name for name, hint in hints.items() if get_origin(hint) is not NotRequired]
        for source in dict.fromkeys(fields.values()):
            words |= _words(inspect.getdoc(source) or "") if source else {}
    properties = {}
    for name, hint in hints.items():
        described = {"description": words[name]} if name in words else {}
        properties[name] = described | _schema(hint, definitions)
    title = (inspect.getdoc(table) or table.__name__).splitlines()[0]
    return {
        "type": "object",
        "description": title,
        "properties": properties,
        "required": required,
        "additionalProperties": False,
    }


def _words(docstring: str) -> dict[str, str]:
    """Words of the parameters of a docstring in NumPy's form, by name."""
    _, _, section = docstring.partition("Parameters\n----------\n")
    section = re.split(r"\n\w+\n-+\n", section)[0]
    words: dict[str, str] = {}
    names: list[str] = []
    for line in section.splitlines():
        if line.startswith(" "):
            words |= {name: f"{words.get(name, '')} {line.strip()}".strip() for name in names}
        elif line:
            names = [name.strip() for name in line.partition(" : ")[0].split(",")]
    return words
