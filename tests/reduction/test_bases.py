"""Residual vectors, orthonormal form, effective interface mass, free interface.

And how many modes are enough.
"""

from itertools import pairwise

import h5py
import numpy as np
import pytest
import scipy.linalg
from numpy.testing import assert_allclose

from carrierflex.reduction.body_files import read_body, write_body
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.dynamic_stiffness import full_response, response_error
from carrierflex.reduction.free_interface import free_interface_reduction
from carrierflex.reduction.held_structure import GroundedBody, HeldStructure
from carrierflex.reduction.interface_mass import (
    effective_interface_mass,
    has_fixed_interface_modes,
    rigid_motion_of_interface,
)
from carrierflex.reduction.mode_count import chosen_modes, modes_for_response, response_of_body
from carrierflex.reduction.modes.dense_modes import dense_modes
from carrierflex.reduction.modes.mode_rules import AtLeast
from carrierflex.reduction.orthonormal_form import orthonormal_form
from carrierflex.reduction.reduced_static import pilot_compliance
from carrierflex.reduction.residual_vectors import body_loads
from tests.reduction.small_bar import bar

STRUCTURE = bar((8, 2, 2))
K, M = STRUCTURE.K.toarray(), STRUCTURE.M.toarray()
G = np.concatenate([pilot.G.toarray() for pilot in STRUCTURE.pilots])
N_PILOT = len(G)
EXACT = np.sqrt(np.abs(scipy.linalg.eigh(K, M, eigvals_only=True)))[6:]
PLAIN = craig_bampton(STRUCTURE, 6)
COMPLETED = craig_bampton(STRUCTURE, 6, residual_loads=body_loads(STRUCTURE))


def free_frequencies(model):
    return np.sqrt(np.abs(scipy.linalg.eigh(model.K, model.M, eigvals_only=True)))[6:]


def receptance(model, omega):
    return np.linalg.inv(model.K * (1.0 + 0.04j) - omega**2 * model.M)[:N_PILOT, :N_PILOT]


def static_error(reduction, force):
    """Share of strain energy that the reduced static response to an interior force lacks.

    With the pilots fixed.
    """
    u = HeldStructure(reduction.body, STRUCTURE.pilots).static_response(force[:, None])[:, 0]
    T, k = reduction.basis[:, N_PILOT:], reduction.model.K[N_PILOT:, N_PILOT:]
    lacking = u - T @ np.linalg.solve(k, T.T @ force)
    return float(np.sqrt((lacking @ K @ lacking) / (u @ K @ u)))


def test_free_frequencies_converge_from_above_with_the_mode_count():
    errors = [
        free_frequencies(craig_bampton(STRUCTURE, n).model)[:6] / EXACT[:6] - 1.0
        for n in (2, 6, 12, 24, 36)
    ]
    assert all((error > -1e-9).all() for error in errors)
    for before, after in pairwise(errors):
        assert (after <= before + 1e-9).all()
    assert errors[0].max() > 1e-2
    assert errors[-1].max() < 2e-3
    # The error of the lowest mode falls with a power of the mode count, neither slower nor faster.
    slope = np.log(errors[1][0] / errors[-1][0]) / np.log(36 / 6)
    assert 2.0 < slope < 7.0


@pytest.mark.parametrize("load", range(4), ids=["weight x", "weight y", "weight z", "centrifugal"])
def test_residual_vectors_make_the_static_answer_to_body_loads_exact(load):
    force = body_loads(STRUCTURE)[:, load]
    assert static_error(PLAIN, force) > 1e-2
    assert static_error(COMPLETED, force) < 1e-9


def test_residual_vectors_are_modes_like_the_others():
    model, k = COMPLETED.model, 6
    assert model.labels[N_PILOT + k].startswith("residual vector 1 (")
    assert_allclose(model.M[N_PILOT:, N_PILOT:], np.eye(len(model.M) - N_PILOT), atol=1e-8)
    diagonal = np.diag(model.K[N_PILOT:, N_PILOT:])
    assert_allclose(np.diag(COMPLETED.basis.T @ K @ COMPLETED.basis)[N_PILOT:], diagonal, rtol=1e-8)
    assert np.abs(G @ COMPLETED.residuals.Phi).max() < 1e-9 * np.abs(COMPLETED.residuals.Phi).max()
    assert (free_frequencies(model)[:6] <= free_frequencies(PLAIN.model)[:6] * (1.0 + 1e-9)).all()


