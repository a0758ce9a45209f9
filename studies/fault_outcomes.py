"""What becomes of a fault of the measuring chain.

Detected: ``check`` gives a finding that the campaign without the fault does not give, the campaign
is refused, or the diagnosis names the effect of the library that the fault is, or its class (gain
of a sensor). Harmless: the verdict stays, and the interval of every parameter holds the value
without the fault. Moved: the verdict stays and a value without the fault lies outside its new
interval, but the two intervals overlap: what a test of five per cent cannot tell from chance.
Equivalent: the baseline fits the records with the fault as well as those without, as far as the
blocks can tell, or better (late samples are read between two samples, which halves their noise), so
that they are the records of another machine (a force in other units, of a stiffer and heavier one;
a delay under one sine, of another damping) and no check of records can tell. Missed: the rest.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.inference.effect_fit import fit_effects
from carrierflex.diagnosis.inference.results import CLASS_NAMED
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign_check.records_check import records_findings
from carrierflex.workflows.diagnosis.examination import examined
from studies.fault_table import Fault

DETECTED = "detected"
HARMLESS = "harmless"
MOVED = "moved"
EQUIVALENT = "equivalent"
MISSED = "missed"
OUTCOMES = (DETECTED, HARMLESS, MOVED, EQUIVALENT, MISSED)
#: Told by a message that refuses the campaign.
REFUSED = "refused"
#: Halves of an interval between two values from which their intervals are apart.
_APART = 2.0
#: Growth of what one model leaves of two records that is none: within so many standard errors over
#: the blocks, or rounding of two searches.
_STANDARD_ERRORS, _ALIKE = 2.0, 1e-3
#: Period of an angle by its unit.
_TURN = {"rad": 2.0 * np.pi, "deg": 360.0}

FloatArray = NDArray[np.float64]
Curves = Mapping[str, DeflectionCurve] | None


@dataclass(frozen=True)
class Outcome:
    """What became of one fault in one campaign.

    Parameters
    ----------
    fault, size : str
        Fault and size.
    outcome : str
        One of `OUTCOMES`.
    by : tuple of str
        Checks, or effects, that report it; otherwise the verdict that changed (``before -> after``)
        and the parameters that moved, with the distance in halves of their interval.
    """

    fault: str
    size: str
    outcome: str
    by: tuple[str, ...]


def fault_outcomes(
    clean: Campaign, faults: Sequence[Fault], seed: int, curves: Curves, *, first: int = 0
) -> Iterator[Outcome]:
    """Put faults into a campaign one by one.

    The diagnosis, which takes nearly all of the time, is made only where no finding tells a fault.

    Parameters
    ----------
    clean : Campaign
        Campaign without a fault.
    faults : sequence of Fault
        Faults.
    seed : int
        Seed of their random numbers.
    curves : mapping of str to DeflectionCurve, optional
        Deflection curves of a carrier.
    first : int
        Number of the fault to begin with.

    Yields
    ------
    Outcome
        In the order of the faults.
    """
    clean_checks = {*_records_checks(clean, curves), *_baseline_checks(clean, curves)}
    without: list[_Answer] = []
    for number, fault in list(enumerate(faults))[first:]:
        faulty = fault.change(clean, np.random.default_rng([seed, number]))
        try:
            by = _records_checks(faulty, curves) - clean_checks
            by = by or _baseline_checks(faulty, curves) - clean_checks
            if not by:
                without = without or [_answer(clean, curves)]
                outcome, by = _consequence(fault, without[0], _answer(faulty, curves))
                yield Outcome(fault.name, fault.size, outcome, tuple(sorted(by)))
                continue
        except ValueError:
            by = {REFUSED}
        yield Outcome(fault.name, fault.size, DETECTED, tuple(sorted(by)))


@dataclass(frozen=True, eq=False)
class _Answer:
    """Diagnosis of a campaign, and the shares of its signals' square that the baseline leaves."""

    diagnosis: Diagnosis
    remainder: FloatArray


def _consequence(fault: Fault, before: _Answer, after: _Answer) -> tuple[str, set[str]]:
    """Outcome of a fault that no finding tells, and by what."""
    named = _named(fault, after.diagnosis)
    if named:
        return DETECTED, named
    verdict = set(_verdict_change(before.diagnosis, after.diagnosis))
    moved = _moved_parameters(before.diagnosis, after.diagnosis)
    by = verdict | {f"{name} by {distance:.1f}" for name, distance in moved.items()}
    if not by:
        return HARMLESS, by
    if not verdict and _fits_as_well(before.remainder, after.remainder):
        return EQUIVALENT, by
    if not verdict and max(moved.values()) < _APART:
        return MOVED, by
    return MISSED, by


def _fits_as_well(before: FloatArray, after: FloatArray) -> bool:
    """Whether the blocks do not show that a model leaves more of the records with a fault."""
    error = 0.0
    if before.size == after.size:
        error = _STANDARD_ERRORS * np.sqrt(before.size) * float((after - before).std(ddof=1))
    growth = float(after.sum() - before.sum())
    return growth <= max(error, _ALIKE * float(before.sum()))


def _named(fault: Fault, diagnosis: Diagnosis) -> set[str]:
    """Effects, or where a class is named its class, that are the fault."""
    if diagnosis.verdict == CLASS_NAMED and diagnosis.classes is not None:
        holding = diagnosis.classes.classes_of_law
        classes = {name for effect in fault.ids for name in holding.get(effect, ())}
        return classes & {named.id for named in diagnosis.classes.classes}
    return set(diagnosis.attribution.effects) & set(fault.ids)


def _records_checks(campaign: Campaign, curves: Curves) -> set[str]:
    """Checks of the records that tell something."""
    return {finding.id or finding.check for finding in records_findings(campaign, curves)}


def _baseline_checks(campaign: Campaign, curves: Curves) -> set[str]:
    """Checks of the fitted baseline that tell something."""
    checked = examined(campaign, curves).baseline()
    return {finding.id or finding.check for finding in checked.warnings}


def _answer(campaign: Campaign, curves: Curves) -> _Answer:
    """Diagnosis as the command makes it."""
    examination = examined(campaign, curves)
    diagnosis = examination.diagnosis()
    fit = diagnosis.baseline or fit_effects(examination.problem, ())
    square = fit.sums.square
    size = sum(
        float(np.nansum((values - np.nanmean(values)) ** 2))
        for run in examination.distinct.runs
        for values in run.signals.values()
    )
    return _Answer(diagnosis, square.reshape(len(square), -1).sum(axis=1) / size)


def _verdict_change(before: Diagnosis, after: Diagnosis) -> Iterator[str]:
    """Text of a change of the verdict or of the effects that are named."""
    if (before.verdict, before.attribution.effects) != (after.verdict, after.attribution.effects):
        named = ", ".join(after.attribution.effects)
        yield f"{before.verdict} -> {after.verdict}" + (f" {named}" if named else "")


def _moved_parameters(before: Diagnosis, after: Diagnosis) -> dict[str, float]:
    """Parameters whose new interval does not hold the value before."""
    moved = {}
    for effect, values in before.attribution.parameters.items():
        others = after.attribution.parameters.get(effect, {})
        for name in values.keys() & others.keys():
            low, high = others[name].ci95
            half = 0.5 * (high - low)
            away = values[name].value - 0.5 * (high + low)
            turn = _TURN.get(values[name].unit)
            if turn is not None:
                away -= turn * np.round(away / turn)
            if np.isfinite(half) and abs(away) > half:
                moved[f"{effect}.{name}"] = abs(away) / max(half, np.finfo(float).tiny)
    return moved
