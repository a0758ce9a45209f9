"""Standard input data of a flexible body (SID_FEM, Wallrapp) for Simpack, Modelica and their like.

Conventions of the file, easily mistaken: the first order ``m1(i, j, k)`` counts row, mode, column;
the inertia J is a column of six, xx yy zz xy xz yz, with the tensor's signs (xy is ``-∫ ρ x y``);
the columns of Oe are xx yy zz xy yz xz.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from carrierflex.files.whole_files import whole_file
from carrierflex.reduction.exports.ordered_body import FRAME, UNITS, HeldBody, held_body
from carrierflex.reduction.ffrf_data import FfrfData
from carrierflex.reduction.reduced_model import ReducedModel

#: Numbers of the structure entry.
_ZERO, _DIAGONAL, _FULL, _IDENTITY = 0, 1, 3, 4
#: Rows of J.
_J_ROWS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def write_sid(model: ReducedModel, path: Path, *, pilot: str | None = None) -> NDArray[np.float64]:
    """Write a body's standard input data.

    One pilot is held and the floating frame moves with it (tangent frame), its origin where the
    body frame's is. The modes are the eigenvectors of the body held so, mass-normalised: as many as
    coordinates are left, so that the file spans the same motion as the body. Nodes are the pilots,
    numbered from 1, the held one among them. Geometric stiffening is not included.

    Parameters
    ----------
    model : ReducedModel
        A single body with inertia invariants.
    path : Path
        File to write.
    pilot : str, optional
        The held pilot; the first by default.

    Returns
    -------
    ndarray, shape (n_modes,)
        Frequencies of the modes [Hz], ascending.

    Raises
    ------
    ValueError
        Where the body is an assembly or has no inertia invariants.
    KeyError
        Where the body has no such pilot.

    References
    ----------
    Wallrapp (1994), Mechanics of Structures and Machines 22(3), 315-337.
    """
    body = held_body(model, pilot)
    squares, V = held_modes(body)
    frequencies_hz = np.sqrt(squares) / (2.0 * np.pi)
    with whole_file(path) as temporary:
        temporary.write_text("\n".join(_lines(model, body, squares, V)) + "\n", encoding="utf-8")
    return frequencies_hz


def held_modes(body: HeldBody) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Squared angular frequencies [1/s^2] and modes ``Vᵀ M V = I`` of the held body, ascending."""
    # Translations, rotations and modal amplitudes: scaled to unit mass before the eigenvalue
    # problem.
    scale = 1.0 / np.sqrt(body.M.diagonal())
    squares, V = scipy.linalg.eigh(body.K * np.outer(scale, scale), body.M * np.outer(scale, scale))
    return squares, scale[:, None] * V


def _lines(
    model: ReducedModel, body: HeldBody, squares: NDArray[np.float64], V: NDArray[np.float64]
) -> Iterator[str]:
    n = len(squares)
    pilots = ", ".join(f"{i} {name}" for i, name in enumerate(model.pilots, start=1))
    comment = f"{model.name}, written by carrierflex; {UNITS}; {FRAME}; floating frame moves with held pilot {body.pilot}"
    yield f"{len(model.pilots):5d}{n:5d}    :{comment}; nodes {pilots}; no geometric stiffening"
    yield from ("part", " new modal")
    yield "  refmod"
    yield _entry("mass", _number(model.mass_properties.mass))
    yield _entry("nelastq", str(n))
    for i, square in enumerate(squares, start=1):
        yield _entry(
            f"ielastq ({i:4d})", f"Eigen Mode {i:4d} : {np.sqrt(square) / (2.0 * np.pi):14.6f} Hz"
        )
    yield from ("  end refmod", "  frame")
    for i, (name, point) in enumerate(model.pilots.items(), start=1):
        motion = body.motion[list(model.pilots).index(name)] @ V
        yield from (_entry("new node", str(i)), _entry("rframe", "body ref"))
        yield from _node(point, motion)
        yield "   end node"
    yield "  end frame"
    yield from _integrals(body.ffrf.transformed(V), squares, V.T @ body.D @ V)
    yield from (" end modal", "end part")


def _node(point: NDArray[np.float64], motion: NDArray[np.float64]) -> Iterator[str]:
    """A node's place, translation phi, rotation psi and orientation AP, per mode."""
    phi, psi = motion[:3], motion[3:]
    # AP = I + psi~, its columns the node's axes.
    turned = np.cross(psi.T[:, None, :], np.eye(3)).transpose(2, 0, 1)
    n = phi.shape[1]
    yield from _block("origin", point[:, None], phi[:, :, None], n)
    yield from _block("phi", phi, None, n)
    yield from _block("psi", psi, None, n)
    yield from _block("AP", np.eye(3), turned, n)


def _integrals(
    data: FfrfData, squares: NDArray[np.float64], damping: NDArray[np.float64]
) -> Iterator[str]:
    n = data.n_coordinates
    J0 = np.array([[data.J[a, b]] for a, b in _J_ROWS])
    J1 = np.array([data.J1[a, b] for a, b in _J_ROWS])[:, :, None]
    yield from _block("mdCM", data.first_moment[:, None], data.Ct.T[:, :, None], n)
    yield from _block("J", J0, J1, n)
    yield from _block("Ct", data.Ct, None, n)
    yield from _block("Cr", data.Cr, data.Cr1, n)
    yield from _block("Me", np.eye(n), None, n, _IDENTITY)
    yield from _block("Gr", data.Gr.transpose(0, 2, 1).reshape(3, 3 * n), None, n)
    yield from _block("Ge", data.Ge.transpose(0, 2, 1).reshape(n, 3 * n), None, n)
    yield from _block("Oe", data.Oe, data.Oe1, n)
    yield from _block("ksigma", np.zeros((n, 1)), None, n)
    yield from _block("Ke", np.diag(squares), None, n, _DIAGONAL)
    yield from _block("De", damping, None, n)


def _block(
    name: str,
    m0: NDArray[np.float64],
    m1: NDArray[np.float64] | None,
    n: int,
    structure: int = _FULL,
) -> Iterator[str]:
    """One matrix expanded in the modes.

    M0 (rows, columns) and m1 (rows, n, columns), entries that are not zero.
    """
    if not m0.any() and (m1 is None or not m1.any()):
        structure = _ZERO
    yield f"  {name}"
    counts = {
        "order": 0 if m1 is None else 1,
        "nrow": m0.shape[0],
        "ncol": m0.shape[1],
        "nq": n,
        "nqn": 0,
    }
    yield from (
        _entry(key, str(count)) for key, count in (counts | {"structure": structure}).items()
    )
    if structure != _IDENTITY:
        for row, column in np.argwhere(m0):
            yield _entry(f"m0({row + 1:3d},{column + 1:3d})", _number(m0[row, column]))
        for row, mode, column in np.argwhere(m1) if m1 is not None else ():
            assert m1 is not None
            yield _entry(
                f"m1({row + 1:3d},{mode + 1:3d},{column + 1:3d})", _number(m1[row, mode, column])
            )
    yield f"  end {name}"


def _entry(key: str, value: str) -> str:
    return f"    {key:<28s}= {value}"


def _number(value: float) -> str:
    return f"{value:23.15E}".replace("E", "D")
