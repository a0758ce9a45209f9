"""Motion of the housing under its loads.

Integrated by a fixed-step Runge-Kutta method, with every force at its own bushing.

Radial forces beside the linear ones are by other equations than the library's; hardening springs
are stacks of leaves: straight between steps of an eighth of the deflection's size. A main bearing
that gives way is a spring and damper at its two coordinates.

================ ============================================================================
damping          of the deflection: a hyperbolic function whose first term is its square
elasto-plastic   Bouc-Wen with a sharp knee (exponent 10)
Maxwell branch   two branches whose time constants lie 10 % about the named one
warming spring   loses stiffness with time
================ ============================================================================
"""

from dataclasses import dataclass, field

import numpy as np
from numba import njit
from numpy.typing import NDArray

from carrierflex.blind_check.truth.mounting.form_laws import (
    N_PARAMETERS,
    N_STATES,
    form_force,
)
from carrierflex.blind_check.truth.mounting.rig import N_FREE, RIG, Bodies

FloatArray = NDArray[np.float64]

#: Laws by number; the parameters are p0, p1 and the deflection, speed that shape the other form.
LAWS = {
    "deflection_dependent_damping": 6,
    "elasto_plastic_friction": 11,
    "maxwell_branch": 12,
    "softening_in_time": 13,
}
#: Laws of leaves, beside those of element_laws: power of the deflection.
LEAVES = {"cubic_stiffness": 103, "quintic_stiffness": 105}
_LEAF = 0.125  # of the deflection's size
#: Integration steps in a sample of the record, and where only sizes are sought.
FINE, COARSE = 20, 8
#: Largest step of a bearing that gives way, times its circular frequency (Runge-Kutta: below 2.8).
_BEARING_STEP = 2.0
_BEARING_DAMPING = 0.03
#: Part of a step at which each slope of the Runge-Kutta rule is taken.
_RUNGE_KUTTA_NODES = (0.0, 0.5, 0.5, 1.0)


_HYPERBOLIC = 0.6  # argument of the hyperbolic functions at the deflection's size


@dataclass(frozen=True, eq=False)
class Bushings:
    """True bushings and bearing.

    Parameters
    ----------
    K1, C1 : float
        Radial stiffness and damping of each bushing.
    k_x, c_x : float
        Axial stiffness and damping of each.
    excess : float
        Starboard forces are 1 + excess, port ones 1 - excess times the mean.
    compliance : float
        Radial compliance of the main bearing [m/N].
    laws : tuple of (int, ndarray of 4, ndarray of 2)
        Forces of every bushing beside the linear ones: number, parameters, deflection and speed
        that shape it.
    forms : tuple of ndarray
        Forces of other forms (:mod:`carrierflex.blind_check.truth.mounting.form_laws`).
    """

    K1: float
    C1: float
    k_x: float = RIG["bushing_axial_stiffness"]
    c_x: float = RIG["bushing_axial_damping"]
    excess: float = 0.0
    compliance: float = 0.0
    laws: tuple[tuple[int, FloatArray, FloatArray], ...] = field(default=())
    forms: tuple[FloatArray, ...] = field(default=())


@njit(cache=True)
def leaf_force(stiffness: float, size: float, power: int, u: float) -> float:
    """Force ``stiffness u^power`` at multiples of an eighth of `size`, straight between them."""
    h = _LEAF * size
    n = np.floor(abs(u) / h)
    low, high = stiffness * (n * h) ** power, stiffness * ((n + 1.0) * h) ** power
    return np.copysign(low + (high - low) * (abs(u) / h - n), u)


