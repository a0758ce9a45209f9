"""How a class may follow the loads: smooth functions of torque and radial load, or none.

A function is linear within a run about the run's mean loads, and as curved as it is from run to
run: the columns of the flexible model, each times a constant of the run, carry it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.carrier.records.columns import CONSTANT, FORCE_Y, FORCE_Z, TORQUE
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.simulation.carrier.measured_laws.rim_patterns import (
    BY_BOTH,
    BY_RADIAL_LOAD,
    BY_TORQUE,
    NONE,
)

#: Torque over nominal, radial load over the largest, along y and z; shape (n,) each.
LoadFunction = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
#: Radial load, over the largest, at which a saturating function bends.
_BENDS = (0.15, 0.45)
_STEP = 1e-4
#: Two torques over nominal are one within this.
_ONE_TORQUE = 0.05


@dataclass(frozen=True, eq=False)
class LoadWeights:
    """One function of the loads, linear within each run.

    Parameters
    ----------
    by_load : mapping of str to ndarray, shape (n_runs,)
        Factor of the columns times each load.
    means : mapping of str to ndarray, shape (n_runs,)
        Mean of each load in each run.
    """

    by_load: Mapping[str, FloatArray]
    means: Mapping[str, FloatArray]


@dataclass(frozen=True, eq=False)
class LoadFunctions:
    """Functions of one dependence.

    Parameters
    ----------
    functions : tuple of callable
        Functions of the loads, those of a vector first: along y, then along z, pair by pair.
    penalty : ndarray, shape (n,)
        How much each is penalised.
    n_vectors : int
        Pairs of functions along y and z.
    """

    functions: tuple[LoadFunction, ...]
    penalty: FloatArray
    n_vectors: int = 0


def load_weights(function: LoadFunction, means: FloatArray) -> LoadWeights:
    """Function of the loads, linear about the mean loads of each run.

    Parameters
    ----------
    function : callable
        Of torque over nominal and radial load over the largest.
    means : ndarray, shape (n_runs, 3)
        Mean loads of each run in these units.
    """
    t, y, z = means.T
    value = function(t, y, z)
    slopes = {
        TORQUE: (function(t + _STEP, y, z) - function(t - _STEP, y, z)) / (2.0 * _STEP),
        FORCE_Y: (function(t, y + _STEP, z) - function(t, y - _STEP, z)) / (2.0 * _STEP),
        FORCE_Z: (function(t, y, z + _STEP) - function(t, y, z - _STEP)) / (2.0 * _STEP),
    }
    by_mean = {TORQUE: t, FORCE_Y: y, FORCE_Z: z}
    constant = value - sum(slopes[load] * by_mean[load] for load in slopes)
    return LoadWeights({CONSTANT: constant, **slopes}, {CONSTANT: np.ones_like(t), **by_mean})


def torque_levels(torque: FloatArray) -> int:
    """Torques over nominal that differ by more than a twentieth."""
    levels: list[float] = []
    for value in sorted(torque.tolist()):
        if not levels or value - levels[-1] > _ONE_TORQUE:
            levels.append(value)
    return len(levels)


def load_functions(n_torques: int) -> dict[str, LoadFunctions]:
    """Functions of each dependence, and how much each is penalised.

    The constant for what follows nothing; powers of the torque, zero without torque, as many as the
    torques can tell; the radial load as a vector, linear, saturating and even in its direction.

    Parameters
    ----------
    n_torques : int
        Torques that differ.

    Returns
    -------
    dict of str to LoadFunctions
        By dependence.
    """
    powers = tuple(_power(k) for k in range(1, max(min(n_torques - 1, 3), 1) + 1))
    bends = tuple(_saturating(component, bend) for bend in _BENDS for component in (0, 1))
    linear = (lambda t, y, z: y, lambda t, y, z: z)
    even = (lambda t, y, z: y * z, lambda t, y, z: z * z, lambda t, y, z: y * y)
    return {
        NONE: LoadFunctions((lambda t, y, z: np.ones_like(t),), np.zeros(1)),
        BY_TORQUE: LoadFunctions(powers, np.array([0.0, *[1.0] * (len(powers) - 1)])),
        BY_RADIAL_LOAD: LoadFunctions(
            (*linear, *bends, *even), np.array([0.0] * 2 + [1.0] * 7), n_vectors=3
        ),
        BY_BOTH: LoadFunctions(
            tuple(_times_torque(function) for function in (*linear, *bends)),
            np.array([0.0] * 2 + [1.0] * 4),
            n_vectors=3,
        ),
    }


def _power(k: int) -> LoadFunction:
    return lambda t, y, z: np.asarray(np.sign(t) * np.abs(t) ** k)


def _times_torque(function: LoadFunction) -> LoadFunction:
    return lambda t, y, z: t * function(t, y, z)


def _saturating(component: int, bend: float) -> LoadFunction:
    def function(t: FloatArray, y: FloatArray, z: FloatArray) -> FloatArray:
        """Component of a vector along the load, as long as ``tanh(|F| / bend)``."""
        size = np.hypot(y, z)
        along = (y, z)[component] / np.maximum(size, np.finfo(float).tiny)
        return np.asarray(np.where(size > 0.0, along * np.tanh(size / bend), 0.0))

    return function
