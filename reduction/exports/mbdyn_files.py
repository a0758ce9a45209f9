"""Modal data of MBDyn (``.fem``).

Modes, matrices and inertia invariants in the frame of one held pilot.
"""

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.whole_files import whole_file
from carrierflex.reduction.exports.ordered_body import HeldBody, comments, header, held_body
from carrierflex.reduction.reduced_model import ReducedModel


def write_mbdyn(model: ReducedModel, path: Path, *, pilot: str | None = None) -> None:
    """Write a body for MBDyn's modal joint.

    The basis is free of rigid motion: `pilot` is held and is the modal node, coordinates count from
    its point, axes are the body frame's. Nodes are the pilots, numbered from 1; modes are the other
    pilots' unit motions, then the fixed-interface modes, with full mass, stiffness and damping
    matrices. Instead of nodal masses (group 11) the file holds the invariants 3, 4, 8, 5 and 9
    (groups 14 to 18) of the consistent mass.

    Parameters
    ----------
    model : ReducedModel
        A single body with inertia invariants.
    path : Path
        File to write.
    pilot : str, optional
        The held pilot; the first by default.

    Raises
    ------
    ValueError
        Where the body is an assembly or has no inertia invariants.
    KeyError
        Where the body has no such pilot.
    """
    body = held_body(model, pilot)
    lines = [
        *comments("**", header(model)),
        *comments(
            "**",
            [
                f"Modal node: pilot {body.pilot}, held; coordinates from its point, axes of the body frame"
            ],
        ),
        *(f"** Node {number}: pilot {name}" for number, name in enumerate(model.pilots, start=1)),
        *_groups(model, body),
        "** END OF FILE",
    ]
    with whole_file(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _groups(model: ReducedModel, body: HeldBody) -> Iterator[str]:
    n_nodes, n_modes = len(model.pilots), len(body.K)
    origin = model.pilots[body.pilot]
    points = np.array(list(model.pilots.values())) - origin
    yield from _group(1, "HEADER")
    yield "**   REVISION, NODE, NORMAL, ATTACHMENT, CONSTRAINT, REJECTED MODES"
    yield f"REV0 {n_nodes} {n_modes} 0 0 0"
    yield from _group(2, "FINITE ELEMENT NODE LIST")
    yield " ".join(str(number) for number in range(1, n_nodes + 1))
    for axis, name in enumerate("XYZ"):
        yield from _group(5 + axis, f"NODAL {name} COORDINATES [m]")
        yield from _rows(points[:, axis : axis + 1])
    yield from _group(8, "MODE SHAPES")
    for mode in range(n_modes):
        yield f"**    NORMAL MODE SHAPE # {mode + 1}"
        yield from _rows(body.motion[:, :, mode])
    yield from _group(9, "MODAL MASS MATRIX")
    yield from _rows(body.M)
    yield from _group(10, "MODAL STIFFNESS MATRIX")
    yield from _rows(body.K)
    mass = model.mass_properties
    yield from _group(12, "RIGID BODY INERTIA: MASS, CENTRE, INERTIA ABOUT THE CENTRE")
    yield from _rows(np.array([[mass.mass]]))
    yield from _rows((mass.centre - origin)[None])
    yield from _rows(mass.inertia)
    yield from _group(13, "MODAL DAMPING MATRIX")
    yield from _rows(body.D)
    for number, (name, rows) in enumerate(invariant_rows(body, origin).items(), start=14):
        yield from _group(number, name)
        yield from _rows(rows)


def invariant_rows(body: HeldBody, origin: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    """Groups 14 to 18, three rows each, about `origin` [m]; columns run mode by mode.

    ``Inv3 = ∫ ρ φ_j``, ``Inv4 = ∫ ρ x × φ_j``, ``Inv8_j = -∫ ρ x~ φ_j~``, ``Inv5_jk = ∫ ρ φ_j ×
    φ_k``, ``Inv9_jk = ∫ ρ φ_j~ φ_k~``; of two mode numbers the second runs faster.

    References
    ----------
    MBDyn Theory and Developer's Manual 1.7, modal element.
    """
    data = body.ffrf.about(origin)
    n = data.n_coordinates
    blocks = data.blocks
    trace = np.eye(3)[:, :, None, None] * np.trace(blocks)
    # φ_j~ φ_k~ = φ_k φ_jᵀ - (φ_j·φ_k) I
    inv9 = blocks.transpose(1, 0, 2, 3) - trace
    return {
        "INVARIANT 3": data.N,
        "INVARIANT 4": data.Cr.T,
        "INVARIANT 8": data.Gr.transpose(0, 2, 1).reshape(3, 3 * n) / 2.0,
        "INVARIANT 5": data.Cr1.transpose(2, 1, 0).reshape(3, n * n),
        "INVARIANT 9": inv9.transpose(0, 2, 3, 1).reshape(3, 3 * n * n),
    }


def _group(number: int, name: str) -> Iterable[str]:
    return ("**", f"** RECORD GROUP {number}, {name}")


def _rows(values: NDArray[np.float64]) -> Iterator[str]:
    return (" ".join(f"{value:.16e}" for value in row) for row in values)
