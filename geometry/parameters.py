"""Parameters of the planet carrier, its pins and the planetary gears, each default with its source.

Source tags, as in the project's data sheet: *paper* is Haastrup, Hansen and Ebbesen (2012); *GRC*
is public material on the Gearbox Reliability Collaborative's 750 kW gearbox; *derived* follows from
those by a calculation; *chosen* is an assumption of this project, with its reason.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields

from carrierflex.files.problems import refuse

#: Fewest and most planets of a carrier: two hold no symmetric tilt, nine leave no room for webs.
FEWEST_PLANETS, MOST_PLANETS = 3, 8
#: Element edge length [m]; order 3 of delta_f is then 4 % below its limit, order 6 of delta_s 3 %
#: (docs/cad.md).
DEFAULT_SIZE = 0.03
#: No planet carrier is larger [m]; a value in millimetres is.
_LARGEST_RADIUS = 5.0
_AXIAL_LENGTHS = (
    "upwind_plate_thickness", "downwind_plate_thickness", "plate_gap", "hub_length", "seat_length",
)  # fmt: skip
_GEAR_LENGTHS = (
    "centre_distance", "module", "sun_tip_diameter", "planet_tip_diameter", "ring_tip_diameter",
    "sun_width", "planet_width",
)  # fmt: skip
#: The pin holes are drilled past hub and seat; they may cut that deep a notch into them [m].
_DEEPEST_NOTCH = 0.005


def half_sector_angle(n_planets: int) -> float:
    """Half the angle between two pins [rad]: a half sector runs from a pin's plane to a web's."""
    return math.pi / n_planets


def refuse_non_positive(parameters: object, table: str, *, but: tuple[str, ...] = ()) -> None:
    """Raise ValueError naming every field that is not a finite positive number.

    `table` is that of the user's file; the fields `but` may be 0.
    """
    refuse(_non_positive(parameters, table, but))


def _non_positive(parameters: object, table: str, but: tuple[str, ...]) -> Iterator[str]:
    for field in fields(parameters):  # type: ignore[arg-type]
        value = getattr(parameters, field.name)
        if field.name in but and value == 0.0:
            continue
        if not (isinstance(value, (int, float)) and math.isfinite(value) and value > 0.0):
            yield f"[{table}] {field.name} is {value!r}; expected a positive number"


@dataclass(frozen=True)
class CarrierParameters:
    """Dimensions of the planet carrier [m], checked for consistency.

    Two plates joined by webs midway between the pins; a hub upwind, shrunk onto the main
    shaft; a seat for the downwind bearing. All fillets are left out, as in the paper's mesh.

    Raises
    ------
    ValueError
        Where a dimension is not positive, two of them contradict each other or there are fewer
        than three or more than eight planets; the message names the parameter.
    """

    outer_radius: float = 0.435
    """Chosen: leaves a machined face around the sensor radius, inside the ring's root radius.

    That radius is 523 mm.
    """
    upwind_plate_thickness: float = 0.065
    """Derived: mass 691 kg (GRC drawing 254594) and rim deflection of Table 4."""
    downwind_plate_thickness: float = 0.045
    """Derived, as above."""
    plate_gap: float = 0.240
    """Chosen: planet face width 227.5 mm (GRC) and 6 mm on either side."""
    centre_distance: float = 0.308
    """GRC: planet bores on carrier drawing 251345, 308.000 ± 0.010 mm."""
    pin_hole_diameter: float = 0.160
    """GRC: bore of the planet bearings NJ2232."""
    web_inner_radius: float = 0.235
    """Chosen, as the outer radius: the webs fill what the planets leave free."""
    planet_clearance_radius: float = 0.219
    """Derived: planet tip radius 210.6 mm (paper, Table 3) and 8 mm of air."""
    hub_outer_diameter: float = 0.460
    """GRC: bore of the upwind carrier bearing SL18 1892E; the pin holes cut 2 mm into it."""
    hub_inner_diameter: float = 0.320
    """Chosen: wall of the shrink fit on the main shaft."""
    hub_length: float = 0.120
    """Chosen: bearing width 56 mm and the shrink fit."""
    upwind_bearing_width: float = 0.056
    """GRC: SL18 1892E; the bearing is centred half-way along the hub."""
    seat_outer_diameter: float = 0.400
    """GRC: bore of the downwind carrier bearing SL18 1880."""
    seat_inner_diameter: float = 0.280
    """Chosen: lets the sun shaft through."""
    seat_length: float = 0.060
    """Chosen: bearing width 46 mm."""
    sensor_radius: float = 0.412
    """Paper, section 2: the proximity sensors' distance from the axis."""
    n_planets: int = 3
    """Paper, section 2: planets, and as many pins and webs."""

    def __post_init__(self) -> None:
        refuse_non_positive(self, "carrier")
        is_integer = isinstance(self.n_planets, int)
        if not (is_integer and FEWEST_PLANETS <= self.n_planets <= MOST_PLANETS):
            raise ValueError(
                f"[carrier] n_planets is {self.n_planets}; expected a whole number from "
                f"{FEWEST_PLANETS} to {MOST_PLANETS}"
            )
        # In millimetres nothing else would make sense either.
        if self.outer_radius > _LARGEST_RADIUS:
            raise ValueError(
                f"[carrier] outer_radius is {self.outer_radius} m; expected dimensions in "
                f"metres, at most {_LARGEST_RADIUS} m"
            )
        conflicts = [*self._pin_hole_conflicts(), *self._web_conflicts()]
        conflicts += [*self._shaft_end_conflicts(), *self._sensor_circle_conflicts()]
        conflicts += self._axial_conflicts()
        refuse(conflicts)

    @property
    def pin_hole_radius(self) -> float:
        """Radius of the pin holes [m]."""
        return self.pin_hole_diameter / 2.0

    @property
    def upwind_bearing_x(self) -> tuple[float, float]:
        """Axial extent of the upwind bearing's seat on the hub [m]."""
        centre = -self.hub_length / 2.0
        return centre - self.upwind_bearing_width / 2.0, centre + self.upwind_bearing_width / 2.0

    @property
    def length_between_faces(self) -> float:
        """Distance from the upwind face of plate A to the downwind face of plate B [m]."""
        return self.upwind_plate_thickness + self.plate_gap + self.downwind_plate_thickness

    @property
    def upwind_bore_x(self) -> tuple[float, float]:
        """Axial extent of the pin bores of plate A [m]."""
        return 0.0, self.upwind_plate_thickness

    @property
    def downwind_bore_x(self) -> tuple[float, float]:
        """Axial extent of the pin bores of plate B [m]."""
        return self.upwind_plate_thickness + self.plate_gap, self.length_between_faces

    @property
    def pin_stations(self) -> tuple[float, float, float]:
        """Stations of the pins' upwind bores, mid-spans and downwind bores [m].

        Each at the middle of the bore.
        """
        upwind, downwind = self.upwind_bore_x, self.downwind_bore_x
        return (
            sum(upwind) / 2.0,
            self.upwind_plate_thickness + self.plate_gap / 2.0,
            sum(downwind) / 2.0,
        )

    def _axial_conflicts(self) -> Iterator[str]:
        """No carrier is longer than it is wide: such a length is in another unit."""
        for name in _AXIAL_LENGTHS:
            length = getattr(self, name)
            if length > 2.0 * self.outer_radius:
                yield (
                    f"[carrier] {name} is {length} m; expected at most twice outer_radius "
                    f"{self.outer_radius} m, dimensions in metres"
                )

    def _sensor_circle_conflicts(self) -> Iterator[str]:
        if not self.outer_radius > self.sensor_radius:
            yield (
                f"[carrier] outer_radius is {self.outer_radius} m: the rim ends inside the "
                f"sensor radius {self.sensor_radius} m; expected a larger outer radius"
            )
        if self.sensor_radius <= self.centre_distance + self.pin_hole_radius:
            yield (
                f"[carrier] sensor_radius is {self.sensor_radius} m: the measured circle "
                "crosses the pin holes, which reach "
                f"{self.centre_distance + self.pin_hole_radius:.4g} m; expected a larger sensor "
                "radius"
            )

    def _pin_hole_conflicts(self) -> Iterator[str]:
        outer, inner = (
            self.centre_distance + self.pin_hole_radius,
            self.centre_distance - self.pin_hole_radius,
        )
        if outer >= self.outer_radius:
            yield (
                f"[carrier] pin_hole_diameter is {self.pin_hole_diameter} m: the hole "
                f"reaches radius {outer:.4g} m and leaves the plate; expected less than "
                f"outer_radius {self.outer_radius} m"
            )
        to_web = self.centre_distance * math.sin(half_sector_angle(self.n_planets))
        if to_web <= self.pin_hole_radius:
            yield (
                f"[carrier] n_planets is {self.n_planets}: neighbouring pin holes of "
                f"pin_hole_diameter {self.pin_hole_diameter} m are {2.0 * to_web:.4g} m apart "
                "and overlap; expected fewer planets, thinner pins or a larger centre_distance"
            )
        for name in ("hub_outer_diameter", "seat_outer_diameter"):
            if inner <= getattr(self, name) / 2.0 - _DEEPEST_NOTCH:
                yield (
                    f"[carrier] {name} is {getattr(self, name)} m and covers the pin "
                    f"holes, which begin at radius {inner:.4g} m; expected at most "
                    f"{2.0 * (inner + _DEEPEST_NOTCH):.4g} m"
                )

    def _web_conflicts(self) -> Iterator[str]:
        a, clearance = self.centre_distance, self.planet_clearance_radius
        if not self.web_inner_radius < self.outer_radius:
            yield (
                f"[carrier] web_inner_radius is {self.web_inner_radius} m; expected less "
                f"than outer_radius {self.outer_radius} m"
            )
        # Nearest distance of the web's middle plane (half a pitch from the pin) to the pin axis,
        # within the web's radii.
        across = math.cos(half_sector_angle(self.n_planets))
        r_nearest = min(max(a * across, self.web_inner_radius), self.outer_radius)
        nearest = math.sqrt(r_nearest**2 + a**2 - 2.0 * r_nearest * a * across)
        if nearest <= clearance:
            yield (
                f"[carrier] planet_clearance_radius is {clearance} m: the webs touch the "
                f"planet, their middle plane is {nearest:.4g} m from the pin axis; expected a "
                "smaller clearance radius or a larger centre_distance"
            )
        if clearance <= self.pin_hole_radius:
            yield (
                f"[carrier] planet_clearance_radius is {clearance} m; expected more than "
                f"the pin hole's radius {self.pin_hole_radius} m"
            )

    def _shaft_end_conflicts(self) -> Iterator[str]:
        for name, inner, outer in (
            ("hub", self.hub_inner_diameter, self.hub_outer_diameter),
            ("seat", self.seat_inner_diameter, self.seat_outer_diameter),
        ):
            if not inner < outer:
                yield (
                    f"[carrier] {name}_inner_diameter is {inner} m; expected less than "
                    f"{name}_outer_diameter {outer} m"
                )
            if not outer < 2.0 * self.outer_radius:
                yield (
                    f"[carrier] {name}_outer_diameter is {outer} m; expected less than "
                    f"twice outer_radius {self.outer_radius} m"
                )
        if not self.upwind_bearing_width < self.hub_length:
            yield (
                f"[carrier] upwind_bearing_width is {self.upwind_bearing_width} m; "
                f"expected less than hub_length {self.hub_length} m, on which the bearing is "
                "centred"
            )
        largest_bore = max(self.hub_inner_diameter, self.seat_inner_diameter) / 2.0
        if not largest_bore < self.web_inner_radius:
            yield (
                f"[carrier] web_inner_radius is {self.web_inner_radius} m; expected more "
                f"than the radius of the central bores, {largest_bore} m"
            )


