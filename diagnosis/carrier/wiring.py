"""Errors of the wiring of a carrier's rim sensors as rivals of what the library names.

The baseline is linear in its parameters, so that a campaign with a corrected wiring is a
least-squares problem in sums of products, of every signal with the columns of every place.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from carrierflex.diagnosis.carrier.problem import CarrierProblem
from carrierflex.diagnosis.carrier.sums import inputs_of
from carrierflex.diagnosis.wiring.late_signals import LinearRecord
from carrierflex.diagnosis.wiring.rivals import (
    ANGLE_DIRECTION,
    SENSOR_ORDER,
    TORQUE_SIGN,
    PredictedRecord,
    WiringRival,
)
from carrierflex.identification.campaign.campaign import Campaign, Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign_check.campaign_warning import key_of, sample_of
from carrierflex.identification.carrier.models import rim_sensor
from carrierflex.simulation.carrier.effect import Effect

FloatArray = NDArray[np.float64]

#: Sensors whose order is tried in full; of more only neighbours and places moved on.
_ALL_ORDERS = 4
_RIDGE = 1e-12
#: Bytes of the columns of one run.
_MOST_COLUMNS = 300_000_000


@dataclass(frozen=True, eq=False)
class _Wiring:
    """Signs of torque, radial loads and angle."""

    torque: float = 1.0
    load: float = 1.0
    angle: float = 1.0


@dataclass(frozen=True, eq=False)
class _Products:
    """Products of the columns of every place with every signal.

    Parameters
    ----------
    matrix : ndarray, shape (C, C, p, p)
        Columns of place j over the samples of signal i: ``[i, j]``.
    right : ndarray, shape (C, C, p)
        Columns of place j times signal i.
    square, count : ndarray, shape (C,)
        Sum of squares and samples of every signal.
    """

    matrix: FloatArray
    right: FloatArray
    square: FloatArray
    count: FloatArray


def carrier_rivals(problem: CarrierProblem) -> tuple[WiringRival, ...]:
    """Baseline refitted with torque, load or angle of the other sign, and sensors exchanged.

    Parameters
    ----------
    problem : CarrierProblem
        Campaign whose baseline is the model.

    Returns
    -------
    tuple of WiringRival
        Every sign, and the order of the sensors that leaves least; empty where the baseline holds
        no linear effect or is another simulator's.
    """
    effects = _linear_effects(problem)
    if not effects or problem.campaign.baseline.source != "model":
        return ()
    campaign = problem.campaign
    place = sample_of(campaign.runs[0].file, 0)
    signs = {
        "torque": (TORQUE_SIGN, "the torque of the other sign", _Wiring(torque=-1.0)),
        "ntl_y, ntl_z": (TORQUE_SIGN, "radial loads of the other sign", _Wiring(load=-1.0)),
        "carrier_angle": (ANGLE_DIRECTION, "the angle counted the other way", _Wiring(angle=-1.0)),
    }
    same = tuple(range(len(campaign.channels)))
    products = _products(problem, effects, _Wiring())
    rivals = [
        WiringRival(name, about, text, left, place)
        for about, (name, text, wiring) in signs.items()
        for left in [_left(problem, effects, _products(problem, effects, wiring), same)]
    ]
    orders = list(_orders(problem))
    if orders:
        left = [_left(problem, effects, products, order) for order in orders]
        best = int(np.argmin(left))
        rivals.append(_order_rival(campaign.channels, orders[best], left[best]))
    return tuple(rivals)


def carrier_predictions(problem: CarrierProblem) -> tuple[PredictedRecord, ...]:
    """Every run beside the baseline fitted to all; empty where the baseline is not the model's."""
    effects = _linear_effects(problem)
    if not effects or problem.campaign.baseline.source != "model":
        return ()
    channels = problem.campaign.channels
    same = tuple(range(len(channels)))
    theta = _solved(problem, effects, _products(problem, effects, _Wiring()), same)[0]
    records = []
    for r, run in enumerate(problem.campaign.runs):
        predicted = [theta @ _columns(problem, effects, run, r, c, _Wiring()) for c in channels]
        measured = [run.signals[channel.name] for channel in channels]
        records.append(
            PredictedRecord(run.name, run.time, np.array(measured).T, np.array(predicted).T)
        )
    return tuple(records)


def carrier_records(problem: CarrierProblem, theta: FloatArray) -> Iterator[LinearRecord]:
    """Every run beside its baseline and the baseline's columns.

    Parameters
    ----------
    problem : CarrierProblem
        Campaign.
    theta : ndarray, shape (p,)
        Fitted parameters of the baseline.

    Yields
    ------
    LinearRecord
        One a run; none where the baseline holds more than linear effects, is another simulator's,
        or its columns would fill the memory.
    """
    effects = _linear_effects(problem)
    runs, channels = problem.campaign.within_use().runs, problem.campaign.channels
    is_linear = len(effects) == len(problem.model.contained)
    longest = max(run.time.size for run in runs)
    size = 8 * theta.size * longest * len(channels)
    if not effects or not is_linear or problem.campaign.baseline.source != "model":
        return
    if size > _MOST_COLUMNS:
        return
    for number, run in enumerate(runs):
        by_channel = [_columns(problem, effects, run, number, c, _Wiring()) for c in channels]
        columns = np.stack(by_channel, axis=2)
        predicted = np.einsum("p,pnc->nc", theta, columns)
        measured = np.array([run.signals[channel.name] for channel in channels]).T
        slope = np.gradient(predicted, run.time, axis=0)
        yield LinearRecord(run.name, run.time, measured - predicted, slope, columns)


