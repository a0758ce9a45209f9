"""Tell what became of the gap after an effect was added to the simulator.

Two diagnoses of one measurement are laid beside each other: the gap on the same held-out blocks,
what shrank and what came in the gap map, what is named before and after. A good answer: the ratio's
interval excludes one, the cause that was added is no longer missing, and nothing came.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from carrierflex.files.json_files import save_json, save_text
from carrierflex.workflows.outputs import prepared_folder

if TYPE_CHECKING:
    from carrierflex.diagnosis.report.gap_change import GapChange

COMPARISON_FILE = "comparison.json"
PAGE_FILE = "comparison.html"


def main(before: Path, after: Path, *, out: Path | None = None) -> GapChange:
    """Compare two diagnoses of one measurement, before and after the simulator changed.

    Parameters
    ----------
    before : Path
        Folder of the earlier diagnosis, with its diagnosis.json.
    after : Path
        Folder of the later diagnosis, with its diagnosis.json.
    out : Path, optional
        Folder to write: comparison.json and comparison.html; default: the result is only shown.

    Returns
    -------
    GapChange
        Ratio of the gap with its interval, cells that shrank and came, causes, error by run.

    Raises
    ------
    ValueError
        Where a diagnosis is missing, of a newer version, or without digests of its records, or
        where the two are of different kind, unit or measurement.
    OSError
        Where `out` cannot be written.
    """
    from carrierflex.diagnosis.report.gap_change import (
        change_document,
        comparison_page,
        gap_change,
        read_side,
    )

    change = gap_change(read_side(before), read_side(after))
    if out is not None:
        prepared_folder(out)
        save_json(out / COMPARISON_FILE, change_document(change))
        save_text(out / PAGE_FILE, comparison_page(change))
    return change
