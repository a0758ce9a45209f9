"""Figures of the simulation. Matplotlib is imported late."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.stage.tooth_contact import MeshContact

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh
    from matplotlib.figure import Figure


def mesh_contact_figure(
    contacts: Mapping[str, MeshContact],
    misalignment: NDArray[np.float64],
    pressure_ratio: Mapping[str, NDArray[np.float64]],
) -> "Figure":
    """Contact pressure over face width and mesh position, and its increase with the misalignment.

    Parameters
    ----------
    contacts : mapping of str to MeshContact
        Contact by title; one panel each, two rows.
    misalignment : ndarray, shape (n,)
        Slope of the gap over the face width [rad].
    pressure_ratio : mapping of str to ndarray, shape (n,)
        Largest pressure over that of the aligned mesh, by mesh.

    Returns
    -------
    Figure
        Maps on the left, increase on the right.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 6.0), layout="constrained")
    grid = figure.add_gridspec(2, 3, width_ratios=(1.0, 1.0, 1.2))
    top = max(contact.largest_pressure for contact in contacts.values()) / 1e6
    for k, (title, contact) in enumerate(contacts.items()):
        axes = figure.add_subplot(grid[k // 2, k % 2])
        image = _draw_pressure(axes, title, contact, top)
    figure.colorbar(image, ax=figure.axes, label="largest Hertz pressure, MPa", location="left")
    increase = figure.add_subplot(grid[:, 2])
    for name, ratio in pressure_ratio.items():
        increase.plot(misalignment * 1e6, (ratio - 1.0) * 100.0, label=f"planet and {name}")
    increase.axhline(1.5, color="0.5", linestyle="--", label="2012 paper, sun: 1.5 %")
    increase.set(
        xlabel="misalignment of the mesh, urad", ylabel="increase of the largest pressure, %"
    )
    increase.legend()
    increase.grid(alpha=0.3)
    return figure


def stage_contact_figure(contacts: Mapping[str, MeshContact]) -> "Figure":
    """Contact pressure over face width and mesh position, half of the contacts in each row.

    Parameters
    ----------
    contacts : mapping of str to MeshContact
        Contact by title; an even number.

    Returns
    -------
    Figure
        One map a contact, on one scale of pressure.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13.0, 7.0), layout="constrained")
    panels = figure.subplots(2, len(contacts) // 2, sharex=True, sharey=True)
    top = max(contact.largest_pressure for contact in contacts.values()) / 1e6
    for axes, (title, contact) in zip(panels.flat, contacts.items(), strict=True):
        largest = contact.largest_pressure / 1e6
        image = _draw_pressure(axes, f"{title}; {largest:.0f} MPa", contact, top)
        axes.title.set_fontsize("small")
    figure.colorbar(image, ax=figure.axes, label="largest Hertz pressure, MPa")
    return figure


def _draw_pressure(axes: "Axes", title: str, contact: MeshContact, top: float) -> "QuadMesh":
    """Map of the largest pressure [MPa] of the lines that cross a slice: what the flank sees."""
    image = axes.pcolormesh(
        contact.face_position * 1e3,
        contact.phase,
        contact.pressure.max(axis=1) / 1e6,
        vmin=0.0,
        vmax=top,
        cmap="viridis",
    )
    axes.set(title=title, xlabel="face width, mm", ylabel="mesh position, base pitches")
    return image
