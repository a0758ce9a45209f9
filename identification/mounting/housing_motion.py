"""Rigid-body motion of the gearbox housing from its motion sensors (2011 paper, eqs 8 to 10)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.mounting.rig import HOUSING_MOTION, SENSORS, MountingRig

#: A singular value below this share of the largest one: the sensors do not see the direction.
_UNSEEN = 1e-9


@dataclass(frozen=True, eq=False)
class HousingMotion:
    """Motion of the origin midway between the bushings.

    Parameters
    ----------
    coordinates : tuple of str
        Coordinates that were solved for; the others are zero by assumption.
    motion : ndarray, shape (n, n_coordinates)
        Displacements [m] and rotations [rad]; NaN where too few sensors read.
    residual : ndarray, shape (n, n_sensors)
        Sensor signals less those of the motion [m]; zero where there are no more sensors than
        coordinates.
    condition_number : float
        Of the sensor matrix as it stands, rotations in rad and positions in m.
    incomplete_samples : int
        Samples at which a sensor was missing and the others sufficed.
    lost_samples : int
        Samples at which the others did not suffice.
    """

    coordinates: tuple[str, ...]
    motion: NDArray[np.float64]
    residual: NDArray[np.float64]
    condition_number: float
    incomplete_samples: int
    lost_samples: int


def housing_motion(
    rig: MountingRig,
    signals: Mapping[str, NDArray[np.float64]],
    *,
    coordinates: Sequence[str] = HOUSING_MOTION,
) -> HousingMotion:
    """Solve ``s = T d`` for the housing's motion, by least squares where sensors are more.

    Parameters
    ----------
    rig : MountingRig
        Positions of the sensors.
    signals : mapping of str to ndarray, shape (n,)
        Displacement [m] by sensor (ssx, spx, ssz, spz, spy, sbx); missing samples NaN. A sensor
        that is absent is left out.
    coordinates : sequence of str
        Coordinates to solve for, out of d_x, d_y, d_z, theta_x, theta_y, theta_z; the others are
        taken as zero.

    Returns
    -------
    HousingMotion
        Motion with residual and condition number.

    Raises
    ------
    ValueError
        Where a name is unknown, or the sensors at hand cannot tell the coordinates apart; the
        message names the combination that they do not see.

    References
    ----------
    .. [1] 2011 paper, equations (8) to (10): six sensors, six coordinates, ``d = T^-1 s``.
    """
    _refuse_unknown(signals, SENSORS, "sensor")
    _refuse_unknown(coordinates, HOUSING_MOTION, "coordinate")
    sensors = tuple(name for name in SENSORS if name in signals)
    rows = [SENSORS.index(name) for name in sensors]
    columns = [HOUSING_MOTION.index(name) for name in coordinates]
    T = rig.sensor_matrix[np.ix_(rows, columns)]
    _refuse_unseen(T, sensors, tuple(coordinates))
    s = np.column_stack([signals[name] for name in sensors])
    present = np.isfinite(s)
    motion = np.full((len(s), len(columns)), np.nan)
    patterns, which = np.unique(present, axis=0, return_inverse=True)
    for number, pattern in enumerate(patterns):
        if np.linalg.matrix_rank(T[pattern], tol=_UNSEEN * np.linalg.norm(T)) == len(columns):
            samples = which.ravel() == number
            motion[samples] = s[np.ix_(samples, pattern)] @ np.linalg.pinv(T[pattern]).T
    solved = np.isfinite(motion).all(axis=1)
    return HousingMotion(
        coordinates=tuple(coordinates),
        motion=motion,
        residual=s - motion @ T.T,
        condition_number=float(np.linalg.cond(T)),
        incomplete_samples=int((solved & ~present.all(axis=1)).sum()),
        lost_samples=int((~solved).sum()),
    )


def _refuse_unknown(
    names: Mapping[str, object] | Sequence[str], known: Sequence[str], what: str
) -> None:
    for name in names:
        if name not in known:
            raise ValueError(
                f"housing motion: unknown {what} '{name}'; expected one of {', '.join(known)}"
            )


def _refuse_unseen(
    T: NDArray[np.float64], sensors: Sequence[str], coordinates: Sequence[str]
) -> None:
    """Refuse sensors that leave a direction of motion unseen, and name it."""
    _, sizes, directions = np.linalg.svd(T)
    rank = int((sizes > _UNSEEN * sizes[0]).sum()) if sizes.size else 0
    if rank == len(coordinates):
        return
    unseen = directions[-1] / np.abs(directions[-1]).max()
    terms = " ".join(
        f"{share:+.2g} {name}"
        for share, name in zip(unseen, coordinates, strict=True)
        if abs(share) > 1e-6
    )
    raise ValueError(
        f"housing motion: {len(sensors)} sensors ({', '.join(sensors)}) see {rank} of "
        f"{len(coordinates)} coordinates; the "
        f"motion {terms} stays unseen; expected more sensors, or fewer coordinates to solve for"
    )
