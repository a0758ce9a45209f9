"""From the errors of a validation to lines with table, key, what was found and what is expected."""

import difflib
from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import ValidationError

from carrierflex.files.problems import problems_of
from carrierflex.files.shown_values import shortened, shown
from carrierflex.files.toml_values import TomlTable, json_schema

Schema = Mapping[str, Any]
KeyPath = tuple[str | int, ...]

_A_TABLE = ("model_type", "dict_type", "model_attributes_type")
_TABLES = ("list_type", "too_short")
_BAD_TAG = ("union_tag_invalid", "union_tag_not_found")


def problems_in(
    error: ValidationError,
    document: Mapping[str, Any],
    table: type[TomlTable],
) -> tuple[str, ...]:
    """One line for every problem.

    Parameters
    ----------
    error : ValidationError
        What pydantic refused.
    document : mapping
        The document that it refused.
    table : type of TomlTable
        Its top table.
    """
    schema = json_schema(table)
    errors = error.errors(include_url=False)
    entries = [{**entry, "loc": _key_path(entry["loc"], document)} for entry in errors]
    misspelt = {known for entry in entries if (known := _misspelt(entry, document, schema))}
    lines: list[str] = []
    for entry in entries:
        if entry["type"] != "missing" or entry["loc"] not in misspelt:
            lines.extend(_lines(entry, document, schema))
    return tuple(lines)


def newer_keys_in(
    document: Mapping[str, Any], table: type[TomlTable], version: int
) -> tuple[str, ...]:
    """One line for every key, and every value, that a later version of the format brought.

    Parameters
    ----------
    document : mapping
        Parsed document.
    table : type of TomlTable
        Its top table.
    version : int
        Version that the document states.
    """
    schema = json_schema(table)
    return tuple(_newer_keys((), document, document, schema, version))


def _newer_keys(
    path: KeyPath, value: Any, document: Any, schema: Schema, version: int
) -> Iterator[str]:
    if isinstance(value, list):
        for number, entry in enumerate(value):
            yield from _newer_keys((*path, number), entry, document, schema, version)
    if not isinstance(value, dict):
        return
    for name, known in _properties(path, document, schema).items():
        if name not in value:
            continue
        words, since = f"key '{name}'", known.get("since", 1)
        values = known.get("newer_values", {})
        if isinstance(value[name], str) and value[name] in values:
            words = f"key '{name}' is '{value[name]}', which"
            since = max(since, values[value[name]])
        if since > version:
            yield f"{_at(path)}{words} belongs to version {since}; expected version = {since}"
        yield from _newer_keys((*path, name), value[name], document, schema, version)


def _lines(entry: Mapping[str, Any], document: Any, schema: Schema) -> Iterator[str]:
    """Lines of one error of the validation; a check may have found several problems."""
    path = entry["loc"]
    kind = entry["type"]
    value = entry["input"]
    if kind == "value_error":
        inside = path if isinstance(value, dict) else path[:-1]
        table = _at(inside)
        for problem in problems_of(entry["ctx"]["error"]):
            # A problem of several tables names them itself.
            yield problem if problem.startswith(table.removesuffix(": ")) else table + problem
        return
    before, name = _at(path[:-1]), shortened(str(path[-1]) if path else "")
    if kind in _BAD_TAG:
        yield from _bad_tag(entry, document, schema)
    elif kind == "extra_forbidden":
        yield f"{before}unknown key '{name}'; {_instead(path, document, schema)}"
    elif kind == "missing":
        expected = _words(_schema_at(path, document, schema))
        yield f"{before}missing key '{name}'; expected {expected}"
    else:
        words = entry["msg"] if kind == "expected" else _type_words(kind, entry["msg"])
        if isinstance(path[-1], int):
            yield f"{_at(path)}{shown(value)}; expected {words}"
        else:
            yield f"{before}key '{name}' is {shown(value)}; expected {words}"


def _type_words(kind: str, message: str) -> str:
    if kind in _A_TABLE:
        return "a table"
    return "at least one table" if kind in _TABLES else message.removeprefix("Input should be ")


