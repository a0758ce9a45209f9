"""The reduction from the half sector against the reduction of the whole body.

Equal, whatever the path.
"""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.half_sector_sensors import half_sector_sensors
from carrierflex.fe.structural_model import (
    carrier_pilot_points,
    flexible_carrier_pilots,
    stiff_carrier_pilots,
)
from carrierflex.fe.symmetry_blocks import half_sector, symmetry_block
from carrierflex.geometry.dihedral_group import dihedral_group
from carrierflex.reduction.certificate import (
    certify,
    compliance_errors,
    compliance_errors_by_fields,
    inner_checks,
)
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.symmetric_certificate import certify_by_blocks
from carrierflex.reduction.symmetric_craig_bampton import symmetric_craig_bampton

#: Wanted of the two paths; they reach 1e-12, the rounding of two different factorisations.
AGREEMENT = 1e-8
N_MODES = 12

pytestmark = pytest.mark.long


@pytest.fixture(scope="module", params=["flexible", "stiff"])
def paths(request, carrier):
    """Whole body, its reduction, the half sector and the reduction made from it."""
    mesh = request.getfixturevalue(f"{request.param}_half")
    structure = request.getfixturevalue(f"{request.param}_structure")
    names = flexible_carrier_pilots(3) if request.param == "flexible" else stiff_carrier_pilots(3)
    points = carrier_pilot_points(carrier)
    pilots = {name: points[name] for name in names}
    half = half_sector(structure.name, mesh, pilots, dihedral_group(3))
    sensors = half_sector_sensors(mesh, carrier.sensor_radius, 3)
    symmetric = symmetric_craig_bampton(half, N_MODES, sensors=sensors)
    return structure, craig_bampton(structure, N_MODES), half, symmetric


def assert_equal_matrices(actual, expected):
    scale = np.sqrt(np.outer(expected.diagonal(), expected.diagonal()))
    assert_allclose(actual / scale, expected / scale, rtol=0.0, atol=AGREEMENT)


def test_static_stiffness_and_mass_of_the_pilots_agree(paths):
    _, full, _, symmetric = paths
    m = full.Psi.shape[1]
    for letter in "KM":
        result, expected = getattr(symmetric.model, letter), getattr(full.model, letter)
        assert_equal_matrices(result[:m, :m], expected[:m, :m])
        assert (result == result.T).all()
    assert not symmetric.model.K[:m, m:].any()


def test_frequencies_labels_and_damping_agree(paths):
    _, full, _, symmetric = paths
    m = full.Psi.shape[1]
    assert_allclose(symmetric.model.K.diagonal()[m:], full.modes.omega**2, rtol=AGREEMENT)
    assert_allclose(symmetric.model.D, full.model.D, rtol=AGREEMENT)
    assert symmetric.model.labels == full.model.labels
    assert_allclose(symmetric.model.M[m:, m:], np.eye(N_MODES), rtol=0.0, atol=AGREEMENT)


def test_modes_of_one_frequency_span_the_same_space(paths):
    structure, full, _, symmetric = paths
    m = full.Psi.shape[1]
    Phi = symmetric.basis.whole_body(structure.points)[:, m:]
    products = full.modes.Phi.T @ (structure.M @ Phi)
    omega, complete = full.modes.omega, symmetric.basis.omega
    same = np.abs(omega[:, None] / complete[None, :] - 1.0) < 1e-6
    assert same.sum() > len(omega)  # pairs there are
    assert_allclose(
        np.where(same, products, 0.0) @ products.T, np.eye(N_MODES), rtol=0.0, atol=AGREEMENT
    )
    assert_allclose(np.where(same, 0.0, products), 0.0, atol=AGREEMENT)


def test_constraint_modes_agree_on_the_whole_body(paths):
    structure, full, _, symmetric = paths
    Psi = symmetric.basis.whole_body(structure.points)[:, : full.Psi.shape[1]]
    # One column a pilot motion: metres per metre and metres per radian have scales of their own.
    assert_allclose(
        Psi / np.abs(Psi).max(axis=0), full.Psi / np.abs(Psi).max(axis=0), rtol=0.0, atol=AGREEMENT
    )


