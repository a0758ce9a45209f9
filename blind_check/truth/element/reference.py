"""Motion of an element without causes, by which these are sized."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.blind_check.truth.element.drives import Drive, drive_motion
from carrierflex.blind_check.truth.element.element import FINE, Element, Law
from carrierflex.blind_check.truth.noise import root_mean_square

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Reference:
    """Motion of the largest run without any cause, at the truth's own steps.

    `columns` deflection, speed, acceleration and one; `force` that of the element's base.
    """

    columns: FloatArray
    step: float
    force: FloatArray

    @property
    def scale(self) -> FloatArray:
        """Largest deflection and speed."""
        return np.abs(self.columns[:, :2]).max(axis=0)

    def missing(self, force: FloatArray) -> float:
        """RMS of what mass, spring, damper and constant leave of a force."""
        solution = np.linalg.lstsq(self.columns / self._size, force, rcond=1e-9)[0]
        return root_mean_square(force - self.columns / self._size @ solution)

    @property
    def _size(self) -> FloatArray:
        return np.abs(self.columns).max(axis=0)


def reference_motion(plain: Element, drive: Drive, n: int) -> Reference:
    """Motion without any cause under the largest drive."""
    step, n_fine = plain.step / FINE, (n - 1) * FINE + 1
    if plain.by_force:
        q = plain.motion(drive, 0, n)
        v = np.gradient(q, step)
        motion = (q, v, np.gradient(v, step))
    else:
        motion = drive_motion(drive, step, n_fine)
    columns = np.array([*motion, np.ones(n_fine)]).T
    m, k, c, f0 = plain.base
    if plain.by_force:
        force = drive.at(step * np.arange(float(n_fine)))
    else:
        force = columns @ np.array([k, c, m, f0])
    return Reference(columns, step, force)


def force_of(law: Law, reference: Reference) -> FloatArray:
    """Force of a law along the motion, shape (n,)."""
    q, v = reference.columns[:, 0].copy(), reference.columns[:, 1].copy()
    return law.along(q, v, reference.step)
