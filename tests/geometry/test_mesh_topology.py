"""The meshes are one closed solid with the holes of the drawing.

Nodes of round faces lie on their cylinders.
"""

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose
from scipy.sparse.csgraph import connected_components

from carrierflex.geometry.tet_mesh import TET_EDGES, boundary_facets

#: Genus of each solid, counted on the drawing. A plate without pins has four holes; the webs join
#: two plates once and close two more loops. Bonded pins fill six holes and close three loops more.
GENUS = {"flexible_mesh": 4 + 4 + 2, "stiff_mesh": 1 + 1 + 5, "one_pin_mesh": 0}
VARIANTS = pytest.mark.parametrize("variant", GENUS)


def directed_edges(facets):
    """Corner edges of facets with their mid-side nodes, each in its facet's own direction."""
    return np.concatenate([facets[:, columns] for columns in ([0, 1, 3], [1, 2, 4], [2, 0, 5])])


@VARIANTS
def test_boundary_is_a_closed_oriented_surface(variant, request):
    edges = directed_edges(boundary_facets(request.getfixturevalue(variant).tets))
    forward, backward = edges[np.lexsort(edges.T)], edges[:, [1, 0, 2]]
    backward = backward[np.lexsort(backward.T)]
    # Every edge is met once in each direction, with the same mid-side node: the cut faces fit.
    assert (forward == backward).all()
    assert len(np.unique(edges[:, :2], axis=0)) == len(edges)


@VARIANTS
def test_boundary_has_the_number_of_holes_of_the_drawing(variant, request):
    facets = boundary_facets(request.getfixturevalue(variant).tets)
    n_edges = len(np.unique(np.sort(directed_edges(facets)[:, :2], axis=1), axis=0))
    assert len(np.unique(facets[:, :3])) - n_edges + len(facets) == 2 - 2 * GENUS[variant]


@VARIANTS
def test_every_node_belongs_to_one_connected_solid(variant, request):
    mesh = request.getfixturevalue(variant)
    pairs = np.concatenate([mesh.tets[:, [0, i]] for i in range(1, 10)])
    graph = sp.coo_array((np.ones(len(pairs)), pairs.T), shape=(len(mesh.points),) * 2)
    assert connected_components(graph, directed=False)[0] == 1


@VARIANTS
def test_normals_of_named_surfaces_point_out_of_the_body(variant, request, carrier):
    mesh = request.getfixturevalue(variant)
    for name, facets in mesh.surfaces.items():
        corners = mesh.points[facets[:, :3]]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).sum(axis=0)
        if name in ("shaft_face", "rim_face"):
            assert normal[0] < 0.0  # both look upwind
            continue
        # Away from the surface's own axis on a shaft, towards it in a bore.
        axis = corners.mean(axis=(0, 1)) * (0.0 if "seat" in name else 1.0)
        outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        side = np.einsum("ka,ka->k", outward[:, 1:], (corners.mean(axis=1) - axis)[:, 1:])
        bore = variant != "one_pin_mesh" and name.endswith(("_upwind", "_downwind"))
        assert ((side < 0.0) if bore else (side > 0.0)).all(), name


@pytest.mark.parametrize("variant", ["flexible_mesh", "stiff_mesh"])
def test_mid_side_nodes_of_round_faces_lie_on_their_cylinders(variant, request, carrier):
    points = request.getfixturevalue(variant).points
    facets = boundary_facets(request.getfixturevalue(variant).tets)
    a, clearance = carrier.centre_distance, carrier.planet_clearance_radius
    for radius, offset in (
        (carrier.outer_radius, 0.0),
        (carrier.pin_hole_radius, a),
        (clearance, a),
    ):
        r = np.hypot(points[facets][..., 1], points[facets][..., 2] - offset)
        on = (np.abs(r[:, :3] - radius) < 1e-9).all(axis=1) & (
            np.ptp(points[facets][:, :3, 0], axis=1) > 1e-3
        )
        assert on.sum() >= 8
        assert_allclose(
            r[on], radius, rtol=0.0, atol=1e-9
        )  # gmsh's own tolerance is 1e-8 of the size


def test_mid_side_nodes_of_straight_edges_lie_half_way(one_pin_mesh):
    tets, points = one_pin_mesh.tets, one_pin_mesh.points
    on_skin = np.isin(tets, boundary_facets(tets))
    for number, (i, j) in enumerate(TET_EDGES):
        inside = ~(on_skin[:, i] & on_skin[:, j])
        middles = points[tets[inside, 4 + number]]
        assert_allclose(
            middles, (points[tets[inside, i]] + points[tets[inside, j]]) / 2.0, rtol=0.0, atol=1e-9
        )
