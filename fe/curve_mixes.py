"""How well a mix of the two extreme curves stands for a third.

``rho_s delta_s + rho_f delta_f`` (2012 paper, section 2.2).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from carrierflex.fe.deflection_curves import DeflectionCurve


@dataclass(frozen=True, eq=False)
class CurveMix:
    """A mix of two axial curves and what it leaves of a third."""

    rho_s: float
    """Share of the stiff curve."""
    rho_f: float
    """Share of the flexible curve."""
    curve: DeflectionCurve
    """The mix."""
    residual: float
    """RMS of the difference over the RMS of the third curve."""


#: Finds a mix of the second and third curve that stands for the first.
MixRule = Callable[[DeflectionCurve, DeflectionCurve, DeflectionCurve], CurveMix]


def least_squares_mix(
    curve: DeflectionCurve, stiff: DeflectionCurve, flexible: DeflectionCurve
) -> CurveMix:
    """Shares of any size and sign that leave the smallest RMS, what identification finds of a long clean record.

    Raises
    ------
    ValueError
        Where the curves belong to different circles or loads, or `curve` is zero.
    """
    A = _columns(curve, stiff, flexible)
    shares = np.asarray(np.linalg.lstsq(A, curve.axial, rcond=None)[0], dtype=np.float64)
    return _mix(curve, stiff, flexible, shares)


def nonnegative_mix(
    curve: DeflectionCurve, stiff: DeflectionCurve, flexible: DeflectionCurve
) -> CurveMix:
    """Shares that leave the smallest RMS with neither below zero.

    Errors as in :func:`least_squares_mix`.
    """
    A = _columns(curve, stiff, flexible)
    # Curves are some 1e-7 m high: the solver's own tolerances are absolute.
    scale = float(np.linalg.norm(curve.axial))
    return _mix(curve, stiff, flexible, scipy.optimize.nnls(A / scale, curve.axial / scale)[0])


def convex_mix(
    curve: DeflectionCurve, stiff: DeflectionCurve, flexible: DeflectionCurve
) -> CurveMix:
    """Shares that leave the smallest RMS with neither below zero and a sum of one.

    Errors as in :func:`least_squares_mix`.
    """
    _columns(curve, stiff, flexible)
    difference = stiff.axial - flexible.axial
    size = float(difference @ difference)
    share = float(difference @ (curve.axial - flexible.axial)) / size if size else 0.0
    share = min(1.0, max(0.0, share))
    return _mix(curve, stiff, flexible, np.array([share, 1.0 - share]))


def _columns(
    curve: DeflectionCurve, stiff: DeflectionCurve, flexible: DeflectionCurve
) -> NDArray[np.float64]:
    for other in (stiff, flexible):
        for name in ("radius", "unit_load"):
            if getattr(other, name) != getattr(curve, name):
                raise ValueError(
                    f"curves {curve.name} and {other.name} have {name} {getattr(curve, name)} and {getattr(other, name)}; "
                    "expected the same"
                )
        if other.axial.size != curve.axial.size:
            raise ValueError(
                f"curves {curve.name} and {other.name} have {curve.axial.size} and {other.axial.size} samples; expected as many"
            )
    if not curve.axial.any():
        raise ValueError(f"curve {curve.name} is zero everywhere; expected a deflection")
    return np.stack([stiff.axial, flexible.axial], axis=1)


def _mix(
    curve: DeflectionCurve,
    stiff: DeflectionCurve,
    flexible: DeflectionCurve,
    shares: NDArray[np.float64],
) -> CurveMix:
    rho_s, rho_f = (float(share) for share in shares)
    mixed = replace(
        curve,
        name=f"{rho_s:.3g} {stiff.name} + {rho_f:.3g} {flexible.name}",
        axial=rho_s * stiff.axial + rho_f * flexible.axial,
        radial=rho_s * stiff.radial + rho_f * flexible.radial,
    )
    residual = float(np.linalg.norm(curve.axial - mixed.axial) / np.linalg.norm(curve.axial))
    return CurveMix(rho_s, rho_f, mixed, residual)
