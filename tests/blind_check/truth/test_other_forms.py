"""Causes of a carrier in other forms: each of the frame, pattern and load that its class says."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.blind_check.case_plans import case_plans
from carrierflex.blind_check.labels import FORM, NOTHING, CasePlan
from carrierflex.blind_check.truth.carrier.other_forms import (
    CLASSES_OF_LAW,
    OTHER_FORMS,
    drawn_form,
    other_form_signal,
)
from carrierflex.blind_check.truth.carrier.rig import SENSOR_ANGLES
from carrierflex.blind_check.truth.carrier.signals import NOMINAL_TORQUE, RimRecord
from carrierflex.blind_check.truth.carrier.truth import carrier_case
from carrierflex.diagnosis.carrier.classes.answer import CLASS_OF_LAW

TURN = np.linspace(0.0, 2.0 * np.pi, 240, endpoint=False)


def record_of(torque=1.0, load=(1e5, 0.5e5), sensors=SENSOR_ANGLES):
    """One turn at constant loads."""
    return RimRecord(
        0,
        TURN * 5.0,
        TURN,
        torque * NOMINAL_TORQUE + 0.0 * TURN,
        load[0] + 0.0 * TURN,
        load[1] + 0.0 * TURN,
        sensors[:, None],
    )


def signal_of(name, **options):
    """Signal of a cause with values of one seed."""
    values = drawn_form(name, np.random.default_rng(4))
    return other_form_signal(name, record_of(**options), values)


@pytest.mark.parametrize("name", OTHER_FORMS)
def test_a_cause_turns_with_the_carrier_or_stays_as_its_frame_says(name):
    frame, _, pattern = OTHER_FORMS[name].shape.partition("/")
    signal = signal_of(name)
    assert np.abs(signal).max() > 1e-7
    if frame == "carrier":
        # A sensor a quarter turn further on reads the same a quarter turn later.
        np.testing.assert_allclose(signal[1], np.roll(signal[0], TURN.size // 4), atol=1e-12)
        return
    orders = np.abs(np.fft.rfft(signal, axis=1)) / TURN.size
    present = set(np.flatnonzero(orders.max(axis=0) > 1e-9).tolist())
    if pattern in ("tilt", "saddle"):
        assert present == {0}
        sign = -1.0 if pattern == "tilt" else 1.0
        np.testing.assert_allclose(signal[2:], sign * signal[:2], atol=1e-12)
    if pattern == "planet_pass":
        assert present == {3}
    if pattern == "load_sharing":
        assert present <= {0, 3, 6, 9, 12, 15, 18, 21, 24, 27, 30}
    if pattern == "offset":
        np.testing.assert_allclose(signal, np.broadcast_to(signal[0], signal.shape), atol=1e-15)


@pytest.mark.parametrize("name", OTHER_FORMS)
def test_a_cause_follows_the_loads_that_its_class_says_and_no_other(name):
    follows = OTHER_FORMS[name].follows.split("+")
    full = signal_of(name)
    less_torque = signal_of(name, torque=0.5)
    unloaded = signal_of(name, load=(0.0, 0.0))
    assert np.allclose(less_torque, full, rtol=0.0, atol=1e-12) == ("torque" not in follows)
    assert np.allclose(unloaded, full, rtol=0.0, atol=1e-12) == ("radial_load" not in follows)
    if "radial_load" in follows:
        assert not unloaded.any()
    if "torque" in follows:
        # No law of the library: none is proportional to the torque.
        assert not np.allclose(less_torque, 0.5 * full, rtol=1e-3, atol=1e-9) or len(follows) > 1


def test_planets_that_share_unevenly_leave_no_wave_that_equal_loads_make():
    orders = np.abs(np.fft.rfft(signal_of("uneven_lobes"), axis=1)) / TURN.size
    assert orders[:, 3:13:3].max() < 1e-6 * orders.max()


def test_plans_hold_causes_alone_in_pairs_of_two_classes_and_none():
    plans = case_plans("carrier", 120, 3, (FORM,))
    sizes = [len(plan.effects) for plan in plans]
    assert [sizes.count(n) for n in (0, 1, 2)] == [20, 80, 20]
    assert {name for plan in plans for name in plan.effects} == set(OTHER_FORMS)
    for plan in plans:
        shapes = [OTHER_FORMS[name].shape for name in plan.effects]
        assert len(set(shapes)) == len(shapes)
        assert (plan.ratio > 0.0) == bool(plan.effects)
    for kind in ("carrier", "mounting"):
        assert all(plan.family != FORM for plan in case_plans(kind, 300, 3))


def test_the_diagnosis_and_the_truth_place_every_law_alike():
    assert {law: (shape,) for law, shape in CLASS_OF_LAW.items()} == dict(CLASSES_OF_LAW)


def test_a_case_has_its_gap_and_its_label_the_classes_of_its_causes():
    plan = CasePlan("carrier", 1, 5, FORM, ("bounded_lobes",), 10.0)
    campaign, label = carrier_case(plan)
    assert label.gap_over_floor == pytest.approx(10.0, rel=1e-3)
    assert (label.family, label.classes) == (FORM, ("carrier/waves/torque",))
    assert label.drive == {6: "six_loads", 8: "eight_loads"}[len(campaign.runs)]
    assert not label.parameters
    _, nothing = carrier_case(replace(plan, effects=(), ratio=0.0))
    assert (nothing.family, nothing.classes) == (NOTHING, ())
    assert nothing.drive


def test_each_of_two_causes_has_a_gap_of_its_own():
    plan = CasePlan("carrier", 6, 7463, FORM, ("late_tilt", "load_saddle"), 6.0)
    _, label = carrier_case(plan)
    first, second = label.own_gaps
    # Signals add up: a triangle's sides; the plan draws both alike.
    assert abs(first - second) < label.gap_over_floor < first + second
    assert first == pytest.approx(second, rel=0.01)
    _, alone = carrier_case(replace(plan, effects=("late_tilt",)))
    assert alone.own_gaps == ()
