"""Laws of the element's truth are of the class they are named for; its march is of fourth order."""

import numpy as np
import pytest

from carrierflex.blind_check.labels import NOTHING, OUTSIDE, SINGLE, CasePlan
from carrierflex.blind_check.truth.campaigns import write_case
from carrierflex.blind_check.truth.element.laws import LAWS, driven_motion, force_along, law_force
from carrierflex.identification.campaign.campaign_files import read_campaign

SIZE = np.array([2e-3, 0.05])
STIFFNESS = 1e5


def static_force(name, p, q, v=0.0):
    own = np.array([*p, *[0.0] * (3 - len(p)), STIFFNESS])
    return law_force(LAWS[name], own, SIZE, q, v, np.zeros(2), 0.0, np.zeros(2))


@pytest.mark.parametrize(
    ("name", "power"),
    [("quadratic_stiffness", 2), ("cubic_stiffness", 3), ("quintic_stiffness", 5)],
)
def test_springs_begin_as_the_named_power_and_leave_it(name, power):
    small = static_force(name, (7.0,), 0.1 * SIZE[0])
    np.testing.assert_allclose(small, 7.0 * (0.1 * SIZE[0]) ** power, rtol=1e-3)
    at_size = static_force(name, (7.0,), SIZE[0]) / (7.0 * SIZE[0] ** power) - 1.0
    assert 0.005 < at_size < 0.05, "another form, of the same class"


@pytest.mark.parametrize(("name", "power"), [("quadratic_damping", 2), ("cubic_damping", 3)])
def test_dampers_follow_the_named_power_and_always_dissipate(name, power):
    for v in (-SIZE[1], 0.5 * SIZE[1]):
        force = static_force(name, (3.0,), 0.0, v)
        np.testing.assert_allclose(force, 3.0 * np.sign(v) * abs(v) ** power, rtol=0.02)


def test_backlash_takes_the_spring_away_within_its_gap():
    inside, outside = (static_force("backlash", (1e-3,), q) for q in (0.5e-3, 3e-3))
    np.testing.assert_allclose(inside, -STIFFNESS * 0.5e-3, rtol=1e-3)
    np.testing.assert_allclose(outside, -STIFFNESS * 1e-3, rtol=1e-3)


def sine(n=4000, cycles=3):
    phase = np.linspace(0.0, 2.0 * np.pi * cycles, n * cycles + 1)
    omega = SIZE[1] / SIZE[0]
    return SIZE[0] * np.sin(phase), SIZE[1] * np.cos(phase), (phase[1] - phase[0]) / omega


