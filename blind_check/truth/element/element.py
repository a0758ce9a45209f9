"""One element of the truth: its laws, its drive's and sensor's faults, and what it answers."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.signal import lfilter

from carrierflex.blind_check.truth.element.drives import Drive, Lines, Release, drive_motion
from carrierflex.blind_check.truth.element.static_laws import changed_form, static_force

FloatArray = NDArray[np.float64]

#: Steps of the truth in one sample, and samples in one period of the natural frequency.
FINE = 24
PER_PERIOD = 32
N_FORM = 4


#: Laws with inner states by number, each by the truth's own equation, per unit of its size:
#: hysteresis whose loop does not depend on the rate (Bouc-Wen that softens, hardens or is pinched,
#: Iwan's sliders in parallel, an elasto-plastic slider, play with friction), LuGre's bristles,
#: Maxwell branches; outside every class a tuned mass, friction that its own heat softens, a
#: nonlinear spring in series with a dashpot, and a spring that the damper's heat softens.
#: Hysteresis is changed in form as N(z) = z + d(z), which keeps it free of rate, play in its
#: flanks, LuGre's friction as a function of the speed.
MEMORY_LAWS = {
    "bouc_wen": 100, "pinched_bouc_wen": 101, "iwan": 102, "elasto_plastic": 103,
    "play_with_friction": 104,
    "lugre": 110,
    "maxwell_branches": 120,
    "tuned_mass": 130, "heated_friction": 131, "spring_and_dashpot": 132, "heated_spring": 133,
}  # fmt: skip
#: Inner states that every law is given; Iwan's sliders need most.
_N_MEMORY = 10
_inline = njit(cache=True, inline="always")


@dataclass(frozen=True, eq=False)
class Law:
    """A law with its numbers.

    `p`, `form` and `scale` as :func:`carrierflex.blind_check.truth.element.integration.law_force`.
    """

    number: int
    p: FloatArray
    form: FloatArray
    scale: FloatArray

    def along(self, q: FloatArray, v: FloatArray, step: float) -> FloatArray:
        """Force along a deflection and its speed at the truth's own steps, shape (n,)."""
        force = force_along(q, v, step, self.number, self.p, self.form, self.scale)
        return np.asarray(force)


@dataclass(frozen=True, eq=False)
class DriveSide:
    """What is wrong between the force that is said and the force that is there.

    ``amplitude (g(u / largest) + d(u / largest))`` is added to the force u; `name` is that of the
    cause, `p` its parameter, `form` the change d.
    """

    name: str
    p: float
    form: FloatArray
    largest: float
    amplitude: float

    def added(self, force: FloatArray) -> FloatArray:
        """Force that is added."""
        u = force / self.largest
        if self.name == "saturation":
            bend = np.tanh(self.p * u) / self.p - u
        elif self.name == "unequal_gain":
            bend = np.sqrt(u * u + 1e-4)
        else:
            bend = -np.tanh(u / self.p)
        size, waves, phases = self.form[:, :, None]
        changed = (size * np.sin(waves * u + phases)).sum(axis=0)
        return np.asarray(self.amplitude * (bend + changed))


