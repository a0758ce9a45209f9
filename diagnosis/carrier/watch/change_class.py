"""The class of a change: which pattern, baseline effect or fault of the measurement explains it.

A change D is the mean vector after its beginning less that before. Every hypothesis has columns B;
its cost is

    min_a |W (D - B a)|² + q ln(d),    W' W = (Sigma_mean + (eps |D|)² I)^-1

with q columns, d components and the share eps that model and calibration leave open. The cheapest
is named, with those that cost nearly as little.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Annotated

import numpy as np

from carrierflex.diagnosis.carrier.classes.answer import ANGLE, CLASS_OF_LAW, DELAY, GAIN, ZERO
from carrierflex.diagnosis.carrier.classes.class_rows import shapes
from carrierflex.diagnosis.carrier.records.columns import SAMPLES_A_TURN
from carrierflex.diagnosis.carrier.watch.change_test import RevolutionNoise
from carrierflex.diagnosis.carrier.watch.rim_revolutions import RimBaseline, vector_of_amplitudes
from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.simulation.carrier.effect import Effect
from carrierflex.simulation.carrier.measured_laws import rim_patterns
from carrierflex.simulation.carrier.measured_laws.rim_patterns import Columns
from carrierflex.simulation.carrier.rim import inputs_of_columns

#: Faults of the measurement, not of the machine.
EXCHANGED, REVERSED, LOST = "wiring/sensor_order", "wiring/reversed", "channel/lost"
ONE_CHANNEL = "channel/other"
NO_CLASS = "none_of_these"
#: Factors on a channel are alike where they differ by less.
_NEAR = 0.2


@dataclass(frozen=True, eq=False)
class ChangeClass:
    """What a change is of."""

    id: Annotated[str, "Class (frame/pattern), fault of the measurement, or none_of_these"]
    ties: Annotated[Sequence[str], "Classes that explain it as well"]
    is_fault: Annotated[bool, "Whether it is a fault of the measurement"]
    channels: Annotated[Sequence[str], "Channels of a fault"]
    effect: Annotated[str, "Effect of the baseline whose size has changed; empty where none has"]
    relative: Annotated[float | None, "Change of that effect's size over its size"]
    share: Annotated[float, "Share of the mean square of the change that the class explains"]


@dataclass(frozen=True, eq=False)
class _Hypothesis:
    """One explanation: columns of unit length, shape (q, p, C)."""

    id: str
    columns: FloatArray
    channels: tuple[str, ...] = ()
    effect: str = ""
    length: float = 1.0  # length of the column of an effect or a channel
    is_sparse: bool = False  # whether waves that are not significant are no columns


def named_change(
    change: FloatArray,
    n: int,
    noise: RevolutionNoise,
    baseline: RimBaseline,
    before: FloatArray,
    loads: FloatArray,
) -> ChangeClass:
    """Cheapest hypothesis on the class of a change, or that none explains enough.

    `change` is D, `n` are the revolutions after it; `before` is the vector of the measured signals
    without the change [m], shape (p, C); `loads` are the mean loads after it, as of a revolution.
    """
    W = _whitening(change, n, noise)
    target = np.einsum("kcd,kd->kc", W, change).ravel()
    costs: dict[str, tuple[float, _Hypothesis, float, FloatArray]] = {}
    for one in _hypotheses(baseline, before, loads):
        B = np.einsum("kcd,qkd->qkc", W, one.columns).reshape(len(one.columns), -1).T
        a = _amplitudes(B, target, is_sparse=one.is_sparse)
        # Exchanged signals are exchanged as a whole.
        if one.id == EXCHANGED and abs(float(a[0]) / one.length - 1.0) >= _NEAR:
            continue
        n_columns = np.count_nonzero(a)
        cost = float(np.sum((target - B @ a) ** 2) + n_columns * np.log(target.size))
        remainder = change - np.tensordot(a, one.columns, 1)
        share = 1.0 - float(np.sum(remainder**2) / np.sum(change**2))
        if one.id not in costs or cost < costs[one.id][0] - 1e-6:
            costs[one.id] = (cost, one, share, a)
    cost, best, share, a = min(costs.values(), key=lambda of: of[0])
    if share < 1.0 - ClassConstants().named_left:
        return ChangeClass(NO_CLASS, (), False, (), "", None, share)
    ties = [
        name
        for name, (of_rival, rival, *_) in costs.items()
        # A tie: evidence of one in 100.
        if of_rival < cost + 2.0 * np.log(100.0)
        and name != best.id
        # Any fault of a channel is no rival of a particular one of the same channel.
        and (name != ONE_CHANNEL or rival.channels != best.channels)
    ]
    name = _fault_by_factor(best, a)
    is_fault = name.startswith(("channel/", "clock/", "wiring/"))
    relative = float(a[0] / best.length) if best.effect else None
    return ChangeClass(name, ties, is_fault, best.channels, best.effect, relative, share)


def _whitening(change: FloatArray, n: int, noise: RevolutionNoise) -> FloatArray:
    """W by row, shape (p, C, C)."""
    C = change.shape[1]
    memory = 1.0 - noise.memory[:, None, None]
    covariance = noise.covariance / memory**2 / n
    # eps: what errors of gains, torque and curves leave open in a component.
    covariance = covariance + 0.03**2 * np.sum(change**2) * np.eye(C)
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))


def _amplitudes(B: FloatArray, target: FloatArray, *, is_sparse: bool) -> FloatArray:
    """Amplitudes by least squares; of a sparse hypothesis, zero where the column costs more."""
    a = np.asarray(np.linalg.lstsq(B, target, rcond=None)[0])
    if not is_sparse:
        return a
    saved = a**2 * np.sum(B**2, axis=0)
    used = saved > min(np.log(target.size), saved.max())
    used[np.argmax(saved)] = True
    result = np.zeros_like(a)
    result[used] = np.linalg.lstsq(B[:, used], target, rcond=None)[0]
    return result


def _fault_by_factor(one: _Hypothesis, a: FloatArray) -> str:
    """A gain that is a lost or a reversed signal, else the hypothesis."""
    if one.id != GAIN:
        return one.id
    factor = float(a[0]) / one.length
    for name, value in ((LOST, -1.0), (REVERSED, -2.0)):
        if abs(factor - value) < _NEAR:
            return name
    return GAIN


def _hypotheses(
    baseline: RimBaseline, before: FloatArray, loads: FloatArray
) -> Iterator[_Hypothesis]:
    """Patterns, effects of the library, effects of the baseline, faults of the measurement."""
    quantities = [channel.quantity for channel in baseline.channels]
    for shape in shapes():
        name = shape.id
        columns = next(iter(shape.columns.values()))(quantities, baseline.rig.n_planets)
        # Unequal pin loads make their waves in one ratio, which the library's effects know.
        if name in (rim_patterns.UNEVEN, rim_patterns.MODULATED) and "g_f" in baseline.rig.curves:
            continue
        rows = _unit(_pattern_vectors(columns, baseline))
        # Their waves' sizes know no ratio.
        yield _Hypothesis(
            name, rows, is_sparse=name in (rim_patterns.WAVES, rim_patterns.PLANET_PASS)
        )
    turn = _turn(loads)
    # Before the same effect of the library: of equal costs the first is taken.
    for term in baseline.terms:
        rows = _effect_vectors(term.effect, baseline, turn, *term.shapes)
        vector = np.tensordot(term.coefficients, rows, 1)
        length = float(np.linalg.norm(vector))
        if length and term.effect.id in CLASS_OF_LAW:
            name = CLASS_OF_LAW[term.effect.id]
            yield _Hypothesis(name, vector[None] / length, (), term.effect.id, length)
    for name, effect in baseline.effects.items():
        if effect.pattern is None or effect.n_shapes or effect.weighed_by:
            continue
        if name in CLASS_OF_LAW:
            rows = _effect_vectors(effect, baseline, turn)
            if rows.any():
                yield _Hypothesis(CLASS_OF_LAW[name], _unit(rows))
    yield from _faults(baseline, before)


def _faults(baseline: RimBaseline, before: FloatArray) -> list[_Hypothesis]:
    """What a channel, a pair of channels or the clock does to the signals as they were."""
    p, C = before.shape
    slope = _slope(before)
    constant = np.zeros((p, C))
    constant[0] = 1.0

    def add(name: str, vector: FloatArray, names: tuple[str, ...], *others: FloatArray) -> None:
        """Add a fault of a known vector, which must not be zero, and further columns."""
        length = float(np.linalg.norm(vector))
        if length:
            faults.append(
                _Hypothesis(name, np.stack([vector / length, *others]), names, "", length)
            )

    faults: list[_Hypothesis] = []
    add(DELAY, slope, ())
    for c, channel in enumerate(baseline.channels):
        only = np.eye(C)[c]
        zero, names = constant * only, (channel.name,)
        waves = before * only
        waves[0] = 0.0
        faults.append(_Hypothesis(ZERO, zero[None], names))
        rows = np.zeros((p, p, C))
        rows[np.arange(p), np.arange(p), c] = 1.0
        faults.append(_Hypothesis(ONE_CHANNEL, rows, names, is_sparse=True))
        add(GAIN, waves, names, zero)
        add(ANGLE, slope * only, names, zero)
    for first, second in combinations(range(C), 2):
        exchanged = before.copy()
        exchanged[:, [first, second]] = before[:, [second, first]]
        both = (baseline.channels[first].name, baseline.channels[second].name)
        add(EXCHANGED, exchanged - before, both)
    return faults


def _slope(vector: FloatArray) -> FloatArray:
    """Derivative by the carrier angle: ``n b`` of the cosine, ``-n a`` of the sine."""
    n = (len(vector) - 1) // 2
    order = np.arange(1, n + 1)[:, None]
    cosine, sine = vector[1 : n + 1], vector[n + 1 :]
    return np.concatenate([np.zeros_like(vector[:1]), order * sine, -order * cosine])


def _unit(columns: FloatArray) -> FloatArray:
    """Columns of unit length, without those that are zero."""
    length = np.sqrt(np.sum(columns**2, axis=(1, 2)))
    return columns[length > 0.0] / length[length > 0.0, None, None]


def _pattern_vectors(columns: Columns, baseline: RimBaseline) -> FloatArray:
    """Vectors of the columns of a pattern, shape (q, p, C)."""
    n = baseline.n_orders
    amplitudes = np.zeros((len(columns), *baseline.shape))
    angle = np.array([baseline.sensor(channel).angle for channel in baseline.channels])
    quantity = np.array([channel.quantity for channel in baseline.channels])
    for q, column in enumerate(columns):
        cosine, sine = (weight * (quantity == column.quantity) for weight in column.over(angle))
        amplitudes[q, column.order] = cosine
        if column.order:
            amplitudes[q, n + column.order] = sine
    return vector_of_amplitudes(amplitudes)


def _turn(loads: FloatArray) -> dict[str, FloatArray]:
    """Columns of one turn under constant loads."""
    theta = 2.0 * np.pi * np.arange(SAMPLES_A_TURN) / SAMPLES_A_TURN
    *forces, speed = loads.tolist()
    names = ("torque", "ntl_y", "ntl_z")
    steady = {name: np.full(SAMPLES_A_TURN, of) for name, of in zip(names, forces, strict=True)}
    return {"time": theta / speed, "carrier_angle": theta} | steady


def _effect_vectors(
    effect: Effect, baseline: RimBaseline, turn: Mapping[str, FloatArray], *shapes: float
) -> FloatArray:
    """Vectors of the unit signals of an effect, shape (q, p, C)."""
    inputs, rig = inputs_of_columns(turn), baseline.rig
    sensors = [baseline.sensor(channel) for channel in baseline.channels]
    signals = np.array([effect.signals(sensor, inputs, rig, *shapes) for sensor in sensors])
    angle = turn["carrier_angle"]
    return np.array([baseline.vectors(angle, of_unit)[0] for of_unit in signals.swapaxes(0, 1)])
