"""Tell what became of the gap after an effect was added to the simulator.

Two diagnoses of one measurement are laid beside each other: the gap on the same held-out blocks,
what shrank and what came in the gap map, what is named before and after. A good answer: the ratio's
interval excludes one, the cause that was added is no longer missing, and nothing came.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypedDict

from carrierflex.files.json_files import save_json, save_text
from carrierflex.files.versions import Software
from carrierflex.workflows.outputs import prepared_folder

if TYPE_CHECKING:
    from carrierflex.diagnosis.report.gap_change import CellChange, GapChange, RunChange
    from carrierflex.workflows.diagnosis.documents import Verdict

COMPARISON_FILE = "comparison.json"
PAGE_FILE = "comparison.html"


def main(before: Path, after: Path, *, out: Path | None = None) -> GapChange:
    """Compare two diagnoses of one measurement, before and after the simulator changed.

    Parameters
    ----------
    before, after : Path
        Folders of diagnose --out, each with its diagnosis.json.
    out : Path, optional
        Folder for comparison.json and comparison.html; without, the result is only shown.

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
    from carrierflex.diagnosis.report.gap_change import gap_change, read_side
    from carrierflex.diagnosis.report.gap_change_page import change_document, comparison_page

    change = gap_change(read_side(before), read_side(after))
    if out is not None:
        prepared_folder(out)
        save_json(out / COMPARISON_FILE, change_document(change))
        save_text(out / PAGE_FILE, comparison_page(change))
    return change


class Side(TypedDict):
    """One of two diagnoses."""

    folder: Annotated[str, "Where it stands"]
    campaign: Annotated[str, "Name of the campaign"]
    verdict: Verdict
    causes: Annotated[Sequence[str], "Named effects, or classes where none is named"]
    rms: Annotated[float, "Held-out RMS of the baseline's gap [unit]"]
    noise_floor: Annotated[float, "RMS of the noise [unit]"]


class Causes(TypedDict):
    """What became of the causes."""

    solved: Annotated[Sequence[str], "Named before only"]
    remaining: Annotated[Sequence[str], "Named both times"]
    added: Annotated[Sequence[str], "Named after only"]


class ComparisonDocument(TypedDict):
    """comparison.json, written by compare."""

    format: Annotated[Literal["carrierflex-comparison"], "Kind of the file"]
    version: Annotated[Literal[1], "Version of the format"]
    software: Software
    text: Annotated[str, "What became of the gap, in one sentence"]
    kind: Annotated[str, "Kind of the campaign"]
    unit: Annotated[str, "Unit of every RMS"]
    measured: Annotated[str, "SHA-256 of the measured records"]
    before: Annotated[Side, "First diagnosis"]
    after: Annotated[Side, "Second diagnosis"]
    ratio: Annotated[float, "RMS of the gap after over before"]
    ratio_ci95: Annotated[Sequence[float], "95 % interval of the ratio"]
    explained: Annotated[float, "Share of the mean square above the noise that went"]
    causes: Annotated[Causes, "Causes"]
    cells: Annotated[Sequence[CellChange], "Cells of the gap map, largest change first"]
    runs: Annotated[Sequence[RunChange], "Error by run"]