def carrier_left(problem: CarrierProblem, campaign: Campaign) -> float:
    """Mean square that the baseline leaves once it is fitted to another campaign.

    Parameters
    ----------
    problem : CarrierProblem
        Problem of a campaign whose baseline is the model.
    campaign : Campaign
        Records with the same channels, inputs and baseline.
    """
    other = replace(problem, campaign=campaign)
    effects = _linear_effects(other)
    same = tuple(range(len(campaign.channels)))
    return _left(other, effects, _products(other, effects, _Wiring()), same)


def _linear_effects(problem: CarrierProblem) -> list[Effect]:
    """Effects of the baseline that add a signal linear in their parameters."""
    contained = (problem.model.effects[name] for name in problem.model.contained)
    return [effect for effect in contained if effect.pattern is not None and not effect.has_shape]


def _columns(
    problem: CarrierProblem,
    effects: Sequence[Effect],
    run: Run,
    number: int,
    channel: Channel,
    wiring: _Wiring,
) -> FloatArray:
    """Columns of a place in a run, shape (p, n); zero where they are another run's own."""
    inputs = inputs_of(run)
    inputs = replace(
        inputs,
        torque=wiring.torque * inputs.torque,
        ntl_y=wiring.load * inputs.ntl_y,
        ntl_z=wiring.load * inputs.ntl_z,
        carrier_angle=wiring.angle * inputs.carrier_angle,
    )
    rows = []
    for effect in effects:
        signals = effect.signals(rim_sensor(channel), inputs, problem.model.source.rig)
        if not effect.per_run:
            rows.append(signals)
            continue
        for other in range(len(problem.campaign.runs)):
            rows.append(signals if other == number else np.zeros_like(signals))
    return np.concatenate(rows)


def _products(problem: CarrierProblem, effects: Sequence[Effect], wiring: _Wiring) -> _Products:
    channels = problem.campaign.channels
    n = len(channels)
    parts = []
    for number, run in enumerate(problem.campaign.runs):
        columns = [_columns(problem, effects, run, number, c, wiring) for c in channels]
        signals = np.array([run.signals[channel.name] for channel in channels])
        known = np.isfinite(signals)
        signals = np.where(known, signals, 0.0)
        matrix = [[(columns[j] * known[i]) @ columns[j].T for j in range(n)] for i in range(n)]
        right = [[columns[j] @ signals[i] for j in range(n)] for i in range(n)]
        square = np.sum(signals**2, axis=1)
        parts.append((np.array(matrix), np.array(right), square, known.sum(axis=1)))
    return _Products(*(np.sum(np.stack(part), axis=0) for part in zip(*parts, strict=True)))


def _solved(
    problem: CarrierProblem,
    effects: Sequence[Effect],
    products: _Products,
    order: Sequence[int],
) -> tuple[FloatArray, float]:
    """Bounded least squares where signal i is of place order[i]; parameters and mean square."""
    signals = np.arange(len(order))
    matrix = products.matrix[signals, list(order)].sum(axis=0)
    right = products.right[signals, list(order)].sum(axis=0)
    scale = np.sqrt(np.maximum(np.diag(matrix), np.finfo(float).tiny))
    scaled = matrix / np.outer(scale, scale) + _RIDGE * np.eye(scale.size)
    factor = np.linalg.cholesky(scaled).T
    target = np.linalg.solve(factor.T, right / scale)
    lower, upper = _bounds(problem, effects)
    solution = lsq_linear(factor, target, bounds=(lower * scale, upper * scale))
    left = float(products.square.sum() - target @ target + 2.0 * solution.cost)
    return np.asarray(solution.x / scale), max(left, 0.0) / float(products.count.sum())


def _left(
    problem: CarrierProblem,
    effects: Sequence[Effect],
    products: _Products,
    order: Sequence[int],
) -> float:
    return _solved(problem, effects, products, order)[1]


def _bounds(problem: CarrierProblem, effects: Sequence[Effect]) -> tuple[FloatArray, FloatArray]:
    n_runs = len(problem.campaign.runs)
    limits = [
        (parameter.lower, parameter.upper)
        for effect in effects
        for _ in range(n_runs if effect.per_run else 1)
        for parameter in effect.parameters
    ]
    lower, upper = np.array(limits).T
    return lower, upper


def _orders(problem: CarrierProblem) -> Iterator[tuple[int, ...]]:
    """Other orders of the sensors of each quantity."""
    channels = problem.campaign.channels
    same = list(range(len(channels)))
    for quantity in {channel.quantity: None for channel in channels}:
        members = [k for k in same if channels[k].quantity == quantity]
        tried = (
            permutations(members)
            if len(members) <= _ALL_ORDERS
            else iter([tuple(members[k:] + members[:k]) for k in range(len(members))])
        )
        for places in tried:
            order = same.copy()
            for member, place in zip(members, places, strict=True):
                order[member] = place
            if order != same:
                yield tuple(order)


def _order_rival(channels: Sequence[Channel], order: Sequence[int], left: float) -> WiringRival:
    moved = [
        f"{channels[signal].name} where {channels[place].name} stands"
        for signal, place in enumerate(order)
        if signal != place
    ]
    about = ", ".join(channels[k].name for k, place in enumerate(order) if k != place)
    line = key_of("[[channels]]", "angle_deg")
    return WiringRival(SENSOR_ORDER, about, f"the signal of {', '.join(moved)}", left, line)
