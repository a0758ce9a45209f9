"""Off-screen picture of what was recognised in a CAD solid: surfaces numbered, names coloured."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.cad_recognition.merged_surfaces import SurfaceGroup
from carrierflex.geometry.cad_recognition.surface_proposal import SurfaceProposal
from carrierflex.geometry.view import LIGHTING, new_plotter

Vector = NDArray[np.float64]

#: Pixels of the picture: three views and the legend.
_WINDOW = (1800, 1500)
#: Views: title, direction to the viewer, half of the carrier that is shown (None for all of it).
_VIEWS = (
    ("from upwind", (-1.5, 0.85, 0.75), None),
    ("from downwind", (1.5, 0.85, 0.75), None),
    ("cut through the axis and pin 1", (0.35, -1.5, 0.45), 1.0),
)
_PLAIN, _EDGES = "#c9ced6", "#5b6670"
#: Colours by the beginning of a name; what is left out has one of its own.
_COLOURS = {
    "shaft_face": "#7b3fa0",
    "rim_face": "#d1495b",
    "upwind_seat": "#2e86ab",
    "downwind_seat": "#17a398",
    "pin_upwind": "#e09f3e",
    "pin_downwind": "#8f9b2f",
}
_LEFT_OUT = "#f26df9"
#: Triangles of a group that are tried for a label that can be seen.
_TRIED = 60


@dataclass(frozen=True)
class _Named:
    """A colour, and what it means in the legend."""

    colour: str
    text: str


def proposal_picture(proposal: SurfaceProposal) -> NDArray[np.uint8]:
    """Draw the solid from upwind, from downwind and cut, every surface with its number.

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)
        The picture; writing it is the caller's business.
    """
    named = _named(proposal)
    plotter = new_plotter((2, 2))
    plotter.window_size = list(_WINDOW)
    for index, (title, viewpoint, half) in enumerate(_VIEWS):
        plotter.subplot(index // 2, index % 2)
        _draw(plotter, proposal, named, np.array(viewpoint), half)
        plotter.add_text(title, font_size=11, color="black")
    plotter.subplot(1, 1)
    _legend(plotter, proposal, named)
    image = np.asarray(plotter.screenshot(return_img=True), dtype=np.uint8)
    plotter.close()
    return image


def _named(proposal: SurfaceProposal) -> dict[int, _Named]:
    """Colour and names by number of the group."""
    names: dict[int, list[str]] = {}
    colours: dict[int, str] = {}
    for surface in proposal.surfaces:
        kind = surface.name
        if kind.startswith("pin_"):
            kind = "pin_" + kind.rpartition("_")[2]
        chosen = surface.chosen
        shown = surface.candidates[: surface.equals] if chosen is None else (chosen,)
        for candidate in shown:
            for number in candidate.numbers:
                text = kind if chosen is not None else f"{kind}?"
                if text not in names.setdefault(number, []):
                    names[number].append(text)
                colours[number] = _LEFT_OUT if chosen is None else _COLOURS[kind]
    last = sum(surface.name.startswith("pin_") for surface in proposal.surfaces) // 2
    return {
        number: _Named(colours[number], ", ".join(_all_pins(text, last) for text in texts))
        for number, texts in sorted(names.items())
    }


def _all_pins(name: str, last: int) -> str:
    kind, _, side = name.partition("_")
    return f"pin_1 ... {last}_{side}" if kind == "pin" else name


def _draw(
    plotter: Any,
    proposal: SurfaceProposal,
    named: dict[int, _Named],
    viewpoint: Vector,
    half: float | None,
) -> None:

    visible = {group.number: _triangles(group, half) for group in proposal.groups}
    surface = _poly(np.concatenate([triangles for triangles in visible.values() if len(triangles)]))
    for number, triangles in visible.items():
        if not len(triangles):
            continue
        colour = named[number].colour if number in named else _PLAIN
        plotter.add_mesh(_poly(triangles), color=colour, **LIGHTING)
    plotter.add_mesh(_lines(_edges(proposal), half), color=_EDGES, line_width=1.2)
    _add_frame(plotter, proposal, half, tip=viewpoint[0] > 0.0)
    towards = viewpoint / np.linalg.norm(viewpoint)
    far = 10.0 * surface.length * towards
    labels = {
        number: _seen_point(triangles, surface, towards, far)
        for number, triangles in visible.items()
        if len(triangles)
    }
    shown = {number: point for number, point in labels.items() if point is not None}
    plotter.add_point_labels(
        np.array(list(shown.values())),
        [str(number) for number in shown],
        always_visible=True,
        show_points=False,
        font_size=15,
        text_color="black",
        shape_color="white",
        shape_opacity=0.8,
        margin=2,
    )
    plotter.background_color = "white"
    plotter.enable_parallel_projection()
    plotter.view_vector(viewpoint, viewup=(0.0, 0.0, 1.0))
    plotter.camera.zoom(1.25)


def _triangles(group: SurfaceGroup, half: float | None) -> Vector:
    """Triangles of all copies; of a half only those whose middle has y on its side."""
    triangles = np.concatenate([surface.triangles for surface in group.surfaces])
    return triangles if half is None else _cut(triangles, half)


def _cut(triangles: Vector, half: float) -> Vector:
    """Triangles with what lies beyond the plane y = 0 cut off."""
    clipped = _poly(triangles).clip("y", origin=(0.0, 0.0, 0.0), invert=half < 0.0)
    surface = clipped.extract_surface(algorithm="dataset_surface").triangulate()
    if not surface.n_cells:
        return np.zeros((0, 3, 3))
    return np.asarray(surface.points[surface.regular_faces], dtype=np.float64)


def _edges(proposal: SurfaceProposal) -> Iterator[Vector]:
    """Edges of all faces, as polylines [m]."""
    for group in proposal.groups:
        for surface in group.surfaces:
            for oriented in surface.faces:
                outline = oriented.face.outline
                yield from outline.reshape(max(len(oriented.face.edges), 1), -1, 3)


def _lines(polylines: Iterable[Vector], half: float | None) -> Any:
    """Polylines as one set of straight segments; of a half those that lie on its side."""
    import pyvista

    segments = np.concatenate([np.stack([line[:-1], line[1:]], axis=1) for line in polylines])
    if half is not None:
        segments = segments[(half * segments[:, :, 1] > -1e-6).all(axis=1)]
    pairs = np.arange(2 * len(segments)).reshape(-1, 2)
    cells = np.concatenate([np.full((len(pairs), 1), 2), pairs], axis=1)
    return pyvista.PolyData(segments.reshape(-1, 3), lines=cells.ravel())


def _poly(triangles: Vector) -> Any:
    import pyvista

    corners = np.arange(3 * len(triangles)).reshape(-1, 3)
    faces = np.concatenate([np.full((len(corners), 1), 3), corners], axis=1)
    return pyvista.PolyData(triangles.reshape(-1, 3), faces.ravel())


def _seen_point(triangles: Vector, solid: Any, towards: Vector, far: Vector) -> Vector | None:
    """Middle of a triangle that nothing hides, the most central of them; None where all are hid."""
    middles = triangles.mean(axis=1)
    sides = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    # Seen edge-on a surface is no place for a label.
    facing = np.abs(sides @ towards)
    tried = np.argsort(-facing)[:_TRIED]
    visible = []
    for middle in middles[tried]:
        start = middle + 1e-4 * solid.length * towards
        hits, _ = solid.ray_trace(start, middle + far)
        if not len(hits):
            visible.append(middle)
    if not visible:
        return None
    points = np.array(visible)
    return np.asarray(points[np.linalg.norm(points - points.mean(axis=0), axis=1).argmin()])


def _add_frame(plotter: Any, proposal: SurfaceProposal, half: float | None, *, tip: bool) -> None:
    """Axis downwind, direction of pin 1 and, on the rim face, the circle of the sensors.

    The axis is named where its tip is seen.
    """
    import pyvista

    corners = np.concatenate(
        [surface.outline for group in proposal.groups for surface in group.surfaces]
    )
    low, high = corners[:, 0].min(), corners[:, 0].max()
    reach = 0.15 * (high - low) + 0.05 * np.abs(corners).max()
    length = high - low + 2.0 * reach
    arrow = pyvista.Arrow(
        start=(low - reach, 0.0, 0.0), direction=(1.0, 0.0, 0.0), scale=length,
        tip_length=0.08, tip_radius=0.012, shaft_radius=0.004,
    )  # fmt: skip
    plotter.add_mesh(arrow, color="black")
    rim = next(surface for surface in proposal.surfaces if surface.name == "rim_face")
    if rim.chosen is not None:
        radius, station = rim.chosen.statement.window[0], rim.chosen.statement.size
        angles = np.linspace(0.0, 2.0 * np.pi, 181)
        circle = np.stack(
            [np.full(181, station - 1e-3), -radius * np.sin(angles), radius * np.cos(angles)],
            axis=1,
        )
        plotter.add_mesh(_lines([circle], half), color="black", line_width=2.0)
    radius = float(np.hypot(corners[:, 1], corners[:, 2]).max())
    plotter.add_point_labels(
        np.array([[0.0, 0.0, 1.06 * radius], [high + reach, 0.0, 0.0]])[: 2 if tip else 1],
        ["pin 1", "x, downwind"][: 2 if tip else 1],
        always_visible=True,
        show_points=False,
        font_size=14,
        text_color="black",
        shape=None,
    )


def _legend(plotter: Any, proposal: SurfaceProposal, named: dict[int, _Named]) -> None:
    """Colours with numbers and names, and the place of the file's frame."""
    plotter.background_color = "white"
    plotter.add_text(proposal.step.name, font_size=11, color="black")
    entries = [[f"{number}  {each.text}", each.colour] for number, each in named.items()]
    entries.append(["others, numbers as in the list", _PLAIN])
    entries.append(["circle of the sensors", "black"])
    height = min(0.045 * len(entries), 0.8)
    plotter.add_legend(
        entries, bcolor="white", border=False, size=(0.85, height), loc="center", face="rectangle"
    )
