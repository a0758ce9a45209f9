"""Columns of the classes: splines of curves, steps at rest, and signals of laws with memory."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numba import njit
from scipy.interpolate import BSpline
from scipy.signal import lfilter

from carrierflex.diagnosis.comparison.problem import FloatArray

Run = TypeVar("Run")
#: Speed of the asinh scale over its RMS: a third of the splines lie below a tenth of the RMS.
_SPEED_SCALE = 0.1
#: Relaxation times from so many steps to this share of the longest record.
N_PRONY, _TAU_STEPS, _TAU_SHARE = 8, 1.5, 0.2
#: Class of a stiffness that changes with time.
TIME_VARIATION = "time_variation"
#: Splines of time: five do not imitate a stiffness that differs from run to run.
N_TIME = 5


@dataclass(frozen=True, eq=False)
class GroupColumns(Generic[Run]):
    """How the columns of one group are made of a run, and their penalty."""

    id: str  # Group
    #: Gives the columns of a run, the number of the column first
    columns: Callable[[Run], FloatArray]
    penalty: FloatArray  # Penalty of unit mean diagonal, shape (n_columns, n_columns)
    is_nonnegative: bool = False  # Whether coefficients are >= 0


_CUBIC = 3


@dataclass(frozen=True, eq=False)
class SplineBasis:
    """Cubic B-splines with even knots over a range."""

    #: low, high: ends of the range; beyond them the end values are held
    low: float
    high: float
    n: int  # Number of splines

    def __call__(self, x: FloatArray) -> FloatArray:
        """Values at x, shape (n, x.size)."""
        inner = np.linspace(self.low, self.high, self.n - _CUBIC + 1)
        knots = np.concatenate([[self.low] * _CUBIC, inner, [self.high] * _CUBIC])
        inside = np.clip(x, self.low, self.high)
        return np.asarray(BSpline.design_matrix(inside, knots, _CUBIC).toarray().T)


def basis_over(samples: FloatArray, n: int) -> SplineBasis:
    """Splines over the range of some samples."""
    low, high = float(samples.min()), float(samples.max())
    # Without any range, as of a baseline whose force is zero, one constant is all that is shown.
    margin = 1e-9 * max(high - low, abs(high)) or 1.0
    return SplineBasis(low - margin, high + margin, n)


def difference_penalty(n: int, order: int) -> FloatArray:
    """Penalty on differences of neighbouring coefficients, of unit mean diagonal, shape (n, n).

    References
    ----------
    .. [1] P. H. C. Eilers, B. D. Marx, "Flexible smoothing with B-splines and penalties",
       Statistical Science 11 (1996) 89.
    """
    D = np.diff(np.eye(n), order, axis=0)
    P = D.T @ D
    return P / np.mean(np.diag(P))


@njit(cache=True)
def _stops(x, yields, state):  # type: ignore[no-untyped-def]
    """Deflection of every stop along x; `state` is where they begin and is changed."""
    deflections = np.empty((yields.size, x.size))
    last = x[0]
    for k in range(x.size):
        moved = x[k] - last
        last = x[k]
        for i in range(yields.size):
            state[i] = min(max(state[i] + moved, -yields[i]), yields[i])
            deflections[i, k] = state[i]
    return deflections


def stops(x: FloatArray, yields: FloatArray, *, from_rest: bool = False) -> FloatArray:
    """Deflection of Jenkins elements (a spring that slips) along a motion, shape (n_yields, n).

    The record is played backwards first, so that the sliders begin where a motion like this one
    leaves them; or they begin relaxed.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Deflection.
    yields : ndarray, shape (n_yields,)
        Deflection at which each slips.
    from_rest : bool
        Whether they are relaxed at the first sample.

    Returns
    -------
    ndarray, shape (n_yields, n)
        Divided by the yield deflection: within -1 and 1.

    References
    ----------
    .. [1] W. D. Iwan, "A distributed-element model for hysteresis", J. Appl. Mech. 33 (1966) 893.
    """
    deflections = along(
        lambda q, state: _stops(q, yields, state), x, np.zeros(yields.size), from_rest=from_rest
    )
    return deflections / yields[:, None]


@njit(cache=True)
def _dahl(x, lengths, state):  # type: ignore[no-untyped-def]
    forces = np.empty((lengths.size, x.size))
    last = x[0]
    for k in range(x.size):
        moved = x[k] - last
        last = x[k]
        sign = 1.0 if moved > 0.0 else -1.0
        for i in range(lengths.size):
            # Exact for a step in one direction: z tends to the sign of the motion.
            state[i] = sign + (state[i] - sign) * np.exp(-abs(moved) / lengths[i])
            forces[i, k] = state[i]
    return forces


def dahl_friction(x: FloatArray, lengths: FloatArray, *, from_rest: bool = False) -> FloatArray:
    """Dry friction with pre-sliding along a motion, ``dz/dx = (1 - z sign(v)) / length``.

    Shape (n_lengths, n), within -1 and 1: `lengths` are the deflections over which it turns. Played
    backwards first, or relaxed at the first sample (`from_rest`).

    References
    ----------
    .. [1] P. R. Dahl, "A solid friction model", Aerospace Corporation TOR-0158 (1968).
    """
    return along(
        lambda q, state: _dahl(q, lengths, state), x, np.zeros(lengths.size), from_rest=from_rest
    )


def along(
    elements: Callable[[FloatArray, FloatArray], FloatArray],
    x: FloatArray,
    state: FloatArray,
    *,
    from_rest: bool,
) -> FloatArray:
    """Rate-independent elements along a motion, relaxed at first or as its way backwards ends.

    `elements` gives what is wanted of them along a motion, and moves their relaxed `state`. Between
    two reversals such elements move as in one stretch, so that backwards the reversals are enough.
    """
    if not from_rest:
        elements(_reversals(x)[::-1].copy(), state)
    return np.asarray(elements(np.ascontiguousarray(x), state), dtype=np.float64)


def _reversals(x: FloatArray) -> FloatArray:
    """First and last value of a motion, and those at which it turns."""
    moves = np.diff(x)
    moving = np.flatnonzero(moves)
    turns = moving[1:][np.diff(np.sign(moves[moving])) != 0.0]
    return x[np.concatenate([[0], turns, [x.size - 1]])]


def relaxing_branches(
    x: FloatArray, taus: FloatArray, step: float, *, from_rest: bool = False
) -> FloatArray:
    """Deflection of the springs of Maxwell elements along a motion, shape (n_taus, n).

    ``dz/dt = v - z / tau``, exact for straight lines between the samples; the record is played
    backwards first, or they begin relaxed.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Deflection.
    taus : ndarray, shape (n_taus,)
        Relaxation times [s].
    step : float
        Sampling interval [s].
    from_rest : bool
        Whether they are relaxed at the first sample.

    Returns
    -------
    ndarray, shape (n_taus, n)
        Deflection of each spring.
    """
    moved = x if from_rest else np.concatenate([x[::-1], x])
    moved = np.diff(moved, prepend=moved[0])
    rows = []
    for tau in taus:
        decay = np.exp(-step / tau)
        gain = tau / step * (1.0 - decay)
        rows.append(lfilter([gain], [1.0, -decay], moved)[-x.size :])
    return np.array(rows)


def curved_speed(v: FloatArray, rms: float) -> FloatArray:
    """``asinh(v / (0.1 v_rms))``: fine near rest, coarse far from it."""
    return np.asarray(np.arcsinh(v / (_SPEED_SCALE * rms)), dtype=np.float64)


def straight_speed(curved: FloatArray, rms: float) -> FloatArray:
    """Speed of :func:`curved_speed`."""
    return np.asarray(_SPEED_SCALE * rms * np.sinh(curved), dtype=np.float64)


def step_at_rest(v: FloatArray, rest_speed: float) -> FloatArray:
    """Signs of positive and of negative speed, smooth where uncertain, shape (2, *v.shape)."""
    sign = np.tanh(v / rest_speed)
    return np.array([np.maximum(sign, 0.0), np.minimum(sign, 0.0)])


def relaxation_times(step: float, longest: float) -> FloatArray:
    """Relaxation times [s] of branches for a sampling interval and the longest run."""
    return np.geomspace(_TAU_STEPS * step, _TAU_SHARE * longest, N_PRONY)


def time_splines(longest: float) -> SplineBasis:
    """Splines of time over the longest run [s]."""
    return SplineBasis(0.0, longest, N_TIME)
