"""Every fault changes what it says, and nothing else; what becomes of it is told rightly."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from carrierflex.blind_check.case_plans import case_plans
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.diagnosis.inference.results import NamedValue
from carrierflex.identification.campaign.declarations import Baseline
from studies import fault_outcomes as study
from studies.clean_campaigns import SORTS, clean_cases, clean_outcome
from studies.fault_answers import ANOTHER, PHYSICS, REPORTED, SILENT, answer_of, fault_answers
from studies.fault_outcomes import (
    DETECTED,
    EQUIVALENT,
    HARMLESS,
    MISSED,
    fault_outcomes,
)
from studies.fault_table import Fault, faults_of
from studies.practice_faults import practice_faults, unforeseen_faults
from tests.diagnosis.element.element_campaigns import displacement_campaign
from tests.identification.campaign_check.faulty_campaigns import faultless
from tests.identification.synthetic_campaigns import TRUTH, carrier_campaign, run_case
from tests.simulation.synthetic_curves import curve_set

CONTAINED = ("axial_offset", "housing_tilt", "carrier_tilt", "stiff_pins", "flexible_pins")


def explained_carrier():
    """Two runs that the baseline explains to the noise."""
    half = run_case("LC2", replace(TRUTH, d_x=6e-5), torque=180e3, condition="50 %")
    campaign = carrier_campaign([run_case("LC1"), half])
    return replace(campaign, baseline=Baseline("model", CONTAINED))


CAMPAIGNS = {
    "carrier": explained_carrier,
    "mounting": lambda: faultless("mounting"),
    "element": lambda: displacement_campaign(lambda q, v: 0.0 * q),
}


def content(campaign):
    """Everything that a fault may change, comparable."""
    runs = [
        (
            run.name,
            run.time.tobytes(),
            {name: values.tobytes() for name, values in run.columns().items()},
        )
        for run in campaign.runs
    ]
    return runs, campaign.channels, dict(campaign.rig)


@pytest.mark.parametrize("kind", list(CAMPAIGNS))
def test_every_fault_changes_a_copy_of_the_campaign(kind):
    campaign = CAMPAIGNS[kind]()
    before = content(campaign)
    faults = faults_of(kind)
    assert len({(fault.name, fault.size) for fault in faults}) == len(faults)
    for fault in faults:
        faulty = fault.change(campaign, np.random.default_rng(1))
        assert content(campaign) == before, fault.name
        if fault.name == "signals of two runs exchanged" and len(campaign.runs) < 2:
            continue
        if "loads" in fault.name and not any(
            run.inputs[name].any() for run in campaign.runs for name in ("ntl_y", "ntl_z")
        ):
            continue
        assert content(faulty) != before, (fault.name, fault.size)


#: Errors that change no record: names of conditions, order of runs, what the rig does not declare.
UNCHANGED = ("mass in grams", "axial stiffness")


@pytest.mark.parametrize("kind", list(CAMPAIGNS))
def test_every_error_of_practice_changes_a_copy_of_the_campaign(kind):
    campaign = CAMPAIGNS[kind]()
    # A floor of zero hides what is added in floors.
    channels = tuple(replace(one, noise_std=one.noise_std or 1e-6) for one in campaign.channels)
    campaign = replace(campaign, channels=channels)
    before = content(campaign), [run.condition for run in campaign.runs]
    faults = (*practice_faults(kind, None), *unforeseen_faults())
    assert len({(fault.name, fault.size) for fault in faults}) == len(faults)
    for fault in faults:
        is_radial = "radial" in fault.name
        if fault.name.startswith("columns") or fault.name in UNCHANGED or is_radial:
            continue
        if fault.name == "names of runs repeated" and len(campaign.runs) > 1:
            with pytest.raises(ValueError, match="different names"):
                fault.change(campaign, np.random.default_rng(1))
            continue
        if len(campaign.runs) == 1 and fault.name.startswith(("names", "order", "conditions")):
            continue
        faulty = fault.change(campaign, np.random.default_rng(1))
        assert (content(campaign), [run.condition for run in campaign.runs]) == before, fault.name
        after = content(faulty), [run.condition for run in faulty.runs]
        assert after != before, (fault.name, fault.size)


@pytest.mark.parametrize(
    ("verdict", "classes", "ties", "reported", "expected"),
    [
        ("class_named", ("housing/tilt/torque",), (), (), SILENT),
        ("class_named", ("housing/tilt/torque", "carrier/waves/torque"), (), (), PHYSICS),
        ("class_named", ("carrier/waves/torque",), (), ("wiring/load_zero",), REPORTED),
        ("class_named", ("carrier/waves/torque",), (), ("wiring/encoder",), PHYSICS),
        ("aliased", ("carrier/waves/torque",), ("wiring/encoder",), ("wiring/encoder",), ANOTHER),
        ("aliased", ("carrier/waves/torque",), ("wiring/load_zero",), (), REPORTED),
        ("class_named", ("channel/gain/none",), (), (), SILENT),
        ("none_of_these", ("carrier/waves/torque",), (), (), SILENT),
        ("class_named", ("housing/tilt/radial_load",), (), (), SILENT),
    ],
)
def test_physics_beyond_the_true_cause_counts_where_the_error_is_not_reported(
    verdict, classes, ties, reported, expected
):
    label = SimpleNamespace(
        effects=("ntl_tilt",), classes=("housing/tilt/torque",), acceptable=(), class_aliases=()
    )
    fault = Fault("zero", "5 %", lambda campaign, rng: campaign, ("wiring/load_zero",))
    diagnosis = SimpleNamespace(
        verdict=verdict,
        reason_id="",
        attribution=SimpleNamespace(effects=(), aliases=(ties,) if ties else ()),
        class_ids=classes,
        classes=SimpleNamespace(classes_of_law={"ntl_tilt": ("housing/tilt/radial_load",)}),
    )
    new = [SimpleNamespace(id=name, check="wiring") for name in reported]
    assert answer_of(fault, label, diagnosis, new) == expected


@pytest.mark.parametrize(
    ("classes", "expected"), [((), HARMLESS), (("carrier/waves/torque",), PHYSICS)]
)
def test_right_records_need_no_finding_but_no_false_law_either(classes, expected):
    label = SimpleNamespace(effects=(), classes=(), acceptable=(), class_aliases=())
    diagnosis = SimpleNamespace(
        verdict="class_named",
        reason_id="",
        attribution=SimpleNamespace(effects=(), aliases=()),
        class_ids=classes,
        classes=None,
    )
    cut = Fault("cut", "-", lambda campaign, rng: campaign)
    assert answer_of(cut, label, diagnosis, []) == expected


def test_a_drifting_clock_is_late_by_its_drift_at_the_end_of_the_last_run_alone():
    campaign = explained_carrier()
    fault = next(f for f in faults_of("carrier") if f.name.startswith("clock") and "50" in f.size)
    faulty = fault.change(campaign, np.random.default_rng(1))
    first, last = campaign.runs
    name = campaign.channels[0].name
    np.testing.assert_array_equal(faulty.runs[0].signals[name], first.signals[name])
    late = CubicSpline(last.time, last.signals[name])(last.time - 0.05)
    moved = faulty.runs[1].signals[name]
    assert moved[0] == last.signals[name][0]
    np.testing.assert_allclose(moved[-1], late[-1], rtol=1e-12)


@pytest.mark.long
def test_outcomes_are_told_by_checks_by_names_and_by_what_moved(monkeypatch):
    """A turned torque is told; no change is harmless; what no check tells is a miss."""
    campaign = explained_carrier()
    curves = curve_set()
    faults = {fault.name: fault for fault in faults_of("carrier")}
    nothing = Fault("nothing", "-", lambda campaign, rng: campaign)
    chosen = [faults["sign of the load turned"], nothing]
    turned, harmless = fault_outcomes(campaign, chosen, 1, curves)
    assert (turned.outcome, turned.by) == (DETECTED, ("torque_sign",))
    assert (harmless.outcome, harmless.by) == (HARMLESS, ())
    monkeypatch.setattr(study, "_records_checks", lambda campaign, curves: set())
    monkeypatch.setattr(study, "_baseline_checks", lambda campaign, curves: set())
    (equivalent,) = fault_outcomes(campaign, [faults["gain of an input"]], 1, curves)
    # A larger torque on this carrier is the same torque on a softer one.
    assert equivalent.outcome == EQUIVALENT
    assert any("rho_" in text for text in equivalent.by)
    late = fault_outcomes(campaign, [faults["clock of one file drifts"]], 1, curves)
    assert [outcome.outcome for outcome in late] == [MISSED]


def test_clean_campaigns_are_two_hundred():
    sorts = [case.sort for case in clean_cases(1)]
    assert [sorts.count(sort) for sort in SORTS] == [125, 55, 20]


@pytest.mark.long
def test_a_softer_axial_bushing_ties_with_the_load_across_it():
    # Both change the yaw under that load and nothing else: one parameter, two names.
    case = next(
        case for case in clean_cases(303) if case.plan.effects == ("axial_bushing_stiffness",)
    )
    outcome = clean_outcome(case, None)
    assert outcome.change == "named -> aliased"
    assert outcome.findings == ("wiring/input_gain",)
    assert outcome.is_tie


@pytest.mark.parametrize(
    ("class_id", "expected"),
    [("channel/gain/none", DETECTED), ("housing/tilt/torque", MISSED)],
)
def test_a_fault_is_told_where_its_class_is_named(class_id, expected):
    fault = next(fault for fault in faults_of("carrier") if "sensor_gain" in fault.ids)
    nothing = SimpleNamespace(effects=(), parameters={})
    classes = SimpleNamespace(
        classes=(SimpleNamespace(id=class_id),),
        classes_of_law={"sensor_gain": ("channel/gain/none",), "x": ("housing/tilt/torque",)},
    )
    before = SimpleNamespace(verdict="at_noise_floor", attribution=nothing, classes=None)
    after = SimpleNamespace(verdict="class_named", attribution=nothing, classes=classes)
    outcome, by = study._consequence(
        fault, study._Answer(before, np.ones(24)), study._Answer(after, 2.0 * np.ones(24))
    )
    assert outcome == expected
    assert expected == MISSED or by == {class_id}


EVEN, UNEVEN = np.full(24, 0.05), 0.05 + 0.2 * np.resize([1.0, -1.0], 24)


@pytest.mark.parametrize(
    ("more", "expected"),
    [(0.0, EQUIVALENT), (-EVEN, EQUIVALENT), (UNEVEN, EQUIVALENT), (EVEN, MISSED)],
)
def test_records_that_the_baseline_fits_as_well_or_better_are_another_machines(more, expected):
    """A delay under one sine is damping, and reading between samples takes noise away."""
    fault = next(fault for fault in faults_of("element") if fault.name == "constant delay")

    def answer(damping):
        value = NamedValue(damping, 0.5, "N s/m", (damping - 1.0, damping + 1.0))
        attribution = SimpleNamespace(effects=(), parameters={"baseline": {"C1": value}})
        return SimpleNamespace(verdict="at_noise_floor", attribution=attribution, classes=None)

    outcome, by = study._consequence(
        fault,
        study._Answer(answer(200.0), np.ones(24)),
        study._Answer(answer(120.0), np.ones(24) + more),
    )
    assert (outcome, by) == (expected, {"baseline.C1 by 80.0"})


@pytest.mark.long
@pytest.mark.parametrize("name", ["load 10 % up in one run", "linear drift"])
def test_an_error_beside_a_class_is_told_and_the_class_stays(name):
    """A damping that follows the place, as no law of the library does."""
    plans = case_plans("element", 120, 310)
    damped = [plan for plan in plans if plan.effects == ("exponential_coupling",)]
    clean, label = case_campaign(next(plan for plan in damped if plan.ratio > 20.0))
    (fault,) = [one for one in practice_faults("element", None) if one.name == name]
    (outcome,) = fault_answers(clean, label, [fault], 310, None)
    assert outcome.outcome == REPORTED
    assert any("coupled_damping" in words for words in outcome.by)
