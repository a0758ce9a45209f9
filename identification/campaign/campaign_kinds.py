"""What each kind of measurement campaign holds: inputs, quantities, units and effect ids.

Data only, after the file contract (docs/campaign_format.md). The keys of the file, those
of the rig among them, are stated in :mod:`carrierflex.identification.campaign.campaign_tables`.
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from carrierflex.geometry.parameters import FEWEST_PLANETS, MOST_PLANETS
from carrierflex.identification.campaign.file_names import EFFECT_NAMES

#: Read here so that a campaign's document is checked without the arrays of the effects.
_NAMES: dict[str, Any] = json.loads(EFFECT_NAMES.read_text(encoding="utf-8"))

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


def _kind(
    name: str,
    inputs: Mapping[str, str],
    quantities: Mapping[str, str],
    of_baseline: tuple[str, ...] = (),
    any_unit: bool = False,
) -> CampaignKind:
    """Contract of a kind with the published effects and the baseline's own parameters."""
    published = {effect: tuple(names) for effect, names in _NAMES[name]["parameters"].items()}
    partners: dict[tuple[str, str], str] = {}
    for effect, angles in _NAMES[name]["angles"].items():
        for size, angle in angles.items():
            partners |= {(effect, size): angle, (effect, angle): size}
    parameters = {"baseline": of_baseline, **published} if of_baseline else published
    return CampaignKind(name, inputs, quantities, tuple(published), parameters, partners, any_unit)


CARRIER = _kind(
    "carrier",
    {"carrier_angle": "rad", "torque": "N m", "ntl_y": "N", "ntl_z": "N"},
    {"axial_displacement": "m", "radial_displacement": "m"},
)

#: Bending moment of the main shaft about an axis that turns with it.
BENDING = "shaft_bending_moment"

MOUNTING = _kind(
    "mounting",
    {"torque": "N m", "speed": "rad/s", "carrier_angle": "rad", "ntl_y": "N", "ntl_z": "N"},
    {"housing_displacement": "m", BENDING: "N m"},
    of_baseline=("K1", "C1"),
)


def _carrier(facts: Mapping[str, Any]) -> CampaignKind:
    """Contract of a carrier: parameters of its own number of planets, inputs of its rig."""
    kind, n_planets = CARRIER, facts.get("n_planets")
    if isinstance(n_planets, int) and FEWEST_PLANETS <= n_planets <= MOST_PLANETS:
        of_number = _NAMES["carrier"]["of_planets"].get(str(n_planets), {})
        others = {name: tuple(names) for name, names in of_number.items()}
        kind = replace(kind, parameters={**kind.parameters, **others})
    if facts.get("radial_load") is not None:
        # A rig without radial load has no columns of it.
        kind = replace(kind, inputs={"carrier_angle": "rad", "torque": "N m"})
    return kind


def _element(inputs: Mapping[str, str], quantity: str, unit: str) -> CampaignKind:
    return _kind("element", inputs, {quantity: unit}, ("m", "K1", "C1", "f0"), any_unit=True)


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
