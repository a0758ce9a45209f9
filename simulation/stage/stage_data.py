"""Masses, springs and gear data of the stage outside its elastic body, each with its source.

Source tags as in :mod:`carrierflex.geometry.parameters`: *paper*, *GRC*, *derived*, *chosen*.
Published bearing and mesh stiffnesses of this gearbox do not exist: those here follow from line
contact and tooth stiffness formulas.
"""

import math
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import TYPE_CHECKING

from carrierflex.geometry.parameters import GearData

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

#: ISO/TS 16281: spring constant of a roller between both races, steel on steel [N/mm^(10/9)] times
#: L^(8/9) in mm.
_LINE_CONTACT = 35948.0
#: Exponent of the line contact's law.
EXPONENT = 10.0 / 9.0
#: Standard gravity [m/s^2].
GRAVITY = 9.81


def _refuse_negative(data: object, table: str, *, but: tuple[str, ...] = ()) -> None:
    """Raise ValueError naming the first number that is not finite or is negative.

    `table` is that of the case file; the fields `but` may be negative.
    """
    for entry in fields(data):  # type: ignore[arg-type]
        value = getattr(data, entry.name)
        if not isinstance(value, int | float):
            continue
        if not math.isfinite(value):
            raise ValueError(f"[{table}] {entry.name} is {value!r}; expected a finite number")
        if value < 0.0 and entry.name not in but:
            raise ValueError(f"[{table}] {entry.name} is {value!r}; expected a finite number >= 0")


@dataclass(frozen=True)
class RollerBearingData:
    """Rollers of a planet's two bearings NJ 2232; their inner geometry is not published.

    Raises
    ------
    ValueError
        Where a dimension is not positive, rollers overlap, or a count is not positive.
    """

    n_rollers: int = 17
    """Chosen: in a row; with length and diameter this gives the static rating of 1.2 MN usual for
    the size (ISO 76)."""
    n_rows: int = 2
    """GRC: PL-A and PL-B."""
    row_spacing: float = 0.080
    """GRC: width of one bearing [m]; the rows stand side by side."""
    roller_diameter: float = 0.036
    """Chosen: D_we [m], see n_rollers."""
    roller_length: float = 0.053
    """Chosen: effective length L_we [m], see n_rollers."""
    pitch_diameter: float = 0.229
    """Chosen: D_pw [m], inner race of 193 mm and a roller."""
    n_slices: int = 3
    """Chosen: slices of a roller, at the points and with the widths of Gauss-Legendre quadrature; 2
    % off at 1 mrad."""
    profile: float = 0.0
    """Chosen: straight rollers. ISO/TS 16281 proposes ``P = 0.00035 D_we ln(1/(1 - (2x/L_we)^2))``,
    this factor 0.00035."""
    reference_load: float = 390e3
    """Derived: pin load at 360 kN m [N]; the linear part of the equations takes the stiffness that
    the bearing has there."""

    def __post_init__(self) -> None:
        for entry in fields(self):
            value = getattr(self, entry.name)
            if not (
                math.isfinite(value) and (value > 0.0 or (value == 0.0 and entry.name == "profile"))
            ):
                raise ValueError(
                    f"[planet_rollers] {entry.name} is {value!r}; expected a positive number"
                )
        if self.n_rollers * math.asin(self.roller_diameter / self.pitch_diameter) > math.pi:
            raise ValueError(
                f"[planet_rollers] n_rollers is {self.n_rollers}: rollers of "
                f"{self.roller_diameter} m overlap on a pitch circle of {self.pitch_diameter} m; "
                "expected fewer or smaller ones"
            )

    @property
    def roller_stiffness(self) -> float:
        """``c_L`` of one roller between both races [N/m^(10/9)]."""
        return _LINE_CONTACT * (1e3 * self.roller_length) ** (8.0 / 9.0) * 1e3**EXPONENT

    @property
    def static_rating(self) -> float:
        """Basic static load rating of one row [N] (ISO 76:2006, eq. 17)."""
        D, L = 1e3 * self.roller_diameter, 1e3 * self.roller_length
        return 44.0 * (1.0 - self.roller_diameter / self.pitch_diameter) * self.n_rollers * L * D

    def cage_ratio(self, gear: GearData) -> float:
        """Turn of the cage in the carrier's frame over the carrier's turn.

        The planet's by -z_r/z_p, half of it rolls off.
        """
        rolling = 0.5 * (1.0 + self.roller_diameter / self.pitch_diameter)
        return -gear.ring_teeth / gear.planet_teeth * rolling

    @cached_property
    def slices(self) -> "tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]":
        """Axial place [m] from the bearing's middle, share of a roller, profile on both races [m].

        Shapes (rows * slices,).
        """
        # Late: a case's keys are checked without a library of arrays.
        import numpy as np

        point, weight = np.polynomial.legendre.leggauss(self.n_slices)
        middles = self.row_spacing * (np.arange(self.n_rows) - 0.5 * (self.n_rows - 1))
        x = (middles[:, None] + 0.5 * self.roller_length * point).ravel()
        drop = 2.0 * self.profile * self.roller_diameter * np.log(1.0 / (1.0 - point**2))
        return x, np.tile(weight / 2.0, self.n_rows), np.tile(drop, self.n_rows)