@dataclass(frozen=True)
class PinParameters:
    """Dimensions of a planet pin [m].

    A plain cylinder from the carrier's upwind to its downwind face.

    Raises
    ------
    ValueError
        Where a dimension is not positive.
    """

    diameter: float = 0.160
    """GRC: bore of the planet bearings NJ2232 (clearance of the fit left out)."""
    bearing_width: float = 0.160
    """GRC: two NJ2232 rows of 80 mm, the mid-span surface that carries the planet."""

    def __post_init__(self) -> None:
        refuse_non_positive(self, "pin")

    def check_fits(self, carrier: CarrierParameters) -> None:
        """Raise ValueError where the pin does not fit `carrier`.

        The message names the parameter.
        """
        refuse(self._conflicts(carrier))

    def _conflicts(self, carrier: CarrierParameters) -> Iterator[str]:
        if not math.isclose(self.diameter, carrier.pin_hole_diameter, rel_tol=1e-12):
            yield (
                f"[pin] diameter is {self.diameter} m; expected the carrier's "
                f"pin_hole_diameter {carrier.pin_hole_diameter} m (the fit's clearance is not part "
                "of the mesh)"
            )
        if not self.bearing_width < carrier.plate_gap:
            yield (
                f"[pin] bearing_width is {self.bearing_width} m; expected less than the "
                f"carrier's plate_gap {carrier.plate_gap} m"
            )


