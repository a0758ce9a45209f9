"""What could be added to a mounting's campaign, and the signatures over all of it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from carrierflex.diagnosis.comparison.problem import BASELINE
from carrierflex.diagnosis.inference.planning.plan import PlannedTable, Signature
from carrierflex.diagnosis.inference.planning.results import LOADS, MINUTES, Addition, Costs
from carrierflex.diagnosis.mounting.problem import (
    LENGTH,
    STEP,
    MountingProblem,
    blank_record,
    trial_loads,
)
from carrierflex.diagnosis.mounting.records import MountingRecord
from carrierflex.diagnosis.mounting.signatures import signature_columns, signature_rows

#: Shares of the limits at which loads could be added, and of the length of every run.
_SHARES = (0.25, 0.5, 1.0)
_FACTORS = (2.0, 4.0)


@dataclass(frozen=True, eq=False)
class MountingPool:
    """Records as planned, blank records of loads that could be added, and the additions."""

    records: tuple[MountingRecord, ...]  # Planned ones first
    n_planned: int  # How many are planned
    planned: Addition  # What is planned alone
    additions: tuple[Addition, ...]  # What could be added


def mounting_pool(
    records: Sequence[MountingRecord],
    channels: tuple[str, ...],
    costs: Costs,
    *,
    torque: float,
    radial_load: float,
) -> MountingPool:
    """What could be added to a campaign of kind mounting.

    Torque, vertical and sideways load as a sine of 0.05 or 1 Hz at a quarter, half and all of the
    limit (`torque` [N m], `radial_load` [N]), 120 s each; torque beside a constant load; all runs
    two and four times as long.
    """
    once = {record.name: 1.0 for record in records}
    time, loads = trial_loads(torque, radial_load, _SHARES)
    first = replace(records[0], noise=records[0].noise * records[0].step / STEP)
    added = [blank_record(first, text, time, columns) for text, columns in loads.items()]
    cost = costs.load_case + costs.minute * LENGTH / 60.0
    additions = [
        Addition(LOADS, f"{text}, {LENGTH:.0f} s", {**once, text: 1.0}, channels, cost)
        for text in loads
    ]
    minutes = sum(record.inputs.time[-1] - record.inputs.time[0] for record in records) / 60.0
    for factor in _FACTORS:
        longer = {name: factor for name in once}
        text = f"every run {factor:g} times as long"
        cost = costs.minute * (factor - 1.0) * float(minutes)
        additions.append(Addition(MINUTES, text, longer, channels, cost))
    planned = Addition(MINUTES, "as planned", once, channels, 0.0)
    return MountingPool((*records, *added), len(records), planned, tuple(additions))


def mounting_planned_table(
    problem: MountingProblem, pool: MountingPool, note: Callable[[str], None] = lambda text: None
) -> PlannedTable:
    """Products of target, baseline and signatures by run and channel; `note` shows each run."""
    bare = replace(problem, model=replace(problem.model, contained=()))
    theta = bare.bare_fit()
    known = {(BASELINE, "K1"): float(theta[0]), (BASELINE, "C1"): float(theta[1])}
    every = signature_columns(problem.model)
    contained = [column for column in every if column.effect in problem.model.contained]
    columns = [column for column in every if column.effect in problem.cards]
    size = np.array(
        [1.0, *(column.scale for column in bare.parameters(()))]
        + [column.amplitude.scale for column in (*contained, *columns)]
    )
    grams = []
    for r, record in enumerate(pool.records):
        note(f"signatures under {record.condition}")
        target = np.zeros_like(record.measured)
        if r < pool.n_planned:
            target = record.measured - bare.model.predicted(record, (), theta, {})
        rows = signature_rows(problem.model, record, target, (*contained, *columns), known)
        table = size[:, None, None] * rows
        for c in range(record.measured.shape[1]):
            # The target is no amplitude; its size is one.
            grams.append(table[:, :, c] @ table[:, :, c].T / record.noise[c])
    n_runs, n_channels = len(pool.records), len(problem.model.channels)
    counts = [np.isfinite(record.measured).sum(axis=0) for record in pool.records]
    n_base = 2 + len(contained)
    variants: dict[tuple[str, tuple[float, ...]], list[int]] = {}
    for k, column in enumerate(columns, 1 + n_base):
        variants.setdefault((column.effect, column.variant), []).append(k)
    return PlannedTable(
        np.array(grams),
        n_base,
        np.zeros(n_base),
        tuple(Signature(*key, tuple(numbers)) for key, numbers in variants.items()),
        {column.effect: column.amplitude for column in reversed(columns)},
        np.repeat(np.arange(n_runs), n_channels),
        np.tile(np.arange(n_channels), n_runs),
        np.concatenate(counts).astype(np.float64),
        tuple(record.name for record in pool.records),
        problem.model.channels,
        float(np.sqrt(np.mean(pool.records[0].noise))),
    )
