import numpy as np
from numpy.testing import assert_allclose

from carrierflex.geometry.tet_mesh import boundary_facets
from carrierflex.geometry.view import PICTURE_SIZE, mesh_picture, skin


def test_the_skin_holds_the_boundary_facets_and_their_data(one_pin_mesh):
    surface = skin(one_pin_mesh, subdivision=0, x=one_pin_mesh.points[:, 0])
    assert surface.n_cells == len(boundary_facets(one_pin_mesh.tets))
    assert_allclose(
        surface.point_data["x"], surface.points[:, 0], rtol=0.0, atol=1e-7
    )  # VTK may keep single precision


def test_a_mesh_picture_shows_the_mesh(stiff_mesh):
    picture = mesh_picture(stiff_mesh, "stiff carrier")
    width, height = PICTURE_SIZE
    assert picture.shape == (height, width, 3)
    assert picture.dtype == np.uint8
    # Background is white; the body covers a good part of the picture, in more than one colour.
    drawn = (picture != 255).any(axis=2)
    assert 0.1 < drawn.mean() < 0.9
    assert len(np.unique(picture[drawn], axis=0)) > 100
