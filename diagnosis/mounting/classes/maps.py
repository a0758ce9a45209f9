"""Maps from loads to signals without a fixed form: stiffness, loads, sensors, delay.

Each column is what the map adds to the signals of a run, shape (n_channels, n). Stiffness between
free motions and the load map answer through the housing; where the map moves what the baseline
holds (bearing, axial guide) that motion is seen at once, and loads the bushings besides.
"""

from collections.abc import Sequence

import numpy as np

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.mounting.classes.motion import BushingMotion
from carrierflex.diagnosis.mounting.classes.rigid_body import N_FREE, RigidBody

#: Delays among which the one that fits is sought [s], both signs.
DELAYS = np.geomspace(0.004, 0.3, 14)
#: Motion of a channel over what is missing in it from which a gain may be the reason.
_LEAST_MOVED = 1.5
#: Share of the motion that the smaller of torque and radial load must make.
_LEAST_PART = 0.1
_LOADS = {"all": (0, 1, 2), "torque": (0,), "radial_load": (1, 2)}


def signals_of(body: RigidBody, own: BushingMotion, p: FloatArray) -> FloatArray:
    """Signals that generalised forces on the free coordinates make, shape (m, n_channels, n)."""
    moved = body.response(p, own.step)
    return np.asarray(body.free_output @ own.zeroed(moved))


def held_forces(body: RigidBody, own: BushingMotion) -> FloatArray:
    """Forces that bearing and axial guide must bear, shape (3, n): p of the coordinates held."""
    acceleration = np.gradient(own.rate, own.step, axis=1)
    free, held = slice(0, N_FREE), slice(N_FREE, None)
    return np.asarray(
        body.G[held] @ own.loads.T
        - body.M[held, free] @ acceleration
        - body.C[held, free] @ own.rate
        - body.K[held, free] @ own.q
    )


def held_motions(body: RigidBody, own: BushingMotion, b: FloatArray) -> FloatArray:
    """Signals of motions of what the baseline holds, shape (m, n_channels, n).

    Parameters
    ----------
    body : RigidBody
        Housing.
    own : BushingMotion
        Run.
    b : ndarray, shape (m, 3, n)
        Motion of bearing in z and y, and along the axis.
    """
    rate = np.gradient(b, own.step, axis=-1)
    acceleration = np.gradient(rate, own.step, axis=-1)
    free, held = slice(0, N_FREE), slice(N_FREE, None)
    p = -(body.M[free, held] @ acceleration + body.C[free, held] @ rate + body.K[free, held] @ b)
    seen = body.output[:, held] @ own.zeroed(b)
    return np.asarray(seen + signals_of(body, own, p))


def bearing_column(body: RigidBody, own: BushingMotion) -> FloatArray:
    """Bearing that gives way alike in y and in z, shape (1, n_channels, n)."""
    b = held_forces(body, own)
    b[2] = 0.0
    return held_motions(body, own, b[None])


def axial_column(body: RigidBody, own: BushingMotion) -> FloatArray:
    """Axial stiffness of the bushings: a moment against yaw, shape (1, n_channels, n)."""
    return signals_of(body, own, _on_free(own, 2, -own.q[2])[None])


def unequal_column(body: RigidBody, own: BushingMotion) -> FloatArray:
    """Forces of the starboard bushing larger, of the port one smaller, shape (1, n_channels, n)."""
    force = body.stiffness * own.u + body.damping * own.v
    sides = np.array([1.0, -1.0])[:, None, None]
    return signals_of(body, own, body.on_coordinates((force * sides)[None]))


def full_stiffness(body: RigidBody, own: BushingMotion) -> FloatArray:
    """Symmetric map of six motions, shape (n_columns, n_channels, n).

    Stiffness between the free coordinates (6), compliance of bearing and guide (6, of which those
    of the guide are zero without axial forces), and one flexibility between every free and every
    held coordinate (9).
    """
    stiff = []
    for i in range(N_FREE):
        for j in range(i, N_FREE):
            p = _on_free(own, i, -own.q[j])
            if i != j:
                p += _on_free(own, j, -own.q[i])
            stiff.append(p)
    held = held_forces(body, own)
    free = body.K[:N_FREE, :N_FREE] @ own.q
    moves = []
    for i in range(2):
        for j in range(i, 2):
            b = np.zeros_like(held)
            b[i] += held[j]
            if i != j:
                b[j] += held[i]
            moves.append(b)
    for i in range(N_FREE):
        for j in range(N_FREE):
            b = np.zeros_like(held)
            b[j] = free[i] / body.K[i, i]
            moves.append(b)
    return np.concatenate(
        [signals_of(body, own, np.array(stiff)), held_motions(body, own, np.array(moves))]
    )


