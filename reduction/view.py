"""Pictures of fixed-interface modes (pyvista)."""

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.view import add_mode
from carrierflex.geometry.tet_mesh import TetMesh
from carrierflex.geometry.view import new_plotter, taken
from carrierflex.reduction.fixed_interface_modes import FixedInterfaceModes


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
