"""One of two diagnoses that are compared: what the comparison needs of a diagnosis.json."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from carrierflex.diagnosis.report.diagnosis_files import DIAGNOSIS_FILE, read_diagnosis
from carrierflex.files.shown_values import shown

#: A cell of the gap map: run, pattern or channel, order.
CellKey = tuple[str, str, float]
#: A block of a run.
BlockKey = tuple[str, int]


@dataclass(frozen=True, eq=False)
class BlockGap:
    """Held-out gap of the baseline in one block: condition, samples, mean square."""

    condition: str
    samples: int
    mean_square: float


@dataclass(frozen=True, eq=False)
class CellGap:
    """One cell of the baseline's gap map.

    Parameters
    ----------
    mean_square, coherent : float
        Mean square of the gap, and the same less the noise.
    p_value : float
        Probability without a gap.
    frequency_hz : tuple of float, optional
        Band of the cell [Hz].
    """

    mean_square: float
    coherent: float
    p_value: float
    frequency_hz: tuple[float, float] | None


@dataclass(frozen=True, eq=False)
class RunError:
    """Comparison error of a run and its uncertainty (ASME V&V 20)."""

    error: float
    u_val: float


@dataclass(frozen=True, eq=False)
class DiagnosisSide:
    """What one diagnosis says of its baseline.

    Parameters
    ----------
    folder : Path
        Where its diagnosis.json stands.
    campaign, kind, unit, verdict : str
        As in the file.
    measured : str
        Digest of the measured records.
    causes : tuple of str
        What it says is missing: named effects; classes where no effect is named.
    rms, noise_floor : float
        Held-out RMS of the baseline's gap and of the noise.
    blocks : mapping of BlockKey to BlockGap
        Held-out gap by block.
    cells : mapping of CellKey to CellGap
        Gap map.
    runs : mapping of str to RunError
        Comparison error by run.
    """

    folder: Path
    campaign: str
    kind: str
    unit: str
    verdict: str
    measured: str
    causes: tuple[str, ...]
    rms: float
    noise_floor: float
    blocks: Mapping[BlockKey, BlockGap]
    cells: Mapping[CellKey, CellGap]
    runs: Mapping[str, RunError]


def read_side(folder: Path) -> DiagnosisSide:
    """Read one diagnosis.

    Parameters
    ----------
    folder : Path
        Folder of ``carrierflex diagnose --out``.

    Raises
    ------
    ValueError
        Where its diagnosis.json is missing, of another format or of a newer version, holds no
        digest of its records, made no diagnosis, or lacks a key.
    """
    path = folder / DIAGNOSIS_FILE
    document = read_diagnosis(path)
    if not document.get("records"):
        raise ValueError(
            f"{path}: key 'records' is missing, so that it cannot be told which measurement this "
            "is; expected the digests that diagnose writes: diagnose the campaign again"
        )
    if not document.get("held_out"):
        reason = shown(document.get("reason"))
        raise ValueError(f"{path}: holds no gap to compare; its reason is {reason}")
    try:
        return _side(folder, document)
    except KeyError as error:
        raise ValueError(f"{path}: missing key {error}; expected a whole diagnosis") from error
    except (TypeError, ValueError, AttributeError, OverflowError) as error:
        reason = " ".join(str(error).split())
        raise ValueError(f"{path}: a value is of another type ({reason})") from error


def _side(folder: Path, document: Mapping[str, Any]) -> DiagnosisSide:
    far = document["how_far"]
    return DiagnosisSide(
        folder=folder,
        campaign=_text(document["campaign"]),
        kind=_text(document["kind"]),
        unit=_text(document["unit"]),
        verdict=_text(document["verdict"]),
        measured=_text(document["records"]["measured"]),
        causes=_causes(document["effects"], document["classes"]),
        rms=_number(far["rms_before"]),
        noise_floor=_number(far["noise_floor"]),
        blocks={
            (_text(row["run"]), int(row["block"])): BlockGap(
                _text(row["condition"]), int(row["samples"]), _number(row["mean_square"])
            )
            for row in document["held_out"]
        },
        cells={
            (_text(row["run"]), _text(row["channel_pattern"]), _number(row["order"])): _cell(row)
            for row in document["where"]
        },
        runs={
            _text(row["run"]): RunError(_number(row["error_before"]), _number(row["u_val"]))
            for row in document["validation"]
        },
    )


def _causes(effects: Sequence[Any], classes: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    named = [_text(effect) for effect in effects]
    of_class = [_text(found["id"]) for found in classes]
    return tuple(named or of_class)


def _cell(row: Mapping[str, Any]) -> CellGap:
    band = row.get("frequency_hz")
    return CellGap(
        _number(row["mean_square"]),
        _number(row["coherent"]),
        _number(row["p_value"]),
        None if band is None else (_number(band[0]), _number(band[1])),
    )


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise TypeError(f"found {shown(value)}; expected a text")
    return value


def _number(value: object) -> float:
    """Number of the file; null is not a number."""
    if value is None:
        return math.nan
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise TypeError(f"found {shown(value)}; expected a number")
    return float(value)
