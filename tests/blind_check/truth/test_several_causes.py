"""Several causes at once: their plans, and what each leaves alone."""

import hashlib
from dataclasses import astuple, replace

import numpy as np
import pytest

from carrierflex.blind_check.case_plans import LARGEST_OWN, SMALLEST_OWN, case_plans
from carrierflex.blind_check.labels import FORM, SEVERAL, CasePlan
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.blind_check.truth.carrier.alias_sets import alias_sets
from carrierflex.blind_check.truth.carrier.other_forms import (
    OTHER_FORMS,
    drawn_form,
    other_form_signal,
)
from carrierflex.blind_check.truth.carrier.rig import drawn_record as rim_record
from carrierflex.blind_check.truth.linear_refit import LinearBaseline
from carrierflex.blind_check.truth.mounting.loads import drawn_record
from carrierflex.blind_check.truth.mounting.other_forms import MOUNTING_FORMS, STATIC_MAPS
from carrierflex.blind_check.truth.mounting.rig import RIG, bodies
from carrierflex.blind_check.truth.mounting.state import MountingState
from carrierflex.blind_check.truth.mounting.time_integration import COARSE, FINE, Bushings


def digest(plans):
    """Digest of what every plan held before several causes had sizes of their own."""
    text = "\n".join(repr(astuple(plan)[:8]) for plan in plans)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


@pytest.mark.parametrize(
    ("kind", "families", "expected"),
    [
        ("carrier", None, "3245523361659701"),
        ("carrier", (FORM,), "3de002ed67451007"),
        ("mounting", None, "70d78dd2b87f0278"),
        ("mounting", (FORM,), "4d9c5ed1768463a7"),
    ],
)
def test_plans_of_every_earlier_seed_stay_what_they_were(kind, families, expected):
    plans = case_plans(kind, 40, 9041, *([families] if families else []))
    assert all(plan.family != SEVERAL and not plan.own_ratios for plan in plans)
    assert digest(plans) == expected


@pytest.mark.parametrize("kind", ["carrier", "mounting"])
def test_plans_hold_three_to_five_causes_of_classes_of_their_own(kind):
    plans = case_plans(kind, 90, 3, (SEVERAL,))
    assert plans == case_plans(kind, 90, 3, (SEVERAL,))
    assert [sum(len(plan.effects) == n for plan in plans) for n in (3, 4, 5)] == [30, 30, 30]
    forms = OTHER_FORMS if kind == "carrier" else MOUNTING_FORMS
    assert {name for plan in plans for name in plan.effects} == set(forms)
    for plan in plans:
        classes = [
            OTHER_FORMS[name].shape if kind == "carrier" else MOUNTING_FORMS[name].class_id
            for name in plan.effects
        ]
        assert len(set(classes)) == len(classes)
        assert len(set(classes) & set(STATIC_MAPS)) <= 1
        # Three lobes and planets that pass are the same tilt at order 3 to four sensors.
        has_lobes = not {"bounded_lobes", "stiffening_lobes"}.isdisjoint(plan.effects)
        assert not (has_lobes and "housing/planet_pass" in classes)
        assert plan.ratio == pytest.approx(np.hypot.reduce(plan.own_ratios))


def test_sizes_have_a_uniform_logarithm_and_know_nothing_of_one_another():
    plans = case_plans("carrier", 600, 4, (SEVERAL,))
    scaled = [
        np.log(np.array(plan.own_ratios) / SMALLEST_OWN) / np.log(LARGEST_OWN / SMALLEST_OWN)
        for plan in plans
    ]
    every = np.concatenate(scaled)
    counts, _ = np.histogram(every, bins=5, range=(0.0, 1.0))
    assert counts.sum() == every.size
    # Five standard deviations of a share of a fifth.
    np.testing.assert_allclose(counts / every.size, 0.2, atol=5.0 * np.sqrt(0.16 / every.size))
    first, second = np.array([case[:2] for case in scaled]).T
    assert abs(np.corrcoef(first, second)[0, 1]) < 5.0 / np.sqrt(len(plans))


def test_every_cause_of_a_carrier_leaves_alone_what_was_drawn():
    causes = ("bent_drift", "bounded_lobes", "torque_saddle")
    plan = CasePlan("carrier", 4, 77, SEVERAL, causes, 4.0, own_ratios=(1.3, 3.0, 2.0))
    _, label = case_campaign(plan)
    assert label.own_gaps == pytest.approx(plan.own_ratios, rel=1e-3)
    assert label.family == SEVERAL
    assert label.drive
    assert label.classes == (
        "carrier/waves/torque",
        "housing/offset/time",
        "housing/saddle/torque",
    )
    _, other = case_campaign(replace(plan, own_ratios=(1.3, 6.0, 2.0)))
    assert other.own_gaps == pytest.approx((1.3, 6.0, 2.0), rel=1e-3)


@pytest.mark.long
def test_a_form_that_the_loads_do_not_show_is_drawn_anew():
    # Every run has more torque than this tilt's first limit: it would be a constant one.
    causes = ("bounded_torque_tilt", "rooted_drift", "torque_saddle")
    limits = []
    for number in range(1, 9):
        plan = CasePlan("carrier", number, 941, SEVERAL, causes, 4.0, own_ratios=(2.0, 2.0, 3.0))
        _, label = case_campaign(plan)
        limits.append(label.own_gaps)
    np.testing.assert_allclose(limits, [[2.0, 2.0, 3.0]] * 8, rtol=1e-3)


