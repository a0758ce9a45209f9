"""What became of the gap between two diagnoses of one measurement: comparison.json, its page."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np

from carrierflex.diagnosis.comparison.effect_names import plain_name
from carrierflex.diagnosis.comparison.problem import GapCell
from carrierflex.diagnosis.gap.gap_map import SIGNIFICANCE
from carrierflex.diagnosis.inference.results import NO_INTERVAL, BlockScore, Interval, RunValidation
from carrierflex.diagnosis.inference.thresholds import INTERVAL
from carrierflex.diagnosis.report.diagnosis_files import DIAGNOSIS_FILE, Verdict, read_diagnosis
from carrierflex.diagnosis.report.page import rendered_page
from carrierflex.diagnosis.report.words import capitalised, listed, percent, position_of, ratio
from carrierflex.files.quantities import sized
from carrierflex.files.result_reading import restored
from carrierflex.files.result_schemas import json_content, json_table
from carrierflex.files.shown_values import shown
from carrierflex.files.versions import software_name
from carrierflex.identification.estimation.resampling import two_level_counts


@dataclass(frozen=True, eq=False)
class DiagnosisSide:
    """What one diagnosis says of its baseline."""

    folder: Annotated[Path, "Folder of its diagnosis.json"]
    campaign: Annotated[str, "Name of the campaign"]
    kind: Annotated[str, "Kind of the campaign"]
    unit: Annotated[str, "Unit of every RMS"]
    verdict: Annotated[str, "Verdict"]
    measured: Annotated[str, "SHA-256 of the measured records"]
    causes: Annotated[tuple[str, ...], "Named effects, or classes where no effect is named"]
    rms: Annotated[float, "Held-out RMS of the baseline's gap [unit]"]
    noise_floor: Annotated[float, "RMS of the noise [unit]"]
    blocks: Annotated[Mapping[tuple[str, int], BlockScore], "Held-out gap by block"]
    cells: Annotated[Mapping[tuple[str, str, float], GapCell], "Gap map"]
    runs: Annotated[Mapping[str, RunValidation], "Comparison error by run"]


def digest_of_records(folder: Path) -> str:
    """SHA-256 of the records that a diagnosis is of; ValueError where there is none."""
    path = folder / DIAGNOSIS_FILE
    records = read_diagnosis(path).get("records")
    if not isinstance(records, dict) or not isinstance(records.get("measured"), str):
        raise ValueError(
            f"{path}: key 'records' is missing, so that the measurement is unknown; "
            "expected the digests that diagnose writes: diagnose the campaign again"
        )
    return str(records["measured"])


def read_side(folder: Path) -> DiagnosisSide:
    """Read a diagnosis of a folder of diagnose; ValueError where there is none to compare."""
    path = folder / DIAGNOSIS_FILE
    document = read_diagnosis(path)
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
    far, unknown = document["how_far"], {"share": None, "share_ci95": NO_INTERVAL}
    stated = {
        "folder": folder,
        "measured": document["records"]["measured"],
        "causes": document["effects"] or [finding["id"] for finding in document["classes"]],
        "rms": far["rms_before"],
        "noise_floor": far["noise_floor"],
        **{key: {} for key in ("blocks", "cells", "runs")},
    }
    side: DiagnosisSide = restored(DiagnosisSide, {**document, **stated})
    blocks = restored(tuple[BlockScore, ...], document["held_out"])
    cells = restored(tuple[GapCell, ...], [cell | unknown for cell in document["where"]])
    runs = restored(tuple[RunValidation, ...], document["validation"])
    return replace(
        side,
        blocks={(row.run, row.block): row for row in blocks},
        cells={(row.run, row.channel_pattern, row.order): row for row in cells},
        runs={row.run: row for row in runs},
    )


#: What became of a cell of the gap map.
_GONE = "gone"
_SMALLER = "smaller"
_SAME = "same"
_LARGER = "larger"
_NEW = "new"


@dataclass(frozen=True, eq=False)
class CellChange:
    """One cell of the gap map before and after."""

    run: Annotated[str, "Run of the cell"]
    channel_pattern: Annotated[str, "Its sensor pattern or channel"]
    order: Annotated[float, "Order, line, or frequency over the lowest of the map"]
    rms_before: Annotated[
        float, "RMS above the noise before; zero where the map does not list the cell"
    ]
    rms_after: Annotated[float, "The same after"]
    u: Annotated[float, "RMS of the noise in the cell"]
    what: Annotated[str, "gone, smaller, same, larger or new"]
    frequency_hz: Annotated[tuple[float, float] | None, "Band of the cell [Hz]"] = None

    @property
    def change(self) -> float:
        """Change of the mean square."""
        return self.rms_after**2 - self.rms_before**2


@dataclass(frozen=True, eq=False)
class RunChange:
    """Comparison error of a run before and after, beside its uncertainty."""

    run: Annotated[str, "Run"]
    error_before: Annotated[float, "RMS of measured less simulated before"]
    error_after: Annotated[float, "The same after"]
    u_val: Annotated[float, "Uncertainty of both"]


@dataclass(frozen=True, eq=False)
class GapChange:
    """Two diagnoses of one measurement."""

    before: Annotated[DiagnosisSide, "First diagnosis"]
    after: Annotated[DiagnosisSide, "Second diagnosis"]
    ratio: Annotated[float, "RMS of the gap after over before, on the same held-out blocks"]
    ratio_ci95: Annotated[Interval, "95 % interval of the ratio"]
    explained: Annotated[
        float, "Share of the mean square above the noise that the change took; negative: added"
    ]
    cells: Annotated[
        tuple[CellChange, ...], "Significant cells of either map, largest change first"
    ]
    runs: Annotated[tuple[RunChange, ...], "Error by run"]
    solved: Annotated[tuple[str, ...], "Causes named before only"]
    remaining: Annotated[tuple[str, ...], "Causes named both times"]
    added: Annotated[tuple[str, ...], "Causes named after only"]


def gap_change(before: DiagnosisSide, after: DiagnosisSide) -> GapChange:
    """Compare two diagnoses; ValueError where kind, unit, records or blocks differ."""
    _refuse_different(before, after)
    ratio, interval = _ratio(before, after)
    above = before.rms**2 - before.noise_floor**2
    taken = before.rms**2 - after.rms**2
    return GapChange(
        before=before,
        after=after,
        ratio=ratio,
        ratio_ci95=interval,
        explained=taken / above if above > 0.0 else float("nan"),
        cells=tuple(sorted(_cell_changes(before, after), key=lambda cell: -abs(cell.change))),
        runs=tuple(
            RunChange(run, old.error_before, new.error_before, max(old.u_val, new.u_val))
            for run, old in before.runs.items()
            if (new := after.runs.get(run)) is not None
        ),
        solved=tuple(name for name in before.causes if name not in after.causes),
        remaining=tuple(name for name in before.causes if name in after.causes),
        added=tuple(name for name in after.causes if name not in before.causes),
    )


def _refuse_different(before: DiagnosisSide, after: DiagnosisSide) -> None:
    about = f"{before.folder} and {after.folder}"
    for what in ("kind", "unit"):
        first, second = (getattr(side, what) for side in (before, after))
        if first != second:
            raise ValueError(
                f"{about}: their {what} is {first} and {second}; expected two diagnoses of one "
                "measurement"
            )
    if before.measured != after.measured:
        raise ValueError(
            f"{about}: campaigns '{before.campaign}' and '{after.campaign}' hold different "
            f"records ({before.measured[:12]} and {after.measured[:12]}); expected two diagnoses "
            "of one measurement: same samples, windows and conditions"
        )
    samples = [{key: of.samples for key, of in side.blocks.items()} for side in (before, after)]
    if samples[0] != samples[1]:
        raise ValueError(
            f"{about}: their records are scored in different blocks; expected two diagnoses of "
            "one version of the program: diagnose both again"
        )


def _ratio(before: DiagnosisSide, after: DiagnosisSide) -> tuple[float, Interval]:
    """RMS after over before with its interval; the same blocks are drawn of both."""
    scores = [[side.blocks[key] for key in before.blocks] for side in (before, after)]
    squares = np.array([[one.samples * one.mean_square for one in of_side] for of_side in scores])
    totals = squares.sum(axis=1)
    if not totals[0] > 0.0:
        return float("nan"), NO_INTERVAL
    counts = two_level_counts(
        [one.condition for one in before.blocks.values()],
        n_samples=1000,
        rng=np.random.default_rng(17),
    )
    drawn = [counts @ square for square in squares]
    with np.errstate(invalid="ignore", divide="ignore"):
        low, high = np.quantile(np.sqrt(drawn[1] / drawn[0]), INTERVAL)
    return float(np.sqrt(totals[1] / totals[0])), (float(low), float(high))


def _cell_changes(before: DiagnosisSide, after: DiagnosisSide) -> Iterator[CellChange]:
    for key in dict.fromkeys((*before.cells, *after.cells)):
        pair = [side.cells.get(key) for side in (before, after)]
        is_real = [cell is not None and cell.p_value < SIGNIFICANCE for cell in pair]
        if not any(is_real):
            continue
        rms = [0.0 if cell is None else _root(cell.coherent) for cell in pair]
        known = [cell for cell in pair if cell is not None]
        u = max(_root(cell.mean_square - cell.coherent) for cell in known)
        # What the baseline's own parameters take up is refitted, and moves a cell's neighbours.
        least = max(2.0 * u, 0.1 * max(rms))
        what = _SAME
        if rms[1] < rms[0] - least:
            what = _SMALLER if is_real[1] else _GONE
        elif rms[1] > rms[0] + least:
            what = _LARGER if is_real[0] else _NEW
        yield CellChange(*key, rms[0], rms[1], u, what, known[0].frequency_hz)


def _root(square: float) -> float:
    return float(np.sqrt(max(square, 0.0)))


_SIDE = json_table(
    "Side",
    "One of two diagnoses.",
    {DiagnosisSide: "folder campaign causes rms noise_floor"},
    verdict=(Verdict, "What the diagnosis says"),
)
_CAUSES = json_table("Causes", "Causes before and after.", {GapChange: "solved remaining added"})
#: comparison.json.
COMPARISON = json_table(
    "ComparisonDocument",
    "comparison.json, written by compare.",
    {DiagnosisSide: "kind unit measured", GapChange: "ratio ratio_ci95 explained cells runs"},
    format=(Literal["carrierflex-comparison"], "Kind of the file"),
    version=(Literal[1], "Version of the format"),
    software=(str, "Name and version of this software"),
    text=(str, "What became of the gap, in one sentence"),
    before=(_SIDE, "First diagnosis"),
    after=(_SIDE, "Second diagnosis"),
    causes=(_CAUSES, "Causes"),
)
#: Cells that are named in a sentence.
_MOST_NAMED = 3


def first_sentence(change: GapChange) -> str:
    """What became of the gap as one sentence.

    For example ``The change took 92 % of the gap: 46 µm RMS before, 14 µm after on the same
    held-out records (ratio 0.300, 95 % 0.28 to 0.33; noise floor 5 µm).``
    """
    unit = change.before.unit
    sizes = f"{sized(change.before.rms, unit)} RMS before, {sized(change.after.rms, unit)} after"
    floor = sized(change.before.noise_floor, unit)
    low, high = change.ratio_ci95
    figures = (
        f"{sizes} on the same held-out records (ratio {ratio(change.ratio)}, 95 % {low:.3f} to "
        f"{high:.3f}; noise floor {floor})"
    )
    if not math.isfinite(change.ratio):
        return f"There was no gap before the change: {sizes}."
    if high < 1.0:
        took = f"{percent(min(change.explained, 1.0))} of the gap above the noise"
        return f"The change took {took}: {figures}."
    if low > 1.0:
        return f"The change made the gap larger: {figures}."
    return f"The change did not affect the gap: {figures}."


def causes_sentence(change: GapChange) -> str:
    """Causes that are named before and after."""
    clauses = [
        f"{words}: {listed([plain_name(cause) for cause in causes])}"
        for words, causes in (
            ("no longer missing", change.solved),
            ("still missing", change.remaining),
            ("missing now, not named before", change.added),
        )
        if causes
    ]
    return f"{capitalised('; '.join(clauses) or 'neither diagnosis names a cause')}."


def cells_sentence(change: GapChange) -> str:
    """What shrank and what came, by cells of the gap map."""
    shrank = [cell for cell in change.cells if cell.what in (_GONE, _SMALLER)]
    came = [cell for cell in change.cells if cell.what in (_NEW, _LARGER)]
    return f"Smaller: {_cells(shrank)}. New or larger: {_cells(came)}."


def _cell_name(cell: CellChange) -> str:
    """Where a cell lies, without its run."""
    return f"{cell.channel_pattern}, {position_of(cell.order, cell.frequency_hz)}"


def change_document(change: GapChange) -> dict[str, Any]:
    """Content of comparison.json."""
    return json_content(
        COMPARISON,
        change,
        change.before,
        software=software_name(),
        text=first_sentence(change),
        causes=json_content(_CAUSES, change),
        before=json_content(_SIDE, change.before),
        after=json_content(_SIDE, change.after),
    )


def _cells(cells: Sequence[CellChange]) -> str:
    """Places of the largest cells, each once, and how many cells there are beside."""
    if not cells:
        return "nothing"
    names = list(dict.fromkeys(_cell_name(cell) for cell in cells))
    more = len(names) - _MOST_NAMED
    text = "; ".join(names[:_MOST_NAMED])
    return f"{text}; and {more} more" if more > 0 else text


_MOST_ROWS = 30


def comparison_page(change: GapChange) -> str:
    """HTML text of a comparison."""
    content = {
        "change": change,
        "unit": change.before.unit,
        "cell_name": _cell_name,
        "first_sentence": first_sentence(change),
        "causes_sentence": causes_sentence(change),
        "cells_sentence": cells_sentence(change),
        "software": software_name(),
        "largest_error": max([0.0, *(max(r.error_before, r.error_after) for r in change.runs)]),
        "largest_cell": max([0.0, *(max(c.rms_before, c.rms_after) for c in change.cells)]),
        "cells": change.cells[:_MOST_ROWS],
        "n_more_cells": max(len(change.cells) - _MOST_ROWS, 0),
    }
    return rendered_page("comparison.html.j2", content)
