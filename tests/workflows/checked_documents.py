"""A JSON file that a command wrote, held against its schema."""

import json

import jsonschema

from carrierflex.workflows.schemas.file_schemas import file_schema


def checked_document(path):
    """Content of a file; it fails where a key is missing, unknown, or of another type."""
    document = json.loads(path.read_text(encoding="utf-8"))
    validator = jsonschema.Draft202012Validator(file_schema(path.stem.replace("_", " ")))
    refusals = [
        f"{error.json_path}: {error.message[:300]}" for error in validator.iter_errors(document)
    ]
    assert refusals == []
    return document