@dataclass(frozen=True)
class RigidPart:
    """Mass and inertia of a rigid part about its centre, and its centre along the carrier's axis.

    Raises
    ------
    ValueError
        Where the mass or an inertia is not positive.
    """

    mass: float
    """[kg]."""
    polar_inertia: float
    """About x [kg m^2]."""
    transverse_inertia: float
    """About y and z [kg m^2]."""
    x: float
    """Axial position of the centre [m]."""

    def __post_init__(self) -> None:
        for name in ("mass", "polar_inertia", "transverse_inertia"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise ValueError(
                    f"RigidPart.{name} is {getattr(self, name)!r}; expected a positive number"
                )


@dataclass(frozen=True)
class MeshData:
    """Meshes of the planetary stage.

    Raises
    ------
    ValueError
        Where a value is negative, or a stiffness is zero.
    """

    sun_stiffness: float = 3.3e9
    """Derived: mean along the tooth normal [N/m], ISO 6336 c_gamma of 15 N/(mm um) over the face
    width."""
    ring_stiffness: float = 4.1e9
    """Derived, as above with 18 N/(mm um)."""
    backlash: float = 0.3e-3
    """Chosen: play between the flanks along the normal [m], usual for module 10 mm."""
    n_harmonics: int = 3
    """Chosen: harmonics of the mesh frequency kept in the stiffness; a helical mesh of this overlap
    has little more."""
    n_slices: int = 1
    """Chosen: slices over the face width ``b``, at the points and with the weights of
    Gauss-Legendre quadrature. 1: teeth do not resist tilt. 2 or more: stiffness constant over the
    width (ISO 6336 has one c_gamma for all of it), so that a mesh resists tilt in its plane of
    action with ``k b^2 / 12``, 1.3e7 N m/rad at the sun, until an edge loses contact."""

    def __post_init__(self) -> None:
        _refuse_negative(self, "mesh")
        if self.n_slices < 1:
            raise ValueError(f"[mesh] n_slices is {self.n_slices}; expected 1 or more")
        if not (self.sun_stiffness > 0.0 and self.ring_stiffness > 0.0):
            raise ValueError(
                f"MeshData has stiffnesses {self.sun_stiffness} and {self.ring_stiffness} N/m; "
                "expected positive ones"
            )


@dataclass(frozen=True)
class BearingData:
    """Bearings as springs: radial, axial [N/m] and tilting [N m/rad].

    All are isotropic about the axis but for the carrier's, whose stiffness may differ between the
    housing's y and z. One merged bearing in place of two is ``downwind_radial`` = 0 with
    ``upwind_tilt``.

    Raises
    ------
    ValueError
        Where a value is negative, or a carrier bearing has both a clearance and unequal
        stiffnesses: under weight and load a clearance makes its own inequality.
    """

    planet_radial: float = 1.7e10
    """Derived: two rows NJ2232, Harris line contact at half the pin load."""
    planet_axial: float = 1e9
    """Chosen: stiff against the axial mesh forces, which cancel on a planet."""
    planet_tilt: float = 2.7e7
    """Derived: two rows 80 mm apart."""
    upwind_radial: float = 6e9
    """Derived: PLC-A, line contact."""
    downwind_radial: float = 5e9
    """Derived: PLC-B."""
    upwind_tilt: float = 0.0
    """Chosen: one row of rollers hardly resists tilt."""
    downwind_tilt: float = 0.0
    """Chosen, as above."""
    upwind_y_factor: float = 1.0
    """Chosen: stiffness of PLC-A along the housing's y over `upwind_radial`, the one along z."""
    downwind_y_factor: float = 1.0
    """Chosen, as above for PLC-B."""
    carrier_axial: float = 1.6e9
    """GRC: 63 um at 100 kN thrust (NREL/CP-5000-55207)."""
    main_radial: float = 5e9
    """Derived: SRB 24076; the paper's spherical joint with its stiffness."""
    main_axial: float = 1e9
    """Derived, as above."""
    sun_radial: float = 5e6
    """Chosen: the sun floats on a quill [N/m]. :func:`quill_stiffness` of 105 mm x 0.9 m, which
    `ChainData.sun_shaft_torsion` implies; the dimensions are not published. Range 1e6 to 1.4e9:
    no thicker than the sun's root circle of 186 mm and no shorter than 0.3 m. What it decides:
    ``python -m studies.tabulate_load_sharing``."""
    sun_friction: float = 0.0
    """Chosen: no friction in the sun's spline. Coefficient; 0.05 to 0.15 on lubricated steel. The
    lateral force that sticks is at most ``sun_friction T_sun / spline_radius``."""
    spline_radius: float = 0.07
    """Chosen [m]: acts with `sun_friction` alone; 0.05 to 0.09 fit within the sun's root circle."""
    sun_clearance: float = 0.0
    """Chosen: radial clearance of the spline [m]; 0 to 0.3 mm."""
    sun_axial: float = 3e8
    """Chosen: bearings of the low-speed shaft."""
    sun_tilt: float = 1e6
    """Chosen: bending of the sun shaft."""
    ring_to_housing: float = 1e10
    """Chosen: bolted joint [N/m]; rotations at the ring's radius."""
    upwind_clearance: float = 0.0
    """Radial clearance of PLC-A [m], half the diametral one; GRC models have 0.14 mm."""
    downwind_clearance: float = 0.0
    """Radial clearance of PLC-B [m]."""
    planet_clearance: float = 0.0
    """Radial clearance of each planet on its pin [m]."""

    def __post_init__(self) -> None:
        _refuse_negative(self, "bearings")
        if not self.spline_radius > 0.0:
            raise ValueError(
                f"[bearings] spline_radius is {self.spline_radius} m; expected a positive number"
            )
        if self.sun_friction > 0.0 and self.sun_radial == 0.0:
            raise ValueError(
                f"[bearings] sun_friction is {self.sun_friction} with a sun_radial of 0 N/m; "
                "expected a positive stiffness where the spline rubs"
            )
        for side in ("upwind", "downwind"):
            clearance = getattr(self, f"{side}_clearance")
            factor = getattr(self, f"{side}_y_factor")
            if clearance > 0.0 and factor != 1.0:
                raise ValueError(
                    f"[bearings] {side}_y_factor is {factor} with a clearance of {clearance} m; "
                    "expected 1 where there is a clearance"
                )


def quill_stiffness(
    diameter: float, length: float, bore: float = 0.0, youngs_modulus: float = 210e9
) -> float:
    """Lateral stiffness ``3 E I / L^3`` of a sun on a quill that is clamped at its far end [N/m].

    Parameters
    ----------
    diameter, length, bore : float
        Of the quill [m].
    youngs_modulus : float
        [Pa].

    Examples
    --------
    >>> f"{quill_stiffness(0.105, 0.9):.2g}"
    '5.2e+06'
    """
    second_moment = math.pi / 64.0 * (diameter**4 - bore**4)
    return 3.0 * youngs_modulus * second_moment / length**3


@dataclass(frozen=True)
class ChainData:
    """Low-speed, intermediate and high-speed shaft and generator: rotations joined by mesh springs.

    Raises
    ------
    ValueError
        Where a value is negative.
    """

    sun_shaft_torsion: float = 0.92e6
    """Derived [N m/rad]: the rest that makes the gearbox 27 MN m/rad at the carrier (2011 paper,
    figure 12)."""
    low_speed_inertia: float = 30.0
    """2011 paper, figure 12 [kg m^2]."""
    intermediate_inertia: float = 3.5
    """Derived from the 88 teeth of module 5 mm, 120 mm wide [kg m^2]."""
    high_speed_inertia: float = 0.2
    """Derived from its tip radius and 84 kg (GRC) [kg m^2]."""
    generator_inertia: float = 32.0
    """2011 paper, figure 12 [kg m^2]."""
    low_teeth: tuple[int, int] = (82, 23)
    """GRC (NREL/TP-500-58190)."""
    high_teeth: tuple[int, int] = (88, 22)
    """GRC."""
    low_base_radius: float = 0.327
    """GRC: base radius of the 82 teeth, module 8.25 mm, helix 14 deg [m]."""
    high_base_radius: float = 0.2125
    """GRC: base radius of the 88 teeth, module 5 mm [m]."""
    low_stiffness: float = 3.4e9
    """Derived: ISO 6336, 20 N/(mm um) on 170 mm [N/m]."""
    high_stiffness: float = 2.2e9
    """Derived: the same on 110 mm [N/m]."""
    coupling_torsion: float = 1e6
    """Chosen: coupling of the generator [N m/rad]; 6.6e9 N m/rad seen from the carrier."""
    generator_constant: float = 1e3
    """Paper, eq. 9: K [N m s]."""

    def __post_init__(self) -> None:
        _refuse_negative(self, "chain")

    @property
    def parallel_ratio(self) -> float:
        """Generator speed over sun speed."""
        return self.low_teeth[0] / self.low_teeth[1] * self.high_teeth[0] / self.high_teeth[1]


@dataclass(frozen=True)
class MountingData:
    """The two bushings under the housing and what hangs on the main shaft.

    Raises
    ------
    ValueError
        Where a value is not finite, or is negative (`x` may be).
    """

    arm: float = 0.75
    """2011 paper, figure 5: bushings at y = +-arm [m]."""
    x: float = 0.1
    """Chosen: axial position of the bushings [m], downwind of the rim's face.

    The housing's centre is at 0.5."""
    radial_stiffness: float = 20.2e6
    """2011 paper, table 3: K1 of one bushing, y and z [N/m]."""
    axial_stiffness: float = 1e6
    """Chosen: the pins slide axially [N/m].

    A bonded bush has 1/39 to 1/2.4 of the radial stiffness, 0.5e6 to 8.3e6 (Adkins and Gent 1954,
    long and short bush of radius ratio 1.5); 20.2e6 where one reads the paper's stiffness for all
    three components. What it decides: ``carrierflex study order-one``."""
    tilt_stiffness: float = 0.0
    """Paper: "three component" bushings carry no moment. Of each bushing, about y and z [N m/rad].

    Two bushes a trunnion, each half as stiff, at +-h along x have ``radial_stiffness h^2``."""
    radial_damping: float = 4e4
    """Chosen: 1 % of k/omega of the drive train's first mode [N s/m]; the paper's 4.83e6 locks the
    mode."""
    axial_damping: float = 1e4
    """Chosen [N s/m]."""
    rotor_inertia: float = 2e5
    """2011 paper, figure 12 [kg m^2]."""
    coupling_mass: float = 4100.0
    """2011 paper: equivalent mass of the dynamometer coupling [kg]."""
    coupling_arm: float = 1.75
    """2011 paper: its distance upwind of the main bearing [m]."""
    ntl_arm: float = 1.22
    """Chosen: distance of the radial load upwind of the main bearing [m], at the hub (GRC).

    200 kN make 244 kN m, within the 300 kN m of the rig's published range; at the coupling's 1.75 m
    they would make 350."""

    def __post_init__(self) -> None:
        _refuse_negative(self, "mounting", but=("x",))


@dataclass(frozen=True)
class StageData:
    """Everything of the stage but its elastic body."""

    gear: GearData = field(default_factory=GearData)
    mesh: MeshData = field(default_factory=MeshData)
    bearings: BearingData = field(default_factory=BearingData)
    chain: ChainData = field(default_factory=ChainData)
    mounting: MountingData = field(default_factory=MountingData)
    planet: RigidPart = field(default_factory=lambda: RigidPart(147.0, 3.4, 2.2, 0.185))
    """Derived: gear 99 kg, 2.96 kg m^2, with two bearings of 24 kg; at the pins' mid-span."""
    sun: RigidPart = field(default_factory=lambda: RigidPart(110.0, 0.5, 2.0, 0.185))
    """Derived: back-scaled from a 5 MW gearbox with the same tooth numbers; transverse chosen."""
    ring: RigidPart = field(default_factory=lambda: RigidPart(509.0, 150.0, 77.0, 0.185))
    """GRC drawing; inertia of a ring of mean radius 0.54 m."""
    housing: RigidPart = field(default_factory=lambda: RigidPart(2800.0, 1000.0, 1000.0, 0.5))
    """GRC: housing parts without ring 1860 kg and the parallel stages' 943 kg; inertia and centre
    chosen."""
    planet_rollers: RollerBearingData | None = None
    """Rollers of the planet bearings, with the clearance of `bearings`; None for springs."""
    damping_ratio: float = 0.02
    """Chosen: structural damping on every elastic mode of the assembled stage, share of
    critical."""

    def __post_init__(self) -> None:
        if not 0.0 <= self.damping_ratio < 1.0:
            raise ValueError(f"damping_ratio is {self.damping_ratio}; expected 0 <= ratio < 1")

    @property
    def ratio(self) -> float:
        """Generator speed over carrier speed: 81.49."""
        return self.gear.ratio * self.chain.parallel_ratio
