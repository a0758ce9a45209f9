"""Force space of an element.

The residual force along the measured motion, and what every effect would add to it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.comparison.problem import (
    FloatArray,
    Signatures,
    shape_starts,
    total_products,
)
from carrierflex.diagnosis.element.model import ElementModel, is_delay
from carrierflex.diagnosis.element.records import ElementRecord
from carrierflex.identification.campaign.signals import band_limited
from carrierflex.simulation.element.effects import ELEMENT_EFFECTS


@dataclass(frozen=True, eq=False)
class Column:
    """One signature: its effect, the values it was computed with, and which is its amplitude."""

    effect: str
    amplitude: str
    values: Mapping[str, float]
    shape: tuple[float, ...]


def signature_columns(model: ElementModel) -> tuple[Column, ...]:
    """Every variant of every candidate, in the order of the library, by amplitude."""
    columns = []
    for name in model.cards:
        if name in model.contained:
            continue
        unknowns = [p for p in model.parameters((name,)) if p.effect == name]
        shapes = [parameter for parameter in unknowns if parameter.shape]
        for share in shape_starts(ELEMENT_EFFECTS, name):
            values = {parameter.name: share * parameter.scale for parameter in shapes}
            if name == "elasto_plastic_friction":
                # The column has Kp = 1: its yield force is the deflection at which it yields.
                values = {"Fy": share * model.scale.deflection}
            if name == "backlash":
                values = {"gap": share * model.scale.deflection}
            amplitudes = [p.name for p in unknowns if not p.shape and p.name not in values]
            columns += [
                Column(name, a, {**values, a: 1.0}, tuple(values.values()))
                for a in amplitudes or ["K1"]
            ]
    return tuple(columns)


def base_columns(model: ElementModel, record: ElementRecord) -> FloatArray:
    """Baseline's regressors along the measured motion, shape (n_base, n).

    Mass (where fitted), K1, C1, f0, contained.
    """
    q, v, a = record.motion
    rows = [] if model.mass is not None else [a]
    rows += [q, v, np.ones(q.size)]
    rows += [column_values(model, record, column) for column in contained_columns(model)]
    return np.array(rows)


def contained_columns(model: ElementModel) -> tuple[Column, ...]:
    """Columns of the effects the baseline contains, shapes at their scale."""
    columns = []
    for parameter in model.parameters(()):
        if parameter.effect in model.contained and not parameter.shape:
            shapes = {
                p.name: p.scale
                for p in model.parameters(())
                if p.effect == parameter.effect and p.shape
            }
            columns.append(
                Column(parameter.effect, parameter.name, {**shapes, parameter.name: 1.0}, ())
            )
    return tuple(columns)


def column_values(model: ElementModel, record: ElementRecord, column: Column) -> FloatArray:
    """Signature of one column along a record, shape (n,)."""
    if is_delay(column.effect):
        sign, force = (1.0, record.drive) if model.by_force else (-1.0, record.response)
        return sign * band_limited(force, record.step, record.cutoff_hz, derivative=1)
    if column.effect == "backlash":
        gap = column.values["gap"]
        return band_limited(-np.clip(record.motion[0], -gap, gap), record.step, record.cutoff_hz)
    return model.signature(record, column.effect, column.values)


def known_force(model: ElementModel, record: ElementRecord) -> FloatArray:
    """Measured force less that of a given mass, in the usable band, shape (n,).

    With another simulator's prediction it is the force that the prediction lacks.
    """
    if record.gap is not None:
        return _lacking_force(model, record, record.gap)
    force = record.drive if model.by_force else record.response
    inertia = (model.mass or 0.0) * record.motion[2]
    return band_limited(force, record.step, record.cutoff_hz) - inertia


def _lacking_force(model: ElementModel, record: ElementRecord, gap: FloatArray) -> FloatArray:
    """Force that would close the gap.

    The gap itself, or ``-(m e'' + C1 e' + K1 e)`` where deflections were predicted.
    """
    e, e_1, e_2 = (
        band_limited(gap, record.step, record.cutoff_hz, derivative=order) for order in (0, 1, 2)
    )
    if not model.by_force:
        return e
    first = 0 if model.mass is not None else 1
    K1, C1 = model.fixed[first : first + 2]
    m = model.mass if model.mass is not None else model.fixed[0]
    return -(m * e_2 + C1 * e_1 + K1 * e)


def element_signatures(model: ElementModel, records: Sequence[ElementRecord]) -> Signatures:
    """Gram matrix of force space for all records: target, baseline and candidates."""
    columns = signature_columns(model)
    gram = np.zeros(())
    for record in records:
        base = base_columns(model, record)
        candidates = [column_values(model, record, column) for column in columns]
        rows = np.vstack([known_force(model, record), base, *candidates])
        gram = gram + total_products(record.where_flat(rows), record.block)
    return Signatures(gram, len(base))
