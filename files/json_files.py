"""JSON and text files, whole or not at all; numbers that JSON does not know become null."""

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from carrierflex.files.whole_files import whole_file


def plain(value: Any) -> Any:
    """Copy of `value` made of what JSON knows; floats that are not finite become null."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {
            field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value)
        }
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, np.integer):
        return int(value)
    if isinstance(value, (float, np.floating)):
        return float(value) if np.isfinite(value) else None
    return value if isinstance(value, (str, int)) or value is None else str(value)


def save_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write `content` as indented JSON."""
    save_text(path, json.dumps(plain(content), indent=2, ensure_ascii=False) + "\n")


def save_text(path: Path, text: str) -> None:
    """Write text."""
    with whole_file(path) as file:
        file.write_text(text, encoding="utf-8")
