"""A scene as one page that opens from disk, drawn by k3d, which the page holds."""

import html
import json
import re
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.dihedral import rotation_about_x
from carrierflex.geometry.view import SURFACE_COLOURS
from carrierflex.workflows.view3d.scene import (
    UNNAMED_COLOUR,
    FloatArray,
    Label,
    Scene,
    SceneObject,
)

#: Largest page [bytes]; entries at the end are left out of a larger one.
MOST_BYTES = 14_500_000
_PANEL = files("carrierflex.workflows") / "view3d" / "panel"
_FIELD_OF_VIEW_DEG = 30.0
#: Points are rounded to this share of the scene's size, a tenth of a pixel: it halves the page.
_ROUNDING = 2.0**-13
#: Shades of the diverging map.
_N_SHADES = 33
#: Colours beyond the deflection's -1 to 1: a band of this width each, for surfaces by name.
_BAND = 2.0 / (len(SURFACE_COLOURS) + 1)


def scene_page(scene: Scene) -> tuple[str, Scene]:
    """HTML text of a scene, and the scene without the entries that would make it too large.

    Raises
    ------
    ValueError
        Where k3d is not installed, or a single entry makes a page that is too large.
    """
    page = _page(scene)
    while len(page) > MOST_BYTES:
        n = int(len(scene.entries) * 0.95 * MOST_BYTES / len(page))
        if n < 1:
            raise ValueError(
                f"{scene.title}: the page would have {len(page) / 1e6:.0f} MB; expected a surface "
                f"that fits into {MOST_BYTES / 1e6:g} MB: reduce the body with a larger --size"
            )
        scene = scene.with_entries(n)
        page = _page(scene)
    return page, scene


def _page(scene: Scene) -> str:
    k3d = viewer_library()
    plot = k3d.plot(
        grid_visible=False,
        camera_auto_fit=False,
        camera_mode="orbit",
        camera_up_axis="z",
        camera_fov=_FIELD_OF_VIEW_DEG,
        colorbar_object_id=0,
        menu_visibility=False,
        axes_helper=1.0,
        snapshot_type="full",
        time=_start(scene, scene.first) + scene.control.start - scene.control.stops[0],
    )
    switches = []
    for item in scene.objects:
        drawn = _drawn(k3d, scene, item)
        plot += drawn
        if item.name:
            switches.append({"name": item.name, "colour": item.colour, "id": drawn.id})
    for label in scene.labels:
        plot += _label(k3d, scene, label)
    data = json.dumps(_panel_data(scene, switches)).replace("<", "\\u003c")
    code = (_PANEL / "panel.js").read_text(encoding="utf-8")
    page = plot.get_snapshot(9, additional_js_code=f"{code}\nturnable(K3DInstance, {data});")
    return _with_head(page, scene)


def viewer_library() -> Any:
    """The module k3d.

    Raises
    ------
    ValueError
        Where it is not installed; the message says how to install it.
    """
    try:
        import k3d
    except ImportError as error:
        raise ValueError(
            "the page needs k3d, which is not installed; expected: pip install "
            '"carrierflex[view]" (.venv/bin/pip install "k3d>=3.2" in a clone)'
        ) from error
    return k3d


def _with_head(page: str, scene: Scene) -> str:
    """The page with its title and style, and with words where there is no WebGL."""
    style = (_PANEL / "panel.css").read_text(encoding="utf-8")
    title = html.escape(scene.title)
    head = (
        f"<title>{title}</title>\n<link rel='icon' href='data:,'>\n"
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        # By this word the page is known as one of this program, which the next one may replace.
        '<meta name="generator" content="carrierflex">\n'
        f"<style>{style}</style>"
    )
    page = re.sub(r"<title>[^<]*</title>", lambda _: head, page, count=1)
    before, _, after = page.rpartition("</body>")
    absent = (_PANEL / "no_webgl.html").read_text(encoding="utf-8")
    return f"{before}{absent}</body>{after}"


