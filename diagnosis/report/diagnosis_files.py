"""What diagnosis.json holds, its writing and its reading."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from carrierflex.diagnosis.classes.results import (
    LEADING_CLASS,
    ClassAnswer,
    ClassFinding,
    MeasuredShape,
)
from carrierflex.diagnosis.comparison.problem import GapCell
from carrierflex.diagnosis.gap.findings import Drift, GapDetail, GapFindings, NonSynchronousCell
from carrierflex.diagnosis.gap.gap_map import SIGNIFICANCE, map_of
from carrierflex.diagnosis.inference.results import (
    CLASS_NAMED,
    NO_INTERVAL,
    Attribution,
    BlockScore,
    GapReduction,
    RunValidation,
    SelectionStep,
)
from carrierflex.diagnosis.report.gap_words import parity_words, scatter_words, where_text
from carrierflex.diagnosis.report.verdict_words import verdict_heading
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.files.json_files import plain, read_document, save_plain_json
from carrierflex.files.result_schemas import json_content, json_table
from carrierflex.files.versions import software_name

DIAGNOSIS_FILE = "diagnosis.json"
FORMAT, VERSION = "carrierflex-diagnosis", 2
#: Rows of a table in the file at most, and the smallest share worth a row where chance could make
#: it.
_MOST_ROWS = 200

Verdict = Annotated[
    Literal[
        "named",
        "named_with_remainder",
        "class_named",
        "aliased",
        "none_of_these",
        "at_noise_floor",
        "not_diagnosable",
    ],
    "What the diagnosis says",
]

#: Tables of diagnosis.json.
_CELL = json_table(
    "Cell",
    "One cell of the gap map.",
    {GapCell: "order share p_value"},
    optional="frequency_hz",
    channel_pattern=(str, "Channel or sensor pattern"),
    run=(str, "Run"),
    mean_square=(float, "Mean square of the gap [unit squared]"),
    coherent=(float, "The same less the noise floor; may be negative"),
    share_ci95=([float], "95 % interval of the share"),
    frequency_hz=([float], "Band of the cell [Hz]"),
)
_HOW_FAR = json_table(
    "HowFar",
    "Reduction of the gap on held-out records; null: no diagnosis.",
    {GapReduction: "floor_multiple extrapolation_rho"},
    rms_before=(float, "Held-out RMS of the baseline [unit]"),
    rms_after=(float, "Held-out RMS with the effects [unit]"),
    noise_floor=(float, "RMS of the noise alone [unit]"),
    rho=(float, "RMS after over before"),
    phi=(float, "Share of the mean square above the floor that is explained"),
    rho_ci95=([float], "95 % interval of rho"),
    phi_ci95=([float], "95 % interval of phi"),
    held_out=(Literal[True], "Always on records that were not fitted to"),
)
_SHAPE = json_table(
    "Shape",
    "Measured shape of a class.",
    {MeasuredShape: "band law words name beside"},
    x=([float], "Abscissa"),
    y=([float], "Central curve"),
    labels=([str], "Names of both axes"),
    units=([str], "Units of both axes"),
)
_CLASS = json_table(
    "NamedClass",
    "A class of effects that the gap is of.",
    {ClassFinding: "id share share_ci95 law_share law_named"},
    law=(str | None, "Nearest law of the library; null where the class holds none"),
    shape=(_SHAPE | None, "Its measured shape; null where it has none"),
)
_GAP = json_table(
    "GapBeyondMap",
    "The baseline's gap beyond its map.",
    {GapFindings: "in_time growth", GapDetail: "cells scalars"},
    text=(str, "What does not repeat, as a sentence"),
    parity=(str, "Parity of the missing law"),
    drift=([Drift], "Trends over a run"),
    incoherent=([NonSynchronousCell], "What does not repeat"),
)
#: diagnosis.json, written by diagnose and run.
DIAGNOSIS = json_table(
    "DiagnosisDocument",
    "diagnosis.json, written by diagnose and run.",
    {
        Diagnosis: "campaign reason reason_id unit records warnings",
        Attribution: "effects aliases parameters alternatives undetermined ranking",
    },
    format=(Literal["carrierflex-diagnosis"], "Kind of the file"),
    version=(Literal[2], "Version of the format"),
    software=(str, "Name and version of this software"),
    kind=(Literal["carrier", "mounting", "element"], "Kind of the campaign"),
    verdict=(Verdict, "What the diagnosis says"),
    headline=(str, "What the diagnosis says first, in one sentence"),
    incomplete=(bool, "Whether a class leads without explaining what a cause would"),
    gains=(str | None, "What the intervals hold of the signals' gains"),
    where=([_CELL], "Largest cells of the gap"),
    where_text=(str, "Position of the gap, as a sentence"),
    how_far=(_HOW_FAR, "How far the gap shrinks"),
    how_far_law=(_HOW_FAR, "The same of the nearest laws"),
    classes=([_CLASS], "Classes of the gap; empty where none is named"),
    class_ties=([Sequence[str]], "Classes that the records cannot distinguish"),
    class_rivals=(Mapping[str, float], "Share that another class alone explains"),
    beyond_share=(float, "Share of the gap beyond the classes"),
    beyond_learnable=(float, "Share that a flexible model learns beyond the classes"),
    class_note=(str, "What the records cannot say of classes"),
    remaining=([_CELL], "Largest cells of the remaining gap"),
    ladder=([SelectionStep], "Held-out RMS as the effects are added"),
    validation=([RunValidation], "Comparison error by run (ASME V&V 20)"),
    held_out=([BlockScore], "Held-out gap of the baseline by block"),
    gap=(_GAP | None, "The gap beyond its map"),
    separating_test=(str, "Measurement that would distinguish the rivals"),
)


def diagnosis_document(diagnosis: Diagnosis) -> dict[str, Any]:
    """Content of diagnosis.json; what is not finite is null."""
    which = diagnosis.attribution
    reduction = diagnosis.reduction
    document: dict[str, Any] = plain(
        json_content(
            DIAGNOSIS,
            diagnosis,
            which,
            software=software_name(),
            headline=verdict_heading(diagnosis),
            incomplete=diagnosis.verdict == CLASS_NAMED
            and diagnosis.classes is not None
            and diagnosis.classes.state == LEADING_CLASS,
            gains=which.gains or None,
            where=_cells(reduction.cells_before if reduction else ()),
            where_text=where_text(diagnosis),
            how_far=_how_far(reduction),
            how_far_law=_how_far(diagnosis.reduction_law or reduction),
            **_class_keys(diagnosis.classes),
            remaining=_cells(reduction.cells_after if reduction else ()),
            ladder=reduction.steps if reduction else (),
            validation=reduction.validation if reduction else (),
            held_out=reduction.blocks if reduction else (),
            gap=None if diagnosis.gap is None else _gap(diagnosis.gap, diagnosis.unit),
            separating_test=which.discriminating_experiment,
        )
    )
    return document


def write_diagnosis(path: Path, diagnosis: Diagnosis) -> None:
    """Write diagnosis.json."""
    save_plain_json(path, diagnosis_document(diagnosis))


def read_diagnosis(path: Path) -> dict[str, Any]:
    """Read diagnosis.json.

    Raises
    ------
    ValueError
        Where the file is missing, no JSON, of another format, or written by a newer version.
    """
    return read_document(path, "a diagnosis.json", FORMAT, VERSION)


def _share(value: float) -> float:
    """Share as it is written: within 0 and 1, NaN (null) where it is not known."""
    return min(max(value, 0.0), 1.0)


def _class_keys(answer: ClassAnswer | None) -> dict[str, Any]:
    """Keys of the answer by class in diagnosis.json; empty lists where the kind has no classes."""
    findings, rivals = (answer.classes, answer.rivals) if answer else ((), {})
    return {
        "classes": [
            json_content(
                _CLASS,
                finding,
                share=_share(finding.share),
                share_ci95=[_share(end) for end in finding.share_ci95],
                law=finding.law or None,
                law_share=_share(finding.law_share),
                shape=finding.shape and json_content(_SHAPE, finding.shape),
            )
            for finding in findings
        ],
        "class_ties": answer.ties if answer else (),
        "class_rivals": {name: _share(value) for name, value in rivals.items()},
        "beyond_share": answer.beyond_share if answer else None,
        "beyond_learnable": answer.beyond_learnable if answer else None,
        "class_note": answer.note if answer else "",
    }


def _how_far(reduction: GapReduction | None) -> dict[str, Any]:
    """Figures of merit; all null where no diagnosis was made."""
    intervals = dict.fromkeys(("rho_ci95", "phi_ci95"), NO_INTERVAL) if reduction is None else {}
    return json_content(_HOW_FAR, reduction, **intervals)


def _cells(cells: Sequence[GapCell]) -> list[Mapping[str, Any]]:
    """Largest cells; a small one only where chance would not make it."""
    gap_map = map_of(cells)
    known = gap_map.chosen((gap_map.shares >= 1e-3) | (gap_map.p_values < SIGNIFICANCE))
    rows = [plain(cell) for cell in known[:_MOST_ROWS]]
    return [
        {name: of for name, of in row.items() if (name, of) != ("frequency_hz", None)}
        for row in rows
    ]


def _gap(detail: GapDetail, unit: str) -> dict[str, Any]:
    """Content of the key ``gap``, no list of more than 200 rows."""
    findings = detail.findings
    content = json_content(
        _GAP,
        findings,
        detail,
        text=scatter_words(findings, unit),
        parity=parity_words(findings.parity),
        drift=findings.drifts,
        incoherent=findings.non_synchronous,
    )
    return {
        key: rows[:_MOST_ROWS] if isinstance(rows, tuple) else rows for key, rows in content.items()
    }