def test_compliance_errors_by_fields_are_those_of_the_factorised_body(paths):
    structure, full, _, symmetric = paths
    m = full.Psi.shape[1]
    Psi = symmetric.basis.whole_body(structure.points)[:, :m]
    errors = compliance_errors_by_fields(structure, symmetric.model, Psi)
    assert errors.keys() == compliance_errors(structure, full).keys()
    # Rounding of the products with K.
    assert max(errors.values()) < 1e-10
    # A body 0.1 % too stiff at its pilots is an error of that size.
    stiffer = replace(full, model=replace(full.model, K=1.001 * full.model.K))
    expected = compliance_errors(structure, stiffer)
    result = compliance_errors_by_fields(structure, stiffer.model, full.Psi)
    assert_allclose([result[name] for name in expected], list(expected.values()), rtol=3e-3)
    # Fields that are 0.1 % too large are an error of the square of that.
    larger = compliance_errors_by_fields(structure, full.model, 1.001 * full.Psi)
    assert_allclose(list(larger.values()), 1e-6, rtol=1e-3)
    # Fields that do not balance between the pilots are an error too.
    wrong = full.Psi.copy()
    coupled = np.unique(np.concatenate([pilot.G.indices for pilot in structure.pilots]))
    free = np.setdiff1d(np.arange(structure.n_dofs), coupled)
    wrong[free] *= 1.0 - 1e-3
    assert max(compliance_errors_by_fields(structure, full.model, wrong).values()) > 1e-9


def frequency_response(model, omega):
    """Motion of pilots and sensors per unit load at the pilots.

    In units of each coordinate's stiffness.
    """
    m = 6 * len(model.pilots)
    scale = 1.0 / np.sqrt(model.K.diagonal()[:m])
    H = np.linalg.inv(model.K + 1j * omega * model.D - omega**2 * model.M)[:, :m]
    return H[:m] / np.outer(scale, scale), model.sensor_rows @ H / scale


def test_frequency_response_at_pilots_and_sensors_agrees(paths):
    _, full, _, symmetric = paths
    for share in (0.03, 0.4, 0.97):
        omega = share * full.modes.omega[-1]
        for result, expected in zip(
            *(frequency_response(path.model, omega) for path in (symmetric, full)), strict=True
        ):
            assert_allclose(result, expected, rtol=0.0, atol=AGREEMENT * np.abs(expected).max())


def test_sensor_rows_of_the_constraint_modes_agree(paths):
    _, full, _, symmetric = paths
    m = full.Psi.shape[1]
    expected = full.model.sensor_rows[:, :m]
    assert symmetric.model.sensor_names == full.model.sensor_names
    assert_allclose(
        symmetric.model.sensor_rows[:, :m],
        expected,
        rtol=0.0,
        atol=AGREEMENT * np.abs(expected).max(),
    )


def test_mass_properties_and_inertia_invariants_agree(paths):
    _, full, _, symmetric = paths
    m = full.Psi.shape[1]
    result, expected = symmetric.model.mass_properties, full.model.mass_properties
    assert_allclose(result.mass, expected.mass, rtol=AGREEMENT)
    assert_allclose(result.centre, expected.centre, rtol=0.0, atol=AGREEMENT)
    assert_allclose(
        result.inertia, expected.inertia, rtol=0.0, atol=AGREEMENT * expected.inertia.max()
    )
    for name in ("first_moment", "second_moment", "N", "P"):
        a, b = (getattr(reduction.model.ffrf, name)[..., :m] for reduction in (symmetric, full))
        assert_allclose(a, b, rtol=0.0, atol=AGREEMENT * np.abs(b).max(), err_msg=name)
    a, b = (reduction.model.ffrf.Q[:, :m, :m] for reduction in (symmetric, full))
    assert_allclose(a, b, rtol=0.0, atol=AGREEMENT * np.abs(b).max())


