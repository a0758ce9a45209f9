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
from carrierflex.diagnosis.carrier.records.columns import inputs_of
from carrierflex.diagnosis.wiring.linear_records import LinearRecord
from carrierflex.diagnosis.wiring.rivals import (
    ANGLE_DIRECTION,
    SENSOR_ORDER,
    TORQUE_SIGN,
    PredictedRecord,
    WiringRival,
)
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign_check.campaign_warning import key_of, sample_of
from carrierflex.identification.carrier.models import rim_sensor
from carrierflex.simulation.carrier.effect import Effect

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Sensors whose order is tried in full; of more only neighbours and places moved on.
_ALL_ORDERS = 4
_RIDGE = 1e-12
#: Bytes of all records beside their prediction, and of the columns of one run.
_MOST_RECORDS = 300_000_000
_MOST_COLUMNS = 100_000_000


@dataclass(frozen=True, eq=False)
class _Wiring:
    """Signs of torque, radial loads and angle."""

    torque: float = 1.0
    load: float = 1.0
    angle: float = 1.0


@dataclass(frozen=True, eq=False)
class _Products:
    """Products of the baseline's columns where signal i is of place order[i].

    Parameters
    ----------
    matrix : ndarray, shape (n_orders, p, p)
        Columns with each other, over the samples of the signals.
    right : ndarray, shape (n_orders, p)
        Columns with the signals.
    square, count : float
        Sum of squares and samples of all signals.
    """

    matrix: FloatArray
    right: FloatArray
    square: float
    count: float


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
    rivals = [
        WiringRival(name, about, text, _left(problem, effects, wiring), place)
        for about, (name, text, wiring) in signs.items()
    ]
    orders = list(_orders(problem))
    if orders:
        products = _products(problem, effects, _Wiring(), orders)
        left = [_solved(problem, effects, products, k)[1] for k in range(len(orders))]
        best = int(np.argmin(left))
        rivals.append(_order_rival(campaign.channels, orders[best], left[best]))
    return tuple(rivals)


def unchecked_records(problem: CarrierProblem) -> str:
    """Why records are not held beside their prediction: both would fill the memory; else empty."""
    campaign = problem.campaign
    size = 16 * len(campaign.channels) * sum(run.time.size for run in campaign.runs)
    if campaign.baseline.source != "model" or size <= _MOST_RECORDS:
        return ""
    return f"records and prediction take {size / 1e6:.0f} MB, at most {_MOST_RECORDS / 1e6:.0f} MB"


def carrier_predictions(problem: CarrierProblem) -> tuple[PredictedRecord, ...]:
    """Every run beside the baseline fitted to all.

    Empty where the baseline is not the model's, or by :func:`unchecked_records`.
    """
    effects = _linear_effects(problem)
    is_model = bool(effects) and problem.campaign.baseline.source == "model"
    if not is_model or unchecked_records(problem):
        return ()
    channels = problem.campaign.channels
    products = _products(problem, effects, _Wiring(), [range(len(channels))])
    theta = _solved(problem, effects, products, 0)[0]
    records = []
    for r, run in enumerate(problem.campaign.runs):
        own = theta[_numbers(problem, effects, r)]
        predicted = [own @ _columns(problem, effects, run, c, _Wiring()) for c in channels]
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
        One a run; none where the baseline holds more than linear effects, or is another
        simulator's.
    """
    effects = _linear_effects(problem)
    runs, channels = problem.campaign.within_use().runs, problem.campaign.channels
    is_linear = len(effects) == len(problem.model.contained)
    if not effects or not is_linear or problem.campaign.baseline.source != "model":
        return
    # Columns of the run itself first.
    ordered = sorted(effects, key=lambda effect: not effect.per_run)
    is_of_run = np.concatenate([[effect.per_run] * len(effect.parameters) for effect in effects])
    order = np.argsort(~is_of_run, kind="stable")
    most = _MOST_COLUMNS // (8 * is_of_run.size * len(channels))
    for number, whole in enumerate(runs):
        # Delay and gain are of the whole run: every second sample of a long one tells them too.
        run = whole.thinned(-(-whole.time.size // max(most, 1)))
        columns = np.stack(
            [_columns(problem, ordered, run, c, _Wiring()) for c in channels], axis=2
        )
        own_theta = theta[_numbers(problem, effects, number)[order]]
        predicted = np.einsum("p,pnc->nc", own_theta, columns)
        measured = np.array([run.signals[channel.name] for channel in channels]).T
        yield LinearRecord(
            run.name, run.time, measured - predicted, predicted, columns, int(is_of_run.sum())
        )


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
    return _left(other, _linear_effects(other), _Wiring())


def _linear_effects(problem: CarrierProblem) -> list[Effect]:
    """Effects of the baseline that add a signal linear in their parameters."""
    contained = (problem.model.effects[name] for name in problem.model.contained)
    return [effect for effect in contained if effect.pattern is not None and not effect.n_shapes]


def _columns(
    problem: CarrierProblem,
    effects: Sequence[Effect],
    run: Run,
    channel: Channel,
    wiring: _Wiring,
) -> FloatArray:
    """Columns of a place in a run, shape (q, n); those of other runs' own values are left out."""
    inputs = inputs_of(run)
    inputs = replace(
        inputs,
        torque=wiring.torque * inputs.torque,
        ntl_y=wiring.load * inputs.ntl_y,
        ntl_z=wiring.load * inputs.ntl_z,
        carrier_angle=wiring.angle * inputs.carrier_angle,
    )
    sensor, rig = rim_sensor(channel), problem.model.source.rig
    return np.concatenate([effect.signals(sensor, inputs, rig) for effect in effects])


