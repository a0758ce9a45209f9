"""The group's matrices multiply as its motions do.

They split any coordinates that follow the group completely.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.geometry.dihedral import completed
from carrierflex.geometry.dihedral_group import dihedral_group, pilot_motions
from carrierflex.geometry.tet_mesh import TetMesh


@pytest.fixture(params=(3, 4, 5, 6), ids=lambda n: f"{n} planets")
def group(request):
    """Motions of a carrier of this number of planets, and how fields follow them."""
    return dihedral_group(request.param)


def pilots(group):
    """A point of the axis, and one at every pin."""
    at_pins = [group.motions[2 * k] @ [0.2, 0.0, 0.3] for k in range(group.n_planets)]
    return np.array([[0.1, 0.0, 0.0], *at_pins])


def products(group):
    """Number of the motion that is motion b followed by motion a, for all pairs."""
    motions, n = group.motions, len(group.motions)
    for a in range(n):
        for b in range(n):
            distance = np.abs(motions - motions[a] @ motions[b]).max(axis=(1, 2))
            yield a, b, int(distance.argmin())


def test_matrices_of_a_representation_multiply_as_the_motions_do(group):
    for kind in group.representations:
        for a, b, ab in products(group):
            assert_allclose(kind.matrices[a] @ kind.matrices[b], kind.matrices[ab], atol=1e-14)


def test_representations_are_different_irreducible_and_all_there_are(group):
    characters = np.array(
        [np.trace(kind.matrices, axis1=1, axis2=2) for kind in group.representations]
    )
    order = len(group.motions)
    assert order == 2 * group.n_planets
    assert_allclose(characters @ characters.T / order, np.eye(len(characters)), atol=1e-14)
    assert sum(kind.dimension**2 for kind in group.representations) == order


def test_pilots_follow_the_group(group):
    Q = pilot_motions(group, pilots(group))
    for a, b, ab in products(group):
        assert_allclose(Q[a] @ Q[a].T, np.eye(Q.shape[1]), atol=1e-14)
        assert_allclose(Q[a] @ Q[b], Q[ab], atol=1e-14)


def test_a_rigid_motion_of_the_pilots_turns_as_a_whole(group):
    # Rigid rotation about y, seen from the rotated pilots, is the rigid rotation about the rotated
    # axis.
    points = pilots(group)
    Q, omega = pilot_motions(group, points), np.array([0.0, 1.0, 0.5])
    for rho, Q_g in zip(group.motions, Q, strict=True):
        turned = np.linalg.det(rho) * rho @ omega
        before = np.concatenate([np.concatenate([np.cross(omega, x), omega]) for x in points])
        after = np.concatenate([np.concatenate([np.cross(turned, x), turned]) for x in points])
        assert_allclose(Q_g @ before, after, atol=1e-14)


def test_adapted_coordinates_are_orthonormal_complete_and_turn_as_their_representation_says(group):
    Q = pilot_motions(group, pilots(group))
    columns = []
    for kind in group.representations:
        X = kind.adapted_coordinates(Q)
        columns += list(X)
        for D, Q_g in zip(kind.matrices, Q, strict=True):
            for j in range(kind.dimension):
                assert_allclose(Q_g @ X[j], np.einsum("k,kac->ac", D[:, j], X), atol=1e-13)
    every = np.concatenate(columns, axis=1)
    assert every.shape == Q.shape[1:]
    assert_allclose(every.T @ every, np.eye(len(every)), atol=1e-13)


def test_a_pilot_without_an_image_is_refused():
    group = dihedral_group(3)
    with pytest.raises(
        ValueError,
        match=r"pilot 3 at \[0.2, -0.259808, -0.15\] m has no image at \[0.2, 0.259808, -0.15\] m",
    ):
        pilot_motions(group, pilots(group)[:3])


def test_motions_are_ordered_as_the_half_sectors_images(flexible_half):
    full: TetMesh = completed(flexible_half, 3)
    n = len(flexible_half.tets)
    for number, rho in enumerate(dihedral_group(3).motions):
        corners = full.points[full.tets[number * n : (number + 1) * n, :4]].mean(axis=1)
        expected = flexible_half.points[flexible_half.tets[:, :4]].mean(axis=1) @ rho.T
        assert_allclose(corners, expected, atol=1e-12)
