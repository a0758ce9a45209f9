"""Force space of an element, where the search for its parameters starts, and their scale.

Signatures are the residual force along the measured motion, and what every effect would add to it.
A start is least squares on them, shape by shape. Under a force it is biased where the deflection is
noisy: its second derivative is mostly noise, and the mass comes out far too small. Instruments that
follow from the measured force alone carry none of that noise.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product

import numpy as np
from scipy.linalg import expm
from scipy.signal import lfilter

from carrierflex.diagnosis.comparison.problem import (
    BASELINE,
    Effects,
    FloatArray,
    Signatures,
    bounds_of,
    shape_starts,
    total_products,
)
from carrierflex.diagnosis.element.model import STATE_NAMES, ElementModel, ElementScale
from carrierflex.diagnosis.element.records import ElementRecord
from carrierflex.diagnosis.inference.effect_fit import parameter_key
from carrierflex.identification.campaign.signals import band_limited
from carrierflex.identification.estimation.scaled_least_squares import (
    bounded_solution,
    design_solution,
    normal_solution,
)
from carrierflex.simulation.element.effects import ELEMENT_EFFECTS
from carrierflex.simulation.measurement import Measurement

#: Mass, stiffness, damping and constant force of a linear element.
_Linear = tuple[float, float, float, float]
_Values = Mapping[tuple[str, str], float]
#: Rounds of instruments, of which the best is kept.
_ROUNDS = 6
#: Damping ratio of the first instrument, and the least one of any.
_FIRST_DAMPING, _LEAST_DAMPING = 0.5, 1e-3
#: Resonances over the frequency of the motion, and damping ratios, that are tried where no round
#: gives an element.
_RESONANCES = np.geomspace(0.1, 10.0, 25)
_DAMPINGS = (0.01, 0.05, 0.2)
#: Share of the square of the deflections that an element leaves which is none.
_ASTRAY = 0.5


@dataclass(frozen=True, eq=False)
class Column:
    """One signature: its effect, the values it was computed with, and which is its amplitude."""

    effect: str
    amplitude: str
    values: Mapping[str, float]
    variant: tuple[float, ...]


def _signature_columns(model: ElementModel) -> tuple[Column, ...]:
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
    """Regressors along the motion, (n_base, n): mass where it is fitted, K1, C1, f0, contained."""
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
    if model.measurement(column.effect) is Measurement.DELAY:
        sign, force = (1.0, record.drive) if model.by_force else (-1.0, record.response)
        return sign * band_limited(force, record.step, record.cutoff_hz, derivative=1)
    if column.effect == "backlash":
        gap = column.values["gap"]
        return band_limited(-np.clip(record.motion[0], -gap, gap), record.step, record.cutoff_hz)
    return model.signature(record, column.effect, column.values)


def known_force(model: ElementModel, record: ElementRecord) -> FloatArray:
    """Measured force less that of a given mass, in the usable band, shape (n,).

    With another simulator's prediction it is the force that the prediction lacks and that would
    close the gap: the gap itself, or ``-(m e'' + C1 e' + K1 e)`` where deflections were predicted.
    """
    if record.gap is not None:
        e, rate, turn = (
            band_limited(record.gap, record.step, record.cutoff_hz, derivative=order)
            for order in (0, 1, 2)
        )
        if not model.by_force:
            return e
        m, K1, C1 = (model.mass, *model.fixed)[:3] if model.mass is not None else model.fixed[:3]
        return -(m * turn + C1 * rate + K1 * e)
    force = record.drive if model.by_force else record.response
    inertia = (model.mass or 0.0) * record.motion[2]
    return band_limited(force, record.step, record.cutoff_hz) - inertia


def element_signatures(model: ElementModel, records: Sequence[ElementRecord]) -> Signatures[Column]:
    """Gram matrix of force space for all records: target, baseline and candidates."""
    columns = _signature_columns(model)
    gram = np.zeros(())
    for record in records:
        base = base_columns(model, record)
        candidates = [column_values(model, record, column) for column in columns]
        rows = np.vstack([known_force(model, record), base, *candidates])
        gram = gram + total_products(record.where_flat(rows), record.block)
    return Signatures(gram, len(base), columns)


def element_starts(
    model: ElementModel, signatures: Signatures[Column], effects: Effects, known: _Values
) -> list[FloatArray]:
    """Starts of one set, at least one: what is known with the new effects off, then solutions.

    `signatures` are those of force space; `known` are the values of a smaller set.
    """
    parameters = model.parameters(effects)
    bounds = {parameter_key(p): (p.lower, p.upper) for p in parameters}
    lower = np.full(signatures.n_base, -np.inf)
    if not model.fixed:
        # A start with a negative damping beside a friction that falls with speed is neither's.
        lower[1 + (model.mass is None)] = 0.0
    solutions = [
        _values(model, *solution)
        for solution in signatures.solutions(
            effects,
            lambda column: bounds.get((column.effect, column.amplitude), (-np.inf, np.inf)),
            lower,
            solve=bounded_solution,
        )
    ]
    states = {
        (BASELINE, f"{name} of {run}"): value
        for run, state in model.states.items()
        for name, value in zip(STATE_NAMES, state, strict=True)
    }
    # What is known; of the rest the best solution, new effects off.
    guess = solutions[0] | states
    warm = []
    for p in parameters:
        is_on = p.effect == BASELINE or p.shape
        off = p.scale if is_on else 0.0
        value = off if known and not is_on else guess.get(parameter_key(p), off)
        warm.append(known.get(parameter_key(p), value))
    solutions = [{**states, **solution} for solution in solutions]
    sources: list[_Values] = [{}]
    if known:
        # The known baseline with the new effects of force space: the effect's size is right where
        # the baseline is.
        sources.append(known)
    elif model.by_force:
        # What the response to the force says of the baseline, which noise in the deflection does
        # not touch.
        names = ("m", "K1", "C1", "f0")
        sources.append({(BASELINE, name): getattr(model.scale, name) for name in names})
    starts = [
        [
            (solution | dict(source)).get(parameter_key(p), p.scale if p.shape else 0.0)
            for p in parameters
        ]
        for source in sources
        for solution in solutions
    ]
    return [np.clip(np.array(start), *bounds_of(parameters)) for start in (warm, *starts)]


def _values(
    model: ElementModel, base: FloatArray, amplitudes: Sequence[tuple[Column, float]]
) -> dict[tuple[str, str], float]:
    """Named parameters of a force-space solution."""
    names = ["m"] if model.mass is None else []
    names += ["K1", "C1", "f0"]
    values = {(BASELINE, name): float(value) for name, value in zip(names, base, strict=False)}
    for column, value in zip(contained_columns(model), base[len(names) :], strict=True):
        # Physical bounds are applied where a start is handed back: a spring may soften.
        values[column.effect, column.amplitude] = float(value)
    for column, amplitude in amplitudes:
        for name, value in column.values.items():
            values[column.effect, name] = value
        values[column.effect, column.amplitude] = amplitude
        if column.effect == "elasto_plastic_friction":
            stiffness = max(amplitude, 0.02 * model.scale.of((1, -1, 0)))
            values[column.effect, "Kp"] = stiffness
            values[column.effect, "Fy"] = stiffness * column.values["Fy"]
    return values


def _linear_element(
    records: Sequence[ElementRecord], start: _Linear, *, mass: float | None
) -> _Linear:
    """Mass, stiffness, damping and constant force that predict the deflections best.

    Refined instrumental variables: the response of the last estimate to the measured force is the
    instrument of the next.

    References
    ----------
    .. [1] P. C. Young, "Recursive Estimation and Time-Series Analysis" (2011), refined instrumental
       variable method.
    """
    q, v = (
        np.concatenate([record.motion[k][record.block >= 0] for record in records]) for k in (0, 1)
    )
    frequency = float(v.std() / q.std())
    first = (1.0, frequency**2, 2.0 * _FIRST_DAMPING * frequency, 0.0)
    best, least = _refined(records, first, start, mass)
    measured = np.concatenate([record.response[record.block >= 0] for record in records])
    most = _ASTRAY * measured.size * float(measured.var())
    if not least < most:
        # A drive of one line tells stiffness less inertia only: both came out as nothing, or as
        # those of a resonance at the drive, far too large.
        searched = _searched(records, measured, frequency, mass)
        if searched is not None:
            resonant, misfit = _refined(records, searched, searched, mass)
            # Of a motion that no linear element follows the instruments' estimate stays.
            if misfit < most or not np.isfinite(least):
                best = resonant
    return best


def _refined(
    records: Sequence[ElementRecord], instrument: _Linear, start: _Linear, mass: float | None
) -> tuple[_Linear, float]:
    """Best of a start and of what the rounds from an instrument give, and its misfit."""
    best, least = start, _misfit(records, start)
    for _ in range(_ROUNDS):
        estimate = _instrumental(records, instrument, mass)
        if estimate is None:
            break
        misfit = _misfit(records, estimate)
        if misfit < least:
            best, least = estimate, misfit
        instrument = estimate
    return best, least


def _searched(
    records: Sequence[ElementRecord], measured: FloatArray, frequency: float, mass: float | None
) -> _Linear | None:
    """Element of some resonances and dampings about a frequency [rad/s] that predicts best."""
    elements = []
    for resonance, damping in product(frequency * _RESONANCES, _DAMPINGS):
        m = mass or 1.0
        unit = (m, m * resonance**2, 2.0 * m * damping * resonance, 0.0)
        to_force = np.concatenate(
            [_response(record, unit)[record.block >= 0] for record in records]
        )
        # A constant force bends the spring, once it has come to rest.
        constant = np.full(to_force.size, -1.0 / unit[1])
        if mass is None:
            columns = np.array([to_force, constant])
            factor, bent = normal_solution(columns @ columns.T, columns @ measured)
        else:
            factor, bent = 1.0, float(np.mean(to_force - measured)) * unit[1]
        if factor > 0.0:
            element = (m / factor, unit[1] / factor, unit[2] / factor, float(bent) / factor)
            elements.append((_misfit(records, element), element))
    return min(elements)[1] if elements else None


def element_scale(model: ElementModel, records: Sequence[ElementRecord]) -> ElementScale:
    """Sizes of an element and its baseline from its motion, or its response to a force."""
    plain = replace(model, contained=())
    rows = [
        record.where_flat(base_columns(plain, record))[:, record.block >= 0] for record in records
    ]
    force = [record.where_flat(known_force(model, record))[record.block >= 0] for record in records]
    design, target = np.concatenate(rows, axis=1), np.concatenate(force)
    solution = design_solution(design.T, target)
    mass = model.mass if model.mass is not None else max(float(solution[0]), 0.0)
    inertia = 0.0 if model.mass is not None else solution[0] * design[0]
    K1, C1, f0 = (float(value) for value in solution[-3:])
    restoring = target - inertia
    if model.by_force:
        mass, K1, C1, f0 = _linear_element(records, (mass, K1, C1, f0), mass=model.mass)
    deflection, speed = float(design[-3].std()), float(np.sqrt(np.mean(design[-2] ** 2)))
    return ElementScale(
        force=float(restoring.std()) or float(target.std()),
        deflection=deflection,
        time=deflection / speed,
        speed=speed,
        m=mass,
        K1=max(K1, 0.0),
        C1=max(C1, 0.0),
        f0=f0,
    )


def _instrumental(
    records: Sequence[ElementRecord], instrument: _Linear, mass: float | None
) -> _Linear | None:
    """Solution of ``Zᵀ (A x - f) = 0``; None where it is no element."""
    products = np.zeros((4, 4))
    right = np.zeros(4)
    square = np.zeros(4)
    for record in records:
        inside = record.block >= 0
        q, v, a = (signal[inside] for signal in record.motion)
        A = np.array([a, v, q, np.ones_like(q)])
        response = _response(record, instrument)
        slope = np.gradient(response, record.step)
        Z = np.array([np.gradient(slope, record.step), slope, response, np.ones_like(response)])[
            :, inside
        ]
        products += Z @ A.T
        square += np.square(Z).sum(axis=1)
        # The motion is known in the usable band only: the force in the same band goes with it.
        right += Z @ band_limited(record.drive, record.step, record.cutoff_hz)[inside]
    if mass is not None:
        right, products = right[1:] - mass * products[1:, 0], products[1:, 1:]
    if not (square.all() and products.any(axis=0).all()):
        return None
    # Instruments of unit length: a deflection weighs as much as its second derivative.
    length = np.sqrt(square[-len(right) :])
    solution = design_solution(products / length[:, None], right / length)
    m, C1, K1, f0 = solution if mass is None else (mass, *solution)
    if not (m > 0.0 and K1 > 0.0):
        return None
    return float(m), float(K1), float(max(C1, 2.0 * _LEAST_DAMPING * np.sqrt(m * K1))), float(f0)


def _response(record: ElementRecord, element: _Linear) -> FloatArray:
    """Deflection of a linear element from rest, straight lines between the samples of the force."""
    force = record.drive - element[-1]
    if not force.any():
        return force
    return np.asarray(lfilter(*_difference_equation(*element[:3], record.step), force))


@lru_cache(maxsize=16)  # the same for every record of a campaign
def _difference_equation(
    m: float, K1: float, C1: float, step: float
) -> tuple[FloatArray, FloatArray]:
    """Filter of force to deflection, exact for straight lines between the samples.

    With ``s = [q, v]`` the exponential of the element with a force and its rise in a step gives
    ``s_(k+1) = A s_k + B_0 u_k + B_1 u_(k+1)``, and with ``C = [1, 0]``
    ``q = C adj(z - A) (B_0 + z B_1) / det(z - A) u``.

    References
    ----------
    .. [1] G. F. Franklin, J. D. Powell, M. L. Workman, "Digital Control of Dynamic Systems" (1998),
       triangle hold.
    """
    rates = np.zeros((4, 4))
    rates[0, 1] = step
    rates[1, :3] = -K1 / m * step, -C1 / m * step, step / m
    rates[2, 3] = 1.0
    ahead = expm(rates)
    (a, b), (c, d) = ahead[:2, :2].tolist()
    constant, rising = ahead[:2, 2], ahead[:2, 3]
    (p0, r0), (p1, r1) = (constant - rising).tolist(), rising.tolist()
    numerator = np.array([p1, p0 - d * p1 + b * r1, b * r0 - d * p0])
    return numerator, np.array([1.0, -(a + d), a * d - b * c])


def _misfit(records: Sequence[ElementRecord], element: _Linear) -> float:
    """Sum of squares of measured less predicted deflection; infinite for what is no element."""
    if not (min(element[:2]) > 0.0 and element[2] >= 0.0):
        return float("inf")
    missed = [
        (record.response - _response(record, element))[record.block >= 0] for record in records
    ]
    return float(sum(residual @ residual for residual in missed))
