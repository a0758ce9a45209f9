"""Two diagnoses of different records: which causes differ, and which measurement would decide.

The two may be of two turbines or of two days. A cause of both is compared by its parameters; one
that a diagnosis does not name is compared by what it leaves: at most all of the other's gap.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from scipy.stats import norm

from carrierflex.diagnosis.comparison.effect_names import set_name
from carrierflex.diagnosis.inference.results import NO_INTERVAL, Interval
from carrierflex.diagnosis.report.diagnosis_files import DIAGNOSIS_FILE, Verdict, read_diagnosis
from carrierflex.diagnosis.report.page import rendered_page
from carrierflex.diagnosis.report.words import capitalised, counted, listed
from carrierflex.files.quantities import number
from carrierflex.files.result_schemas import json_content, json_table
from carrierflex.files.versions import software_name
from carrierflex.identification.estimation.resampling import NORMAL_95
from carrierflex.workflows.diagnosis.fleet_sizes import (
    GAP,
    RMS,
    CampaignRow,
    CauseSize,
    campaign_row,
    shown_size,
    shown_span,
    size_left,
    size_name,
)

#: Distance in standard deviations at which nine of ten differences lie beyond their interval.
_SEEN_IN_NINE_OF_TEN = NORMAL_95 + float(norm.ppf(0.9))
#: Records that are longer by more decide nothing in practice.
_MOST_LONGER = 100.0
_MOST_NAMED = 4


@dataclass(frozen=True, eq=False)
class SizeDifference:
    """Size of a cause in two measurements."""

    cause: Annotated[str, "Cause"]
    parameter: Annotated[str, "Parameter that is its size; rms: RMS of what the cause leaves"]
    unit: Annotated[str, "Unit"]
    first: Annotated[CauseSize | None, "Size in the first; null where it is not named there"]
    second: Annotated[CauseSize | None, "Size in the second"]
    difference: Annotated[float, "Second less first; null where one does not name the cause [unit]"]
    difference_ci95: Annotated[Interval, "Its 95 % interval [unit]"]
    differs: Annotated[bool, "Whether both are apart beyond their intervals"]
    longer: Annotated[
        float,
        "Factor on the length of both records with which nine of ten such differences are beyond "
        "their interval; null where they are already, or above 100",
    ]


@dataclass(frozen=True, eq=False)
class RecordDifference:
    """Two diagnoses of different records."""

    first: Annotated[CampaignRow, "First diagnosis"]
    second: Annotated[CampaignRow, "Second diagnosis"]
    sizes: Annotated[tuple[SizeDifference, ...], "Sizes, those that differ first"]
    deciding: Annotated[tuple[str, ...], "Measurements that would decide, as sentences"]


def record_difference(first: Path, second: Path) -> RecordDifference:
    """Compare two folders of ``diagnose --out`` of one kind, whatever their records are.

    Errors of both are taken as independent: on one rig, errors of its sensors act alike in both,
    and the intervals of differences are wider than need be.

    Raises
    ------
    ValueError
        Where a diagnosis is missing or damaged, or the two are of different kind or unit.
    """
    documents, rows = [], []
    for folder in (first, second):
        document = read_diagnosis(folder / DIAGNOSIS_FILE)
        documents.append(document)
        try:
            rows.append(campaign_row(document, str(folder), document["campaign"], ""))
        except (KeyError, TypeError, AttributeError) as error:
            raise ValueError(
                f"{folder / DIAGNOSIS_FILE}: a key is missing or of another type ({error}); "
                "expected a complete diagnosis: diagnose the campaign again"
            ) from error
    for what in ("kind", "unit"):
        of_both = [getattr(row, what) for row in rows]
        if of_both[0] != of_both[1]:
            raise ValueError(
                f"{first} and {second}: their {what} is {of_both[0]} and {of_both[1]}; expected "
                f"two diagnoses of one {what}"
            )
    sizes = sorted(_differences(rows, documents), key=_order)
    return RecordDifference(rows[0], rows[1], tuple(sizes), tuple(_deciding(sizes, documents)))


def _order(one: SizeDifference) -> tuple[bool, bool, float]:
    """Those that differ first, causes before the whole gap, larger differences before smaller."""
    std = (one.difference_ci95[1] - one.difference_ci95[0]) / (2.0 * NORMAL_95)
    distance = abs(one.difference) / std if std > 0.0 else math.inf
    return not one.differs, one.cause == GAP, -distance


def _differences(
    rows: list[CampaignRow], documents: list[dict[str, Any]]
) -> Iterator[SizeDifference]:
    known = [{(one.cause, one.parameter): one for one in row.sizes} for row in rows]
    for key, first in known[0].items():
        if key in known[1]:
            yield _of_both(first, known[1][key])
    for side in (0, 1):
        others = {cause for cause, _ in known[1 - side]}
        gap, other_gap = (of.get((GAP, RMS)) for of in (known[side], known[1 - side]))
        for cause in rows[side].causes:
            classes = [
                one for one in documents[side]["classes"] if cause in (one["law"], one["id"])
            ]
            if cause in others or not classes or gap is None or other_gap is None:
                continue
            size = size_left(cause, classes[0], gap)
            if size is not None:
                yield _of_one(size, other_gap, side)


def _of_both(first: CauseSize, second: CauseSize) -> SizeDifference:
    difference = second.value - first.value
    std = math.hypot(first.std, second.std)
    ends = (difference - NORMAL_95 * std, difference + NORMAL_95 * std)
    differs = ends[0] > 0.0 or ends[1] < 0.0
    # Standard deviations shrink with the root of the length.
    longer = (_SEEN_IN_NINE_OF_TEN * std / difference) ** 2 if difference else math.inf
    is_open = not differs and longer <= _MOST_LONGER
    return SizeDifference(
        first.cause,
        first.parameter,
        first.unit,
        first,
        second,
        difference,
        ends,
        differs,
        max(longer, 1.0) if is_open else math.nan,
    )


def _of_one(size: CauseSize, other_gap: CauseSize, side: int) -> SizeDifference:
    """A cause that one diagnosis names: it differs where it leaves more than all of the other."""
    return SizeDifference(
        cause=size.cause,
        parameter=RMS,
        unit=size.unit,
        first=size if side == 0 else None,
        second=size if side == 1 else None,
        difference=math.nan,
        difference_ci95=NO_INTERVAL,
        differs=bool(size.ci95[0] > other_gap.ci95[1]),
        longer=math.nan,
    )


def _deciding(sizes: list[SizeDifference], documents: list[dict[str, Any]]) -> Iterator[str]:
    """What would decide: tests that separate causes first, then longer records."""
    for ordinal, document in zip(("first", "second"), documents, strict=True):
        if document["separating_test"]:
            text = document["separating_test"].rstrip(".")
            yield f"At the {ordinal}, whose cause is not certain: {text}."
    longer = [one for one in sizes if np.isfinite(one.longer)]
    for one in longer[:_MOST_NAMED]:
        name = size_name(one.cause, one.parameter)
        yield (
            f"{capitalised(name)}: records {number(one.longer, 2)} times as long at both would "
            "show a difference of this size."
        )
    gains = next((document["gains"] for document in documents if document["gains"]), "")
    if longer and gains:
        yield (
            f"Longer records do not shrink what is declared of sensors and loads ({gains}): "
            "calibrate them, or compare days of one turbine with the same sensors."
        )


_SIDE = json_table(
    "ComparedRecords",
    "One of two diagnoses of different records.",
    {CampaignRow: "campaign turbine causes noise_floor gap_floors rho rho_ci95 faults"},
    verdict=(Verdict, "What the diagnosis says"),
)
#: comparison.json of two diagnoses of different records.
DIFFERENCE = json_table(
    "DifferenceDocument",
    "comparison.json, written by compare where the records differ.",
    {RecordDifference: "sizes deciding", CampaignRow: "kind unit"},
    format=(Literal["carrierflex-difference"], "Kind of the file"),
    version=(Literal[1], "Version of the format"),
    software=(str, "Name and version of this software"),
    text=(str, "What differs, in one sentence"),
    first=(_SIDE, "First diagnosis"),
    second=(_SIDE, "Second diagnosis"),
)


def difference_document(difference: RecordDifference) -> dict[str, Any]:
    """Content of comparison.json."""
    return json_content(
        DIFFERENCE,
        difference,
        difference.first,
        software=software_name(),
        text=difference_sentence(difference),
        first=json_content(_SIDE, difference.first),
        second=json_content(_SIDE, difference.second),
    )


def difference_sentence(difference: RecordDifference) -> str:
    """What differs between the two measurements, as one sentence."""
    names = [
        size_name(one.cause, one.parameter)
        for one in difference.sizes
        if one.differs and one.cause != GAP
    ]
    if names:
        more = len(names) - _MOST_NAMED
        rest = f", and {counted(more, 'more size')}" if more > 0 else ""
        return f"Beyond their intervals differ: {listed(names[:_MOST_NAMED])}{rest}."
    if any(one.differs for one in difference.sizes):
        return "The gap differs beyond its interval, no size of a cause does."
    return "No cause differs beyond its interval."


def verdict_sentence(row: CampaignRow) -> str:
    """What one diagnosis names, with its gap."""
    named = set_name(row.causes) if row.causes else "nothing"
    return (
        f"{row.turbine} ({row.campaign}): {row.verdict}, {named} named; gap "
        f"{number(row.gap_floors)} noise floors, rho {number(row.rho)}"
    )


def size_cells(one: SizeDifference) -> tuple[str, ...]:
    """Name, both sizes, difference with interval, and whether they differ, as a table has them."""
    sizes = [
        "not named" if size is None else shown_size(size.value, one.parameter, one.unit, size.std)
        for size in (one.first, one.second)
    ]
    difference = "all that is left there is smaller" if one.differs else "may hide in what is left"
    if math.isfinite(one.difference):
        value = shown_size(one.difference, one.parameter, one.unit)
        difference = f"{value} [{shown_span(one.difference_ci95, one.parameter, one.unit)}]"
    return size_name(one.cause, one.parameter), *sizes, difference, "yes" if one.differs else "no"


def difference_page(difference: RecordDifference) -> str:
    """HTML text of a comparison of different records."""
    content = {
        "difference": difference,
        "text": difference_sentence(difference),
        "software": software_name(),
        "verdict_sentence": verdict_sentence,
        "size_cells": size_cells,
    }
    return rendered_page("difference.html.j2", content)