def _panel_data(scene: Scene, switches: list[dict[str, Any]]) -> dict[str, Any]:
    """What the panel beside the picture shows."""
    return {
        "title": scene.title,
        "words": scene.words,
        "first": scene.first,
        "camera": _camera(scene),
        "control": {
            "name": scene.control.name,
            "unit": scene.control.unit,
            "start": scene.control.start,
            "low": scene.control.stops[0],
            "high": scene.control.stops[-1],
        },
        "shades": [_hex(colour) for colour in _diverging()[:: _N_SHADES // 8]],
        "entries": [
            {
                "name": entry.name,
                "words": entry.words,
                "legend": entry.legend,
                "limit": f"{entry.limit:.3g}",
                "start": _start(scene, number),
            }
            for number, entry in enumerate(scene.entries)
        ],
        "switches": switches,
    }


def _start(scene: Scene, number: int) -> float:
    """Time at which the first stop of an entry stands."""
    stops = scene.control.stops
    return 2.0 * (stops[-1] - stops[0]) * number


def _camera(scene: Scene) -> list[float]:
    points = np.concatenate([item.rest for item in scene.objects])
    middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
    distance = 0.85 * scene.size / np.tan(np.deg2rad(_FIELD_OF_VIEW_DEG / 2.0))
    eye = middle + distance * np.array(scene.eye) / np.linalg.norm(scene.eye)
    return [*eye.tolist(), *middle.tolist(), 0.0, 0.0, 1.0]


def _drawn(k3d: Any, scene: Scene, item: SceneObject) -> Any:
    """The item as an object of k3d, with its states over time."""
    step = scene.size * _ROUNDING
    vertices = _over_time(scene, item, item.rest, item.moved, step)
    # The colour map's colours are multiplied by this one.
    colour = item.colour if item.values is None else "#ffffff"
    options: dict[str, Any] = {"name": item.name, "color": int(colour[1:], 16)}
    if item.cells.shape[1] == 2:
        drawn = k3d.lines(
            item.rest.astype(np.float32),
            item.cells.astype(np.uint32),
            indices_type="segment",
            shader="mesh" if item.width else "simple",
            width=item.width or 1e-3,
            **options,
        )
    elif item.values is None:
        drawn = k3d.mesh(
            item.rest.astype(np.float32),
            item.cells.astype(np.uint32),
            side="double",
            flat_shading=False,
            **options,
        )
    else:
        drawn = k3d.mesh(
            item.rest.astype(np.float32),
            item.cells.astype(np.uint32),
            attribute=np.zeros(len(item.rest), dtype=np.float32),
            color_map=_colour_map(),
            color_range=[-1.0, 3.0],
            side="double",
            roughness=0.9,
            **options,
        )
        drawn.attribute = _colours_over_time(scene, item)
    drawn.vertices = vertices
    if item.turns:
        drawn.model_matrix = {time: _turned(stop) for time, stop in _times(scene)}
    return drawn


def _label(k3d: Any, scene: Scene, label: Label) -> Any:
    point = np.array(label.point, dtype=np.float32)
    text = k3d.text(
        html.escape(label.text),
        position=point,
        color=0x222222,
        size=0.75,
        label_box=False,
        is_html=True,
        reference_point="cc",
    )
    if label.turns:
        text.position = {
            time: (rotation_about_x(np.deg2rad(stop)) @ label.point).astype(np.float32)
            for time, stop in _times(scene)
        }
    return text


def _times(scene: Scene) -> list[tuple[str, float]]:
    """Time and stop [control's unit] of every state of every entry."""
    first = scene.control.stops[0]
    return [
        (repr(_start(scene, number) + stop - first), stop)
        for number in range(len(scene.entries))
        for stop in scene.control.stops
    ]


def _over_time(
    scene: Scene, item: SceneObject, rest: FloatArray, moved: FloatArray, step: float
) -> Any:
    """Points of every state, rounded; the same points where nothing moves."""
    if not moved.any():
        return rest.astype(np.float32)
    stops = (
        scene.control.stops
        if item.follows
        else scene.control.stops[:: len(scene.control.stops) - 1]
    )
    first = scene.control.stops[0]
    return {
        repr(_start(scene, number) + stop - first): _rounded(
            rest + (stop if item.follows else 1.0) * moved[number], step
        )
        for number in range(len(scene.entries))
        for stop in stops
    }


def _colours_over_time(scene: Scene, item: SceneObject) -> dict[str, NDArray[np.float32]]:
    """Share of the limit in every state; in an entry without a legend the surface's own band."""
    assert item.values is not None
    stops = (
        scene.control.stops
        if item.follows
        else scene.control.stops[:: len(scene.control.stops) - 1]
    )
    first = scene.control.stops[0]
    colours = {}
    for number, entry in enumerate(scene.entries):
        for stop in stops:
            share = (stop if item.follows else 1.0) * item.values[number]
            if not entry.legend:
                share = np.full_like(share, _band_middle(item.colour))
            colours[repr(_start(scene, number) + stop - first)] = _rounded(share, 2.0**-9)
    return colours


def _rounded(values: FloatArray, step: float) -> NDArray[np.float32]:
    return np.asarray(np.round(values / step) * step, dtype=np.float32)


def _turned(angle_deg: float) -> NDArray[np.float32]:
    matrix = np.eye(4)
    matrix[:3, :3] = rotation_about_x(np.deg2rad(angle_deg))
    return matrix.astype(np.float32)


def _diverging() -> NDArray[np.float64]:
    """Blue over white to red, shape (n, 3)."""
    import matplotlib

    shades = matplotlib.colormaps["RdBu_r"](np.linspace(0.0, 1.0, _N_SHADES))
    return np.asarray(shades[:, :3])


def _band_middle(colour: str) -> float:
    """Value of a surface's colour in the second half of the colour map."""
    number = SURFACE_COLOURS.index(colour) + 1 if colour in SURFACE_COLOURS else 0
    return 1.0 + _BAND * (number + 0.5)


def _colour_map() -> NDArray[np.float32]:
    """Control points (place, red, green, blue): deflection below one half, surfaces above."""
    rows = [[0.5 * number / (_N_SHADES - 1), *colour] for number, colour in enumerate(_diverging())]
    for number, text in enumerate((UNNAMED_COLOUR, *SURFACE_COLOURS)):
        colour = [int(text[i : i + 2], 16) / 255.0 for i in (1, 3, 5)]
        start = 0.5 + 0.25 * _BAND * number
        rows += [[start + 1e-4, *colour], [start + 0.25 * _BAND - 1e-4, *colour]]
    rows[-1][0] = 1.0
    return np.array(rows, dtype=np.float32)


def _hex(colour: NDArray[np.float64]) -> str:
    return "#" + "".join(f"{round(255 * channel):02x}" for channel in colour)
