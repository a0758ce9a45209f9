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
_MOST_STARTS = 6
Known = Mapping[tuple[str, str], float]
#: Values by effect and name, and the channel of each effect of one sensor.
Solution = tuple[dict[tuple[str, str], float], dict[str, int]]


@dataclass(frozen=True, eq=False)
class Column:
    """One signature."""

    #: effect, amplitude: owner and parameter
    effect: str
    amplitude: str
    size: float  # Value of the amplitude in the simulation
    shapes: Mapping[str, float]  # Values of the shapes
    channel: int = -1  # Channel of an effect of one sensor; -1 otherwise
    #: Whether the shapes grow with the amplitude: a yield force, a damper. Those of a user's law
    #: stay as they are.
    shapes_follow: bool = True
    bounds: tuple[float, float] = (-np.inf, np.inf)  # Physical bounds of the amplitude

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
            columns.append(
                Column(
                    name,
                    amplitude.name,
                    _SIZE * amplitude.scale,
                    values,
                    channel,
                    shapes_follow=follow,
                    bounds=(amplitude.lower, amplitude.upper),
                )
            )
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
        values = {**column.shapes, column.amplitude: column.size}
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
) -> tuple[Signatures, tuple[Column, ...]]:
    """Gram matrix of the baseline's residual, its derivatives and all signatures."""
    every = signature_columns(model)
    contained = [column for column in every if column.effect in model.contained]
    columns = [column for column in every if column.effect not in model.contained]
    gram = np.zeros(())
    for record, residual in zip(records, residuals, strict=True):
        table = signature_rows(model, record, residual, (*contained, *columns), known)
        gram = gram + total_products(table, record.block)
    return Signatures(gram, 2 + len(contained)), tuple(columns)


def solutions(
    signatures: Signatures, columns: Sequence[Column], effects: Effects, known: Known
) -> list[Solution]:
    """Least-squares values over the variants of the effects, best first, and their channels."""
    gram, first = signatures.gram, 1 + signatures.n_base
    groups = [_variants(columns, effect) for effect in effects]
    fits = []
    for chosen in product(*groups):
        numbers = [k for group in chosen for k in group]
        owners = [columns[k] for k in numbers]
        square, values = _bounded_solution(
            gram, [*range(1, first), *(first + k for k in numbers)], owners
        )
        named = {
            (BASELINE, name): known[BASELINE, name] + float(values[k])
            for k, name in enumerate(("K1", "C1"))
        }
        for column, value in zip(owners, values[first - 1 :].tolist(), strict=True):
            named[column.effect, column.amplitude] = value
            # A branch of the same time, a slider of the same yield deflection, at the fitted
            # stiffness.
            growth = abs(value) / column.size if column.shapes_follow else 1.0
            for name, shape in column.shapes.items():
                named[column.effect, name] = growth * shape
        channel = {column.effect: column.channel for column in owners if column.channel >= 0}
        fits.append((square, (named, channel)))
    fits.sort(key=lambda pair: pair[0])
    return [numbers for _, numbers in fits[:_MOST_STARTS]]


def _variants(columns: Sequence[Column], effect: str) -> list[list[int]]:
    """Columns of an effect that are taken together, by variant; one empty list if it has none."""
    groups: dict[tuple[float, ...], list[int]] = {}
    for k, column in enumerate(columns):
        if column.effect == effect:
            groups.setdefault(column.variant, []).append(k)
    return list(groups.values()) or [[]]


def _bounded_solution(
    gram: FloatArray, rows: Sequence[int], columns: Sequence[Column]
) -> tuple[float, FloatArray]:
    """Residual sum of squares and least-squares values."""
    values, active = np.zeros(len(rows)), list(range(len(rows)))
    n_base = len(rows) - len(columns)
    while True:
        used = [rows[k] for k in active]
        solution = normal_solution(gram[np.ix_(used, used)], gram[used, 0])
        outside = [
            k
            for k, value in zip(active, solution, strict=True)
            if k >= n_base
            and not columns[k - n_base].bounds[0] <= value <= columns[k - n_base].bounds[1]
        ]
        if not outside:
            values[active] = solution
            return float(gram[0, 0] - solution @ gram[used, 0]), values
        active = [k for k in active if k not in outside]


def values_array(parameters: Sequence[Parameter], values: Known) -> FloatArray:
    """Values in the order of the parameters; what is not known leaves the baseline as it is."""
    off = [p.scale if p.shape else 0.0 for p in parameters]
    return np.array(
        [values.get((p.effect, p.name), value) for p, value in zip(parameters, off, strict=True)]
    )
