"""What every effect would add to the sensors' signals, by simulation beside the fitted baseline.

The housing moves slowly: its signals are the bushings' forces over their stiffness, so that the
screen needs no force of its own. A signature is the difference that an effect of noticeable size
makes, over that size.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from carrierflex.diagnosis.comparison.problem import (
    BASELINE,
    Effects,
    FloatArray,
    Parameter,
    Signatures,
    shape_starts,
    total_products,
)
from carrierflex.diagnosis.mounting.model import ONE_CHANNEL, USER_SHARES, MountingModel
from carrierflex.diagnosis.mounting.records import MountingRecord
from carrierflex.identification.estimation.scaled_least_squares import normal_solution
from carrierflex.simulation.mounting.effects import MOUNTING_EFFECTS

#: Size of an effect in its signature, in scales of its parameter.
_SIZE = 0.05
Known = Mapping[tuple[str, str], float]
#: Values by effect and name, and the channel of each effect of one sensor.
Solution = tuple[dict[tuple[str, str], float], dict[str, int]]


@dataclass(frozen=True, eq=False)
class Column:
    """One signature."""

    effect: str  # Owner
    amplitude: Parameter  # Unknown of which it is the signature
    shapes: Mapping[str, float]  # Values of the shapes
    channel: int = -1  # Channel of an effect of one sensor; -1 otherwise
    #: Whether the shapes grow with the amplitude: a yield force, a damper. Those of a user's law
    #: stay as they are.
    shapes_follow: bool = True

    @property
    def size(self) -> float:
        """Value of the amplitude in the simulation."""
        return _SIZE * self.amplitude.scale

    @property
    def variant(self) -> tuple[float, ...]:
        """What tells it from other columns of its effect."""
        return (*self.shapes.values(), *((float(self.channel),) if self.channel >= 0 else ()))


def signature_columns(model: MountingModel) -> tuple[Column, ...]:
    """Every variant of every effect, the contained ones among them."""
    bare, columns = replace(model, contained=()), []
    for name in model.cards:
        parameters = bare.parameters((name,))[2:]
        shapes = [parameter for parameter in parameters if parameter.shape]
        amplitudes = [parameter for parameter in parameters if not parameter.shape]
        shares, growth = shape_starts(MOUNTING_EFFECTS, name), _SIZE
        follow = name not in model.laws and name not in model.measured
        if not follow:
            shares, growth = USER_SHARES if shapes else (1.0,), 1.0
        channels = range(len(model.channels)) if name in ONE_CHANNEL else (-1,)
        for share, channel, amplitude in product(shares, channels, amplitudes):
            values = {
                p.name: float(np.clip(share * p.scale * growth, p.lower, p.upper)) for p in shapes
            }
            columns.append(Column(name, amplitude, values, channel, follow))
    return tuple(columns)


def signature_rows(
    model: MountingModel,
    record: MountingRecord,
    target: FloatArray,
    columns: Sequence[Column],
    known: Known,
) -> FloatArray:
    """Target, derivatives by K1 and C1, signatures; zero where nothing was measured.

    Of shape (n_rows, n, n_channels). A signature is the change of the prediction of the fitted
    linear bushings by a column's effect, over its size.
    """
    bare = replace(model, contained=())
    base = np.array([known[BASELINE, "K1"], known[BASELINE, "C1"]])
    start = bare.predicted(record, (), base, {})
    rows = [target]
    for k, parameter in enumerate(bare.parameters(())):
        step = np.zeros(2)
        step[k] = 1e-3 * parameter.scale
        change = _change(bare.predicted(record, (), base + step, {}), start)
        rows.append(np.zeros_like(start) if model.fixed else change / step[k])
    for column in columns:
        effects = (column.effect,)
        values = {**column.shapes, column.amplitude.name: column.size}
        parameters = bare.parameters(effects)[2:]
        theta = np.array([*base, *(values.get(p.name, 0.0) for p in parameters)])
        choice = {column.effect: column.channel}
        rows.append(_change(bare.predicted(record, effects, theta, choice), start) / column.size)
    return np.where(record.is_measured, np.array(rows), 0.0)


def _change(predicted: FloatArray, start: FloatArray) -> FloatArray:
    """Change of a prediction; zero where either motion leaves the model."""
    is_known = np.isfinite(predicted) & np.isfinite(start)
    return np.subtract(predicted, start, out=np.zeros_like(start), where=is_known)


def mounting_signatures(
    model: MountingModel,
    records: Sequence[MountingRecord],
    residuals: Sequence[FloatArray],
    known: Known,
) -> Signatures[Column]:
    """Gram matrix of the baseline's residual, its derivatives and all signatures."""
    every = signature_columns(model)
    contained = [column for column in every if column.effect in model.contained]
    columns = [column for column in every if column.effect not in model.contained]
    gram = np.zeros(())
    for record, residual in zip(records, residuals, strict=True):
        table = signature_rows(model, record, residual, (*contained, *columns), known)
        gram = gram + total_products(table, record.block)
    return Signatures(gram, 2 + len(contained), tuple(columns))


def solutions(signatures: Signatures[Column], effects: Effects, known: Known) -> list[Solution]:
    """Least-squares values over the variants of the effects, best first, and their channels."""
    results = []
    for base, values in signatures.solutions(
        effects,
        lambda column: (column.amplitude.lower, column.amplitude.upper),
        solve=_within_bounds,
    ):
        named = {
            (BASELINE, name): known[BASELINE, name] + float(base[k])
            for k, name in enumerate(("K1", "C1"))
        }
        for column, value in values:
            named[column.effect, column.amplitude.name] = value
            # A branch of the same time, a slider of the same yield deflection, at the fitted
            # stiffness.
            growth = abs(value) / column.size if column.shapes_follow else 1.0
            for name, shape in column.shapes.items():
                named[column.effect, name] = growth * shape
        channels = {column.effect: column.channel for column, _ in values if column.channel >= 0}
        results.append((named, channels))
    return results


def _within_bounds(
    gram: FloatArray, right: FloatArray, lower: FloatArray, upper: FloatArray
) -> FloatArray:
    """Least squares of what lies within its bounds, shape (n,); the others are off."""
    values, active = np.zeros(right.size), np.arange(right.size)
    while True:
        solution = normal_solution(gram[np.ix_(active, active)], right[active])
        is_inside = (solution >= lower[active]) & (solution <= upper[active])
        if is_inside.all():
            values[active] = solution
            return values
        active = active[is_inside]
