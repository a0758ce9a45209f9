"""JSON files are written whole or not at all, without their text in memory."""

import json
import tracemalloc

import pytest

from carrierflex.files.json_files import read_json, save_json, save_plain_json


def test_a_large_document_is_written_piece_by_piece(tmp_path):
    document = {"cells": [{"run": f"run {k}", "value": 1.37e-6 * k} for k in range(20_000)]}
    path = tmp_path / "large.json"
    tracemalloc.start()
    try:
        save_plain_json(path, document)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert path.read_text(encoding="utf-8") == json.dumps(document, indent=2) + "\n"
    assert peak < 0.3 * path.stat().st_size


def test_what_json_does_not_know_leaves_no_file(tmp_path):
    path = tmp_path / "broken.json"
    save_json(path, {"value": float("nan"), "unit": "µm"})
    assert read_json(path, "values") == {"value": None, "unit": "µm"}
    with pytest.raises(TypeError, match="not JSON serializable"):
        save_plain_json(path, {"value": 1, "second": {1, 2}})
    # The file before stands.
    assert read_json(path, "values") == {"value": None, "unit": "µm"}
    assert [entry.name for entry in tmp_path.iterdir()] == ["broken.json"]
