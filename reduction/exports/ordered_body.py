"""A reduced body in the order that every export writes.

For codes with a floating frame, one pilot is held.
"""

import textwrap
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.reduction.ffrf_data import FfrfData
from carrierflex.reduction.reduced_model import PILOT_COORDINATES, ReducedModel

#: Statement of units and frame in every header.
UNITS = "SI units: m, kg, s, N, rad"
FRAME = (
    "body frame: x downwind along the rotation axis, z up, right-handed, origin on the upwind "
    "plate's upwind face"
)
#: Columns of a comment: Nastran reads 80, MBDyn stops at a line above 255.
_COMMENT_WIDTH = 76


@dataclass(frozen=True, eq=False)
class OrderedBody:
    """Matrices of a reduced body, pilots first.

    Parameters
    ----------
    K, M, D : ndarray, shape (n, n)
        Stiffness, mass and damping, symmetric, SI.
    labels : tuple of str
        Coordinates in words.
    pilots : tuple of str
        Names of the pilots.
    components : tuple of tuple of int
        Components of each pilot, 0 to 5, whose coordinates are the first ones.
    points : ndarray, shape (n_pilots, 3)
        Their positions [m].
    rows : ndarray of int, shape (n,)
        Coordinates of the model in this order.
    """

    K: NDArray[np.float64]
    M: NDArray[np.float64]
    D: NDArray[np.float64]
    labels: tuple[str, ...]
    pilots: tuple[str, ...]
    components: tuple[tuple[int, ...], ...]
    points: NDArray[np.float64]
    rows: NDArray[np.int64]

    @property
    def n_modal(self) -> int:
        """Number of modal coordinates."""
        return len(self.labels) - self.n_pilot_coordinates

    @property
    def n_pilot_coordinates(self) -> int:
        """Number of the pilots' coordinates, which come first."""
        return sum(len(components) for components in self.components)


@dataclass(frozen=True, eq=False)
class HeldBody:
    """A reduced body in the frame of one pilot that is held.

    Parameters
    ----------
    pilot : str
        The held pilot; the floating frame moves with it and keeps the body frame's axes.
    K, M, D : ndarray, shape (n, n)
        Matrices of the coordinates that are left: the other pilots', then the modal ones.
    motion : ndarray, shape (n_pilots, 6, n)
        Motion of every pilot, the held one among them, per unit coordinate; zero along components
        that a pilot does not have.
    ffrf : FfrfData
        Inertia invariants of these coordinates about the body frame's origin.
    """

    pilot: str
    K: NDArray[np.float64]
    M: NDArray[np.float64]
    D: NDArray[np.float64]
    motion: NDArray[np.float64]
    ffrf: FfrfData


def ordered_body(model: ReducedModel) -> OrderedBody:
    """Bring a body into the order of the exports.

    Raises
    ------
    ValueError
        Where pilots share coordinates, as tied ones in an assembly do: other codes tie nodes
        themselves.
    """
    pilot_rows = model.pilot_rows
    if len(np.unique(pilot_rows)) != len(pilot_rows):
        raise ValueError(
            f"{model.name}: pilots share coordinates; expected a single body, to be joined in the "
            "other code"
        )
    rows = np.concatenate([pilot_rows, np.setdiff1d(np.arange(model.n_coordinates), pilot_rows)])
    K, M, D = ((A + A.T)[np.ix_(rows, rows)] / 2.0 for A in (model.K, model.M, model.D))
    labels = tuple(model.labels[row] for row in rows)
    return OrderedBody(
        K,
        M,
        D,
        labels,
        tuple(model.pilots),
        tuple(model.components_of(name) for name in model.pilots),
        np.array(list(model.pilots.values())),
        rows,
    )


def held_body(model: ReducedModel, pilot: str | None = None) -> HeldBody:
    """Hold one pilot, by default the first: a basis without rigid motion.

    Raises
    ------
    ValueError
        Where the body has no inertia invariants or those of other coordinates.
    KeyError
        Where the body has no such pilot.
    """
    body = ordered_body(model)
    if model.ffrf is None:
        raise ValueError(
            f"{model.name} has no inertia invariants, which floating-frame codes need; expected a "
            "free body of solid elements, written by this version of carrierflex reduce, or one "
            "converted from a file that holds them (SID, Exudyn)"
        )
    if model.ffrf.n_coordinates != model.n_coordinates:
        raise ValueError(
            f"{model.name}: inertia invariants of {model.ffrf.n_coordinates} coordinates; expected "
            f"{model.n_coordinates}, one a label"
        )
    fixed_pilot = body.pilots[0] if pilot is None else pilot
    fixed_coordinates = model.coordinates_of(fixed_pilot)
    free = np.flatnonzero(~np.isin(body.rows, fixed_coordinates))
    n = len(body.labels)
    K, M, D = (A[np.ix_(free, free)] for A in (body.K, body.M, body.D))
    motion = np.zeros((len(body.pilots), 6, len(free)))
    selection = np.eye(n)[: body.n_pilot_coordinates, free]
    numbers = [(pilot, i) for pilot, each in enumerate(body.components) for i in each]
    for row, (pilot_number, component) in zip(selection, numbers, strict=True):
        motion[pilot_number, component] = row
    basis = np.eye(n)[:, body.rows[free]]
    return HeldBody(fixed_pilot, K, M, D, motion, model.ffrf.transformed(basis))


def header(model: ReducedModel) -> tuple[str, ...]:
    """Lines that every header starts with: the body, units, frame and order."""
    names = ", ".join(model.pilots)
    return (
        f"Reduced body {model.name}, Craig-Bampton, written by carrierflex",
        UNITS,
        FRAME,
        f"Order: pilots {names}, six rows each (Tx Ty Tz Rx Ry Rz); then modal coordinates",
        *(
            f"Pilot {name} has {_listed(components)} only"
            for name, components in model.pilot_components.items()
        ),
    )


def _listed(components: tuple[int, ...]) -> str:
    """Components in words without units."""
    return " ".join(PILOT_COORDINATES[i].split(" ")[0] for i in components)


def comments(mark: str, lines: Iterable[str]) -> tuple[str, ...]:
    """Comment lines that begin with `mark`, long ones broken."""
    return tuple(
        f"{mark} {wrapped}"
        for line in lines
        for wrapped in textwrap.wrap(line, _COMMENT_WIDTH, subsequent_indent="    ")
    )
