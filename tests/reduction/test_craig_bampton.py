"""Fixed-interface modes and reduced matrices against dense linear algebra.

And against the definitions of Craig and Bampton.
"""

from itertools import pairwise

import numpy as np
import pytest
import scipy.linalg
from numpy.testing import assert_allclose

from carrierflex.fe.materials import STEEL
from carrierflex.fe.static import AccuracyError
from carrierflex.reduction.craig_bampton import craig_bampton, mass_properties
from carrierflex.reduction.fixed_interface_modes import fixed_interface_modes
from carrierflex.reduction.held_structure import GroundedBody, HeldStructure
from carrierflex.reduction.modes.mode_rules import Below
from carrierflex.reduction.reduced_static import pilot_compliance
from tests.analytic import (
    box_inertia,
    carrier_centre_x,
    carrier_inertia,
    carrier_volume,
    pin_inertia,
)
from tests.reduction.small_bar import LENGTH, bar

REDUCTIONS = pytest.mark.parametrize("body", ["flexible", "pin"])


def both(body, request):
    return request.getfixturevalue(f"{body}_structure"), request.getfixturevalue(
        f"{body}_reduction"
    )


def coupling(structure):
    return np.concatenate([pilot.G.toarray() for pilot in structure.pilots])


@REDUCTIONS
def test_fixed_interface_modes_are_held_and_mass_normalised(body, request):
    structure, reduction = both(body, request)
    Phi = reduction.modes.Phi
    for pilot in structure.pilots:
        assert np.abs(pilot.G @ Phi).max() < 1e-9 * np.abs(Phi).max()
    assert_allclose(Phi.T @ (structure.M @ Phi), np.eye(Phi.shape[1]), rtol=0.0, atol=1e-8)
    assert_allclose(Phi.T @ (structure.K @ Phi), np.diag(reduction.modes.omega**2), rtol=0.0,
                    atol=1e-7 * reduction.modes.omega[-1] ** 2)  # fmt: skip
    assert (np.diff(reduction.modes.omega) >= 0.0).all()


@REDUCTIONS
def test_constraint_modes_do_no_work_on_fixed_interface_modes(body, request):
    structure, reduction = both(body, request)
    K_bq = reduction.Psi.T @ (structure.K @ reduction.modes.Phi)
    m = reduction.Psi.shape[1]
    scale = np.sqrt(np.outer(reduction.model.K.diagonal()[:m], reduction.modes.omega**2))
    assert np.abs(K_bq / scale).max() < 1e-8
    assert not reduction.model.K[:m, m:].any()


@REDUCTIONS
def test_reduced_matrices_are_those_of_the_basis(body, request):
    structure, reduction = both(body, request)
    model = reduction.model
    T = np.concatenate([reduction.Psi, reduction.modes.Phi], axis=1)
    for matrix, reduced in ((structure.K, model.K), (structure.M, model.M)):
        expected = T.T @ (matrix @ T)
        scale = np.sqrt(np.outer(reduced.diagonal(), reduced.diagonal()))
        assert_allclose(reduced / scale, expected / scale, rtol=0.0, atol=1e-8)
        assert (reduced == reduced.T).all()
    # Two per cent of critical damping on the modes, none on the pilots: 2 zeta omega.
    m = reduction.Psi.shape[1]
    damping = np.concatenate([np.zeros(m), 0.04 * reduction.modes.omega])
    assert_allclose(model.D, np.diag(damping), rtol=1e-14)


def test_fixed_interface_frequencies_equal_those_of_a_dense_null_space():
    structure = bar((4, 1, 1))
    N = scipy.linalg.null_space(coupling(structure))
    squares = scipy.linalg.eigh(
        N.T @ structure.K.toarray() @ N, N.T @ structure.M.toarray() @ N, eigvals_only=True
    )
    omega = craig_bampton(structure, 12).modes.omega
    assert_allclose(omega, np.sqrt(squares[:12]), rtol=1e-8)


