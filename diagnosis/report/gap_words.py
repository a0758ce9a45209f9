"""Where the gap lies, in words: sentences made of findings, the same for every kind."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from carrierflex.diagnosis.gap.findings import (
    BAND,
    CHANNEL,
    EVEN,
    KNOWN_WITHIN,
    LINE,
    LINES,
    MOTION,
    MOTION_BANDS,
    NO_ODD_DRIVE,
    NO_PERIODIC_DRIVE,
    NO_PERIODIC_LOADS,
    ODD,
    ODD_AND_EVEN,
    ORDER,
    ORDERS,
    SMALL_ORDER,
    Exponent,
    Finding,
    GapFindings,
    Repeatability,
)
from carrierflex.diagnosis.report.words import counted
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.files.quantities import sized
from carrierflex.identification.carrier.sensor_patterns import PATTERN_NAMES, RADIAL

#: What does not repeat is said where it is this share of what does.
_SMALLEST_SCATTER = 0.01
_SMALLEST_P = 1e-6

_NOTHING = {
    ORDERS: "no order or pattern of the gap is significant",
    LINES: "no frequency of the gap is significant",
    MOTION_BANDS: "no motion of the housing is significant",
}
_MEANINGS = {
    (0, "m=0"): "axial offset",
    (0, "m=+1"): "tilt fixed to the housing",
    (0, "m=-1"): "tilt fixed to the housing",
    (0, "m=2"): "saddle fixed to the housing",
    (1, "m=+1"): "tilt fixed to the carrier",
    (0, RADIAL): "radial shift fixed to the housing",
    (1, RADIAL): "eccentricity fixed to the carrier",
}
_FRAMES = {
    "carrier": "waves fixed to the carrier",
    "housing": "pulsating, fixed to the housing",
    "undecided": "fixed to carrier or housing, undecided",
}
_LOADS = {"torque": "the torque", "ntl_z": "the vertical load", "ntl_y": "the sideways load"}
_PARITIES = {
    ODD: "on odd lines: the missing law is odd",
    EVEN: "on even lines: the missing law is even",
    ODD_AND_EVEN: "on odd and even lines",
}
_NO_PARITIES = {
    NO_PERIODIC_DRIVE: "not determinable: the drive is not periodic",
    NO_PERIODIC_LOADS: "not determinable: the loads are not periodic",
    NO_ODD_DRIVE: "not determinable: the drive holds even lines, or no line of the gap is "
    "significant",
}


def where_text(diagnosis: Diagnosis) -> str:
    """Where the gap lies, as plain text: the key ``where_text`` of diagnosis.json."""
    if diagnosis.gap is None:
        return "not diagnosed"
    findings = diagnosis.gap.findings
    return _joined(place_words(findings), further_words(findings, diagnosis.unit))


def _joined(*clauses: str) -> str:
    """Clauses that say anything, with semicolons between them."""
    return "; ".join(clause for clause in clauses if clause)


def first_place_words(findings: GapFindings) -> str:
    """The largest part of the gap alone."""
    return place_words(replace(findings, where=findings.where[:1]))


def place_words(findings: GapFindings) -> str:
    """Largest parts of the gap with their shares, or that no part is significant."""
    largest = [finding for finding in findings.where if finding.kind != SMALL_ORDER]
    if not largest:
        return _NOTHING[findings.numbered_by]
    first, *others = largest
    sentences = [_finding_words(first, "of the gap ", findings.parity)]
    sentences += [_finding_words(finding, "", findings.parity) for finding in others]
    return "; ".join(sentences)


def further_words(findings: GapFindings, unit: str, smallest_order: float = 0.0) -> str:
    """Small orders of a share from `smallest_order` on, scatter and drift."""
    small = [one for one in findings.where if one.kind == SMALL_ORDER]
    small = [one for one in small if one.share >= smallest_order]
    return _joined(_small_order_words(small), scatter_words(findings, unit))


def scatter_words(findings: GapFindings, unit: str) -> str:
    """What does not repeat, and what drifts: the key ``gap.text`` of diagnosis.json."""
    noun = "order" if findings.numbered_by == ORDERS else "line"
    clauses = [_repeatability_words(one, noun, unit) for one in findings.repeatability]
    return _joined(*clauses, _drift_words(findings, noun, unit))


def parity_words(parity: str) -> str:
    """Parity of the missing law, or why it is not determinable; empty where it has no meaning."""
    return ({"": ""} | _PARITIES | _NO_PARITIES)[parity]


def _finding_words(finding: Finding, of_the_gap: str, parity: str) -> str:
    """One of the largest parts with its share."""
    text = _SENTENCES[finding.kind](finding, of_the_gap)
    return f"{text}, {_PARITIES[parity]}" if finding.kind == BAND and parity in _PARITIES else text


def _share(finding: Finding) -> str:
    """Share of a part; one that others partly cancel is larger than the whole."""
    return f"{min(100.0 * finding.share, 100.0):.0f} %"


def _order_words(finding: Finding, of_the_gap: str) -> str:
    """``67 % of the gap is order 3, m=-1 (waves fixed to the carrier), in every run``."""
    start = (
        f"{_share(finding)} {of_the_gap}is order {finding.order}, "
        f"{finding.patterns[0]}{_meaning(finding)}, {_run_words(finding)}"
    )
    torque = finding.exponents["torque"]
    reason = f" (growth with torque not determinable: {torque.reason})" if torque.reason else ""
    changes = f", changing with the {finding.changes_with}" if finding.changes_with else ""
    return start + _growth_words(finding.exponents) + reason + changes


def _growth_words(exponents: Mapping[str, Exponent]) -> str:
    """How a part grows with every condition, as far as the runs tell."""
    text = ""
    for condition, exponent in exponents.items():
        # What is left beside a baseline that took the mean of a cause over the runs has others.
        if not exponent.is_within(KNOWN_WITHIN) or abs(exponent.value) > 4.0:
            continue
        if abs(exponent.value) < 0.25:
            text += f", whatever the {condition}"
        else:
            text += f", growing as {condition}^{exponent.value:.1f}"
    return text


def _meaning(finding: Finding) -> str:
    """What an order of a sensor pattern is, in brackets; empty for a channel of its own."""
    pattern = finding.patterns[0]
    known = _MEANINGS.get((finding.order or 0, pattern))
    if known:
        return f" ({known})"
    if pattern not in (*PATTERN_NAMES.values(), RADIAL):
        return ""
    if finding.order == 0:
        return " (fixed to the housing)"
    return f" ({_FRAMES[finding.frame]})"


def _line_words(finding: Finding, of_the_gap: str) -> str:
    """``30 % of the gap is a line at 0.47X (0.17 Hz), between the shaft's orders, in s137``."""
    assert finding.band_hz is not None
    low, high = finding.band_hz
    hertz = f"{high:.3g} Hz" if high <= 1.01 * low else f"{low:.3g} to {high:.3g} Hz"
    alone = f"{finding.patterns[0]} alone" if len(finding.patterns) == 1 else "several channels"
    return (
        f"{_share(finding)} {of_the_gap}is a line at {finding.line} ({hertz}), {finding.place}, "
        f"in {alone}, {_run_words(finding)}"
    )


