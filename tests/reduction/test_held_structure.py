"""Constraint modes and static responses against their definition.

And against a direct factorisation of the saddle point.
"""

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg
from numpy.testing import assert_allclose

from carrierflex.fe.factorisation import SingularMatrixError
from carrierflex.fe.surface_integrals import rigid_motion
from carrierflex.reduction.held_structure import (
    GroundedBody,
    HeldStructure,
    statically_determinate_dofs,
)
from tests.reduction.small_bar import bar


@pytest.fixture(scope="module", params=["flexible", "pin"])
def constrained(request):
    """Structure, its held form and its constraint modes with their static stiffness."""
    structure = request.getfixturevalue(f"{request.param}_structure")
    reduction = request.getfixturevalue(f"{request.param}_reduction")
    solver = HeldStructure(reduction.body, structure.pilots)
    return structure, solver, *solver.constraint_modes()


def coupling(structure):
    return sp.csr_array(sp.vstack([pilot.G for pilot in structure.pilots]))


def pilot_rigid_motions(structure):
    """Six rigid motions of the body about the origin, as the pilots' coordinates.

    Rotations are the same everywhere.
    """
    blocks = []
    for pilot in structure.pilots:
        block = np.zeros((6, 6))
        block[:3] = rigid_motion(pilot.point, np.zeros(3))
        block[3:, 3:] = np.eye(3)
        blocks.append(block)
    return np.concatenate(blocks)


def test_constraint_modes_are_the_identity_on_the_interface(constrained):
    structure, _, Psi, _ = constrained
    G = coupling(structure)
    assert_allclose(
        G @ Psi, np.eye(G.shape[0]), rtol=0.0, atol=1e-9
    )  # rounding of the static solution


def test_constraint_modes_reproduce_rigid_body_motion(constrained):
    structure, _, Psi, _ = constrained
    expected = rigid_motion(structure.points, np.zeros(3)).reshape(-1, 6)
    assert_allclose(Psi @ pilot_rigid_motions(structure), expected, rtol=0.0, atol=1e-9)


def test_static_stiffness_is_the_energy_of_the_constraint_modes(constrained):
    structure, _, Psi, K_bb = constrained
    energy = Psi.T @ (structure.K @ Psi)
    scale = np.sqrt(np.outer(K_bb.diagonal(), K_bb.diagonal()))
    assert_allclose(energy / scale, K_bb / scale, rtol=0.0, atol=1e-8)
    assert (K_bb == K_bb.T).all()


def test_static_stiffness_does_not_resist_rigid_motion(constrained):
    structure, _, _, K_bb = constrained
    motion = pilot_rigid_motions(structure)
    # Beside the largest force of its row: many entries are zero by symmetry and hold rounding
    # alone.
    scale = (np.abs(K_bb) @ np.abs(motion)).max(axis=1, keepdims=True)
    assert (np.abs(K_bb @ motion) < 1e-9 * scale).all()


def test_constraint_modes_load_the_body_at_its_pilots_only(constrained):
    # K Psi = G^T K_bb: the forces that make a constraint mode come through the couplings.
    structure, _, Psi, K_bb = constrained
    forces = structure.K @ Psi
    expected = coupling(structure).T @ K_bb
    assert_allclose(forces, expected, rtol=0.0, atol=1e-8 * np.abs(forces).max())


@pytest.mark.parametrize("which", ["bar", "pin"])
def test_solutions_equal_those_of_the_saddle_point_itself(which, pin_structure):
    structure = bar((4, 1, 2)) if which == "bar" else pin_structure
    solver = HeldStructure(GroundedBody(structure.K, structure.points), structure.pilots)
    rng = np.random.default_rng(4)
    G = coupling(structure)
    m, n = G.shape
    f, d = rng.standard_normal((n, 2)), 1e-9 * rng.standard_normal((m, 2))
    # Constraints in the size of the stiffness, or the pivots of the indefinite factorisation
    # suffer.
    s = abs(structure.K).max()
    saddle = sp.block_array([[structure.K, s * G.T], [s * G, None]], format="csc")
    reference = scipy.sparse.linalg.spsolve(saddle, np.concatenate([f, s * d]))
    u, lagrange = solver.solve(f, d)
    # Both solutions carry rounding times the condition of the body.
    assert_allclose(u, reference[:n], rtol=0.0, atol=1e-9 * np.abs(u).max())
    scale = np.abs(lagrange).max(axis=1, keepdims=True)
    assert_allclose(lagrange / scale, s * reference[n:] / scale, rtol=0.0, atol=1e-7)


def test_held_pilots_do_not_move_and_moved_ones_move_as_told(constrained):
    structure, solver, _, _ = constrained
    rng = np.random.default_rng(5)
    G = coupling(structure)
    d = 1e-6 * rng.standard_normal((G.shape[0], 1))
    u, _ = solver.solve(rng.standard_normal((structure.n_dofs, 1)), d)
    assert_allclose(G @ u, d, rtol=0.0, atol=1e-9 * np.abs(d).max() + 1e-10 * np.abs(u).max())


def test_the_holding_forces_are_minus_the_reactions():
    structure = bar()
    solver = HeldStructure(GroundedBody(structure.K, structure.points), structure.pilots[:1])
    load = np.array([3.0, 1.0, -2.0, 0.1, 0.2, 0.3])
    _, lagrange = solver.solve((structure.pilots[1].G.T @ load)[:, None], np.zeros((6, 1)))
    # The bar is 0.3 m long: holding force -F, holding moment -(M + r x F).
    expected = np.concatenate([load[:3], load[3:] + np.cross([0.3, 0.0, 0.0], load[:3])])
    assert_allclose(lagrange[:, 0], expected, rtol=0.0, atol=1e-10)


def test_six_held_freedoms_remove_every_rigid_motion_and_no_more(flexible_structure, pin_structure):
    for points in (flexible_structure.points, pin_structure.points, bar().points):
        dofs = statically_determinate_dofs(points)
        R = rigid_motion(points, points.mean(axis=0)).reshape(-1, 6)[dofs]
        assert len(np.unique(dofs)) == 6
        assert np.linalg.cond(R) < 1e3


def test_a_self_equilibrated_load_leaves_the_ground_without_reaction():
    structure = bar()
    body = GroundedBody(structure.K, structure.points)
    f = (structure.pilots[1].G - structure.pilots[0].G).T @ np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    u = body.displacement(f)
    assert_allclose(structure.K @ u, f, rtol=0.0, atol=1e-10 * np.abs(f).max())


def test_a_body_in_two_pieces_is_refused():
    one, other = bar(), bar(offset=1.0)
    K = sp.csr_array(sp.block_diag([one.K, other.K]))
    body = GroundedBody(K, np.concatenate([one.points, other.points]))
    with pytest.raises(SingularMatrixError, match="without detached bodies"):
        body.displacement(np.zeros(K.shape[0]))
