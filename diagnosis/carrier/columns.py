"""Columns of the carrier's signals.

Every basis function an effect can ask for, at one sensor and one piece of record.

Effects that move a sensor or delay a signal are polynomials through the exact columns at a few
shifts: with nodes 3 deg (sensor, up to 6) and 6 deg (delay, up to 18) apart the interpolation
misses order 6 by less than half a per cent of its amplitude. A closing clearance is linear between
its nodes, as the law itself is wherever the torque stays off the node's cell.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.carrier.cards import NEGATIVE_CONTROLS
from carrierflex.diagnosis.carrier.laws import (
    CarrierInputs,
    CarrierRig,
    RimSensor,
    deflection,
)
from carrierflex.diagnosis.comparison.effect_cards import EffectCard
from carrierflex.simulation.carrier.effects import (
    closing_torque,
    load_shift_pattern,
    load_tilt_pattern,
    saturated_load,
)

FloatArray = NDArray[np.float64]

#: Shifts of a sensor [rad], and of the carrier angle behind a delay [rad], at which columns are
#: computed.
ANGLE_NODES = np.deg2rad([-6.0, -3.0, 0.0, 3.0, 6.0])
DELAY_NODES = np.deg2rad([-18.0, -12.0, -6.0, 0.0, 6.0, 12.0, 18.0])
#: Threshold torques over the nominal torque; saturating loads over the largest load.
TORQUE_NODES = np.linspace(0.0, 1.0, 11)
LOAD_NODES = np.geomspace(0.02, 4.0, 9)
#: Effects whose columns follow a moved sensor, and a delayed carrier angle.
MOVED = (
    "housing_tilt",
    "torque_tilt",
    "ntl_tilt",
    "carrier_tilt",
    "flexible_pins",
    "stiff_pins",
    "flange_warp",
)
DELAYED = ("carrier_tilt", "flexible_pins", "stiff_pins")
#: Orders of the flexible residual model; those up to the second number also with torque and radial
#: load.
_CEILING_ORDERS = 12
_LOADED_ORDERS = 8
_FORCED_ORDERS = 2

TARGET, PREDICTION, ONE, CEILING_COLUMN = "target", "prediction", "one", "ceiling"
Key = tuple[str, int, str, int]


@dataclass(frozen=True, eq=False)
class ColumnIndex:
    """Numbers of the columns.

    Parameters
    ----------
    places : mapping
        Place of each column by ``(effect, number of its parameter, node family, node)``.
    """

    places: Mapping[Key, int]

    def of(self, effect: str, number: int = 0, family: str = "", node: int = 0) -> int:
        """Place of one column."""
        return self.places[effect, number, family, node]

    def of_owner(self, effect: str) -> list[int]:
        """Places of all columns of one owner, in order."""
        return [place for key, place in self.places.items() if key[0] == effect]

    @property
    def size(self) -> int:
        """Number of columns."""
        return len(self.places)


@dataclass(frozen=True, eq=False)
class ColumnSource:
    """What columns are computed from.

    Parameters
    ----------
    rig : CarrierRig
        Rig and curves.
    cards : mapping of str to EffectCard
        All cards, contained effects and placebos among them.
    speed : float
        Typical speed of the carrier [rad/s].
    largest_load : float
        Largest radial load [N]; 1 where there is none.
    """

    rig: CarrierRig
    cards: Mapping[str, EffectCard]
    speed: float
    largest_load: float

    def rows(
        self, sensor: RimSensor, inputs: CarrierInputs, shifts: Sequence[CarrierInputs]
    ) -> dict[Key, FloatArray]:
        """All columns but target and prediction, by key.

        `shifts` are the inputs at the nodes of the delay.
        """
        rows: dict[Key, FloatArray] = {(ONE, 0, "", 0): np.ones(inputs.time.size)}
        for name, card in self.cards.items():
            if card.law is None:
                continue
            rows.update(_keyed(name, "", 0, card.law(sensor, inputs, self.rig)))
            if name in MOVED:
                for node in np.flatnonzero(ANGLE_NODES).tolist():
                    moved = replace(sensor, angle=sensor.angle + ANGLE_NODES[node])
                    rows.update(_keyed(name, "angle", node, card.law(moved, inputs, self.rig)))
            if name in DELAYED:
                for node in np.flatnonzero(DELAY_NODES).tolist():
                    rows.update(
                        _keyed(name, "delay", node, card.law(sensor, shifts[node], self.rig))
                    )
        rows.update(self._clearance_rows(sensor, inputs))
        rows.update(_keyed(CEILING_COLUMN, "", 0, self._flexible_rows(inputs)))
        return rows

    def _clearance_rows(self, sensor: RimSensor, inputs: CarrierInputs) -> dict[Key, FloatArray]:
        rows: dict[Key, FloatArray] = {}
        for node, share in enumerate(TORQUE_NODES):
            torque = closing_torque(inputs.torque, share * self.rig.nominal_torque)
            stiff, flexible = (
                deflection(c, sensor, inputs, self.rig, torque) for c in ("delta_s", "delta_f")
            )
            rows["pin_clearance", 0, "threshold", node] = stiff - flexible
        for node, share in enumerate(LOAD_NODES):
            load = saturated_load(inputs.ntl_y, inputs.ntl_z, share * self.largest_load)
            tilt = load_tilt_pattern(sensor.angle, sensor.radius, *load)
            shift = load_shift_pattern(sensor.angle, *load)
            rows["bearing_clearance", 0, "threshold", node] = sensor.is_axial * tilt
            rows["bearing_clearance", 1, "threshold", node] = (not sensor.is_axial) * shift
        return rows

    def _flexible_rows(self, inputs: CarrierInputs) -> FloatArray:
        torque = inputs.torque / self.rig.nominal_torque
        forces = [inputs.ntl_y / self.largest_load, inputs.ntl_z / self.largest_load]
        u = (2.0 * inputs.time - inputs.start - inputs.end) / max(
            inputs.end - inputs.start, np.finfo(float).tiny
        )
        rows = [u, u**2]
        for order in range(_CEILING_ORDERS + 1):
            waves = [np.cos(order * inputs.carrier_angle), np.sin(order * inputs.carrier_angle)][
                : 2 if order else 1
            ]
            loads = [np.ones_like(torque)]
            loads += [torque] * (order <= _LOADED_ORDERS) + forces * (order <= _FORCED_ORDERS)
            rows += [wave * load for wave in waves for load in loads]
        return np.array(rows)


def shape_nodes(effect: str, source: ColumnSource) -> FloatArray:
    """Nodes of an effect's threshold, in its unit."""
    if effect == "pin_clearance":
        return TORQUE_NODES * source.rig.nominal_torque
    return LOAD_NODES * source.largest_load


def all_cards(cards: Mapping[str, EffectCard]) -> dict[str, EffectCard]:
    """Cards of the library and the placebos, by id."""
    return {**cards, **{card.id: card for card in NEGATIVE_CONTROLS}}


def _keyed(effect: str, family: str, node: int, rows: FloatArray) -> dict[Key, FloatArray]:
    return {(effect, number, family, node): row for number, row in enumerate(rows)}