def _bad_tag(entry: Mapping[str, Any], document: Any, schema: Schema) -> Iterator[str]:
    """A table whose form depends on one of its keys, and the key is missing or wrong."""
    tag = entry["ctx"]["discriminator"].strip("'")
    choices = ", ".join(_schema_at(entry["loc"], document, schema)["discriminator"]["mapping"])
    where = _at(entry["loc"])
    if not isinstance(entry["input"], dict):
        yield f"{where}{shown(entry['input'])}; expected a table"
    elif tag in entry["input"]:
        yield f"{where}key '{tag}' is {shown(entry['input'][tag])}; expected one of {choices}"
    else:
        yield f"{where}missing key '{tag}'; expected one of {choices}"


def _key_path(loc: KeyPath, document: Any) -> KeyPath:
    """Way to a value without the steps that only name a form of a table (``cylinder``)."""
    steps: list[str | int] = []
    value = document
    for number, step in enumerate(loc):
        if isinstance(value, list) if isinstance(step, int) else step in _table(value):
            value = value[step]
        elif number < len(loc) - 1:
            continue
        steps.append(step)
    return tuple(steps)


def _table(value: Any) -> Mapping[str, Any]:
    """The value, an empty table where it is none."""
    return value if isinstance(value, dict) else {}


def _at(path: KeyPath) -> str:
    """``[[runs]] 1, [motion]: `` for the way to the first run's motion."""
    texts, names = [], list[str]()
    for step in path:
        if isinstance(step, int):
            texts.append(f"[[{'.'.join(names)}]] {step + 1}")
            names = []
        else:
            names.append(shortened(step))
    if names:
        texts.append(f"[{'.'.join(names)}]")
    return ", ".join(texts) + ": " if texts else ""


def _misspelt(entry: Mapping[str, Any], document: Any, schema: Schema) -> KeyPath | None:
    """Way to the known key that an unknown one was meant for."""
    path = entry["loc"]
    if entry["type"] != "extra_forbidden":
        return None
    nearest = _nearest(str(path[-1]), list(_properties(path[:-1], document, schema)))
    return (*path[:-1], nearest) if nearest else None


def _instead(path: KeyPath, document: Any, schema: Schema) -> str:
    known = list(_properties(path[:-1], document, schema))
    nearest = _nearest(str(path[-1]), known)
    return f"did you mean '{nearest}'?" if nearest else f"expected one of {', '.join(known)}"


def _nearest(name: str, known: list[str]) -> str:
    """Known key that differs from `name` by a few letters, empty where none does.

    Case does not count. Symbols of one or two letters (``K4``) are all near each other: they match
    only where case is the difference.
    """
    plain = {entry.lower(): entry for entry in known}
    cutoff = 0.6 if len(name) > 2 else 1.0
    close = difflib.get_close_matches(name[:100].lower(), plain, n=1, cutoff=cutoff)
    return plain[close[0]] if close else ""


def _words(schema: Schema) -> str:
    """Expectation of a key in words."""
    if "expected" in schema:
        return str(schema["expected"])
    return "at least one table" if schema.get("type") == "array" else "a table"


def _properties(path: KeyPath, document: Any, schema: Schema) -> Mapping[str, Schema]:
    properties: Mapping[str, Schema] = _schema_at(path, document, schema).get("properties", {})
    return properties


def _schema_at(path: KeyPath, document: Any, root: Schema) -> Schema:
    """JSON Schema of the value at a place of the document."""
    here, value = root, document
    for step in path:
        here = _form(_resolved(here, root), value, root)
        if isinstance(step, int):
            # A list may stand where none is expected: nothing of it is known.
            here = here.get("items") or {}
        else:
            here = here.get("properties", {}).get(step) or here.get("additionalProperties") or {}
        value = value[step] if isinstance(step, int) else _table(value).get(step)
    resolved = _resolved(here, root)
    return _form(resolved, value, root) if isinstance(value, dict) else resolved


def _form(schema: Schema, value: Any, root: Schema) -> Schema:
    """The form of a table that its own key chooses (``type = "plane"``), or the schema itself."""
    choice = schema.get("discriminator")
    tag = value.get(choice["propertyName"]) if choice and isinstance(value, dict) else None
    chosen = choice["mapping"].get(tag) if choice and isinstance(tag, str) else None
    return _resolved({"$ref": chosen}, root) if chosen else schema


def _resolved(schema: Schema, root: Schema) -> Schema:
    if "$ref" not in schema:
        return schema
    target: Schema = root["$defs"][schema["$ref"].rsplit("/", 1)[-1]]
    return {**target, **{name: value for name, value in schema.items() if name != "$ref"}}
