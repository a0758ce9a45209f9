"""Facets of a mesh that lie on a surface which a user states by axis, radius and station."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.cad_surface_files import CadStatements
from carrierflex.geometry.cad_surfaces import SurfaceStatement
from carrierflex.geometry.pins import planets_of
from carrierflex.geometry.tet_mesh import FACET_CORNERS, NamedSurfaces


def with_stated(
    mesh: NamedSurfaces,
    boundary: Mapping[str, NDArray[np.int64]],
    statements: CadStatements | None,
    where: str,
) -> dict[str, NDArray[np.int64]]:
    """Named surfaces of a mesh and those that are stated.

    Of bonded pins, the planet bearings' seats too: ``pin_i_midspan`` as wide as ``[pin]
    bearing_width``, half-way between the bores, where none is named or stated.

    Parameters
    ----------
    mesh : NamedSurfaces
        In the carrier's frame [m].
    boundary : mapping of str to ndarray of int
        Boundary facets of every body, corners first.
    statements : CadStatements, optional
        The surfaces file.
    where : str
        The mesh in messages.

    Raises
    ------
    ValueError
        Where a body or a surface that is stated is not in the mesh, or the seats of bonded pins
        are neither named nor as wide as could be.
    """
    if statements is None:
        return dict(mesh.surfaces)
    if "carrier" not in boundary:
        raise ValueError(
            f"{where}: bodies {', '.join(map(repr, boundary))}; expected 'carrier' and, bonded, "
            "'pins', or [mesh.bodies] of the surfaces file saying which group of elements is which"
        )
    surfaces = dict(mesh.surfaces)
    for statement in statements.surfaces:
        surfaces[statement.name] = stated_facets(
            mesh.points, boundary, statement, statements.tolerance, where
        )
    if "pins" in boundary and not any(name.endswith("_midspan") for name in surfaces):
        if statements.bearing_width is None:
            raise ValueError(
                f"{where}: no surface pin_1_midspan among its groups, and the surfaces file has no "
                "[pin] bearing_width; expected one of the two for the carrier with bonded pins"
            )
        for seat in _seats(mesh.points, surfaces, statements, statements.bearing_width):
            surfaces[seat.name] = stated_facets(
                mesh.points, boundary, seat, statements.tolerance, where
            )
    return surfaces


def _seats(
    points: NDArray[np.float64],
    surfaces: Mapping[str, NDArray[np.int64]],
    statements: CadStatements,
    width: float,
) -> Iterator[SurfaceStatement]:
    """Seats of the planet bearings of a `width` [m], half-way between bores that are stated."""
    stated = {statement.name for statement in statements.surfaces}
    for number in range(1, planets_of(stated) + 1):
        names = [f"pin_{number}_{side}" for side in ("upwind", "downwind")]
        if not stated.issuperset(names):
            continue
        bore = statements.named(names[0])
        ends = [points[np.unique(surfaces[name])] @ bore.direction for name in names]
        first, last = sorted((float(end.min()), float(end.max())) for end in ends)
        middle, gap = (first[1] + last[0]) / 2.0, last[0] - first[1]
        if not width < gap:
            raise ValueError(
                f"[pin] bearing_width is {width} m; expected less than the {gap:.4g} m between the "
                f"bores of pin {number}"
            )
        window = (middle - width / 2.0, middle + width / 2.0)
        yield replace(bore, name=f"pin_{number}_midspan", window=window)


def stated_facets(
    points: NDArray[np.float64],
    boundary: Mapping[str, NDArray[np.int64]],
    statement: SurfaceStatement,
    tolerance: float,
    where: str,
) -> NDArray[np.int64]:
    """Boundary facets whose corners all lie on the stated plane or cylinder, in its window.

    Corners decide: the mid-side nodes of a linear mesh made quadratic lie on chords.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Nodes in the carrier's frame [m].
    boundary : mapping of str to ndarray of int
        Boundary facets of every body, corners first.
    statement : SurfaceStatement
        What is looked for; of the body ``pins`` where its name ends in midspan, of the carrier
        otherwise.
    tolerance : float
        Distance [m] that still counts as on the surface.
    where : str
        The mesh in messages.

    Raises
    ------
    ValueError
        Where there is none.
    """
    body = "pins" if statement.name.endswith("_midspan") else "carrier"
    if body not in boundary:
        raise ValueError(
            f"{where}: surface {statement.name!r} is stated of a mesh without a body 'pins'; "
            "expected it of the carrier with bonded pins only"
        )
    facets = boundary[body]
    corners = points[facets[:, : FACET_CORNERS[facets.shape[1]]]]
    along = corners @ statement.direction
    radius = np.linalg.norm(np.cross(corners - statement.point, statement.direction), axis=2)
    measured, inside = (along, radius) if statement.kind == "plane" else (radius, along)
    low, high = statement.window
    on = (np.abs(measured - statement.size) <= tolerance).all(axis=1)
    if statement.name == "rim_face":
        _refuse_crossed_circle(inside[on], low, tolerance, where)
    within = (inside >= low - tolerance) & (inside <= high + tolerance)
    found = facets[on & within.all(axis=1)]
    if not len(found):
        raise ValueError(
            f"{where}: no facet lies on surface {statement.name!r}, the {statement}, within "
            f"{tolerance:g} m; expected one that element edges bound"
        )
    return found


def _refuse_crossed_circle(
    radii: NDArray[np.float64], circle: float, tolerance: float, where: str
) -> None:
    """Refuse facets of the rim's plane, radii (k, m) of their corners, that the circle cuts.

    The inner edge of the facets outside would be taken for the sensors' circle.
    """
    crossed = (radii.min(axis=1) < circle - tolerance) & (radii.max(axis=1) > circle + tolerance)
    if crossed.any():
        outside = radii[radii > circle + tolerance].min()
        raise ValueError(
            f"{where}: {int(crossed.sum())} facets of surface 'rim_face' lie across its inner "
            f"radius of {circle:.6g} m, the sensors' circle; expected element edges along it (the "
            f"mesh's next nodes outside lie at {outside:.6g} m)"
        )
