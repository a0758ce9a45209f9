"""Errors of the wiring of a mounting, and of a length of its rig, as rivals.

Signs and gains of loads, sensors exchanged, the main bearing elsewhere.

The baseline is linear in its loads: its answers to each load alone, with the nominal bushings, tell
which sign and which order of the sensors fits; only those are refitted.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment, minimize_scalar

from carrierflex.diagnosis.inference.effect_fit import fit_effects, mean_square_of
from carrierflex.diagnosis.kind.problem_in_time import ProblemInTime
from carrierflex.diagnosis.mounting.model import MountingModel
from carrierflex.diagnosis.mounting.records import MountingRecord
from carrierflex.diagnosis.wiring.load_faults import with_scaled_inputs
from carrierflex.diagnosis.wiring.refits import (
    LOADS,
    RADIAL_LOADS,
    REPORTED,
    SMALLEST_GAIN,
    Fault,
    WiringRival,
)
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign_check.campaign_warning import key_of

FloatArray = NDArray[np.float64]
MountingInTime = ProblemInTime[MountingModel, MountingRecord]

#: Factor of the answer to a load below which its sign is wrong.
_TURNED = -0.2
#: Step of a length over it, the range in which it is sought, and the refits at most.
_LENGTH_STEP, _LENGTHS, _LENGTH_REFITS = 0.1, (0.6, 1.7), 12


def mounting_rivals(problem: MountingInTime, campaign: Campaign) -> tuple[WiringRival, ...]:
    """Baseline refitted with what looks turned or exchanged put right; empty where nothing does."""
    names = problem.model.channels
    rig = problem.model.rig
    known = {"K1": rig.bushing_radial_stiffness, "C1": rig.bushing_radial_damping}
    nominal = np.array(
        [known.get(p.name, max(p.lower, min(p.upper, 0.0))) for p in problem.parameters(())]
    )
    measured = np.concatenate([record.measured for record in problem.records])
    predicted = _answers(problem, problem.records, nominal)
    factors = _factors(measured, predicted)
    turned = [name for name, factor in zip(LOADS, factors, strict=True) if factor < _TURNED]
    rivals = []
    if turned:
        square = _refitted(problem, lambda record: _with_loads(record, turned))
        text = f"{', '.join(turned)} of the other sign"
        rivals.append(WiringRival(Fault.TORQUE_SIGN, ", ".join(turned), text, square, "run files"))
    if _are_exchanged(problem, measured, predicted, nominal):
        y, z = RADIAL_LOADS
        square = _refitted(problem, _with_exchanged_loads)
        text = f"{y} and {z} exchanged"
        rivals.append(WiringRival(Fault.LOAD_AXES, f"{y}, {z}", text, square, "run files"))
    # Exchanged sensors may look like a load of the other sign: both are tried.
    for loads in [[], turned] if turned else [[]]:
        sign = np.where(np.isin(LOADS, loads), -1.0, 1.0)
        order = _order(measured, np.einsum("l,lnc->nc", sign, predicted))
        if order is not None:
            rivals.append(_exchanged(problem, order, loads))
    # Channels that read the other sign of what is predicted, where most do not.
    sum_of_loads = predicted.sum(axis=0)
    known_rows = np.isfinite(measured).all(axis=1) & np.isfinite(sum_of_loads).all(axis=1)
    signals, answers = measured[known_rows], sum_of_loads[known_rows]
    size = np.maximum(np.square(answers).sum(axis=0), 1e-300)
    is_reversed = (signals * answers).sum(axis=0) / size < _TURNED
    if 0 < 2 * np.count_nonzero(is_reversed) < is_reversed.size:
        sign = np.where(is_reversed, -1.0, 1.0)
        square = _refitted(problem, lambda record: replace(record, measured=sign * record.measured))
        about = ", ".join(names[k] for k in np.flatnonzero(is_reversed))
        line = key_of("[[channels]]", about)
        rivals.append(
            WiringRival(Fault.POLARITY, about, f"{about} of the other sign", square, line)
        )
    gains = _gain_rivals(problem, campaign, measured)
    best = min(gains, key=lambda rival: rival.mean_square, default=None)
    return (*rivals, *([best] if best else []), *_bearing_rival(problem, campaign))


def _refitted(
    problem: MountingInTime, corrected: Callable[[MountingRecord], MountingRecord]
) -> float:
    """Mean square that the baseline leaves of corrected records."""
    return mean_square_of(replace(problem, records=tuple(map(corrected, problem.records))))


def _bearing_rival(problem: MountingInTime, campaign: Campaign) -> Iterator[WiringRival]:
    """Baseline refitted with the main bearing elsewhere, where a parabola promises half of it."""
    rig = problem.model.rig
    stated = rig.main_bearing_x

    def square(x: float) -> float:
        """Mean square with the main bearing there."""
        model = replace(problem.model, rig=replace(rig, main_bearing_x=x))
        return mean_square_of(replace(problem, model=model))

    squares = [square(stated * (1.0 + step)) for step in (-_LENGTH_STEP, 0.0, _LENGTH_STEP)]
    parabola = np.polyfit((-1.0, 0.0, 1.0), squares, 2)
    vertex = float(np.clip(-0.5 * parabola[1] / parabola[0], -1.0, 1.0))
    if min(np.polyval(parabola, vertex), *squares) > (1.0 - REPORTED) * squares[1]:
        return
    best = minimize_scalar(
        square,
        bounds=stated * np.array(_LENGTHS),
        method="bounded",
        options={"maxiter": _LENGTH_REFITS, "xatol": 1e-3 * stated},
    )
    x = float(best.x)
    text = f"the main bearing {x:.3g} m upwind of the bushings, not {stated:.3g} m,"
    key = "main_bearing_x"
    corrected = replace(campaign, rig={**campaign.rig, key: x})
    line = key_of("[rig]", key)
    yield WiringRival(Fault.RIG_LENGTH, key, text, float(best.fun), line, corrected=corrected)


def _gain_rivals(
    problem: MountingInTime, campaign: Campaign, measured: FloatArray
) -> Iterator[WiringRival]:
    """Baseline refitted with one load larger or smaller beside the others."""
    theta = fit_effects(problem, ()).theta
    factors = _factors(measured, _answers(problem, problem.records, theta))
    for load, name in enumerate(LOADS):
        others = np.delete(factors, load)
        others = others[others != 1.0]
        if factors[load] == 1.0 or not others.size or min(factors[load], *others) <= 0.0:
            continue
        gain = float(factors[load] / np.mean(others))
        if abs(gain - 1.0) < SMALLEST_GAIN:
            continue
        square = _refitted(problem, partial(_with_loads, names=[name], factor=gain))
        text = f"{name} {gain:.3g} times as large relative to the other loads"
        corrected = with_scaled_inputs(campaign, {name: (name, gain)})
        yield WiringRival(Fault.INPUT_GAIN, name, text, square, "run files", corrected=corrected)


def _exchanged(problem: MountingInTime, order: Sequence[int], turned: Sequence[str]) -> WiringRival:
    """Baseline refitted with the sensors in another order and loads of the other sign."""
    names = problem.model.channels
    square = _refitted(
        problem,
        lambda record: replace(_with_loads(record, turned), measured=record.measured[:, order]),
    )
    moved = [(signal, k) for k, signal in enumerate(order) if signal != k]
    text = ", ".join(f"{names[signal]} as {names[k]}" for signal, k in moved)
    about = ", ".join(names[k] for _, k in moved)
    also = f" and {', '.join(turned)} of the other sign" if turned else ""
    line = key_of("[[channels]]", "sensor")
    return WiringRival(Fault.SENSOR_ORDER, about, f"the signal of {text}{also}", square, line)


def _answers(
    problem: MountingInTime, records: Sequence[MountingRecord], theta: FloatArray
) -> FloatArray:
    """Signals of some runs, one behind the other, under each load alone, (3, n, n_channels)."""
    predicted = problem.simulator(())
    answers = []
    for record in records:
        still = dict.fromkeys(LOADS, np.zeros_like(record.inputs.torque))
        alone = [
            replace(record.inputs, **(still | {name: getattr(record.inputs, name)}))
            for name in LOADS
        ]
        answers.append([predicted(replace(record, inputs=one), theta, 1) for one in alone])
    return np.concatenate(answers, axis=1)


def _factors(measured: FloatArray, predicted: FloatArray) -> FloatArray:
    """Factor of the answer to every load by least squares; one where a load does not act."""
    known = np.isfinite(measured).all(axis=1)
    columns = predicted[:, known].reshape(len(predicted), -1)
    acts = np.abs(columns).max(axis=1) > 0.0
    factors = np.ones(len(predicted))
    if acts.any() and np.isfinite(columns).all():
        factors[acts] = np.linalg.lstsq(columns[acts].T, measured[known].ravel(), rcond=None)[0]
    return factors


def _are_exchanged(
    problem: MountingInTime, measured: FloatArray, as_read: FloatArray, theta: FloatArray
) -> bool:
    """Whether the answers to exchanged radial loads fit the signals, and those as read do not."""
    other = _answers(problem, [_with_exchanged_loads(one) for one in problem.records], theta)
    # Where a radial load does not act its factors are one, as read and exchanged.
    factors = _factors(measured, np.concatenate([as_read, other[1:]]))
    return bool(factors[3:].min() > np.abs(factors[1:3]).max())


def _with_exchanged_loads(record: MountingRecord) -> MountingRecord:
    y, z = (getattr(record.inputs, name) for name in RADIAL_LOADS)
    return replace(record, inputs=replace(record.inputs, ntl_y=z, ntl_z=y))


def _order(measured: FloatArray, predicted: FloatArray) -> Sequence[int] | None:
    """Signal for every place where another order fits far better; None otherwise."""
    known = np.isfinite(measured).all(axis=1)
    signals, answers = measured[known].T, predicted[known].T
    if not np.isfinite(answers).all():
        return None
    square = ((answers[:, None] - signals[None]) ** 2).sum(axis=2)
    _, order = linear_sum_assignment(square)
    best = float(square[np.arange(len(order)), order].sum())
    same = float(np.trace(square))
    moved = order != np.arange(len(order))
    return order.tolist() if moved.any() and best < (1.0 - REPORTED) * same else None


def _with_loads(
    record: MountingRecord, names: Sequence[str], factor: float = -1.0
) -> MountingRecord:
    values = {name: factor * getattr(record.inputs, name) for name in names}
    return replace(record, inputs=replace(record.inputs, **values))
