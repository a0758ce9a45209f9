"""Pictures of deformed carriers (pyvista) and of deflection curves (matplotlib)."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.geometry.pins import pin_angles
from carrierflex.geometry.tet_mesh import TetMesh
from carrierflex.geometry.view import (
    LIGHTING,
    add_axes,
    add_labels,
    add_outline,
    add_title,
    add_torque_arrow,
    new_plotter,
    rounded_magnification,
    skin,
    taken,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Largest displacement drawn, as a share of the body's size.
_DRAWN_DEFLECTION = 0.06
_COLOURS = ("#1f5fa8", "#c8501e")
_ORDER_COLOURS = ("#1f5fa8", "#c8501e", "#3a8f4d", "#7a4fa3")
#: Radius of the torque's arrow, as a share of the body's size.
_ARROW = 0.13


def deformed_picture(
    mesh: TetMesh,
    u: NDArray[np.float64],
    title: str,
    *,
    labels: Mapping[str, NDArray[np.float64]] | None = None,
    torque_at: NDArray[np.float64] | None = None,
) -> NDArray[np.uint8]:
    """Render the deformed body, exaggerated, coloured by axial displacement in micrometres.

    With the edges of the body at rest and the directions of the axes.

    Parameters
    ----------
    mesh : TetMesh
        Mesh of n nodes.
    u : ndarray, shape (n, 3)
        Nodal displacement [m].
    title : str
        First line of the picture.
    labels : mapping of str to ndarray, shape (3,), optional
        Points [m] to be marked with their names.
    torque_at : ndarray, shape (3,), optional
        Middle of the face that a positive torque acts on [m]; an arrow shows it.
    """
    plotter = new_plotter()
    factor = rounded_magnification(_drawn_factor(mesh, u))
    limit = float(np.abs(u[:, 0]).max()) * 1e6
    name = f"axial displacement [um], drawn {factor:,.0f} times larger"
    _add_deformed(plotter, mesh, factor * u, u[:, 0] * 1e6, limit, bar=_bar(name))
    add_title(plotter, title)
    add_labels(plotter, labels or {})
    if torque_at is not None:
        add_torque_arrow(plotter, torque_at, _ARROW * float(np.ptp(mesh.points, axis=0).max()))
    return taken(plotter)


def add_mode(plotter: Any, mesh: TetMesh, shape: NDArray[np.float64], title: str) -> None:
    """Add a vibration mode to the plotter's current sub-picture.

    Colours are the axial displacement over the largest displacement of the mode.

    Parameters
    ----------
    plotter : pyvista.Plotter
        The scene.
    mesh : TetMesh
        Mesh of n nodes.
    shape : ndarray, shape (n, 3)
        Nodal displacement, to any scale.
    title : str
        First line of the sub-picture.
    """
    axial = shape[:, 0] / np.linalg.norm(shape, axis=1).max()
    # The title is the bar's key: bars of one title would share one range.
    bar = _bar("axial / largest displacement" + " " * len(plotter.scalar_bars))
    drawn = _drawn_factor(mesh, shape) * shape
    _add_deformed(plotter, mesh, drawn, axial, float(np.abs(axial).max()), bar=bar)
    add_title(plotter, title, font_size=11)


def _drawn_factor(mesh: TetMesh, u: NDArray[np.float64]) -> float:
    """Magnification that shows the largest displacement as a fixed share of the body's size."""
    size = float(np.ptp(mesh.points, axis=0).max())
    return _DRAWN_DEFLECTION * size / float(np.linalg.norm(u, axis=1).max())


def _add_deformed(
    plotter: Any,
    mesh: TetMesh,
    drawn: NDArray[np.float64],
    colours: NDArray[np.float64],
    limit: float,
    *,
    bar: dict[str, Any],
) -> None:
    """Add the body moved by `drawn` [m] in colours from -limit to limit, and its edges at rest."""
    surface = skin(mesh, displacement=drawn, colours=colours)
    surface.points = surface.points + surface.point_data["displacement"]
    plotter.add_mesh(
        surface,
        scalars="colours",
        cmap="RdBu_r",
        clim=(-limit, limit),
        smooth_shading=True,
        split_sharp_edges=True,
        copy_mesh=True,
        scalar_bar_args=bar,
        **LIGHTING,
    )
    add_outline(plotter, mesh)
    add_axes(plotter)


def _bar(title: str) -> dict[str, Any]:
    """Colour bar below a picture."""
    return {
        "title": f"{title}\n",
        "fmt": "%.2f",
        "n_labels": 5,
        "color": "black",
        "vertical": False,
        "position_x": 0.25,
        "position_y": 0.03,
        "width": 0.6,
        "title_font_size": 18,
        "label_font_size": 16,
    }


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


def orders_over_fit_figure(
    curves: Mapping[float, DeflectionCurve],
    free: DeflectionCurve,
    bonded: DeflectionCurve,
    n_planets: int,
) -> "Figure":
    """Draw the orders N, 2 N, 3 N and 4 N of the axial curve over the stiffness of the pin fit.

    Parameters
    ----------
    curves : mapping of float to DeflectionCurve
        Curve of joined carrier and pins by interface stiffness above zero [N m/rad].
    free, bonded : DeflectionCurve
        Curves of the whole models without pins and with bonded pins, drawn at the edges.
    n_planets : int
        Number of planets N.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 4.6), layout="constrained")
    axis = figure.subplots()
    stiffness = np.array(sorted(curves))
    content = np.array([curves[k].axial_order_content() for k in stiffness]) * 1e6
    edges = np.array([stiffness[0] / 10.0, stiffness[-1] * 10.0])
    ends = np.array([free.axial_order_content(), bonded.axial_order_content()]) * 1e6
    for order, colour in zip(n_planets * np.arange(1, 5), _ORDER_COLOURS, strict=True):
        axis.plot(stiffness, content[:, order], color=colour, lw=1.6, label=f"order {order}")
        axis.plot(edges, ends[:, order], "o", color=colour, mfc="white", ms=6, clip_on=False)
    decades = np.arange(np.ceil(np.log10(stiffness[0])), np.log10(stiffness[-1]) + 0.5, 2.0)
    ticks = ["no pins", *(f"1e{decade:.0f}" for decade in decades), "bonded"]
    axis.set(
        xscale="log",
        xlim=edges,
        ylim=(0.0, None),
        xlabel="bending stiffness of each pin interface [N m/rad] (circles: whole models)",
        ylabel="amplitude [µm per kN m]",
    )
    axis.set_xticks([edges[0], *10.0**decades, edges[1]], ticks)
    axis.minorticks_off()
    axis.grid(alpha=0.25)
    axis.legend()
    return figure
