"""Numbers of the files that are written, each with where it comes from.

A number is taken from the REXS file, derived from numbers of the file, or a default: that of the
shipped gearbox, scaled to the centre distance by geometric similarity in the same material. With
the ratio ``s`` of the centre distances, lengths go with s, stiffnesses with s (N/m) and s^3
(N m/rad), masses and torques with s^3, inertias with s^5, dampings with s^2 and s^4.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Annotated, Literal

from carrierflex.geometry.main_shaft_parameters import MainShaftParameters
from carrierflex.geometry.parameters import CarrierParameters, GearData, PinParameters
from carrierflex.simulation.rexs.planetary_stage import PlanetaryStage
from carrierflex.simulation.rexs.rexs_model import Component
from carrierflex.simulation.stage.stage_data import StageData

#: Power of the scale by the unit of a quantity.
_POWERS = {
    "m": 1,
    "N/m": 1,
    "N s/m": 2,
    "kg": 3,
    "N m": 3,
    "N m/rad": 3,
    "N m s": 4,
    "kg m^2": 5,
}
#: Stiffness over the default one from which a connection counts as rigid: more digits than that
#: are lost in sums with the stiffness of teeth and bodies.
RIGID = 1e3

How = Literal["file", "derived", "default"]


@dataclass(frozen=True)
class Value:
    """A number of the files that are written, and where it comes from."""

    table: Annotated[str, "Table of the file; empty for keys at its top"]
    key: Annotated[str, "Key of the table"]
    number: Annotated[float | int, "Number in SI units"]
    how: Annotated[How, "From the file, derived from numbers of the file, or a default"]
    source: Annotated[str, "Component and attribute, or the rule"]
    unit: Annotated[str, "SI unit; empty for pure numbers"] = ""


def shipped_tables() -> dict[str, object]:
    """Tables of the shipped gearbox by name."""
    data = StageData()
    names = ("mesh", "bearings", "chain", "mounting", "housing")
    return {
        "carrier": CarrierParameters(),
        "pin": PinParameters(),
        "gear": GearData(),
        "main_shaft": MainShaftParameters(),
        **{name: getattr(data, name) for name in names},
    }


class Numbers:
    """Values as they are collected, looked up by table and key; the first of a key counts.

    Parameters
    ----------
    stage : PlanetaryStage
        Components of the stage.
    scale : float
        Centre distance over that of the shipped gearbox.
    unit_of : callable
        SI unit of a key by its table and name; empty for pure numbers.
    """

    def __init__(
        self, stage: PlanetaryStage, scale: float, unit_of: Callable[[str, str], str]
    ) -> None:
        self.stage, self.model, self.scale = stage, stage.model, scale
        self.values: dict[tuple[str, str], Value] = {}
        self.notes: list[str] = []
        self._unit_of = unit_of
        self._shipped: Mapping[str, object] = shipped_tables()

    def __getitem__(self, item: tuple[str, str]) -> float:
        return self.values[item].number

    def __contains__(self, item: object) -> bool:
        return item in self.values

    def put(self, table: str, key: str, number: float, how: How, source: str) -> None:
        """Keep a value, unless there is one; twelve digits."""
        rounded = number if isinstance(number, int) else float(f"{number:.12g}")
        unit = self._unit_of(table, key)
        self.values.setdefault((table, key), Value(table, key, rounded, how, source, unit))

    def take(
        self,
        table: str,
        key: str,
        component: Component | None,
        *attributes: str,
        times: float = 1.0,
    ) -> None:
        """Take the first of some attributes that the file states."""
        for attribute in attributes:
            number = self.model.number(component, attribute)
            if number is not None:
                factor = "" if times == 1.0 else f" x {times:g}"
                self.put(table, key, number * times, "file", f"{component} {attribute}{factor}")
                return

    def take_stiffness(
        self, table: str, key: str, stiffness: float, shipped: float, source: str
    ) -> None:
        """Keep a stiffness; one that is rigid beside teeth and bodies as what counts as that.

        `shipped` is one of the shipped gearbox, in the unit of the key.
        """
        most = RIGID * shipped * self.scale ** _POWERS[self._unit_of(table, key)]
        if stiffness > most:
            source += f" {stiffness:.3g}: rigid, taken as {most:.3g}"
        self.put(table, key, min(stiffness, most), "file", source)

    def scaled(self, table: str, key: str, number: float) -> tuple[float, str]:
        """A number of the shipped gearbox at this size, and the rule in words."""
        power = _POWERS.get(self._unit_of(table, key), 0)
        if power == 0 or number == 0.0 or self.scale == 1.0:
            return number, f"default {number:g}"
        at_size = number * self.scale**power
        words = f" x {self.scale:.4g}" + (f"^{power}" if power > 1 else "")
        return at_size, f"default {number:g}{words}"

    def default(self, table: str, key: str) -> None:
        """Keep the scaled default of a key, unless there is a value."""
        self.put(table, key, *self._default(table, key))

    def rest(self, table: str) -> None:
        """Keep the scaled defaults of a table's numbers that have no value."""
        for entry in fields(self._shipped[table]):  # type: ignore[arg-type]
            number = getattr(self._shipped[table], entry.name)
            if isinstance(number, int | float) and not isinstance(number, bool):
                self.default(table, entry.name)

    def _default(self, table: str, key: str) -> tuple[float, How, str]:
        number, rule = self.scaled(table, key, getattr(self._shipped[table], key))
        return number, "default", rule

    def of_tables(self, tables: Sequence[str]) -> tuple[Value, ...]:
        """Values by table, in the order of the tables."""
        return tuple(
            value for table in tables for value in self.values.values() if value.table == table
        )