def test_the_reduced_body_passes_the_checks_of_its_own_matrices(paths):
    checks = inner_checks(paths[3].model, 500.0)
    assert any("120" in check.name for check in checks)
    assert all(check.met for check in checks), checks


def test_blocks_hold_a_sixth_a_sixth_and_a_third_of_the_unknowns(paths):
    structure, _, half, _ = paths
    sizes = [symmetry_block(half, kind).K.shape[0] for kind in half.group.representations]
    assert sizes[0] + sizes[1] + 2 * sizes[2] == structure.n_dofs


def test_no_mode_is_missing_when_one_block_has_more_than_its_share(paths, monkeypatch):
    _, full, half, _ = paths
    # Without spare modes the blocks have to be asked again.
    monkeypatch.setattr("carrierflex.reduction.symmetric_craig_bampton._SPARE_MODES", 0)
    model = symmetric_craig_bampton(half, 5).model
    omega = np.sqrt(model.K.diagonal()[6 * len(model.pilots) :])
    assert len(omega) >= 5
    assert_allclose(omega, full.modes.omega[: len(omega)], rtol=AGREEMENT)


def test_no_modes_at_all_leave_the_static_body(paths):
    _, full, half, _ = paths
    model = symmetric_craig_bampton(half, 0).model
    assert model.n_coordinates == full.Psi.shape[1]
    assert_equal_matrices(model.M, full.model.M[: model.n_coordinates, : model.n_coordinates])


def test_nodes_of_another_mesh_are_refused(paths):
    structure, _, _, symmetric = paths
    with pytest.raises(
        ValueError, match=r"lies .* m from the nearest node; expected the nodes of the body"
    ):
        symmetric.basis.whole_body(structure.points + np.array([1e-3, 0.0, 0.0]))
    with pytest.raises(ValueError, match="has nodes that are no images of the half sector's"):
        symmetric.basis.whole_body(np.concatenate([structure.points, [[1.0, 1.0, 1.0]]]))


def test_a_pilot_without_a_surface_is_refused(flexible_half, carrier):
    points = carrier_pilot_points(carrier)
    names = [f"pin_{number}_midspan" for number in (1, 2, 3)]
    with pytest.raises(
        ValueError,
        match="pilot 'pin_1_midspan' has no surface in the half sector, nor has an image of it",
    ):
        half_sector(
            "carrier", flexible_half, {name: points[name] for name in names}, dihedral_group(3)
        )


def certificate_figures(certificate):
    return {check.name: check.reached for check in certificate.checks if check.reached > 1e-6}


def test_the_certificate_by_blocks_is_that_of_the_whole_body(paths):
    structure, full, _, symmetric = paths
    expected, reached = certify(structure, full), certify_by_blocks(symmetric)
    assert [check.name for check in reached.checks] == [check.name for check in expected.checks]
    assert_allclose(reached.cut_off_hz, expected.cut_off_hz, rtol=1e-9)
    result, wanted = certificate_figures(reached), certificate_figures(expected)
    assert result.keys() == wanted.keys()
    assert len(wanted) >= 3
    for name, figure in wanted.items():
        assert_allclose(result[name], figure, rtol=1e-5, err_msg=name)


def failed(certificate):
    return {check.name.split(",")[0] for check in certificate.checks if not check.met}


def test_each_damage_fails_its_line_of_the_certificate_by_blocks(paths):
    *_, symmetric = paths
    m = len(symmetric.basis.K_bb)
    model = symmetric.model
    assert failed(certify_by_blocks(symmetric)) == set()
    K = model.K.copy()
    K[:m, :m] *= 1.001
    stiffer = replace(symmetric, model=replace(model, K=K))
    assert "static compliance at downwind_seat" in failed(certify_by_blocks(stiffer))
    M = model.M.copy()
    M[:m, m:] *= 0.5
    M[m:, :m] *= 0.5
    uncoupled = replace(symmetric, model=replace(model, M=M))
    # Beyond the first elastic frequency of either carrier.
    beyond = certify_by_blocks(uncoupled, cut_off_hz=1100.0)
    assert "free frequencies" in failed(beyond)
