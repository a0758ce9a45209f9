"""The solution by two levels against that of a factorisation, and what the meshes cost."""

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose

from carrierflex.fe import two_level_solution as module
from carrierflex.fe.assembly import assemble_stiffness
from carrierflex.fe.factorisation import factorise
from carrierflex.fe.materials import BODY_MATERIALS
from carrierflex.fe.node_dofs import dofs_of
from carrierflex.fe.static import AccuracyError
from carrierflex.fe.two_level_solution import linear_part, two_level_solution
from carrierflex.geometry.carrier_mesh import flexible_half_sector


def held_problem(half):
    """K of a half sector held at its shaft face, its linear part, and forces at random."""
    fixed = dofs_of(np.unique(half.surface("shaft_face"))).ravel()
    free = np.setdiff1d(np.arange(half.points.size), fixed)
    K = sp.csr_array(assemble_stiffness(half, BODY_MATERIALS)[free][:, free])
    P = sp.csc_array(linear_part(half)[free][:, free])
    b = np.random.default_rng(5).standard_normal(len(free))
    return K, sp.csr_array(P[:, np.diff(P.indptr) > 0]), b


def test_the_solution_is_that_of_a_factorisation(stiff_half):
    K, P, b = held_problem(stiff_half)
    expected = factorise(K).solve(b)
    # The iteration ends at 1e-12 of the load.
    assert_allclose(
        two_level_solution(K, P, b), expected, rtol=0.0, atol=1e-10 * np.abs(expected).max()
    )


def test_linear_fields_are_their_own_linear_part_where_the_edges_are_straight(flexible_half):
    tets, points = flexible_half.tets, flexible_half.points
    ends = points[tets[:, [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]]]
    bent = np.linalg.norm(points[tets[:, 4:]] - ends.mean(axis=2), axis=2) > 1e-12
    straight = np.setdiff1d(np.arange(len(points)), tets[:, 4:][bent])
    gradient = np.random.default_rng(6).standard_normal((3, 3))
    u = points @ gradient + 1.0
    again = (linear_part(flexible_half) @ u.ravel()).reshape(-1, 3)
    assert 0.5 * len(points) < len(straight) < len(points)
    assert_allclose(again[straight], u[straight], rtol=0.0, atol=1e-12)


def test_the_number_of_steps_does_not_grow_with_the_mesh(carrier, monkeypatch):
    # Fine meshes take 33 or 34; one level alone takes as many more as the elements are smaller.
    monkeypatch.setattr(module, "_MOST_STEPS", 40)
    for size in (0.06, 0.03):
        two_level_solution(*held_problem(flexible_half_sector(carrier, size)))


def test_an_iteration_that_does_not_end_is_refused(flexible_half, monkeypatch):
    monkeypatch.setattr(module, "_MOST_STEPS", 3)
    with pytest.raises(AccuracyError, match="after 3 steps; expected fewer"):
        two_level_solution(*held_problem(flexible_half))
