"""Products of the mounting's signatures over every run that is planned or possible."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from carrierflex.diagnosis.comparison.problem import BASELINE
from carrierflex.diagnosis.inference.planning.table import PlannedTable, ScaledParameter, Signature
from carrierflex.diagnosis.mounting.planned.additions import MountingPool
from carrierflex.diagnosis.mounting.problem import MountingProblem
from carrierflex.diagnosis.mounting.signatures import (
    Column,
    base_columns,
    column_values,
    signature_columns,
)


def mounting_planned_table(
    problem: MountingProblem, pool: MountingPool, note: Callable[[str], None] = lambda text: None
) -> PlannedTable:
    """Products of target, baseline and signatures by run and channel.

    Parameters
    ----------
    problem : MountingProblem
        Campaign as planned, with signals, to which the linear bushings are fitted.
    pool : MountingPool
        Planned records and blank ones.
    note : callable
        Told each run, for progress.

    Returns
    -------
    PlannedTable
        Parts: every run at every channel.
    """
    bare = replace(problem, model=replace(problem.model, contained=()))
    theta = bare.bare_fit()
    known = {(BASELINE, "K1"): float(theta[0]), (BASELINE, "C1"): float(theta[1])}
    every = signature_columns(problem.model)
    contained = [own for own in every if own.effect in problem.model.contained]
    columns = [own for own in every if own.effect in problem.cards]
    scales = _scales(problem)
    size = np.array(
        [1.0, *(own.scale for own in bare.parameters(()))]
        + [scales[own.effect, own.amplitude] for own in (*contained, *columns)]
    )
    grams = []
    runs = []
    channels = []
    counts = []
    for r, record in enumerate(pool.records):
        note(f"signatures under {record.condition}")
        target = np.zeros_like(record.measured)
        if r < pool.n_planned:
            target = record.measured - bare.model.predicted(record, (), theta, {})
        rows = [target, *base_columns(problem.model, record, known)]
        rows += [column_values(problem.model, record, own, known) for own in (*contained, *columns)]
        table = size[:, None, None] * np.where(np.isfinite(record.measured), np.array(rows), 0.0)
        for c in range(record.measured.shape[1]):
            # The target is no amplitude; its size is one.
            grams.append(table[:, :, c] @ table[:, :, c].T / record.noise[c])
            runs.append(r)
            channels.append(c)
            counts.append(np.isfinite(record.measured[:, c]).sum())
    n_base = 2 + len(contained)
    return PlannedTable(
        np.array(grams),
        n_base,
        np.zeros(n_base),
        _signatures(columns, n_base),
        {
            own.effect: ScaledParameter(own.amplitude, _unit(problem, own), scales[_key(own)])
            for own in reversed(columns)
        },
        np.array(runs),
        np.array(channels),
        np.array(counts, dtype=np.float64),
        tuple(record.name for record in pool.records),
        problem.model.channels,
        float(np.sqrt(np.mean(pool.records[0].noise))),
    )


def _key(column: Column) -> tuple[str, str]:
    return column.effect, column.amplitude


def _scales(problem: MountingProblem) -> dict[tuple[str, str], float]:
    """Scale of every amplitude."""
    bare = replace(problem.model, contained=())
    return {
        (name, own.name): own.scale
        for name in problem.model.cards
        for own in bare.parameters((name,))[2:]
        if not own.shape
    }


def _unit(problem: MountingProblem, column: Column) -> str:
    bare = replace(problem.model, contained=())
    units = {own.name: own.unit for own in bare.parameters((column.effect,))[2:]}
    return units[column.amplitude]


def _signatures(columns: list[Column], n_base: int) -> tuple[Signature, ...]:
    """Columns by effect and variant."""
    groups: dict[tuple[str, tuple[float, ...]], list[int]] = {}
    for k, own in enumerate(columns):
        groups.setdefault((own.effect, own.variant), []).append(1 + n_base + k)
    return tuple(Signature(*key, tuple(numbers)) for key, numbers in groups.items())
