"""Involute geometry of one gear pair.

Radii, working pressure angle, path of contact, contact ratios.

Signed tooth numbers as in DIN 3960 and ISO 21771: a ring gear has a negative number of teeth, and
with it negative radii, so one set of equations serves both meshes of a planetary stage.
"""

import math
from dataclasses import dataclass

from carrierflex.geometry.parameters import GearData


@dataclass(frozen=True)
class InvolutePair:
    """Planet with sun, or planet with ring.

    Parameters
    ----------
    teeth : tuple of int
        Teeth of the planet and of its mate; a ring counts negative.
    module : float
        Normal module [m].
    pressure_angle, helix_angle : float
        Normal pressure angle and helix angle at the reference cylinder [rad].
    centre_distance : float
        Distance of the axes [m], positive.
    tip_radii : tuple of float
        Tip radii of planet and mate [m], positive.
    face_width : float
        Common face width [m].

    Raises
    ------
    ValueError
        Where the teeth never meet or the path of contact is shorter than a base pitch.
    """

    teeth: tuple[int, int]
    module: float
    pressure_angle: float
    helix_angle: float
    centre_distance: float
    tip_radii: tuple[float, float]
    face_width: float

    def __post_init__(self) -> None:
        touching = abs(sum(self.base_radii)) / self.centre_distance
        if not touching < 1.0:
            raise ValueError(
                f"gear pair {self.teeth}: base radii add up to {touching:.3f} centre distances; "
                "expected less than 1"
            )
        for radius, base in zip(self.tip_radii, self.base_radii, strict=True):
            if not radius > abs(base):
                raise ValueError(
                    f"gear pair {self.teeth}: tip radius {radius} m lies inside the base circle of "
                    f"{abs(base):.6f} m"
                )
        if self.contact_ratio < 1.0:
            raise ValueError(
                f"gear pair {self.teeth}: transverse contact ratio {self.contact_ratio:.3f}; "
                "expected 1 or more, check tip radii and centre distance"
            )

    @property
    def transverse_pressure_angle(self) -> float:
        """At the reference cylinder [rad]: ``tan alpha_t = tan alpha_n / cos beta``."""
        return math.atan(math.tan(self.pressure_angle) / math.cos(self.helix_angle))

    @property
    def base_radii(self) -> tuple[float, float]:
        """Base radii of planet and mate [m]; negative for a ring."""
        first, second = (
            0.5
            * z
            * self.module
            / math.cos(self.helix_angle)
            * math.cos(self.transverse_pressure_angle)
            for z in self.teeth
        )
        return first, second

    @property
    def working_pressure_angle(self) -> float:
        """In the transverse plane at the given centre distance [rad].

        ``cos alpha_wt = (r_b1 + r_b2) / a``.
        """
        return math.acos(abs(sum(self.base_radii)) / self.centre_distance)

    @property
    def base_helix_angle(self) -> float:
        """Helix angle at the base cylinder [rad]: ``sin beta_b = sin beta cos alpha_n``."""
        return math.asin(math.sin(self.helix_angle) * math.cos(self.pressure_angle))

    @property
    def base_pitch(self) -> float:
        """Transverse base pitch [m]."""
        return 2.0 * math.pi * self.base_radii[0] / self.teeth[0]

    @property
    def tangent_lengths(self) -> tuple[float, float]:
        """Distance of the pitch point from the base circles' tangent points [m].

        The radii of curvature there.
        """
        sine = math.sin(self.working_pressure_angle)
        working = (self.centre_distance * z / abs(sum(self.teeth)) for z in self.teeth)
        first, second = (radius * sine for radius in working)
        return first, second

    @property
    def path_of_contact(self) -> tuple[float, float]:
        """Ends of the path of contact, measured from the pitch point along it [m].

        At `s` the planet's flank has the radius of curvature ``rho_1 + s``, the mate's ``rho_2 -
        s``; the tip of a wheel is where its radius of curvature is ``sqrt(r_a^2 - r_b^2)``.
        """
        first, second = self.tangent_lengths
        tip_1, tip_2 = (
            math.sqrt(tip**2 - base**2)
            for tip, base in zip(self.tip_radii, self.base_radii, strict=True)
        )
        # A ring's tip is its smallest radius: there its (negative) radius of curvature is the
        # largest.
        return second - math.copysign(tip_2, self.teeth[1]), tip_1 - first

    @property
    def contact_ratio(self) -> float:
        """Transverse contact ratio: path of contact over base pitch."""
        begin, end = self.path_of_contact
        return (end - begin) / self.base_pitch

    @property
    def overlap_ratio(self) -> float:
        """Axial pitches within the face width: ``b sin beta / (pi m_n)``."""
        return self.face_width * math.sin(self.helix_angle) / (math.pi * self.module)


def sun_planet_pair(gear: GearData) -> InvolutePair:
    """Mesh of planet and sun."""
    return InvolutePair(
        (gear.planet_teeth, gear.sun_teeth),
        gear.module,
        gear.pressure_angle,
        gear.helix_angle,
        gear.centre_distance,
        (gear.planet_tip_diameter / 2.0, gear.sun_tip_diameter / 2.0),
        gear.sun_width,
    )


def ring_planet_pair(gear: GearData) -> InvolutePair:
    """Mesh of planet and ring."""
    return InvolutePair(
        (gear.planet_teeth, -gear.ring_teeth),
        gear.module,
        gear.pressure_angle,
        gear.helix_angle,
        gear.centre_distance,
        (gear.planet_tip_diameter / 2.0, gear.ring_tip_diameter / 2.0),
        gear.planet_width,
    )
