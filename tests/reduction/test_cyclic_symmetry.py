"""The reduced carrier inherits the mesh's symmetry.

Its matrices commute with the rotation by 120 deg and the mirror.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.geometry.dihedral import rotation_about_x
from carrierflex.reduction.certificate import FREE_MESH, inner_checks
from carrierflex.reduction.cyclic_symmetry import (
    asymmetry_ppm,
    modal_asymmetry_ppm,
    unlike_response,
)

#: Measured 1e-9 and less; the meshes' symmetry is exact and only the solver's rounding is left.
PPM = 1e-6


def pilot_map(model, images, polar, axial):
    """Matrix that carries each pilot's motion to its image.

    Translations by `polar`, rotations by `axial`.
    """
    n = 6 * len(model.pilots)
    P = np.zeros((n, n))
    for old, new in images.items():
        rows, columns = model.coordinates_of(new), model.coordinates_of(old)
        P[np.ix_(rows[:3], columns[:3])] = polar
        P[np.ix_(rows[3:], columns[3:])] = axial
    return P


def rotation(model):
    R = rotation_about_x(2.0 * math.pi / 3.0)
    turned = {"1": "2", "2": "3", "3": "1"}
    images = {
        name: name if "seat" in name or "shaft" in name else f"pin_{turned[name[4]]}{name[5:]}"
        for name in model.pilots
    }
    return pilot_map(model, images, R, R)


def mirror(model):
    S = np.diag([1.0, -1.0, 1.0])
    swapped = {"1": "1", "2": "3", "3": "2"}
    images = {
        name: name if "seat" in name or "shaft" in name else f"pin_{swapped[name[4]]}{name[5:]}"
        for name in model.pilots
    }
    # A rotation vector is a cross product: it changes sign where a displacement does not.
    return pilot_map(model, images, S, -S)


@pytest.mark.parametrize("symmetry", [rotation, mirror])
def test_stiffness_and_mass_at_the_pilots_commute_with_the_symmetry(flexible_reduction, symmetry):
    model = flexible_reduction.model
    P = symmetry(model)
    m = len(P)
    assert_allclose(P @ P.T, np.eye(m), rtol=0.0, atol=1e-14)
    for matrix in (model.K[:m, :m], model.M[:m, :m]):
        scale = np.sqrt(np.outer(matrix.diagonal(), matrix.diagonal()))
        assert_allclose(P @ matrix @ P.T / scale, matrix / scale, rtol=0.0, atol=PPM)


@pytest.mark.parametrize("symmetry", [rotation, mirror])
def test_the_modes_share_of_the_pilots_inertia_commutes_with_the_symmetry(
    flexible_reduction, symmetry
):
    # Modes of one frequency may turn among themselves; M_bq M_qb does not change with that.
    model = flexible_reduction.model
    P = symmetry(model)
    m = len(P)
    share = model.M[:m, m:] @ model.M[m:, :m]
    scale = np.sqrt(np.outer(model.M.diagonal()[:m], model.M.diagonal()[:m]))
    assert_allclose(P @ share @ P.T / scale, share / scale, rtol=0.0, atol=PPM)


def test_sensors_turn_with_the_carrier(flexible_reduction):
    model = flexible_reduction.model
    P = rotation(model)
    for rows in (model.sensor_rows[:360, : len(P)], model.sensor_rows[360:, : len(P)]):
        # Turning the pilots' motion by 120 deg turns the readings by 120 places.
        assert_allclose(
            rows @ P, np.roll(rows, 120, axis=0), rtol=0.0, atol=1e-9 * np.abs(rows).max()
        )
        assert np.abs(rows @ P - np.roll(rows, -120, axis=0)).max() > 0.01 * np.abs(rows).max()


def lowest(model, n_modes):
    """Body of the first `n_modes` modes, wherever that ends."""
    chosen = slice(0, 6 * len(model.pilots) + n_modes)
    return replace(
        model, K=model.K[chosen, chosen], M=model.M[chosen, chosen], D=model.D[chosen, chosen],
        labels=model.labels[chosen], sensor_rows=model.sensor_rows[:, chosen], ffrf=None,
    )  # fmt: skip


def test_half_a_pair_among_the_modes_is_seen_where_the_static_part_is_not(flexible_reduction):
    full, cut = (lowest(flexible_reduction.model, n) for n in (10, 9))
    cut_off_hz = 0.25 * flexible_reduction.modes.omega[8] / (2.0 * np.pi)
    assert modal_asymmetry_ppm(full) < 1e-3
    assert unlike_response(full, cut_off_hz) < 1e-8
    assert asymmetry_ppm(cut) < 1e-3
    assert modal_asymmetry_ppm(cut) > 100.0
    # Equal pins answer differently, the more the nearer to resonance.
    near, far = (unlike_response(cut, share * cut_off_hz) for share in (1.0, 0.3))
    assert near > 1e-3
    assert far < near
    assert [check.name for check in inner_checks(cut, cut_off_hz) if not check.met] == [
        "asymmetry of the modal part, ppm",
        "unlike response of equal pilots up to the cut-off",
    ]
    free_mesh = replace(cut, provenance=dict([FREE_MESH]))
    assert all(check.met for check in inner_checks(free_mesh, cut_off_hz))


def test_pilots_that_do_not_map_are_not_compared(pin_reduction):
    assert modal_asymmetry_ppm(pin_reduction.model) is None
    assert unlike_response(pin_reduction.model, 1000.0) is None
