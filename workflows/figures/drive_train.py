"""Section through main shaft and gearbox, to scale: the ground of several of the papers' figures.

Carrier, pins, planets, sun, ring and main shaft have this project's dimensions; gears of the
parallel stages their published teeth and centre distances. Walls of the housing, bearings' outlines
and axial stations behind the carrier are drawn freely. The parallel shafts are turned into the
plane of the drawing. Coordinates: x along the axis from the upwind face of plate A, z up [m].
"""

from dataclasses import dataclass, field

import numpy as np
from matplotlib.axes import Axes

from carrierflex.geometry.main_shaft_parameters import MainShaftParameters
from carrierflex.geometry.parameters import CarrierParameters, GearData, PinParameters
from carrierflex.simulation.stage.stage_data import ChainData, MountingData
from carrierflex.workflows.figures.sketching import (
    CARRIER,
    GEAR,
    HOUSING,
    RUBBER,
    STEEL,
    box,
    ground,
    line,
    mirrored,
    spring,
)

#: Face widths of sun, planet and ring [m] (NREL/TP-500-58190), module of the low-speed parallel
#: stage and of the high-speed one [m], helix of both [rad], their centre distances [m].
FACE_WIDTH = {"sun": 0.220, "planet": 0.2275, "ring": 0.230}
_MODULES = (8.25e-3, 5e-3)
_HELIX = np.deg2rad(14.0)
_CENTRES = (0.450, 0.285)
#: Drawn freely [m]: radius of the planet bearings' outer rings, of the ring gear's outside and of
#: the housing.
_BEARING_RADIUS = 0.145
_RING_OUTSIDE = 0.60
_HOUSING_RADIUS = 0.66


@dataclass(frozen=True)
class DriveTrain:
    """Dimensions that the section is drawn from."""

    carrier: CarrierParameters = field(default_factory=CarrierParameters)
    pin: PinParameters = field(default_factory=PinParameters)
    shaft: MainShaftParameters = field(default_factory=MainShaftParameters)
    gear: GearData = field(default_factory=GearData)
    chain: ChainData = field(default_factory=ChainData)
    mounting: MountingData = field(default_factory=MountingData)

    @property
    def bearing_x(self) -> float:
        """Station of the main bearing [m]."""
        return self.shaft.bearing_x(self.carrier)

    @property
    def coupling_x(self) -> float:
        """Station of the equivalent mass of the dynamometer's coupling [m]."""
        return self.bearing_x - self.mounting.coupling_arm

    @property
    def planet_x(self) -> float:
        """Station of the planets' middle plane [m]."""
        return self.carrier.pin_stations[1]


def pitch_radii(gear: GearData) -> dict[str, float]:
    """Working pitch radii of sun, planet and ring [m]."""
    planet = gear.planet_pitch_diameter / 2.0
    return {
        "sun": gear.centre_distance - planet,
        "planet": planet,
        "ring": gear.centre_distance + planet,
    }


def draw_main_shaft(axes: Axes, train: DriveTrain) -> None:
    """Main shaft with its bore and flange, and the main bearing on the bedplate."""
    shaft, carrier = train.shaft, train.carrier
    radii = (shaft.inner_diameter / 2.0, shaft.outer_diameter / 2.0)
    flange = shaft.flange_x(carrier)
    mirrored(axes, (flange, shaft.joint_x(carrier)), radii)
    mirrored(axes, (flange - 0.06, flange), (radii[0], 0.34))
    seat = shaft.bearing_seat_x(carrier)
    mirrored(axes, seat, (radii[1], 0.28), "white", hatch="xx")
    mirrored(axes, (seat[0] - 0.04, seat[1] + 0.04), (0.28, 0.36), HOUSING)
    box(axes, (seat[0] - 0.02, seat[1] + 0.02), (-0.82, -0.36), HOUSING)


def draw_gearbox(axes: Axes, train: DriveTrain) -> None:
    """Carrier with pin and planet above the axis and a web below; sun, ring and parallel stages."""
    _draw_carrier(axes, train.carrier)
    _draw_planet(axes, train)
    _draw_parallel_stages(axes, train)
    _draw_housing(axes, train.carrier)
    line(axes, [(-4.3, 0.0), (1.6, 0.0)], style="-.")


def draw_bushing(axes: Axes, train: DriveTrain) -> None:
    """Torque arms on their bushings, one behind the other, as a spring to the ground."""
    x = train.mounting.x
    box(axes, (x - 0.1, x + 0.1), (-0.72, -_HOUSING_RADIUS), RUBBER)
    spring(axes, (x, -0.98), (x, -0.72), width=0.10)
    ground(axes, (x - 0.25, x + 0.25), -0.98, depth=0.07)
    seat = train.shaft.bearing_seat_x(train.carrier)
    ground(axes, (seat[0] - 0.15, seat[1] + 0.15), -0.82, depth=0.07)