def _band_words(finding: Finding, of_the_gap: str) -> str:
    """``98 % of the gap in force lies between 0.2 and 1.9 Hz, in R2``, and growth."""
    assert finding.band_hz is not None
    low, high = finding.band_hz
    band = f"at {high:.3g} Hz" if high <= 1.001 * low else f"between {low:.3g} and {high:.3g} Hz"
    text = (
        f"{_share(finding)} {of_the_gap}in {finding.patterns[0]} lies {band}, {_run_words(finding)}"
    )
    for condition, exponent in finding.exponents.items():
        if exponent.is_within(1.5):
            low_end, high_end = exponent.ci95
            text += f", grows with {condition}^{exponent.value:.1f}"
            text += f" (95 %: {low_end:.1f} to {high_end:.1f})"
    return text


def _motion_words(finding: Finding, of_the_gap: str) -> str:
    """``71 % of the gap is roll motion of the housing, mostly below 0.7 Hz, in every run``."""
    assert finding.band_hz is not None
    name = finding.patterns[0]
    motion = f"{name} motion of the housing" if finding.kind == MOTION else f"motion at {name}"
    text = (
        f"{_share(finding)} {of_the_gap}is {motion}, mostly below {finding.band_hz[1]:.2g} Hz, "
        f"{_run_words(finding)}"
    )
    if finding.follows is not None:
        of_rate = "the rate of " if finding.follows.is_rate else ""
        load = _LOADS[finding.follows.load]
        text += f", and follows {of_rate}{load} (correlation {finding.follows.correlation:.2f})"
    return text


_SENTENCES = {
    ORDER: _order_words,
    LINE: _line_words,
    BAND: _band_words,
    MOTION: _motion_words,
    CHANNEL: _motion_words,
}


def _small_order_words(findings: Sequence[Finding]) -> str:
    """``small yet beyond chance: order 6, m=2 (0.04 %, p <= 1e-09 in every run)``."""
    if not findings:
        return ""
    orders = []
    for finding in findings:
        p = finding.p_value
        bound = f"p < {_SMALLEST_P:.0e}" if p <= _SMALLEST_P else f"p <= {p:.0e}"
        orders.append(
            f"order {finding.order}, {' and '.join(finding.patterns)} "
            f"({100.0 * finding.share:.2g} %, {bound} {_run_words(finding)})"
        )
    return f"small yet beyond chance: {', '.join(orders)}"


def _run_words(finding: Finding) -> str:
    return "in every run" if finding.is_in_every_run else f"in {', '.join(sorted(finding.runs))}"


def _repeatability_words(repeatability: Repeatability, noun: str, unit: str) -> str:
    """``in addition 4 µm RMS does not repeat from revolution to revolution, most of it at ...``."""
    repeats = f"from {repeatability.repetition} to {repeatability.repetition}"
    cell = repeatability.largest
    if cell is None:
        return f"what does not repeat {repeats} is noise"
    if repeatability.share < _SMALLEST_SCATTER:
        least = f"{100.0 * _SMALLEST_SCATTER:.0f} %"
        return f"what does not repeat {repeats} is below {least} of what does"
    position = "off the shaft orders" if cell.order is None else f"at {noun} {cell.order:g}"
    multiple = math.sqrt(cell.gap / cell.noise) if cell.noise > 0.0 else math.inf
    return (
        f"in addition {sized(repeatability.rms, unit)} RMS does not repeat {repeats}, most of it "
        f"{position} "
        f"in {cell.run} ({cell.channel_pattern}, {multiple:.1f} times the noise)"
    )


def _drift_words(findings: GapFindings, noun: str, unit: str) -> str:
    """``the gap drifts in time: in LC2 order 0, m=0 changes by 12 µm``; empty without a drift."""
    drifts = [row for row in findings.drifts if row.share >= 0.02]
    if not drifts:
        return ""
    cells = [
        f"in {row.run} {noun} {row.order:g}, {row.channel_pattern} changes by "
        f"{sized(row.change, unit)}"
        for row in drifts[:2]
    ]
    n_more = len(drifts) - len(cells)
    more = f" (and {counted(n_more, 'cell')} more)" if n_more else ""
    return f"the gap drifts in time: {', '.join(cells)}{more}"
