"""What a REXS file holds: components with attributes, the relations that join them, load cases."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from carrierflex.files.shown_values import shown
from carrierflex.simulation.rexs.rexs_units import factor_to_si

#: Words for yes and no.
_TRUE, _FALSE = ("true", "1"), ("false", "0")
#: Sizes of numbers other than zero that are taken, in SI units.
_SMALLEST, _LARGEST = 1e-40, 1e40


class Attribute(NamedTuple):
    """Value and unit as they stand in the file."""

    value: object
    unit: str | None


@dataclass(frozen=True, eq=False)
class Component:
    """A machine element."""

    id: int
    type: str
    name: str
    attributes: Mapping[str, Attribute]

    def __str__(self) -> str:
        return f"{self.type} {self.id}"


class Relation(NamedTuple):
    """Components that belong together, by role."""

    type: str
    roles: Mapping[str, int]


@dataclass(frozen=True, eq=False)
class LoadCase:
    """Attributes of components that one load case states."""

    id: int
    attributes: Mapping[int, Mapping[str, Attribute]]


@dataclass(frozen=True, eq=False)
class RexsModel:
    """A gearbox as the file states it.

    Parameters
    ----------
    path : Path
        File.
    version, application : str
        Version of REXS; program that wrote the file.
    components : mapping of int to Component
        By id.
    relations : tuple of Relation
        Relations.
    load_cases : tuple of LoadCase
        Of the load spectrum.
    """

    path: Path
    version: str
    application: str
    components: Mapping[int, Component]
    relations: tuple[Relation, ...]
    load_cases: tuple[LoadCase, ...]

    def of_type(self, *types: str) -> list[Component]:
        """Components of some types."""
        return [each for each in self.components.values() if each.type in types]

    def related(
        self, relation: str, role: str, component: Component, other: str
    ) -> Iterator[Component]:
        """Components in the role `other` of relations in which a component has the role `role`."""
        for each in self.relations:
            if each.type == relation and each.roles.get(role) == component.id:
                if other in each.roles:
                    yield self.components[each.roles[other]]

    def parts_of(self, assembly: Component, *types: str) -> list[Component]:
        """Components that belong to an assembly."""
        members = (
            member
            for relation in ("assembly", "ordered_assembly")
            for member in self.related(relation, "assembly", assembly, "part")
        )
        # A component may stand in several relations with the same assembly.
        return list({each.id: each for each in members if each.type in types}.values())

    def assembly_of(self, member: Component, *types: str) -> Component | None:
        """First assembly of some types that a component belongs to."""
        for relation in ("assembly", "ordered_assembly"):
            for each in self.related(relation, "part", member, "assembly"):
                if each.type in types:
                    return each
        return None

    def number(
        self, component: Component | None, attribute: str, case: LoadCase | None = None
    ) -> float | None:
        """A number in SI; None where the file states none.

        Parameters
        ----------
        component : Component or None
            Component; None has no attribute.
        attribute : str
            Id.
        case : LoadCase, optional
            Load case whose value comes before that of the component.

        Raises
        ------
        ValueError
            Where the value is no number of 1e-40 to 1e40 in SI units or 0, or its unit is unknown
            or of another dimension.
        """
        entry = self._attribute(component, attribute, case)
        if component is None or entry is None:
            return None
        return self._si(component, attribute, entry.value, entry.unit)

    def vector(self, component: Component, attribute: str) -> tuple[float, float, float] | None:
        """Three numbers in SI; None where the file states none.

        Raises
        ------
        ValueError
            As :meth:`number`, and where they are not three.
        """
        entry = self._attribute(component, attribute, None)
        if entry is None:
            return None
        values = entry.value
        if not isinstance(values, (list, tuple)) or len(values) != 3:
            raise ValueError(
                f"{self.path}: {component}: {attribute} is {shown(values)}; expected three numbers"
            )
        u, v, w = (self._si(component, attribute, value, entry.unit) for value in values)
        return u, v, w

    def text(self, component: Component | None, attribute: str) -> str:
        """A text or a choice; empty where the file states none."""
        entry = self._attribute(component, attribute, None)
        return "" if entry is None else str(entry.value).strip()

    def flag(self, component: Component | None, attribute: str) -> bool | None:
        """A yes or no; None where the file states none, or something else."""
        word = self.text(component, attribute).lower()
        return True if word in _TRUE else False if word in _FALSE else None

    def _attribute(
        self, component: Component | None, attribute: str, case: LoadCase | None
    ) -> Attribute | None:
        if component is None:
            return None
        stated = case.attributes.get(component.id, {}) if case is not None else {}
        entry = stated.get(attribute) or component.attributes.get(attribute)
        # Programs write attributes without a value.
        return None if entry is None or entry.value is None or entry.value == "" else entry

    def _si(self, component: Component, attribute: str, value: object, unit: str | None) -> float:
        try:
            factor = factor_to_si(attribute, unit)
        except ValueError as error:
            raise ValueError(f"{self.path}: {component}: {error}") from error
        try:
            number = math.nan if isinstance(value, bool) else float(value)  # type: ignore[arg-type]
        except (TypeError, ValueError, OverflowError):
            number = math.nan
        # Neither a power of it nor the length of a vector overflows or vanishes.
        if number != 0.0 and not _SMALLEST <= abs(number * factor) <= _LARGEST:
            raise ValueError(
                f"{self.path}: {component}: {attribute} is {shown(value)}; expected a "
                "number, of 1e-40 to 1e40 in SI units or 0"
            )
        # Twelve digits: the same value in another unit is the same number.
        return float(f"{number * factor:.12g}")
