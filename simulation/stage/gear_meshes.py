"""Lines of action of the planetary meshes, two a planet, drive and coast flanks.

Their stiffness over the carrier angle.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.involute_pair import InvolutePair, ring_planet_pair, sun_planet_pair
from carrierflex.geometry.parameters import GearData
from carrierflex.geometry.pins import pin_angles
from carrierflex.simulation.stage.stage_data import MeshData


@dataclass(frozen=True, eq=False)
class FlankLine:
    """One flank pair of one mesh, or a slice of it over the face width.

    Parameters
    ----------
    mate : str
        ``sun`` or ``ring``.
    planet : int
        Number, from 1 on.
    normal : ndarray, shape (3,)
        Direction of the force on the planet, carrier frame.
    point : ndarray, shape (3,)
        Pitch point at mid-width of the flank or of its slice [m].
    gap : float
        Play along the normal before the flanks touch [m].
    share : float
        Share of the mesh's stiffness.
    """

    mate: str
    planet: int
    normal: NDArray[np.float64]
    point: NDArray[np.float64]
    gap: float
    share: float = 1.0


@dataclass(frozen=True, eq=False)
class MeshStiffness:
    """Stiffness of a mesh over the carrier angle, ``k(theta) = Σ_h Re(c_h exp(j h z_r theta))``.

    Parameters
    ----------
    amplitudes : ndarray of complex, shape (n_harmonics + 1,)
        ``c_h`` [N/m]; the mean first.
    """

    amplitudes: NDArray[np.complex128]

    @property
    def mean(self) -> float:
        """[N/m]."""
        return float(self.amplitudes[0].real)

    def at(self, mesh_angle: float) -> float:
        """Stiffness [N/m] at the mesh angle ``z_r theta`` [rad]."""
        orders = np.arange(len(self.amplitudes))
        return float((self.amplitudes * np.exp(1j * orders * mesh_angle)).sum().real)


def _pair(mate: str, gear: GearData) -> InvolutePair:
    return sun_planet_pair(gear) if mate == "sun" else ring_planet_pair(gear)


def flank_line(
    mate: str,
    planet: int,
    gear: GearData,
    n_planets: int,
    *,
    x: float,
    coast: bool,
    gap: float,
) -> FlankLine:
    """Line of action of one flank pair through the pitch point.

    Drive flanks: the sun pushes the planet out and against the rotation, the ring in and against
    the rotation, as a positive torque asks; the helix adds +x at the sun and -x at the ring
    (left-handed planets, :mod:`carrierflex.fe.load_cases`). Coast flanks: the mirror image about
    the radial direction.

    Parameters
    ----------
    mate : str
        ``sun`` or ``ring``.
    planet : int
        Number, from 1 on.
    gear : GearData
        Teeth and angles.
    n_planets : int
        Planets of the stage.
    x : float
        Mid-width of the gears [m].
    coast : bool
        Which flank of the teeth.
    gap : float
        Play along the normal [m].
    """
    angle = float(pin_angles(n_planets)[planet - 1])
    e = np.array([0.0, -math.sin(angle), math.cos(angle)])
    t = np.array([0.0, -math.cos(angle), -math.sin(angle)])
    pair = _pair(mate, gear)
    alpha, beta = pair.working_pressure_angle, pair.base_helix_angle
    outward = 1.0 if mate == "sun" else -1.0
    side = 1.0 if coast else -1.0
    transverse = side * math.cos(alpha) * t + outward * math.sin(alpha) * e
    # The axial part turns with the tangential one: both change sign between the flanks of a helical
    # tooth.
    axial = -side * outward * math.sin(beta) * np.array([1.0, 0.0, 0.0])
    radius = gear.centre_distance - outward * gear.planet_pitch_diameter / 2.0
    normal = math.cos(beta) * transverse + axial
    return FlankLine(mate, planet, normal, radius * e + np.array([x, 0.0, 0.0]), gap)


def face_slices(line: FlankLine, gear: GearData, n_slices: int) -> tuple[FlankLine, ...]:
    """Slices of a flank over the face width, as many as `n_slices`.

    Points and weights of Gauss-Legendre quadrature: two or more have the moment ``b^2 / 12`` of an
    even stiffness exactly.
    """
    width = min(gear.sun_width, gear.planet_width) if line.mate == "sun" else gear.planet_width
    point, weight = np.polynomial.legendre.leggauss(n_slices)
    return tuple(
        replace(
            line, point=line.point + np.array([0.5 * width * x, 0.0, 0.0]), share=float(0.5 * share)
        )
        for x, share in zip(point, weight, strict=True)
    )


def mesh_stiffness(
    mate: str, planet: int, gear: GearData, data: MeshData, n_planets: int
) -> MeshStiffness:
    """Stiffness of one mesh.

    Tooth pairs in contact, averaged over the face width, its first harmonics.

    A spur slice has ``N(s)`` pairs in contact, a box train of mean ``eps_alpha``; the helix
    averages it over ``eps_beta`` base pitches: ``c_h = 2 k sin(pi h eps_alpha) / (pi h eps_alpha)
    sinc(h eps_beta) exp(-j h phase)``.

    Notes
    -----
    The stiffness per length of contact line is taken as constant along the path of contact.
    """
    mean = data.sun_stiffness if mate == "sun" else data.ring_stiffness
    return MeshStiffness(mean * _harmonics(mate, planet, gear, data.n_harmonics, n_planets))


@lru_cache(maxsize=32)
def _harmonics(
    mate: str, planet: int, gear: GearData, n_harmonics: int, n_planets: int
) -> NDArray[np.complex128]:
    """Amplitudes over their mean; stages of the same gears, drawn in thousands, share them."""
    pair = _pair(mate, gear)
    h = np.arange(1, n_harmonics + 1)
    ripple = 2.0 * np.sinc(h * pair.contact_ratio) * np.sinc(h * pair.overlap_ratio)
    phase = 2.0 * np.pi * mesh_phase(mate, planet, gear, n_planets)
    return np.concatenate([[1.0], ripple * np.exp(1j * h * phase)]).astype(np.complex128)


def mesh_phase(mate: str, planet: int, gear: GearData, n_planets: int) -> float:
    """Phase of a mesh against that of planet 1 with the ring, in base pitches.

    Planet i is ahead by ``z_r psi_i / 2 pi`` at the ring and behind by ``z_s psi_i / 2 pi`` at the
    sun (whose teeth come the other way in the carrier frame); on one planet sun and ring meet
    opposite flanks half a turn apart.

    References
    ----------
    Parker and Lin (2004), J. Mechanical Design 126, 525-534, table 1.
    """
    turn = (planet - 1) / n_planets
    if mate == "ring":
        return (gear.ring_teeth * turn) % 1.0
    middle = _middle_of_contact("sun", gear) - _middle_of_contact("ring", gear)
    across = gear.planet_teeth / 2.0 + _tooth_thickness_in_pitches(gear)
    return (-gear.sun_teeth * turn + across + middle) % 1.0


def _middle_of_contact(mate: str, gear: GearData) -> float:
    """Middle of the path of contact from the pitch point, in base pitches."""
    pair = _pair(mate, gear)
    return sum(pair.path_of_contact) / 2.0 / pair.base_pitch


def _tooth_thickness_in_pitches(gear: GearData, profile_shift: float = 0.39) -> float:
    """Planet's tooth thickness at its working pitch circle over the pitch there.

    Profile shift from the paper's table 3.
    """
    pair = sun_planet_pair(gear)
    reference, working = pair.transverse_pressure_angle, pair.working_pressure_angle
    half_angle = (
        math.pi / 2.0 + 2.0 * profile_shift * math.tan(gear.pressure_angle)
    ) / gear.planet_teeth
    half_angle += (math.tan(reference) - reference) - (math.tan(working) - working)
    return half_angle * gear.planet_teeth / math.pi