def _draw_carrier(axes: Axes, carrier: CarrierParameters) -> None:
    downwind, seat_end = carrier.downwind_bore_x, carrier.length_between_faces + carrier.seat_length
    hub = (carrier.hub_inner_diameter / 2.0, carrier.hub_outer_diameter / 2.0)
    seat = (carrier.seat_inner_diameter / 2.0, carrier.seat_outer_diameter / 2.0)
    pin = (
        carrier.centre_distance - carrier.pin_hole_radius,
        carrier.centre_distance + carrier.pin_hole_radius,
    )
    mirrored(axes, (-carrier.hub_length, 0.0), hub, CARRIER)
    mirrored(axes, (carrier.length_between_faces, seat_end), seat, CARRIER)
    for x, inner in ((carrier.upwind_bore_x, hub[0]), (downwind, seat[0])):
        box(axes, x, (inner, pin[0]), CARRIER)
        box(axes, x, (pin[1], carrier.outer_radius), CARRIER)
        box(axes, x, (-carrier.outer_radius, -inner), CARRIER)
    gap = (carrier.upwind_bore_x[1], downwind[0])
    box(axes, gap, (-carrier.outer_radius, -carrier.web_inner_radius), CARRIER)
    box(axes, (0.0, carrier.length_between_faces), pin, STEEL)
    # Bearings A on the hub and B on the seat.
    mirrored(axes, carrier.upwind_bearing_x, (hub[1], hub[1] + 0.06), "white", hatch="xx")
    mirrored(
        axes, (carrier.length_between_faces + 0.007, seat_end - 0.007), (seat[1], seat[1] + 0.05),
        "white", hatch="xx",
    )  # fmt: skip


def _draw_planet(axes: Axes, train: DriveTrain) -> None:
    carrier = train.carrier
    gear = train.gear
    middle = train.planet_x
    radii = pitch_radii(gear)

    def face(name: str) -> tuple[float, float]:
        """Axial extent of a gear [m]."""
        return middle - FACE_WIDTH[name] / 2.0, middle + FACE_WIDTH[name] / 2.0

    a = gear.centre_distance
    rollers = (middle - train.pin.bearing_width / 2.0, middle + train.pin.bearing_width / 2.0)
    for side in (-1.0, 1.0):
        tooth = sorted((a + side * radii["planet"], a + side * _BEARING_RADIUS))
        box(axes, face("planet"), (tooth[0], tooth[1]), GEAR)
        rows = sorted((a + side * _BEARING_RADIUS, a + side * carrier.pin_hole_radius))
        box(axes, rollers, (rows[0], rows[1]), "white", hatch="xx")
    box(axes, face("sun"), (-radii["sun"], radii["sun"]), GEAR)
    box(axes, (face("sun")[1], 0.62), (-0.0525, 0.0525), STEEL)
    mirrored(axes, face("ring"), (radii["ring"], _RING_OUTSIDE), GEAR)


def _draw_parallel_stages(axes: Axes, train: DriveTrain) -> None:
    low, high = train.chain.low_teeth, train.chain.high_teeth
    normal = [m / (2.0 * np.cos(_HELIX)) for m in _MODULES]
    z_ims = _CENTRES[0]
    z_hs = z_ims + _CENTRES[1]
    box(axes, (0.50, 0.98), (-0.12, 0.12), STEEL)
    mirrored(axes, (0.66, 0.83), (0.12, low[0] * normal[0]), GEAR)
    box(axes, (0.56, 1.12), (z_ims - 0.055, z_ims + 0.055), STEEL)
    box(axes, (0.652, 0.838), (z_ims - low[1] * normal[0], z_ims + low[1] * normal[0]), GEAR)
    for side in (-1.0, 1.0):
        wheel = sorted((z_ims + side * 0.055, z_ims + side * high[0] * normal[1]))
        box(axes, (0.92, 1.04), (wheel[0], wheel[1]), GEAR)
    box(axes, (0.82, 1.42), (z_hs - 0.04, z_hs + 0.04), STEEL)
    box(axes, (0.925, 1.035), (z_hs - high[1] * normal[1], z_hs + high[1] * normal[1]), GEAR)
    for x, z, half in (
        (0.515, 0.0, 0.12), (0.93, 0.0, 0.12), (0.57, z_ims, 0.055), (1.08, z_ims, 0.055),
        (0.835, z_hs, 0.04), (1.105, z_hs, 0.04),
    ):  # fmt: skip
        for side in (-1.0, 1.0):
            rows = sorted((z + side * half, z + side * (half + 0.04)))
            box(axes, (x, x + 0.045), (rows[0], rows[1]), "white", hatch="xx")


def _draw_housing(axes: Axes, carrier: CarrierParameters) -> None:
    outer, hub = _HOUSING_RADIUS, carrier.hub_outer_diameter / 2.0 + 0.06
    front, wall = (-0.10, -0.03), (0.357, 0.403)
    mirrored(axes, front, (hub, outer), HOUSING, layer=1.0)
    mirrored(axes, (front[1], wall[0]), (_RING_OUTSIDE, outer), HOUSING, layer=1.0)
    mirrored(axes, wall, (0.25, outer), HOUSING, layer=1.0)
    top = 0.90
    bottom = -0.50
    rear = (1.15, 1.20)
    box(axes, wall, (outer, top), HOUSING, layer=1.0)
    box(axes, (wall[1], rear[0]), (top - 0.05, top), HOUSING, layer=1.0)
    box(axes, (wall[1], rear[0]), (bottom, bottom + 0.05), HOUSING, layer=1.0)
    box(axes, rear, (bottom, top), HOUSING, layer=1.0)
    # Carrier of the inner bearings.
    box(axes, (0.515, 0.56), (0.16, 0.395), HOUSING, layer=1.0)
    box(axes, (0.515, 0.56), (0.545, top - 0.05), HOUSING, layer=1.0)
    box(axes, (0.515, 0.56), (bottom + 0.05, -0.16), HOUSING, layer=1.0)
