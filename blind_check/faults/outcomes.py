"""What becomes of a fault: told, without consequence, or missed.

Told: ``check`` gives a finding that the campaign without the fault does not give, the campaign is
refused, or the diagnosis names the effect of the library that the fault is. Without consequence:
the verdict stays, and the interval of every parameter holds the value without the fault.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from carrierflex.blind_check.faults.fault_table import Fault
from carrierflex.diagnosis.baseline_check import checked_baseline, with_findings
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.kinds import problem_of, wiring_of
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign_check.copies import copied_runs, without_copies
from carrierflex.identification.campaign_check.records_check import records_findings

DETECTED = "detected"
HARMLESS = "harmless"
MISSED = "missed"
#: Told by a message that refuses the campaign.
REFUSED = "refused"
#: Period of an angle by its unit.
_TURN = {"rad": 2.0 * np.pi, "deg": 360.0}

Curves = Mapping[str, DeflectionCurve] | None


@dataclass(frozen=True)
class Outcome:
    """What became of one fault in one campaign.

    Parameters
    ----------
    fault, size : str
        Fault and size.
    outcome : str
        ``detected``, ``harmless`` or ``missed``.
    by : tuple of str
        Checks, or effects, that told it; of a missed one the verdict that changed (``before ->
        after``) and the parameters that moved.
    """

    fault: str
    size: str
    outcome: str
    by: tuple[str, ...]


def fault_outcomes(
    clean: Campaign, faults: Sequence[Fault], seed: int, curves: Curves
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
        Seed of their random parts.
    curves : mapping of str to DeflectionCurve, optional
        Deflection curves of a carrier.

    Yields
    ------
    Outcome
        In the order of the faults.
    """
    told = {*_records_checks(clean, curves), *_baseline_checks(clean, curves)}
    before: Diagnosis | None = None
    for number, fault in enumerate(faults):
        rng = np.random.default_rng([seed, number])
        faulty = fault.change(clean, rng)
        try:
            by = _records_checks(faulty, curves) - told
            by = by or _baseline_checks(faulty, curves) - told
            if not by:
                before = before or _diagnosed(clean, curves)
                after = _diagnosed(faulty, curves)
        except ValueError:
            by = {REFUSED}
        if not by and before is not None:
            by = set(after.attribution.effects) & set(fault.effects)
        if by or before is None:
            yield Outcome(fault.name, fault.size, DETECTED, tuple(sorted(by)))
            continue
        changes = tuple(_changes(before, after))
        yield Outcome(fault.name, fault.size, MISSED if changes else HARMLESS, changes)


def _records_checks(campaign: Campaign, curves: Curves) -> set[str]:
    """Checks of the records that tell something."""
    return {finding.check for finding in records_findings(campaign, curves)}


def _baseline_checks(campaign: Campaign, curves: Curves) -> set[str]:
    """Checks of the fitted baseline that tell something."""
    distinct = without_copies(campaign, copied_runs(campaign))
    problem, _ = problem_of(distinct, curves)
    checked = checked_baseline(problem, distinct, wiring_of(problem, distinct))
    return {finding.check for finding in checked.warnings}


def _diagnosed(campaign: Campaign, curves: Curves) -> Diagnosis:
    """Diagnosis as the command makes it."""
    distinct = without_copies(campaign, copied_runs(campaign))
    problem, floor_is_measured = problem_of(distinct, curves)
    diagnosis = diagnose(
        problem, campaign=campaign.name, kind=campaign.kind, floor_is_measured=floor_is_measured
    )
    wiring = wiring_of(problem, distinct)
    checked = checked_baseline(problem, distinct, wiring, diagnosis.baseline)
    return with_findings(diagnosis, records_findings(campaign, curves), checked)


def _changes(before: Diagnosis, after: Diagnosis) -> Iterator[str]:
    """Verdict, effects and parameters that a fault has changed."""
    if (before.verdict, before.attribution.effects) != (after.verdict, after.attribution.effects):
        named = ", ".join(after.attribution.effects)
        yield f"{before.verdict} -> {after.verdict}" + (f" {named}" if named else "")
    for effect, values in before.attribution.parameters.items():
        moved = after.attribution.parameters.get(effect, {})
        for name, value in values.items():
            if name not in moved or not np.isfinite(moved[name].ci95).all():
                continue
            low, high = moved[name].ci95
            half = 0.5 * (high - low)
            away = value.value - 0.5 * (high + low)
            turn = _TURN.get(value.unit)
            if turn is not None:
                away -= turn * np.round(away / turn)
            if abs(away) > half:
                yield f"{effect}.{name} by {abs(away) / max(half, np.finfo(float).tiny):.1f}"
