"""Shape derivatives of matrices and couplings: motions whose answer is known, and differences."""

import contextlib
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.assembly import MatrixDerivatives, assemble_stiffness_and_mass
from carrierflex.fe.materials import BODY_MATERIALS
from carrierflex.fe.shape_extension import extended_velocity
from carrierflex.fe.surface_integrals import surface_moment_derivatives, surface_moments
from carrierflex.geometry.carrier_mesh import stiff_half_sector
from carrierflex.geometry.parameter_files import StageParameters
from carrierflex.geometry.shape_velocity import (
    BoundaryMotion,
    dimension_value,
    dimensions_of,
    parametric_motion,
    with_step,
)
from carrierflex.geometry.tet_mesh import boundary_facets
from tests.fe.box_meshes import box_mesh

STAGE = StageParameters()


@pytest.fixture(scope="module")
def half():
    return stiff_half_sector(STAGE.carrier, STAGE.pin, 0.1)


@pytest.fixture(scope="module")
def matrices(half):
    return MatrixDerivatives(half, BODY_MATERIALS)


@pytest.fixture(scope="module")
def any_velocity(half):
    return np.random.default_rng(3).standard_normal(half.points.shape)


def relative(difference, size):
    return abs(difference).max() / abs(size).max()


@pytest.mark.long
def test_a_rigid_motion_changes_the_stiffness_as_it_turns_it(half, matrices):
    """K of the turned body is ``R K Rᵀ``: its derivative is ``W K + K Wᵀ``, W the rotation's."""
    K, M = assemble_stiffness_and_mass(half, BODY_MATERIALS)
    axis = np.array([0.3, -0.5, 0.8])
    W = np.cross(np.eye(3), axis)
    V = half.points @ W.T + np.array([0.2, 0.1, -0.4])
    dK, dS = matrices.by_shape(V)
    n = len(half.points)
    u = np.random.default_rng(0).standard_normal((n, 3))
    turned = (K @ u.ravel()).reshape(n, 3) @ W.T + (K @ (u @ W).ravel()).reshape(n, 3)
    assert relative(dK @ u.ravel() - turned.ravel(), turned) < 1e-10
    assert relative(dS, M[::3, ::3]) < 1e-12


@pytest.mark.long
def test_growth_scales_stiffness_with_length_and_mass_with_volume(half, matrices):
    K, M = assemble_stiffness_and_mass(half, BODY_MATERIALS)
    dK, dS = matrices.by_shape(half.points)
    assert relative(dK - K, K) < 1e-12
    assert relative(dS - 3.0 * M[::3, ::3], M) < 1e-12


def test_the_derivative_is_that_of_the_same_mesh_moved(half, matrices, any_velocity):
    """Central differences: their error falls with the square of the step, 1e-6 m here."""
    step = 1e-6
    (Kp, Mp), (Km, Mm) = (
        assemble_stiffness_and_mass(
            replace(half, points=half.points + sign * step * any_velocity), BODY_MATERIALS
        )
        for sign in (1.0, -1.0)
    )
    dK, dS = matrices.by_shape(any_velocity)
    assert relative((Kp - Km) / (2.0 * step) - dK, dK) < 1e-6
    assert relative((Mp - Mm)[::3, ::3] / (2.0 * step) - dS, dS) < 1e-6
    assert abs(dK - dK.T).max() < 1e-15 * abs(dK).max()


@pytest.mark.parametrize("constant", ["E", "nu", "rho"])
def test_constants_of_a_material_meet_differences(half, matrices, constant):
    step = 1e-4 * getattr(BODY_MATERIALS["pins"], constant)
    (Kp, Mp), (Km, Mm) = (
        assemble_stiffness_and_mass(
            half,
            BODY_MATERIALS
            | {
                "pins": replace(
                    BODY_MATERIALS["pins"],
                    **{constant: getattr(BODY_MATERIALS["pins"], constant) + sign * step},
                )
            },
        )
        for sign in (1.0, -1.0)
    )
    dK, dS = matrices.by_material("pins", constant)
    size = max(abs(dK).max(), abs(dS).max())
    assert abs((Kp - Km) / (2.0 * step) - dK).max() < 1e-6 * size
    assert abs((Mp - Mm)[::3, ::3] / (2.0 * step) - dS).max() < 1e-6 * size


def test_moments_of_a_surface_meet_differences(half, any_velocity):
    step, origin, V_origin = 1e-6, np.array([0.1, 0.0, 0.3]), np.array([0.5, -1.0, 2.0])
    facets = half.surface("pin_1_upwind")
    (Bp, Zp), (Bm, Zm) = (
        surface_moments(
            replace(half, points=half.points + sign * step * any_velocity),
            facets,
            origin + sign * step * V_origin,
        )
        for sign in (1.0, -1.0)
    )
    dB, dZ = surface_moment_derivatives(half, facets, origin, (any_velocity, V_origin))
    assert relative((Bp - Bm) / (2.0 * step) - dB, dB) < 1e-6
    assert relative((Zp - Zm) / (2.0 * step) - dZ, dZ) < 1e-6


def test_a_driven_boundary_carries_a_linear_motion_through_the_solid():
    """A uniform strain meets no force inside, so its boundary motion gives it back everywhere."""
    box = box_mesh((1.0, 0.8, 0.6), (3, 3, 3))
    V = box.points @ np.array([[1.0, 0.2, 0.0], [-0.5, 0.3, 0.4], [0.0, 0.1, 0.7]])
    nodes = np.repeat(np.unique(boundary_facets(box.tets)), 3)
    normals = np.tile(np.eye(3), (len(nodes) // 3, 1))
    rates = np.einsum("ma,ma->m", normals, V[nodes])[:, None]
    extended = extended_velocity(box, BoundaryMotion(nodes, normals, rates))
    assert_allclose(extended[0], V, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("dimension", dimensions_of(pins=True))
def test_moved_nodes_lie_on_the_faces_of_the_changed_carrier(half, dimension):
    """A hundred thousandth of the dimension: what curvature adds is far below the 1e-7 m asked."""
    value = dimension_value(STAGE, dimension)
    step = 1e-5 * value
    changed = with_step(STAGE, dimension, step)
    V = extended_velocity(half, parametric_motion(half, STAGE, [dimension]))[0]
    moved = replace(half, points=half.points + step * V)
    # As many nodes on faces, edges and circles as before, and fewer on those of a third carrier.
    n_rows = rows_of_motion(half, STAGE)
    assert rows_of_motion(moved, changed) == n_rows
    assert rows_of_motion(half, with_step(STAGE, dimension, 1e-3 * value)) < n_rows


def rows_of_motion(mesh, stage):
    """Nodes on faces, counted face by face; none where a facet lies on no face."""
    with contextlib.suppress(ValueError):
        return len(parametric_motion(mesh, stage, []).nodes)
    return 0


def test_a_mesh_of_another_carrier_is_refused(half):
    with pytest.raises(ValueError, match="lie on no face of the carrier; expected the mesh of"):
        parametric_motion(half, with_step(STAGE, "carrier.outer_radius", 5e-3), [])
