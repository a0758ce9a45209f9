"""Columns of every class and law along a run: forces of the bushings, maps, laws of the library.

A force is one of each bushing in y and in z, shape (2, 2, n). Laws of the library act in y and in z
apart; a ring of rubber acts along its deflection. A class holds both kinds of column. A column of a
map is what it adds to the signals of a run, shape (n_channels, n). Stiffness between free motions
and the load map answer through the housing; where the map moves what the baseline holds (bearing,
axial guide) that motion shows at once, and loads the bushings besides.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations_with_replacement, product

import numpy as np
from numba import njit

from carrierflex.diagnosis.classes.columns import (
    N_PRONY,
    N_TIME,
    GroupColumns,
    SplineBasis,
    basis_over,
    curved_speed,
    difference_penalty,
    relaxation_times,
    relaxing_branches,
    step_at_rest,
    stops,
    time_splines,
)
from carrierflex.diagnosis.comparison.problem import FloatArray, bounds_of
from carrierflex.diagnosis.mounting.model import USER_SHARES, MountingModel
from carrierflex.diagnosis.mounting.motion import N_FREE, BushingMotion
from carrierflex.simulation.mounting.measured_laws.bushing_laws import bushing_forces, packed_laws

_N_FORCE, _N_RADIAL = 16, 8
_N_SPEED, _N_RADIAL_SPEED = 10, 6
_N_COUPLED = 6
_N_YIELDS, _N_RADIAL_YIELDS = 10, 8
#: Speed below which its sign is uncertain, over its RMS.
_REST_SPEED = 0.02
#: Yield deflections over the largest deflection.
_YIELDS = (0.01, 0.7)
#: Group of forces of the bushings, columns of shape (n_columns, 2, 2, n).
ForceGroup = GroupColumns[BushingMotion]
_SIZES = np.geomspace(0.004, 0.3, 14)
#: Delays among which the one that fits is sought [s]: loads may be late, or signals.
DELAYS = np.concatenate([_SIZES, -_SIZES])
#: Motion of a channel over what is missing in it from which a gain may be the reason.
_LEAST_MOVED = 1.5
#: Share of the motion that a load must make to count as one that acts.
ACTING = 0.1
_LOADS = {"all": (0, 1, 2), "torque": (0,), "radial_load": (1, 2)}
#: Relaxation times and yield deflections of the laws over the time of a step and the largest
#: deflection.
_LAW_TAUS = np.geomspace(1.5, 1500.0, 14)
_LAW_YIELDS = np.geomspace(0.01, 1.0, 14)


@dataclass(frozen=True, eq=False)
class BushingSize:
    """Sizes of the motion over all runs, and what follows from them."""

    #: deflection, radius: largest deflection in y or z, largest along any direction
    deflection: float
    radius: float
    #: low, high: range of the deflection
    low: float
    high: float
    #: speed, fastest, rest_speed: RMS, largest, and below which its sign is uncertain
    speed: float
    fastest: float
    rest_speed: float
    length: float  # Longest run [s]
    taus: FloatArray  # Relaxation times [s], shape (n,)
    #: yields, radial_yields: of sliders in y and in z, and in the plane, shape (n,)
    yields: FloatArray
    radial_yields: FloatArray


def bushing_size(motions: Sequence[BushingMotion]) -> BushingSize:
    """Sizes over all runs."""
    u = np.concatenate([run.u.reshape(4, -1) for run in motions], axis=1)
    v = np.concatenate([run.v.reshape(4, -1) for run in motions], axis=1)
    deflection = float(np.abs(u).max())
    radius = float(max(_radius(run.u).max() for run in motions))
    speed = float(np.sqrt(np.mean(v**2)))
    length = float(max(run.time[-1] + run.step for run in motions))
    return BushingSize(
        deflection=deflection,
        radius=radius,
        low=float(u.min()),
        high=float(u.max()),
        speed=speed,
        fastest=float(np.abs(v).max()),
        rest_speed=_REST_SPEED * speed,
        length=length,
        taus=relaxation_times(min(run.step for run in motions), length),
        yields=np.geomspace(*_YIELDS, _N_YIELDS) * deflection,
        radial_yields=np.geomspace(*_YIELDS, _N_RADIAL_YIELDS) * radius,
    )


def force_groups(size: BushingSize) -> tuple[ForceGroup, ...]:
    """Every group of forces: of the deflection, of time, of the speed, with a memory."""
    curvature = partial(difference_penalty, order=2)
    deflections, radii = np.array([size.low, size.high]), np.array([0.0, size.radius])
    f, radial_f = basis_over(deflections, _N_FORCE), basis_over(radii, _N_RADIAL)
    h, radial_h = basis_over(deflections, _N_COUPLED), basis_over(radii, _N_COUPLED)
    speeds = curved_speed(np.array([-size.fastest, size.fastest]), size.speed)
    g, in_time = basis_over(speeds, _N_SPEED), time_splines(size.length)
    radial_g = basis_over(np.array([0.0, np.sqrt(2.0) * size.fastest]), _N_RADIAL_SPEED)

    def speed_force(run: BushingMotion) -> FloatArray:
        """Splines of the speed, and a step at rest for either direction."""
        splines = _splined(g, curved_speed(run.v, size.speed))
        return np.concatenate([splines, step_at_rest(run.v, size.rest_speed)])

    def radial_speed(run: BushingMotion) -> FloatArray:
        """c(|v|) along the speed, and dry friction against it."""
        speed = _radius(run.v)
        friction = np.tanh(speed / size.rest_speed) / np.maximum(speed, 1e-3 * size.rest_speed)
        factors = np.concatenate([_splined(radial_g, speed), friction[None]])
        return factors[:, :, None] * run.v

    def radial_stops(run: BushingMotion) -> FloatArray:
        """Sliders that yield in the direction of their deflection."""
        yields = size.radial_yields
        return _in_plane(run, yields, _returned) / yields[:, None, None, None]

    none, none_radial = np.zeros((_N_YIELDS,) * 2), np.zeros((_N_RADIAL_YIELDS,) * 2)
    return (
        ForceGroup("f", lambda run: _splined(f, run.u), curvature(_N_FORCE)),
        ForceGroup(
            "radial_f",
            lambda run: _splined(radial_f, _radius(run.u))[:, :, None] * run.u,
            curvature(_N_RADIAL),
        ),
        ForceGroup(
            "time",
            lambda run: in_time(run.time)[:, None, None] * run.u,
            difference_penalty(N_TIME, 1),
        ),
        ForceGroup("g", speed_force, np.pad(curvature(_N_SPEED), (0, 2))),
        ForceGroup("radial_g", radial_speed, np.pad(curvature(_N_RADIAL_SPEED), (0, 1))),
        ForceGroup("h", lambda run: _splined(h, run.u) * run.v, curvature(_N_COUPLED)),
        ForceGroup(
            "radial_h",
            lambda run: _splined(radial_h, _radius(run.u))[:, :, None] * run.v,
            curvature(_N_COUPLED),
        ),
        ForceGroup("stops", lambda run: _stop_forces(run, size.yields), none, True),
        ForceGroup("radial_stops", radial_stops, none_radial, True),
        ForceGroup(
            "smooth_stops",
            lambda run: _in_plane(run, size.radial_yields, _given_way),
            none_radial,
            True,
        ),
        ForceGroup(
            "prony", lambda run: _branches(run, size.taus), np.zeros((N_PRONY, N_PRONY)), True
        ),
    )


def _splined(basis: SplineBasis, values: FloatArray) -> FloatArray:
    """Splines of every value, shape (n_splines, *values.shape)."""
    return basis(values.ravel()).reshape(basis.n, *values.shape)


def _radius(u: FloatArray) -> FloatArray:
    """Size of a vector in y and z, shape (2, n)."""
    return np.asarray(np.hypot(u[:, 0], u[:, 1]))


def _along_each(
    u: FloatArray, n_columns: int, along: Callable[[FloatArray], FloatArray]
) -> FloatArray:
    """Columns of every direction of every bushing, shape (n_columns, 2, 2, n)."""
    columns = np.empty((n_columns, *u.shape))
    for bushing in range(2):
        for direction in range(2):
            if bushing and np.array_equal(u[0, direction], u[1, direction]):
                columns[:, 1, direction] = columns[:, 0, direction]
                continue
            columns[:, bushing, direction] = along(u[bushing, direction])
    return columns


def _stop_forces(run: BushingMotion, yields: FloatArray) -> FloatArray:
    """Sliders in y and in z apart, within -1 and 1, shape (n_yields, 2, 2, n)."""
    return _along_each(run.u, yields.size, lambda x: stops(x, yields, from_rest=True))


def _branches(run: BushingMotion, taus: FloatArray) -> FloatArray:
    """Relaxing branches, shape (n_taus, 2, 2, n)."""
    return _along_each(
        run.u, taus.size, lambda x: relaxing_branches(x, taus, run.step, from_rest=True)
    )


def _in_plane(
    run: BushingMotion,
    yields: FloatArray,
    sliders: Callable[[FloatArray, FloatArray], FloatArray],
) -> FloatArray:
    """Sliders of both bushings in the plane, shape (n_yields, 2, 2, n)."""
    return np.stack([sliders(np.ascontiguousarray(u), yields) for u in run.u], axis=1)


@njit(cache=True)
def _returned(u, yields):  # type: ignore[no-untyped-def]
    """Deflection of sliders in a plane: beyond the yield it returns along its own direction."""
    n = u.shape[1]
    z = np.zeros((yields.size, 2, n))
    state = np.zeros((yields.size, 2))
    for k in range(n):
        for i in range(yields.size):
            for d in range(2):
                state[i, d] += u[d, k] - (u[d, k - 1] if k > 0 else u[d, 0])
            size = np.hypot(state[i, 0], state[i, 1])
            if size > yields[i]:
                state[i] *= yields[i] / size
            z[i, :, k] = state[i]
    return z


@njit(cache=True)
def _given_way(u, yields):  # type: ignore[no-untyped-def]
    """Share of the force at slip: ``dz = (du - |du| z) / yield`` on a straight way (Dahl, 1968).

    Such sliders give way along their path: what small loops left, they lose in the next ones.
    """
    n = u.shape[1]
    z = np.zeros((yields.size, 2, n))
    for i in range(yields.size):
        for k in range(1, n):
            way = np.hypot(u[0, k] - u[0, k - 1], u[1, k] - u[1, k - 1])
            decay = np.exp(-way / yields[i])
            for d in range(2):
                along = (u[d, k] - u[d, k - 1]) / way if way > 0.0 else 0.0
                z[i, d, k] = decay * z[i, d, k - 1] + (1.0 - decay) * along
    return z


def _guide_forces(run: BushingMotion) -> FloatArray:
    """Forces that bearing and axial guide must bear, shape (3, n): p of the coordinates held."""
    body, acceleration = run.body, np.gradient(run.rate, run.step, axis=1)
    free, guided = slice(0, N_FREE), slice(N_FREE, None)
    return np.asarray(
        body.G[guided] @ run.loads.T
        - body.M[guided, free] @ acceleration
        - body.C[guided, free] @ run.rate
        - body.K[guided, free] @ run.q
    )


def _guide_motions(run: BushingMotion, b: FloatArray) -> FloatArray:
    """Signals of motions of what the baseline holds, shape (m, n_channels, n)."""
    body, rate = run.body, np.gradient(b, run.step, axis=-1)
    acceleration = np.gradient(rate, run.step, axis=-1)
    free, guided = slice(0, N_FREE), slice(N_FREE, None)
    p = -(
        body.M[free, guided] @ acceleration + body.C[free, guided] @ rate + body.K[free, guided] @ b
    )
    direct = body.output[:, guided] @ run.zeroed(b)
    return np.asarray(direct + run.signals_of(p))


def bearing_column(run: BushingMotion) -> FloatArray:
    """Bearing that gives way alike in y and in z, shape (1, n_channels, n)."""
    b = _guide_forces(run)
    b[2] = 0.0
    return _guide_motions(run, b[None])


def axial_column(run: BushingMotion) -> FloatArray:
    """Axial stiffness of the bushings: a moment against yaw, shape (1, n_channels, n)."""
    return run.signals_of(_on_free(run, 2, -run.q[2])[None])


def unequal_column(run: BushingMotion) -> FloatArray:
    """Forces of the starboard bushing larger, of the port one smaller, shape (1, n_channels, n)."""
    force = run.body.stiffness * run.u + run.body.damping * run.v
    sides = np.array([1.0, -1.0])[:, None, None]
    return run.signals_of_bushings((force * sides)[None])


def full_stiffness(run: BushingMotion) -> FloatArray:
    """Symmetric map of six motions, shape (n_columns, n_channels, n)."""
    stiff = []
    for i, j in combinations_with_replacement(range(N_FREE), 2):
        p = _on_free(run, i, -run.q[j])
        p[j] = -run.q[i]
        stiff.append(p)
    forces, K = _guide_forces(run), run.body.K[:N_FREE, :N_FREE]
    moves = []
    for i, j in combinations_with_replacement(range(2), 2):
        b = np.zeros_like(forces)
        b[i], b[j] = forces[j], forces[i]
        moves.append(b)
    free = K @ run.q
    for i, j in product(range(N_FREE), range(N_FREE)):
        b = np.zeros_like(forces)
        b[j] = free[i] / K[i, i]
        moves.append(b)
    return np.concatenate([run.signals_of(np.array(stiff)), _guide_motions(run, np.array(moves))])


def _on_free(run: BushingMotion, coordinate: int, values: FloatArray) -> FloatArray:
    """Generalised force on one free coordinate, shape (3, n)."""
    p = np.zeros((N_FREE, run.loads.shape[0]))
    p[coordinate] = values
    return p


def load_columns(run: BushingMotion, way: str) -> FloatArray:
    """Map of the loads in one of its ways, shape (n_columns, n_channels, n).

    ``torque_from_load``: roll by F_y, by F_z; ``direction``: the radial load turned about the axis;
    ``gain``: the radial load too large beside the torque; ``full``: any force of six motions by any
    load but those that act there anyway. A load's own size is no column of the others: with free
    stiffness it would be the measured motion, whatever moves it.
    """
    F = run.loads.T
    free = run.body.G[:N_FREE]
    if way == "torque_from_load":
        return run.signals_of(np.array([_on_free(run, 0, row) for row in F[1:]]))
    if way in ("direction", "gain"):
        y, z = (-F[2], F[1]) if way == "direction" else (F[1], F[2])
        return run.signals_of((free @ np.array([np.zeros_like(y), y, z]))[None])
    others = [
        _on_free(run, i, row)
        for i in range(N_FREE)
        for k, row in enumerate(F)
        if abs(free[i, k]) == 0.0
    ]
    size = np.maximum(np.abs(F).max(axis=1), 1.0)
    b = np.zeros((3 * len(F), 3, F.shape[1]))
    for number, (j, k) in enumerate(product(range(3), range(len(F)))):
        b[number, j] = F[k] / size[k]
    return np.concatenate([run.signals_of(np.array(others)), _guide_motions(run, b)])


def shows_load_gain(motions: Sequence[BushingMotion]) -> bool:
    """Whether torque and radial load both move the housing."""
    squares = np.zeros(2)
    for run in motions:
        for k, columns in enumerate(((0,), (1, 2))):
            p = run.body.G[:N_FREE, columns] @ run.loads[:, columns].T
            squares[k] += float(np.sum(run.signals_of(p[None]) ** 2))
    return bool(squares.min() >= ACTING**2 * squares.sum())


def delay_columns(run: BushingMotion, way: str, delays: Sequence[float] | FloatArray) -> FloatArray:
    """Loads that act later by each delay, less those that act at once."""
    added = np.zeros((len(delays), *run.loads.shape))
    for late, delay in zip(added, delays, strict=True):
        for k in _LOADS[way]:
            moved = np.interp(run.time - delay, run.time, run.loads[:, k])
            late[:, k] = moved - run.loads[:, k]
    return run.signals_of(run.body.G[:N_FREE] @ added.transpose(0, 2, 1))


def gain_channels(motions: Sequence[BushingMotion]) -> list[int]:
    """Channels whose gain may be wrong: the baseline moves them, and more than they are off."""
    predicted = [run.zeroed(run.predicted) for run in motions]
    gaps = [np.nan_to_num(run.gap) for run in motions]
    squares = [
        np.sum([np.sum(np.square(values), axis=1) for values in runs], axis=0)
        for runs in (predicted, gaps)
    ]
    return np.flatnonzero(squares[0] > _LEAST_MOVED**2 * squares[1]).tolist()


def channel_column(run: BushingMotion, channel: int, values: FloatArray | float) -> FloatArray:
    """Values in one channel, shape (1, n_channels, n): its signal for a gain, one for a zero."""
    column = np.zeros((1, *run.signals.shape))
    column[0, channel] = values
    return column


#: Laws that are no forces of the bushings: signals of a run for unit amplitude.
_SIGNALS: Mapping[str, Callable[[BushingMotion], FloatArray]] = {
    "sensor_gain": lambda run: np.array(
        [channel_column(run, k, signal) for k, signal in enumerate(run.signals)]
    ),
    "sensor_zero": lambda run: np.array(
        [channel_column(run, k, 1.0) for k in range(len(run.signals))]
    ),
    "sensor_delay": lambda run: delay_columns(run, "all", DELAYS)[:, None],
    "parasitic_torque": lambda run: load_columns(run, "torque_from_load")[None, 1:],
    "ntl_direction": lambda run: load_columns(run, "direction")[None, :1],
    "axial_bushing_stiffness": lambda run: axial_column(run)[None],
    "main_bearing_compliance": lambda run: bearing_column(run)[None],
    "unequal_bushings": lambda run: unequal_column(run)[None],
}
#: Laws of one shape: force over deflection and speed.
_FORCES: Mapping[str, Callable[[FloatArray, FloatArray], FloatArray]] = {
    "cubic_stiffness": lambda u, v: u**3,
    "quintic_stiffness": lambda u, v: u**5,
    "deflection_dependent_damping": lambda u, v: u**2 * v,
}


def law_signals(
    model: MountingModel, size: BushingSize, run: BushingMotion, law: str
) -> FloatArray:
    """Signals of a law for unit amplitude, shape (n_shapes, n_columns, n_channels, n)."""
    if law in _SIGNALS:
        return _SIGNALS[law](run)
    forces = law_forces(model, size, run, law)
    signals = run.signals_of_bushings(forces.reshape(-1, *forces.shape[2:]))
    return signals.reshape(*forces.shape[:2], *run.signals.shape)


def law_forces(model: MountingModel, size: BushingSize, run: BushingMotion, law: str) -> FloatArray:
    """Forces of the bushings for unit amplitude, shape (n_shapes, n_columns, 2, 2, n)."""
    if law in _FORCES:
        return _FORCES[law](run.u, run.v)[None, None]
    if law == "fluid_branch":
        return _branches(run, _LAW_TAUS * run.step)[:, None]
    if law == "elasto_plastic_friction":
        return _stop_forces(run, _LAW_YIELDS * size.deflection)[:, None]
    if law in model.measured:
        laws = packed_laws([(model.measured[law], 1.0)])
        return bushing_forces(laws, run.u, run.v, run.step)[None, None]
    return _user_forces(model, run, law)


def _user_forces(model: MountingModel, run: BushingMotion, law: str) -> FloatArray:
    """Forces of a user's law at multiples of the scales of its shapes, amplitude by amplitude."""
    parameters = [p for p in model.parameters((law,)) if p.effect == law]
    is_shape = np.array([p.shape for p in parameters])
    scales = np.array([p.scale for p in parameters])
    motion = list(zip(run.u.ravel().tolist(), run.v.ravel().tolist(), strict=True))
    forces = []
    for share in USER_SHARES if is_shape.any() else (1.0,):
        shapes = np.where(is_shape, np.clip(share * scales, *bounds_of(parameters)), 0.0)
        for amplitude in np.flatnonzero(~is_shape):
            values = shapes + (np.arange(shapes.size) == amplitude)
            forces.append([model.laws[law](u, v, values) for u, v in motion])
    return np.reshape(forces, (-1, np.count_nonzero(~is_shape), *run.u.shape))
