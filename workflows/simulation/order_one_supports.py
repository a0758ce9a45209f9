"""Ways to support carrier and housing, each of which shows another share of a kink in the joint.

What the order-one study varies: one change after another from the 2012 paper read literally (ball
joint, bushings that carry forces only, tight bearings) to a housing that is held.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Annotated

from carrierflex.identification.carrier.printed_tables import FULL_TORQUE, PHI_PLC
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.readings import ReadingEffects
from carrierflex.simulation.stage.stage_data import (
    BearingData,
    MeshData,
    MountingData,
    StageData,
)
from carrierflex.simulation.stage.statics import SteadyLoad

#: Carrier angle of its axis [rad]: any, the carrier turns.
_THETA = 1.0
#: Half the diametral clearances of the gearbox's two carrier bearings, 0.275 and 0.245 mm (GRC).
PUBLISHED_CLEARANCE = (0.1375e-3, 0.1225e-3)
#: Stiffness of a mounting that holds the housing [N/m, N m/rad]; the bearings' is 6e9.
_RIGID = 1e13


@dataclass(frozen=True, eq=False)
class Support:
    """A stage with a kink in the joint of main shaft and carrier."""

    name: Annotated[str, "What is changed against the paper read literally"]
    data: Annotated[StageData, "The stage"] = field(default_factory=StageData)
    phi_PLC: Annotated[float, "Kink [rad]"] = PHI_PLC
    load: Annotated[SteadyLoad, "Load"] = field(default_factory=lambda: SteadyLoad(FULL_TORQUE))
    reading: Annotated[ReadingEffects, "What lies between motion and record"] = field(
        default_factory=ReadingEffects
    )

    @property
    def effects(self) -> StageEffects:
        """The kink."""
        return StageEffects(phi_PLC=self.phi_PLC, theta_PLC=_THETA)


def _stage(bearings: dict[str, float], mounting: dict[str, float]) -> StageData:
    return StageData(bearings=BearingData(**bearings), mounting=MountingData(**mounting))


def clearances(share: float = 1.0) -> dict[str, float]:
    """Clearances of the carrier's bearings as a share of the published ones."""
    upwind, downwind = PUBLISHED_CLEARANCE
    return {"upwind_clearance": share * upwind, "downwind_clearance": share * downwind}


