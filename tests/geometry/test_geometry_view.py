import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.geometry.tet_mesh import boundary_facets
from carrierflex.geometry.view import (
    PICTURE_SIZE,
    mesh_picture,
    new_plotter,
    skin,
    surface_patch,
    taken_with_pixels,
)


def test_the_skin_holds_the_boundary_facets_and_their_data(one_pin_mesh):
    surface = skin(one_pin_mesh, subdivision=0, x=one_pin_mesh.points[:, 0])
    assert surface.n_cells == len(boundary_facets(one_pin_mesh.tets))
    assert_allclose(
        surface.point_data["x"], surface.points[:, 0], rtol=0.0, atol=1e-7
    )  # VTK may keep single precision


@pytest.mark.long
def test_a_mesh_picture_shows_the_mesh(stiff_mesh):
    picture = mesh_picture(stiff_mesh, "stiff carrier")
    width, height = PICTURE_SIZE
    assert picture.shape == (height, width, 3)
    assert picture.dtype == np.uint8
    # Background is white; the body covers a good part of the picture, in more than one colour.
    drawn = (picture != 255).any(axis=2)
    assert 0.1 < drawn.mean() < 0.9
    assert len(np.unique(picture[drawn], axis=0)) > 100


def test_points_stand_in_the_picture_where_they_are_drawn():
    positions = np.array([[0.0, 0.3, 0.1], [0.2, -0.4, -0.2], [-0.1, 0.1, 0.4]])
    plotter = new_plotter()
    for position, colour in zip(positions, ("red", "lime", "blue"), strict=True):
        plotter.add_points(
            position[None],
            color=colour,
            point_size=24,
            render_points_as_spheres=True,
            lighting=False,
        )
    image, pixels = taken_with_pixels(plotter, positions, viewpoint=(-1.0, 0.4, 0.3))
    for (column, row), channel in zip(pixels, range(3), strict=True):
        rows, columns = np.nonzero(
            (image[..., channel] > 200) & (np.delete(image, channel, axis=2).max(axis=2) < 80)
        )
        assert_allclose([columns.mean(), rows.mean()], [column, row], atol=1.5)


def test_a_surface_patch_has_the_area_of_its_surface(one_pin_mesh):
    patch = surface_patch(one_pin_mesh.points, one_pin_mesh.surface("pin_1_upwind"))
    # Cylinder of 160 mm diameter over 65 mm; flat triangles cut its corners.
    assert_allclose(patch.area, np.pi * 0.160 * 0.065, rtol=0.02)