def test_both_modes_of_every_degenerate_pair_are_found(flexible_reduction):
    # Threefold symmetry makes pairs of equal frequency; a vector iteration may miss the second of a
    # pair.
    omega = flexible_reduction.modes.omega
    same = np.flatnonzero(np.diff(omega) < 1e-6 * omega[:-1])
    assert len(same) >= 3
    assert (np.diff(same) > 1).all()


def test_free_free_frequencies_converge_from_above_with_the_number_of_modes():
    structure, n_compared = bar((4, 1, 1)), 6
    exact = scipy.linalg.eigh(structure.K.toarray(), structure.M.toarray(), eigvals_only=True)[
        6 : 6 + n_compared
    ]
    counts, errors = (0, 4, 8, 16, 23), []
    for n_modes in counts:
        model = craig_bampton(structure, n_modes).model
        squares = scipy.linalg.eigh(model.K, model.M, eigvals_only=True)
        assert (np.abs(squares[:6]) < 1e-7 * exact[0]).all()
        errors.append(squares[6 : 6 + n_compared] / exact - 1.0)
    for coarse, fine in pairwise(errors):
        assert (fine <= coarse + 1e-9).all()
    assert all((error > -1e-9).all() for error in errors)  # from above, to rounding
    # Statics alone miss the sixth frequency by more than half; 23 modes leave less than a
    # thousandth.
    assert errors[0].max() > 0.5
    assert errors[-1].max() < 2e-3
    # Bounded from both sides: with frequencies that grow as the square of their number the error
    # falls as a low power.
    slope = -np.polyfit(np.log(counts[1:]), [np.log(error.max()) for error in errors[1:]], 1)[0]
    assert 1.5 < slope < 6.0, errors


@REDUCTIONS
def test_static_compliance_is_that_of_the_full_model_whatever_the_modes(body, request):
    structure, reduction = both(body, request)
    first, *others = structure.pilots
    constrained = HeldStructure(reduction.body, (first,))
    G = np.concatenate([pilot.G.toarray() for pilot in others])
    u, _ = constrained.solve(np.ascontiguousarray(G.T), np.zeros((6, len(G))))
    full = G @ u
    reduced = pilot_compliance(reduction.model, [first.name])
    scale = np.sqrt(np.outer(full.diagonal(), full.diagonal()))
    assert_allclose(reduced / scale, full / scale, rtol=0.0, atol=1e-9)


def test_sensors_read_the_same_from_reduced_and_nodal_coordinates(
    flexible_structure, flexible_reduction
):
    q = np.random.default_rng(6).standard_normal(flexible_reduction.model.n_coordinates)
    T = np.concatenate([flexible_reduction.Psi, flexible_reduction.modes.Phi], axis=1)
    expected = flexible_structure.sensors.rows @ (T @ q)
    result = flexible_reduction.model.sensor_rows @ q
    assert_allclose(result, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())
    assert flexible_reduction.model.sensor_names == flexible_structure.sensors.names


def test_mass_properties_of_a_bar_are_exact():
    properties = mass_properties(bar(offset=0.2))
    lengths = (LENGTH, 0.03, 0.05)
    mass = STEEL.rho * np.prod(lengths)
    assert_allclose(properties.mass, mass, rtol=1e-12)
    assert_allclose(properties.centre, [0.35, 0.0, 0.0], rtol=0.0, atol=1e-12)
    # Rounding of the difference of inertia about the origin and the parallel-axis term.
    assert_allclose(properties.inertia, box_inertia(mass, lengths), rtol=0.0, atol=1e-11 * mass)


