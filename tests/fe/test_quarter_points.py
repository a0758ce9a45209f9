"""Mid-side nodes drawn towards a re-entrant edge: a bracket of two legs, bent at its corner."""

import gmsh
import numpy as np
from numpy.testing import assert_allclose

from carrierflex.fe.assembly import assemble_stiffness_and_mass
from carrierflex.fe.materials import BODY_MATERIALS
from carrierflex.fe.node_dofs import dofs_of
from carrierflex.fe.static import held_displacement
from carrierflex.geometry.cad_recognition.inner_edges import grade_towards, reentrant_edges
from carrierflex.geometry.cad_recognition.quarter_points import draw_towards
from carrierflex.geometry.half_sector import extracted, quiet_geometry

LEAST = 0.1
LEG, THICK, WIDE = 0.2, 0.1, 0.05


def bracket(size, *, finer=1.0, drawn=False):
    """Mesh of the bracket, least minSJ, and the number of nodes that were drawn."""
    with quiet_geometry():
        block = gmsh.model.occ.addBox(0.0, 0.0, 0.0, LEG, LEG, WIDE)
        notch = gmsh.model.occ.addBox(THICK, THICK, 0.0, LEG, LEG, WIDE)
        gmsh.model.occ.cut([(3, block)], [(3, notch)])
        gmsh.model.occ.synchronize()
        for option in ("Mesh.MeshSizeMin", "Mesh.MeshSizeMax"):
            gmsh.option.setNumber(option, size)
        edges = reentrant_edges()
        grade_towards(edges, size, size / finer, THICK)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2)
        n_drawn = draw_towards(edges, LEAST) if drawn else 0
        tags = gmsh.model.mesh.getElementsByType(11)[0]
        least = float(np.min(gmsh.model.mesh.getElementQualities(tags, "minSJ")))
        return extracted(lambda _: "carrier"), least, n_drawn


def compliance(mesh):
    """Work of the weight across one leg on the displacement that it makes, the other leg held."""
    K, M = assemble_stiffness_and_mass(mesh, BODY_MATERIALS)
    weight = (M @ np.tile([0.0, 9.81, 0.0], len(mesh.points)))[:, None]
    fixed = dofs_of(np.flatnonzero(mesh.points[:, 1] > LEG - 1e-9)).ravel()
    return float((weight.T @ held_displacement(K, fixed, weight))[0, 0])


def test_drawn_nodes_halve_the_error_of_a_singular_stress_at_the_same_unknowns():
    fine = compliance(bracket(0.025, finer=6.0, drawn=True)[0])
    plain, drawn = (compliance(bracket(0.035, drawn=each)[0]) for each in (False, True))
    # Of the exact work the energy of every finite element solution is the lower bound.
    assert plain < drawn < fine
    assert fine - drawn < 0.5 * (fine - plain)


def test_only_mid_side_nodes_at_the_edge_move_and_no_element_is_distorted():
    (plain, _, _), (drawn, least, n_drawn) = bracket(0.05), bracket(0.05, drawn=True)
    moved = np.flatnonzero((plain.points != drawn.points).any(axis=1))
    assert len(moved) == n_drawn > 10
    assert least > LEAST
    assert not np.isin(moved, plain.tets[:, :4]).any()
    from_edge = [np.hypot(*(mesh.points[moved, :2] - THICK).T) for mesh in (plain, drawn)]
    assert (from_edge[1] < from_edge[0]).all()
    masses = [assemble_stiffness_and_mass(mesh, BODY_MATERIALS)[1].sum() for mesh in (plain, drawn)]
    # The rule of the mass is exact for the cubic Jacobian determinants of such elements.
    assert_allclose(masses[1], masses[0], rtol=1e-12)


def test_nodes_that_would_distort_an_element_stay_nearer_the_middle(monkeypatch):
    reach = {}
    for least in (0.05, 0.1, 0.3):
        monkeypatch.setattr("tests.fe.test_quarter_points.LEAST", least)
        mesh, quality, _ = bracket(0.05, drawn=True)
        assert quality > least
        reach[least] = compliance(mesh)
    assert reach[0.05] > reach[0.1] > reach[0.3]


def test_without_such_edges_nothing_moves():
    assert draw_towards([], LEAST) == 0
