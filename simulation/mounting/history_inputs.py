"""Inputs of a run from its load history, figure 6 of the 2011 paper."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.load_history import LoadHistory

Array = NDArray[np.float64]


def history_inputs(
    history: LoadHistory, first: float = 0.0, last: float | None = None
) -> MountingInputs:
    """Inputs of a history from `first` to `last` seconds, every ``1 / sample_rate``.

    Parameters
    ----------
    history : LoadHistory
        Times and levels.
    first, last : float
        Part of the record [s]; the paper leaves out the first and the last part of it and
        simulates 520 s.

    Returns
    -------
    MountingInputs
        Time counts from the beginning of the history.
    """
    count = round(((history.duration if last is None else last) - first) * history.sample_rate)
    return inputs_at(history, first + np.arange(count) / history.sample_rate)


def history_pieces(history: LoadHistory, size: int) -> Iterator[MountingInputs]:
    """Inputs of the whole history in pieces of `size` samples, the last one of up to one more.

    Parameters
    ----------
    history : LoadHistory
        Times and levels.
    size : int
        Samples of a piece, two or more.
    """
    count = round(history.duration * history.sample_rate)
    first = 0
    while first < count:
        # A piece of one sample has no interval: it joins the one before.
        last = count if count - first <= size + 1 else first + size
        yield inputs_at(history, np.arange(first, last) / history.sample_rate)
        first = last


def inputs_at(history: LoadHistory, time: Array) -> MountingInputs:
    """Inputs of a history at given times [s]."""
    speed = _speed(history, time)
    angle = _angle(history, time)
    radial = _smooth_rise(time, history.radial_load_from, history.radial_load_to)
    radial = radial * (1.0 + history.load_ripple * np.sin(angle))
    torque = history.torque * _smooth_rise(
        time, history.torque_from, history.torque_from + history.torque_rise
    )
    torque = torque * (1.0 + history.torque_ripple * np.sin(angle))
    return MountingInputs(
        time, torque, speed, angle, history.ntl_y * radial, history.ntl_z * radial
    )


def _knots(history: LoadHistory) -> tuple[Array, Array]:
    """Corners of the speed: start, up, down to zero within the stop, up to full speed."""
    middle = 0.5 * (history.stop_from + history.stop_to)
    reached = (
        history.speed * (history.stop_from - history.start) / (history.full_speed - history.start)
    )
    regained = (
        history.speed * (history.stop_to - history.start) / (history.full_speed - history.start)
    )
    times = np.array(
        [history.start, history.stop_from, middle, history.stop_to, history.full_speed]
    )
    return times, np.array([0.0, reached, 0.0, regained, history.speed])


def _speed(history: LoadHistory, time: Array) -> Array:
    return np.interp(time, *_knots(history))


def _angle(history: LoadHistory, time: Array) -> Array:
    """Angle of the shaft [rad]: the exact integral of the piecewise linear speed."""
    times, speeds = _knots(history)
    turned = np.concatenate([[0.0], np.cumsum(0.5 * (speeds[1:] + speeds[:-1]) * np.diff(times))])
    piece = np.clip(np.searchsorted(times, time) - 1, 0, len(times) - 2)
    inside = np.clip(time, times[0], times[-1]) - times[piece]
    slope = np.diff(speeds) / np.diff(times)
    after = np.maximum(time - times[-1], 0.0)
    return (
        turned[piece]
        + speeds[piece] * inside
        + 0.5 * slope[piece] * inside**2
        + history.speed * after
    )


def _smooth_rise(time: Array, begin: float, end: float) -> Array:
    """From 0 to 1 between two times, with zero slope at both."""
    s = np.clip((time - begin) / (end - begin), 0.0, 1.0)
    return s * s * (3.0 - 2.0 * s)
