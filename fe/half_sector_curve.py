"""Torque deflection curve from the half sector alone: one of 2 N images of N planets.

Under equal tangential pin loads the carrier's displacement is antisymmetric about every pin's and
every web's meridional plane, so on those planes the radial and axial displacement vanish. The shaft
face is held.
"""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.assembly import assemble_stiffness
from carrierflex.fe.carrier_curves import UNIT_TORQUE
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.fe.half_sector_sensors import folded_circle
from carrierflex.fe.load_cases import PilotLoad
from carrierflex.fe.materials import BODY_MATERIALS
from carrierflex.fe.rim_circle import rim_recovery
from carrierflex.fe.structural_model import carrier_pilot_points
from carrierflex.fe.surface_integrals import surface_moments
from carrierflex.fe.two_level_solution import linear_part, two_level_solution
from carrierflex.geometry.dihedral import cut_plane_nodes
from carrierflex.geometry.parameters import CarrierParameters, half_sector_angle
from carrierflex.geometry.tet_mesh import TetMesh

#: Reflection of a rigid motion about the plane y = 0: translations keep x and z, rotations keep y.
_MIRROR = np.diag([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])


def half_sector_curve(
    half: TetMesh, carrier: CarrierParameters, pin_1_load: dict[str, PilotLoad]
) -> DeflectionCurve:
    """Deflection curve under a unit drive torque, computed on the half sector.

    Parameters
    ----------
    half : TetMesh
        Half sector with its named surfaces.
    carrier : CarrierParameters
        Dimensions [m].
    pin_1_load : mapping of str to ndarray, shape (6,)
        Load of the whole pin 1 at its pilots for a torque of 1 kN m: a force along t and,
        optionally, a moment about t.

    Returns
    -------
    DeflectionCurve
        Axial and radial curve over the whole circle, continued by the symmetry.

    Notes
    -----
    A moment about t bends the carrier symmetrically and is left out of the half sector: it is
    refused.

    Raises
    ------
    ValueError
        Where the load is not antisymmetric about the pin's plane.
    SingularMatrixError, AccuracyError
        From :func:`carrierflex.fe.two_level_solution.two_level_solution`.
    """
    f = np.zeros(half.points.size)
    points = carrier_pilot_points(carrier)
    for name, load in pin_1_load.items():
        if np.abs(_MIRROR @ load + load).max() > 1e-9 * np.abs(load).max():
            raise ValueError(
                f"load at {name} is not antisymmetric about the pin's plane; expected a force "
                "along t only"
            )
        B, Z = surface_moments(half, half.surface(name), points[name])
        f += B.reshape(6, -1).T @ np.linalg.solve(Z + _MIRROR @ Z @ _MIRROR, load)
    T = _admitted_displacements(half, carrier.n_planets)
    to_unknowns = sp.csr_array(T.T)
    A = to_unknowns @ assemble_stiffness(half, BODY_MATERIALS) @ T
    P = sp.csc_array(to_unknowns @ linear_part(half) @ T)
    coarse = sp.csr_array(P[:, np.diff(P.indptr) > 0])
    return _whole_circle(half, carrier, T @ two_level_solution(A, coarse, to_unknowns @ f))


def _admitted_displacements(half: TetMesh, n_planets: int) -> sp.csr_array:
    """Displacement of the nodes from the unknowns that neither symmetry nor shaft face holds.

    Those of a node on the web's plane are turned into (x, radial, tangential).
    """
    on_pin, on_web = cut_plane_nodes(half, n_planets)
    n = len(half.points)
    angle = half_sector_angle(n_planets)
    c, s = np.cos(angle), np.sin(angle)
    blocks = np.tile(np.eye(3), (n, 1, 1))
    blocks[on_web] = np.array([[1.0, 0.0, 0.0], [0.0, -s, -c], [0.0, c, -s]])
    T = sp.csr_array(sp.bsr_array((blocks, np.arange(n), np.arange(n + 1))))
    fixed = np.zeros((n, 3), dtype=bool)
    fixed[np.unique(half.surface("shaft_face"))] = True
    fixed[on_pin] |= [True, False, True]
    fixed[on_web] |= [True, True, False]
    return sp.csr_array(T[:, np.flatnonzero(~fixed.ravel())])


def _whole_circle(
    half: TetMesh, carrier: CarrierParameters, u: NDArray[np.float64]
) -> DeflectionCurve:
    circle, radius = folded_circle(carrier.n_planets), carrier.sensor_radius
    # The displacement is antisymmetric: a mirrored image has its sign turned.
    sign = np.where(circle.images % 2 == 1, -1.0, 1.0)
    axial, radial = (
        sign * (rows @ u)[circle.angle_index] for rows in rim_recovery(half, radius, circle.angles)
    )
    return DeflectionCurve("torque", radius, UNIT_TORQUE, axial, radial)
