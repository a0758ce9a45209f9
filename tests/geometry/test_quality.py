import math
from dataclasses import replace
from io import StringIO

import numpy as np
import pytest
from numpy.testing import assert_allclose
from rich.console import Console

from carrierflex.geometry.quality import InvertedElementError, check_quality, mesh_quality
from carrierflex.geometry.tet_mesh import TET_EDGES, TetMesh
from carrierflex.workflows.screen.tables import quality_table

EDGE = 0.1


def one_element(corners):
    corners = np.array(corners, dtype=np.float64)
    points = np.concatenate([corners, [(corners[i] + corners[j]) / 2.0 for i, j in TET_EDGES]])
    return TetMesh(points, np.arange(10)[None, :], {}, {"carrier": np.arange(1)})


@pytest.fixture
def regular_tetrahedron():
    h = EDGE / math.sqrt(2.0)
    return one_element([[0, 0, 0], [h, h, 0], [0, h, h], [h, 0, h]])


def test_a_regular_tetrahedron_has_the_best_marks(regular_tetrahedron):
    quality = check_quality(regular_tetrahedron)
    assert (quality.n_nodes, quality.n_tets) == (10, 1)
    assert_allclose(quality.volume, EDGE**3 / (6.0 * math.sqrt(2.0)), rtol=1e-12)  # rounding
    assert_allclose([quality.worst_scaled_jacobian, quality.worst_shape], 1.0, rtol=1e-12)


def test_the_printed_figures_have_words_and_units(regular_tetrahedron):
    screen = Console(width=200, file=StringIO())
    screen.print(quality_table(check_quality(regular_tetrahedron)))
    for words in ("nodes ", "quadratic tetrahedra ", "volume, m^3 ", "1 is regular "):
        assert words in screen.file.getvalue()


def test_a_corner_tetrahedron_has_its_textbook_shape():
    # Three unit edges and three of length sqrt 2 about a right corner: 12 (3/6)^(2/3) / 9 (Liu and
    # Joe 1994).
    quality = mesh_quality(one_element([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]))
    assert_allclose(quality.worst_shape, 12.0 * 0.5 ** (2.0 / 3.0) / 9.0, rtol=1e-12)


def test_volume_of_a_curved_element_grows_as_its_face_bulges(regular_tetrahedron):
    points = regular_tetrahedron.points.copy()
    outward = points[4] - points[:4].mean(axis=0)
    points[4] += 0.01 * outward
    bulged = mesh_quality(replace(regular_tetrahedron, points=points))
    assert bulged.volume > mesh_quality(regular_tetrahedron).volume
    assert 0.8 < bulged.worst_scaled_jacobian < 1.0


def test_an_element_turned_inside_out_is_refused(regular_tetrahedron):
    tets = regular_tetrahedron.tets[:, [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]]
    with pytest.raises(
        InvertedElementError, match=r"1 of 1 elements are inverted, .* choose a smaller mesh size"
    ):
        check_quality(replace(regular_tetrahedron, tets=tets))


def test_an_element_folded_by_one_mid_side_node_is_refused_and_located(regular_tetrahedron):
    points = regular_tetrahedron.points.copy()
    points[4] = points[0]
    with pytest.raises(InvertedElementError, match=r"the worst near \(0\.035, 0\.035, 0\.035\) m"):
        check_quality(replace(regular_tetrahedron, points=points))


def test_project_meshes_have_no_inverted_element(flexible_mesh, stiff_mesh, one_pin_mesh):
    for mesh in (flexible_mesh, stiff_mesh, one_pin_mesh):
        quality = check_quality(mesh)
        assert quality.worst_scaled_jacobian > 0.1
        assert quality.worst_shape > 0.3


WRONG_MESHES = [
    ({"points": np.zeros((10, 2))}, r"mesh points have shape \(10, 2\); expected \(n, 3\)"),
    ({"points": np.full((10, 3), np.nan)}, r"every coordinate finite"),
    (
        {"tets": np.zeros((1, 4), dtype=np.int64)},
        r"tetrahedra have shape \(1, 4\); expected \(m, 10\)",
    ),
    (
        {"tets": np.arange(1, 11)[None, :]},
        r"tetrahedra refer to node 10; expected numbers below 10",
    ),
    (
        {"surfaces": {"rim_face": np.full((1, 6), 77)}},
        r"rim_face refer to node 77; expected numbers below 10",
    ),
]


@pytest.mark.parametrize(("changed", "message"), WRONG_MESHES)
def test_meshes_that_contradict_themselves_are_refused(regular_tetrahedron, changed, message):
    with pytest.raises(ValueError, match=message):
        replace(regular_tetrahedron, **changed)


def test_a_missing_surface_is_named_with_those_there_are(flexible_mesh):
    with pytest.raises(
        KeyError, match=r"no surface 'pin_1_midspan'; it has downwind_seat, pin_1_downwind"
    ):
        flexible_mesh.surface("pin_1_midspan")