def _on_free(own: BushingMotion, place: int, values: FloatArray) -> FloatArray:
    """Generalised force on one free coordinate, shape (3, n)."""
    p = np.zeros((N_FREE, own.loads.shape[0]))
    p[place] = values
    return p


def load_columns(body: RigidBody, own: BushingMotion, way: str) -> FloatArray:
    """Map of the loads in one of its ways, shape (n_columns, n_channels, n).

    ``torque_from_load``: roll by F_y, by F_z; ``direction``: the radial load turned about the axis;
    ``gain``: the radial load too large beside the torque; ``full``: any force of six motions by any
    load but those that act there anyway. A load's own size is no column of the others: with free
    stiffness it would be the measured motion, whatever moves it.
    """
    F = own.loads.T
    free = body.G[:N_FREE]
    if way == "torque_from_load":
        return signals_of(body, own, np.array([_on_free(own, 0, row) for row in F[1:]]))
    if way == "direction":
        turned = np.array([np.zeros_like(F[0]), -F[2], F[1]])
        return signals_of(body, own, (free @ turned)[None])
    if way == "gain":
        radial = np.array([np.zeros_like(F[0]), F[1], F[2]])
        return signals_of(body, own, (free @ radial)[None])
    others = [
        _on_free(own, i, row)
        for i in range(N_FREE)
        for k, row in enumerate(F)
        if abs(free[i, k]) == 0.0
    ]
    size = np.maximum(np.abs(F).max(axis=1), 1.0)
    b = np.zeros((3 * len(F), 3, F.shape[1]))
    for j in range(3):
        for k, row in enumerate(F):
            b[len(F) * j + k, j] = row / size[k]
    return np.concatenate([signals_of(body, own, np.array(others)), held_motions(body, own, b)])


def tells_load_gain(body: RigidBody, motions: Sequence[BushingMotion]) -> bool:
    """Whether torque and radial load both move the housing.

    Else the size of the only load is that of the stiffness.
    """
    parts = np.zeros(2)
    for own in motions:
        for k, columns in enumerate(((0,), (1, 2))):
            p = body.G[:N_FREE, columns] @ own.loads[:, columns].T
            moved = signals_of(body, own, p[None])
            parts[k] += float(np.sum(moved**2))
    return bool(parts.min() >= _LEAST_PART**2 * parts.sum())


def delay_columns(
    body: RigidBody, own: BushingMotion, way: str, delays: Sequence[float] | FloatArray
) -> FloatArray:
    """Loads that act later by each delay, less those that act at once.

    Shape (n_delays, n_channels, n). Signals that come later are the same: the motion does not know
    the time.
    """
    added = np.zeros((len(delays), *own.loads.shape))
    for late, delay in zip(added, delays, strict=True):
        for k in _LOADS[way]:
            moved = np.interp(own.time - delay, own.time, own.loads[:, k])
            late[:, k] = moved - own.loads[:, k]
    return signals_of(body, own, body.G[:N_FREE] @ added.transpose(0, 2, 1))


def gain_column(own: BushingMotion, channel: int) -> FloatArray:
    """One channel's own signal, shape (1, n_channels, n).

    As measured: of what the baseline predicts, gains of all channels at minus one would leave the
    measured motion, which free stiffness returns whatever moves it.
    """
    found = np.zeros((1, *own.signals.shape))
    found[0, channel] = own.signals[channel]
    return found


def gain_channels(motions: Sequence[BushingMotion]) -> list[int]:
    """Channels whose gain may be wrong: the baseline moves them, and more than they are off.

    A channel that the baseline leaves at rest would explain itself.
    """
    squares = [
        np.sum([np.sum(np.square(values(own)), axis=1) for own in motions], axis=0)
        for values in (lambda own: own.zeroed(own.predicted), lambda own: np.nan_to_num(own.gap))
    ]
    return np.flatnonzero(squares[0] > _LEAST_MOVED**2 * squares[1]).tolist()


def zero_column(own: BushingMotion, channel: int) -> FloatArray:
    """A constant in one channel, shape (1, n_channels, n)."""
    found = np.zeros((1, *own.signals.shape))
    found[0, channel] = 1.0
    return found
