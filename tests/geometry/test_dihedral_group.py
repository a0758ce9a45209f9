"""The group's matrices multiply as its motions do, and split any coordinates that follow it completely."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.geometry.dihedral import completed
from carrierflex.geometry.dihedral_group import IRREDUCIBLE_REPRESENTATIONS, MOTIONS, pilot_motions
from carrierflex.geometry.tet_mesh import TetMesh

KINDS = pytest.mark.parametrize("kind", IRREDUCIBLE_REPRESENTATIONS, ids=lambda kind: kind.name)
POINTS = np.array(
    [[0.1, 0.0, 0.0], [0.2, 0.0, 0.3], *(MOTIONS[2 * k] @ [0.2, 0.0, 0.3] for k in (1, 2))]
)


def product(a, b):
    """Number of the motion that is motion b followed by motion a."""
    return int(np.abs(MOTIONS - MOTIONS[a] @ MOTIONS[b]).max(axis=(1, 2)).argmin())


@KINDS
def test_matrices_of_a_representation_multiply_as_the_motions_do(kind):
    for a in range(6):
        for b in range(6):
            assert_allclose(
                kind.matrices[a] @ kind.matrices[b], kind.matrices[product(a, b)], atol=1e-14
            )


def test_representations_are_different_and_irreducible():
    characters = np.array(
        [np.trace(kind.matrices, axis1=1, axis2=2) for kind in IRREDUCIBLE_REPRESENTATIONS]
    )
    assert_allclose(characters @ characters.T / 6.0, np.eye(3), atol=1e-14)


def test_pilots_follow_the_group():
    Q = pilot_motions(POINTS)
    for a in range(6):
        assert_allclose(Q[a] @ Q[a].T, np.eye(24), atol=1e-14)
        for b in range(6):
            assert_allclose(Q[a] @ Q[b], Q[product(a, b)], atol=1e-14)


def test_a_rigid_motion_of_the_pilots_turns_as_a_whole():
    # Rigid rotation about y, seen from the rotated pilots, is the rigid rotation about the rotated
    # axis.
    Q, omega = pilot_motions(POINTS), np.array([0.0, 1.0, 0.5])
    for rho, Q_g in zip(MOTIONS, Q, strict=True):
        turned = np.linalg.det(rho) * rho @ omega
        before = np.concatenate([np.concatenate([np.cross(omega, x), omega]) for x in POINTS])
        after = np.concatenate([np.concatenate([np.cross(turned, x), turned]) for x in POINTS])
        assert_allclose(Q_g @ before, after, atol=1e-14)


def test_adapted_coordinates_are_orthonormal_complete_and_turn_as_their_representation_says():
    Q = pilot_motions(POINTS)
    columns = []
    for kind in IRREDUCIBLE_REPRESENTATIONS:
        X = kind.adapted_coordinates(Q)
        columns += list(X)
        for D, Q_g in zip(kind.matrices, Q, strict=True):
            for j in range(kind.dimension):
                assert_allclose(Q_g @ X[j], np.einsum("k,kac->ac", D[:, j], X), atol=1e-13)
    every = np.concatenate(columns, axis=1)
    assert every.shape == (24, 24)
    assert_allclose(every.T @ every, np.eye(24), atol=1e-13)


def test_a_pilot_without_an_image_is_refused():
    with pytest.raises(
        ValueError,
        match=r"pilot 3 at \[0.2, -0.259808, -0.15\] m has no image at \[0.2, 0.259808, -0.15\] m",
    ):
        pilot_motions(POINTS[:3])


def test_motions_are_ordered_as_the_half_sectors_images(flexible_half):
    whole: TetMesh = completed(flexible_half)
    n = len(flexible_half.tets)
    for number, rho in enumerate(MOTIONS):
        corners = whole.points[whole.tets[number * n : (number + 1) * n, :4]].mean(axis=1)
        expected = flexible_half.points[flexible_half.tets[:, :4]].mean(axis=1) @ rho.T
        assert_allclose(corners, expected, atol=1e-12)
