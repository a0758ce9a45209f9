"""Patterns over the sensors: what a class looks like at a unit of its load function.

A signal fixed to the carrier is ``sum_n a_n cos n(v - theta) + b_n sin n(v - theta)`` at a sensor
at angle v; one fixed to the housing is a function of v, at order 0 or at the order at which planets
pass.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.order_analysis import highest_order

#: Places that the two halves of a saddle are counted from.
_SADDLE = np.deg2rad(47.0)


@dataclass(frozen=True, eq=False)
class PatternColumn:
    """One column: weight of the cosine and the sine of an order of the angle in every channel.

    Parameters
    ----------
    order : int
        Order of the carrier angle.
    cosine, sine : ndarray, shape (n_channels,)
        Weights.
    """

    order: int
    cosine: FloatArray
    sine: FloatArray


Columns = tuple[PatternColumn, ...]


def housing_columns(
    channels: Sequence[Channel], shapes: Sequence[FloatArray], order: int
) -> Columns:
    """Shapes that stay in the housing, at one order, both phases; axial and radial apart.

    Parameters
    ----------
    channels : sequence of Channel
        Channels.
    shapes : sequence of ndarray, shape (n_channels,)
        Values of each shape at the sensors.
    order : int
        Order at which the shape pulsates; 0 where it is static.
    """
    columns = []
    for own in _by_quantity(channels):
        for shape in shapes:
            still = np.zeros(len(channels))
            columns.append(PatternColumn(order, own * shape, still))
            if order:
                columns.append(PatternColumn(order, still, own * shape))
    return tuple(columns)


def carrier_columns(channels: Sequence[Channel], orders: Sequence[int]) -> Columns:
    """Waves of some orders that turn with the carrier; axial and radial sensors apart."""
    angle = _angles(channels)
    columns = []
    for own in _by_quantity(channels):
        for order in orders:
            c, s = own * np.cos(order * angle), own * np.sin(order * angle)
            # cos n(v - theta) and sin n(v - theta) in cosines and sines of n theta.
            columns.append(PatternColumn(order, c, s))
            columns.append(PatternColumn(order, s, -c))
    return tuple(columns)


def offset(channels: Sequence[Channel]) -> Columns:
    """Every sensor alike."""
    return housing_columns(channels, [np.ones(len(channels))], 0)


def tilt(channels: Sequence[Channel]) -> Columns:
    """Tilt of the housing at axial sensors, a shift at radial ones."""
    angle = _angles(channels)
    return housing_columns(channels, [np.cos(angle), np.sin(angle)], 0)


def saddle(channels: Sequence[Channel]) -> Columns:
    """Two waves around the housing."""
    angle = 2.0 * (_angles(channels) - _SADDLE)
    return housing_columns(channels, [np.cos(angle), np.sin(angle)], 0)


def planet_pass(channels: Sequence[Channel], n_planets: int) -> Columns:
    """Offset and tilt of the housing at the order at which planets pass."""
    angle = _angles(channels)
    shapes = [np.ones(angle.size), np.cos(angle), np.sin(angle)]
    return housing_columns(channels, shapes, n_planets)


def turning_tilt(channels: Sequence[Channel]) -> Columns:
    """One wave that turns with the carrier."""
    return carrier_columns(channels, [1])


def face_waves(channels: Sequence[Channel], n_planets: int) -> Columns:
    """Waves on the carrier's face, whatever their order."""
    return carrier_columns(channels, range(2, highest_order(n_planets) + 1))


def planet_waves(channels: Sequence[Channel], n_planets: int) -> Columns:
    """Waves that equal loads of all planets make: as many lobes as planets, and multiples."""
    return carrier_columns(channels, range(n_planets, highest_order(n_planets) + 1, n_planets))


def uneven_waves(channels: Sequence[Channel], n_planets: int) -> Columns:
    """Waves that unequal loads of the planets make: all that equal loads do not.

    Up to two beyond the second order of equal loads: higher ones of a pin's are small.
    """
    orders = [n for n in range(1, 2 * n_planets + 3) if n % n_planets]
    return carrier_columns(channels, orders)


def modulated_waves(channels: Sequence[Channel], n_planets: int) -> Columns:
    """Waves of planets whose loads change once a turn, at a phase fixed to the housing.

    A wave of h lobes from planets modulated once a turn shows at the orders ``h - 1`` or ``h + 1``
    that are multiples of the number of planets.
    """
    angle = _angles(channels)
    columns = []
    for own in _by_quantity(channels):
        for order in (0, n_planets, 2 * n_planets):
            for lobes in (order - 1, order + 1) if order else (1,):
                c, s = own * np.cos(lobes * angle), own * np.sin(lobes * angle)
                turns = float(order > 0)
                columns.append(PatternColumn(order, c, turns * s))
                columns.append(PatternColumn(order, s, -turns * c))
    return tuple(columns)


def _angles(channels: Sequence[Channel]) -> FloatArray:
    return np.array([channel.angle for channel in channels], dtype=np.float64)


def _by_quantity(channels: Sequence[Channel]) -> list[FloatArray]:
    """One for the channels of each quantity: its amplitudes are its own."""
    names = dict.fromkeys(channel.quantity for channel in channels)
    return [np.array([float(channel.quantity == name) for channel in channels]) for name in names]