def test_loads_that_the_basis_answers_already_add_nothing():
    again = craig_bampton(STRUCTURE, 6, residual_loads=STRUCTURE.M @ PLAIN.modes.Phi[:, :2])
    assert again.residuals.omega.size == 0
    assert again.model.labels == PLAIN.model.labels


def test_loads_at_pilots_need_no_residual_vector():
    """Torque and tilting moment act at pilots: the constraint modes answer them exactly."""
    assert_allclose(
        pilot_compliance(PLAIN.model, ["bar_start"]),
        pilot_compliance(COMPLETED.model, ["bar_start"]),
        rtol=1e-10, atol=1e-20,
    )  # fmt: skip


def test_weight_of_the_reduced_body_is_its_mass_times_rigid_motion():
    """No load vector need be stored: acceleration of the frame acts through the reduced mass."""
    R = rigid_motion_of_interface(PLAIN.model)
    assert_allclose(
        PLAIN.basis.T @ body_loads(STRUCTURE)[:, :3], PLAIN.model.M @ R[:, :3], atol=1e-9
    )


def test_orthonormal_form_is_the_same_body():
    form = orthonormal_form(PLAIN.model)
    assert form.n_rigid == 6
    assert not form.omega[:6].any()
    assert_allclose(form.X.T @ PLAIN.model.M @ form.X, np.eye(len(form.omega)), atol=1e-9)
    assert_allclose(form.omega[6:], free_frequencies(PLAIN.model), rtol=1e-9)
    omega = 0.6 * form.omega[6]
    modal = form.X / (form.omega**2 * (1.0 + 0.04j) - omega**2) @ form.X.T
    assert_allclose(
        modal[:N_PILOT, :N_PILOT],
        receptance(PLAIN.model, omega),
        rtol=1e-6,
        atol=1e-6 * np.abs(modal).max(),
    )


def test_signs_and_bases_of_equal_frequencies_are_not_left_to_rounding(monkeypatch):
    model, rng = PLAIN.model, np.random.default_rng(5)
    squared, X = dense_modes(model.K, model.M)
    form = orthonormal_form(model)

    def otherwise(K, M):
        """Modes as another order of sums might give them: turned among equals, with other signs."""
        turned = X * rng.choice([-1.0, 1.0], X.shape[1])
        turned[:, :6] = X[:, :6] @ np.linalg.qr(rng.standard_normal((6, 6)))[0]
        return squared, turned

    monkeypatch.setattr("carrierflex.reduction.orthonormal_form.dense_modes", otherwise)
    for _ in range(3):
        again = orthonormal_form(model)
        assert_allclose(again.X, form.X, atol=1e-9 * np.abs(form.X).max())
    assert_allclose(again.X.T @ model.M @ again.X, np.eye(X.shape[1]), atol=1e-9)


def test_a_held_body_has_no_orthonormal_form():
    from dataclasses import replace

    grounded = replace(
        PLAIN.model,
        K=PLAIN.model.K + np.diag(np.r_[np.full(6, 1e9), np.zeros(len(PLAIN.model.K) - 6)]),
    )
    with pytest.raises(ValueError, match="0 modes without stiffness; expected 6"):
        orthonormal_form(grounded)


