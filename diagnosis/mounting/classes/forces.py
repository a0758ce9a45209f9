"""Forces of the bushings without a fixed form: columns of every class along a run.

A column is a force of each bushing in y and in z, shape (2, 2, n). Laws of the library act in y and
in z apart; a ring of rubber acts along its deflection. A class holds both kinds of column.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit

from carrierflex.diagnosis.classes.columns import (
    GroupColumns,
    SplineBasis,
    basis_over,
    difference_penalty,
    relaxing_branches,
    stops,
)
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.mounting.classes.motion import BushingMotion

_N_FORCE, _N_RADIAL = 16, 8
_N_SPEED, _N_RADIAL_SPEED = 10, 6
_N_COUPLED = 6
_N_YIELDS, _N_RADIAL_YIELDS = 10, 8
_N_PRONY = 8
_N_TIME = 5
#: Speed of the asinh scale, and below which its sign is uncertain, over its RMS.
_SPEED_SCALE, _REST_SPEED = 0.1, 0.02
#: Yield deflections over the largest deflection.
_YIELDS = (0.01, 0.7)
#: Relaxation times from so many steps to this share of the longest record.
_TAU_STEPS, _TAU_SHARE = 1.5, 0.2

#: Group of forces of the bushings, columns of shape (n_columns, 2, 2, n).
ForceGroup = GroupColumns[BushingMotion]


@dataclass(frozen=True, eq=False)
class BushingSize:
    """Sizes of the motion over all runs, and the splines over them.

    Parameters
    ----------
    deflection, radius, speed : float
        Largest deflection in y or z, largest along any direction, RMS speed.
    taus : ndarray, shape (n,)
        Relaxation times [s].
    length : float
        Longest run [s].
    low, high : float
        Range of the deflection.
    fastest : float
        Largest speed.
    """

    deflection: float
    radius: float
    speed: float
    taus: FloatArray
    length: float
    low: float
    high: float
    fastest: float

    @property
    def rest_speed(self) -> float:
        """Speed below which its sign is uncertain."""
        return _REST_SPEED * self.speed

    @property
    def yields(self) -> FloatArray:
        """Yield deflections, shape (n,)."""
        return np.geomspace(*_YIELDS, _N_YIELDS) * self.deflection

    @property
    def radial_yields(self) -> FloatArray:
        """Yield deflections of sliders in the plane, shape (n,)."""
        return np.geomspace(*_YIELDS, _N_RADIAL_YIELDS) * self.radius

    def curved_speed(self, v: FloatArray) -> FloatArray:
        """asinh(v / (0.1 v_rms)): fine near rest, coarse far from it."""
        return np.asarray(np.arcsinh(v / (_SPEED_SCALE * self.speed)), dtype=np.float64)

    def straight_speed(self, curved: FloatArray) -> FloatArray:
        """Speed of :meth:`curved_speed`."""
        return np.asarray(_SPEED_SCALE * self.speed * np.sinh(curved), dtype=np.float64)

    def force_splines(self) -> SplineBasis:
        """Splines of f(u)."""
        return basis_over(np.array([self.low, self.high]), _N_FORCE)

    def speed_splines(self) -> SplineBasis:
        """Splines of g(v), in asinh of the speed."""
        end = self.curved_speed(np.array([-self.fastest, self.fastest]))
        return basis_over(end, _N_SPEED)

    def coupled_splines(self) -> SplineBasis:
        """Splines of h(u)."""
        return basis_over(np.array([self.low, self.high]), _N_COUPLED)

    def time_splines(self) -> SplineBasis:
        """Splines of time over the longest run."""
        return SplineBasis(0.0, self.length, _N_TIME)


def bushing_size(motions: Sequence[BushingMotion]) -> BushingSize:
    """Sizes over all runs."""
    u = np.concatenate([own.u.reshape(4, -1) for own in motions], axis=1)
    v = np.concatenate([own.v.reshape(4, -1) for own in motions], axis=1)
    radius = np.concatenate([np.hypot(own.u[:, 0], own.u[:, 1]).ravel() for own in motions])
    length = max(own.time[-1] + own.step for own in motions)
    step = min(own.step for own in motions)
    return BushingSize(
        deflection=float(np.abs(u).max()),
        radius=float(radius.max()),
        speed=float(np.sqrt(np.mean(v**2))),
        taus=np.geomspace(_TAU_STEPS * step, _TAU_SHARE * length, _N_PRONY),
        length=float(length),
        low=float(u.min()),
        high=float(u.max()),
        fastest=float(np.abs(v).max()),
    )


def force_groups(size: BushingSize) -> tuple[ForceGroup, ...]:
    """Every group of forces.

    Parameters
    ----------
    size : BushingSize
        Sizes and splines.
    """
    of_deflection = (
        ForceGroup("f", lambda own: static_force(size, own.u), difference_penalty(_N_FORCE, 2)),
        ForceGroup("radial_f", lambda own: _radial_force(size, own), _second(_N_RADIAL)),
        ForceGroup("time", lambda own: _in_time(size, own), difference_penalty(_N_TIME, 1)),
    )
    of_speed = (
        ForceGroup("g", lambda own: speed_force(size, own.v), _with_step(_second(_N_SPEED), 2)),
        ForceGroup("radial_g", lambda own: _radial_speed(size, own), _radial_speed_penalty()),
        ForceGroup("h", lambda own: coupled_force(size, own.u, own.v), _second(_N_COUPLED)),
        ForceGroup("radial_h", lambda own: _radial_coupled(size, own), _second(_N_COUPLED)),
    )
    with_memory = (
        ForceGroup("stops", lambda own: _stops(size, own), np.zeros((_N_YIELDS, _N_YIELDS)), True),
        ForceGroup(
            "radial_stops",
            lambda own: _radial_stops(size, own),
            np.zeros((_N_RADIAL_YIELDS, _N_RADIAL_YIELDS)),
            True,
        ),
        ForceGroup(
            "smooth_stops",
            lambda own: _smooth_stops(size, own),
            np.zeros((_N_RADIAL_YIELDS, _N_RADIAL_YIELDS)),
            True,
        ),
        ForceGroup(
            "prony",
            lambda own: branches(own, size.taus),
            np.zeros((_N_PRONY, _N_PRONY)),
            True,
        ),
    )
    return (*of_deflection, *of_speed, *with_memory)


def _second(n: int) -> FloatArray:
    return difference_penalty(n, 2)


def _with_step(penalty: FloatArray, n_free: int) -> FloatArray:
    """Penalty with columns behind it that are free."""
    n = len(penalty)
    found = np.zeros((n + n_free, n + n_free))
    found[:n, :n] = penalty
    return found


def _radial_speed_penalty() -> FloatArray:
    return _with_step(_second(_N_RADIAL_SPEED), 1)


def _splined(basis: SplineBasis, values: FloatArray) -> FloatArray:
    """Splines of every value, shape (n_splines, *values.shape)."""
    return basis(values.ravel()).reshape(basis.n, *values.shape)


def static_force(size: BushingSize, u: FloatArray) -> FloatArray:
    """f(u), shape (n_columns, *u.shape)."""
    return _splined(size.force_splines(), u)


def speed_force(size: BushingSize, v: FloatArray) -> FloatArray:
    """g(v): splines, and a step at rest for either direction, shape (n_columns, *v.shape)."""
    sign = np.tanh(v / size.rest_speed)
    steps = np.array([np.maximum(sign, 0.0), np.minimum(sign, 0.0)])
    return np.concatenate([_splined(size.speed_splines(), size.curved_speed(v)), steps])


def coupled_force(size: BushingSize, u: FloatArray, v: FloatArray) -> FloatArray:
    """h(u) v, shape (n_columns, *u.shape)."""
    return _splined(size.coupled_splines(), u) * v


def _radius(u: FloatArray) -> FloatArray:
    """Size of a vector in y and z, shape (2, n)."""
    return np.asarray(np.hypot(u[:, 0], u[:, 1]))


def _radial_force(size: BushingSize, own: BushingMotion) -> FloatArray:
    """k(r) along the deflection."""
    basis = basis_over(np.array([0.0, size.radius]), _N_RADIAL)
    return _splined(basis, _radius(own.u))[:, :, None] * own.u


def _radial_speed(size: BushingSize, own: BushingMotion) -> FloatArray:
    """c(|v|) along the speed, and dry friction against it."""
    speed = _radius(own.v)
    basis = basis_over(np.array([0.0, np.sqrt(2.0) * size.fastest]), _N_RADIAL_SPEED)
    friction = np.tanh(speed / size.rest_speed) / np.maximum(speed, 1e-3 * size.rest_speed)
    factors = np.concatenate([_splined(basis, speed), friction[None]])
    return factors[:, :, None] * own.v


def _radial_coupled(size: BushingSize, own: BushingMotion) -> FloatArray:
    """h(r) along the speed."""
    basis = basis_over(np.array([0.0, size.radius]), _N_COUPLED)
    return _splined(basis, _radius(own.u))[:, :, None] * own.v


def _in_time(size: BushingSize, own: BushingMotion) -> FloatArray:
    """Stiffness that changes slowly with time."""
    splines = size.time_splines()(own.time)
    return splines[:, None, None] * own.u


def _along_each(
    u: FloatArray, n_columns: int, along: Callable[[FloatArray], FloatArray]
) -> FloatArray:
    """Columns of every direction of every bushing, shape (n_columns, 2, 2, n)."""
    found = np.empty((n_columns, *u.shape))
    for bushing in range(2):
        for direction in range(2):
            if bushing and np.array_equal(u[0, direction], u[1, direction]):
                found[:, 1, direction] = found[:, 0, direction]
                continue
            found[:, bushing, direction] = along(u[bushing, direction])
    return found


def stop_forces(own: BushingMotion, yields: FloatArray) -> FloatArray:
    """Sliders in y and in z apart, within -1 and 1, shape (n_yields, 2, 2, n)."""
    return _along_each(own.u, yields.size, lambda x: stops(x, yields, from_rest=True))


def branches(own: BushingMotion, taus: FloatArray) -> FloatArray:
    """Relaxing branches, shape (n_taus, 2, 2, n)."""
    return _along_each(
        own.u, taus.size, lambda x: relaxing_branches(x, taus, own.step, from_rest=True)
    )


def _stops(size: BushingSize, own: BushingMotion) -> FloatArray:
    return stop_forces(own, size.yields)


def _radial_stops(size: BushingSize, own: BushingMotion) -> FloatArray:
    """Sliders that yield in the direction of their deflection."""
    yields = size.radial_yields
    found = np.empty((yields.size, *own.u.shape))
    for bushing in range(2):
        found[:, bushing] = _returned(np.ascontiguousarray(own.u[bushing]), yields)
    return found / yields[:, None, None, None]


@njit(cache=True)
def _returned(u, yields):  # type: ignore[no-untyped-def]
    """Deflection of sliders in a plane: beyond the yield it returns along its own direction."""
    n = u.shape[1]
    found = np.zeros((yields.size, 2, n))
    state = np.zeros((yields.size, 2))
    for k in range(n):
        for i in range(yields.size):
            for d in range(2):
                state[i, d] += u[d, k] - (u[d, k - 1] if k > 0 else u[d, 0])
            size = np.hypot(state[i, 0], state[i, 1])
            if size > yields[i]:
                state[i] *= yields[i] / size
            found[i, :, k] = state[i]
    return found


def _smooth_stops(size: BushingSize, own: BushingMotion) -> FloatArray:
    """Sliders that give way along their path: what small loops left, they lose in the next ones."""
    yields = size.radial_yields
    found = np.empty((yields.size, *own.u.shape))
    for bushing in range(2):
        found[:, bushing] = _given_way(np.ascontiguousarray(own.u[bushing]), yields)
    return found


@njit(cache=True)
def _given_way(u, yields):  # type: ignore[no-untyped-def]
    """Share of the force at slip: ``dz = (du - |du| z) / yield`` on a straight way (Dahl, 1968)."""
    n = u.shape[1]
    found = np.zeros((yields.size, 2, n))
    for i in range(yields.size):
        for k in range(1, n):
            way = np.hypot(u[0, k] - u[0, k - 1], u[1, k] - u[1, k - 1])
            kept = np.exp(-way / yields[i])
            for d in range(2):
                along = (u[d, k] - u[d, k - 1]) / way if way > 0.0 else 0.0
                found[i, d, k] = kept * found[i, d, k - 1] + (1.0 - kept) * along
    return found
