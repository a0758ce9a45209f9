"""Force of a fitted parameter set in the columns of the Gram table, and its derivatives.

A law linear in its parameters is a column of the table. One with a shape stands there at some
shapes; between them its column is the cubic through the four nearest, in the logarithm of the
shape.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from carrierflex.diagnosis.classes.gram_table import (
    GramTable,
    IntArray,
    LawColumns,
    discrepancy_shift,
)
from carrierflex.diagnosis.comparison.problem import BASELINE, FloatArray, Parameter
from carrierflex.diagnosis.element.classes.laws import MotionSize, shapes_of
from carrierflex.diagnosis.element.classes.table import ElementTable
from carrierflex.diagnosis.element.model import ElementModel
from carrierflex.diagnosis.element.signatures import contained_columns

#: Step of the derivatives by differences, relative to a parameter or a hundredth of its scale.
_DIFFERENCE = 1e-4
#: Nearest shapes that the column between them is made of.
_NEAREST = 4


def parameter_shift(
    model: ElementModel, own: ElementTable, parameters: Sequence[Parameter], theta: FloatArray
) -> FloatArray:
    """Shift of the parameters of a fit beside a discrepancy, shape (p,).

    Parameters
    ----------
    model : ElementModel
        Baseline.
    own : ElementTable
        Table of the classes.
    parameters : sequence of Parameter
        Unknowns of a set.
    theta : ndarray, shape (p,)
        The fit, at which the force is taken as linear.

    Returns
    -------
    ndarray, shape (p,)
        Zero where the table does not hold the fitted force: a shape beyond those that it has, or
        that of a user's law. What its columns then miss would be taken for a discrepancy.
    """
    if not _holds_shapes(own, parameters, theta):
        return np.zeros(len(parameters))
    derivatives = force_derivatives(model, own.table, own.bases.size, parameters, theta)
    independent = sum(
        np.count_nonzero(record.counts) * min(1.0, 2.0 * record.band_hz * record.step)
        for record in own.records
    )
    return discrepancy_shift(own.table, derivatives, independent_samples=independent)


def _holds_shapes(own: ElementTable, parameters: Sequence[Parameter], theta: FloatArray) -> bool:
    """Whether the shapes of all laws lie among those of the table."""
    values = {(p.effect, p.name): float(v) for p, v in zip(parameters, theta, strict=True)}
    for effect in dict.fromkeys(p.effect for p in parameters):
        known = _SHAPED.get(effect)
        if known is None:
            if any(p.shape for p in parameters if p.effect == effect):
                return False
            continue
        shape = known({name: v for (of, name), v in values.items() if of == effect}, 0.0)[1]
        shapes = shapes_of(effect, own.bases.size)
        if not shapes[0] <= shape <= shapes[-1]:
            return False
    return True


def force_derivatives(
    model: ElementModel,
    table: GramTable,
    size: MotionSize,
    parameters: Sequence[Parameter],
    theta: FloatArray,
) -> FloatArray:
    """Derivatives of the force by the parameters, as coefficients of the table's columns.

    Parameters
    ----------
    model : ElementModel
        Baseline.
    table : GramTable
        Columns.
    size : MotionSize
        What the shapes of the laws are multiples of.
    parameters : sequence of Parameter
        Unknowns of a set.
    theta : ndarray, shape (p,)
        Where.

    Returns
    -------
    ndarray, shape (n_columns, p)
        Zero for a parameter that is held, and for one that no column follows: the start of a run.
    """
    derivatives = np.zeros((len(table.scale), len(parameters)))
    for k, parameter in enumerate(parameters):
        if parameter.run is not None or parameter.lower >= parameter.upper:
            continue
        step = _DIFFERENCE * max(abs(theta[k]), 0.01 * parameter.scale)
        ends = []
        for sign in (1.0, -1.0):
            moved = theta.copy()
            moved[k] += sign * step
            ends.append(_force(model, table, size, parameters, moved))
        derivatives[:, k] = (ends[0] - ends[1]) / (2.0 * step)
    # Coefficients of the scaled columns for a target that is scaled too.
    return derivatives * (table.scale[0] / table.scale)[:, None]


def _force(
    model: ElementModel,
    table: GramTable,
    size: MotionSize,
    parameters: Sequence[Parameter],
    theta: FloatArray,
) -> FloatArray:
    """Coefficients of the raw columns, shape (n_columns,)."""
    values = {(p.effect, p.name): float(v) for p, v in zip(parameters, theta, strict=True)}
    force = np.zeros(len(table.scale))
    names = ["K1", "C1", "f0"] if model.mass is not None else ["m", "K1", "C1", "f0"]
    keys = [(BASELINE, name) for name in names]
    keys += [(column.effect, column.amplitude) for column in contained_columns(model)]
    for place, key in zip(table.base, keys, strict=True):
        force[place] += values[key]
    laws = {law.id: law for own in table.laws.values() for law in own}
    for effect in dict.fromkeys(p.effect for p in parameters):
        if effect in laws:
            own = [p for p in parameters if p.effect == effect]
            if effect in _SHAPED:
                named = {p.name: values[effect, p.name] for p in own}
                _add_shaped(force, laws[effect], named, size, values[BASELINE, "K1"])
            else:
                sizes = [values[effect, p.name] for p in own if not p.shape]
                force[laws[effect].variants[0]] += sizes
    return force


def _add_shaped(
    force: FloatArray, law: LawColumns, own: Mapping[str, float], size: MotionSize, K1: float
) -> None:
    """Add the force of a law with a shape to the coefficients."""
    amplitudes, shape = _SHAPED[law.id](own, K1)
    places, weights = _between(shapes_of(law.id, size), shape)
    for place, weight in zip(places, weights, strict=True):
        force[law.variants[place]] += weight * np.array(amplitudes)


#: Amplitudes of a law's columns, and its shape, from its parameters and K1.
_SHAPED: dict[str, Callable[[Mapping[str, float], float], tuple[list[float], float]]] = {
    "backlash": lambda own, K1: ([K1], own["gap"]),
    "stribeck_friction": lambda own, K1: ([own["Fc"], own["Fs"]], own["v_s"]),
    "elasto_plastic_friction": lambda own, K1: ([own["Fy"]], own["Fy"] / max(own["Kp"], 1e-300)),
    "maxwell_branch": lambda own, K1: ([own["k"]], own["tau"]),
}


def _between(shapes: FloatArray, shape: float) -> tuple[IntArray, FloatArray]:
    """Numbers of the nearest shapes and their weights by Lagrange's polynomial."""
    at = np.log(np.clip(shape, shapes[0], shapes[-1]))
    nodes = np.log(shapes)
    first = int(np.clip(np.searchsorted(nodes, at) - _NEAREST // 2, 0, nodes.size - _NEAREST))
    own = nodes[first : first + _NEAREST]
    weights = [
        np.prod([(at - other) / (node - other) for other in own if other != node]) for node in own
    ]
    return first + np.arange(_NEAREST), np.array(weights)