def test_one_cause_that_the_loads_do_not_show_is_drawn_anew_too():
    # Of this seed the first tilt drawn would have to be 1e10 m for its gap.
    plan = case_plans("carrier", 100, 931, (FORM,))[29]
    assert plan.effects == ("bounded_torque_tilt",)
    campaign, label = case_campaign(plan)
    assert label.gap_over_floor == pytest.approx(plan.ratio, rel=0.05)
    largest = max(np.abs(signal).max() for run in campaign.runs for signal in run.signals.values())
    assert largest < 1e-3


@pytest.mark.long
def test_every_cause_of_a_mounting_leaves_alone_what_was_drawn_and_none_exceeds_its_form():
    causes = ("one_sided_stop", "turned_load", "warming")
    plan = CasePlan("mounting", 4, 77, SEVERAL, causes, 4.0, own_ratios=(5.0, 0.8, 2.0))
    _, label = case_campaign(plan)
    # What is said of the sizing: within 7 %, in coarser steps of time.
    assert label.own_gaps == pytest.approx(plan.own_ratios, rel=0.08)
    assert label.classes == ("bushings/restoring_force", "input_map", "time_variation")
    assert len(label.changes) == len(causes)
    # Triangle inequality: a stop stiffens what warming softens, so that the gap of all together may
    # be less than the largest, by the others at most (5 % for what one changes of another).
    largest, total = max(label.own_gaps), sum(label.own_gaps)
    assert 0.95 * (2.0 * largest - total) < label.gap_over_floor < 1.05 * total


@pytest.mark.long
def test_a_cause_whose_drawn_size_lets_the_housing_run_away_has_its_gap_all_the_same():
    # Rubber that warms: at its drawn size the motion grows to numbers that are still finite.
    causes = ("load_lever", "power_damping", "rubber", "warming")
    ratios = (4.9, 0.73, 4.6, 0.91)
    plan = CasePlan("mounting", 22, 14010, SEVERAL, causes, 7.0, own_ratios=ratios)
    _, label = case_campaign(plan)
    assert label.own_gaps == pytest.approx(ratios, rel=0.08)


@pytest.mark.long
def test_coarser_steps_leave_the_signals_of_a_small_cause_as_they_are():
    record = drawn_record(np.random.default_rng(2), 0)
    bushings = Bushings(RIG["bushing_radial_stiffness"], RIG["bushing_radial_damping"])
    state = MountingState(replace(bushings, excess=0.05))
    fine, coarse = (state.read(bodies(), [record], fine=n)[0] for n in (FINE, COARSE))
    assert np.abs(coarse - fine).max() < 1e-4 * np.abs(fine).max()


@pytest.mark.long
def test_a_main_bearing_that_hardly_gives_way_is_integrated_in_steps_that_it_bears():
    record = drawn_record(np.random.default_rng(2), 0)
    bushings = Bushings(RIG["bushing_radial_stiffness"], RIG["bushing_radial_damping"])
    stiff = MountingState(replace(bushings, compliance=2e-12))
    rigid = MountingState(bushings)
    signals, rigidly = (state.read(bodies(), [record])[0] for state in (stiff, rigid))
    assert np.abs(signals - rigidly).max() < 0.01 * np.abs(rigidly).max()


def rim_case(sensors):
    """Runs of three torques at such sensors, and a baseline of offsets alone."""
    rng = np.random.default_rng(2)
    loads = [(share, y, 0.0, 2.0) for share, y in ((1.0, 0.0), (0.5, 1e5), (0.75, -1e5))]
    records = [rim_record(rng, k, load, 24.0) for k, load in enumerate(loads)]
    records = [replace(record, sensors=np.array(sensors)[:, None]) for record in records]
    nothing = [np.zeros((len(sensors) * record.time.size, 0)) for record in records]
    return records, LinearBaseline(nothing, own_offset=True)


def signals_of(records, name, **values):
    drawn = drawn_form(name, np.random.default_rng(1)) | values
    return [other_form_signal(name, record, drawn) for record in records]


def test_lobes_are_planets_that_pass_to_four_sensors_and_not_to_five():
    """``cos 3(v - theta)``: where 3 v is -v beside a constant this is a tilt at order 3."""
    four, five = (np.deg2rad(47.0) + 2.0 * np.pi / n * np.arange(n) for n in (4, 5))
    for sensors, is_alias in ((four, True), (five, False)):
        records, baseline = rim_case(sensors)
        lobes = {"bounded_lobes": signals_of(records, "bounded_lobes", form_third=0.0)}
        result = alias_sets(lobes, records, baseline, 0.05e-5)
        assert (("housing/planet_pass",) in result) is is_alias
    # With a third wave of half the size nothing but lobes makes it.
    records, baseline = rim_case(four)
    lobes = {"bounded_lobes": signals_of(records, "bounded_lobes", form_third=0.5)}
    assert alias_sets(lobes, records, baseline, 0.05e-5) == ()
    # Planets that pass move an offset too, which lobes do not.
    passing = {"steady_pass": signals_of(records, "steady_pass", form_tilt=0.5)}
    assert alias_sets(passing, records, baseline, 0.05e-5) == ()


def test_each_of_several_causes_is_exchanged_by_itself():
    records, baseline = rim_case(np.deg2rad(47.0) + 0.5 * np.pi * np.arange(4))
    causes = {
        "bounded_lobes": signals_of(records, "bounded_lobes", form_third=0.0),
        "rooted_drift": signals_of(records, "rooted_drift"),
    }
    result = alias_sets(causes, records, baseline, 0.05e-5)
    assert result == (("housing/offset", "housing/planet_pass"),)
    # Of what leaves less than it may, every class is an alias.
    small = {name: [1e-3 * signal for signal in signals] for name, signals in causes.items()}
    assert len(alias_sets(small, records, baseline, 0.05e-5)) > 10
    assert alias_sets({}, records, baseline, 1.0) == ()
