"""Writing of the gap map as JSON and CSV; a file appears complete or not at all."""

import json
import math
from pathlib import Path
from typing import Any

from diagnosis.gap_map import GapMap
from diagnosis.gap_words import gap_parts, where_text
from diagnosis.order_map import PATTERNS
from geometry.whole_files import whole_file

FORMAT = "carrierflex-gap-map"
VERSION = 1
COLUMNS = ("run", "order", "pattern", "mean_square", "coherent", "share", "p_value", "adjusted_p_value")


def write_gap_json(path: Path, gap: GapMap) -> None:
    """Write the map, its parts by size and the sentence about them; mean squares in m²."""
    document = {
        "format": FORMAT,
        "version": VERSION,
        "baseline": gap.model,
        "where_text": where_text(gap),
        "rms": {run: float(gap.rms[k]) for k, run in enumerate(gap.runs)},
        "n_revolutions": dict(zip(gap.runs, gap.n_revolutions, strict=True)),
        "parts": [
            {"order": part.order, "patterns": part.patterns, "share": _finite(part.share), "runs": part.runs}
            for part in gap_parts(gap)
        ],
        "cells": [dict(zip(COLUMNS, row, strict=True)) for row in _rows(gap)],
    }
    _write(path, json.dumps(document, indent=1, allow_nan=False) + "\n")


def write_gap_csv(path: Path, gap: GapMap) -> None:
    """Write the map as a table, one row a run, order and pattern; mean squares in m²."""
    lines = [",".join(COLUMNS)]
    lines += [",".join("" if value is None else str(value) for value in row) for row in _rows(gap)]
    _write(path, "\n".join(lines) + "\n")


def _rows(gap: GapMap) -> list[tuple[Any, ...]]:
    """One row a cell, in the sequence of COLUMNS."""
    tables = (gap.mean_square, gap.coherent, gap.share, gap.p_value, gap.adjusted_p_value)
    return [
        (run, int(order), m, *(_finite(float(table[k, order, column])) for table in tables))
        for k, run in enumerate(gap.runs)
        for order in gap.orders
        for column, m in enumerate(PATTERNS)
    ]


def _finite(value: float) -> float | None:
    """JSON knows neither NaN nor infinity."""
    return value if math.isfinite(value) else None


def _write(path: Path, text: str) -> None:
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