@dataclass(frozen=True, eq=False)
class Element:
    """One element under its drive.

    `base` mass, stiffness, damping, constant force; `omega` natural frequency [rad/s]; `by_force`
    whether its motion is free under a force (no force at all in a decay); `delay`, `lag` dead time
    and time constant [s] of its sensor; `disturbance` an unmeasured force of every run.
    """

    base: FloatArray
    omega: float
    by_force: bool
    laws: tuple[Law, ...] = ()
    delay: float = 0.0
    lag: float = 0.0
    drive_side: DriveSide | None = None
    disturbance: tuple[Lines, ...] = ()

    @property
    def step(self) -> float:
        """Sampling interval [s]."""
        return 2.0 * np.pi / self.omega / PER_PERIOD

    @property
    def damping_ratio(self) -> float:
        """Damping over the critical one."""
        return float(self.base[2] / (2.0 * self.base[0] * self.omega))

    def channel(self, drive: Drive, run: int, n: int) -> FloatArray:
        """Deflection, or force of a driven element, of one run without noise, shape (n,)."""
        fine = self.motion(drive, run, n) if self.by_force else self._driven_force(drive, run, n)
        return self.sensed(fine, n)

    def sensed(self, fine: FloatArray, n: int) -> FloatArray:
        """What its sensor shows of a signal at the truth's own steps, shape (n,)."""
        if self.lag > 0.0:
            keep = np.exp(-self.step / FINE / self.lag)
            fine = lfilter([1.0 - keep], [1.0, -keep], fine, zi=[keep * fine[0]])[0]
        at = (np.arange(n) - self.delay / self.step) * FINE
        return np.asarray(np.interp(at, np.arange(fine.size), fine))

    def motion(self, drive: Drive, run: int, n: int, added: FloatArray | None = None) -> FloatArray:
        """Deflection at the truth's own steps under a force, or after a release.

        `added` is a further force at these steps.
        """
        step = self.step / FINE
        time = step / 3.0 * np.arange(3.0 * (n - 1) * FINE + 1.0)
        force = drive.at(time)
        if self.drive_side is not None:
            force = force + self.drive_side.added(force)
        if self.disturbance:
            force = force + self.disturbance[run].at(time)
        if added is not None:
            force = force + np.interp(time, time[::3], added)
        start = np.array([drive.deflection if isinstance(drive, Release) else 0.0, 0.0])
        laws, p, form, scale = _stacked(self.laws)
        return np.asarray(
            motion_under(force, step, start, self.base, laws, p, form, scale), dtype=np.float64
        )

    def law_force(self, q: FloatArray) -> FloatArray:
        """Force of its laws along a deflection at the truth's own steps."""
        step = self.step / FINE
        v = np.gradient(q, step)
        force = np.zeros(q.size)
        for law in self.laws:
            force += law.along(q, v, step)
        return force

    def _driven_force(self, drive: Drive, run: int, n: int) -> FloatArray:
        step, n_fine = self.step / FINE, (n - 1) * FINE + 1
        q, v, a = drive_motion(drive, step, n_fine)
        m, k, c, f0 = self.base
        force = m * a + c * v + k * q + f0
        for law in self.laws:
            force = force + law.along(q, v, step)
        if self.drive_side is not None:
            force = force + self.drive_side.added(force)
        if self.disturbance:
            force = force + self.disturbance[run].at(step * np.arange(float(n_fine)))
        return np.asarray(force)


