"""Columns along a motion that an element and the bushings of a mounting have alike."""

import numpy as np

from carrierflex.diagnosis.classes.columns import SplineBasis
from carrierflex.diagnosis.comparison.problem import FloatArray

#: Speed of the asinh scale over its RMS: a third of the splines lie below a tenth of the RMS.
_SPEED_SCALE = 0.1
#: Relaxation times from so many steps to this share of the longest record.
N_PRONY, _TAU_STEPS, _TAU_SHARE = 8, 1.5, 0.2
#: Splines of time: five do not imitate a stiffness that differs from run to run.
N_TIME = 5


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
