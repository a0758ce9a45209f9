"""Columns of the carrier's signals.

Every basis function an effect can ask for, at one sensor and one segment of record.

Effects that move a sensor or delay a signal are polynomials through the exact columns at a few
shifts: with nodes 3 deg (sensor, up to 6) and 6 deg (delay, up to 18) apart the interpolation
misses order 6, the second of three planets, by less than half a per cent of its amplitude. More
planets have as many more nodes. A shape is linear between its nodes; of several shapes, each has a
part of the signal to itself.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.order_analysis import highest_order
from carrierflex.simulation.carrier.effect import Effect, Pattern
from carrierflex.simulation.carrier.rim import CarrierInputs, CarrierRig, RimSensor

FloatArray = NDArray[np.float64]

#: Largest shift of a sensor, and of the angle behind a delay, at which columns are computed.
_FARTHEST_MOVE_DEG, _FARTHEST_DELAY_DEG = 6.0, 18.0
#: Values between the bounds of a shape that names no nodes.
_SHAPE_NODES = 11
#: Orders of the flexible residual model up to which it follows the radial load.
_FORCED_ORDERS = 2

TARGET = "target"
PREDICTION = "prediction"
ONE = "one"
#: Families of nodes; plain columns have none.
PLAIN = ""
SHAPE = "threshold"
ANGLE = "angle"
DELAY = "delay"
Key = tuple[str, int, str, int]
#: Loads by which a wave of the flexible model is multiplied.
CONSTANT = "1"
TORQUE = "torque"
FORCE_Y = "ntl_y"
FORCE_Z = "ntl_z"


@dataclass(frozen=True)
class FlexibleTerm:
    """One column of the flexible residual model: cosine or sine of an order, times a load.

    Torque is over the nominal torque, radial loads over the largest radial load.
    """

    order: int
    is_sine: bool
    load: str


@dataclass(frozen=True, eq=False)
class ColumnIndex:
    """Numbers of the columns.

    Parameters
    ----------
    numbers : mapping
        Number of each column by ``(effect, number of its parameter, node family, node)``.
    """

    numbers: Mapping[Key, int]

    def of(self, effect: str, parameter: int = 0, family: str = PLAIN, node: int = 0) -> int:
        """Number of one column."""
        return self.numbers[effect, parameter, family, node]

    @property
    def has_prediction(self) -> bool:
        """Whether the record holds another simulator's prediction."""
        return (PREDICTION, 0, PLAIN, 0) in self.numbers

    @property
    def size(self) -> int:
        """Number of columns."""
        return len(self.numbers)


@dataclass(frozen=True, eq=False)
class ColumnSource:
    """What columns are computed from.

    Parameters
    ----------
    rig : CarrierRig
        Rig and curves.
    effects : mapping of str to Effect
        All effects, contained ones among them.
    speed : float
        Typical speed of the carrier [rad/s].
    largest_load : float
        Largest radial load [N]; 1 where there is none.
    """

    rig: CarrierRig
    effects: Mapping[str, Effect]
    speed: float
    largest_load: float

    def rows(
        self,
        sensor: RimSensor,
        inputs: CarrierInputs,
        delayed: Sequence[CarrierInputs],
        owners: Collection[str] | None = None,
    ) -> dict[Key, FloatArray]:
        """Columns of effects, by key.

        Parameters
        ----------
        sensor : RimSensor
            Sensor.
        inputs : CarrierInputs
            Inputs of n samples.
        delayed : sequence of CarrierInputs
            The same inputs at the nodes of the delay.
        owners : collection of str, optional
            Effects whose columns are wanted; all without.

        Returns
        -------
        dict of tuple to ndarray, shape (n,)
            Columns [m per unit of the parameter].
        """
        rows: dict[Key, FloatArray] = {(ONE, 0, PLAIN, 0): np.ones(inputs.time.size)}
        for effect in self.effects.values():
            if effect.pattern is None or (owners is not None and effect.id not in owners):
                continue
            if effect.n_shapes:
                nodes = self.shape_nodes(effect).tolist()
                for node, (part, value) in enumerate(product(_parts_of(effect), nodes)):
                    signals = part(sensor, inputs, self.rig, value)
                    rows.update(_keyed(effect.id, SHAPE, node, signals))
                continue
            rows.update(_keyed(effect.id, PLAIN, 0, effect.signals(sensor, inputs, self.rig)))
            if effect.follows_sensor:
                moves = angle_nodes(self.rig.n_planets)
                for node in np.flatnonzero(moves).tolist():
                    moved = replace(sensor, angle=sensor.angle + moves[node])
                    signals = effect.signals(moved, inputs, self.rig)
                    rows.update(_keyed(effect.id, ANGLE, node, signals))
            if effect.follows_delay:
                for node in np.flatnonzero(delay_nodes(self.rig.n_planets)).tolist():
                    signals = effect.signals(sensor, delayed[node], self.rig)
                    rows.update(_keyed(effect.id, DELAY, node, signals))
        return rows

    def shape_nodes(self, effect: Effect) -> FloatArray:
        """Values between which an effect's signals are interpolated, of each of its shapes."""
        if effect.shape_nodes is not None:
            return effect.shape_nodes(self.rig, self.largest_load)
        shape = effect.parameters[-1]
        return np.linspace(shape.lower, shape.upper, _SHAPE_NODES)

    @property
    def n_flexible(self) -> int:
        """Number of features of the flexible residual model."""
        one = np.zeros(1)
        return len(self.flexible_rows(CarrierInputs(one, one, one, one, one, 0.0, 0.0)))

    def flexible_rows(self, inputs: CarrierInputs) -> FloatArray:
        """Features of the flexible residual model, the same at every sensor, shape (k, n)."""
        torque = inputs.torque / self.rig.nominal_torque
        forces = [inputs.ntl_y / self.largest_load, inputs.ntl_z / self.largest_load]
        u = (2.0 * inputs.time - inputs.start - inputs.end) / max(
            inputs.end - inputs.start, np.finfo(float).tiny
        )
        quantity = {CONSTANT: np.ones_like(torque), TORQUE: torque}
        quantity |= dict(zip((FORCE_Y, FORCE_Z), forces, strict=True))
        terms = flexible_terms(self.rig.n_planets)
        waves = {
            (order, is_sine): (np.sin if is_sine else np.cos)(order * inputs.carrier_angle)
            for order, is_sine in {(term.order, term.is_sine): None for term in terms}
        }
        rows = [u, u**2]
        rows += [waves[term.order, term.is_sine] * quantity[term.load] for term in terms]
        return np.array(rows)