def _stacked(
    laws: Sequence[Law],
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    n = len(laws)
    return (
        np.array([law.number for law in laws], dtype=np.float64),
        np.array([law.p for law in laws]).reshape(n, 6),
        np.array([law.form for law in laws]).reshape(n, 3, N_FORM),
        np.array([law.scale for law in laws]).reshape(n, 3),
    )


@njit(cache=True)
def _law_force(
    law: int,
    p: FloatArray,
    form: FloatArray,
    scale: FloatArray,
    q: float,
    v: float,
    t: float,
    memory: FloatArray,
    rate: FloatArray,
) -> float:
    """Force of a law and the rates of its inner states."""
    s, w = q / scale[1], v / scale[2]
    if law < 100:
        rate[:] = 0.0
        return scale[0] * static_force(law, p, form, s, w, t)
    return scale[0] * _memory_force(law, p, form, s, w, v / scale[1], memory, rate)


@njit(cache=True)
def _slope(
    state: FloatArray,
    force: float,
    t: float,
    base: FloatArray,
    laws: FloatArray,
    p: FloatArray,
    form: FloatArray,
    scale: FloatArray,
    slope: FloatArray,
) -> None:
    total = force - base[3] - base[1] * state[0] - base[2] * state[1]
    for i in range(laws.size):
        memory = slice(2 + _N_MEMORY * i, 2 + _N_MEMORY * (i + 1))
        total -= _law_force(
            int(laws[i]),
            p[i],
            form[i],
            scale[i],
            state[0],
            state[1],
            t,
            state[memory],
            slope[memory],
        )
    slope[0] = state[1]
    slope[1] = total / base[0]


@njit(cache=True)
def motion_under(
    force: FloatArray,
    step: float,
    start: FloatArray,
    base: FloatArray,
    laws: FloatArray,
    p: FloatArray,
    form: FloatArray,
    scale: FloatArray,
) -> FloatArray:
    """Deflection of a mass on the element under a force.

    Integrated by the three-eighths Runge-Kutta rule.

    Parameters
    ----------
    force : ndarray, shape (3 n + 1,)
        Force at every third of a step.
    step : float
        Step [s].
    start : ndarray, shape (2,)
        Deflection and speed at the first step.
    base : ndarray, shape (4,)
        Mass, stiffness, damping, constant force.
    laws, p, form, scale : ndarray, shape (n,), (n, 6), (n, 3, m), (n, 3)
        As :func:`_law_force`, for every law; their forces add.

    Returns
    -------
    ndarray, shape (n + 1,)
        Deflection at the steps.
    """
    n = (force.size - 1) // 3
    n_states = 2 + _N_MEMORY * laws.size
    result = np.empty(n + 1)
    state = np.zeros(n_states)
    state[:2] = start
    k1, k2, k3, k4 = np.zeros((4, n_states))
    result[0] = state[0]
    for k in range(n):
        t = step * k
        _slope(state, force[3 * k], t, base, laws, p, form, scale, k1)
        trial = state + step * k1 / 3.0
        _slope(trial, force[3 * k + 1], t + step / 3.0, base, laws, p, form, scale, k2)
        trial = state + step * (k2 - k1 / 3.0)
        _slope(trial, force[3 * k + 2], t + step / 1.5, base, laws, p, form, scale, k3)
        trial = state + step * (k1 - k2 + k3)
        _slope(trial, force[3 * k + 3], t + step, base, laws, p, form, scale, k4)
        state += step / 8.0 * (k1 + 3.0 * k2 + 3.0 * k3 + k4)
        result[k + 1] = state[0]
    return result


@njit(cache=True)
def force_along(
    q: FloatArray,
    v: FloatArray,
    step: float,
    law: int,
    p: FloatArray,
    form: FloatArray,
    scale: FloatArray,
) -> FloatArray:
    """Force of a law along a given motion.

    The inner states are integrated by the midpoint rule on straight lines between the samples.

    Parameters
    ----------
    q, v : ndarray, shape (n,)
        Deflection and speed at steps short against the memory of the law.
    step : float
        Step [s].
    law, p, form, scale
        As :func:`_law_force`.

    Returns
    -------
    ndarray, shape (n,)
        Force.
    """
    result = np.empty(q.size)
    memory = np.zeros(_N_MEMORY)
    rate = np.zeros(_N_MEMORY)
    for k in range(q.size):
        t = k * step
        result[k] = _law_force(law, p, form, scale, q[k], v[k], t, memory, rate)
        if k + 1 < q.size:
            middle = memory + 0.5 * step * rate
            q_m, v_m = 0.5 * (q[k] + q[k + 1]), 0.5 * (v[k] + v[k + 1])
            _law_force(law, p, form, scale, q_m, v_m, t + 0.5 * step, middle, rate)
            memory += step * rate
    return result


@_inline
def _slides(z: float, limit: float, r: float) -> bool:
    return abs(z) >= limit and z * r > 0.0


@_inline
def _bouc_wen(p: FloatArray, r: float, z: float) -> float:
    """Rate of z: p[0] stiffness, p[1] exponent, p[2] beta, p[3] gamma."""
    hardening = p[2] * np.sign(r * z) + p[3]
    return p[0] * r * (1.0 - abs(z) ** p[1] * hardening)


@_inline
def _hysteresis(
    law: int, p: FloatArray, s: float, r: float, memory: FloatArray, rate: FloatArray
) -> float:
    if law <= 101:
        rate[0] = _bouc_wen(p, r, memory[0])
        pinch = 1.0 - p[4] * np.exp(-((s / p[5]) ** 2)) if law == 101 else 1.0
        return memory[0] * pinch
    if law == 102:  # yields spread evenly from p[0] to p[1], weights by the power p[2]
        total = 0.0
        weights = 0.0
        for k in range(memory.size):
            limit = p[0] + (p[1] - p[0]) * k / (memory.size - 1.0)
            weight = limit ** p[2]
            rate[k] = 0.0 if _slides(memory[k], limit, r) else r
            total += weight * memory[k]
            weights += weight * limit
        return total / weights
    if law == 103:  # lopsided by p[1]
        rate[0] = 0.0 if _slides(memory[0], p[0], r) else r
        z = memory[0] / p[0]
        return z + p[1] * z * z
    # Play with friction: beyond the gap p[0] the flanks bear, within it a slider that yields at
    # p[1] drags with the level p[2].
    rate[0] = 0.0 if _slides(memory[0], p[1], r) else r
    flanks = np.sign(s) * max(abs(s) - p[0], 0.0) / (1.0 - p[0])
    return flanks + p[2] * memory[0] / p[1]


@_inline
def _lugre(p: FloatArray, w: float, r: float, memory: FloatArray, rate: FloatArray) -> float:
    """Bristles of length p[0]; Stribeck rise p[1] below the speed p[2]; p[3] damping."""
    level = 1.0 + p[1] * np.exp(-((w / p[2]) ** 2))
    rate[0] = r - abs(r) * memory[0] / (p[0] * level)
    return memory[0] / p[0] + p[3] * rate[0] / p[0]


@_inline
def _relaxation(p: FloatArray, r: float, memory: FloatArray, rate: FloatArray) -> float:
    """Three Maxwell branches: stiffness p[0], p[2], p[4] and time p[1], p[3], p[5]."""
    total = 0.0
    for k in range(3):
        rate[k] = r - memory[k] / p[2 * k + 1]
        total += p[2 * k] * memory[k]
    return total


@_inline
def _outside(
    law: int, p: FloatArray, s: float, w: float, r: float, memory: FloatArray, rate: FloatArray
) -> float:
    if law == 130:  # frequency p[0], damping ratio p[1]
        pull = p[0] ** 2 * (s - memory[0]) + 2.0 * p[1] * p[0] * (r - memory[1])
        rate[0] = memory[1]
        rate[1] = pull
        return pull / p[0] ** 2
    if law == 131:  # heat rises with the work and fades in the time p[1]
        friction = np.tanh(w / 0.002) / (1.0 + memory[0])
        rate[0] = p[0] * friction * r - memory[0] / p[1]
        return friction
    if law == 133:  # heat rises with the square of the speed and fades in the time p[1]
        rate[0] = p[0] * w * w - memory[0] / p[1]
        return -memory[0] / (1.0 + memory[0]) * s
    spring = memory[0] + p[0] * memory[0] ** 3
    rate[0] = r - spring / p[1]
    return spring


@njit(cache=True)
def _memory_force(
    law: int,
    p: FloatArray,
    form: FloatArray,
    s: float,
    w: float,
    r: float,
    memory: FloatArray,
    rate: FloatArray,
) -> float:
    """Force of a law with inner states, per unit of its size, and the rates of these states."""
    rate[:] = 0.0
    if law < 110:
        z = _hysteresis(law, p, s, r, memory, rate)
        return z + changed_form(form, s if law == 104 else z)
    if law < 120:
        z = _lugre(p, w, r, memory, rate)
        return z + changed_form(form, w)
    if law < 130:
        return _relaxation(p, r, memory, rate)
    return _outside(law, p, s, w, r, memory, rate)