def _numbers(problem: CarrierProblem, effects: Sequence[Effect], run: int) -> IntArray:
    """Numbers of the columns of a run among the p of all runs."""
    n_runs = len(problem.campaign.runs)
    numbers, first = [], 0
    for effect in effects:
        n = len(effect.parameters)
        numbers.append(first + np.arange(n) + (run * n if effect.per_run else 0))
        first += n * (n_runs if effect.per_run else 1)
    return np.concatenate(numbers)


def _products(
    problem: CarrierProblem,
    effects: Sequence[Effect],
    wiring: _Wiring,
    orders: Sequence[Sequence[int]],
) -> _Products:
    """Products for every order of the places, summed run by run."""
    channels = problem.campaign.channels
    p = len(_bounds(problem, effects)[0])
    matrix, right = np.zeros((len(orders), p, p)), np.zeros((len(orders), p))
    square = count = 0.0
    for number, run in enumerate(problem.campaign.runs):
        columns = np.stack([_columns(problem, effects, run, c, wiring) for c in channels])
        signals = np.array([run.signals[channel.name] for channel in channels])
        known = np.isfinite(signals)
        signals = np.where(known, signals, 0.0)
        own = _numbers(problem, effects, number)
        # Where no sample is missing the products of a place are the same for every signal.
        whole = columns @ np.swapaxes(columns, 1, 2)
        partial = {
            i: (columns * known[i]) @ np.swapaxes(columns, 1, 2)
            for i in range(len(channels))
            if not known[i].all()
        }
        mixed = columns @ signals.T
        for k, order in enumerate(orders):
            placed = list(enumerate(order))
            of_run = sum(partial.get(i, whole)[j] for i, j in placed)
            matrix[k][np.ix_(own, own)] += of_run
            right[k, own] += sum(mixed[j, :, i] for i, j in placed)
        square += float(np.sum(signals**2))
        count += float(known.sum())
    return _Products(matrix, right, square, count)


def _solved(
    problem: CarrierProblem,
    effects: Sequence[Effect],
    products: _Products,
    order: int,
) -> tuple[FloatArray, float]:
    """Bounded least squares for one of the orders; parameters and mean square."""
    matrix, right = products.matrix[order], products.right[order]
    scale = np.sqrt(np.maximum(np.diag(matrix), np.finfo(float).tiny))
    scaled = matrix / np.outer(scale, scale) + _RIDGE * np.eye(scale.size)
    factor = np.linalg.cholesky(scaled).T
    target = np.linalg.solve(factor.T, right / scale)
    lower, upper = _bounds(problem, effects)
    solution = lsq_linear(factor, target, bounds=(lower * scale, upper * scale))
    left = products.square - float(target @ target) + 2.0 * float(solution.cost)
    return np.asarray(solution.x / scale), max(left, 0.0) / products.count


def _left(problem: CarrierProblem, effects: Sequence[Effect], wiring: _Wiring) -> float:
    """Mean square that the baseline leaves with every sensor where it is said to be."""
    same = range(len(problem.campaign.channels))
    return _solved(problem, effects, _products(problem, effects, wiring, [same]), 0)[1]


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
