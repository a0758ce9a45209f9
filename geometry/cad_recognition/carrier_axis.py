"""Where a planet carrier's axis lies in its CAD model, which way is downwind, where pin 1 is."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.cad_recognition.merged_surfaces import (
    PARALLEL,
    SAME_LENGTH,
    CadSurface,
)
from carrierflex.geometry.cad_surface_files import CadFrame
from carrierflex.geometry.parameters import FEWEST_PLANETS, MOST_PLANETS

Vector = NDArray[np.float64]
#: Deviation of a pin from its place at equal angles [rad], as far as the carrier is computed with.
_PIN_ANGLE = 1e-3
#: A second candidate that has more than this share of the first one's measure is as good.
AS_GOOD = 0.8
#: A plane that reaches this share of the greatest radius is one of the rim.
NEAR_THE_RIM = 0.9
#: Differences below this share say nothing of which end is the shaft's.
_ALIKE = 0.02
_SHOWN = 4


@dataclass(frozen=True, eq=False)
class PinPattern:
    """Equal bores on a pitch circle, each in two plates.

    Parameters
    ----------
    lines : tuple of tuple of CadSurface
        Bores of each pin along the axis, the lowest station first.
    radius, pitch_radius : float
        Radius of the bores and of the circle their axes lie on [m].
    """

    lines: tuple[tuple[CadSurface, ...], ...]
    radius: float
    pitch_radius: float

    @property
    def area(self) -> float:
        """Area of all bores [m^2]."""
        return sum(bore.area for line in self.lines for bore in line)

    def __str__(self) -> str:
        return (
            f"{len(self.lines)} equal pairs of bores of radius {self.radius:.5g} m on a pitch "
            f"circle of radius {self.pitch_radius:.5g} m"
        )


@dataclass(frozen=True, eq=False)
class AxisCandidate:
    """A line that cylinders of the solid turn about.

    Parameters
    ----------
    direction, point : ndarray, shape (3,)
        The line in the file's frame; the direction's sign is open [m].
    turned : float
        Area of the cylinders about it [m^2].
    patterns : tuple of PinPattern
        Patterns of bores about it, the largest first.
    """

    direction: Vector
    point: Vector
    turned: float
    patterns: tuple[PinPattern, ...]

    @property
    def rank(self) -> tuple[bool, float]:
        """What candidates are ordered by: pins about it, then turned area."""
        return bool(self.patterns), self.turned

    def __str__(self) -> str:
        pins = str(self.patterns[0]) if self.patterns else "no pins about it"
        through = self.point - (self.point @ self.direction) * self.direction
        return (
            f"axis {shown(self.direction)} through {shown(through)} m: {pins}, area of surfaces "
            f"of revolution {self.turned:.4g} m^2"
        )


def shown(vector: Vector) -> str:
    """Components with five digits, without -0."""
    return "(" + ", ".join(f"{x:.5g}" for x in np.round(vector, 7) + 0.0) + ")"


def axis_candidates(
    surfaces: Sequence[CadSurface], axis: Vector | None = None
) -> tuple[AxisCandidate, ...]:
    """Lines that the solid's cylinders turn about, the best first.

    Parameters
    ----------
    surfaces : sequence of CadSurface
        Of the solid.
    axis : ndarray, shape (3,), optional
        Direction that the carrier's axis is known to have.
    """
    cylinders = [surface for surface in surfaces if surface.kind == "cylinder"]
    lines: list[list[CadSurface]] = []
    for cylinder in cylinders:
        if axis is not None and np.linalg.norm(np.cross(axis, cylinder.direction)) > PARALLEL:
            continue
        for line in lines:
            if _coaxial(line[0], cylinder):
                line.append(cylinder)
                break
        else:
            lines.append([cylinder])
    candidates = []
    for line in lines:
        direction, point = line[0].direction, line[0].point
        others = [other for other in lines if other is not line]
        patterns = _patterns(direction, point, others)
        turned = sum(surface.area for surface in line)
        candidates.append(AxisCandidate(direction, point, turned, patterns))
    return tuple(sorted(candidates, key=lambda candidate: candidate.rank, reverse=True))


def _coaxial(first: CadSurface, second: CadSurface) -> bool:
    if float(np.linalg.norm(np.cross(first.direction, second.direction))) > PARALLEL:
        return False
    offset = np.cross(second.point - first.point, first.direction)
    return float(np.linalg.norm(offset)) < SAME_LENGTH


def _patterns(
    direction: Vector, point: Vector, lines: Sequence[Sequence[CadSurface]]
) -> tuple[PinPattern, ...]:
    """Patterns of 3 to 8 equal pairs of bores at equal angles about a line."""
    kinds: list[tuple[Vector, list[tuple[float, tuple[CadSurface, ...]]]]] = []
    first = np.cross(direction, np.eye(3)[np.abs(direction).argmin()])
    first /= np.linalg.norm(first)
    second = np.cross(direction, first)
    for line in lines:
        if np.linalg.norm(np.cross(line[0].direction, direction)) > PARALLEL:
            continue
        across = line[0].point - point
        at = np.array([across @ first, across @ second])
        for bores in _in_two_plates(line, direction):
            lengths = np.array([bores[0].radius, np.hypot(*at), bores[0].extent(direction)[0]])
            member = (float(np.arctan2(at[1], at[0])), bores)
            for first_lengths, alike in kinds:
                if np.abs(lengths - first_lengths).max() < 10.0 * SAME_LENGTH:
                    alike.append(member)
                    break
            else:
                kinds.append((lengths, [member]))
    patterns = []
    for _, members in kinds:
        members.sort(key=lambda member: member[0])
        angles = np.array([angle for angle, _ in members])
        if not FEWEST_PLANETS <= len(angles) <= MOST_PLANETS:
            continue
        steps = np.diff(np.append(angles, angles[0] + 2.0 * np.pi))
        if np.abs(steps - 2.0 * np.pi / len(angles)).max() < _PIN_ANGLE:
            bore = members[0][1][0]
            pitch = float(np.linalg.norm(np.cross(bore.point - point, direction)))
            patterns.append(PinPattern(tuple(bores for _, bores in members), bore.radius, pitch))
    return tuple(sorted(patterns, key=lambda pattern: -pattern.area))


def _in_two_plates(line: Sequence[CadSurface], direction: Vector) -> list[tuple[CadSurface, ...]]:
    """Round bores of one radius along a line, where there are two or more of them."""
    bores = [surface for surface in line if surface.hollow and surface.goes_round]
    by_radius: list[list[CadSurface]] = []
    for bore in sorted(bores, key=lambda bore: bore.extent(direction)[0]):
        for alike in by_radius:
            if abs(alike[0].radius - bore.radius) < SAME_LENGTH:
                alike.append(bore)
                break
        else:
            by_radius.append([bore])
    return [tuple(alike) for alike in by_radius if len(alike) > 1]


def chosen_axis(candidates: Sequence[AxisCandidate], path: str) -> AxisCandidate:
    """The best candidate.

    Raises
    ------
    ValueError
        Where none has pins about it, or a second is as good; the message lists the candidates.
    """
    listed = "; ".join(f"[{n}] {each}" for n, each in enumerate(candidates[:_SHOWN], start=1))
    with_pins = [candidate for candidate in candidates if candidate.patterns]
    if not with_pins:
        raise ValueError(
            f"{path}: no axis with {FEWEST_PLANETS} to {MOST_PLANETS} equal pairs of bores at "
            "equal angles about it; expected a carrier with empty pin bores in two plates; "
            f"candidates: {listed or 'no cylinder at all'}"
        )
    if len(with_pins) > 1 and with_pins[1].turned > AS_GOOD * with_pins[0].turned:
        raise ValueError(
            f"{path}: two axes fit equally well; expected one: choose it with --axis or --origin; "
            f"candidates: {listed}"
        )
    return with_pins[0]


@dataclass(frozen=True, eq=False)
class RecognisedFrame:
    """The carrier's frame in the CAD model, and why.

    Parameters
    ----------
    frame : CadFrame
        Origin on the rim face, axis downwind, direction of pin 1.
    reasons : tuple of str
        Why this axis, this direction, this origin and this pin.
    """

    frame: CadFrame
    reasons: tuple[str, ...]


def recognised_frame(
    surfaces: Sequence[CadSurface],
    candidate: AxisCandidate,
    path: str,
    *,
    axis: Vector | None = None,
    origin: Vector | None = None,
    length_unit: str | None = None,
) -> RecognisedFrame:
    """Frame of the carrier about the chosen axis.

    Parameters
    ----------
    surfaces : sequence of CadSurface
        Of the solid, in the file's frame.
    candidate : AxisCandidate
        The axis, with its pins.
    path : str
        The file, for messages.
    axis, origin : ndarray, shape (3,), optional
        Downwind direction and origin, where the user gives them.
    length_unit : str, optional
        Unit that the user gives.

    Raises
    ------
    ValueError
        Where it cannot be told which end is the shaft's.
    """
    reasons = [str(candidate)]
    if axis is None:
        downwind, why = _downwind(surfaces, candidate, path)
    else:
        downwind, why = axis / np.linalg.norm(axis), "downwind as given by --axis"
    reasons.append(why)
    if origin is None:
        station = _rim_station(surfaces, candidate, downwind)
        origin = candidate.point + (station - candidate.point @ downwind) * downwind
        reasons.append(f"origin {shown(origin)} m: the axis in the upwind face of the rim")
    else:
        reasons.append("origin as given by --origin")
    pin_1, why = _towards_pin_1(candidate, downwind)
    reasons.append(why)
    # Rounding of the CAD model's numbers is no direction.
    frame = CadFrame(_clean(origin, 9), _clean(downwind, 12), _clean(pin_1, 12), length_unit)
    return RecognisedFrame(frame, tuple(reasons))


def _clean(vector: Vector, digits: int) -> Vector:
    return np.asarray(np.round(vector, digits) + 0.0)


def _rim_station(
    surfaces: Sequence[CadSurface], candidate: AxisCandidate, downwind: Vector
) -> float:
    """Station of the most upwind face that faces upwind and reaches the rim [m].

    The upwind end of the pins' bores where no face does.
    """
    largest = max(surface.radii(candidate.point, downwind)[1] for surface in surfaces)
    stations = [
        surface.extent(downwind)[0]
        for surface in surfaces
        if surface.kind == "plane"
        and surface.outward @ downwind < -1.0 + PARALLEL
        and surface.radii(candidate.point, downwind)[1] > NEAR_THE_RIM * largest
    ]
    bores = [bore.round_extent(downwind)[0] for bore in candidate.patterns[0].lines[0]]
    return min(stations or bores)


def _downwind(
    surfaces: Sequence[CadSurface], candidate: AxisCandidate, path: str
) -> tuple[Vector, str]:
    """Direction away from the shaft, by what tells the shaft's end, and the reasons."""
    d, pins = candidate.direction, candidate.patterns[0]
    bores = pins.lines[0]
    plates = (bores[0].round_extent(d), bores[-1].round_extent(d))
    middle = (plates[0][0] + plates[1][1]) / 2.0
    hub = [
        _hub(surfaces, candidate, sign, middle, abs(end - middle))
        for sign, end in ((-1.0, plates[0][0]), (1.0, plates[1][1]))
    ]
    measures = (
        ("the wider hub", hub[0][0], hub[1][0]),
        ("the longer hub", hub[0][1], hub[1][1]),
        ("the thicker plate", plates[0][1] - plates[0][0], plates[1][1] - plates[1][0]),
    )
    votes = []
    for name, low, high in measures:
        if abs(low - high) > _ALIKE * max(low, high):
            votes.append((name, 1 if low > high else -1, low, high))
    total = sum(vote for _, vote, _, _ in votes)
    described = "; ".join(
        f"{name} at the {'lower' if vote > 0 else 'upper'} end ({low:.4g} and {high:.4g} m)"
        for name, vote, low, high in votes
    )
    if total == 0:
        raise ValueError(
            f"{path}: which end of the axis {shown(d)} is the shaft's cannot be determined "
            f"({described or 'both ends are equal'}); expected --axis with the direction from the "
            "shaft's end to the other"
        )
    downwind = d if total > 0 else -d
    return downwind, f"downwind is {shown(downwind)}, away from the shaft's end: {described}"


