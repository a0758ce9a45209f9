"""Laws of the element's truth are of the class they are named for; its march is of fourth order."""

import numpy as np
import pytest

from carrierflex.blind_check.truth.element.element import MEMORY_LAWS, force_along, motion_under
from carrierflex.blind_check.truth.element.families import CAUSES, class_sets
from carrierflex.blind_check.truth.element.static_laws import STATIC_LAWS, static_force

PLAIN = np.zeros((3, 4))
#: A change of form as strong as none that is drawn.
CHANGED = np.array([[0.2, -0.1, 0.15, 0.1], [1.0, 2.5, 4.0, 5.5], [0.3, 1.0, 2.0, 4.0]])
ONE = np.ones(3)
#: Laws whose loop must not know the rate.
HYSTERESIS = {
    "bouc_wen": (5.0, 1.5, 0.6, 0.4),
    "pinched_bouc_wen": (5.0, 1.0, 0.5, 0.5, 0.8, 0.3),
    "iwan": (0.05, 0.7, -0.5),
    "elasto_plastic": (0.2, 0.4),
    "play_with_friction": (0.3, 0.02, 0.5),
}
HARDENING = (2.0, 1.0, 0.4, -0.9)


def parameters(p):
    return np.array([*p, *[0.0] * (6 - len(p))])


def static(name, p, s, w=0.0, t=0.0, form=PLAIN):
    return static_force(STATIC_LAWS[name], parameters(p), form, s, w, t)


def loop(name, p, *, period=2.0 * np.pi, n=6000, cycles=3, form=PLAIN, numbers=None):
    """Deflection and force over the last cycle of a sine of unit amplitude."""
    phase = np.linspace(0.0, 2.0 * np.pi * cycles, n * cycles + 1)
    omega = 2.0 * np.pi / period
    q, v = np.sin(phase), omega * np.cos(phase)
    law = (numbers or MEMORY_LAWS)[name]
    force = force_along(q, v, (phase[1] - phase[0]) / omega, law, parameters(p), form, ONE)
    last = slice((cycles - 1) * n, None)
    return q[last], force[last]


@pytest.mark.parametrize("power", [3.0, 5.0])
def test_textbook_springs_are_powers(power):
    np.testing.assert_allclose(static("odd_power_spring", (power,), -0.5), -(0.5**power))


def test_a_spring_with_a_gap_carries_nothing_within_it():
    inside, outside = (0.1 - abs(static("dead_zone", (0.4,), q) + q) for q in (0.1, 0.1))
    assert abs(inside - 0.1) < 1e-3
    np.testing.assert_allclose(static("dead_zone", (0.4,), 1.0), -0.4, rtol=1e-3)
    assert outside == inside


def test_contact_acts_on_one_side_only():
    assert static("one_sided_contact", (0.3, 1.5, -1.0), 0.9) == 0.0
    np.testing.assert_allclose(
        static("one_sided_contact", (0.3, 1.5, -1.0), -0.9), -(0.6**1.5), rtol=1e-12
    )


@pytest.mark.long
def test_a_visco_elastic_stop_pushes_only():
    forces = [static("visco_elastic_stop", (0.3, 0.5), q, w) for q in (0.2, 0.6) for w in (-1, 1)]
    np.testing.assert_allclose(forces, [0.0, 0.0, 0.0, 0.8], atol=1e-12)


@pytest.mark.long
def test_dry_friction_loses_its_level_over_the_path():
    q, force = loop("creeping_friction", (0.0, 1.0, 0.5), numbers=STATIC_LAWS)
    np.testing.assert_allclose([force.max(), -force.min()], [1.0, 0.5], rtol=1e-6)
    np.testing.assert_allclose(np.trapezoid(force, q), 2.0 * 1.5, rtol=0.01)


def test_lugre_gives_before_it_slides_and_then_keeps_its_level():
    q, force = loop("lugre", (0.03, 0.0, 0.1))
    np.testing.assert_allclose(force.max(), 1.0, rtol=1e-3)
    turned = np.flatnonzero(q == q.max())[0]
    # After the turn the bristles unwind over a path of their own length.
    path = q.max() - q[turned + 1 :]
    crossing = path[np.flatnonzero(force[turned + 1 :] < 0.0)[0]]
    np.testing.assert_allclose(crossing, 0.03 * np.log(2.0), rtol=0.05)


