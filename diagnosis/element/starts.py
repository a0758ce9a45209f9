"""Where the search for an element's parameters starts.

Least squares in force space, shape by shape.
"""

from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np

from carrierflex.diagnosis.comparison.problem import (
    BASELINE,
    Effects,
    FloatArray,
    Parameter,
    Signatures,
)
from carrierflex.diagnosis.element.model import STATE_NAMES, ElementModel
from carrierflex.diagnosis.element.signatures import Column, contained_columns
from carrierflex.diagnosis.inference.effect_fit import parameter_key
from carrierflex.identification.estimation.scaled_least_squares import normal_solution

#: Starts handed back at most, best fit in force space first.
_MOST_STARTS = 6


def element_starts(
    model: ElementModel,
    signatures: Signatures,
    columns: Sequence[Column],
    effects: Effects,
    known: Mapping[tuple[str, str], float],
) -> list[FloatArray]:
    """Starts of one set: what is known with the new effects off, then force-space solutions.

    Parameters
    ----------
    model : ElementModel
        Parameters and scale.
    signatures, columns
        Force space, and what its columns are.
    effects : tuple of str
        Effects beside the baseline.
    known : mapping
        Values of a smaller set.

    Returns
    -------
    list of ndarray
        At least one.
    """
    parameters = model.parameters(effects)
    solutions = _force_space_solutions(model, signatures, columns, effects)
    best = solutions[0]
    states = {
        (BASELINE, f"{name} of {run}"): value
        for run, state in model.states.items()
        for name, value in zip(STATE_NAMES, state, strict=True)
    }
    solutions = [{**states, **found} for found in solutions]
    warm = np.array([_warm_value(parameter, known, best | states) for parameter in parameters])
    starts = [
        warm,
        *(
            np.array([found.get(parameter_key(p), _off(p)) for p in parameters])
            for found in solutions
        ),
    ]
    # The known baseline with the new effects of force space: the effect's size is right where the
    # baseline is.
    starts += [
        np.array(
            [known.get(parameter_key(p), found.get(parameter_key(p), _off(p))) for p in parameters]
        )
        for found in solutions
        if known
    ]
    if model.by_force and not known:
        # What the response to the force says of the baseline, which noise in the deflection does
        # not touch.
        scale = {(BASELINE, name): getattr(model.scale, name) for name in ("m", "K1", "C1", "f0")}
        starts += [
            np.array(
                [
                    scale.get(parameter_key(p), found.get(parameter_key(p), _off(p)))
                    for p in parameters
                ]
            )
            for found in solutions
        ]
    lower, upper = np.array([[p.lower, p.upper] for p in parameters]).T
    return [np.clip(start, lower, upper) for start in starts]


def _warm_value(
    parameter: Parameter,
    known: Mapping[tuple[str, str], float],
    solution: Mapping[tuple[str, str], float],
) -> float:
    key = parameter_key(parameter)
    if key in known:
        return known[key]
    if parameter.effect == BASELINE or parameter.shape:
        return solution.get(key, parameter.scale)
    return 0.0 if known else solution.get(key, 0.0)


def _off(parameter: Parameter) -> float:
    return parameter.scale if parameter.shape else 0.0


def _force_space_solutions(
    model: ElementModel, signatures: Signatures, columns: Sequence[Column], effects: Effects
) -> list[dict[tuple[str, str], float]]:
    """Least-squares solutions over the shapes of the effects, best first."""
    gram = signatures.gram
    first = 1 + signatures.n_base
    by_effect = []
    for effect in effects:
        shapes = sorted({column.shape for column in columns if column.effect == effect})
        groups = [
            [
                k
                for k, column in enumerate(columns)
                if column.effect == effect and column.shape == shape
            ]
            for shape in shapes
        ]
        by_effect.append(groups or [[]])
    found = []
    for choice in product(*by_effect):
        chosen = [k for group in choice for k in group]
        places = [*range(1, first), *(first + k for k in chosen)]
        solution = normal_solution(gram[np.ix_(places, places)], gram[places, 0])
        left = gram[0, 0] - solution @ gram[places, 0]
        base, amplitudes = solution[: first - 1], solution[first - 1 :]
        found.append((left, _values(model, base, [columns[k] for k in chosen], amplitudes)))
    found.sort(key=lambda pair: pair[0])
    return [values for _, values in found[:_MOST_STARTS]]


def _values(
    model: ElementModel, base: FloatArray, columns: Sequence[Column], amplitudes: FloatArray
) -> dict[tuple[str, str], float]:
    """Named parameters of a force-space solution."""
    names = ["m"] if model.mass is None else []
    names += ["K1", "C1", "f0"]
    values = {(BASELINE, name): float(value) for name, value in zip(names, base, strict=False)}
    own = contained_columns(model)
    for column, value in zip(own, base[len(names) :], strict=True):
        # Physical bounds are kept where a start is handed back: a spring may soften.
        values[column.effect, column.amplitude] = float(value)
    for column, amplitude in zip(columns, amplitudes, strict=True):
        for name, value in column.values.items():
            values[column.effect, name] = value
        values[column.effect, column.amplitude] = float(amplitude)
        if column.effect == "elasto_plastic_friction":
            stiffness = max(float(amplitude), 0.02 * model.scale.of((1, -1, 0)))
            values[column.effect, "Kp"], values[column.effect, "Fy"] = (
                stiffness,
                stiffness * column.values["Fy"],
            )
    return values