def _hub(
    surfaces: Sequence[CadSurface],
    candidate: AxisCandidate,
    sign: float,
    middle: float,
    plate: float,
) -> tuple[float, float]:
    """Greatest radius of an outer cylinder beyond the plate on one side, and its reach [m].

    `plate` is the plate's distance from the middle between the plates.
    """
    d = candidate.direction
    largest = max(surface.radii(candidate.point, d)[1] for surface in surfaces)
    widest, reach = 0.0, 0.0
    for surface in about_axis(surfaces, candidate.point, d):
        low, high = surface.extent(d)
        beyond = (middle - low if sign < 0.0 else high - middle) - plate
        if not surface.hollow and surface.radius < NEAR_THE_RIM * largest and beyond > SAME_LENGTH:
            widest, reach = max(widest, surface.radius), max(reach, beyond)
    return widest, reach


def about_axis(
    surfaces: Sequence[CadSurface], point: Vector, direction: Vector
) -> list[CadSurface]:
    """Cylinders about the axis through `point`."""
    return [
        surface
        for surface in surfaces
        if surface.kind == "cylinder"
        and np.linalg.norm(np.cross(surface.direction, direction)) < PARALLEL
        and np.linalg.norm(np.cross(surface.point - point, direction)) < SAME_LENGTH
    ]


def _towards_pin_1(candidate: AxisCandidate, downwind: Vector) -> tuple[Vector, str]:
    """Direction of the pin nearest to the file's z axis, or to its x axis where that is the axis's.

    Unit vector, perpendicular to the axis to rounding.
    """
    wanted = np.array([0.0, 0.0, 1.0])
    name = "z"
    if abs(downwind @ wanted) > np.sqrt(0.5):
        wanted, name = np.array([1.0, 0.0, 0.0]), "x"
    directions = []
    for line in candidate.patterns[0].lines:
        across = line[0].point - candidate.point
        across = across - (across @ downwind) * downwind
        directions.append(across / np.linalg.norm(across))
    # Of two pins that are as near, the first in the file's order about the axis.
    nearest = max(range(len(directions)), key=lambda n: round(float(directions[n] @ wanted), 6))
    text = f"pin 1 is the one nearest to the file's {name} axis, others follow about the axis"
    return directions[nearest], text
