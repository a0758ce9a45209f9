"""Forces without memory, by the truth's own equations, per unit of their size.

Arguments are the deflection s and the speed w, both over the largest of the motion. Every law is
changed in form by a smooth random sum of sines d, which stays in the law's class:

====================== ============================================ ==============================
class                  laws                                         changed form
====================== ============================================ ==============================
restoring force        powers, hyperbolic sine, rounded dead zone,  g(s) + d(s)
                       one-sided stop, Hertz contact, periodic
dissipation            powers, dry friction that creeps             g(w) + d(w)
                       (Stribeck, unequal directions), displaced
                       hyperbolic tangent
coupled damping        h(s) w: square, exponential, bump            h(s) (1 + d(s)) w
force surface          dry friction or orifice whose level          g(s, w) (1 + d(s))
                       depends on the deflection, visco-elastic
                       stop
slow change            of stiffness, damping or preload             profile(t) (1 + d(t))
====================== ============================================ ==============================
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: Laws by number; below 100 without memory.
STATIC_LAWS = {
    "form_of_deflection": 1, "form_of_speed": 2,
    "odd_power_spring": 10, "even_power_spring": 11, "hyperbolic_spring": 12, "dead_zone": 13,
    "one_sided_contact": 14, "periodic_spring": 15,
    "power_damper": 20, "creeping_friction": 21, "displaced_tanh": 22,
    "square_coupling": 30, "exponential_coupling": 31, "bump_coupling": 32,
    "position_dependent_friction": 40, "metered_orifice": 41, "visco_elastic_stop": 42,
    "warming_spring": 50, "drifting_damper": 51, "drifting_preload": 52,
    "fast_parametric_spring": 60,
}  # fmt: skip
#: Speed at which dry friction is three quarters of its level, over the largest speed.
_CREEP = 0.002
_CORNER = 0.03

_inline = njit(cache=True, inline="always")


@njit(cache=True)
def changed_form(form: FloatArray, s: float) -> float:
    """Smooth random function ``sum_k a_k sin(b_k s + c_k)``.

    Parameters
    ----------
    form : ndarray, shape (3, n)
        Amplitudes a, wave numbers b, phases c.
    s : float
        Argument, within about -1 to 1.

    Returns
    -------
    float
        Value.
    """
    total = 0.0
    for k in range(form.shape[1]):
        total += form[0, k] * np.sin(form[1, k] * s + form[2, k])
    return total


@_inline
def _restoring(law: int, p: FloatArray, s: float) -> float:
    if law == 10:
        return np.sign(s) * abs(s) ** p[0]
    if law == 11:
        return abs(s) ** p[0]
    if law == 12:
        return np.sinh(p[0] * s) / np.sinh(p[0])
    if law == 13:
        corner = _CORNER * p[0]
        over = np.logaddexp(0.0, (s - p[0]) / corner) - np.logaddexp(0.0, (-s - p[0]) / corner)
        return corner * over - s
    if law == 14:
        return max(p[2] * s - p[0], 0.0) ** p[1] * p[2]
    return np.sin(p[0] * s + p[1])


@_inline
def _dissipation(law: int, p: FloatArray, w: float) -> float:
    if law == 20:
        return w * (w * w + 1e-4) ** (0.5 * (p[0] - 1.0))
    if law == 21:
        level = 1.0 + p[0] * np.exp(-((w / p[1]) ** 2))
        if w < 0.0:
            level *= p[2]
        return level * np.tanh(w / _CREEP)
    return np.tanh((w - p[0]) / p[1])


@_inline
def _coupling(law: int, p: FloatArray, s: float) -> float:
    if law == 30:
        return s * s
    if law == 31:
        return np.exp(p[0] * s)
    return np.exp(-(((s - p[0]) / p[1]) ** 2))


@_inline
def _surface(law: int, p: FloatArray, s: float, w: float) -> float:
    if law == 40:
        return (1.0 + p[0] * np.tanh(2.0 * s)) * np.tanh(w / _CREEP)
    if law == 41:
        return np.exp(p[0] * s) * w * abs(w)
    # A stop with a damper of its own pushes only, and cannot hold the mass back.
    return max(s - p[0] + p[1] * w, 0.0) if s > p[0] else 0.0


@_inline
def _changing(law: int, p: FloatArray, s: float, w: float, t: float) -> float:
    """Parameters that change slowly with time; p[0] is the time they take."""
    if law == 50:
        return -(1.0 - np.exp(-t / p[0])) * s
    if law == 51:
        return t / p[0] * w
    return np.tanh(2.0 * t / p[0] - 1.0)


@njit(cache=True)
def static_force(law: int, p: FloatArray, form: FloatArray, s: float, w: float, t: float) -> float:
    """Force of a law without memory, per unit of its size.

    Parameters
    ----------
    law : int
        Number of the law.
    p : ndarray, shape (6,)
        Its parameters.
    form : ndarray, shape (3, n)
        Its change of form.
    s, w : float
        Deflection and speed over the largest of the motion.
    t : float
        Time [s].

    Returns
    -------
    float
        Force.
    """
    if law == 1:
        return changed_form(form, s)
    if law == 2:
        return changed_form(form, w)
    if law < 20:
        return _restoring(law, p, s) + changed_form(form, s)
    if law < 30:
        return _dissipation(law, p, w) + changed_form(form, w)
    if law < 40:
        return _coupling(law, p, s) * (1.0 + changed_form(form, s)) * w
    if law < 50:
        return _surface(law, p, s, w) * (1.0 + changed_form(form, s))
    if law < 60:
        return _changing(law, p, s, w, t) * (1.0 + changed_form(form, 2.0 * t / p[1] - 1.0))
    return np.sin(p[0] * t) * s
