"""Sensor patterns of the rim.

Four axial sensors split into m = 0, +1, -1, 2, a radial pair into signed orders.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.order_analysis import PATTERNS, are_quarter_turns
from carrierflex.simulation.carrier.run_cases import AXIAL

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

PATTERN_NAMES = {0: "m=0", 1: "m=+1", -1: "m=-1", 2: "m=2"}
RADIAL = "radial"


@dataclass(frozen=True, eq=False)
class PatternSplit:
    """Split of the channels into patterns; n is the highest order.

    Parameters
    ----------
    names : tuple of str
        Patterns, or the names of channels that join none.
    amplitudes : ndarray of complex, shape (R, n_patterns, 2 n + 1)
        By revolution, at the orders -n to n; negative orders are zero but for a
        radial pair.
    weights, noise : ndarray, shape (n_patterns, 2 n + 1)
        Share of a squared amplitude in the mean square over all channels; mean square there of
        white noise of variance 1 over N samples a revolution, times N.
    members : tuple of tuple of int
        Channels of every pattern.
    """

    names: tuple[str, ...]
    amplitudes: ComplexArray
    weights: FloatArray
    noise: FloatArray
    members: tuple[tuple[int, ...], ...]


def pattern_split(channels: Sequence[Channel], orders: ComplexArray) -> PatternSplit:
    """Split order amplitudes into sensor patterns, signed orders of the radial pair, and the rest.

    Patterns are of four axial sensors 90 deg apart.

    Parameters
    ----------
    channels : sequence of Channel
        Channels.
    orders : ndarray of complex, shape (R, n_channels, n + 1)
        Order amplitudes, 0 to n.

    Returns
    -------
    PatternSplit
        Amplitudes by pattern.
    """
    axial = [c for c, channel in enumerate(channels) if channel.quantity == AXIAL]
    radial = [c for c in range(len(channels)) if c not in axial]
    angles = np.array([channel.angle for channel in channels], dtype=np.float64)
    names: list[str] = []
    rows, weights = [], []
    members: list[tuple[int, ...]] = []
    order = np.arange(orders.shape[-1])
    n_signed = 2 * order.size - 1
    plain = np.where(order == 0, 1.0, 0.5) / len(channels)
    of_noise = _one_sided(np.where(order == 0, 1.0, 2.0) / len(channels)).real
    if are_quarter_turns(angles[axial]):
        for m in PATTERNS:
            names.append(PATTERN_NAMES[m])
            members.append(tuple(axial))
            rows.append(
                _one_sided(
                    np.einsum("rcn,c->rn", orders[:, axial], np.exp(1j * m * angles[axial]) / 4.0)
                )
            )
            weights.append(_one_sided(4.0 * plain).real)
        axial = []
    if len(radial) == 2 and abs(np.sin(angles[radial[0]] - angles[radial[1]])) > 0.5:
        names.append(RADIAL)
        members.append(tuple(radial))
        rows.append(_signed_orders(orders[:, radial], angles[radial]))
        weights.append(np.full(n_signed, 1.0 / len(channels)))
        radial = []
    for c in (*axial, *radial):
        names.append(channels[c].name)
        members.append((c,))
        rows.append(_one_sided(orders[:, c]))
        weights.append(_one_sided(plain).real)
    noise = [
        np.full(n_signed, 2.0 / len(channels)) if name == RADIAL else of_noise for name in names
    ]
    return PatternSplit(
        tuple(names), np.stack(rows, axis=1), np.array(weights), np.array(noise), tuple(members)
    )


def _one_sided(values: NDArray[np.inexact]) -> ComplexArray:
    """Values of the orders from 0 on, with zeros at the negative ones before."""
    blank = np.zeros((*values.shape[:-1], values.shape[-1] - 1), dtype=np.complex128)
    return np.concatenate([blank, values], axis=-1)


def _signed_orders(orders: ComplexArray, angles: FloatArray) -> ComplexArray:
    """Forward (+n) and backward (-n) motion ``u = sum Z_n exp(j n theta)`` of a pair.

    The real part of u is along z, the imaginary part along -y.

    A sensor at v reads ``Re(u) cos v + Im(u) sin v``.
    """
    solved = np.einsum(
        "ij,rjn->rin", np.linalg.inv(np.column_stack([np.cos(angles), np.sin(angles)])), orders
    )
    forward = (solved[:, 0] + 1j * solved[:, 1]) / 2.0
    backward = np.conj(solved[:, 0] - 1j * solved[:, 1]) / 2.0
    highest = orders.shape[-1] - 1
    result = np.zeros((len(orders), 2 * highest + 1), dtype=np.complex128)
    result[:, highest:], result[:, :highest] = forward, backward[:, :0:-1]
    result[:, highest] = solved[:, 0, 0].real + 1j * solved[:, 1, 0].real
    return result
