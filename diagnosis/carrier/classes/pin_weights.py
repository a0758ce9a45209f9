"""Patterns of unequal pin loads in the proportions of the carrier's own curve of one pin.

A pin that carries more than its part bends the carrier by ``g(v - theta - alpha_i)``. What unequal
loads leave at the rim is a sum of such curves, of which the wave of one lobe is the largest: waves
with a size of their own each would pass for bumps on the face and for planets that pass.
"""

import numpy as np

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.simulation.carrier.measured_laws.rim_patterns import MODULATED, UNEVEN, Columns
from carrierflex.simulation.carrier.rim import CarrierRig

#: Points of a curve around the carrier: waves of less than half as many lobes are exact.
_POINTS = 512
_AXIAL = "axial_displacement"


def pin_weights(pattern: str, columns: Columns, rig: CarrierRig) -> FloatArray | None:
    """Weights of the columns of a pattern in what unequal pin loads can make of it.

    Parameters
    ----------
    pattern : str
        Frame and pattern.
    columns : tuple of PatternColumn
        Its columns, of one wave each.
    rig : CarrierRig
        Number of planets, and the curve ``g_f`` of one pin.

    Returns
    -------
    ndarray, shape (n_patterns, n_columns), or None
        The largest weight at the sensors of a quantity is one. None for a pattern that unequal pin
        loads do not make, and without the curve: every wave has a size of its own then.

    References
    ----------
    .. [1] 2012 paper, section 2: superposition of the single-pin curves.
    """
    if pattern not in (UNEVEN, MODULATED) or "g_f" not in rig.curves:
        return None
    lobes = np.array([column.waves[0].lobes for column in columns])
    order = np.array([column.order for column in columns])
    cosine = np.array([column.waves[0].cosine for column in columns])
    sine = np.array([column.waves[0].sine for column in columns])
    if pattern == UNEVEN:
        factors = _of_excesses(lobes, rig.n_planets)
    else:
        factors = _of_turning_shares(lobes - order)
    rows = []
    for quantity in dict.fromkeys(column.quantity for column in columns):
        shows = np.array([column.quantity == quantity for column in columns])
        G = _coefficients(rig.curves["g_f"], is_axial=quantity == _AXIAL)[lobes]
        amplitudes = shows * factors * G * np.exp(-1j * order * rig.pin_angle)
        # Of Re(A exp(j (h v - n theta))).
        weights = cosine * amplitudes.real - sine * amplitudes.imag
        rows.append(weights / np.abs(weights).max())
    return np.concatenate(rows)


def _coefficients(curve: DeflectionCurve, *, is_axial: bool) -> np.ndarray:
    """Coefficients ``g(u) = sum_h Re(G_h exp(j h u))``."""
    angle = 2.0 * np.pi / _POINTS * np.arange(_POINTS)
    values = curve.axial_at(angle) if is_axial else curve.radial_at(angle)
    return np.asarray(2.0 / _POINTS * np.fft.rfft(values))


def _of_excesses(lobes: np.ndarray, n_planets: int) -> np.ndarray:
    """Sums ``2/n sum_i e_i exp(-j h alpha_i)`` of excesses that add up to nothing.

    Shape (n_planets - 1, n_columns): ``e_i = cos(m alpha_i)`` and ``sin(m alpha_i)``.
    """
    rows = []
    for m in range(1, n_planets // 2 + 1):
        is_own, is_other = lobes % n_planets == m, lobes % n_planets == n_planets - m
        rows.append((is_own | is_other).astype(complex))
        if 2 * m < n_planets:
            rows.append(-1j * is_own + 1j * is_other)
    return np.array(rows)


def _of_turning_shares(step: np.ndarray) -> np.ndarray:
    """Sums ``2/n sum_i e_i exp(-j (h - n) beta_i)`` of shares that change once a turn.

    Shape (2, n_columns): ``e_i = cos(beta_i)`` and ``sin(beta_i)``, beta the housing angle of a
    pin; `step` is h - n, one or minus one.
    """
    return np.array([np.ones(step.size, dtype=complex), -1j * step])
