"""What each kind of measurement campaign holds: inputs, quantities, units and effect ids.

Data only, after the file contract (docs: campaign format, version 1). The keys of the file, those
of the rig among them, are stated in :mod:`carrierflex.identification.campaign.campaign_tables`.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from carrierflex.simulation.carrier.effects.library import CARRIER_EFFECTS
from carrierflex.simulation.element.effects import ELEMENT_EFFECTS
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
    any_unit : bool
        Whether a channel may declare another unit than that of its quantity (voltage analogue).
    """

    name: str
    inputs: Mapping[str, str]
    quantities: Mapping[str, str]
    effects: tuple[str, ...] = ()
    any_unit: bool = False


CARRIER = CampaignKind(
    name="carrier",
    inputs={"carrier_angle": "rad", "torque": "N m", "ntl_y": "N", "ntl_z": "N"},
    quantities={"axial_displacement": "m", "radial_displacement": "m"},
    effects=tuple(CARRIER_EFFECTS),
)

MOUNTING = CampaignKind(
    name="mounting",
    inputs={"torque": "N m", "speed": "rad/s", "carrier_angle": "rad", "ntl_y": "N", "ntl_z": "N"},
    quantities={"housing_displacement": "m"},
    effects=tuple(MOUNTING_EFFECTS),
)


def _element(input_name: str, input_unit: str, quantity: str, unit: str) -> CampaignKind:
    return CampaignKind(
        name="element",
        inputs={input_name: input_unit},
        quantities={quantity: unit},
        effects=tuple(ELEMENT_EFFECTS),
        any_unit=True,
    )


#: One mount, damper or spring, by what drives it.
ELEMENT_BY_DRIVE = {
    "force": _element("force", "N", "displacement", "m"),
    "displacement": _element("displacement", "m", "force", "N"),
}

KIND_NAMES = ("carrier", "mounting", "element")


def campaign_kind(name: str, drive: str | None = None) -> CampaignKind:
    """Contract of one kind of campaign.

    Parameters
    ----------
    name : str
        ``carrier``, ``mounting`` or ``element``.
    drive : str, optional
        The rig key ``drive`` of an element campaign; it decides which column is the input.

    Returns
    -------
    CampaignKind
        The contract.

    Raises
    ------
    ValueError
        Where the kind, or the drive of an element, is unknown.
    """
    if name == "carrier":
        return CARRIER
    if name == "mounting":
        return MOUNTING
    if name != "element":
        raise ValueError(f"key 'kind' is '{name}'; expected one of {', '.join(KIND_NAMES)}")
    if drive not in ELEMENT_BY_DRIVE:
        raise ValueError(
            f"[rig]: key 'drive' is {drive!r}; expected one of {', '.join(ELEMENT_BY_DRIVE)}"
        )
    return ELEMENT_BY_DRIVE[drive]
