"""What could be added to a mounting's campaign, and the signatures over all of it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.comparison.problem import BASELINE
from carrierflex.diagnosis.inference.planning.results import LOADS, MINUTES, Addition, Costs
from carrierflex.diagnosis.inference.planning.table import PlannedTable, ScaledParameter, Signature
from carrierflex.diagnosis.mounting.problem import MountingProblem
from carrierflex.diagnosis.mounting.records import MountingRecord
from carrierflex.diagnosis.mounting.signatures import (
    Column,
    base_columns,
    column_values,
    signature_columns,
)
from carrierflex.simulation.mounting.inputs import MountingInputs

FloatArray = NDArray[np.float64]
#: Added records: step and length [s].
_STEP, _LENGTH = 0.05, 120.0
_SHARES, _FREQUENCIES = (0.25, 0.5, 1.0), (0.05, 1.0)
_FACTORS = (2.0, 4.0)


@dataclass(frozen=True, eq=False)
class MountingPool:
    """Records as planned, blank records of loads that could be added, and the additions.

    Parameters
    ----------
    records : tuple of MountingRecord
        Planned ones first.
    n_planned : int
        How many are planned.
    planned : Addition
        What is planned alone.
    additions : tuple of Addition
        What could be added.
    """

    records: tuple[MountingRecord, ...]
    n_planned: int
    planned: Addition
    additions: tuple[Addition, ...]


def mounting_pool(
    records: Sequence[MountingRecord],
    channels: tuple[str, ...],
    costs: Costs,
    *,
    torque: float,
    radial_load: float,
) -> MountingPool:
    """What could be added to a campaign of kind mounting.

    Parameters
    ----------
    records : sequence of MountingRecord
        Runs as planned.
    channels : tuple of str
        Their channels.
    costs : Costs
        Costs by sort.
    torque, radial_load : float
        Limits of the rig [N m], [N].

    Returns
    -------
    MountingPool
        Torque, vertical and sideways load as a sine of 0.05 or 1 Hz at a quarter, half and all of
        the limit, 120 s each; torque beside a constant load; all runs two and four times as long.
    """
    once = {record.name: 1.0 for record in records}
    time = _STEP * np.arange(round(_LENGTH / _STEP), dtype=np.float64)
    rise = np.asarray(np.clip((time - 5.0) / 10.0, 0.0, 1.0), dtype=np.float64)
    loads: dict[str, dict[str, FloatArray]] = {}
    for name, words, largest, unit in (
        ("torque", "torque", torque, "kN m"),
        ("ntl_z", "vertical load", radial_load, "kN"),
        ("ntl_y", "sideways load", radial_load, "kN"),
    ):
        for share in _SHARES:
            for frequency in _FREQUENCIES:
                wave = rise * np.sin(2.0 * np.pi * frequency * time)
                size = f"{share * largest / 1e3:g} {unit}"
                text = f"{words} alone, a sine of {frequency:g} Hz and {size}"
                loads[text] = {name: share * largest * wave}
    beside = 0.5 * torque * rise * (1.0 + 0.5 * np.sin(np.pi * time))
    for name, words in (("ntl_z", "vertical"), ("ntl_y", "sideways")):
        text = (
            f"torque of {0.5 * torque / 1e3:g} kN m with a sine of 0.5 Hz beside a constant "
            f"{words} load of {radial_load / 1e3:g} kN"
        )
        loads[text] = {"torque": beside, name: radial_load * rise}
    added = [_blank_record(records[0], text, time, own) for text, own in loads.items()]
    cost = costs.load_case + costs.minute * _LENGTH / 60.0
    additions = [
        Addition(LOADS, f"{text}, {_LENGTH:.0f} s", {**once, text: 1.0}, channels, cost)
        for text in loads
    ]
    whole = sum(record.inputs.time[-1] - record.inputs.time[0] for record in records) / 60.0
    for factor in _FACTORS:
        longer = {name: factor for name in once}
        own = costs.minute * (factor - 1.0) * float(whole)
        text = f"every run {factor:g} times as long"
        additions.append(Addition(MINUTES, text, longer, channels, own))
    planned = Addition(MINUTES, "as planned", once, channels, 0.0)
    return MountingPool((*records, *added), len(records), planned, tuple(additions))


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
        _by_variant(columns, n_base),
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


def _blank_record(
    record: MountingRecord, name: str, time: FloatArray, loads: dict[str, FloatArray]
) -> MountingRecord:
    """Record under some loads without signals; its noise is that of the sensors at its step."""
    still = {
        own: np.zeros(time.size) for own in ("torque", "speed", "carrier_angle", "ntl_y", "ntl_z")
    }
    return replace(
        record,
        name=name,
        condition=name,
        inputs=MountingInputs.from_columns(time, {**still, **loads}),
        measured=np.zeros((time.size, record.measured.shape[1])),
        block=np.zeros(time.size, dtype=np.int64),
        noise=record.noise * record.step / _STEP,
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


def _by_variant(columns: list[Column], n_base: int) -> tuple[Signature, ...]:
    """Columns by effect and variant."""
    groups: dict[tuple[str, tuple[float, ...]], list[int]] = {}
    for k, own in enumerate(columns):
        groups.setdefault((own.effect, own.variant), []).append(1 + n_base + k)
    return tuple(Signature(*key, tuple(numbers)) for key, numbers in groups.items())
