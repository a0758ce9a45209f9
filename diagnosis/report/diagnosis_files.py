"""Writing and reading of diagnosis.json and writing of report.html.

A file appears complete or not at all.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from carrierflex.diagnosis.classes.results import LEADING_CLASS, ClassAnswer, MeasuredShape
from carrierflex.diagnosis.comparison.problem import GapCell
from carrierflex.diagnosis.gap.findings import GapDetail
from carrierflex.diagnosis.gap.gap_map import SIGNIFICANCE, map_of
from carrierflex.diagnosis.inference.results import CLASS_NAMED, Attribution, GapReduction
from carrierflex.diagnosis.report.gap_words import parity_words, scatter_words, where_text
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.files.json_files import plain, read_json, save_plain_json, save_text
from carrierflex.files.shown_values import shown
from carrierflex.files.versions import software_name

DIAGNOSIS_FILE = "diagnosis.json"
FORMAT = "carrierflex-diagnosis"
VERSION = 2
#: Rows of a table in the file at most, and the smallest share worth a row where chance could make
#: it.
_MOST_ROWS = 200
_SMALLEST_SHARE = 1e-3


def diagnosis_document(diagnosis: Diagnosis) -> dict[str, Any]:
    """Content of diagnosis.json; what is not finite is null."""
    which = diagnosis.attribution
    reduction = diagnosis.reduction
    content = {
        "format": FORMAT,
        "version": VERSION,
        "campaign": diagnosis.campaign,
        "kind": diagnosis.kind,
        "software": software_name(),
        "verdict": diagnosis.verdict,
        "incomplete": _is_incomplete(diagnosis),
        "reason": diagnosis.reason,
        "effects": which.effects,
        "aliases": which.aliases,
        "parameters": which.parameters,
        "gains": which.gains or None,
        "undetermined": which.undetermined,
        "ranking": _ranking(which),
        "where": _cells(reduction.cells_before if reduction else ()),
        "where_text": where_text(diagnosis),
        "how_far": _how_far(reduction),
        "how_far_law": _how_far(diagnosis.reduction_law or reduction),
        **class_keys(diagnosis.classes),
        "unit": diagnosis.unit,
        "remaining": _cells(reduction.cells_after if reduction else ()),
        "ladder": reduction.steps if reduction else (),
        "validation": reduction.validation if reduction else (),
        "held_out": reduction.blocks if reduction else (),
        "records": diagnosis.records,
        "gap": None if diagnosis.gap is None else _gap(diagnosis.gap, diagnosis.unit),
        "separating_test": which.discriminating_experiment,
        "warnings": [warning.entry() for warning in diagnosis.warnings],
    }
    document: dict[str, Any] = plain(content)
    return document


def _is_incomplete(diagnosis: Diagnosis) -> bool:
    """Whether a class leads without explaining what a cause would."""
    classes = diagnosis.classes
    return (
        diagnosis.verdict == CLASS_NAMED and classes is not None and classes.state == LEADING_CLASS
    )


def write_diagnosis(path: Path, diagnosis: Diagnosis) -> None:
    """Write diagnosis.json."""
    save_plain_json(path, diagnosis_document(diagnosis))


def write_report(path: Path, page: str) -> None:
    """Write report.html."""
    save_text(path, page)


def read_diagnosis(path: Path) -> dict[str, Any]:
    """Read diagnosis.json.

    Parameters
    ----------
    path : Path
        File written by :func:`write_diagnosis`.

    Returns
    -------
    dict
        Its content.

    Raises
    ------
    ValueError
        Where the file is missing, no JSON, of another format, or written by a newer version.
    """
    document = read_json(path, "a diagnosis.json")
    name = document.get("format") if isinstance(document, dict) else None
    if name != FORMAT:
        raise ValueError(f"{path}: key 'format' is {shown(name)}; expected '{FORMAT}'")
    version = document.get("version")
    if not isinstance(version, int) or isinstance(version, bool) or version < 1:
        raise ValueError(f"{path}: key 'version' is {shown(version)}; expected {VERSION}")
    if version > VERSION:
        raise ValueError(
            f"{path}: key 'version' is {shown(version)}, written by a newer version; "
            f"expected {VERSION}"
        )
    return document


def _share(value: float) -> float:
    """Share as it is written: within 0 and 1, NaN (null) where it is not known."""
    return min(max(value, 0.0), 1.0)


def class_keys(answer: ClassAnswer | None) -> dict[str, Any]:
    """Keys of the answer by class in diagnosis.json; empty lists where the kind has no classes."""
    if answer is None:
        return {
            "classes": (),
            "class_ties": (),
            "class_rivals": {},
            "beyond_share": None,
            "beyond_learnable": None,
            "class_note": "",
        }
    return {
        "classes": [
            {
                "id": finding.id,
                "share": _share(finding.share),
                "share_ci95": [_share(end) for end in finding.share_ci95],
                "law": finding.law or None,
                "law_share": _share(finding.law_share),
                "law_named": finding.law_named,
                "shape": _shape(finding.shape),
            }
            for finding in answer.classes
        ],
        "class_ties": answer.ties,
        "class_rivals": {name: _share(value) for name, value in answer.rivals.items()},
        "beyond_share": answer.beyond_share,
        "beyond_learnable": answer.beyond_learnable,
        "class_note": answer.note,
    }


def _shape(shape: MeasuredShape | None) -> dict[str, Any] | None:
    if shape is None:
        return None
    return {
        "x": shape.x,
        "y": shape.y,
        "band": shape.band,
        "law": shape.law,
        "labels": shape.labels,
        "units": shape.units,
        "words": shape.words,
        "name": shape.name,
        "beside": [
            {"name": other.name, "x": other.x, "y": other.y, "band": other.band}
            for other in shape.beside
        ],
    }


def _ranking(which: Attribution) -> list[dict[str, Any]]:
    return [
        {
            "effects": ranked.effects,
            "held_out_rms": ranked.held_out_rms,
            "refused": ranked.refused,
        }
        for ranked in which.ranking
    ]


#: Keys of ``how_far`` by the field that they hold.
_HOW_FAR = {
    "rms_before": "rms_before",
    "rms_after": "rms_after",
    "noise_floor": "noise_floor",
    "rho": "rho",
    "phi": "phi",
    "floor_multiple": "floor_multiple",
    "extrapolation_rho": "extrapolation_rho",
}
_HOW_FAR_INTERVALS = ("rho_ci95", "phi_ci95")


def _how_far(reduction: GapReduction | None) -> dict[str, Any]:
    """Figures of merit; all null where no diagnosis was made."""
    if reduction is None:
        document: dict[str, Any] = dict.fromkeys(_HOW_FAR)
        document |= {key: (None, None) for key in _HOW_FAR_INTERVALS}
    else:
        document = {key: getattr(reduction, field) for key, field in _HOW_FAR.items()}
        document |= {key: getattr(reduction, key) for key in _HOW_FAR_INTERVALS}
    return document | {"held_out": True}


def _cells(cells: Sequence[GapCell]) -> list[Mapping[str, Any]]:
    """Largest cells; a small one only where chance would not make it."""
    gap_map = map_of(cells)
    known = gap_map.chosen((gap_map.shares >= _SMALLEST_SHARE) | (gap_map.p_values < SIGNIFICANCE))
    rows = []
    for cell in known[:_MOST_ROWS]:
        row = plain(cell)
        if cell.frequency_hz is None:
            del row["frequency_hz"]
        rows.append(row)
    return rows


def _gap(detail: GapDetail, unit: str) -> dict[str, Any]:
    """Content of the key ``gap``."""
    findings = detail.findings
    tables: dict[str, Sequence[Any]] = {
        "in_time": findings.in_time,
        "drift": findings.drifts,
        "incoherent": findings.non_synchronous,
        "growth": findings.growth,
        "cells": detail.cells,
        "scalars": detail.scalars,
    }
    return {
        "text": scatter_words(findings, unit).plain,
        "parity": parity_words(findings.parity),
        **{name: rows[:_MOST_ROWS] for name, rows in tables.items()},
    }
