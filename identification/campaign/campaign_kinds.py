"""What each kind of measurement campaign holds: inputs, quantities, units and effect ids.

Data only, after the file contract (docs/campaign_format.md). The keys of the file, those
of the rig among them, are stated in :mod:`carrierflex.identification.campaign.campaign_tables`.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from carrierflex.geometry.parameters import FEWEST_PLANETS, MOST_PLANETS
from carrierflex.simulation.carrier.effect import Effect
from carrierflex.simulation.carrier.effects.library import CARRIER_EFFECTS
from carrierflex.simulation.carrier.effects.of_planets import effects_of
from carrierflex.simulation.effect_parameters import published_names
from carrierflex.simulation.element.effects import ELEMENT_EFFECTS
from carrierflex.simulation.force_effect import ForceEffect
from carrierflex.simulation.mounting.effects import MOUNTING_EFFECTS

#: Units of a declared element quantity that are SI multiples or foreign units of length and force;
#: a voltage analogue may use any other unit.
NOT_SI_UNITS = ("mm", "um", "µm", "cm", "km", "in", "inch", "mil", "kN", "MN", "mN", "lbf", "kgf")


@dataclass(frozen=True, eq=False)
class CampaignKind:
    """The contract of one kind of campaign.

    Parameters
    ----------
    name : str
        ``carrier``, ``mounting`` or ``element``.
    inputs : mapping of str to str
        Input columns and their units, besides ``time`` [s].
    quantities : mapping of str to str
        Quantities a channel may measure and their units.
    effects : tuple of str
        Effect ids.
    parameters : mapping of str to tuple of str
        Published names of the parameters by effect; those of ``baseline`` are its own.
    partners : mapping of (str, str) to str
        Angle of a size and size of an angle, by effect and parameter: together they are a vector.
    any_unit : bool
        Whether a channel may declare another unit than that of its quantity (voltage analogue).
    """

    name: str
    inputs: Mapping[str, str]
    quantities: Mapping[str, str]
    effects: tuple[str, ...] = ()
    parameters: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    partners: Mapping[tuple[str, str], str] = field(default_factory=dict)
    any_unit: bool = False


def _published(
    effects: Mapping[str, Effect] | Mapping[str, ForceEffect],
) -> dict[str, tuple[str, ...]]:
    """Published names of the parameters of every effect."""
    return {
        name: tuple(
            dict.fromkeys(
                published
                for parameter in effect.parameters
                for published in published_names(parameter)
            )
        )
        for name, effect in effects.items()
    }


def _partners(
    effects: Mapping[str, Effect] | Mapping[str, ForceEffect],
) -> dict[tuple[str, str], str]:
    """Other half of every vector of the effects."""
    partners: dict[tuple[str, str], str] = {}
    for name, effect in effects.items():
        for parameter in effect.parameters:
            if parameter.pair is not None:
                partners[name, parameter.pair.size] = parameter.pair.angle
                partners[name, parameter.pair.angle] = parameter.pair.size
    return partners


CARRIER = CampaignKind(
    name="carrier",
    inputs={"carrier_angle": "rad", "torque": "N m", "ntl_y": "N", "ntl_z": "N"},
    quantities={"axial_displacement": "m", "radial_displacement": "m"},
    effects=tuple(CARRIER_EFFECTS),
    parameters=_published(CARRIER_EFFECTS),
    partners=_partners(CARRIER_EFFECTS),
)

MOUNTING = CampaignKind(
    name="mounting",
    inputs={"torque": "N m", "speed": "rad/s", "carrier_angle": "rad", "ntl_y": "N", "ntl_z": "N"},
    quantities={"housing_displacement": "m"},
    effects=tuple(MOUNTING_EFFECTS),
    parameters={"baseline": ("K1", "C1"), **_published(MOUNTING_EFFECTS)},
    partners=_partners(MOUNTING_EFFECTS),
)


def _carrier(facts: Mapping[str, Any]) -> CampaignKind:
    """Contract of a carrier: parameters of its own number of planets, inputs of its rig."""
    kind, n_planets = CARRIER, facts.get("n_planets")
    if isinstance(n_planets, int) and FEWEST_PLANETS <= n_planets <= MOST_PLANETS:
        kind = replace(kind, parameters=_published(effects_of(n_planets)))
    if facts.get("radial_load") is not None:
        # A rig without radial load has no columns of it.
        kind = replace(kind, inputs={"carrier_angle": "rad", "torque": "N m"})
    return kind


def _element(inputs: Mapping[str, str], quantity: str, unit: str) -> CampaignKind:
    return CampaignKind(
        name="element",
        inputs=inputs,
        quantities={quantity: unit},
        effects=tuple(ELEMENT_EFFECTS),
        parameters={"baseline": ("m", "K1", "C1", "f0"), **_published(ELEMENT_EFFECTS)},
        partners=_partners(ELEMENT_EFFECTS),
        any_unit=True,
    )


#: One mount, damper or spring, by what drives it.
ELEMENT_BY_DRIVE = {
    "force": _element({"force": "N"}, "displacement", "m"),
    "displacement": _element({"displacement": "m"}, "force", "N"),
    "free_decay": _element({}, "displacement", "m"),
    "base": _element({"base_displacement": "m"}, "displacement", "m"),
}
#: A base whose acceleration is measured in place of its displacement.
_ACCELERATED_BASE = _element({"base_acceleration": "m/s^2"}, "displacement", "m")

KIND_NAMES = ("carrier", "mounting", "element")


def campaign_kind(
    name: str, rig: Mapping[str, Any] | None = None, inputs: Iterable[str] = ()
) -> CampaignKind:
    """Contract of one kind of campaign.

    Parameters
    ----------
    name : str
        ``carrier``, ``mounting`` or ``element``.
    rig : mapping, optional
        Keys of the rig: ``drive`` of an element and ``radial_load`` of a carrier decide which
        columns are inputs, ``n_planets`` of a carrier its effects' parameters.
    inputs : iterable of str
        Inputs that the campaign declares or has: the choice between displacement and acceleration
        of a base.

    Returns
    -------
    CampaignKind
        The contract.

    Raises
    ------
    ValueError
        Where the kind, or the drive of an element, is unknown.
    """
    facts = rig or {}
    if name == "carrier":
        return _carrier(facts)
    if name == "mounting":
        return MOUNTING
    if name != "element":
        raise ValueError(f"key 'kind' is '{name}'; expected one of {', '.join(KIND_NAMES)}")
    drive = facts.get("drive")
    if drive not in ELEMENT_BY_DRIVE:
        raise ValueError(
            f"[rig]: key 'drive' is {drive!r}; expected one of {', '.join(ELEMENT_BY_DRIVE)}"
        )
    if drive == "base" and "base_acceleration" in inputs:
        return _ACCELERATED_BASE
    return ELEMENT_BY_DRIVE[drive]
