"""One run on the dynamometer: what is done, what reads it, and the carrier's true motion."""

from dataclasses import dataclass

import numpy as np

from carrierflex.fe.deflection_curves import DeflectionCurve

AXIAL = "axial_displacement"
RADIAL = "radial_displacement"


@dataclass(frozen=True, eq=False)
class Sensor:
    """One displacement sensor fixed to the housing.

    Parameters
    ----------
    name : str
        Column name of its signal.
    quantity : str
        ``axial_displacement`` or ``radial_displacement``.
    angle : float
        Housing angle v [rad].
    radius : float
        Radius of the point it looks at [m].
    """

    name: str
    quantity: str
    angle: float
    radius: float

    def __post_init__(self) -> None:
        if self.quantity not in (AXIAL, RADIAL):
            raise ValueError(
                f"sensor {self.name}: quantity is '{self.quantity}'; expected {AXIAL} or {RADIAL}"
            )
        if not (self.radius > 0.0 and np.isfinite(self.angle)):
            raise ValueError(
                f"sensor {self.name}: radius {self.radius} m must be positive, angle "
                f"{self.angle} rad finite"
            )


@dataclass(frozen=True, eq=False)
class CarrierMotion:
    """Parameters of the carrier's motion and deflection in one run; symbols of the 2012 paper.

    Parameters
    ----------
    d_x : float
        Axial offset [m].
    phi_H, theta_H : float
        Tilt against the housing and the housing angle of its axis [rad].
    phi_PLC, theta_PLC : float
        Tilt against the main shaft and the carrier-frame angle of its axis [rad].
    rho_s, rho_f : float
        Scales of the stiff and the flexible deflection curve [-].
    saddle : float
        Amplitude of the static saddle of the housing's flange [m].
    """

    d_x: float
    phi_H: float
    theta_H: float
    phi_PLC: float
    theta_PLC: float
    rho_s: float
    rho_f: float
    saddle: float = 0.0


@dataclass(frozen=True, eq=False)
class RunCase:
    """What is done in one run and what the carrier does in it.

    Parameters
    ----------
    name, condition : str
        Name of the run; free text, equal for repeats.
    torque : float
        Mean torque on the main shaft about +x [N m].
    ntl_y, ntl_z : float
        Radial load at the dynamometer coupling [N].
    speed : float
        Mean speed of the carrier [rad/s].
    duration, sample_rate : float
        Length of the record [s] and samples a second [1/s].
    motion : CarrierMotion
        The truth.
    speed_ripple, torque_ripple : float
        Standard deviation of the slow ripple, relative to the mean [-].

    Raises
    ------
    ValueError
        Where the record would hold fewer than two samples or a value is out of range.
    """

    name: str
    condition: str
    torque: float
    ntl_y: float
    ntl_z: float
    speed: float
    duration: float
    sample_rate: float
    motion: CarrierMotion
    speed_ripple: float
    torque_ripple: float

    def __post_init__(self) -> None:
        if not (self.sample_rate > 0.0 and self.duration * self.sample_rate >= 2.0):
            raise ValueError(
                f"run {self.name}: duration {self.duration} s at {self.sample_rate} samples a "
                "second gives fewer "
                "than two samples"
            )
        for key in ("speed_ripple", "torque_ripple"):
            if not 0.0 <= getattr(self, key) < 0.2:
                raise ValueError(
                    f"run {self.name}: {key} is {getattr(self, key)}; expected 0 <= {key} < 0.2"
                )


def rim_factors(
    amplitude: float,
    stiff_share: float,
    torque: float,
    delta_f: DeflectionCurve,
    n_planets: int,
) -> tuple[float, float]:
    """Scales of the two deflection curves from the size and the mix of the rim's deflection.

    ``rho_f = A_n / (|c_n(delta_f)| T / T_unit)`` and ``rho_s = rho_f s / (1 - s)``, n the planets.

    Parameters
    ----------
    amplitude : float
        Amplitude A_n of the planets' order, the third of three, of ``rho_f delta_f`` at the torque
        T [m].
    stiff_share : float
        Mix ``s = rho_s / (rho_s + rho_f)`` [-].
    torque : float
        Torque T [N m].
    delta_f : DeflectionCurve
        Flexible curve.
    n_planets : int
        Planets n.

    Returns
    -------
    rho_s, rho_f : float
        Scales [-], not negative.

    Raises
    ------
    ValueError
        Where the torque or the curve's planet order is zero, or an input is out of range.
    """
    per_rho = abs(delta_f.axial_order(n_planets)) * torque / delta_f.unit_load
    if per_rho <= 0.0:
        raise ValueError(
            f"torque {torque} N m with curve {delta_f.name} bends the rim by {per_rho} m in "
            f"order {n_planets}; "
            "a positive torque and a curve with that order are needed"
        )
    if amplitude < 0.0 or not 0.0 <= stiff_share < 1.0:
        raise ValueError(
            f"rim_order3_amplitude is {amplitude} m and stiff_share {stiff_share}; "
            "expected an amplitude >= 0 and 0 <= stiff_share < 1"
        )
    rho_f = amplitude / per_rho
    return rho_f * stiff_share / (1.0 - stiff_share), rho_f
