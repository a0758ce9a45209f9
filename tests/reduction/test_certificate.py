"""The certificate: a sound reduction passes, and each kind of damage makes its own line fail."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from numpy.testing import assert_allclose

from carrierflex.reduction.certificate import certify, inner_checks
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.cyclic_symmetry import asymmetry_ppm
from carrierflex.reduction.dynamic_stiffness import (
    LOSS_FACTOR,
    full_response,
    modes_needed,
    response_error,
)
from carrierflex.reduction.free_modes import frequency_errors, full_free_modes, reduced_free_modes
from carrierflex.reduction.mode_names import mode_names
from tests.reduction.small_bar import bar


def failed(checks):
    return [check.name for check in checks if not check.met]


@pytest.fixture(scope="module")
def beam():
    structure = bar((8, 1, 1))
    return structure, craig_bampton(structure, 10)


def test_response_of_the_full_body_equals_a_direct_solve(beam):
    structure, reduction = beam
    response = full_response(structure, reduction)
    omega = 0.4 * reduction.modes.omega[-1]
    K, M = structure.K.toarray() * (1.0 + 1j * LOSS_FACTOR), structure.M.toarray()
    G = np.concatenate([pilot.G.toarray() for pilot in structure.pilots])
    direct = G @ np.linalg.solve(K - omega**2 * M, G.T)
    H, _ = response.at(omega, len(response.omega), with_rest=True)
    scale = np.sqrt(np.abs(np.outer(direct.diagonal(), direct.diagonal())))
    # Eight terms of a series of ratio 0.16 leave 4e-7 of what the kept modes do not answer.
    assert np.abs(H - direct).max() < 1e-5 * scale.max()


def test_more_modes_lower_the_response_error(beam):
    response = full_response(*beam)
    omega = 0.3 * beam[1].modes.omega[-1]
    errors = [response_error(response, omega, n)[0] for n in (2, 6, 10)]
    assert errors[0] > 3.0 * errors[2]


def test_automatic_mode_count_is_the_smallest_that_serves(beam):
    response = full_response(*beam)
    band_hz = 0.3 * beam[1].modes.omega[-1] / (2.0 * np.pi)
    n = modes_needed(response, band_hz, 0.2)
    assert 0 < n <= 10
    worst = [
        max(
            response_error(response, 2.0 * np.pi * f, k)[0]
            for f in np.linspace(0.05, 1.0, 20) * band_hz
        )
        for k in (n - 1, n)
    ]
    assert worst[1] <= 0.2 < worst[0]
    with pytest.raises(ValueError, match="fixed-interface modes leave an error"):
        modes_needed(response, band_hz, 1e-9)


def test_free_modes_equal_a_dense_solution_and_the_reduced_ones_lie_above(beam):
    structure, reduction = beam
    full = full_free_modes(structure, reduction.body, 4, rng=np.random.default_rng(0))
    exact = np.sqrt(
        scipy.linalg.eigh(structure.K.toarray(), structure.M.toarray(), eigvals_only=True)[6:10]
    )
    assert_allclose(
        full.omega, exact, rtol=1e-7
    )  # the dense solver sees rigid modes at rounding of the highest
    errors = frequency_errors(full, reduced_free_modes(reduction, 4))
    assert np.all(errors > -1e-9)
    assert errors.max() < 0.05


def test_certificate_of_a_sound_carrier_is_met(flexible_structure):
    certificate = certify(flexible_structure, craig_bampton(flexible_structure, 20))
    assert failed(certificate.checks) == []
    assert certificate.met
    names = " ".join(check.name for check in certificate.checks)
    for words in (
        "static compliance at pin_3_downwind",
        "MAC",
        "frequency response at the sensors",
        "asymmetry",
    ):
        assert words in names


def test_grounded_stiffness_is_found(flexible_reduction):
    model = flexible_reduction.model
    K = model.K.copy()
    K[0, 0] *= 1.0 + 1e-6
    assert "grounding over own stiffness" in failed(inner_checks(replace(model, K=K)))


def test_wrong_mass_is_found(flexible_reduction):
    model = flexible_reduction.model
    names = failed(inner_checks(replace(model, M=1.001 * model.M)))
    assert len([name for name in names if name.startswith("mass, centre, inertia")]) == 3


def test_a_body_that_lost_its_symmetry_is_found(flexible_reduction):
    model = flexible_reduction.model
    rows = model.coordinates_of("pin_2_upwind")
    K = model.K.copy()
    K[rows[0], rows[0]] *= 1.0 + 1e-4
    assert asymmetry_ppm(model) < 1e-3
    assert asymmetry_ppm(replace(model, K=K)) == pytest.approx(100.0, rel=0.01)


def test_modes_are_named_by_their_motion_at_the_rim(flexible_reduction):
    names = mode_names(flexible_reduction.model)
    assert len(names) == len(flexible_reduction.modes.omega)
    # The first two are a degenerate pair: a tilting motion, one nodal diameter.
    assert names[0].startswith("rim axial, 1 nodal diameter")
    assert names[0] == names[1]
