"""The carrier's signals as weights of columns, with derivatives.

Linear effects, thresholds, and effects of a sensor in full.

The reading of channel c is ``(1 + g_c) (prediction + sum_k w_k X_k(v + dv_c, theta(t - tau))) +
z_c``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.carrier.cards import ONE_CHANNEL, PER_RUN
from carrierflex.diagnosis.carrier.columns import (
    ANGLE_NODES,
    DELAY_NODES,
    DELAYED,
    MOVED,
    ONE,
    PREDICTION,
    ColumnIndex,
    ColumnSource,
    shape_nodes,
)
from carrierflex.diagnosis.comparison.effect_cards import EffectCard
from carrierflex.diagnosis.comparison.problem import Effects, Parameter

FloatArray = NDArray[np.float64]
#: Channel of every effect of one sensor.
Choice = Mapping[str, int]
#: Prior of a candidate's parameter, in its scales.
_PRIOR = 30.0
#: Largest delay, as an angle [rad]: where the columns at the nodes still carry.
_LARGEST_DELAY = np.deg2rad(20.0)
_LARGEST_MOVE = np.deg2rad(7.0)


@dataclass(frozen=True, eq=False)
class CarrierModel:
    """Parameters and weights of any set of effects.

    Parameters
    ----------
    source : ColumnSource
        Columns, with all cards.
    book : ColumnIndex
        Their numbers.
    contained : tuple of str
        Effects of the baseline.
    runs, channels : tuple of str
        Names.
    """

    source: ColumnSource
    book: ColumnIndex
    contained: Effects
    runs: tuple[str, ...]
    channels: tuple[str, ...]

    @property
    def cards(self) -> Mapping[str, EffectCard]:
        """All cards."""
        return self.source.cards

    def parameters(self, effects: Effects, choice: Choice) -> tuple[Parameter, ...]:
        """Unknowns of baseline + effects, runs' own run by run."""
        found: list[Parameter] = []
        for effect in (*self.contained, *effects):
            for run in self.runs if effect in PER_RUN else (None,):
                found += self._own_parameters(effect, run, choice)
        return tuple(found)

    def _own_parameters(self, effect: str, run: str | None, choice: Choice) -> list[Parameter]:
        own = []
        for parameter in self.cards[effect].parameters:
            lower, upper = self._bounds(effect, parameter.name, (parameter.lower, parameter.upper))
            name = (
                f"{parameter.name}_{self.channels[choice[effect]]}"
                if effect in choice
                else parameter.name
            )
            prior = (
                np.inf if parameter.shape or effect in self.contained else _PRIOR * parameter.scale
            )
            own.append(
                Parameter(
                    effect,
                    name,
                    parameter.unit,
                    lower,
                    upper,
                    parameter.scale,
                    prior,
                    run,
                    parameter.shape,
                )
            )
        return own

    def _bounds(self, effect: str, name: str, given: tuple[float, float]) -> tuple[float, float]:
        if name in ("T_c", "F_s"):
            nodes = shape_nodes(effect, self.source)
            return float(nodes[0]), float(nodes[-1])
        if effect == "sensor_delay":
            return -_LARGEST_DELAY / self.source.speed, _LARGEST_DELAY / self.source.speed
        return (-_LARGEST_MOVE, _LARGEST_MOVE) if effect == "sensor_angle" else given

    def weights(
        self, effects: Effects, choice: Choice, theta: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Weights of the columns and their derivatives.

        Parameters
        ----------
        effects : tuple of str
            Effects beside the baseline.
        choice : mapping of str to int
            Channel of every effect of one sensor among all effects.
        theta : ndarray, shape (p,)
            Parameters.

        Returns
        -------
        tuple of ndarray
            Shapes (n_runs, n_channels, k) and (n_runs, n_channels, p, k).
        """
        shape = (len(self.runs), len(self.channels))
        W, D = np.zeros((*shape, self.book.size)), np.zeros((*shape, theta.size, self.book.size))
        if (PREDICTION, 0, "", 0) in self.book.places:
            W[..., self.book.of(PREDICTION)] = 1.0
        first: dict[str, int] = {}
        place = 0
        for effect in (*self.contained, *effects):
            first[effect] = place
            n = len(self.cards[effect].parameters)
            runs: Sequence[slice] = [slice(None)]
            if effect in PER_RUN:
                runs = [slice(r, r + 1) for r in range(len(self.runs))]
            for run in runs:
                self._add_own(effect, W[run], D[run], theta, place)
                place += n
        self._add_sensors(effects, choice, theta, first, W, D)
        return W, D

    def _add_own(
        self, effect: str, W: FloatArray, D: FloatArray, theta: FloatArray, place: int
    ) -> None:
        """Add a linear effect, or one with a threshold, whose parameters start at `place`."""
        parameters = self.cards[effect].parameters
        if self.cards[effect].law is not None:
            for number in range(len(parameters)):
                column = self.book.of(effect, number)
                W[..., column], D[..., place + number, column] = theta[place + number], 1.0
        elif parameters[-1].shape:
            nodes, last = shape_nodes(effect, self.source), place + len(parameters) - 1
            hat, slope = _hats(nodes, float(theta[last]))
            for number in range(len(parameters) - 1):
                columns = [
                    self.book.of(effect, number, "threshold", node) for node in range(nodes.size)
                ]
                W[..., columns] = theta[place + number] * hat
                D[..., place + number, columns] = hat
                D[..., last, columns] = theta[place + number] * slope

    def _add_sensors(
        self,
        effects: Effects,
        choice: Choice,
        theta: FloatArray,
        first: Mapping[str, int],
        W: FloatArray,
        D: FloatArray,
    ) -> None:
        """Add delay and moved sensor, then gain, then zero."""
        W0, D0 = W.copy(), D.copy()
        for effect, family, nodes in (
            ("sensor_delay", "delay", DELAY_NODES),
            ("sensor_angle", "angle", ANGLE_NODES),
        ):
            if effect not in first:
                continue
            i = first[effect]
            size = self.source.speed if family == "delay" else 1.0
            where = (
                np.arange(len(self.channels)) if family == "delay" else np.array([choice[effect]])
            )
            plain = {own for own in (*self.contained, *effects)}
            for base, columns, own_nodes in self._shifted(plain, family, nodes):
                values, slopes = _lagrange(own_nodes, float(theta[i]) * size)
                values[own_nodes == 0.0] -= 1.0
                for column, value, slope in zip(columns, values, slopes * size, strict=True):
                    W[:, where, column] += value * W0[:, where, base]
                    D[:, where, :, column] += value * D0[:, where, :, base]
                    D[:, where, i, column] += slope * W0[:, where, base]
        if "sensor_gain" in first:
            c, i = choice["sensor_gain"], first["sensor_gain"]
            D[:, c] *= 1.0 + theta[i]
            D[:, c, i] = W[:, c]
            W[:, c] *= 1.0 + theta[i]
        if "sensor_zero" in first:
            c, i, one = choice["sensor_zero"], first["sensor_zero"], self.book.of(ONE)
            W[:, c, one] += theta[i]
            D[:, c, i, one] += 1.0

    def _shifted(
        self, present: set[str], family: str, nodes: FloatArray
    ) -> list[tuple[int, list[int], FloatArray]]:
        """Columns that follow a shift.

        Their own place, their places at the nodes, and the nodes.
        """
        found = []
        followers = DELAYED if family == "delay" else MOVED
        for effect in followers:
            for number in range(len(self.cards[effect].parameters) if effect in present else 0):
                columns = [self._node(effect, number, family, n, nodes) for n in range(nodes.size)]
                found.append((self.book.of(effect, number), columns, nodes))
        if (PREDICTION, 0, "", 0) in self.book.places:
            columns = [
                self._node(PREDICTION, 0, "delay", n, DELAY_NODES) for n in range(DELAY_NODES.size)
            ]
            found.append((self.book.of(PREDICTION), columns, DELAY_NODES))
        return found

    def _node(self, effect: str, number: int, family: str, node: int, nodes: FloatArray) -> int:
        return (
            self.book.of(effect, number)
            if nodes[node] == 0.0
            else self.book.of(effect, number, family, node)
        )

    def variants(self, effect: str) -> list[tuple[float, ...]]:
        """Channels of an effect of one sensor, or thresholds, among which a fit starts.

        One empty variant otherwise.
        """
        if effect in ONE_CHANNEL:
            return [(float(c),) for c in range(len(self.channels))]
        if self.cards[effect].parameters[-1].shape:
            return [(float(node),) for node in shape_nodes(effect, self.source)[:-1]]
        return [()]


def _hats(nodes: FloatArray, value: float) -> tuple[FloatArray, FloatArray]:
    """Piecewise linear interpolation: weights of the nodes at a value, and their derivatives."""
    cell = int(np.clip(np.searchsorted(nodes, value) - 1, 0, nodes.size - 2))
    width = nodes[cell + 1] - nodes[cell]
    hat, slope = np.zeros(nodes.size), np.zeros(nodes.size)
    hat[cell], hat[cell + 1] = (nodes[cell + 1] - value) / width, (value - nodes[cell]) / width
    slope[cell], slope[cell + 1] = -1.0 / width, 1.0 / width
    return hat, slope


def _lagrange(nodes: FloatArray, value: float) -> tuple[FloatArray, FloatArray]:
    """Interpolation through all nodes: weights of the nodes at a value, and their derivatives."""
    polynomials, slopes = _node_polynomials(tuple(nodes.tolist()))
    powers = value ** np.arange(nodes.size)
    return polynomials @ powers, slopes @ powers[:-1]


@lru_cache(maxsize=8)
def _node_polynomials(nodes: tuple[float, ...]) -> tuple[FloatArray, FloatArray]:
    """Coefficients, lowest power first, of the polynomials that are one at one node and zero at the others; derivatives."""
    places = np.array(nodes)
    rows = []
    for k in range(places.size):
        others = np.delete(places, k)
        rows.append(np.poly(others)[::-1] / np.prod(places[k] - others))
    polynomials = np.array(rows)
    return polynomials, polynomials[:, 1:] * np.arange(1, places.size)
