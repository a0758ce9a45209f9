"""The certificate: a sound reduction passes, and each kind of damage makes its own line fail."""

import io
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from numpy.testing import assert_allclose
from rich.console import Console

from carrierflex.reduction.certificate import Certificate, Check, certify, inner_checks
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
from carrierflex.workflows.screen.tables import certificate_table
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
    full = full_free_modes(structure.M, reduction.body, 4, rng=np.random.default_rng(0))
    exact = np.sqrt(
        scipy.linalg.eigh(structure.K.toarray(), structure.M.toarray(), eigvals_only=True)[6:10]
    )
    assert_allclose(
        full.omega, exact, rtol=1e-7
    )  # the dense solver sees rigid modes at rounding of the highest
    model = reduction.model
    errors = frequency_errors(full, reduced_free_modes(model.K, model.M, reduction.basis, 4))
    assert np.all(errors > -1e-9)
    assert errors.max() < 0.05


@pytest.mark.long
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


def test_a_certificate_tells_what_share_of_it_is_done(beam):
    structure, reduction = beam
    shares = []
    certify(structure, reduction, cut_off_hz=100.0, note=lambda text, share: shares.append(share))
    assert shares[0] == 0.0
    assert shares == sorted(shares)
    assert len(set(shares)) == len(shares) > 8
    assert shares[-1] < 1.0


def test_without_free_frequencies_below_the_cut_off_the_first_is_told(beam):
    structure, reduction = beam
    full = full_free_modes(structure.M, reduction.body, 1, rng=np.random.default_rng(1))
    first_hz = full.omega[0] / (2.0 * np.pi)
    first_check = next(
        check
        for check in certify(structure, reduction, cut_off_hz=0.5 * first_hz).checks
        if check.name.startswith("free frequencies: none below the cut-off")
    )
    assert f"{first_hz:.0f} Hz" in first_check.name
    model = reduction.model
    reduced = reduced_free_modes(model.K, model.M, reduction.basis, 1)
    assert first_check.reached == pytest.approx(reduced.omega[0] / full.omega[0] - 1.0, rel=1e-3)
    assert 0.0 < first_check.reached < 0.05


def test_free_frequencies_are_compared_up_to_the_cut_off_however_many(beam, monkeypatch):
    structure, reduction = beam
    full = full_free_modes(structure.M, reduction.body, 8, rng=np.random.default_rng(1))
    monkeypatch.setattr("carrierflex.reduction.certificate._FREE_MODES", 2)
    cut_off_hz = 1.001 * full.omega[4] / (2.0 * np.pi)
    names = [check.name for check in certify(structure, reduction, cut_off_hz=cut_off_hz).checks]
    assert "free frequencies, 5 below the cut-off" in names


def test_the_check_closest_to_its_limit_is_told():
    checks = (
        Check("mass", "< 1e-08", 1e-14, True),
        Check("MAC", "> 0.99", 0.999, True),
        Check("response", "< 0.1", 0.087, True),
        Check("asymmetry", "reported (free mesh)", 50.0, True),
    )
    certificate = Certificate(732.0, checks)
    assert certificate.closest is checks[2]
    assert certificate.closest.share_of_limit == pytest.approx(0.87)
    text = io.StringIO()
    Console(file=text, width=120).print(certificate_table(certificate))
    assert "87%" in next(line for line in text.getvalue().splitlines() if "response" in line)
    assert "closest to its limit: response, 87 % of what is allowed" in text.getvalue()


def test_grounded_stiffness_is_found(flexible_reduction):
    model = flexible_reduction.model
    K = model.K.copy()
    K[0, 0] *= 1.0 + 1e-6
    assert "grounding over own stiffness" in failed(inner_checks(replace(model, K=K), 500.0))


def test_wrong_mass_is_found(flexible_reduction):
    model = flexible_reduction.model
    names = failed(inner_checks(replace(model, M=1.001 * model.M), 500.0))
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
