"""The first screen's table: one row a cause with its share, its values and where it acts."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from carrierflex.diagnosis.classes.results import ClassFinding
from carrierflex.diagnosis.comparison.effect_names import plain_name
from carrierflex.diagnosis.inference.results import (
    AT_NOISE_FLOOR,
    FLOOR_UNKNOWN,
    NO_INTERVAL,
    NONE_OF_THESE,
    GapReduction,
    Interval,
    SelectionStep,
)
from carrierflex.diagnosis.report.report_data import ReportData
from carrierflex.diagnosis.report.verdict_words import is_near_law, share_words
from carrierflex.diagnosis.report.words import counted, named_rows, value_words
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.diagnosis.wiring.refits import fault_words
from carrierflex.files.quantities import UNKNOWN, number, scaled_unit, sized

#: States of a row, as the page writes them.
NAMED, SEVERAL, NEAREST = "named", "one of several", "nearest, not named"
UNEXPLAINED, FAULT = "unexplained", "check first"
#: Values of one cause and findings of the check that stand on the first screen.
_MOST_LISTED = 3
#: Sizes that differ by less than this factor are called equal.
_EQUAL = 1.3
#: Names that measured shapes have as laws begin with this.
_MEASURED = "measured "


class CauseRow(NamedTuple):
    """One cause, what remains, or a fault of the measurement."""

    state: str  # NAMED, SEVERAL, NEAREST, UNEXPLAINED or FAULT
    name: str  # in words
    share: float = math.nan  # of the gap above the floor, 0 to 1; NaN where it has none
    ci95: Interval = NO_INTERVAL
    values: Sequence[tuple[str, str]] = ()  # with 95 % interval and what it is; or ("", a text)
    acts: str = ""  # runs with their loads, time

    @property
    def share_text(self) -> str:
        """Share with its interval: ``46 % (35 to 57 %)``."""
        if math.isnan(self.share):
            return ""
        # Ends without a sign, one decimal below one per cent.
        ends = [100.0 * min(max(end, 0.0), 1.0) for end in self.ci95]
        low, high = (number(round(end, 0 if end >= 1.0 else 1)) for end in ends)
        text = share_words(self.share)
        return text if UNKNOWN in (low, high) or low == high else f"{text} ({low} to {high} %)"


def cause_rows(data: ReportData) -> list[CauseRow]:
    """Faults of the measurement, causes by their share, and what remains."""
    diagnosis = data.diagnosis
    far = diagnosis.reduction
    causes = [*_of_steps(data), *_of_classes(diagnosis)]
    causes.sort(key=lambda row: -row.share)
    if far is None:
        return [*_faults(diagnosis), *causes]
    return [*_faults(diagnosis), *_adding_up(causes, far.phi), *_remaining(diagnosis, far)]


def _adding_up(causes: Sequence[CauseRow], explained: float) -> list[CauseRow]:
    """Causes whose shares add up to what all explain together, where they explain anything."""
    total = sum(cause.share for cause in causes)
    scale = explained / total if min(explained, total) > 0.0 else 1.0
    return [
        one._replace(share=scale * one.share, ci95=(scale * one.ci95[0], scale * one.ci95[1]))
        for one in causes
    ]


def _faults(diagnosis: Diagnosis) -> Iterator[CauseRow]:
    for warning in diagnosis.warnings[:_MOST_LISTED]:
        name = f"{warning.about} ({fault_words(warning.id)})" if warning.id else warning.about
        share = min(warning.figure, 1.0) if warning.id.startswith("wiring/") else math.nan
        values = [("", warning.text)]
        yield CauseRow(FAULT, name, share, values=values, acts=warning.line)


def _of_steps(data: ReportData) -> Iterator[CauseRow]:
    """Effects in the order in which they were added to the baseline."""
    diagnosis = data.diagnosis
    far, which = diagnosis.reduction, diagnosis.attribution
    rivals = {group[0]: group[1:] for group in which.aliases}
    steps = far.steps[1:] if far is not None else ()
    findings = [_finding_of(diagnosis, step) for step in steps]
    # Shares of classes do not depend on an order; two effects of one class have those of the steps.
    is_by_class = None not in findings and len({id(one) for one in findings}) == len(findings)
    for step, finding in zip(steps, findings, strict=True):
        others = list(rivals.get(step.added, ()))
        if not which.effects and finding is not None and diagnosis.classes is not None:
            others = [" and ".join(map(plain_name, tie)) for tie in diagnosis.classes.ties]
        values = _values(diagnosis, step.added)
        for name in others:
            values += [("", f"or {plain_name(name)}"), *_values(diagnosis, name)]
        name = plain_name(step.added.removeprefix(_MEASURED))
        if finding is not None and not values:
            named = _values(diagnosis, finding.law) if finding.law_named else []
            values = [*_shape_values(finding), *named]
        state = SEVERAL if others else NAMED
        if diagnosis.verdict == NONE_OF_THESE:
            state = NEAREST
        of = finding if is_by_class and finding is not None else step
        yield CauseRow(state, name, of.share, of.share_ci95, values, _acts(data, step))


def _finding_of(diagnosis: Diagnosis, step: SelectionStep) -> ClassFinding | None:
    """Class that a step is of."""
    classes = diagnosis.classes.classes if diagnosis.classes is not None else ()
    ids = (one for one in classes if one.id == step.added.removeprefix(_MEASURED))
    return next(ids, None) or next((one for one in classes if one.law == step.added), None)


def _of_classes(diagnosis: Diagnosis) -> Iterator[CauseRow]:
    """Classes of the answer that no step is of."""
    answer, far = diagnosis.classes, diagnosis.reduction
    if answer is None:
        return
    stepped = [_finding_of(diagnosis, step) for step in (far.steps[1:] if far is not None else ())]
    for one in answer.classes:
        if one not in stepped and one.law not in diagnosis.attribution.effects:
            state, name = SEVERAL if answer.ties else NAMED, plain_name(one.id)
            values, acts = _shape_values(one), _range_words(one)
            yield CauseRow(state, name, one.share, one.share_ci95, values, acts)


def _values(diagnosis: Diagnosis, effect: str) -> list[tuple[str, str]]:
    """Values of one effect with their 95 % intervals."""
    rows = named_rows(diagnosis, effect)
    texts = [(value_words(row), row.words or row.name) for row in rows[:_MOST_LISTED]]
    more = len(rows) - _MOST_LISTED
    return [*texts, ("", f"and {counted(more, 'more value')} below")] if more > 0 else texts


def _shape_values(finding: ClassFinding) -> list[tuple[str, str]]:
    """Measured curve of a class in words, and the nearest law with its share of it."""
    texts = [finding.shape.words] if finding.shape is not None and finding.shape.words else []
    if finding.law:
        share = finding.law_share / finding.share if finding.share > 0.0 else math.nan
        law = plain_name(finding.law)
        is_open = finding.id.endswith("/undetermined") or is_near_law(finding)
        near = "nearest law" if is_open else "no law of the library, nearest"
        near = f"{near} {law}: {share_words(share)} of it"
        texts.append(f"law: {law}" if finding.law_named else near)
    if finding.id.endswith("/undetermined"):
        texts.append("its load dependence cannot be determined from these records")
    return [("", text) for text in texts]


def _range_words(finding: ClassFinding) -> str:
    """Range of deflection, speed or time in which the curve of a class was measured."""
    if finding.shape is None or not finding.shape.x.size:
        return ""
    x = finding.shape.x
    factor, unit = scaled_unit(float(abs(x).max()), finding.shape.units[0])
    ends = f"{number(factor * float(x.min()))} to {number(factor * float(x.max()))} {unit}"
    return f"{finding.shape.labels[0]} {ends}"


def _acts(data: ReportData, step: SelectionStep) -> str:
    """Where an effect acts: the runs in which it is largest and smallest, and when."""
    unit = data.diagnosis.unit
    by_run = sorted(step.by_run, key=lambda run: -step.by_run[run])
    if not by_run:
        return ""
    most, least = by_run[0], by_run[-1]
    text = f"{sized(step.by_run[most], unit)} in {most}{_level_words(data, most, least)}"
    if most != least:
        low = step.by_run[least]
        text += f", {sized(low, unit) if low > 0.0 else 'nothing'} in {least}"
    first, second = step.halves
    answer = data.diagnosis.classes
    # A law keeps its size, and so what it takes, where the effect changes its own.
    changes = answer is not None and bool(answer.changes)
    if changes or not (math.isfinite(first) and math.isfinite(second)):
        return text
    if max(first, second) < _EQUAL * min(first, second):
        return f"{text}; steady in time"
    return (
        f"{text}; {sized(first, unit)} in the first half of the runs, {sized(second, unit)} later"
    )


def _level_words(data: ReportData, run: str, other: str) -> str:
    """Load, speed or amplitude of a run that differs most from that of another, in brackets."""
    levels = {one.name: one.levels for one in data.campaign.runs}
    if run not in levels or other not in levels:
        return ""

    def difference(name: str) -> float:
        values = [abs(one.get(name, 0.0)) for one in levels.values()]
        most = max(values)
        return abs(levels[run][name] - levels[other].get(name, 0.0)) / most if most > 0.0 else 0.0

    name = max(levels[run], key=difference, default="")
    if not name or difference(name) < 1.0 - 1.0 / _EQUAL:
        return ""
    what, _, unit = name.rstrip("]").partition(" [")
    return f" ({what} {sized(levels[run][name], unit)})"


def _remaining(diagnosis: Diagnosis, far: GapReduction) -> Iterator[CauseRow]:
    """What no cause explains, with the run in which it is largest."""
    if diagnosis.verdict == AT_NOISE_FLOOR:
        yield CauseRow(UNEXPLAINED, "the gap is noise")
        return
    is_answered = len(far.steps) > 1 or diagnosis.shrinks_by_class
    errors = [
        (row.error_after if is_answered else row.error_before, row.run) for row in far.validation
    ]
    error, run = max(errors, key=lambda one: one[0], default=(0.0, ""))
    acts = f"{sized(error, diagnosis.unit)} that repeats, in {run}" if run else ""
    size = far.rms_after if is_answered else far.rms_before
    values = [(number(size / far.noise_floor), "times the noise")] if far.noise_floor > 0.0 else []
    if diagnosis.reason_id == FLOOR_UNKNOWN:
        values = [("", "how much of it is noise is not known")]
    share = 1.0 - far.phi if is_answered else 1.0
    ci95 = (1.0 - far.phi_ci95[1], 1.0 - far.phi_ci95[0]) if is_answered else NO_INTERVAL
    yield CauseRow(UNEXPLAINED, "not explained", share, ci95, values, acts)