def loop_area(name, p):
    q, v, step = sine()
    force = force_along(
        q, v, step, LAWS[name], np.array([*p, *[0.0] * (3 - len(p)), STIFFNESS]), SIZE
    )
    last = slice(2 * (q.size - 1) // 3, None)
    return np.trapezoid(force[last], q[last]), force[last]


def test_dry_friction_loses_its_level_over_the_path():
    area, force = loop_area("coulomb_friction", (20.0,))
    np.testing.assert_allclose(area, 4.0 * 20.0 * SIZE[0], rtol=0.02)
    np.testing.assert_allclose([force.max(), -force.min()], 20.0, rtol=1e-6)


def test_friction_differs_by_direction_where_it_is_said_to():
    _, force = loop_area("friction_asymmetry", (20.0, 12.0))
    np.testing.assert_allclose([force.max(), -force.min()], [20.0, 12.0], rtol=1e-3)


def test_stribeck_friction_falls_with_speed():
    _, force = loop_area("stribeck_friction", (20.0, 10.0, 0.3 * SIZE[1]))
    at_full_speed = force[: force.size // 50].mean()
    np.testing.assert_allclose(at_full_speed, 20.0, rtol=0.01)
    assert force.max() > 27.0


def test_elasto_plastic_friction_yields_at_its_level():
    K, F = 1e5, 80.0
    area, force = loop_area("elasto_plastic_friction", (K, F))
    np.testing.assert_allclose([force.max(), -force.min()], F, rtol=1e-3)
    # A spring and a slider in series lose 4 F (a - F / K); the rounded knee takes less than 3 % of
    # it.
    np.testing.assert_allclose(area, 4.0 * F * (SIZE[0] - F / K), rtol=0.03)


def test_maxwell_branches_lose_what_theory_says():
    k, tau, omega = 3e4, 0.05, SIZE[1] / SIZE[0]
    area, _ = loop_area("maxwell_branch", (k, tau))
    loss = np.mean([k * omega * t / (1.0 + (omega * t) ** 2) for t in (0.9 * tau, 1.1 * tau)])
    np.testing.assert_allclose(area, np.pi * loss * SIZE[0] ** 2, rtol=0.01)


def response(steps, laws=(), damping=0.0):
    """Deflection after two natural periods under a smooth force."""
    mass, period = 100.0, 2.0 * np.pi * np.sqrt(100.0 / STIFFNESS)
    time = np.linspace(0.0, 2.0 * period, 3 * steps + 1)
    force = 100.0 * np.sin(0.7 * 2.0 * np.pi * time / period) ** 3
    names = np.array([LAWS[name] for name, _ in laws], dtype=np.float64)
    p = np.array([[*own, 0.0, 0.0, STIFFNESS] for _, own in laws]).reshape(-1, 4)
    base = np.array([mass, STIFFNESS, damping, 0.0])
    return driven_motion(
        force, 2.0 * period / steps, base, names, p, np.tile(SIZE, (len(laws), 1))
    )[-1]


def test_march_is_of_fourth_order():
    exact = response(4096, (("cubic_stiffness", (5e9,)),))
    errors = [abs(response(n, (("cubic_stiffness", (5e9,)),)) - exact) for n in (32, 64, 128)]
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (slopes > 3.6).all()
    assert (slopes < 4.6).all()


@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_gap_is_as_planned_and_noise_as_declared(number, tmp_path):
    label = write_case(
        CasePlan("element", number, 9, SINGLE, ("coulomb_friction",), 6.0), tmp_path / "case"
    )
    campaign = read_campaign(tmp_path / "case")
    assert label.gap_over_floor == pytest.approx(6.0, rel=1e-6)
    assert campaign.channels[0].noise_std == pytest.approx(label.floor)
    # With the effect out, noise is left. Before, gap and noise add as squares; held out, the gap is
    # larger, and never smaller.
    assert 0.6 < label.rho * np.sqrt(1.0 + 6.0**2) < 1.02


def residual_of_own_baseline(campaign):
    """RMS left by mass, spring, damper and offset in a driven run, by derivatives of the measured input alone."""
    settle, left = campaign.rig["settle_samples"], []
    for run in campaign.runs:
        q, force = run.inputs["displacement"], run.signals["measured_force"]
        step = run.time[1] - run.time[0]
        spectrum, omega = np.fft.rfft(q), 2.0 * np.pi * np.fft.rfftfreq(q.size, step)
        rows = [np.fft.irfft(spectrum * (1j * omega) ** n, q.size) for n in (0, 1, 2)]
        inner = slice(
            2 * settle, -settle
        )  # the transform takes the record for periodic: away from its ends
        matrix = np.array([*rows, np.ones_like(q)]).T[inner]
        left.append(force[inner] - matrix @ np.linalg.lstsq(matrix, force[inner], rcond=None)[0])
    return np.sqrt(np.mean(np.square(left)))


def test_nothing_is_left_but_noise_where_nothing_is_missing(tmp_path):
    for number in (1, 5, 7):  # driven ones
        for family, effects, ratio in ((NOTHING, (), 0.0), (OUTSIDE, ("unmeasured_force",), 5.0)):
            label = write_case(
                CasePlan("element", number, 9, family, effects, ratio), tmp_path / family
            )
            campaign = read_campaign(tmp_path / family)
            left = residual_of_own_baseline(campaign) / label.floor
            assert (0.9 < left < 1.15) if family == NOTHING else (left > 4.0), (
                number,
                family,
                left,
            )