def test_effective_interface_mass_adds_up_to_what_moves_relative_to_the_interface():
    """All fixed-interface modes together.

    The mass of the rigid motion within the fields that leave the pilots at rest.
    """
    null = scipy.linalg.null_space(G)
    K_n, M_n = null.T @ K @ null, null.T @ M @ null
    _, Z = scipy.linalg.eigh(K_n, M_n)
    rigid = PLAIN.basis @ rigid_motion_of_interface(PLAIN.model)
    every = ((null @ Z).T @ M @ rigid) ** 2 / np.diag(rigid.T @ M @ rigid)
    shares = effective_interface_mass(PLAIN.model)
    assert_allclose(shares, every[:6], atol=1e-8)
    projected = np.linalg.solve(M_n, null.T @ M @ rigid)
    inside = np.diag(projected.T @ M_n @ projected) / np.diag(rigid.T @ M @ rigid)
    assert_allclose(every.sum(axis=0), inside, rtol=1e-9)
    assert (shares.sum(axis=0) <= inside + 1e-9).all()
    assert (inside < 1.0).all()


def test_free_interface_basis_has_exact_statics_and_exact_kept_frequencies():
    reduced = free_interface_reduction(STRUCTURE, 6)
    assert reduced.model.labels[:N_PILOT] == PLAIN.model.labels[:N_PILOT]
    reduced_compliance, exact = (
        pilot_compliance(model, ["bar_start"]) for model in (reduced.model, PLAIN.model)
    )
    scale = np.sqrt(np.diag(exact))
    assert_allclose(
        reduced_compliance / np.outer(scale, scale), exact / np.outer(scale, scale), atol=1e-7
    )
    frequencies = free_frequencies(reduced.model)
    assert_allclose(frequencies[:6], EXACT[:6], rtol=1e-8)
    assert (frequencies >= EXACT[: frequencies.size] * (1.0 - 1e-8)).all()
    assert_allclose(G @ reduced.basis, np.eye(N_PILOT, reduced.model.n_coordinates), atol=1e-7)
    # The Craig-Bampton body of as many modes is less exact in them: the price of holding the
    # pilots.
    assert free_frequencies(PLAIN.model)[3] / EXACT[3] - 1.0 > 1e-2


def test_weight_of_a_free_interface_body_is_its_mass_times_rigid_motion_too():
    reduced = free_interface_reduction(STRUCTURE, 6)
    R = rigid_motion_of_interface(reduced.model)
    assert_allclose(
        reduced.basis.T @ body_loads(STRUCTURE)[:, :3], reduced.model.M @ R[:, :3], atol=1e-9
    )
    assert has_fixed_interface_modes(PLAIN.model)
    assert not has_fixed_interface_modes(reduced.model)


def test_fewest_modes_for_a_response_are_enough_and_one_fewer_is_not():
    body = GroundedBody(STRUCTURE.K, STRUCTURE.points)
    band, tolerance = 3000.0, 0.02
    response_of = response_of_body(STRUCTURE, body)
    rule = modes_for_response(response_of, band, tolerance)
    n = rule.n_modes
    response = full_response(STRUCTURE, craig_bampton(STRUCTURE, 24, body=body))
    omegas = 2.0 * np.pi * band * np.linspace(0.05, 1.0, 20)
    assert max(response_error(response, omega, n)[0] for omega in omegas) <= tolerance
    assert max(response_error(response, omega, n - 1)[0] for omega in omegas) > tolerance
    options = {"frf_tolerance": tolerance, "up_to": band}
    assert chosen_modes(response_of, options) == rule
    assert chosen_modes(response_of, {"modes": 3}) == AtLeast(3)
    with pytest.raises(ValueError, match="expected a positive tolerance and a positive frequency"):
        modes_for_response(response_of, band, 0.0)


def test_the_body_file_holds_the_orthonormal_form_and_the_effective_masses(tmp_path):
    path = tmp_path / "bar.h5"
    write_body(COMPLETED.model, path)
    with h5py.File(path) as file:
        assert file["orthonormal_form"].attrs["n_rigid"] == 6
        X, omega = file["orthonormal_form/X"][:], file["orthonormal_form/omega"][:]
        assert_allclose(
            file["effective_interface_mass"][:], effective_interface_mass(COMPLETED.model)
        )
    assert_allclose(X.T @ COMPLETED.model.K @ X, np.diag(omega**2), atol=1e-6 * omega[-1] ** 2)
    assert read_body(path).labels == COMPLETED.model.labels