@pytest.mark.parametrize("name", [*HYSTERESIS, "hardening"])
def test_hysteresis_does_not_know_the_rate(name):
    law, p = ("bouc_wen", HARDENING) if name == "hardening" else (name, HYSTERESIS[name])
    q, slow = loop(law, p, period=6.0, form=CHANGED)
    _, fast = loop(law, p, period=1.0, form=CHANGED)
    np.testing.assert_allclose(fast, slow, atol=0.01 * np.abs(slow).max())
    assert np.trapezoid(slow, q) > 0.05 * np.ptp(slow)


def test_bouc_wen_softens_and_hardens_by_its_signs():
    for p, grows in ((HYSTERESIS["bouc_wen"], False), (HARDENING, True)):
        q, force = loop("bouc_wen", p)
        slope = (np.diff(force) / np.diff(q))[:1490]
        loaded = np.flatnonzero(force[:1490] > 0.0)
        ratio = slope[loaded[-40]] / slope[loaded[0]]
        assert (ratio > 1.1) if grows else (ratio < 0.5)


def test_a_pinched_loop_is_thin_in_the_middle():
    widths = []
    for name in ("bouc_wen", "pinched_bouc_wen"):
        q, force = loop(name, HYSTERESIS["pinched_bouc_wen"])
        widths.append(np.ptp(force[np.abs(q) < 0.02]))
    assert widths[1] < 0.3 * widths[0]


def test_an_elasto_plastic_slider_yields_at_its_level():
    q, force = loop("elasto_plastic", (0.25,))
    np.testing.assert_allclose([force.max(), -force.min()], 1.0, rtol=2e-3)
    np.testing.assert_allclose(np.trapezoid(force, q), 4.0 * (1.0 - 0.25), rtol=0.01)


def test_play_with_friction_bears_on_its_flanks_and_drags_between_them():
    q, force = loop("play_with_friction", (0.3, 0.02, 0.5))
    np.testing.assert_allclose([force.max(), -force.min()], 1.5, rtol=2e-3)
    np.testing.assert_allclose(np.abs(force[np.abs(q) < 0.25]), 0.5, rtol=2e-2)
    np.testing.assert_allclose(np.trapezoid(force, q), 4.0 * 0.5 * (1.0 - 0.02), rtol=0.01)


def test_maxwell_branches_lose_what_theory_says():
    p = (1.0, 0.5, 0.6, 3.0, 0.0, 1.0)
    q, force = loop("maxwell_branches", p, cycles=6)
    loss = sum(k * tau / (1.0 + tau**2) for k, tau in zip(p[::2], p[1::2], strict=True))
    np.testing.assert_allclose(np.trapezoid(force, q), np.pi * loss, rtol=0.01)


def response(steps):
    """Deflection after two natural periods of a hardening spring under a smooth force."""
    period = 2.0 * np.pi
    time = np.linspace(0.0, 2.0 * period, 3 * steps + 1)
    force = 0.5 * np.sin(0.7 * time) ** 3
    law = np.array([STATIC_LAWS["odd_power_spring"]], dtype=np.float64)
    p, form = parameters((3.0,))[None], PLAIN[None]
    base = np.array([1.0, 1.0, 0.1, 0.0])
    step = 2.0 * period / steps
    return motion_under(force, step, np.zeros(2), base, law, p, form, ONE[None])[-1]


@pytest.mark.long
def test_march_is_of_fourth_order():
    exact = response(4096)
    errors = [abs(response(n) - exact) for n in (64, 128, 256)]
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (slopes > 3.6).all()
    assert (slopes < 4.6).all()


def test_sets_of_classes_that_records_may_not_tell_apart():
    assert class_sets(()) == ((), ())
    assert class_sets(("coulomb",)) == (("dissipation",), (("hysteresis",),))
    assert class_sets(("cubic_spring", "lugre")) == (
        ("dissipation", "restoring_force"),
        (("hysteresis", "restoring_force"),),
    )
    classes, others = class_sets(("coulomb", "visco_elastic_stop"))
    assert classes == ("coupled_damping", "dissipation", "restoring_force")
    # Dissipation beside a surface is the surface again.
    assert ("force_surface",) in others


def test_every_law_has_a_cause_and_every_cause_a_law():
    named = {cause.law for cause in CAUSES.values()} - {""}
    # Those two curve the baseline's own spring and damper.
    assert {*STATIC_LAWS, *MEMORY_LAWS} - named == {"form_of_deflection", "form_of_speed"}
    assert named <= {*STATIC_LAWS, *MEMORY_LAWS}
