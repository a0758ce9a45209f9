"""The page and the picture of ``carrierflex papers gap``: answer, next measurement, tables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.report.figures import inline_svg
from carrierflex.diagnosis.report.page import rendered_page
from carrierflex.files.versions import software_name
from carrierflex.identification.carrier.printed_tables import LOAD_CASES
from carrierflex.workflows.papers.gap_posterior import (
    AMPLITUDE_ERRORS,
    NAMES,
    PUBLISHED,
    SAMPLED_ERROR,
    WIDTHS,
    standard_errors,
)
from carrierflex.workflows.papers.gap_results import DECISIVE
from carrierflex.workflows.papers.gap_rows import EvidenceRow, PapersGap

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_IN_UNITS = np.array([1e6] * 7 + [1.0, 1e6])


@dataclass(frozen=True)
class _Table:
    """A table of the page."""

    title: str
    note: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]


def gap_page(gap: PapersGap, inputs: Mapping[str, Any]) -> str:
    """HTML text of the page.

    Parameters
    ----------
    gap : PapersGap
        What is shown.
    inputs : mapping
        Options of the command.
    """
    tables = (
        _evidence_table(gap),
        _order_table(gap),
        _prediction_table(gap),
        _numbers_table(gap),
        _causes_table(gap),
        _left_out_table(gap),
    )
    content = {
        "software": software_name(),
        "inputs": inputs,
        "sentences": gap_sentences(gap),
        "svg": inline_svg(partial(gap_figure, gap), "gap", "Evidence, numbers, measurements"),
        "tables": tables,
        "checks": check_sentences(gap),
    }
    return rendered_page("papers_gap.html.j2", content)


def gap_sentences(gap: PapersGap) -> list[str]:
    """The answer in sentences, most important first."""
    others = {row.second: row.better for row in gap.order if row.first == gap.best}
    undecided = [name for name, better in others.items() if better is None]
    worse = [name for name, better in others.items() if better == gap.best]
    sentences = []
    if undecided:
        sentences.append(
            f"Not decided between {gap.best} and: {'; '.join(undecided)}. The order changes with "
            f"the assumed errors or priors, or the evidence differs by less than {DECISIVE:g}."
        )
    if worse:
        sentences.append(
            f"{_capital(gap.best)} explains the published numbers better than: {'; '.join(worse)}."
        )
    first = gap.predictions[0]
    n = len(first.predicted)
    sentences.append(
        f"Next measurement: {first.measurement}. Expected information {first.bits:.2f} of "
        f"{np.log2(n):.2f} bit on which of the {n} causes it is."
    )
    before, after = gap.causes[0], gap.causes[-1]
    sentences.append(
        f"With all causes of the hypothesis {gap.best}, the gap to table 5 shrinks from "
        f"{1e6 * before.table_5_rms:.0f} to {1e6 * after.table_5_rms:.0f} um RMS, the gap to table "
        f"4 from {1e6 * before.table_4_rms:.0f} to {1e6 * after.table_4_rms:.0f} um."
    )
    return sentences


def check_sentences(gap: PapersGap) -> list[str]:
    """How far the approximations were checked."""
    lines = [
        "Condensed statics against the statics of the stage: largest difference "
        f"{gap.largest_deviation:.1e} of a number."
    ]
    if gap.method == "nested":
        lines.append("The evidence is computed by nested sampling (dynesty).")
    elif gap.nested_evidence:
        differences = ", ".join(
            f"{name} {gap.laplace_evidence[name]:.1f} and {nested:.1f}"
            for name, nested in gap.nested_evidence.items()
        )
        lines.append(
            "Laplace's approximation of the log evidence, then nested sampling (dynesty), at 6 um "
            f"and width 1: {differences}."
        )
    else:
        lines.append(
            "Laplace's approximation is not checked by nested sampling: --no-check is given, or "
            "dynesty is not installed (pip install 'carrierflex[papers]')."
        )
    return lines


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _at(rows: Iterable[EvidenceRow]) -> dict[tuple[str, float, float, float], float]:
    return {
        (row.hypothesis, row.width, row.amplitude_error, row.window_spread): row.log_evidence
        for row in rows
    }


def _evidence_table(gap: PapersGap) -> _Table:
    at = _at(gap.evidence)
    columns = [(width, error) for width in WIDTHS for error in AMPLITUDE_ERRORS]
    window = max(row.window_spread for row in gap.evidence)
    free = {row.hypothesis: row.n_free for row in gap.evidence}
    rows = [
        [
            name,
            str(n),
            *(f"{at[name, width, error, 0.0]:.1f}" for width, error in columns),
            f"{at[name, 1.0, SAMPLED_ERROR, window]:.1f}",
        ]
        for name, n in free.items()
    ]
    header = ["hypothesis", "free"]
    header += [f"{1e6 * error:g} um, width {width:g}" for width, error in columns]
    return _Table(
        "Evidence",
        "Natural logarithm of the evidence less that of the best in the column. Columns: standard "
        "error of the amplitudes, factor on the widths of the priors. Other windows: 6 um, width "
        f"1 and {100 * window:g} % between the records of tables 4 and 5.",
        [*header, "other windows"],
        rows,
    )


def _order_table(gap: PapersGap) -> _Table:
    rows = [
        [row.first, row.second, f"{row.least:+.1f} to {row.most:+.1f}", row.better or "not decided"]
        for row in gap.order
    ]
    return _Table(
        "Order",
        "Difference of the log evidence, first less second, over all columns of the table above. "
        f"Decided: the same sign and more than {DECISIVE:g} in every column.",
        ["first", "second", "difference", "better"],
        rows,
    )


def _prediction_table(gap: PapersGap) -> _Table:
    names = list(gap.predictions[0].predicted)
    rows = []
    for row in gap.predictions:
        cells = [
            f"{mid:.3g} ({low:.3g} to {high:.3g})" for low, mid, high in row.predicted.values()
        ]
        error = f"{row.standard_error:g} {row.unit}".rstrip()
        rows.append([row.measurement, *cells, error, f"{row.bits:.2f}"])
    return _Table(
        "Predictions and the next measurement",
        "Median and 90 % interval by hypothesis; expected information on which of them holds.",
        ["measurement", *names, "standard error", "information [bit]"],
        rows,
    )


def _shown(numbers: NDArray[np.float64]) -> list[str]:
    shown = numbers * _IN_UNITS[: len(numbers)]
    first = ", ".join(f"{value:.0f}" for value in shown[:3])
    if len(shown) > len(NAMES):
        first += f" ({shown[8]:.0f})"
    return [first, ", ".join(f"{value:.0f}" for value in shown[3:7]), f"{shown[7]:.3f}"]


_NUMBERS = ["order 1, LC1, LC2, LC4 (LC3) [um]", "model 2 leaves, LC1 to LC4 [um]", "load sharing"]


def _numbers_table(gap: PapersGap) -> _Table:
    free = {row.hypothesis: row.n_free for row in gap.evidence}
    errors = standard_errors(SAMPLED_ERROR)
    rows = [["published", "", *_shown(PUBLISHED), ""]]
    for name, numbers in gap.numbers.items():
        largest = np.abs((numbers[: len(NAMES)] - PUBLISHED) / errors)[:7].max()
        rows.append([name, str(free[name]), *_shown(numbers), f"{largest:.1f}"])
    return _Table(
        "Most probable values",
        "Numbers of the stage with the most probable values of each hypothesis, at 6 um; last "
        "column: largest gap of the seven numbers of tables 4 and 5.",
        ["hypothesis", "free", *_NUMBERS, "largest gap [standard errors]"],
        rows,
    )


def _causes_table(gap: PapersGap) -> _Table:
    rows = [["published", *_shown(PUBLISHED), "", ""]]
    rows += [
        [
            row.causes,
            *_shown(row.numbers),
            f"{1e6 * row.table_5_rms:.0f}",
            f"{1e6 * row.table_4_rms:.0f}",
        ]
        for row in gap.causes
    ]
    return _Table(
        "What shrinks",
        f"Causes of the hypothesis {gap.best}, added one after the other.",
        ["causes", *_NUMBERS, "gap to table 5, RMS [um]", "gap to table 4, RMS [um]"],
        rows,
    )


def _left_out_table(gap: PapersGap) -> _Table:
    names = list(dict.fromkeys(row.hypothesis for row in gap.left_out))
    rows = []
    for name, factor in zip(NAMES, _IN_UNITS, strict=False):
        digits = 0 if factor > 1.0 else 3
        at = {row.hypothesis: row for row in gap.left_out if row.name == name}
        cells = [
            f"{at[of].mean * factor:.{digits}f} +- {at[of].std * factor:.{digits}f}"
            + (" (few samples)" if at[of].few else "")
            for of in names
        ]
        unit = " um" if factor > 1.0 else ""
        published = f"{at[names[0]].published * factor:.{digits or 2}f}{unit}"
        rows.append([name, published, *cells])
    return _Table(
        "Each number predicted from the others",
        "Mean and standard deviation.",
        ["number", "published", *names],
        rows,
    )


def gap_figure(gap: PapersGap) -> Figure:
    """Evidence by choice, information of measurements, numbers of the most probable values."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(15.0, 9.5), layout="constrained")
    evidence, information, amplitudes, rest = figure.subplots(2, 2).ravel()
    names = list(gap.numbers)
    at = _at(gap.evidence)
    for error, color in zip(AMPLITUDE_ERRORS, ("C0", "C1", "C2"), strict=True):
        for width, marker in zip(WIDTHS, ("v", "o", "^"), strict=True):
            evidence.plot(
                [at[name, width, error, 0.0] for name in names],
                range(len(names)),
                color + marker,
                alpha=0.8,
                label=f"{1e6 * error:g} µm, width {width:g}",
            )
    evidence.set_yticks(range(len(names)), names, fontsize="small")
    evidence.invert_yaxis()
    evidence.set_xscale("symlog", linthresh=5.0)
    evidence.set_xticks([-1000, -100, -10, 0], ["-1000", "-100", "-10", "0"])
    evidence.axvspan(-DECISIVE, 0.0, color="0.9")
    evidence.set(
        xlabel="log evidence less the best's", title="grey: cannot be distinguished from the best"
    )
    evidence.legend(fontsize="x-small", ncols=3, loc="upper center", bbox_to_anchor=(0.4, -0.12))
    rows = gap.predictions[::-1]
    information.barh([row.measurement for row in rows], [row.bits for row in rows], color="C0")
    information.tick_params(axis="y", labelsize="small")
    compared = ", ".join(rows[0].predicted)
    information.set(xlabel="information [bit]", title=f"what distinguishes {compared}")
    cases = list(LOAD_CASES)
    errors = standard_errors(SAMPLED_ERROR) * _IN_UNITS[:8]
    for i, (name, numbers) in enumerate(gap.numbers.items()):
        shown = numbers * _IN_UNITS
        line = f"C{i % 10}o-" if i < 10 else f"C{i % 10}s:"
        amplitudes.plot(cases, shown[[0, 1, 8, 2]], line, ms=3, lw=1.0, label=name)
        rest.plot(cases, shown[3:7], line, ms=3, lw=1.0)
    published = PUBLISHED * _IN_UNITS[:8]
    bars = {"fmt": "ks", "capsize": 6, "label": "published, two standard errors"}
    amplitudes.errorbar(["LC1", "LC2", "LC4"], published[:3], 2.0 * errors[:3], **bars)
    rest.errorbar(cases, published[3:7], 2.0 * errors[3:7], **bars)
    amplitudes.set(ylabel="order 1 [µm]", title="table 5")
    rest.set(ylabel="RMS that model 2 leaves [µm]", title="table 4")
    rest.legend(
        *amplitudes.get_legend_handles_labels(),
        fontsize="x-small",
        loc="upper left",
        bbox_to_anchor=(1.01, 1.0),
    )
    for panel in (evidence, information, amplitudes, rest):
        panel.grid(alpha=0.3)
    return figure
