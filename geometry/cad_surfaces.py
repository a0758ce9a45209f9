"""Statements of surfaces by axis, radius and station.

Which faces of a CAD solid they mean, and where they cut them.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from carrierflex.geometry.cad_faces import CadFace

#: Deviation of directions [rad] that still counts as parallel.
_PARALLEL = 1e-4
#: Candidates listed where none or several faces match.
_SHOWN = 6

Circle = tuple[NDArray[np.float64], NDArray[np.float64], float]


@dataclass(frozen=True, eq=False)
class SurfaceStatement:
    """A part of a plane or cylinder, as a user states it.

    Lengths in metres, in the carrier's frame.

    Parameters
    ----------
    name : str
        Name of the surface, as in ``pin_1_upwind``.
    kind : str
        ``cylinder`` or ``plane``.
    point : ndarray, shape (3,)
        A point of the cylinder's axis, or of the axis about which a plane's radii are measured.
    direction : ndarray, shape (3,)
        Unit vector along the cylinder's axis or the plane's normal.
    size : float
        Radius of the cylinder, or station of the plane: ``direction · x`` of its points.
    window : tuple of float
        Least and greatest station of a cylinder's part, radius of a plane's part; faces are cut at
        both.
    n_bands : int
        Number of bands the surface has along the axis (a plane: of radii), 2 for a bore with a
        groove. Faces side by side around the axis are one band, as those of a seat that is notched
        by bores.
    """

    name: str
    kind: Literal["cylinder", "plane"]
    point: NDArray[np.float64]
    direction: NDArray[np.float64]
    size: float
    window: tuple[float, float] = (-np.inf, np.inf)
    n_bands: int = 1

    def extent(self, face: "CadFace") -> tuple[float, float]:
        """Least and greatest station (cylinder) or radius (plane) of the face's outline."""
        if self.kind == "cylinder":
            along = face.outline @ self.direction
        else:
            along = np.linalg.norm(np.cross(face.outline - self.point, self.direction), axis=1)
        return float(along.min()), float(along.max())

    def deviation(self, face: "CadFace") -> float:
        """Distance [m] of the face's plane or cylinder from the stated one.

        Infinite where kind or direction differ.
        """
        if (
            face.kind != self.kind
            or np.linalg.norm(np.cross(face.direction, self.direction)) > _PARALLEL
        ):
            return float("inf")
        if self.kind == "plane":
            return abs(float(face.point @ self.direction) - self.size)
        off_axis = float(np.linalg.norm(np.cross(face.point - self.point, self.direction)))
        return off_axis + abs(face.radius - self.size)

    def touched(self, faces: "tuple[CadFace, ...]", tolerance: float) -> "list[CadFace]":
        """Faces that lie on the stated plane or cylinder, a part of them at least in the window.

        Raises
        ------
        ValueError
            Where there is none; the message lists the candidates.
        """
        matching = []
        for face in faces:
            low, high = self.extent(face)
            inside = low < self.window[1] - tolerance and high > self.window[0] + tolerance
            if inside and self.deviation(face) <= tolerance:
                matching.append(face)
        if not matching:
            raise ValueError(
                f"surface {self.name!r}: the CAD model has no {self}; candidates: "
                f"{_listed(self._nearest(faces))}"
            )
        return matching

    def circles(self, faces: "list[CadFace]", tolerance: float) -> list[Circle]:
        """Circles (centre, axis, radius) at the window's ends that cut one of `faces`."""
        cuts = []
        for end in self.window:
            across = [
                face
                for face in faces
                if self.extent(face)[0] + tolerance < end < self.extent(face)[1] - tolerance
            ]
            if not across:
                continue
            if self.kind == "plane":
                station = (
                    self.point
                    + (float(across[0].point @ self.direction) - self.point @ self.direction)
                    * self.direction
                )
                cuts.append((station, self.direction, end))
            else:
                # The CAD model's own axis and radius: the cut has to lie on its face.
                centre, axis = across[0].point, across[0].direction
                cuts.append(
                    (
                        centre + (end - centre @ self.direction) / (axis @ self.direction) * axis,
                        axis,
                        across[0].radius,
                    )
                )
        return cuts

    def chosen(self, faces: "tuple[CadFace, ...]", tolerance: float) -> "list[CadFace]":
        """Faces of a model cut by :meth:`circles` that make up the surface.

        Inside the window, in as many bands as stated.

        Raises
        ------
        ValueError
            Where there are none, or another number of bands; the message lists them.
        """
        matching = []
        for face in self.touched(faces, tolerance):
            low, high = self.extent(face)
            if self.window[0] - tolerance <= low and high <= self.window[1] + tolerance:
                matching.append(face)
        if not matching:
            raise ValueError(
                f"surface {self.name!r}: no face of the CAD model lies inside the window of the "
                f"{self}; candidates: {_listed(self._nearest(faces))}"
            )
        n_bands = self._bands(matching, tolerance)
        if n_bands != self.n_bands:
            key = "axial_range" if self.kind == "cylinder" else "radial_range"
            raise ValueError(
                f"surface {self.name!r}: {n_bands} separate surfaces match the {self}; expected "
                f"{self.n_bands}, choose by {key} or say parts = {n_bands}; candidates: "
                f"{_listed(matching)}"
            )
        return matching

    def _bands(self, faces: "list[CadFace]", tolerance: float) -> int:
        """Number of groups of adjacent faces.

        Adjacent faces share edges or lie side by side around the axis.
        """
        bands: list[tuple[float, float, frozenset[int]]] = []
        for face in faces:
            low, high = self.extent(face)
            edges = face.edges
            apart = []
            for band in bands:
                if band[2] & edges or (band[0] < high - tolerance and low < band[1] - tolerance):
                    low = min(low, band[0])
                    high = max(high, band[1])
                    edges = edges | band[2]
                else:
                    apart.append(band)
            bands = [*apart, (low, high, edges)]
        return len(bands)

    def _nearest(self, faces: "tuple[CadFace, ...]") -> "list[CadFace]":
        """Faces of the same kind, the nearest first; all others where none is of that kind."""
        alike = [face for face in faces if face.kind == self.kind]
        return sorted(alike or faces, key=self._distance)

    def _distance(self, face: "CadFace") -> float:
        """Deviation and distance from the window [m], to order candidates by."""
        low, high = self.extent(face)
        outside = max(self.window[0] - low, high - self.window[1], 0.0)
        deviation = self.deviation(face)
        return outside + (deviation if np.isfinite(deviation) else 1e3)

    def __str__(self) -> str:
        axis = tuple(float(f"{x:.6g}") for x in self.direction + 0.0)
        window = (
            ""
            if np.isinf(self.window).all()
            else f" between {self.window[0]:.6g} and {self.window[1]:.6g} m"
        )
        if self.kind == "plane":
            return f"plane of normal {axis} at station {self.size:.6g} m, radii{window or ' all'}"
        through = tuple(float(f"{x:.6g}") for x in self.point + 0.0)
        return (
            f"cylinder of radius {self.size:.6g} m about the axis {axis} through {through}{window}"
        )


def _listed(faces: "list[CadFace]") -> str:
    shown = "; ".join(f"[{number}] {face}" for number, face in enumerate(faces[:_SHOWN], start=1))
    return shown + (f"; and {len(faces) - _SHOWN} more" if len(faces) > _SHOWN else "")
