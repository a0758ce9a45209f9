"""The torque curve over the pin fit, from reduced bodies alone.

One small solve a stiffness; and its mixes of two extremes.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from carrierflex.fe.carrier_curves import UNIT_TORQUE, sensor_curve
from carrierflex.fe.curve_mixes import convex_mix, least_squares_mix, nonnegative_mix
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.fe.load_cases import GearForces, PilotLoad
from carrierflex.geometry.pins import planets_of
from carrierflex.reduction.pin_joints import carrier_with_pins, drive_torque_load
from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.reduction.reduced_static import static_coordinates

#: Pilot through which the carrier is held.
FIXED_PILOT = "shaft_face"
#: Stiffnesses at which something changes are found to this relative accuracy.
_ACCURACY = 1e-4


def torque_curve(
    name: str, model: ReducedModel, loads: dict[str, PilotLoad], radius: float
) -> DeflectionCurve:
    """Static rim curve of a reduced carrier under loads that belong to 1 kN m.

    Its shaft face is fixed through the pilot.

    Parameters
    ----------
    name : str
        Name of the curve.
    model : ReducedModel
        Carrier or assembly with the sensor circle and the pilot ``shaft_face``.
    loads : dict of str to ndarray, shape (6,)
        Loads at pilots [N, N m].
    radius : float
        Radius of the sensor circle [m].

    Raises
    ------
    KeyError, LinAlgError
        From :func:`carrierflex.reduction.reduced_static.static_coordinates`.
    """
    q = static_coordinates(model, [FIXED_PILOT], loads)
    return sensor_curve(name, model.sensor_rows @ q, UNIT_TORQUE, radius)


@dataclass(frozen=True, eq=False)
class PinFitFamily:
    """The torque curves of a carrier and its pins over the stiffness of their interfaces.

    Parameters
    ----------
    carrier, pin : ReducedModel
        Carrier without pins, pin 1.
    forces : GearForces
        Of 1 kN m.
    radius : float
        Radius of the sensor circle [m].
    sliding : bool
        Whether the pins slide along x in their downwind bores.
    """

    carrier: ReducedModel
    pin: ReducedModel
    forces: GearForces
    radius: float
    sliding: bool = False

    @property
    def n_planets(self) -> int:
        """Number of the carrier's pins."""
        return planets_of(self.carrier.pilots)

    def curve(self, stiffness: float) -> DeflectionCurve:
        """Torque curve with interfaces of `stiffness` [N m/rad], from 0 to infinity."""
        model = carrier_with_pins(self.carrier, self.pin, stiffness, sliding=self.sliding)
        loads = drive_torque_load(self.forces.F_PLC, self.forces.M_t, self.n_planets)
        return torque_curve(f"{stiffness:.3g} N m/rad", model, loads, self.radius)

    @cached_property
    def ends(self) -> tuple[DeflectionCurve, DeflectionCurve]:
        """Curves of infinite and of no stiffness."""
        return self.curve(math.inf), self.curve(0.0)

    def stiffness_where(
        self, reached: Callable[[DeflectionCurve], bool], low: float, high: float
    ) -> float:
        """Lowest stiffness [N m/rad] from which on `reached` holds of the curve.

        By bisection between `low` and `high` [N m/rad].

        Raises
        ------
        ValueError
            Where it holds at `low` already or not yet at `high`.
        """
        if reached(self.curve(low)) or not reached(self.curve(high)):
            raise ValueError(
                f"nothing changes between {low:.3g} and {high:.3g} N m/rad; expected a curve that "
                "gets there in between"
            )
        while high / low > 1.0 + _ACCURACY:
            middle = float(np.sqrt(low * high))
            low, high = (low, middle) if reached(self.curve(middle)) else (middle, high)
        return high


@dataclass(frozen=True)
class PinFitRow:
    """Figures of one pin fit.

    Every residual is the RMS that a mix leaves over the RMS of the curve.
    """

    axial: str
    """Pins ``tied`` or ``sliding``.

    ``tied``: along x at both ends, as in the paper; ``sliding``: free along x downwind.
    """
    stiffness: float
    """Of every interface [N m/rad]."""
    peaks: int
    orders: Mapping[int, float]
    """Amplitude [m per kN m] of the orders N, 2 N and 3 N of N planets."""
    rms: float
    """Of the curve [m per kN m]."""
    rho_s: float
    """Share of the stiff curve in the least-squares mix.

    The shaft face is fixed through its pilot, as in the curve.
    """
    rho_f: float
    residual: float
    mix_peaks: int
    """Peaks of that mix."""
    residual_nonnegative: float
    """Of the best mix with shares of zero or more."""
    rho_s_convex: float
    """Share of the stiff curve where the shares are zero or more and add up to one."""
    residual_convex: float
    rho_s_clamped: float
    """Shares of the curves with the shaft face fixed node by node.

    ``carrierflex curves`` writes them that way.
    """
    rho_f_clamped: float
    residual_clamped: float
    rho_rigid: float
    """Shares of the sweep's own ends, infinite and no stiffness."""
    rho_free: float
    residual_ends: float


@dataclass(frozen=True, eq=False)
class ExtremeCurves:
    """Stiff and flexible curve.

    Shaft face held through its pilot, and held node by node (``clamped``).
    """

    stiff: DeflectionCurve
    flexible: DeflectionCurve
    stiff_clamped: DeflectionCurve
    flexible_clamped: DeflectionCurve


def pin_fit_row(family: PinFitFamily, stiffness: float, extremes: ExtremeCurves) -> PinFitRow:
    """Figures of the curve with interfaces of `stiffness` [N m/rad]."""
    curve = family.curve(stiffness)
    content = curve.axial_order_content()
    best = least_squares_mix(curve, extremes.stiff, extremes.flexible)
    convex = convex_mix(curve, extremes.stiff, extremes.flexible)
    clamped = least_squares_mix(curve, extremes.stiff_clamped, extremes.flexible_clamped)
    ends = least_squares_mix(curve, *family.ends)
    return PinFitRow(
        axial="sliding" if family.sliding else "tied",
        stiffness=stiffness,
        peaks=len(curve.peak_angles()),
        orders={order: float(content[order]) for order in family.n_planets * np.array([1, 2, 3])},
        rms=curve.rms,
        rho_s=best.rho_s,
        rho_f=best.rho_f,
        residual=best.residual,
        mix_peaks=len(best.curve.peak_angles()),
        residual_nonnegative=nonnegative_mix(curve, extremes.stiff, extremes.flexible).residual,
        rho_s_convex=convex.rho_s,
        residual_convex=convex.residual,
        rho_s_clamped=clamped.rho_s,
        rho_f_clamped=clamped.rho_f,
        residual_clamped=clamped.residual,
        rho_rigid=ends.rho_s,
        rho_free=ends.rho_f,
        residual_ends=ends.residual,
    )
