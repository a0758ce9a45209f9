"""Candidates for each of the carrier's named surfaces, ranked with reasons, in its own frame."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from carrierflex.geometry.cad_recognition.carrier_axis import (
    AS_GOOD,
    NEAR_THE_RIM,
    PinPattern,
    about_axis,
    axis_candidates,
)
from carrierflex.geometry.cad_recognition.merged_surfaces import (
    PARALLEL,
    SAME_LENGTH,
    CadSurface,
    SurfaceGroup,
)
from carrierflex.geometry.cad_surfaces import SurfaceStatement

_X, _ORIGIN = np.array([1.0, 0.0, 0.0]), np.zeros(3)
#: Candidates for a seat or the shaft's face whose area is a larger share of the best are as good.
_AS_LARGE = 0.5
#: Planes within this share of the hub's length of its end are at the end.
_AT_THE_END = 0.1
#: Digits of a length in metres that are written: a hundredth of a micrometre.
_DIGITS = 8


@dataclass(frozen=True, eq=False)
class Candidate:
    """A surface that may carry a name.

    Parameters
    ----------
    numbers : tuple of int
        Numbers of its groups in the picture.
    surfaces : tuple of CadSurface
        Its faces.
    statement : SurfaceStatement
        What finds it.
    reason : str
        Why it ranks where it does.
    """

    numbers: tuple[int, ...]
    surfaces: tuple[CadSurface, ...]
    statement: SurfaceStatement
    reason: str


@dataclass(frozen=True, eq=False)
class ProposedSurface:
    """A name and what may carry it, the best first.

    Parameters
    ----------
    name : str
        Name of the surface.
    candidates : tuple of Candidate
        The best first; none where the solid has nothing of the kind.
    equals : int
        Number of candidates that are as good as the best; the name is proposed where it is 1.
    """

    name: str
    candidates: tuple[Candidate, ...]
    equals: int

    @property
    def chosen(self) -> Candidate | None:
        """The one candidate, where there is no second as good."""
        return self.candidates[0] if self.equals == 1 else None


class NamedSurfaces:
    """Candidates for each name, in the carrier's frame."""

    def __init__(self, surfaces: Sequence[CadSurface], groups: Sequence[SurfaceGroup]) -> None:
        self._surfaces = surfaces
        self._number = {id(surface): group.number for group in groups for surface in group.surfaces}
        about_x = axis_candidates(surfaces, _X)
        centred = [each for each in about_x if np.hypot(*each.point[1:]) < SAME_LENGTH]
        self._patterns = centred[0].patterns
        self._rim_radius = max(surface.radii(_ORIGIN, _X)[1] for surface in surfaces)
        upwind, downwind = _plates(self._patterns[0].lines[0])
        self._upwind_end = upwind[0].round_extent(_X)[0]
        self._downwind_end = downwind[-1].round_extent(_X)[1]
        #: Distance between the bores of the two plates [m].
        self.gap = downwind[0].round_extent(_X)[0] - upwind[-1].round_extent(_X)[1]

    def _candidate(
        self, name: str, surface: CadSurface, statement: SurfaceStatement, reason: str
    ) -> Candidate:
        return Candidate((self._number[id(surface)],), (surface,), statement, reason)

    def _planes(self, side: float) -> list[CadSurface]:
        """Planes normal to the axis that face downwind (1) or upwind (-1)."""
        return [
            surface
            for surface in self._surfaces
            if surface.kind == "plane" and side * float(surface.outward @ _X) > 1.0 - PARALLEL
        ]

    def shaft_face(self) -> ProposedSurface:
        """Planes that face upwind, upwind of the pins' bores; the end of the hub first."""
        beyond = self._upwind_end - 10.0 * SAME_LENGTH
        planes = [
            plane
            for plane in self._planes(-1.0)
            if plane.extent(_X)[0] < beyond and plane.surrounds(_ORIGIN, _X)
        ]
        if not planes:
            return ProposedSurface("shaft_face", (), 0)
        end = min(plane.extent(_X)[0] for plane in planes)
        reach = end + _AT_THE_END * (self._upwind_end - end)

        def rank(plane: CadSurface) -> tuple[bool, float]:
            return plane.extent(_X)[0] <= reach, plane.area

        planes.sort(key=rank, reverse=True)
        candidates = []
        for plane in planes:
            at_end = rank(plane)[0]
            where = "at the hub's upwind end" if at_end else "inside of the hub's upwind end"
            reason = f"faces upwind, {where}, area {plane.area:.4g} m^2"
            statement = self._plane("shaft_face", plane)
            candidates.append(self._candidate("shaft_face", plane, statement, reason))
        as_good = [
            plane
            for plane in planes
            if rank(plane)[0] == rank(planes[0])[0] and plane.area > _AS_LARGE * planes[0].area
        ]
        return ProposedSurface("shaft_face", tuple(candidates), len(as_good))

    def rim_face(self, sensor_radius: float | None, path: str) -> ProposedSurface:
        """Planes that face upwind and reach the rim; the most upwind first."""
        planes = [
            plane
            for plane in self._planes(-1.0)
            if plane.radii(_ORIGIN, _X)[1] > NEAR_THE_RIM * self._rim_radius
        ]
        planes.sort(key=lambda plane: plane.extent(_X)[0])
        bores = self._patterns[0]
        candidates = []
        for plane in planes:
            inner, outer = plane.radii(_ORIGIN, _X)
            least = max(inner, bores.pitch_radius + bores.radius)
            radius = (least + outer) / 2.0 if sensor_radius is None else sensor_radius
            if plane is planes[0] and not least < radius < outer:
                raise ValueError(
                    f"{path}: --sensor-radius is {radius} m; expected between the bores and the "
                    f"edge of the rim face, {least:.5g} to {outer:.5g} m"
                )
            if not radius < outer:
                continue
            window = (round(radius, 4) if sensor_radius is None else radius, outer)
            first = plane is planes[0]
            reason = f"faces upwind at the rim (radius {outer:.4g} m)" + (
                ", the most upwind of those" if first else ", between the plates or behind"
            )
            statement = self._plane("rim_face", plane, window)
            candidates.append(self._candidate("rim_face", plane, statement, reason))
        return ProposedSurface("rim_face", tuple(candidates), min(len(candidates), 1))

    def seat(self, name: str) -> ProposedSurface:
        """Cylinders about the axis beyond the plate; outer ones first, then the larger."""
        downwind = name == "downwind_seat"
        beyond = []
        for surface in about_axis(self._surfaces, _ORIGIN, _X):
            low, high = surface.extent(_X)
            # At least half of it lies beyond the plate's face.
            middle = (low + high) / 2.0
            outside = middle > self._downwind_end if downwind else middle < self._upwind_end
            if outside and surface.goes_round:
                beyond.append(surface)
        beyond.sort(key=lambda surface: (not surface.hollow, surface.area), reverse=True)
        side = "downwind" if downwind else "upwind"
        candidates = []
        for surface in beyond:
            kind = "bore, after outer cylinders" if surface.hollow else "outer cylinder"
            reason = f"{kind}: about the axis, {side} of the plates, area {surface.area:.4g} m^2"
            window = surface.extent(_X)
            statement = _cylinder(name, surface, window)
            candidates.append(self._candidate(name, surface, statement, reason))
        as_good = [
            surface
            for surface in beyond
            if surface.hollow == beyond[0].hollow and surface.area > _AS_LARGE * beyond[0].area
        ]
        return ProposedSurface(name, tuple(candidates), len(as_good))

    def pins(self) -> Iterator[ProposedSurface]:
        """Bores of every pin in both plates, from pin 1 about the axis; the largest first."""
        patterns = self._patterns
        equals = sum(pattern.area > AS_GOOD * patterns[0].area for pattern in patterns)
        n_planets = len(patterns[0].lines)
        ordered = [_from_z(pattern) for pattern in patterns if len(pattern.lines) == n_planets]
        for number in range(1, n_planets + 1):
            for plate, side in enumerate(("upwind", "downwind")):
                name = f"pin_{number}_{side}"
                candidates = []
                for pattern, lines in zip(patterns, ordered, strict=False):
                    bores = _plates(lines[number - 1])[plate]
                    reason = f"{pattern}, area of all {pattern.area:.4g} m^2"
                    window = (bores[0].round_extent(_X)[0], bores[-1].round_extent(_X)[1])
                    statement = _cylinder(name, bores[0], window, len(bores))
                    numbers = tuple(dict.fromkeys(self._number[id(bore)] for bore in bores))
                    candidates.append(Candidate(numbers, bores, statement, reason))
                yield ProposedSurface(name, tuple(candidates), min(equals, len(candidates)))

    def _plane(
        self, name: str, plane: CadSurface, window: tuple[float, float] | None = None
    ) -> SurfaceStatement:
        station = _rounded(plane.extent(_X)[0])
        if window is None:
            # The whole face, told from others in its plane where there are any.
            others = [
                other
                for other in self._planes(1.0) + self._planes(-1.0)
                if other is not plane and abs(other.extent(_X)[0] - station) < SAME_LENGTH
            ]
            window = plane.radii(_ORIGIN, _X) if others else (-np.inf, np.inf)
        return SurfaceStatement(name, "plane", _ORIGIN, _X, station, _window(window))


