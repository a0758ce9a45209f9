"""Products of the carrier's signatures over every run and channel that is planned or possible."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.carrier.model import CarrierModel
from carrierflex.diagnosis.carrier.problem import CarrierProblem
from carrierflex.diagnosis.carrier.records.columns import largest_load, typical_speed
from carrierflex.diagnosis.carrier.records.run_columns import RunColumns, columns_of_campaign
from carrierflex.diagnosis.carrier.signature_rows import (
    EffectRows,
    contained_channels,
    effect_rows,
    rows_at,
)
from carrierflex.diagnosis.comparison.problem import Parameter
from carrierflex.diagnosis.inference.planning.table import PlannedTable, ScaledParameter, Signature
from carrierflex.identification.campaign.campaign import Campaign

FloatArray = NDArray[np.float64]


def carrier_planned_table(
    problem: CarrierProblem, pool: Campaign, note: Callable[[str], None] = lambda text: None
) -> PlannedTable:
    """Products of target, baseline and signatures by run and channel.

    Parameters
    ----------
    problem : CarrierProblem
        Campaign as planned, with signals: the fitted baseline says at which amplitudes errors of
        sensors act.
    pool : Campaign
        The same with blank runs and channels that could be added, after the planned ones.
    note : callable
        Told each run, for progress.

    Returns
    -------
    PlannedTable
        Parts: every planned run at every channel, every added run at the planned channels.
    """
    model = _model_of(problem, pool)
    base = _baseline_values(problem, model)
    candidates = tuple(problem.cards)
    rows = effect_rows(model, candidates, base)
    n_runs, n_channels = len(problem.campaign.runs), len(problem.campaign.channels)
    noise = np.full(len(pool.channels), float(np.mean(problem.noise)))
    noise[:n_channels] = problem.noise
    contained = contained_channels(model)
    grams = []
    runs = []
    channels = []
    counts = []
    for r, run in enumerate(pool.within_use().runs):
        note(f"signatures under {run.condition}")
        columns = RunColumns(run, model.source)
        for c, channel in enumerate(pool.channels[: None if r < n_runs else n_channels]):
            gram, n_samples = np.zeros((rows.size, rows.size)), 0
            for block in columns.of(channel, columns.blocks(1)):
                numbers, weights = rows_at(rows.groups, r, c, len(block.rows))
                present = np.concatenate([block.present(own) for own in block.revolutions])
                own = weights @ block.rows[:, present]
                gram[np.ix_(numbers, numbers)] += own @ own.T / noise[c]
                n_samples += present.size
            grams.append(gram)
            runs.append(r)
            channels.append(c)
            counts.append(n_samples)
    unknowns = model.parameters((), contained)
    scales, parameters = _scales(model, candidates, contained, base.size)
    size = np.concatenate([[1.0], [own.scale for own in unknowns], _by_row(rows, scales)])
    known = np.array([0.0 if own.prior_std == np.inf else own.prior_std for own in unknowns])
    precision = [
        0.0 if std == 0.0 else (own.scale / std) ** 2
        for std, own in zip(known, unknowns, strict=True)
    ]
    return PlannedTable(
        np.array(grams) * np.outer(size, size),
        base.size,
        np.array(precision),
        _signatures(rows),
        parameters,
        np.array(runs),
        np.array(channels),
        np.array(counts, dtype=np.float64),
        tuple(run.name for run in pool.runs),
        tuple(channel.name for channel in pool.channels),
        float(np.sqrt(np.mean(problem.noise))),
    )


def _model_of(problem: CarrierProblem, pool: Campaign) -> CarrierModel:
    """Model over all runs and channels; shapes lie within the loads that are possible."""
    source = replace(
        problem.model.source, speed=typical_speed(pool), largest_load=largest_load(pool)
    )
    index = columns_of_campaign(pool.runs[0], pool.channels[0], source)
    names = tuple(run.name for run in pool.runs)
    channels = tuple(channel.name for channel in pool.channels)
    return CarrierModel(
        source, index, problem.model.contained, names, channels, problem.model.known
    )


def _baseline_values(problem: CarrierProblem, model: CarrierModel) -> FloatArray:
    """Fitted baseline; parameters of an added run are those of the first run."""
    theta = problem.starts((), {})[1]
    of_run: dict[tuple[str, str, str | None], float] = {}
    first: dict[tuple[str, str], float] = {}
    for own, value in zip(problem.parameters(()), theta.tolist(), strict=True):
        of_run[own.effect, own.name, own.run] = value
        first.setdefault((own.effect, own.name), value)
    return np.array(
        [
            of_run.get((own.effect, own.name, own.run), first.get((own.effect, own.name), 0.0))
            for own in model.parameters((), contained_channels(model))
        ]
    )


def _scales(
    model: CarrierModel, candidates: tuple[str, ...], contained: Mapping[str, int], n_base: int
) -> tuple[dict[str, list[float]], dict[str, ScaledParameter]]:
    """Scales of the amplitudes of every effect, and its first one."""
    scales, first = {}, {}
    for name in candidates:
        one = model.effects[name].is_of_one_channel
        choice = {**contained, name: 0} if one else contained
        own = [p for p in model.parameters((name,), choice)[n_base:] if not p.shape]
        scales[name] = [p.scale for p in own]
        first[name] = ScaledParameter(_published(own[0], one), own[0].unit, own[0].scale)
    return scales, first


def _published(parameter: Parameter, is_of_one_channel: bool) -> str:
    if parameter.pair is not None:
        return parameter.pair.size
    return parameter.name.rpartition("_")[0] if is_of_one_channel else parameter.name


def _by_row(rows: EffectRows, scales: Mapping[str, list[float]]) -> FloatArray:
    """Scale of every row of the effects; each variant of an effect has all its amplitudes."""
    sizes: list[float] = []
    for signature in _signatures(rows):
        sizes += scales[signature.effect]
    return np.array(sizes)


def _signatures(rows: EffectRows) -> tuple[Signature, ...]:
    """Columns by effect and variant."""
    groups: dict[tuple[str, tuple[float, ...]], list[int]] = {}
    for k, key in enumerate(zip(rows.owners, rows.variants, strict=True)):
        groups.setdefault(key, []).append(1 + rows.n_base + k)
    return tuple(
        Signature(effect, variant, tuple(columns)) for (effect, variant), columns in groups.items()
    )
