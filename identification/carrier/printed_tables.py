"""What the printed tables of the 2012 paper determine about the real machine.

With the interval that their digits allow.

The paper shows its parameters in figures only, but its root mean squares pin three of them down:
the rim deflection (table 4), the misalignment of main shaft and carrier (table 5) and the part that
neither model can follow (table 4).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

#: Half a unit of the last printed digit of tables 4 and 5 [m]; the paper prints no unit, mm is the
#: only plausible one.
HALF_DIGIT = 0.5e-6
#: Torque that the paper calls 100 % (its figure 9, and NREL/TP-5000-66594) [N m].
FULL_TORQUE = 360e3
#: Radius of the six sensors (2012 paper, section 2) [m].
SENSOR_RADIUS = 0.412

#: Share of full torque and radial load [N] of each load case (table 2).
LOAD_CASES = {"LC1": (1.0, 0.0), "LC2": (0.5, 0.0), "LC3": (1.0, -200e3), "LC4": (1.0, 200e3)}
#: RMS of measured minus identified displacement, M1 and M2 [m] (table 4).
TABLE_4 = {
    "LC1": (0.115e-3, 0.111e-3),
    "LC2": (0.095e-3, 0.094e-3),
    "LC3": (0.191e-3, 0.189e-3),
    "LC4": (0.036e-3, 0.020e-3),
}
#: RMS of measured minus simulated displacement with and without misalignment [m] (table 5).
TABLE_5 = {"LC1": (0.241e-3, 0.295e-3), "LC2": (0.085e-3, 0.182e-3), "LC4": (0.220e-3, 0.290e-3)}
#: Tilt in the joint of shaft and carrier that table 5 determines in LC1 [rad].
PHI_PLC = 0.58e-3


@dataclass(frozen=True)
class Printed:
    """A quantity derived from printed digits.

    Parameters
    ----------
    value : float
        Value from the digits as they stand.
    low, high : float
        Smallest and largest value that digits rounded to the same print allow.
    unit : str
        Unit.
    """

    value: float
    low: float
    high: float
    unit: str

    def times(self, factor: float, unit: str) -> "Printed":
        """Quantity multiplied by an exact positive factor."""
        return Printed(self.value * factor, self.low * factor, self.high * factor, unit)


@dataclass(frozen=True)
class DerivedFacts:
    """What tables 4 and 5 determine.

    Parameters
    ----------
    deflection_rms : dict of str to Printed
        RMS of the rim deflection by load case [m].
    deflection_per_torque : dict of str to Printed
        The same over the torque [m per N m].
    common_deflection_per_torque : Printed or None
        Where the intervals of all load cases meet: the deflection is proportional to the torque;
        None where they do not.
    order_3_amplitude : Printed or None
        Amplitude of a pure three-peak deflection with the common RMS [m per N m].
    phi_PLC : dict of str to Printed
        Tilt of the carrier against the main shaft by load case [rad].
    saddle_line : tuple of Printed
        Part that M2 leaves at full torque over the radial load: value without load [m], slope
        [m/N].
    saddle_zero : Printed
        Radial load at which that line crosses zero [N].
    """

    deflection_rms: dict[str, Printed]
    deflection_per_torque: dict[str, Printed]
    common_deflection_per_torque: Printed | None
    order_3_amplitude: Printed | None
    phi_PLC: dict[str, Printed]
    saddle_line: tuple[Printed, Printed]
    saddle_zero: Printed


def derived_facts(half_digit: float = HALF_DIGIT) -> DerivedFacts:
    """Derive what the printed root mean squares determine.

    M1 is nested in M2 and both are least squares, so ``rms(deflection)^2 = RMS_M1^2 - RMS_M2^2``.
    Leaving out phi_PLC adds a pure first order of amplitude ``R_s phi_PLC``, uncorrelated with the
    rest: ``(R_s phi_PLC)^2 / 2 = RMS_without^2 - RMS_with^2``. What M2 leaves is the one static
    pattern of four sensors that three static unknowns cannot follow, the saddle; at full torque its
    RMS falls on a line over the radial load.

    Parameters
    ----------
    half_digit : float
        Half a unit of the last printed digit [m].

    Returns
    -------
    DerivedFacts
        Values with intervals.
    """
    deflection = {
        case: _quadrature_difference(m1, m2, half_digit) for case, (m1, m2) in TABLE_4.items()
    }
    per_torque = {
        case: rms.times(1.0 / (LOAD_CASES[case][0] * FULL_TORQUE), "m/(N m)")
        for case, rms in deflection.items()
    }
    common = _common(list(per_torque.values()))
    tilt = {
        case: _quadrature_difference(without, included, half_digit).times(
            np.sqrt(2.0) / SENSOR_RADIUS, "rad"
        )
        for case, (included, without) in TABLE_5.items()
    }
    line, zero = _saddle_line(half_digit)
    return DerivedFacts(
        deflection_rms=deflection,
        deflection_per_torque=per_torque,
        common_deflection_per_torque=common,
        order_3_amplitude=None if common is None else common.times(np.sqrt(2.0), "m/(N m)"),
        phi_PLC=tilt,
        saddle_line=line,
        saddle_zero=zero,
    )


def _quadrature_difference(larger: float, smaller: float, half_digit: float) -> Printed:
    """``sqrt(larger^2 - smaller^2)``."""
    # Monotone in both, so its ends lie at the ends of the digits.
    low = (larger - half_digit) ** 2 - (smaller + half_digit) ** 2
    if low < 1e-12 * larger**2:  # equal to rounding: the two prints may hide the same number
        low = 0.0
    high = (larger + half_digit) ** 2 - (smaller - half_digit) ** 2
    return Printed(
        float(np.sqrt(larger**2 - smaller**2)), float(np.sqrt(low)), float(np.sqrt(high)), "m"
    )


def _common(quantities: list[Printed]) -> Printed | None:
    """Intersection of the intervals, its value the mean weighted by the inverse squared widths."""
    low, high = max(q.low for q in quantities), min(q.high for q in quantities)
    if low > high:
        return None
    weights = np.array([(q.high - q.low) ** -2.0 for q in quantities])
    mean = float(weights @ [q.value for q in quantities] / weights.sum())
    return Printed(float(np.clip(mean, low, high)), low, high, quantities[0].unit)


def _saddle_line(half_digit: float) -> tuple[tuple[Printed, Printed], Printed]:
    """Least-squares line of what M2 leaves at full torque over the radial load, and its zero."""
    # Both coefficients are linear in the printed values: the ends of their intervals are at the
    # corners of the digits.
    cases = [case for case, (share, _) in LOAD_CASES.items() if share == 1.0]
    loads = np.array([LOAD_CASES[case][1] for case in cases])
    printed = np.array([TABLE_4[case][1] for case in cases])
    corners = _corners(printed, half_digit)
    solve = np.linalg.pinv(np.column_stack([np.ones_like(loads), loads]))
    at_rest, slope = solve @ printed
    rests, slopes = solve @ corners.T
    zeros = -rests / slopes
    return (
        (
            Printed(float(at_rest), float(rests.min()), float(rests.max()), "m"),
            Printed(float(slope), float(slopes.min()), float(slopes.max()), "m/N"),
        ),
        Printed(float(-at_rest / slope), float(zeros.min()), float(zeros.max()), "N"),
    )


def _corners(values: NDArray[np.float64], half_width: float) -> NDArray[np.float64]:
    """All corners of the box ``values +- half_width``, shape (2^n, n)."""
    signs = np.stack(np.meshgrid(*[[-1.0, 1.0]] * values.size), axis=-1).reshape(-1, values.size)
    return values + half_width * signs
