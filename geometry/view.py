"""Off-screen pictures of meshes and of fields on them (pyvista)."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.tet_mesh import TetMesh, boundary_facets, surface_of_facets

#: Pixels of a picture.
PICTURE_SIZE = (1200, 900)
#: Seen from upwind, above and to the side: the measured rim face is in front.
_CAMERA = (-1.5, 0.85, 0.75)
#: Soft light: colours stay readable on faces turned away from it.
LIGHTING = {"ambient": 0.45, "diffuse": 0.6, "specular": 0.0}
_EDGE_LINES = "#28323c"
#: Height of a row of a legend, as a share of the picture's.
_LEGEND_ROW = 0.03
_REST_LINES = "#6b757f"
#: Colours of named surfaces, told apart by eye on screen and paper.
SURFACE_COLOURS = (
    "#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377", "#ee9955", "#3d6b5c",
    "#99aadd", "#bb7755", "#77aa44", "#884488", "#dd77aa", "#447799", "#aa9944", "#cc5533",
)  # fmt: skip
_BODY_COLOURS = ("#a9b7c6", "#d8a657", "#8fae8b")


def mesh_picture(mesh: TetMesh, title: str) -> NDArray[np.uint8]:
    """Render the mesh's element edges, bodies and named surfaces in different colours.

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)
        The picture; writing it is the caller's business.
    """
    plotter = new_plotter()
    legend = []
    for (name, elements), colour in zip(mesh.bodies.items(), _BODY_COLOURS, strict=False):
        facets = boundary_facets(mesh.tets[elements])
        plain = facets[surface_of_facets(facets, mesh.surfaces) < 0]
        _add_facets(plotter, mesh.points, plain, colour)
        legend.append((name, colour))
    for number, (name, facets) in enumerate(mesh.surfaces.items()):
        colour = SURFACE_COLOURS[number % len(SURFACE_COLOURS)]
        _add_facets(plotter, mesh.points, facets, colour)
        legend.append((name.replace("_", " "), colour))
    add_title(plotter, title)
    add_axes(plotter)
    rows = plotter.add_legend(
        [list(row) for row in legend], bcolor=None, border=False, loc=None, face="rectangle"
    )
    # Placed by hand: pyvista takes the height for the width when it places a legend on the right.
    rows.SetPosition(0.78, 0.04)
    rows.SetPosition2(0.2, _LEGEND_ROW * len(legend))
    return taken(plotter)


def _add_facets(
    plotter: Any, points: NDArray[np.float64], facets: NDArray[np.int64], colour: str
) -> None:
    """Draw the corner triangles of quadratic facets with their edges."""
    import pyvista

    if not len(facets):
        return
    faces = np.concatenate([np.full((len(facets), 1), 3), facets[:, :3]], axis=1)
    plotter.add_mesh(
        pyvista.PolyData(points, faces.ravel()),
        color=colour,
        show_edges=True,
        edge_color=_EDGE_LINES,
        line_width=0.6,
        **LIGHTING,
    )


def add_title(plotter: Any, title: str, *, font_size: int = 13) -> None:
    """Write a title into the upper left corner of the current sub-picture."""
    plotter.add_text(
        title, position=(0.012, 0.94), viewport=True, font_size=font_size, color="black"
    )


def add_axes(plotter: Any) -> None:
    """Draw the directions x, y, z into the lower left corner of the current sub-picture."""
    plotter.add_axes(
        xlabel="x", ylabel="y", zlabel="z", color="black", line_width=3, viewport=(0, 0, 0.2, 0.2)
    )


def add_outline(plotter: Any, mesh: TetMesh) -> None:
    """Draw the edges of the body at rest, where its surface bends, as grey lines."""
    surface = skin(mesh)
    edges = surface.extract_feature_edges(
        30.0, boundary_edges=False, non_manifold_edges=False, manifold_edges=False
    )
    if edges.n_points:
        plotter.add_mesh(edges, color=_REST_LINES, line_width=1.2, lighting=False)


def add_labels(
    plotter: Any, labels: Mapping[str, NDArray[np.float64]], colour: str = "black"
) -> None:
    """Mark points [m] and write their names beside them, in front of all that is drawn."""
    if labels:
        plotter.add_point_labels(
            np.array([*labels.values()]),
            [*labels],
            font_size=15,
            text_color=colour,
            point_color=colour,
            point_size=7,
            render_points_as_spheres=True,
            shape="rounded_rect",
            shape_color="white",
            shape_opacity=0.7,
            margin=2,
            always_visible=True,
        )


def add_torque_arrow(plotter: Any, centre: NDArray[np.float64], radius: float) -> None:
    """Draw the arrow of a positive torque, :func:`torque_arrow`."""
    import pyvista

    points, triangles = torque_arrow(centre, radius)
    faces = np.concatenate([np.full((len(triangles), 1), 3), triangles], axis=1)
    plotter.add_mesh(pyvista.PolyData(points, faces.ravel()), color="#222222", **LIGHTING)


def new_plotter(shape: tuple[int, int] = (1, 1)) -> Any:
    """Off-screen plotter with the project's background; shape is the grid of sub-pictures."""
    import pyvista
    import vtk

    # Without a display VTK warns about the missing X server before it falls back to an off-screen
    # context.
    vtk.vtkObject.GlobalWarningDisplayOff()
    return pyvista.Plotter(
        off_screen=True, window_size=list(PICTURE_SIZE), shape=shape, border=False
    )


def taken(plotter: Any) -> NDArray[np.uint8]:
    """Picture of the plotter's scene, all sub-pictures from the project's viewpoint.

    Closes the plotter.
    """
    image, _ = taken_with_pixels(plotter, np.zeros((0, 3)))
    return image


