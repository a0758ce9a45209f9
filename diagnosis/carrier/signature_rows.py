"""Rows of the screen and of the classes: weights of the columns, and their products by segment."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.carrier.model import CarrierModel, WeightTable
from carrierflex.diagnosis.comparison.problem import Effects

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class _SignatureRows:
    """Rows that one table of weights makes."""

    numbers: IntArray  # (n_runs, q) number of each row among all, by run
    columns: IntArray  # (u,) columns that they are made of
    weights: FloatArray  # (n_runs, n_own_channels, q, u) their weights
    channel: int | None = None  # the only channel that they act on

    def at(self, run: int, channel: int) -> FloatArray | None:
        """Weights in one channel of a run, shape (q, u); None where they do not act on it."""
        if self.channel is None:
            return np.asarray(self.weights[run, channel])
        return np.asarray(self.weights[run, 0]) if channel == self.channel else None


@dataclass(frozen=True, eq=False)
class EffectRows:
    """Rows of target, baseline and effects.

    Parameters
    ----------
    groups : tuple of _SignatureRows
        The target and the baseline's regressors, then each effect at each of its variants.
    n_base : int
        Regressors of the baseline.
    owners : tuple of str
        Effect of every row after them.
    variants : tuple of tuple of float
        Its channel, or its shape; empty where it has neither.
    """

    groups: tuple[_SignatureRows, ...]
    n_base: int
    owners: tuple[str, ...]
    variants: tuple[tuple[float, ...], ...]

    @property
    def size(self) -> int:
        """Number of rows."""
        return 1 + self.n_base + len(self.owners)


def effect_rows(model: CarrierModel, candidates: Effects, base: FloatArray) -> EffectRows:
    """Rows of target, baseline and candidates.

    Parameters
    ----------
    model : CarrierModel
        Weights.
    candidates : tuple of str
        Effects beside the baseline.
    base : ndarray, shape (p,)
        Parameters of the fitted baseline, at which effects of a sensor are linearised.
    """
    contained = contained_channels(model)
    groups = [_base_rows(model.weights((), contained, base), base)]
    owners: list[str] = []
    variants: list[tuple[float, ...]] = []
    for effect in candidates:
        for variant in model.variants(effect):
            first = 1 + base.size + len(owners)
            rows = _rows_of_effect(model, effect, variant, base, contained, first)
            groups.append(rows)
            n_rows = np.unique(rows.numbers).size
            owners += [effect] * n_rows
            variants += [variant] * n_rows
    return EffectRows(tuple(groups), base.size, tuple(owners), tuple(variants))


def contained_channels(model: CarrierModel) -> dict[str, int]:
    """First channel for every effect of one sensor in the baseline."""
    return {name: 0 for name in model.contained if model.effects[name].is_of_one_channel}


def rows_at(
    groups: Sequence[_SignatureRows], run: int, channel: int, n_columns: int
) -> tuple[IntArray, FloatArray]:
    """Numbers of the rows that act in a channel of a run, and their weights, shape (m, k)."""
    numbers, tables = [], []
    for rows in groups:
        weights = rows.at(run, channel)
        if weights is None:
            continue
        table = np.zeros((len(weights), n_columns))
        table[:, rows.columns] = weights
        numbers.append(rows.numbers[run])
        tables.append(table)
    return np.concatenate(numbers), np.concatenate(tables)


def _base_rows(table: WeightTable, base: FloatArray) -> _SignatureRows:
    """The target less the parts that are no parameter's (another simulator's prediction).

    And the derivatives by the baseline's parameters.
    """
    linear = np.einsum("rcqk,rq->rck", table.slopes, base[table.unknowns])
    target = -(table.values - linear)
    target[..., 0] += 1.0
    weights = np.concatenate([target[:, :, None], table.slopes], axis=2)
    zero = np.zeros((len(weights), 1), dtype=np.int64)
    numbers = np.concatenate([zero, 1 + table.unknowns], axis=1)
    return _SignatureRows(numbers, table.columns, weights)


def _rows_of_effect(
    model: CarrierModel,
    effect: str,
    variant: tuple[float, ...],
    base: FloatArray,
    contained: dict[str, int],
    first: int,
) -> _SignatureRows:
    """Derivatives of the signals by an effect's amplitudes, whose rows begin at `first`."""
    is_of_one_channel = model.effects[effect].is_of_one_channel
    choice = {**contained, effect: int(variant[0])} if is_of_one_channel else contained
    parameters = model.parameters((effect,), choice)[base.size :]
    shapes = iter(() if is_of_one_channel else variant)
    value = [next(shapes) if parameter.shape else 0.0 for parameter in parameters]
    table = model.weights((effect,), choice, np.concatenate([base, value]))
    is_amplitude = np.array([not parameter.shape for parameter in parameters], dtype=bool)
    rank = np.cumsum(is_amplitude) - 1
    chosen = table.unknowns[0] >= base.size
    chosen[chosen] = is_amplitude[table.unknowns[0, chosen] - base.size]
    numbers = first + rank[table.unknowns[:, chosen] - base.size]
    weights = table.slopes[:, :, chosen]
    if not is_of_one_channel:
        return _SignatureRows(numbers, table.columns, _of_all_runs(weights))
    channel = int(variant[0])
    return _SignatureRows(numbers, table.columns, _of_all_runs(weights[:, [channel]]), channel)


def _of_all_runs(weights: FloatArray) -> FloatArray:
    """Weights by run, those that all runs share held once: of 500 runs of 64 channels 0.3 GB."""
    first = weights[:1]
    if not (weights == first).all():
        return weights
    return np.broadcast_to(first.copy(), weights.shape)
