"""What does a body, a curve or a gap look like from all sides? One page that one can turn.

A good answer opens from disk in any browser, without a network, and is sent by mail.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from carrierflex.fe.curve_files import read_curves
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.files.json_files import save_text
from carrierflex.files.whole_files import check_file_writable, refuse_foreign
from carrierflex.geometry.view import rounded_magnification
from carrierflex.workflows.progress import Stages
from carrierflex.workflows.view3d.scene import (
    Control,
    Entry,
    Scene,
    SceneObject,
    band,
    circle,
    directions,
    pin_labels,
    pins,
)
from carrierflex.workflows.view3d.view import scene_page

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
    from carrierflex.workflows.view3d.body_scene import body_scene
    from carrierflex.workflows.view3d.rim_motion_files import read_rim_motion
    from carrierflex.workflows.view3d.rim_scene import rim_scene

    if source.suffix == ".json":
        return rim_scene(read_rim_motion(source))
    if source.suffix == ".csv":
        return _curve_scene(read_curves(source), source.parent.name or source.stem)
    if source.suffix != ".h5":
        raise ValueError(f"{source}: suffix {source.suffix!r}; expected {_EXPECTED}")
    model, shapes = read_body(source), read_shapes(source)
    if shapes is None:
        raise ValueError(
            f"{source}: the body file holds no shapes; expected one of carrierflex reduce --shapes"
        )
    return body_scene(model, shapes)


def _curve_scene(curves: Mapping[str, DeflectionCurve], name: str) -> Scene:
    """Scene of the four curves of a carrier."""
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
