"""What is recognised in a CAD solid: the carrier's frame in it and its named surfaces.

A name gets its best candidate only where no second one is as good; otherwise it is left to the
user, with the candidates.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.cad_recognition.carrier_axis import (
    AxisCandidate,
    axis_candidates,
    chosen_axis,
    recognised_frame,
)
from carrierflex.geometry.cad_recognition.merged_surfaces import (
    SAME_LENGTH,
    SurfaceGroup,
    grouped_about_x,
    merged_surfaces,
)
from carrierflex.geometry.cad_recognition.named_candidates import NamedSurfaces, ProposedSurface
from carrierflex.geometry.cad_recognition.oriented_faces import CadSolid
from carrierflex.geometry.cad_surface_files import CadFrame

#: Assumed width of the planet bearings' seat over the gap between the bores.
_BEARING_SHARE = 2.0 / 3.0
#: Extents of planet carriers [m] that are no surprise.
_USUAL = (0.2, 5.0)


@dataclass(frozen=True, eq=False)
class SurfaceProposal:
    """What was recognised in a CAD solid.

    Parameters
    ----------
    step : Path
        The STEP file.
    solid : CadSolid
        Its solid in the file's frame.
    frame : CadFrame
        The carrier's frame in it.
    reasons : tuple of str
        Why this frame.
    groups : tuple of SurfaceGroup
        All surfaces in the carrier's frame, equal ones under one number.
    surfaces : tuple of ProposedSurface
        Names and candidates.
    bearing_width : float
        Width of the planet bearings' seat [m].
    assumed : tuple of str
        What the solid does not tell and was assumed.
    """

    step: Path
    solid: CadSolid
    frame: CadFrame
    reasons: tuple[str, ...]
    groups: tuple[SurfaceGroup, ...]
    surfaces: tuple[ProposedSurface, ...]
    bearing_width: float
    assumed: tuple[str, ...]

    @property
    def left_out(self) -> tuple[str, ...]:
        """Names without a single best candidate."""
        return tuple(surface.name for surface in self.surfaces if surface.chosen is None)


def proposed_surfaces(
    step: Path,
    solid: CadSolid,
    *,
    axis: NDArray[np.float64] | None = None,
    origin: NDArray[np.float64] | None = None,
    length_unit: str | None = None,
    sensor_radius: float | None = None,
    bearing_width: float | None = None,
) -> SurfaceProposal:
    """Propose the carrier's frame and named surfaces.

    Parameters
    ----------
    step : Path
        The STEP file, for messages.
    solid : CadSolid
        Its solid.
    axis : ndarray, shape (3,), optional
        Direction downwind, in the file's frame.
    origin : ndarray, shape (3,), optional
        Origin on the axis, in the file's frame [m].
    length_unit : str, optional
        Unit that was given.
    sensor_radius : float, optional
        Radius of the circle that the sensors face [m].
    bearing_width : float, optional
        Width of the planet bearings' seat on the pins [m].

    Raises
    ------
    ValueError
        Where no axis with pins is found, two are alike, the shaft's end cannot be told, or a given
        length does not fit the solid.
    """
    in_file = merged_surfaces(solid.faces)
    candidates = axis_candidates(in_file, axis)
    if origin is not None:
        candidates = _through(origin, candidates, str(step))
    carrier_axis = chosen_axis(candidates, str(step))
    recognised = recognised_frame(
        in_file, carrier_axis, str(step), axis=axis, origin=origin, length_unit=length_unit
    )
    surfaces = merged_surfaces([face.moved(recognised.frame) for face in solid.faces])
    groups = grouped_about_x(surfaces)
    named = NamedSurfaces(surfaces, groups)
    gap = named.gap
    proposals = (
        named.shaft_face(),
        named.rim_face(sensor_radius, str(step)),
        named.seat("upwind_seat"),
        named.seat("downwind_seat"),
        *named.pins(),
    )
    if bearing_width is not None and not 0.0 < bearing_width < gap:
        raise ValueError(
            f"{step}: --bearing-width is {bearing_width} m; expected more than 0 and less than "
            f"the {gap:.5g} m between the bores"
        )
    width = round(_BEARING_SHARE * gap, 4) if bearing_width is None else bearing_width
    assumed = []
    if sensor_radius is None and proposals[1].candidates:
        radius = proposals[1].candidates[0].statement.window[0]
        assumed.append(
            f"sensor radius {radius:.5g} m, half-way between bores and rim (--sensor-radius)"
        )
    if bearing_width is None:
        assumed.append(
            f"bearing_width {width:.5g} m, two thirds of the gap between the bores "
            "(--bearing-width)"
        )
    largest = float(solid.extent.max())
    if not _USUAL[0] <= largest <= _USUAL[1]:
        assumed.append(
            f"the unit: {largest:.4g} m across is unusual for a planet carrier (--length-unit)"
        )
    return SurfaceProposal(
        step, solid, recognised.frame, recognised.reasons, groups, proposals, width, tuple(assumed)
    )


def _through(
    origin: NDArray[np.float64], candidates: tuple[AxisCandidate, ...], path: str
) -> tuple[AxisCandidate, ...]:
    """Axes that pass through the given origin."""
    through = tuple(
        each
        for each in candidates
        if np.linalg.norm(np.cross(origin - each.point, each.direction)) < SAME_LENGTH
    )
    if not through:
        listed = "; ".join(str(each) for each in candidates[:2])
        raise ValueError(
            f"{path}: --origin is {origin.tolist()}; expected a point of an axis [m], the best "
            f"candidates: {listed or 'none, no cylinder has the given axis'}"
        )
    return through
