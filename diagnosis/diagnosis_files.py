"""Writing and reading of diagnosis.json; a file appears complete or not at all."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from carrierflex.diagnosis.comparison.problem import GapCell
from carrierflex.diagnosis.gap.findings import SIGNIFICANCE, detail_document
from carrierflex.diagnosis.results import (
    Attribution,
    Diagnosis,
    GapReduction,
    Interval,
    finite_or_none,
)
from carrierflex.files.whole_files import whole_file
from carrierflex.identification.estimate_files import software_name

FORMAT = "carrierflex-diagnosis"
VERSION = 1
#: Cells of the gap map that stand in the file, and the smallest share worth a row where chance
#: could make it.
_MOST_CELLS = 200
_SMALLEST_SHARE = 1e-3


def diagnosis_document(diagnosis: Diagnosis) -> dict[str, Any]:
    """Content of diagnosis.json; what is not finite is null.

    Parameters
    ----------
    diagnosis : Diagnosis
        What was found.

    Returns
    -------
    dict
        Keys of the contract, and beside them ``kind``, ``reason``, ``unit``, ``ladder``,
        ``screen``, ``validation``, ``gap``.
    """
    which, far = diagnosis.attribution, diagnosis.reduction
    return {
        "format": FORMAT,
        "version": VERSION,
        "campaign": diagnosis.campaign,
        "kind": diagnosis.kind,
        "software": software_name(),
        "verdict": diagnosis.verdict,
        "reason": diagnosis.reason,
        "effects": list(which.effects),
        "aliases": [list(members) for members in which.aliases],
        "parameters": _parameters(which),
        "ranking": _ranking(which),
        "where": _cells(far.cells_before),
        "where_text": diagnosis.where_text,
        "how_far": _how_far(far),
        "unit": diagnosis.unit,
        "remaining": _cells(far.cells_after),
        "ladder": [
            {
                "added": step.added,
                "rms": step.rms,
                "rho": step.rho,
                "rho_ci95": _interval(step.rho_ci95),
            }
            for step in far.search
        ],
        "screen": [
            {"effect": own.id, "r_squared": own.r_squared, "surviving_share": own.surviving}
            for own in (which.screen.effects if which.screen else ())
        ],
        "learnable_share": finite_or_none(which.explainable),
        "validation": [asdict(own) for own in far.validation],
        "gap": detail_document(diagnosis.gap, most=_MOST_CELLS) if diagnosis.gap else None,
        "separating_test": which.discriminating_experiment,
    }


def write_diagnosis(path: Path, diagnosis: Diagnosis) -> None:
    """Write diagnosis.json.

    Parameters
    ----------
    path : Path
        File to write; its folder exists.
    diagnosis : Diagnosis
        What was found.
    """
    text = (
        json.dumps(diagnosis_document(diagnosis), indent=2, allow_nan=False, ensure_ascii=False)
        + "\n"
    )
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


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
    if not path.is_file():
        raise ValueError(f"{path}: no such file; expected a diagnosis.json")
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: not a JSON file: {error}") from error
    found = document.get("format") if isinstance(document, dict) else None
    if found != FORMAT:
        raise ValueError(f"{path}: key 'format' is {found!r}; expected '{FORMAT}'")
    version = document.get("version")
    if not isinstance(version, int) or isinstance(version, bool) or version < 1:
        raise ValueError(f"{path}: key 'version' is {version!r}; expected {VERSION}")
    if version > VERSION:
        raise ValueError(
            f"{path}: key 'version' is {version}, written by a newer version; expected {VERSION}"
        )
    return document


def _parameters(which: Attribution) -> dict[str, Any]:
    return {
        effect: {
            name: {
                "value": finite_or_none(own.value),
                "std": finite_or_none(own.std),
                "unit": own.unit,
            }
            for name, own in values.items()
        }
        for effect, values in which.parameters.items()
    }


def _ranking(which: Attribution) -> list[dict[str, Any]]:
    return [
        {
            "effects": list(own.effects),
            "weight": finite_or_none(own.weight),
            "held_out_rms": finite_or_none(own.held_out_rms),
            "refused": own.refused,
        }
        for own in which.ranking
    ]


def _how_far(far: GapReduction) -> dict[str, Any]:
    numbers = {
        "rms_before": far.rms_before,
        "rms_after": far.rms_after,
        "noise_floor": far.noise_floor,
        "rho": far.rho,
        "phi": far.phi,
        "floor_multiple": far.floor_multiple,
        "placebo_rho": far.negative_control_rho,
        "ceiling_rho": far.black_box_rho,
        "extrapolation_rho": far.extrapolation_rho,
    }
    intervals = {"rho_ci95": _interval(far.rho_ci95), "phi_ci95": _interval(far.phi_ci95)}
    return (
        {name: finite_or_none(value) for name, value in numbers.items()}
        | intervals
        | {"held_out": True}
    )


def _cells(cells: Sequence[GapCell]) -> list[dict[str, Any]]:
    """Largest cells; a small one only where chance would not make it."""
    known = [cell for cell in cells if cell.share >= _SMALLEST_SHARE or cell.p_value < SIGNIFICANCE]
    return [_cell(cell) for cell in known[:_MOST_CELLS]]


def _cell(cell: GapCell) -> dict[str, Any]:
    row: dict[str, Any] = {
        "channel_pattern": cell.channel_pattern,
        "order": finite_or_none(cell.order),
        "run": cell.run,
        "share": finite_or_none(cell.share),
        "share_ci95": _interval(cell.share_ci95),
        "p_value": finite_or_none(cell.p_value),
        "mean_square": finite_or_none(cell.mean_square),
        "coherent": finite_or_none(cell.coherent),
    }
    return row if cell.frequency_hz is None else row | {"frequency_hz": list(cell.frequency_hz)}


def _interval(interval: Interval) -> list[float | None]:
    return [finite_or_none(end) for end in interval]
