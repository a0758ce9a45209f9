"""Compare two diagnoses: of one measurement before and after a change, or of two measurements.

Of one measurement: the gap on the same held-out blocks, what shrank and what came in the gap map,
what is named before and after. A good answer: the ratio's interval excludes one, the cause that was
added is no longer missing, and nothing came. Of two turbines or two days: which causes differ
beyond their intervals, and which measurement would decide.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from carrierflex.files.json_files import save_json, save_text
from carrierflex.workflows.outputs import prepared_folder

if TYPE_CHECKING:
    from carrierflex.workflows.diagnosis.gap_change import GapChange
    from carrierflex.workflows.diagnosis.record_difference import RecordDifference


def main(before: Path, after: Path, *, out: Path | None = None) -> GapChange | RecordDifference:
    """Compare two diagnoses: before and after the simulator changed, or of two turbines or days.

    The digests in diagnosis.json tell whether both are of one measurement.

    Parameters
    ----------
    before : Path
        Folder of the earlier or first diagnosis, with its diagnosis.json.
    after : Path
        Folder of the later or second diagnosis, with its diagnosis.json.
    out : Path, optional
        Folder to write: comparison.json and comparison.html; default: the result is shown and not
        written.

    Returns
    -------
    GapChange or RecordDifference
        Of one measurement, ratio of the gap with its interval, cells that shrank and came, causes,
        error by run; of two, sizes of causes with the intervals of their differences.

    Raises
    ------
    ValueError
        Where a diagnosis is missing, of a newer version, or without digests of its records, or
        where the two are of different kind or unit.
    OSError
        Where `out` cannot be written.
    """
    from carrierflex.workflows.diagnosis import gap_change, record_difference

    if gap_change.digest_of_records(before) == gap_change.digest_of_records(after):
        return compared_gaps(before, after, out)
    difference = record_difference.record_difference(before, after)
    if out is not None:
        document = record_difference.difference_document(difference)
        _write(out, document, record_difference.difference_page(difference))
    return difference


def compared_gaps(before: Path, after: Path, out: Path | None) -> GapChange:
    """What became of the gap of one measurement, written where a folder is given.

    Raises
    ------
    ValueError, OSError
        As :func:`main`; ValueError also where the records differ.
    """
    from carrierflex.workflows.diagnosis import gap_change

    change = gap_change.gap_change(gap_change.read_side(before), gap_change.read_side(after))
    if out is not None:
        _write(out, gap_change.change_document(change), gap_change.comparison_page(change))
    return change


def _write(out: Path, document: dict[str, Any], page: str) -> None:
    prepared_folder(out)
    save_json(out / "comparison.json", document)
    save_text(out / "comparison.html", page)
