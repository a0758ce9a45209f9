"""Compare two diagnoses: of one measurement before and after a change, or of two measurements.

Of one measurement: the gap on the same held-out blocks, what shrank and what came in the gap map,
what is named before and after. A good answer: the ratio's interval excludes one, the cause that was
added is no longer missing, and nothing came. Of two turbines or two days: which causes differ
beyond their intervals, and which measurement would decide.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from carrierflex.files.json_files import save_json, save_text
from carrierflex.workflows.outputs import prepared_folder

if TYPE_CHECKING:
    from carrierflex.diagnosis.report.gap_change import GapChange
    from carrierflex.workflows.diagnosis.record_difference import RecordDifference

COMPARISON_FILE = "comparison.json"
PAGE_FILE = "comparison.html"


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
    from carrierflex.diagnosis.report.gap_change import digest_of_records

    is_one_measurement = digest_of_records(before) == digest_of_records(after)
    return (compared_gaps if is_one_measurement else _compared_records)(before, after, out)


def compared_gaps(before: Path, after: Path, out: Path | None) -> GapChange:
    """What became of the gap of one measurement, written where a folder is given.

    Raises
    ------
    ValueError, OSError
        As :func:`main`; ValueError also where the records differ.
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


def _compared_records(first: Path, second: Path, out: Path | None) -> RecordDifference:
    """Difference of two measurements, written where it is asked for."""
    from carrierflex.workflows.diagnosis.record_difference import (
        difference_document,
        difference_page,
        record_difference,
    )

    difference = record_difference(first, second)
    if out is not None:
        prepared_folder(out)
        save_json(out / COMPARISON_FILE, difference_document(difference))
        save_text(out / PAGE_FILE, difference_page(difference))
    return difference
