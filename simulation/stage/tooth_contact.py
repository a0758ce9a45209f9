"""Contact pressure of a gear mesh by slices of the face width.

Thin-slice tooth springs and Hertz line contact.

A tooth pair touches along lines that run across the face width (helical teeth). Every slice of
every line is a spring of the tooth stiffness per width, all pressed together by one approach in the
plane of action; a misaligned axis, crowning and tip relief hold slices apart. Slices do not support
one another, as in ISO 6336-1.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.involute_pair import InvolutePair

#: Exponent of the pitting life over the contact stress (AGMA stress cycle factor, 2012 paper eq.
#: 10).
LIFE_EXPONENT = 1.0 / 0.056


@dataclass(frozen=True)
class ToothFlank:
    """Flank modifications and stiffness of one mesh.

    Parameters
    ----------
    stiffness_per_width : float
        Stiffness of one tooth pair over the face width in the plane of action, normal to the flank
        [N/m^2]. Default 14 N/(mm um), ISO 6336-1's c' of steel gears.
    crowning : float
        Height of the parabola at the ends of the face width [m].
    tip_relief : float
        Material taken off at the tips, both wheels, normal to the flank [m].
    tip_relief_share : float
        Share of the path of contact that each tip relief takes, from its end.
    effective_modulus : float
        ``1 / ((1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2)`` [Pa]; default steel on steel.

    Raises
    ------
    ValueError
        Where a value is negative, or the two reliefs overlap.
    """

    stiffness_per_width: float = 14e9
    crowning: float = 10e-6
    tip_relief: float = 20e-6
    tip_relief_share: float = 0.2
    effective_modulus: float = 210e9 / (2.0 * (1.0 - 0.3**2))

    def __post_init__(self) -> None:
        for name in ("stiffness_per_width", "effective_modulus"):
            if not getattr(self, name) > 0.0:
                raise ValueError(
                    f"ToothFlank.{name} is {getattr(self, name)}; expected a positive number"
                )
        for name in ("crowning", "tip_relief", "tip_relief_share"):
            if not getattr(self, name) >= 0.0:
                raise ValueError(
                    f"ToothFlank.{name} is {getattr(self, name)}; expected zero or more"
                )
        if self.tip_relief_share > 0.5:
            raise ValueError(
                f"ToothFlank.tip_relief_share is {self.tip_relief_share}; expected at most 0.5, or "
                "the reliefs overlap"
            )


@dataclass(frozen=True, eq=False)
class MeshContact:
    """Contact of one mesh through one base pitch.

    Parameters
    ----------
    phase : ndarray, shape (n_phases,)
        Advance of the mesh in base pitches, 0 to 1.
    approach : ndarray, shape (n_phases,)
        Approach of the wheels in the plane of action [m]: loaded transmission error.
    pressure : ndarray, shape (n_phases, n_lines, n_slices)
        Largest Hertz pressure [Pa]; 0 where a slice does not touch.
    line_load : ndarray, shape (n_phases, n_lines, n_slices)
        Load over the length of the contact line [N/m].
    face_position : ndarray, shape (n_slices,)
        Centre of every slice, from the middle of the face width [m].
    """

    phase: NDArray[np.float64]
    approach: NDArray[np.float64]
    pressure: NDArray[np.float64]
    line_load: NDArray[np.float64]
    face_position: NDArray[np.float64]

    @property
    def largest_pressure(self) -> float:
        """Over all phases, lines and slices [Pa]."""
        return float(self.pressure.max())

    @property
    def face_load_factor(self) -> float:
        """``K_Hbeta = max(w) / mean(w)`` of the load w per face width, mean over a base pitch.

        References
        ----------
        ISO 6336-1:2019, 7.1; from slices, so that crowning and lost contact are in it.
        """
        w = self.line_load.sum(axis=1).mean(axis=0)
        return float(w.max() / w.mean())


def mesh_contact(
    pair: InvolutePair,
    flank: ToothFlank,
    tangential_force: float,
    *,
    misalignment: float = 0.0,
    n_slices: int = 60,
    n_phases: int = 40,
) -> MeshContact:
    """Distribute the load of one mesh over its contact lines and find the pressure.

    Parameters
    ----------
    pair : InvolutePair
        Gear geometry.
    flank : ToothFlank
        Modifications and stiffness.
    tangential_force : float
        Force at the working pitch circle [N].
    misalignment : float
        Slope of the gap over the face width in the plane of action [rad].
    n_slices, n_phases : int
        Slices of the face width, and mesh positions within one base pitch.

    Returns
    -------
    MeshContact
        Pressure and load of every slice.

    Raises
    ------
    ValueError
        Where the force is not positive or the misalignment is not finite.
    """
    if not (math.isfinite(tangential_force) and tangential_force > 0.0):
        raise ValueError(f"tangential force is {tangential_force} N; expected a positive number")
    if not math.isfinite(misalignment):
        raise ValueError(f"misalignment is {misalignment} rad; expected a finite angle")
    width = pair.face_width / n_slices
    x = (np.arange(n_slices, dtype=np.float64) + 0.5) * width - 0.5 * pair.face_width
    phase = np.arange(n_phases, dtype=np.float64) / n_phases
    s = _line_positions(pair, phase, x)
    gap = (
        misalignment * x
        + flank.crowning * (2.0 * x / pair.face_width) ** 2
        + _relief(pair, flank, s)
    )
    begin, end = pair.path_of_contact
    gap = np.where((s >= begin) & (s <= end), gap, np.inf)
    normal_force = tangential_force / (
        math.cos(pair.working_pressure_angle) * math.cos(pair.base_helix_angle)
    )
    approach = np.array(
        [
            _approach(clearance, normal_force / (flank.stiffness_per_width * width))
            for clearance in gap
        ]
    )
    penetration = np.maximum(approach[:, None, None] - gap, 0.0)
    # A slice of the face width holds a piece of contact line that is 1/cos(beta_b) longer.
    line_load = flank.stiffness_per_width * penetration * math.cos(pair.base_helix_angle)
    curvature = _relative_curvature(pair, np.clip(s, begin, end))
    pressure = np.sqrt(line_load * flank.effective_modulus * curvature / math.pi)
    return MeshContact(phase, approach, pressure, line_load, x)


def life_ratio(pressure_ratio: float) -> float:
    """Pitting life over the life before, from contact pressures (2012 paper, eqs 10 and 11).

    The paper inserts the stress ratio where eq. 10 defines a ratio of strengths; the number is the
    same.

    Raises
    ------
    ValueError
        Where the ratio is not positive.

    Examples
    --------
    >>> round(life_ratio(1.015), 2)
    0.77
    """
    if not pressure_ratio > 0.0:
        raise ValueError(f"pressure ratio is {pressure_ratio}; expected a positive number")
    return float(pressure_ratio**-LIFE_EXPONENT)


def _line_positions(
    pair: InvolutePair, phase: NDArray[np.float64], x: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Position of every slice of every contact line on the path of contact.

    Shape (n_phases, n_lines, n_slices).
    """
    begin, end = pair.path_of_contact
    across = pair.face_width * math.tan(pair.base_helix_angle)
    n_lines = math.ceil((end - begin + across) / pair.base_pitch) + 1
    lines = np.arange(n_lines)
    first = begin - 0.5 * across
    return (
        first
        + (phase[:, None, None] + lines[None, :, None]) * pair.base_pitch
        + math.tan(pair.base_helix_angle) * x
    )


def _relief(pair: InvolutePair, flank: ToothFlank, s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Linear relief towards both ends of the path of contact [m]."""
    if flank.tip_relief_share == 0.0:
        return np.zeros_like(s)
    begin, end = pair.path_of_contact
    length = flank.tip_relief_share * (end - begin)
    beyond = np.maximum(np.maximum(begin + length - s, s - (end - length)), 0.0)
    return flank.tip_relief * beyond / length


def _approach(gap: NDArray[np.float64], load: float) -> float:
    """Approach at which ``sum(max(approach - gap, 0)) = load``.

    Exact, as the sum is piecewise linear.
    """
    gaps = np.sort(gap[np.isfinite(gap)], axis=None)
    approaches = (load + np.cumsum(gaps)) / np.arange(1, gaps.size + 1)
    touching = np.append(approaches[:-1] <= gaps[1:], True)
    return float(approaches[np.argmax(touching)])


def _relative_curvature(pair: InvolutePair, s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sum of the curvatures in the normal section [1/m]; a ring's is negative."""
    first, second = pair.tangent_lengths
    return math.cos(pair.base_helix_angle) * (1.0 / (first + s) + 1.0 / (second - s))