def _cylinder(
    name: str, surface: CadSurface, window: tuple[float, float], n_bands: int = 1
) -> SurfaceStatement:
    point = np.array([0.0, *(_rounded(x) for x in surface.point[1:])])
    radius = _rounded(surface.radius)
    return SurfaceStatement(name, "cylinder", point, _X, radius, _window(window), n_bands)


def _rounded(value: float) -> float:
    return round(float(value), _DIGITS) + 0.0


def _window(window: tuple[float, float]) -> tuple[float, float]:
    low, high = window
    return (low, high) if np.isinf(low) else (_rounded(low), _rounded(high))


def _plates(
    line: Sequence[CadSurface],
) -> tuple[tuple[CadSurface, ...], tuple[CadSurface, ...]]:
    """Bores of the upwind and of the downwind plate: on both sides of the widest gap."""
    bores = sorted(line, key=lambda bore: bore.extent(_X)[0])
    extents = [bore.round_extent(_X) for bore in bores]
    gaps = [after[0] - before[1] for before, after in pairwise(extents)]
    split = int(np.argmax(gaps)) + 1
    return tuple(bores[:split]), tuple(bores[split:])


def _from_z(pattern: PinPattern) -> list[tuple[CadSurface, ...]]:
    """Bores by pin, from the one at z about +x."""

    def angle(line: tuple[CadSurface, ...]) -> float:
        _, y, z = line[0].point
        # The pin at z itself may be a rounding below zero.
        return float((np.arctan2(-y, z) + 1e-6) % (2.0 * np.pi))

    return sorted(pattern.lines, key=angle)
