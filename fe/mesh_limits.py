"""What the mesh leaves of the deflection curves: their orders at elements of no size."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.geometry.parameter_files import StageParameters

#: Sizes that a limit is taken from, over the size that the curves are computed with: this one last.
_SIZES = (1.25, 0.8, 1.0)


def mesh_limit(
    sizes: Sequence[float], values: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Values at elements of no size, by a straight line through those at several sizes.

    ``v(h) = v_0 + g h``: the edges where webs and hub meet the plates are re-entrant, the error of
    a stress singularity falls with the size and not with its square.

    Parameters
    ----------
    sizes : sequence of float
        Element edge lengths [m], two or more.
    values : ndarray, shape (n_sizes, ...)
        Values by size.

    Returns
    -------
    limit, error : ndarray
        ``v_0``, and its standard error by the scatter about the line; NaN of two sizes.
    """
    h = np.asarray(sizes, np.float64)
    A = np.stack([np.ones_like(h), h], axis=1)
    flat = values.reshape(len(h), -1)
    fit, *_ = np.linalg.lstsq(A, flat, rcond=None)
    freedom = len(h) - 2
    scatter = np.full(flat.shape[1], np.nan)
    if freedom:
        scatter = np.sqrt(((flat - A @ fit) ** 2).sum(axis=0) / freedom)
    error = scatter * np.sqrt(np.linalg.inv(A.T @ A)[0, 0])
    return fit[0].reshape(values.shape[1:]), error.reshape(values.shape[1:])


@dataclass(frozen=True)
class MeshError:
    """Error of one order of a curve by its mesh."""

    curve: Annotated[str, "delta_s, delta_f, g_s or g_f"]
    order: Annotated[int, "Order"]
    amplitude: Annotated[float, "With the elements of the curves [m per kN m or per N]"]
    limit: Annotated[float, "At elements of no size, by a straight line in the size"]
    error: Annotated[float, "Magnitude of the difference of both complex amplitudes"]
    standard_error: Annotated[float, "Of the limit, by the scatter about the line"]
    share: Annotated[float, "The error over the RMS of the curve"]


def mesh_errors(
    stage: StageParameters,
    size: float,
    *,
    note: Callable[[str, float], None] = lambda text, share: None,
) -> tuple[MeshError, ...]:
    """Errors of all curves' main orders for the parametric carrier with elements of one size.

    Two more meshes serve, 1.25 and 0.8 times the size. Orders: N, 2 N, 3 N of N
    planets for a torque, 1 to 3 for one pin's force.

    Parameters
    ----------
    stage : StageParameters
        Dimensions.
    size : float
        Element edge length [m].
    note : callable
        Told each mesh with the share of the work that is done.

    Raises
    ------
    ValueError, MeshingError
        Where one of the meshes cannot be made.
    """
    # Late: commands that describe the result do not wait for gmsh.
    from carrierflex.fe.curve_derivatives import half_sector_curves
    from carrierflex.geometry.carrier_mesh import flexible_half_sector, stiff_half_sector

    sizes = tuple(factor * size for factor in _SIZES)
    curves = []
    for number, edge in enumerate(sizes):
        note(f"elements of {edge:.3g} m", number / len(sizes))
        both = half_sector_curves(flexible_half_sector(stage.carrier, edge), stage)
        stiff = stiff_half_sector(stage.carrier, stage.pin, edge)
        curves.append(both | half_sector_curves(stiff, stage))
    return tuple(curve_errors(sizes, curves, stage.carrier.n_planets))


def curve_errors(
    sizes: Sequence[float], curves: Sequence[Mapping[str, DeflectionCurve]], n_planets: int
) -> Iterator[MeshError]:
    """Errors of the last of several sizes' curves.

    Parameters
    ----------
    sizes : sequence of float
        Element edge lengths [m], that of the curves last.
    curves : sequence of mapping
        Curves by name, for each size.
    n_planets : int
        Number of pins.
    """
    for name, curve in curves[-1].items():
        for order in curve.main_orders(n_planets):
            c = np.array([of_size[name].axial_order(order) for of_size in curves])
            limit, scatter = mesh_limit(sizes, np.stack([c.real, c.imag], axis=1))
            c_0 = complex(*limit)
            error = abs(c_0 - c[-1])
            standard_error = float(np.hypot(*scatter))
            yield MeshError(
                name, order, abs(c[-1]), abs(c_0), error, standard_error, error / curve.rms
            )