def angle_nodes(n_planets: int) -> FloatArray:
    """Shifts of a sensor at which columns are computed [rad]: five of three planets."""
    n_nodes = 2 * (-(-2 * n_planets // 3)) + 1
    return np.deg2rad(np.linspace(-_FARTHEST_MOVE_DEG, _FARTHEST_MOVE_DEG, n_nodes))


def delay_nodes(n_planets: int) -> FloatArray:
    """Shifts of the angle behind a delay at which columns are computed [rad]: 7 of 3 planets."""
    n_nodes = 2 * n_planets + 1
    return np.deg2rad(np.linspace(-_FARTHEST_DELAY_DEG, _FARTHEST_DELAY_DEG, n_nodes))


@lru_cache
def flexible_terms(n_planets: int) -> tuple[FlexibleTerm, ...]:
    """Columns of the flexible residual model after its two of time, in their order.

    Every order that is kept, those up to two beyond the pins' second one also times the torque.
    """
    terms = []
    for order in range(highest_order(n_planets) + 1):
        loads = [CONSTANT]
        if order <= 2 * n_planets + 2:
            loads.append(TORQUE)
        if order <= _FORCED_ORDERS:
            loads += [FORCE_Y, FORCE_Z]
        waves = (False, True) if order else (False,)
        terms += [FlexibleTerm(order, is_sine, load) for is_sine in waves for load in loads]
    return tuple(terms)


def _parts_of(effect: Effect) -> tuple[Pattern, ...]:
    """Patterns of one shape each: an effect with one shape is its only part."""
    return effect.shape_parts or (effect.signals,)


#: Columns of time before those of the flexible residual model: u and u squared.
N_TIME_COLUMNS = 2


def _keyed(effect: str, family: str, node: int, rows: FloatArray) -> dict[Key, FloatArray]:
    return {(effect, number, family, node): row for number, row in enumerate(rows)}


def typical_speed(campaign: Campaign) -> float:
    """Typical speed of the carrier [rad/s]."""
    turned = [
        abs(float(run.inputs["carrier_angle"][-1] - run.inputs["carrier_angle"][0]))
        for run in campaign.runs
    ]
    lasted = [float(run.time[-1] - run.time[0]) for run in campaign.runs]
    return max(sum(turned) / max(sum(lasted), np.finfo(float).tiny), np.finfo(float).tiny)


def largest_load(campaign: Campaign) -> float:
    """Largest radial load [N]; 1 where there is none."""
    if "ntl_y" not in campaign.contract.inputs:
        return 1.0
    largest = max(
        float(np.hypot(run.inputs["ntl_y"], run.inputs["ntl_z"]).max()) for run in campaign.runs
    )
    return largest or 1.0