def test_mass_properties_of_the_carrier_are_those_of_its_drawing(flexible_reduction, carrier):
    properties, mass = flexible_reduction.model.mass_properties, 7200.0 * carrier_volume(carrier)
    about_x, across = carrier_inertia(carrier, 7200.0)
    # The mesh's volume error is 1.4e-5; arcs far out weigh more in the inertia.
    assert_allclose(properties.mass, mass, rtol=5e-5)
    assert_allclose(properties.centre, [carrier_centre_x(carrier), 0.0, 0.0], rtol=0.0, atol=1e-5)
    assert_allclose(properties.inertia, np.diag([about_x, across, across]), rtol=1e-4, atol=1e-10)


def test_mass_properties_of_the_pin_are_those_of_a_cylinder(pin_reduction, carrier):
    properties = pin_reduction.model.mass_properties
    mass = STEEL.rho * np.pi * 0.08**2 * 0.35
    assert_allclose(properties.mass, mass, rtol=2e-4)
    assert_allclose(properties.centre, [0.175, 0.0, 0.308], rtol=0.0, atol=1e-4)
    assert_allclose(properties.inertia, pin_inertia(mass, 0.08, 0.35), rtol=5e-4, atol=1e-4)


def test_coordinates_are_labelled_in_words(pin_reduction):
    model = pin_reduction.model
    assert model.labels[:2] == ("pin_1_upwind Tx [m]", "pin_1_upwind Ty [m]")
    assert model.labels[11] == "pin_1_midspan Rz [rad]"
    assert model.labels[18] == f"mode 1 ({pin_reduction.modes.omega[0] / 2.0 / np.pi:.1f} Hz)"
    assert (model.coordinates_of("pin_1_downwind") == np.arange(12, 18)).all()
    with pytest.raises(
        KeyError, match="pin has no pilot 'rim'; it has pin_1_upwind, pin_1_midspan, pin_1_downwind"
    ):
        model.coordinates_of("rim")


def test_inputs_stay_unchanged():
    structure = bar()
    before = [structure.K.data.copy(), structure.M.data.copy(), structure.points.copy()]
    couplings = [pilot.G.data.copy() for pilot in structure.pilots]
    craig_bampton(structure, 5)
    for now, then in zip(
        (structure.K.data, structure.M.data, structure.points), before, strict=True
    ):
        assert (now == then).all()
    for pilot, then in zip(structure.pilots, couplings, strict=True):
        assert (pilot.G.data == then).all()


def test_the_same_seed_gives_the_same_reduction_and_another_the_same_frequencies():
    one, again, other = (craig_bampton(bar(), 6, seed=seed) for seed in (0, 0, 7))
    assert (one.model.M == again.model.M).all()
    assert_allclose(one.modes.omega, other.modes.omega, rtol=1e-9)


@pytest.mark.parametrize(
    ("n_modes", "message"),
    [
        (-1, "number of modes is -1; expected 0 or more"),
        (13, "13 modes requested; expected at most 12 for 135 degrees of freedom"),
        (1000, "1000 modes requested; expected at most 12 for 135 degrees of freedom"),
        (Below(1e9), r"all modes below 1e\+09 Hz requested; expected at most 12 for 135 "),
    ],
)
def test_an_impossible_number_of_modes_is_refused(n_modes, message):
    structure = bar((2, 1, 1))  # 135 degrees of freedom
    with pytest.raises(ValueError, match=message):
        craig_bampton(structure, n_modes)


def test_modes_of_another_stiffness_fail_the_residual_check(monkeypatch):
    structure = bar()
    constrained = HeldStructure(GroundedBody(structure.K, structure.points), structure.pilots)

    def wrong(answer, M, start, n_modes):
        return np.full(n_modes, 1e9), np.random.default_rng(0).standard_normal(
            (M.shape[0], n_modes)
        )

    monkeypatch.setattr("carrierflex.reduction.fixed_interface_modes.lowest_modes", wrong)
    with pytest.raises(
        AccuracyError,
        match=r"fixed-interface mode \d has a residual of .*; expected less than 1e-06",
    ):
        fixed_interface_modes(constrained, structure.M, 3, rng=np.random.default_rng(0))