@dataclass(frozen=True)
class GearData:
    """Planetary gears of the paper's Table 3.

    Raises
    ------
    ValueError
        Where a value is not positive (the helix angle may be 0: spur gears) or the tooth numbers
        cannot be assembled.
    """

    ring_teeth: int = 99
    """Paper, Table 3."""
    planet_teeth: int = 39
    """Paper, Table 3."""
    sun_teeth: int = 21
    """Paper, Table 3."""
    centre_distance: float = 0.308
    """GRC: carrier drawing 251345 [m]."""
    pressure_angle: float = math.radians(20.0)
    """Paper, Table 3 [rad]."""
    helix_angle: float = math.radians(7.5)
    """Paper, Table 3 [rad]; sun right-handed, planet and ring left-handed (GRC).

    0 for spur gears (paper, section 3.2)."""
    module: float = 0.010
    """Paper, Table 3: normal module [m]."""
    sun_tip_diameter: float = 0.2356
    """Derived from the paper's Table 3 [m]."""
    planet_tip_diameter: float = 0.4212
    """Derived, as above."""
    ring_tip_diameter: float = 0.998
    """Derived, as above."""
    sun_width: float = 0.220
    """GRC: face width of the sun (NREL/TP-500-58190) [m]."""
    planet_width: float = 0.2275
    """GRC: face width of planets and ring, as above [m]."""

    def __post_init__(self) -> None:
        refuse_non_positive(self, "gear", but=("helix_angle",))
        refuse(self._conflicts())

    def _conflicts(self) -> Iterator[str]:
        for name in ("ring_teeth", "planet_teeth", "sun_teeth"):
            if getattr(self, name) != int(getattr(self, name)):
                yield f"[gear] {name} is {getattr(self, name)}; expected a whole number"
        for name in ("pressure_angle", "helix_angle"):
            if getattr(self, name) >= math.pi / 4.0:
                yield (
                    f"[gear] {name} is {getattr(self, name)}; expected an angle in radians, "
                    "below 0.785 (45 deg)"
                )
        for name in _GEAR_LENGTHS:
            if getattr(self, name) > 2.0 * _LARGEST_RADIUS:
                yield (
                    f"[gear] {name} is {getattr(self, name)} m; expected dimensions in metres, "
                    f"at most {2.0 * _LARGEST_RADIUS} m"
                )
        if self.ring_teeth != self.sun_teeth + 2 * self.planet_teeth:
            yield (
                f"[gear] ring_teeth is {self.ring_teeth}; expected sun_teeth + 2 planet_teeth = "
                f"{self.sun_teeth + 2 * self.planet_teeth}"
            )

    def assembly_conflicts(self, n_planets: int) -> Iterator[str]:
        """What keeps so many planets from being assembled at equal angles, or from having room."""
        if (self.ring_teeth + self.sun_teeth) % n_planets:
            yield (
                f"[gear] sun_teeth is {self.sun_teeth}; expected ring_teeth + sun_teeth "
                f"divisible by {n_planets}, or the planets cannot be assembled at equal angles"
            )
        between = 2.0 * self.centre_distance * math.sin(half_sector_angle(n_planets))
        if self.planet_tip_diameter >= between:
            yield (
                f"[gear] planet_tip_diameter is {self.planet_tip_diameter} m: planets are "
                f"{between:.4g} m apart and touch; expected less, or fewer planets than {n_planets}"
            )

    @property
    def planet_pitch_diameter(self) -> float:
        """Working pitch diameter of a planet [m]: 400.4 mm in the paper."""
        return 2.0 * self.centre_distance * self.planet_teeth / (self.sun_teeth + self.planet_teeth)

    @property
    def ratio(self) -> float:
        """Sun speed over carrier speed with the ring fixed, 1 + z_r/z_s."""
        return 1.0 + self.ring_teeth / self.sun_teeth
