"""A reduced body in space: named surfaces, the answer to torque, free and fixed-interface modes."""

from collections.abc import Iterator

import numpy as np

from carrierflex.fe.carrier_curves import flexible_cases, stiff_cases
from carrierflex.geometry.view import SURFACE_COLOURS, rounded_magnification, torque_arrow
from carrierflex.reduction.assembly_modes import assembly_modes
from carrierflex.reduction.pin_fit import FIXED_PILOT
from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.reduction.reduced_static import static_coordinates
from carrierflex.reduction.shapes.body_shapes import BodyShapes
from carrierflex.workflows.reduction.recorded_structure import recorded_inputs
from carrierflex.workflows.view3d.scene import (
    UNNAMED_COLOUR,
    Control,
    Entry,
    FloatArray,
    Label,
    Scene,
    SceneObject,
    feature_edges,
)

#: Largest displacement drawn, as a share of the body's size.
_DRAWN = 0.06
_N_FREE_MODES = 12
_N_RIGID = 6
_OUTLINE = "#8a939c"
#: Radius of the torque's arrow [m].
_ARROW = 0.13
_REST = "body"
_CONTROL = Control("deflection", "", 1.0, (-1.0, 1.0))


def body_scene(model: ReducedModel, shapes: BodyShapes) -> Scene:
    """Scene of a body file with shapes.

    Parameters
    ----------
    model : ReducedModel
        The body.
    shapes : BodyShapes
        Its surface and the displacement of its coordinates on it.
    """
    fields = list(_fields(model, shapes))
    size = float(np.ptp(shapes.points, axis=0).max())
    entries = [Entry("surfaces by name", "At rest; the switches below hide a surface.")]
    moved, values = [np.zeros_like(shapes.points)], [np.zeros(len(shapes.points))]
    for name, words, u, unit in fields:
        factor = _DRAWN * size / float(np.linalg.norm(u, axis=1).max())
        factor = rounded_magnification(factor) if unit else factor
        limit = float(np.abs(u[:, 0]).max())
        scale = 1e6 if unit else 1.0 / float(np.linalg.norm(u, axis=1).max())
        drawn = f"Drawn {factor:,.0f} times larger." if unit else "To any scale."
        legend = f"axial displacement{unit or ', largest displacement = 1'}"
        entries.append(Entry(name, f"{words} {drawn}", legend, limit * scale))
        moved.append(factor * u)
        values.append(u[:, 0] / (limit or 1.0))
    return Scene(
        title=f"{model.name.replace('_', ' ')}, reduced to {model.n_coordinates} coordinates",
        words=f"{len(model.pilots)} pilots, {len(shapes.triangles):,} triangles. Grey lines: the "
        "body at rest. x points downwind along the axis, z up.",
        control=_CONTROL,
        entries=tuple(entries),
        objects=(
            *_objects(shapes, np.array(moved), np.array(values)),
            *_torque(model, len(entries)),
        ),
        labels=tuple(
            Label(name.replace("_", " "), (float(p[0]), float(p[1]), float(p[2])))
            for name, p in model.pilots.items()
        ),
        first=min(1, len(entries) - 1),
    )


def _fields(model: ReducedModel, shapes: BodyShapes) -> Iterator[tuple[str, str, FloatArray, str]]:
    """Name, words, displacement [m], and the unit of its colours (none of a mode)."""
    loads = _torque_loads(model)
    if loads is not None:
        u = shapes.displacement(static_coordinates(model, [FIXED_PILOT], loads))
        words = "Drive torque of 1 kN m, the shaft face held."
        yield "torque of 1 kN m", words, u, ", µm"
    n_free = min(_N_FREE_MODES, model.n_coordinates - _N_RIGID)
    for number, mode in enumerate(assembly_modes(model, n_free), start=1):
        rim = f", {mode.rim_motion}" if model.sensor_names else ""
        words = f"Body free in space{rim}."
        name = f"free mode {number}, {mode.frequency_hz:.0f} Hz"
        yield name, words, shapes.displacement(mode.shape), ""
    for k in np.setdiff1d(np.arange(model.n_coordinates), model.pilot_rows):
        words = "Coordinate of the reduced body, all pilots at rest."
        yield model.labels[k].replace(" (", ", ").rstrip(")"), words, shapes.T[:, :, k], ""


def _torque_loads(model: ReducedModel) -> dict[str, FloatArray] | None:
    """Loads of 1 kN m at the pilots of a carrier of this program's own; None for another body."""
    name = model.name.removesuffix("_carrier")
    is_ours = "parameters" in model.provenance and "carrier_files" not in model.provenance
    if name not in ("flexible", "stiff") or not is_ours:
        return None
    stage, _, _ = recorded_inputs(model)
    if name == "flexible":
        return flexible_cases(stage.carrier, stage.gear)["both"]
    return stiff_cases(stage.gear, stage.carrier.n_planets)["both"]


def _objects(shapes: BodyShapes, moved: FloatArray, values: FloatArray) -> Iterator[SceneObject]:
    """The named surfaces one by one, what has no name, and the outline at rest."""
    for number in (*range(len(shapes.surface_names)), -1):
        triangles = shapes.triangles[shapes.surface_of == number]
        if not len(triangles):
            continue
        nodes, cells = np.unique(triangles, return_inverse=True)
        yield SceneObject(
            name=_REST if number < 0 else shapes.surface_names[number],
            cells=cells.reshape(triangles.shape),
            rest=shapes.points[nodes],
            moved=moved[:, nodes],
            values=values[:, nodes],
            colour=UNNAMED_COLOUR if number < 0 else SURFACE_COLOURS[number % len(SURFACE_COLOURS)],
        )
    edges = feature_edges(shapes.points, shapes.triangles, shapes.surface_of)
    nodes, cells = np.unique(edges, return_inverse=True)
    yield SceneObject(
        name="",
        cells=cells.reshape(edges.shape),
        rest=shapes.points[nodes],
        moved=np.zeros((len(moved), len(nodes), 3)),
        colour=_OUTLINE,
    )


def _torque(model: ReducedModel, n_entries: int) -> Iterator[SceneObject]:
    """Arrow of a positive torque before the shaft face."""
    if FIXED_PILOT in model.pilots:
        points, triangles = torque_arrow(model.pilots[FIXED_PILOT], _ARROW)
        still = np.zeros((n_entries, *points.shape))
        yield SceneObject("arrow of a positive torque", triangles, points, still, colour="#222222")
