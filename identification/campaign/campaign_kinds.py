"""What each kind of measurement campaign holds: inputs, quantities, units, rig keys and effect ids.

Data only, after the file contract (docs: campaign format, version 1). A new kind is a new table
here.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from carrierflex.simulation.toml_tables import (
    COUNT,
    FLAG,
    NOT_NEGATIVE,
    NUMBER,
    POSITIVE,
    POSITIVE_COUNT,
    TEXT,
    THREE_POSITIVE,
    Value,
    one_of,
)

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
    channel_keys : mapping of str to Value
        Keys a channel has in this kind only.
    rig_required, rig_optional : mapping of str to Value
        Keys of the rig table.
    effects : tuple of str
        Effect ids.
    any_unit : bool
        Whether a channel may declare another unit than that of its quantity (voltage analogue).
    """

    name: str
    inputs: Mapping[str, str]
    quantities: Mapping[str, str]
    channel_keys: Mapping[str, Value] = field(default_factory=dict)
    rig_required: Mapping[str, Value] = field(default_factory=dict)
    rig_optional: Mapping[str, Value] = field(default_factory=dict)
    effects: tuple[str, ...] = ()
    any_unit: bool = False


CARRIER = CampaignKind(
    name="carrier",
    inputs={"carrier_angle": "rad", "torque": "N m", "ntl_y": "N", "ntl_z": "N"},
    quantities={"axial_displacement": "m", "radial_displacement": "m"},
    channel_keys={"angle_deg": NUMBER, "radius_m": POSITIVE},
    rig_required={
        "nominal_torque": POSITIVE,
        "sensor_radius": POSITIVE,
        "n_planets": POSITIVE_COUNT,
    },
    rig_optional={"deflection_curves": TEXT},
    effects=(
        "axial_offset",
        "housing_tilt",
        "torque_tilt",
        "carrier_tilt",
        "flexible_pins",
        "stiff_pins",
        "pin_clearance",
        "unequal_load_sharing",
        "load_sharing_ntl",
        "ntl_tilt",
        "bearing_clearance",
        "flange_warp",
        "face_runout",
        "ring_pass",
        "thermal_drift",
        "sensor_gain",
        "sensor_angle",
        "sensor_zero",
        "sensor_delay",
    ),
)

MOUNTING = CampaignKind(
    name="mounting",
    inputs={"torque": "N m", "speed": "rad/s", "carrier_angle": "rad", "ntl_y": "N", "ntl_z": "N"},
    quantities={"housing_displacement": "m"},
    channel_keys={"sensor": one_of("ssx", "spx", "ssz", "spz", "spy", "sbx")},
    rig_required={
        "R_x": POSITIVE,
        "R_y": NUMBER,
        "R_z": NUMBER,
        "R_b": NUMBER,
        "R_yz": NUMBER,
        "bushing_radial_stiffness": POSITIVE,
        "bushing_radial_damping": NOT_NEGATIVE,
        "bushing_axial_stiffness": NOT_NEGATIVE,
        "bushing_axial_damping": NOT_NEGATIVE,
        "housing_mass": POSITIVE,
        "housing_inertia": THREE_POSITIVE,
        "housing_cg_x": NUMBER,
        "shaft_mass": NOT_NEGATIVE,
        "shaft_cg_x": NUMBER,
        "coupling_mass": NOT_NEGATIVE,
        "coupling_arm": NUMBER,
        "main_bearing_x": POSITIVE,
        "gear_ratio": POSITIVE,
        "zeroing_samples": POSITIVE_COUNT,
    },
    effects=(
        "cubic_stiffness",
        "quintic_stiffness",
        "deflection_dependent_damping",
        "fluid_branch",
        "elasto_plastic_friction",
        "parasitic_torque",
        "axial_bushing_stiffness",
        "main_bearing_compliance",
        "ntl_direction",
        "unequal_bushings",
        "sensor_gain",
        "sensor_zero",
        "sensor_delay",
    ),
)

_ELEMENT_RIG_OPTIONAL = {
    "mass": POSITIVE,
    "periodic": FLAG,
    "period_samples": POSITIVE_COUNT,
    "settle_samples": COUNT,
}
_ELEMENT_EFFECTS = (
    "quadratic_stiffness",
    "cubic_stiffness",
    "quintic_stiffness",
    "coulomb_friction",
    "elasto_plastic_friction",
    "stribeck_friction",
    "quadratic_damping",
    "cubic_damping",
    "deflection_dependent_damping",
    "backlash",
    "maxwell_branch",
    "friction_asymmetry",
    "sensor_delay",
)


def _element(input_name: str, input_unit: str, quantity: str, unit: str) -> CampaignKind:
    return CampaignKind(
        name="element",
        inputs={input_name: input_unit},
        quantities={quantity: unit},
        rig_required={"drive": one_of("force", "displacement")},
        rig_optional=_ELEMENT_RIG_OPTIONAL,
        effects=_ELEMENT_EFFECTS,
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
