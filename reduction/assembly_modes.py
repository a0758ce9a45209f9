"""Elastic free modes of a reduced body or an assembly, each told by what moves most in it."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from carrierflex.reduction.mode_names import rim_motion_name
from carrierflex.reduction.reduced_model import ReducedModel

_N_RIGID = 6


@dataclass(frozen=True, eq=False)
class AssemblyMode:
    """One elastic free mode.

    Natural frequency [Hz], pilot with the largest displacement, motion of the rim in words, and
    the assembly's coordinates in the mode, shape (n,), to any scale.
    """

    frequency_hz: float
    leading_pilot: str
    rim_motion: str
    shape: NDArray[np.float64]


def assembly_modes(model: ReducedModel, n_modes: int) -> tuple[AssemblyMode, ...]:
    """Lowest elastic modes of the free body, ``K q = omega² M q`` beyond the six rigid motions.

    Parameters
    ----------
    model : ReducedModel
        Free body with rim sensors.
    n_modes : int
        Elastic modes wanted.

    Returns
    -------
    tuple of AssemblyMode
        By ascending frequency.

    Raises
    ------
    ValueError
        Where the body is not free: fewer or more than six motions meet no stiffness.
    """
    scale = 1.0 / np.sqrt(model.M.diagonal())
    omega_squared, q = scipy.linalg.eigh(
        model.K * np.outer(scale, scale), model.M * np.outer(scale, scale)
    )
    rigid = int(np.count_nonzero(np.abs(omega_squared) < 1e-6 * abs(omega_squared[_N_RIGID])))
    if rigid != _N_RIGID:
        raise ValueError(
            f"{model.name}: {rigid} motions meet no stiffness; expected the six of a free body"
        )
    shapes = (scale[:, None] * q)[:, _N_RIGID : _N_RIGID + n_modes]
    hz = np.sqrt(omega_squared[_N_RIGID : _N_RIGID + n_modes]) / (2.0 * np.pi)
    return tuple(
        AssemblyMode(float(f), _leading_pilot(model, shape), _rim(model, shape), shape)
        for f, shape in zip(hz, shapes.T, strict=True)
    )


def _leading_pilot(model: ReducedModel, shape: NDArray[np.float64]) -> str:
    size = {
        pilot: float(np.linalg.norm(shape[rows[:3]]))
        for pilot, rows in model.pilot_coordinates.items()
    }
    return max(size, key=lambda pilot: size[pilot])


def _rim(model: ReducedModel, shape: NDArray[np.float64]) -> str:
    motion = model.sensor_rows @ shape
    axial, radial = (
        motion[[name.startswith(f"rim_{direction}") for name in model.sensor_names]]
        for direction in ("axial", "radial")
    )
    return rim_motion_name(axial, radial) if len(axial) and len(radial) else "no rim sensors"