def taken_with_pixels(
    plotter: Any,
    points: NDArray[np.float64],
    *,
    viewpoint: Sequence[float] = _CAMERA,
    window_centre: tuple[float, float] = (0.0, -0.12),
    zoom: float = 1.0,
) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """Picture of the plotter's scene, and where points of the last sub-picture stand in it.

    Closes the plotter.

    Parameters
    ----------
    plotter : pyvista.Plotter
        The scene.
    points : ndarray, shape (n, 3)
        Points [m].
    viewpoint : sequence of float, length 3
        Direction from the scene to the viewer; z is up.
    window_centre : tuple of float
        Shift of the scene in the window, in half windows; the default leaves room below the body
        for a colour bar.
    zoom : float
        Size in the picture over that which fits.

    Returns
    -------
    image : ndarray of uint8, shape (height, width, 3)
        The picture.
    pixels : ndarray, shape (n, 2)
        Column and row of every point.
    """
    rows, columns = plotter.shape
    for row in range(rows):
        for column in range(columns):
            plotter.subplot(row, column)
            plotter.background_color = "white"
            plotter.view_vector(viewpoint, viewup=(0.0, 0.0, 1.0))
            plotter.camera.zoom(zoom)
            plotter.camera.SetWindowCenter(*window_centre)
    image = np.asarray(plotter.screenshot(return_img=True), dtype=np.uint8)
    pixels = np.array([_pixel(plotter.renderer, point) for point in points]).reshape(-1, 2)
    plotter.close()
    return image, np.column_stack([pixels[:, 0], image.shape[0] - 1.0 - pixels[:, 1]])


def _pixel(renderer: Any, point: NDArray[np.float64]) -> tuple[float, float]:
    """Column and row, counted from the bottom, of a point [m]."""
    renderer.SetWorldPoint(*point, 1.0)
    renderer.WorldToDisplay()
    column, row, _ = renderer.GetDisplayPoint()
    return column, row


def surface_patch(points: NDArray[np.float64], facets: NDArray[np.int64]) -> Any:
    """Quadratic triangles of a named surface, shape (k, 6), as a pyvista surface."""
    import pyvista

    corners, middles = facets[:, :3].T, facets[:, 3:].T
    triangles = np.concatenate(
        [
            np.stack([corners[0], middles[0], middles[2]], axis=1),
            np.stack([corners[1], middles[1], middles[0]], axis=1),
            np.stack([corners[2], middles[2], middles[1]], axis=1),
            np.stack([middles[0], middles[1], middles[2]], axis=1),
        ]
    )
    faces = np.concatenate([np.full((len(triangles), 1), 3), triangles], axis=1)
    return pyvista.PolyData(points, faces.ravel())


def skin(
    mesh: TetMesh,
    elements: NDArray[np.int64] | None = None,
    *,
    subdivision: int = 1,
    **point_data: NDArray[np.float64],
) -> Any:
    """Boundary of `elements` (all by default) as a pyvista surface.

    It carries `point_data`, arrays over the nodes.

    Curved faces are drawn by `subdivision` levels of flat triangles; 0 draws the corner triangles
    alone.
    """
    import pyvista

    tets = mesh.tets if elements is None else mesh.tets[elements]
    cells = np.concatenate([np.full((len(tets), 1), 10), tets], axis=1)
    grid = pyvista.UnstructuredGrid(
        cells.ravel(), np.full(len(tets), pyvista.CellType.QUADRATIC_TETRA), mesh.points
    )
    for name, values in point_data.items():
        grid.point_data[name] = values
    return grid.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=subdivision)


def rounded_magnification(wanted: float) -> float:
    """Magnification of one digit, at most the wanted one: 1, 2 or 5 times a power of ten.

    >>> rounded_magnification(734.0)
    500.0
    """
    decade = 10.0 ** np.floor(np.log10(wanted))
    steps = [step for step in (1.0, 2.0, 5.0) if step * decade <= wanted * (1.0 + 1e-12)]
    return float(steps[-1] * decade)


def torque_arrow(
    centre: NDArray[np.float64], radius: float
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Bent arrow around the axis, right-handed about +x, upwind of a point.

    Parameters
    ----------
    centre : ndarray, shape (3,)
        Point on the axis [m].
    radius : float
        Radius of the arc [m].

    Returns
    -------
    points : ndarray, shape (n, 3)
        Surface points [m].
    triangles : ndarray of int, shape (k, 3)
        Triangles, normals pointing out.
    """
    head = 0.4
    angle = np.concatenate([np.linspace(-2.2, 2.2 - head, 40), [2.2 - head, 2.2]])
    thickness = radius * np.concatenate([[0.0], np.full(39, 0.05), [0.14, 0.0]])
    around = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    out = np.stack([0.0 * angle, -np.sin(angle), np.cos(angle)], axis=1)
    section = thickness[:, None, None] * (
        np.cos(around)[None, :, None] * out[:, None]
        + np.sin(around)[None, :, None] * np.array([1.0, 0.0, 0.0])
    )
    arc = centre + radius * out - np.array([0.35 * radius, 0.0, 0.0])
    points = (arc[:, None] + section).reshape(-1, 3)
    ring, position = np.divmod(np.arange((len(angle) - 1) * around.size), around.size)
    corner = around.size * ring + position
    neighbour = around.size * ring + (position + 1) % around.size
    first = np.stack([corner, corner + around.size, neighbour], axis=1)
    second = np.stack([neighbour, corner + around.size, neighbour + around.size], axis=1)
    return points, np.concatenate([first, second])
