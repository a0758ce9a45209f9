"""One element of the truth: its laws, its drive's and sensor's faults, and what it answers."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from carrierflex.blind_check.truth.element.drives import Drive, Lines, Release, drive_motion
from carrierflex.blind_check.truth.element.integration import force_along, motion_under

FloatArray = NDArray[np.float64]

#: Steps of the truth in one sample, and samples in one period of the natural frequency.
FINE = 24
PER_PERIOD = 32
N_FORM = 4


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
            own = np.tanh(self.p * u) / self.p - u
        elif self.name == "unequal_gain":
            own = np.sqrt(u * u + 1e-4)
        else:
            own = -np.tanh(u / self.p)
        size, waves, phases = self.form[:, :, None]
        changed = (size * np.sin(waves * u + phases)).sum(axis=0)
        return np.asarray(self.amplitude * (own + changed))


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
