"""What does a body, a curve or a gap look like from all sides? One page that one can turn.

A good answer opens from disk in any browser, without a network, and is sent by mail.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from carrierflex.fe.carrier_curves import flexible_cases, stiff_cases
from carrierflex.fe.curve_files import read_curves
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.files.json_files import save_text
from carrierflex.files.whole_files import check_file_writable, refuse_foreign
from carrierflex.geometry.view import SURFACE_COLOURS, rounded_magnification, torque_arrow
from carrierflex.reduction.assembly_modes import assembly_modes
from carrierflex.reduction.pin_fit import FIXED_PILOT
from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.reduction.reduced_static import static_coordinates
from carrierflex.reduction.shapes.body_shapes import BodyShapes
from carrierflex.workflows.progress import Stages
from carrierflex.workflows.reduction.recorded_structure import recorded_inputs
from carrierflex.workflows.view3d.circles import band, circle, directions, pin_labels, pins
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
from carrierflex.workflows.view3d.view import scene_page

#: Largest displacement drawn, as a share of the body's size.
_DRAWN_OF_BODY = 0.06
_N_FREE_MODES = 12
_N_RIGID = 6
_OUTLINE = "#8a939c"
#: Radius of the torque's arrow [m].
_ARROW = 0.13
_REST = "body"
_CONTROL = Control("deflection", "", 1.0, (-1.0, 1.0))
#: Largest displacement drawn, and width of the band, over the radius.
_DRAWN, _WIDTH = 0.15, 0.06
_WORDS = {
    "delta_s": "Carrier with bonded pins (stiff), torque of 1 kN m.",
    "delta_f": "Carrier without pins (flexible), torque of 1 kN m.",
    "g_s": "Carrier with bonded pins (stiff), force of 1 N on pin 1.",
    "g_f": "Carrier without pins (flexible), force of 1 N on pin 1.",
}
#: Page beside the report of a diagnosis.
VIEW_FILE = "view.html"
_CURVES_FILE = "deflection_curves.csv"
_EXPECTED = "a body (.h5), deflection curves (.csv) or rim_motion.json"


@dataclass(frozen=True)
class WrittenView:
    """The page, its size [bytes], what can be shown in it, and how many entries found no room."""

    path: Path
    size: int
    entries: tuple[str, ...]
    n_left_out: int


def main(
    shown: Path, *, html: bool = False, out: Path | None = None, quiet: bool = False
) -> WrittenView:
    """Write an interactive 3-D page of a body, deflection curves or the gap at the rim.

    Parameters
    ----------
    shown
        Body file (.h5) of carrierflex reduce --shapes: named surfaces, answer to a torque of
        1 kN m, free modes, modes with the pilots held. Folder of carrierflex curves or its
        deflection_curves.csv: the rim under unit loads. Folder of carrierflex diagnose or its
        rim_motion.json (kind carrier): measured and simulated rim with the gap in colour.
    html
        The only format, and the default: one file below 15 MB that contains viewer and data.
        Writing needs carrierflex[view], reading a browser with WebGL 2.
    out
        File to write (.html); default: view.html in the folder, or the file's name with .html.
    quiet
        Show no progress.

    Returns
    -------
    WrittenView
        Path, size and entries of the page.

    Raises
    ------
    FileNotFoundError, ValueError
        Where the file is none of these or damaged, a body has no shapes, or k3d is not installed.
    """
    source = _source(shown)
    page = out or (shown / VIEW_FILE if shown.is_dir() else shown.with_suffix(".html"))
    if page.suffix != ".html":
        raise ValueError(f"{page}: suffix {page.suffix!r}; expected .html")
    check_file_writable(page)
    refuse_foreign(page, "k3d")
    stages = Stages(1, quiet)
    with stages.stage(f"writing {page}"):
        return write_view(_scene(source), page)


def write_view(scene: Scene, path: Path) -> WrittenView:
    """Write the page of a scene.

    Raises
    ------
    ValueError
        Where k3d is not installed, or not one entry fits into a page.
    """
    text, fitted = scene_page(scene)
    save_text(path, text)
    return WrittenView(
        path=path,
        size=len(text.encode("utf-8")),
        entries=tuple(entry.name for entry in fitted.entries),
        n_left_out=len(scene.entries) - len(fitted.entries),
    )


def _source(shown: Path) -> Path:
    """File that is meant: itself, or the one in a folder of curves or of a diagnosis."""
    from carrierflex.workflows.view3d.rim_motion_files import RIM_MOTION_FILE

    if not shown.exists():
        raise FileNotFoundError(f"{shown}: no such file or folder; expected {_EXPECTED}")
    if not shown.is_dir():
        return shown
    for name in (RIM_MOTION_FILE, _CURVES_FILE):
        if (shown / name).is_file():
            return shown / name
    raise ValueError(
        f"{shown}: holds neither {RIM_MOTION_FILE} nor {_CURVES_FILE}; expected a folder of "
        "carrierflex diagnose (kind carrier) or of carrierflex curves"
    )


def _scene(source: Path) -> Scene:
    from carrierflex.reduction.body_files import read_body, read_shapes
    from carrierflex.workflows.view3d.rim_motion_files import read_rim_motion
    from carrierflex.workflows.view3d.rim_scene import rim_scene

    if source.suffix == ".json":
        return rim_scene(read_rim_motion(source))
    if source.suffix == ".csv":
        return curve_scene(read_curves(source), source.parent.name or source.stem)
    if source.suffix != ".h5":
        raise ValueError(f"{source}: suffix {source.suffix!r}; expected {_EXPECTED}")
    model, shapes = read_body(source), read_shapes(source)
    if shapes is None:
        raise ValueError(
            f"{source}: the body file holds no shapes; expected one of carrierflex reduce --shapes"
        )
    return body_scene(model, shapes)


def curve_scene(curves: Mapping[str, DeflectionCurve], name: str) -> Scene:
    """Scene of the four curves of a carrier.

    Parameters
    ----------
    curves : mapping of str to DeflectionCurve
        By name, all over the same angles.
    name : str
        Where they come from.

    Raises
    ------
    ValueError
        Where no curve deflects.
    """
    shown = {name: curve for name, curve in curves.items() if _largest(curve) > 0.0}
    if not shown:
        raise ValueError(f"{name}: every curve is zero; expected one that deflects")
    first = next(iter(shown.values()))
    n, radius = first.angle.size, first.radius
    e = directions(first.angle)
    rest = np.concatenate([(1.0 - _WIDTH) * radius * e, (1.0 + _WIDTH) * radius * e])
    entries = []
    moved = []
    values = []
    for curve_name, curve in shown.items():
        factor = rounded_magnification(_DRAWN * radius / _largest(curve))
        u = curve.axial[:, None] * np.array([1.0, 0.0, 0.0]) + curve.radial[:, None] * e
        limit = float(np.abs(curve.axial).max())
        entries.append(
            Entry(
                curve_name,
                f"{_WORDS[curve_name]} Drawn {factor:,.0f} times larger.",
                "axial displacement, µm",
                limit * 1e6,
            )
        )
        moved.append(factor * np.tile(u, (2, 1)))
        values.append(np.tile(curve.axial / (limit or 1.0), 2))
    n_planets = shown["delta_f"].first_order if "delta_f" in shown else first.first_order
    return Scene(
        title=f"deflection curves, {name}",
        words=f"Circle of radius {radius:g} m on the carrier's rim, seen from upwind. Grey: at "
        "rest. x points downwind along the axis, z up.",
        control=Control("share of the load", "", 1.0, (-1.0, 1.0)),
        entries=tuple(entries),
        objects=(
            SceneObject("rim", band(n), rest, np.array(moved), np.array(values)),
            circle(radius, len(entries)),
            *pins(radius, n_planets, len(entries)),
        ),
        labels=tuple(pin_labels(radius, n_planets)),
    )


def _largest(curve: DeflectionCurve) -> float:
    return float(np.hypot(curve.axial, curve.radial).max())


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
        factor = _DRAWN_OF_BODY * size / float(np.linalg.norm(u, axis=1).max())
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
