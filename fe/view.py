"""Pictures of deformed carriers (pyvista) and of deflection curves (matplotlib)."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.geometry.parameters import pin_angles
from carrierflex.geometry.tet_mesh import TetMesh
from carrierflex.geometry.view import LIGHTING, new_plotter, skin, taken

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Largest displacement drawn, as a share of the body's size.
_DRAWN_DEFLECTION = 0.06
_COLOURS = ("#1f5fa8", "#c8501e")


def deformed_picture(mesh: TetMesh, u: NDArray[np.float64], title: str) -> NDArray[np.uint8]:
    """Render the deformed body, exaggerated, coloured by axial displacement in micrometres.

    Parameters
    ----------
    mesh : TetMesh
        Mesh of n nodes.
    u : ndarray, shape (n, 3)
        Nodal displacement [m].
    title : str
        First line of the picture.
    """
    plotter = new_plotter()
    add_deformed(plotter, mesh, u, title)
    return taken(plotter)


def add_deformed(
    plotter: Any, mesh: TetMesh, u: NDArray[np.float64], title: str, *, free_scale: bool = False
) -> None:
    """Add one deformed body to the plotter's current sub-picture.

    With `free_scale` (a vibration mode) the colours run over the mode's own range and there is no
    colour bar.
    """
    factor = _DRAWN_DEFLECTION * float(
        np.ptp(mesh.points, axis=0).max() / np.linalg.norm(u, axis=1).max()
    )
    surface = skin(mesh, displacement=u, axial=u[:, 0] * 1e6)
    surface.points = surface.points + factor * surface.point_data["displacement"]
    limit = float(np.abs(u[:, 0]).max()) * 1e6
    bar = {
        "title": f"axial displacement [um], drawn x {factor:.0f}\n",
        "fmt": "%.2f",
        "n_labels": 5,
        "color": "black",
        "vertical": False,
        "position_x": 0.2,
        "position_y": 0.03,
        "width": 0.6,
        "title_font_size": 18,
        "label_font_size": 16,
    }
    plotter.add_mesh(
        surface,
        scalars="axial",
        cmap="RdBu_r",
        clim=(-limit, limit),
        smooth_shading=True,
        split_sharp_edges=True,
        copy_mesh=True,
        show_scalar_bar=not free_scale,
        scalar_bar_args=None if free_scale else bar,
        **LIGHTING,
    )
    plotter.add_text(title, font_size=11 if free_scale else 13, color="black")


def curves_figure(delta_s: DeflectionCurve, delta_f: DeflectionCurve, n_planets: int) -> "Figure":
    """Draw both axial deflection curves over the carrier-frame angle, their peaks marked.

    It is the 2012 paper's figure 8.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 7.0), layout="constrained")
    axes = figure.subplots(2, 1, sharex=True)
    titles = ("stiff: pins bonded", "flexible: pins absent, simply supported")
    for axis, curve, title, colour in zip(axes, (delta_s, delta_f), titles, _COLOURS, strict=True):
        angle = np.append(np.rad2deg(curve.angle), 360.0)
        axis.plot(angle, np.append(curve.axial, curve.axial[0]) * 1e6, color=colour, lw=1.6)
        peaks = curve.peak_angles()
        axis.plot(
            np.rad2deg(peaks),
            curve.axial_at(peaks) * 1e6,
            "v",
            color="black",
            ms=7,
            label=f"{len(peaks)} peaks",
        )
        for pin in np.append(np.rad2deg(pin_angles(n_planets)), 360.0):
            axis.axvline(pin, color="0.75", lw=0.8, zorder=0)
        axis.set_title(f"{curve.name}, {title}", loc="left")
        axis.set_ylabel("axial deflection\n[µm per kN m]")
        axis.margins(y=0.18)
        axis.legend(loc="upper right", framealpha=1.0)
        axis.grid(alpha=0.25)
    axes[1].set_xlabel("carrier-frame angle from pin 1 [deg] (grey lines: pins)")
    axes[1].set_xticks(range(0, 361, 30))
    axes[1].set_xlim(0, 360)
    return figure


def order_content_figure(
    labels: Sequence[str], curves: Sequence[DeflectionCurve], n_planets: int
) -> "Figure":
    """Draw the orders N, 2 N, 3 N and 4 N of several axial curves as bars [µm per kN m]."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 4.0), layout="constrained")
    axis = figure.subplots()
    orders = n_planets * np.arange(1, 5)
    width = 0.8 / len(curves)
    for number, (label, curve) in enumerate(zip(labels, curves, strict=True)):
        heights = curve.axial_order_content()[orders] * 1e6
        axis.bar(
            np.arange(len(orders)) + (number - (len(curves) - 1) / 2.0) * width,
            heights,
            width,
            label=label,
        )
    axis.set_xticks(np.arange(len(orders)), [str(order) for order in orders])
    axis.set_xlabel("order of carrier rotation")
    axis.set_ylabel("amplitude [µm per kN m]")
    axis.legend()
    return figure
