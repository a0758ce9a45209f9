"""The element's simulator against closed forms and against another integrator."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from carrierflex.identification.campaign.signals import (
    band_limited,
    half_step_values,
    trusted_frequency,
)
from carrierflex.simulation.element.integration_steps import integration_substeps
from carrierflex.simulation.element.kernels import (
    N_SLOTS,
    driven_motion,
    element_values,
    motions_together,
    no_law,
    restoring_force,
)
from carrierflex.simulation.element.law_forces import element_law, table_cells
from carrierflex.simulation.laws import (
    COUPLED_DAMPING,
    DISSIPATION,
    ELEMENT,
    RESTORING_FORCE,
    Law,
    Table,
)

NONE = np.empty(0)
MASS = 2.0
STIFFNESS = 8e3
DAMPING = 12.0


def flat(**values):
    return element_values({"m": MASS, "K1": STIFFNESS, "C1": DAMPING, **values})


@pytest.mark.parametrize(
    ("m", "K1", "C1", "expected"),
    [
        # A natural frequency of 100 rad/s turns by 1 rad in a step.
        (1.0, 1e4, 2.0, 4),
        # Critical damping: its exponential falls no faster.
        (1.0, 1e4, 200.0, 4),
        # Far beyond: the fastest exponential is all but C1/m, 1990/s.
        (1.0, 1e4, 2000.0, 12),
        (1.0, 1e4, 1e9, 64),
        (0.0, 1e4, 2.0, 1),
    ],
)
def test_steps_of_integration_follow_the_natural_frequency_or_the_fastest_exponential(
    m, K1, C1, expected
):
    assert integration_substeps(m, K1, C1, 0.01) == expected


def motion(force, p, *, step, n, substeps=4, state=(0.0, 0.0)):
    fine = force(step / (2 * substeps) * np.arange(2 * n * substeps + 1))
    limits = np.array([step / substeps, 1.0])
    return driven_motion(fine, np.array(state), substeps, p, limits, no_law, no_law, NONE, NONE)


SMOOTH = {
    "linear": ({}, lambda q, v: 0.0),
    "stiffness": (
        {"K2": 2e5, "K3": 4e8, "K5": 3e13},
        lambda q, v: 2e5 * q**2 + 4e8 * q**3 + 3e13 * q**5,
    ),
    "damping": (
        {"C_vv": 40.0, "C_v3": 300.0, "C_q2v": 2e6},
        lambda q, v: 40.0 * v * abs(v) + 300.0 * v**3 + 2e6 * q**2 * v,
    ),
    "offset": ({"f0": 3.0}, lambda q, v: 3.0),
    "gap": ({"gap": 4e-4}, lambda q, v: -STIFFNESS * np.clip(q, -4e-4, 4e-4)),
}


@pytest.mark.parametrize("case", SMOOTH)
def test_motion_follows_the_law(case):
    values, law = SMOOTH[case]

    def force(t):
        return 6.0 * np.cos(2.0 * np.pi * 9.0 * t) + 3.0 * np.cos(2.0 * np.pi * 4.0 * t + 1.0)

    def rates(t, state):
        q, v = state
        return [v, (force(t) - STIFFNESS * q - DAMPING * v - law(q, v)) / MASS]

    time = 2e-3 * np.arange(1000)
    q, _ = motion(force, flat(**values), step=2e-3, n=1000)
    reference = solve_ivp(
        rates, (0.0, time[-1]), [0.0, 0.0], "DOP853", time, rtol=1e-9, atol=1e-13, max_step=1e-3
    )
    # A corner in the law (gap) costs the fourth order; everything else is far below.
    assert_allclose(q, reference.y[0], atol=(2e-4 if case == "gap" else 2e-6) * np.abs(q).max())


def test_motions_of_several_parameter_sets_together_are_those_of_each_alone():
    step, substeps, n = 2e-3, 4, 300
    time = step / (2 * substeps) * np.arange(2 * n * substeps + 1)
    fine = 6.0 * np.cos(2.0 * np.pi * 9.0 * time)
    sets = [flat(**values) for values, _ in SMOOTH.values()]
    # Friction that slips and sticks, with a slider and of one side; the last runs away.
    sets += [flat(F_plus=2.0, F_minus=2.5), flat(F_plus=9.0, F_minus=9.0), flat(F_minus=1.5)]
    sets += [flat(Kp=2e4, Fy=2.0), flat(Kp=2e4, Fy=2.0, F_plus=1.0, F_minus=1.0, k=2e3, tau=0.03)]
    sets += [flat(k=2e3, tau=0.03), flat(K1=-STIFFNESS)]
    drive = np.arange(len(sets)) % 2
    fines = np.column_stack([fine, 0.5 * fine])
    starts = 1e-4 * np.arange(2.0 * len(sets)).reshape(2, -1)
    state = np.vstack([starts, np.zeros((2, len(sets)))])
    h = step / substeps
    limits = np.tile([[h], [1e3]], len(sets))
    p = np.vstack([np.array(sets).T, np.zeros((2, len(sets)))])
    # In two stretches, the second of which begins where the first ended.
    half = 2 * substeps * (n // 2)
    stretches = [
        motions_together(
            stretch,
            drive,
            state,
            substeps,
            p,
            limits,
            np.empty((3, 0)),
            no_law,
            np.empty((len(sets), 0)),
        )
        for stretch in (fines[: half + 1].copy(), fines[half:].copy())
    ]
    q, v = (np.concatenate(pieces) for pieces in zip(*stretches, strict=True))
    assert np.isfinite(q[:, :-1]).all()
    assert not np.isfinite(q[-1, -1])
    for k in range(len(sets)):
        alone = driven_motion(
            fines[:, drive[k]].copy(),
            starts[:, k].copy(),
            substeps,
            p[:-2, k].copy(),
            np.array([h, 1.0]),
            no_law,
            no_law,
            NONE,
            NONE,
        )
        assert_allclose(q[:, k], alone[0], rtol=1e-12)
        assert_allclose(v[:, k], alone[1], rtol=1e-12)


def test_error_falls_with_the_fourth_power_of_the_step():
    def force(t):
        return 6.0 * np.cos(2.0 * np.pi * 9.0 * t)

    finest = motion(force, flat(K3=4e8), step=5e-3, n=300, substeps=64)[0]
    errors = [
        np.abs(motion(force, flat(K3=4e8), step=5e-3, n=300, substeps=k)[0] - finest).max()
        for k in (2, 4, 8)
    ]
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (slopes > 3.6).all()
    assert (slopes < 4.6).all()


def test_free_motion_under_dry_friction_loses_four_friction_deflections_a_cycle_and_then_sticks():
    # Amplitude falls by 2 F/K each half cycle and the mass stops within ±F/K (den Hartog).
    p = flat(C1=0.0, F_plus=2.0, F_minus=2.0)
    period = 2.0 * np.pi * np.sqrt(MASS / STIFFNESS)
    q, v = motion(np.zeros_like, p, step=period / 200, n=2000, state=(5e-3, 0.0))
    turning = q[np.arange(0, 1000, 100)]
    drop = 2.0 * 2.0 / STIFFNESS
    expected = [(-1) ** k * (5e-3 - k * drop) for k in range(10)]
    assert_allclose(turning, expected, atol=2e-6)
    assert abs(q[-1]) <= 2.0 / STIFFNESS
    assert v[-1] == 0.0
    assert q[-1] == q[-500]  # no creep


def test_friction_below_break_away_holds_and_asymmetric_friction_lets_go_one_way():
    p = flat(F_plus=3.0, F_minus=1.0)
    for level, moves in ((2.9, False), (-0.9, False), (-1.1, True), (3.1, True)):
        q, _ = motion(lambda t, f=level: np.full(t.shape, f), p, step=1e-3, n=400)
        assert (q[-1] != 0.0) == moves


def test_elasto_plastic_loop_has_the_area_of_jenkins_element():
    # Area of one cycle beyond yield: 4 Fy (A - Fy/Kp).
    n, amplitude = 4000, 1e-3
    q = amplitude * np.sin(2.0 * np.pi * np.arange(2 * n) / n)
    p = flat(m=0.0, K1=0.0, C1=0.0, Kp=1e4, Fy=3.0)
    force = restoring_force(
        q, np.zeros_like(q), np.zeros_like(q), p, np.array([1e-3, 1e-3]), no_law, no_law, NONE, NONE
    )
    area = np.sum(0.5 * (force[n:] + force[n - 1 : -1]) * np.diff(q[n - 1 :]))
    assert_allclose(area, 4.0 * 3.0 * (amplitude - 3.0 / 1e4), rtol=1e-3)


def test_maxwell_branch_has_its_complex_stiffness():
    step = 1e-3
    omega = 2.0 * np.pi * 5.0
    k = 4e3
    tau = 0.02
    time = step * np.arange(4000)
    p = flat(m=0.0, K1=0.0, C1=0.0, k=k, tau=tau)
    force = restoring_force(
        np.cos(omega * time),
        np.zeros(4000),
        np.zeros(4000),
        p,
        np.array([step, 1.0]),
        no_law,
        no_law,
        NONE,
        NONE,
    )
    amplitude = 2.0 * np.mean(force[2000:] * np.exp(-1j * omega * time[2000:]))
    # The step holds the rate constant: error of first order in omega times step.
    assert_allclose(amplitude, k * 1j * omega * tau / (1.0 + 1j * omega * tau), rtol=0.02)


def test_a_motion_that_runs_away_is_infinite_not_an_error():
    q, _ = motion(np.ones_like, flat(K1=-1e5), step=1e-3, n=500)
    assert np.isinf(q[-1])


def test_drive_between_the_samples_is_band_limited():
    step, substeps = 1e-3, 3
    time = step * np.arange(2000)
    fine = half_step_values(np.cos(2.0 * np.pi * 130.0 * time), substeps, periodic=False)
    exact = np.cos(2.0 * np.pi * 130.0 * step / (2 * substeps) * np.arange(fine.size))
    middle = slice(600, -600)  # the ends are held, not known
    assert fine.size == 2 * 2000 * substeps + 1
    assert_allclose(fine[middle], exact[middle], atol=2e-4)


def test_derivatives_in_the_trusted_band_are_exact_and_noise_above_it_is_gone():
    step, n = 1e-3, 4000
    time = step * np.arange(n)
    signal = np.sin(2.0 * np.pi * 7.0 * time)
    noisy = signal + 1e-5 * np.random.default_rng(0).standard_normal(n)
    cutoff = trusted_frequency(noisy, step)
    assert 7.0 < cutoff < 120.0
    acceleration = band_limited(noisy, step, cutoff, derivative=2)
    exact = -((2.0 * np.pi * 7.0) ** 2) * signal
    assert_allclose(acceleration[200:-200], exact[200:-200], atol=0.01 * np.abs(exact).max())


@pytest.mark.parametrize("friction", [0.0, 1.5])
@pytest.mark.parametrize("effect_class", [RESTORING_FORCE, COUPLED_DAMPING])
def test_motions_under_a_table_together_are_those_of_each_alone(effect_class, friction):
    step, substeps, n = 2e-3, 4, 300
    fine = 6.0 * np.cos(18.0 * np.pi * step / (2 * substeps) * np.arange(2 * n * substeps + 1))
    # The motion leaves the table on both sides.
    x = np.linspace(-3e-4, 4e-4, 9)
    y = 4e8 * x**3 if effect_class == RESTORING_FORCE else 3e8 * x**2
    law = Law("", ELEMENT, effect_class, ("N", "m"), (Table(ELEMENT, x, y),))
    force = element_law(law).force
    cells, times_speed = table_cells(force)
    assert times_speed is (effect_class == COUPLED_DAMPING)
    sizes = np.array([0.0, 1.0, 2.5])
    # Beside dry friction a motion that turns goes through that step alone, by the law.
    with_friction = flat(F_plus=friction, F_minus=friction)
    p = np.zeros((N_SLOTS + 2, sizes.size))
    p[:N_SLOTS] = with_friction[:, None]
    p[N_SLOTS + times_speed] = sizes
    h = step / substeps
    parameters = [np.append(size, force.parameters[1:]) for size in sizes]
    q, _ = motions_together(
        fine[:, None],
        np.zeros(sizes.size, dtype=int),
        np.zeros((4, sizes.size)),
        substeps,
        p,
        np.tile([[h], [1.0]], sizes.size),
        cells,
        force.force,
        np.array(parameters),
    )
    assert q.min() < x[0]
    assert q.max() > x[-1]
    for k, of_law in enumerate(parameters):
        alone, _ = driven_motion(
            fine,
            np.zeros(2),
            substeps,
            with_friction,
            np.array([h, 1.0]),
            force.force,
            no_law,
            of_law,
            NONE,
        )
        assert_allclose(q[:, k], alone, atol=1e-12 * np.abs(alone).max())


def test_a_table_with_uneven_nodes_or_over_the_speed_has_no_cells():
    def law(effect_class, x):
        return Law("", ELEMENT, effect_class, ("N", "m"), (Table(ELEMENT, x, x**3),))

    even, uneven = np.linspace(-1.0, 1.0, 5), np.array([-1.0, 0.0, 0.4, 1.0])
    assert table_cells(element_law(law(RESTORING_FORCE, uneven)).force) is None
    assert table_cells(element_law(law(DISSIPATION, even)).force) is None
    assert table_cells(element_law(law(RESTORING_FORCE, even)).force) is not None
