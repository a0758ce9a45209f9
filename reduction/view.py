"""Pictures of fixed-interface modes and of stress on a body's surface (pyvista)."""

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.view import add_mode
from carrierflex.geometry.tet_mesh import TetMesh
from carrierflex.geometry.view import LIGHTING, new_plotter, taken, taken_with_pixels
from carrierflex.reduction.fixed_interface_modes import FixedInterfaceModes
from carrierflex.reduction.shapes.body_stresses import BodyStresses


def modes_picture(
    mesh: TetMesh, modes: FixedInterfaceModes, *, rows: int = 2, columns: int = 2
) -> NDArray[np.uint8]:
    """Render the first ``rows × columns`` fixed-interface modes, or as many as there are.

    Coloured by axial displacement over the largest one.
    """
    plotter = new_plotter((rows, columns))
    for number in range(min(rows * columns, len(modes.omega))):
        plotter.subplot(number // columns, number % columns)
        frequency_hz = modes.omega[number] / (2.0 * np.pi)
        shape = modes.Phi[:, number].reshape(-1, 3)
        title = f"mode {number + 1}, {frequency_hz:.0f} Hz"
        add_mode(plotter, mesh, shape, title)
    return taken(plotter)


def surface_picture(
    stresses: BodyStresses,
    values: NDArray[np.float64],
    top: float,
    viewpoint: tuple[float, float, float],
) -> NDArray[np.uint8]:
    """Render a body's surface in colours of a value at its nodes.

    Parameters
    ----------
    stresses : BodyStresses
        The surface.
    values : ndarray, shape (k,)
        Values at its nodes from 0 to `top`; grey where there is none (nan).
    top : float
        Value of the last colour.
    viewpoint : tuple of float
        Direction from the body to the viewer.
    """
    import pyvista

    plotter = new_plotter()
    surface = pyvista.PolyData.from_regular_faces(stresses.points, stresses.triangles)
    surface["values"] = values
    plotter.add_mesh(
        surface,
        scalars="values",
        clim=(0.0, top),
        nan_color="#9a9a9a",
        show_scalar_bar=False,
        **LIGHTING,
    )
    nothing = np.zeros((0, 3))
    picture, _ = taken_with_pixels(
        plotter, nothing, viewpoint=viewpoint, window_centre=(0.0, 0.0), zoom=1.2
    )
    beyond = (picture.shape[1] - picture.shape[0]) // 2
    return picture[:, beyond:-beyond]
