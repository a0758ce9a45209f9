"""The surface and the fields that a body file keeps are those of the finite elements."""

import h5py
import numpy as np
import pytest

from carrierflex.geometry.tet_mesh import boundary_facets
from carrierflex.reduction.body_files import BodyFileError, read_body, read_shapes, write_body
from carrierflex.reduction.shapes.body_shapes import UNNAMED, BodyShapes, body_shapes


@pytest.fixture(scope="module")
def shapes(flexible_mesh, flexible_structure, flexible_reduction):
    return body_shapes(flexible_mesh, flexible_reduction.basis)


@pytest.fixture
def written(tmp_path, shapes, flexible_reduction):
    path = tmp_path / "carrier.h5"
    write_body(flexible_reduction.model, path, shapes=shapes)
    return path


def test_pilots_that_move_rigidly_move_the_surface_rigidly(shapes, flexible_reduction):
    model = flexible_reduction.model
    shift, turn = np.array([1e-3, -2e-3, 5e-4]), np.array([2e-3, 1e-3, -3e-3])
    q = np.zeros(model.n_coordinates)
    for name, point in model.pilots.items():
        q[model.coordinates_of(name)] = [*(shift + np.cross(turn, point)), *turn]
    np.testing.assert_allclose(
        shapes.displacement(q), shift + np.cross(turn, shapes.points), rtol=0.0, atol=1e-9
    )


def test_a_mode_on_the_surface_is_the_mode_of_the_mesh(shapes, flexible_mesh, flexible_reduction):
    nodes = np.unique(boundary_facets(flexible_mesh.tets)[:, :3])
    mode = flexible_reduction.modes.Phi[:, 2].reshape(-1, 3)[nodes]
    column = flexible_reduction.model.labels.index(
        next(label for label in flexible_reduction.model.labels if label.startswith("mode 3 "))
    )
    np.testing.assert_array_equal(shapes.T[:, :, column], mode)
    np.testing.assert_array_equal(shapes.points, flexible_mesh.points[nodes])


def test_the_triangles_enclose_the_carrier_and_know_their_surfaces(shapes, flexible_mesh):
    a, b, c = np.moveaxis(shapes.points[shapes.triangles], 1, 0)
    corners = flexible_mesh.points[flexible_mesh.tets[:, :4]]
    edges = corners[:, 1:] - corners[:, :1]
    volume = np.linalg.det(edges).sum() / 6.0
    # Divergence theorem: outward normals, no triangle missing or twice.
    enclosed = np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0
    np.testing.assert_allclose(enclosed, volume, rtol=1e-10)
    for number, name in enumerate(shapes.surface_names):
        count = np.count_nonzero(shapes.surface_of == number)
        assert count == len(flexible_mesh.surface(name)), name
    assert (shapes.surface_of == UNNAMED).any()


def test_shapes_come_back_and_the_body_is_read_without_them(written, shapes, flexible_reduction):
    result = read_shapes(written)
    assert result is not None
    assert result.surface_names == shapes.surface_names
    for name in ("points", "triangles", "surface_of"):
        np.testing.assert_array_equal(getattr(result, name), getattr(shapes, name))
    # Single precision.
    np.testing.assert_allclose(result.T, shapes.T, rtol=1e-6, atol=1e-30)
    assert read_body(written).labels == flexible_reduction.model.labels


def test_a_body_without_shapes_has_none(tmp_path, pin_reduction):
    write_body(pin_reduction.model, tmp_path / "pin.h5")
    assert read_shapes(tmp_path / "pin.h5") is None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda group: group.attrs.modify("version", 2), "shapes are of version 2; expected 1"),
        (lambda group: group.__delitem__("T"), "shapes/T is missing"),
        (lambda group: group["triangles"].write_direct(_far(group)), "refers to point 1000000000"),
        (lambda group: group["surface_of"].write_direct(_far_surface(group)), "is of surface 99"),
        (lambda group: group["points"].write_direct(_not_finite(group)), "not finite"),
    ],
)
def test_damaged_shapes_are_refused_by_name(written, change, message):
    with h5py.File(written, "a") as file:
        change(file["shapes"])
    with pytest.raises(BodyFileError, match=message) as refusal:
        read_shapes(written)
    assert str(refusal.value).startswith(f"{written}: ")
    # The body itself is whole.
    read_body(written)


def _far(group):
    return np.full(group["triangles"].shape, 1_000_000_000, dtype=np.int32)


def _far_surface(group):
    return np.full(group["surface_of"].shape, 99, dtype=np.int32)


def _not_finite(group):
    return np.full(group["points"].shape, np.nan)


def test_shapes_that_contradict_one_another_are_refused():
    points, triangles = np.zeros((3, 3)), np.array([[0, 1, 2]])
    with pytest.raises(ValueError, match="expected \\(3, 3, coordinates\\)"):
        BodyShapes(points, triangles, (), np.array([-1]), np.zeros((2, 3, 1)))
    with pytest.raises(ValueError, match="2 triangles have a surface; expected 1"):
        BodyShapes(points, triangles, (), np.array([-1, -1]), np.zeros((3, 3, 1)))
