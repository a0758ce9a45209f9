"""JSON that a command wrote or printed, held against its schema."""

import functools
import json

import jsonschema

from carrierflex.workflows.outputs import schema_file
from carrierflex.workflows.schemas.file_schemas import file_schema

VALIDATOR = jsonschema.Draft202012Validator(
    json.loads(schema_file("result").read_text(encoding="utf-8"))
)


def checked_result(text):
    """The document that a line prints; it fails where that does not fulfil the schema."""
    document = json.loads(text)
    error = jsonschema.exceptions.best_match(VALIDATOR.iter_errors(document))
    assert error is None, f"{error.json_path}: {error.message[:300]}"
    return document


def printed_again(line, result, file, *, module, command, monkeypatch):
    """The document that a line prints of a result, with its file, that took its module long."""

    def at_once(*_, **__):
        file.touch()
        return result

    monkeypatch.setattr(module, "main", functools.wraps(module.main)(at_once))
    done = command(*line.split(), "--out", file.parent, "--json")
    assert done.returncode == 0, done.stderr
    document = checked_result(done.stdout)
    assert document["result"] == json.loads(file.read_text(encoding="utf-8"))
    return document


def checked_document(path):
    """Content of a file; it fails where a key is missing, unknown, or of another type."""
    document = json.loads(path.read_text(encoding="utf-8"))
    validator = jsonschema.Draft202012Validator(file_schema(path.stem.replace("_", " ")))
    refusals = [
        f"{error.json_path}: {error.message[:300]}" for error in validator.iter_errors(document)
    ]
    assert refusals == []
    return document
