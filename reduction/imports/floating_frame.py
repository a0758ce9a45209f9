"""A free body from data in a floating frame of reference.

Such data hold the motion of the frame, six rigid coordinates, and r elastic ones q. In x = (frame,
q) at rest, with the letters of the standard input data,

    M = [[m 1, -(m c)~, Ctᵀ], [(m c)~, J, Crᵀ], [Ct, Cr, Me]],    K = diag(0, Ke),

and a node at the point p moves as the frame carries it plus (φ q, ψ q). The nodes that can move
independently become pilots.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from carrierflex.fe.surface_integrals import rigid_body_modes
from carrierflex.reduction.ffrf_data import AXIS_PAIRS, FfrfData
from carrierflex.reduction.imports.imported_body import ImportedBody, origin_of, pilot_labels
from carrierflex.reduction.imports.pilot_form import independent_groups, pilot_form
from carrierflex.reduction.reduced_model import MassProperties, ReducedModel

_SIX = 6
#: Eigenvalue of the mass, scaled to unit diagonal, below which motions of the file are dependent.
_DEPENDENT = 1e-9
_EPSILON = np.zeros((3, 3, 3))
_EPSILON[[0, 1, 2], [1, 2, 0], [2, 0, 1]] = 1.0
_EPSILON[[0, 2, 1], [2, 1, 0], [1, 0, 2]] = -1.0
_MOST_LISTED = 6


@dataclass(frozen=True, eq=False)
class FrameBody:
    """A body of r elastic coordinates in a floating frame.

    Parameters
    ----------
    name : str
        Name of the body.
    Ke, De : ndarray, shape (r, r)
        Elastic stiffness and damping.
    data : FfrfData
        Inertia of the elastic coordinates about the frame's origin.
    nodes : tuple of str
        Names of the p nodes.
    points : ndarray, shape (p, 3)
        Their places.
    motion : ndarray, shape (p, 6, r)
        Translation φ and rotation ψ of every node by coordinate.
    """

    name: str
    Ke: NDArray[np.float64]
    De: NDArray[np.float64]
    data: FfrfData
    nodes: tuple[str, ...]
    points: NDArray[np.float64]
    motion: NDArray[np.float64]


def free_body(
    body: FrameBody, source: str, format: str, losses: Sequence[str] = ()
) -> ImportedBody:
    """The free body that floating-frame data describe.

    Parameters
    ----------
    body : FrameBody
        The data.
    source, format : str
        Name of the file and its format, for provenance.
    losses : sequence of str
        What the file has beyond the data.

    Returns
    -------
    ImportedBody
        Pilots first, then fixed-interface modes; nodes that depend on the pilots are sensors of
        their three translations.

    Raises
    ------
    ValueError
        Where the mass is not positive, or no node can move by six components.
    """
    full = with_frame(body.data)
    M, s = full.Me, 1.0 / np.sqrt(np.maximum(full.Me.diagonal(), np.finfo(float).tiny))
    V, n_dependent = _independent_basis(M, s)
    full = full.transformed(V)
    K, D = (V.T @ scipy.linalg.block_diag(np.zeros((6, 6)), A) @ V for A in (body.Ke, body.De))
    motions = (
        np.array(
            [
                np.hstack([rigid_body_modes(np.zeros((0, 3)), point[None], np.zeros(3)), motion])
                for point, motion in zip(body.points, body.motion, strict=True)
            ]
        ).reshape(-1, _SIX, _SIX + len(body.Ke))
        @ V
    )
    chosen, others = independent_groups(motions, 1.0 / np.sqrt(full.Me.diagonal()))
    if not chosen:
        raise ValueError(
            f"{len(body.nodes)} nodes, none of which moves by six components; expected one node "
            "with translations and rotations at least, to be the pilot"
        )
    form = pilot_form(K, full.Me, D, np.concatenate([motions[i] for i in chosen]))
    if len(chosen) == 1:
        # A free body meets no force at its only pilot; what is there is rounding.
        form.K[:_SIX, :_SIX] = 0.0
    pilots = {body.nodes[i]: body.points[i] for i in chosen}
    n = len(form.K)
    reported = [*losses]
    if n_dependent:
        reported.append(f"{n_dependent} motions are combinations of the others and left out")
    if others:
        reported.append(
            f"{len(others)} of {len(body.nodes)} nodes follow from the pilots and modes, which "
            f"are too few for six coordinates each: sensors, no pilots "
            f"({_listed([body.nodes[i] for i in others])})"
        )
    labels = (
        *pilot_labels([(name, tuple(range(_SIX))) for name in pilots]),
        *(f"mode {i} ({w / (2.0 * np.pi):.1f} Hz)" for i, w in enumerate(form.omega, start=1)),
    )
    data = body.data
    c = data.centre
    model = ReducedModel(
        name=body.name,
        K=form.K,
        M=form.M,
        D=form.D,
        labels=labels,
        pilots=pilots,
        pilot_coordinates={
            name: np.arange(_SIX * i, _SIX * (i + 1)) for i, name in enumerate(pilots)
        },
        sensor_names=tuple(f"{body.nodes[i]} {axis}" for i in others for axis in "xyz"),
        sensor_rows=np.concatenate([np.zeros((0, n)), *(motions[i, :3] @ form.X for i in others)]),
        mass_properties=MassProperties(
            data.mass, c, data.J - data.mass * (c @ c * np.eye(3) - np.outer(c, c))
        ),
        provenance=origin_of(source, format),
        ffrf=full.transformed(form.X),
    )
    return ImportedBody(model, tuple(reported))


def without_invariants(imported: ImportedBody, reason: str) -> ImportedBody:
    """The body without inertia invariants, of which the file has not all."""
    model = replace(imported.model, ffrf=None)
    return ImportedBody(model, (*imported.losses, reason))


def with_frame(data: FfrfData) -> FfrfData:
    """Invariants of the coordinates (frame, q): six rigid motions about the origin come first.

    The field of a rotation about the axis c is ``e_c × x``, that of a translation ``e_c``.
    """
    r = data.n_coordinates
    first, S, blocks = data.first_moment, data.second_moment, data.blocks
    #: (e_c × x)_b = ε_bcd x_d
    N = np.hstack([data.mass * np.eye(3), np.einsum("bcd,d->bc", _EPSILON, first), data.N])
    P = np.concatenate(
        [
            np.einsum("a,bc->abc", first, np.eye(3)),
            np.einsum("bcd,ad->abc", _EPSILON, S),
            data.P,
        ],
        axis=2,
    )
    n = _SIX + r
    Q = np.zeros((3, 3, n, n))
    for a in range(3):
        for b in range(3):
            Q[a, b, a] = N[b]
            Q[a, b, 3:6] = np.einsum("cd,dj->cj", _EPSILON[a], P[:, b])
            Q[a, b, 6:, 6:] = blocks[a, b]
    for a in range(3):
        for b in range(3):
            Q[a, b, 6:, :6] = Q[b, a, :6, 6:].T
    return FfrfData(data.mass, first, S, N, P, np.array([Q[a, b] for a, b in AXIS_PAIRS]))


def _independent_basis(
    M: NDArray[np.float64], s: NDArray[np.float64]
) -> tuple[NDArray[np.float64], int]:
    """Combinations of the coordinates that have mass of their own, and how many have not."""
    values, vectors = np.linalg.eigh(M * np.outer(s, s))
    if values[0] < -_DEPENDENT:
        raise ValueError(
            f"the mass with the frame's six motions is not positive: lowest eigenvalue "
            f"{values[0]:.2g} of the matrix scaled to unit diagonal; expected mdCM, J, Ct, Cr and "
            "Me of one body about one origin: write the file again"
        )
    independent = values > _DEPENDENT
    if independent.all():
        return np.eye(len(M)), 0
    return s[:, None] * vectors[:, independent], int(np.count_nonzero(~independent))


def _listed(names: Sequence[str]) -> str:
    more = ", ..." if len(names) > _MOST_LISTED else ""
    return ", ".join(names[:_MOST_LISTED]) + more
