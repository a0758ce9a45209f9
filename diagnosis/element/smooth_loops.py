"""Smooth loop of hysteresis fitted to the records: Duhem's model with a stiffness of any form.

``F = f z``, ``dz/dx = c(z sign(v)) / X``, X the half range of the motion. Sliders in parallel have
loops that are alike in both directions and never harden (Masing); the state of a smooth loop
remembers where it stands and nothing else, so that its loops may harden and need not close. c has
no fixed form: it is linear between nine values, the same in both directions of motion. They are
found by least squares on the filtered records, baseline and size in each step by projection.

Where c is the same after a reversal as before it, ``c(u) = c(-u)``, the state goes back as it came:
a curve f(x) that rises, and no loop. A smooth loop is hysteresis where it leaves less than such a
curve does.

References
----------
.. [1] B. D. Coleman, M. L. Hodgdon, "A constitutive relation for rate-independent hysteresis in
   ferromagnetically soft materials", Int. J. Eng. Sci. 24 (1986) 897.
.. [2] G. H. Golub, V. Pereyra, "The differentiation of pseudo-inverses and nonlinear least squares
   problems whose variables separate", SIAM J. Numer. Anal. 10 (1973) 413; the Jacobian is that of
   L. Kaufman, BIT 15 (1975) 49.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from carrierflex.diagnosis.classes.columns import GroupColumns, along
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.columns import MotionSize
from carrierflex.diagnosis.element.force_records import ForceRecord
from carrierflex.identification.estimation.scaled_least_squares import DEPENDENT
from carrierflex.simulation.element.loop_kernels import loop_states
from carrierflex.simulation.laws import N_STIFFNESS

#: Stiffnesses at -1, 0 and 1 from which the fit begins, linear between: of sliders, and of a loop
#: that hardens and turns back at twice its stiffness.
_OF_SLIDERS = (6.15, 3.15, 0.15)
_OF_HARDENING = (1.54, 0.7, 0.98)
#: Weight of the curvature of log c, over the RMS of the force: keeps values in hand that no motion
#: reaches.
_CURVATURE = 3e-3
#: Steps of a fit at most.
_MOST_STEPS = 30
#: Change of the square in a step, over the square, at which a fit has settled.
_SETTLED = 1e-4
#: Largest log c: a stiffness that no motion reaches may go anywhere.
_LARGEST_LOG = 20.0
#: Step of log c for the derivatives.
_DIFFERENCE = 1e-4


@dataclass(frozen=True, eq=False)
class SmoothLoop:
    """A fitted smooth loop."""

    half_range: float  # Half of the range of the deflection
    stiffness: FloatArray  # c, from -1 to 1, shape (9,)

    def along(self, x: FloatArray, *, from_rest: bool = False) -> FloatArray:
        """State z along a motion, begun at rest or where a motion like this one leaves it."""
        return along(
            lambda q, state: loop_states(q, self.half_range, self.stiffness, state),
            x,
            np.zeros(1),
            from_rest=from_rest,
        )

    def row(self, force: float) -> FloatArray:
        """Row of the loop among the parts of a law, with its force at z = 1."""
        return np.array([self.half_range, force, *self.stiffness])


def fitted_loop(
    runs: Sequence[ForceRecord],
    size: MotionSize,
    others: Sequence[GroupColumns[ForceRecord]] = (),
    *,
    is_curve: bool = False,
) -> SmoothLoop:
    """Smooth loop that leaves least of the force beside the baseline.

    `others` are columns of a class that shares the force with it; where `is_curve` the state goes
    back as it came. The fit begins at the start that leaves less.
    """
    spread = np.eye(N_STIFFNESS)
    if is_curve:
        half = N_STIFFNESS // 2
        spread = (spread + spread[::-1])[:, : half + 1]
        spread[half, half] = 1.0
    # Weighted curvature of log c by the unknowns.
    bends = _CURVATURE * np.diff(spread, 2, axis=0)
    pieces = []
    for run in runs:
        columns = [group.columns(run) for group in others]
        pieces.append(run.filtered(np.concatenate([run.target[None], run.base, *columns])))
    rows = np.concatenate(pieces, axis=1)
    base = _span(rows[1:])
    target = rows[0] - base @ (base.T @ rows[0])
    target /= np.linalg.norm(target)

    def loop_of(unknowns: FloatArray) -> SmoothLoop:
        log_c = np.clip(spread @ unknowns, -_LARGEST_LOG, _LARGEST_LOG)
        return SmoothLoop(size.half_range, np.exp(log_c))

    def columns_of(unknowns: Sequence[FloatArray]) -> FloatArray:
        """Filtered states of loops without what the baseline explains."""
        loops = [loop_of(values) for values in unknowns]
        states = [
            run.filtered(np.array([loop.along(run.x, from_rest=run.from_rest) for loop in loops]))
            for run in runs
        ]
        columns = np.concatenate(states, axis=1)
        return np.asarray(columns - (columns @ base) @ base.T)

    def force_of(column: FloatArray) -> float:
        return float(column @ target / (column @ column))

    def residual(unknowns: FloatArray) -> FloatArray:
        """What the loop leaves of the force, and the curvature of log c."""
        (column,) = columns_of([unknowns])
        return np.concatenate([target - force_of(column) * column, bends @ unknowns])

    def jacobian(unknowns: FloatArray) -> FloatArray:
        """Derivatives of the residual, shape (n + n_bends, n_unknowns)."""
        column, *moved = columns_of([unknowns, *(unknowns + _DIFFERENCE * np.eye(unknowns.size))])
        change = (np.array(moved) - column) / _DIFFERENCE
        unit = column / np.linalg.norm(column)
        change -= np.outer(change @ unit, unit)
        return np.concatenate([-force_of(column) * change.T, bends])

    at_values = np.linspace(-1.0, 1.0, N_STIFFNESS)
    starts = []
    for stiffness in (_OF_SLIDERS, _OF_HARDENING):
        log_c = np.log(np.interp(at_values, (-1.0, 0.0, 1.0), stiffness))
        starts.append(np.asarray(np.linalg.lstsq(spread, log_c)[0], dtype=np.float64))
    start = min(starts, key=lambda unknowns: float(np.square(residual(unknowns)).sum()))
    fit = least_squares(residual, start, jac=jacobian, ftol=_SETTLED, max_nfev=_MOST_STEPS)
    return loop_of(fit.x)


def _span(rows: FloatArray) -> FloatArray:
    """Orthonormal columns of what some rows span, shape (n, rank)."""
    size = np.maximum(np.linalg.norm(rows, axis=1), np.finfo(float).tiny)
    values, vectors = np.linalg.eigh((rows @ rows.T) / np.outer(size, size))
    spanned = values > DEPENDENT * values[-1]
    columns: FloatArray = (rows / size[:, None]).T @ vectors[:, spanned]
    return columns / np.sqrt(values[spanned])