def housing_motion(
    bodies: Bodies, bushings: Bushings, loads: FloatArray, step: float, *, fine: int = FINE
) -> FloatArray:
    """Sensor signals of a run from rest, not zeroed.

    Parameters
    ----------
    bodies : Bodies
        Rig.
    bushings : Bushings
        Its bushings.
    loads : ndarray, shape (n, 3)
        True torque, ntl_y, ntl_z, straight between samples.
    step : float
        Sampling interval [s].
    fine : int
        Integration steps in a sample at least; more where the bearing is stiff.

    Returns
    -------
    ndarray, shape (n, 6)
        Signals [m].

    Raises
    ------
    ArithmeticError
        Where a force is too stiff for the step, so that the motion grows without bound.
    """
    free = N_FREE if bushings.compliance > 0.0 else N_FREE - 2
    share = np.array([1.0 + bushings.excess, 1.0 - bushings.excess])
    radial, axial = bodies.radial[:, :free], bodies.axial[:, :free]
    weights, ends = np.tile(share, 2), axial.T * share
    K = bushings.K1 * (radial.T * weights) @ radial + bushings.k_x * ends @ axial
    C = bushings.C1 * (radial.T * weights) @ radial + bushings.c_x * ends @ axial
    for i in range(N_FREE - 2, free):
        K[i, i] += 1.0 / bushings.compliance
        C[i, i] += 2.0 * _BEARING_DAMPING * np.sqrt(bodies.M[i, i] / bushings.compliance)
        fastest = 1.0 / np.sqrt(bodies.M[i, i] * bushings.compliance)
        fine = max(fine, int(np.ceil(fastest * step / _BEARING_STEP)))
    inverse = np.linalg.inv(bodies.M[:free, :free])
    names = np.array([law for law, _, _ in bushings.laws], dtype=np.float64)
    p = np.array([parameters for _, parameters, _ in bushings.laws]).reshape(-1, 4)
    size = np.array([sizes for _, _, sizes in bushings.laws]).reshape(-1, 2)
    forces = np.ascontiguousarray(loads @ bodies.loads[:free].T)
    system = (inverse, K, C, np.ascontiguousarray(radial), weights)
    forms = np.array(bushings.forms).reshape(-1, N_PARAMETERS)
    q = _march(system, forces, step, names, p, size, forms, fine)
    if not np.isfinite(q).all():
        raise ArithmeticError(
            f"the housing's motion grows without bound at {fine} steps a sample; expected a softer "
            "force"
        )
    return np.asarray(q @ bodies.sensors[:, :free].T)


@njit(cache=True)
def _along(row, q):  # type: ignore[no-untyped-def]
    """Deflection of an element; written out as the sums below."""
    total = 0.0
    for i in range(q.size):
        total += row[i] * q[i]
    return total


@njit(cache=True)
def _acceleration(  # type: ignore[no-untyped-def]
    system, force, x, t, names, p, size, forms, total, rate
):
    """Rates of the state ``q, q', memories``; `rate` is filled, `total` is room for the forces."""
    inverse, K, C, rows, weights = system
    n = K.shape[0]
    q, v = x[:n], x[n : 2 * n]
    # Written out: a call of BLAS for so small a matrix costs ten times the sums.
    for i in range(n):
        total[i] = force[i]
        for j in range(n):
            total[i] -= K[i, j] * q[j] + C[i, j] * v[j]
    for law in range(names.size):
        for element in range(rows.shape[0]):
            u, u_rate = 0.0, 0.0
            for i in range(n):
                u += rows[element, i] * q[i]
                u_rate += rows[element, i] * v[i]
            if names[law] > 100:
                f = leaf_force(p[law, 0], size[law, 0], int(names[law] - 100), u)
            else:
                at = 2 * n + 2 * (law * rows.shape[0] + element)
                f = _law_force(
                    names[law], p[law], size[law], u, u_rate, x[at : at + 2], t, rate[at : at + 2]
                )
            for i in range(n):
                total[i] -= rows[element, i] * weights[element] * f
    first = 2 * n + 2 * names.size * rows.shape[0]
    for form in range(forms.shape[0]):
        for bushing in range(2):
            # Rows are starboard and port along z, then along y.
            u_zy = _along(rows[bushing + 2], q), _along(rows[bushing], q)
            v_zy = _along(rows[bushing + 2], v), _along(rows[bushing], v)
            at = first + N_STATES * (2 * form + bushing)
            f = form_force(
                forms[form], bushing, u_zy, v_zy, t, x[at : at + N_STATES], rate[at : at + N_STATES]
            )
            for i in range(n):
                push = rows[bushing + 2, i] * f[0] + rows[bushing, i] * f[1]
                total[i] -= weights[bushing] * push
    for i in range(n):
        rate[i], rate[n + i] = v[i], 0.0
        for j in range(n):
            rate[n + i] += inverse[i, j] * total[j]