def supports() -> tuple[Support, ...]:
    """Rows of the table."""
    rigid = dict.fromkeys(("radial_stiffness", "axial_stiffness", "tilt_stiffness"), _RIGID)
    equal = {"axial_stiffness": 20.2e6}
    centred = equal | {"x": 0.5}
    soft = {"upwind_radial": 1e8, "downwind_radial": 1e8}
    one = {"downwind_radial": 0.0}
    loose = _stage(one, {})
    floating = one | {"sun_radial": 1.0, "sun_tilt": 1.0}
    tilting = {"x": 0.2, "tilt_stiffness": 8e5}
    held_sun = clearances() | {"sun_radial": 3e8}
    sideways = {"upwind_y_factor": 1.0 / 60.0, "downwind_y_factor": 1.0 / 50.0}
    return (
        Support("as the paper reads: ball joint, bushings without moment, tight bearings"),
        Support("without gravity", load=SteadyLoad(FULL_TORQUE, gravity=0.0)),
        Support("bushings 1e11 N/m radially", _stage({}, {"radial_stiffness": 1e11})),
        Support("bushings 20.2 MN/m axially", _stage({}, equal)),
        Support("bushings rigid axially", _stage({}, {"axial_stiffness": 1e12})),
        Support("both bearings 1e9 N/m", _stage(dict.fromkeys(soft, 1e9), {})),
        Support("both bearings 1e8 N/m", _stage(soft, {})),
        Support("no bearing B", loose),
        Support("no bearing B, backlash 10 mm", replace(loose, mesh=MeshData(backlash=0.01))),
        Support("both bearings 1e8 N/m, axially 20.2 MN/m", _stage(soft, equal)),
        Support("published clearances", _stage(clearances(), {})),
        Support("clearances, axially 20.2 MN/m", _stage(clearances(), equal)),
        Support("the same, bushings at x = 0.5 m", _stage(clearances(), centred)),
        Support("the same, misalignment 1.2 mrad", _stage(clearances(), centred), 1.2e-3),
        Support("the same, misalignment 2 mrad", _stage(clearances(), centred), 2e-3),
        Support("the same, misalignment 3 mrad", _stage(clearances(), centred), 3e-3),
        Support("clearances, tilt 1e7 N m/rad", _stage(clearances(), {"tilt_stiffness": 5e6})),
        Support("clearances, tilt 1e8 N m/rad", _stage(clearances(), {"tilt_stiffness": 5e7})),
        Support(
            "clearances, tilt 1e7, axially 20.2 MN/m, x = 0.5 m, misalignment 1.2 mrad",
            _stage(clearances(), centred | {"tilt_stiffness": 5e6}),
            1.2e-3,
        ),
        Support("housing held", _stage({}, rigid)),
        Support("housing held, bearings 1e8 N/m along y alone", _stage(sideways, rigid)),
        Support("housing held, one bearing with tilt 1e8 N m/rad",
                _stage(one | {"upwind_tilt": 1e8}, rigid)),
        Support("housing held, both bearings 1e8 N/m", _stage(soft, rigid)),
        Support("housing held, bearing A alone", _stage(one, rigid)),
        Support("housing held, bearing A alone, sun floating freely", _stage(floating, rigid)),
        Support("sensors on the ground", reading=ReadingEffects(reference="ground")),
        Support("tilt of the face in place of the misalignment", phi_PLC=0.0,
                reading=ReadingEffects(phi_face=PHI_PLC)),
        Support("clearances, x = 0.2 m, tilt 1.6e6, misalignment 2.5 mrad",
                _stage(clearances(), tilting), 2.5e-3),
        Support("the same, sun held by 3e8 N/m", _stage(held_sun, tilting), 2.5e-3),
    )  # fmt: skip


def with_phi(support: Support, phi: float) -> Support:
    """Copy with another kink [rad]."""
    return replace(support, phi_PLC=phi)


def with_clearance(support: Support, share: float) -> Support:
    """Copy with clearances as a share of the published ones."""
    bearings = replace(support.data.bearings, **clearances(share))
    return replace(support, data=replace(support.data, bearings=bearings))


def with_tilt(support: Support, stiffness: float) -> Support:
    """Copy with a mounting of another stiffness against tilt [N m/rad], both bushings together."""
    mounting = replace(support.data.mounting, tilt_stiffness=0.5 * stiffness)
    return replace(support, data=replace(support.data, mounting=mounting))


def with_torque(support: Support, torque: float) -> Support:
    """Copy with another torque [N m]."""
    return replace(support, load=replace(support.load, torque=torque))


def with_radial_load(support: Support, force: float) -> Support:
    """Copy with another vertical load [N]."""
    return replace(support, load=replace(support.load, ntl_z=force))


@dataclass(frozen=True, eq=False)
class Axis:
    """One quantity that the study varies."""

    name: Annotated[str, "What it is"]
    unit: Annotated[str, "The unit that tables and pictures show"]
    values: Annotated[tuple[float, ...], "In SI units"]
    in_unit: Annotated[float, "Shown unit over the SI unit"]
    changed: Annotated[Callable[[Support, float], Support], "Copy of a support with a value"]
    logarithmic: Annotated[bool, "Scale of its axis"] = False


AXES = (
    Axis(
        "misalignment phi_PLC", "mrad", (0.2e-3, 0.58e-3, 1e-3, 1.5e-3, 2e-3, 3e-3), 1e3, with_phi
    ),
    Axis("clearance over the published", "1", (0.0, 0.25, 0.5, 1.0, 1.5), 1.0, with_clearance),
    Axis("moment restraint", "N m/rad", (1e5, 1e6, 1e7, 1e8, 1e9), 1.0, with_tilt, True),
    Axis("torque", "kN m", (36e3, 90e3, 180e3, 270e3, 360e3), 1e-3, with_torque),
    Axis("radial load", "kN", (-200e3, -100e3, 0.0, 100e3, 200e3), 1e-3, with_radial_load),
)