@njit(cache=True)
def _last_at_rest(forces):  # type: ignore[no-untyped-def]
    """Sample before the first force: nothing moves until then."""
    for sample in range(forces.shape[0]):
        for i in range(forces.shape[1]):
            if forces[sample, i] != 0.0:
                return max(sample - 1, 0)
    return forces.shape[0] - 1


@njit(cache=True)
def _march(system, forces, step, names, p, size, forms, fine):  # type: ignore[no-untyped-def]
    """Classical Runge-Kutta rule of fourth order, `fine` steps in a sample."""
    n_samples, n = forces.shape
    states = 2 * names.size * system[3].shape[0] + 2 * N_STATES * forms.shape[0]
    x = np.zeros(2 * n + states)
    stage, slopes = np.zeros(x.size), np.zeros((4, x.size))
    # Every array is made once: an array made in a step costs as much as the sums on it.
    rise = np.empty(n)
    force = np.empty(n)
    total = np.empty(n)
    q, h = np.zeros((n_samples, n)), step / fine
    for sample in range(_last_at_rest(forces), n_samples - 1):
        for i in range(n):
            rise[i] = (forces[sample + 1, i] - forces[sample, i]) / fine
        for within in range(fine):
            t = (sample * fine + within) * h
            for number in range(4):
                law_part = _RUNGE_KUTTA_NODES[number]
                for i in range(n):
                    force[i] = forces[sample, i] + within * rise[i] + law_part * rise[i]
                for i in range(x.size):
                    stage[i] = x[i] + law_part * h * slopes[number - 1, i] if number else x[i]
                _acceleration(
                    system,
                    force,
                    stage,
                    t + law_part * h,
                    names,
                    p,
                    size,
                    forms,
                    total,
                    slopes[number],
                )
            for i in range(x.size):
                both = slopes[0, i] + 2.0 * slopes[1, i] + 2.0 * slopes[2, i] + slopes[3, i]
                x[i] += h / 6.0 * both
        q[sample + 1] = x[:n]
        if not np.isfinite(x[: 2 * n]).all():
            # A place or speed that is no number leaves none to all places behind it.
            q[sample + 2 :] = np.nan
            break
    return q


@njit(cache=True)
def _law_force(
    law: int,
    p: FloatArray,
    size: FloatArray,
    q: float,
    v: float,
    memory: FloatArray,
    t: float,
    rate: FloatArray,
) -> float:
    """Force of a law and the rates of its memory."""
    rate[0] = rate[1] = 0.0
    if law == 11:
        share = (abs(memory[0]) * p[0] / p[1]) ** 10
        rate[0] = v - (share * v if v * memory[0] > 0.0 else 0.0)
        return p[0] * memory[0]
    if law == 12:
        rate[0], rate[1] = v - memory[0] / (0.9 * p[1]), v - memory[1] / (1.1 * p[1])
        return 0.5 * p[0] * (memory[0] + memory[1])
    if law == 13:  # the spring loses stiffness as it warms
        return -p[0] * (1.0 - np.exp(-t / p[1])) * q
    b = _HYPERBOLIC / size[0]
    return 2.0 * p[0] * (np.cosh(b * q) - 1.0) / b**2 * v
