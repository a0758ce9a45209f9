"""Errors of wiring and sign are found as rivals, and the verdict says to check the wiring first."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.interpolate import CubicSpline

from carrierflex.blind_check.labels import NOTHING, CasePlan
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.diagnosis.baseline_check import BaselineCheck, checked_baseline, with_findings
from carrierflex.diagnosis.carrier import wiring as carrier_wiring
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.inference.results import Attribution, GapReduction
from carrierflex.diagnosis.kinds import problem_of
from carrierflex.diagnosis.report.verdict_words import headlines, verdict_heading
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.diagnosis.wiring.refits import (
    Fault,
)
from carrierflex.identification.campaign.declarations import Baseline, KnownValue
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning
from carrierflex.workflows.diagnosis.examination import examined
from tests.diagnosis.element.element_campaigns import displacement_campaign
from tests.identification.campaign_check.faulty_campaigns import changed, faultless, with_channels
from tests.identification.synthetic_campaigns import TRUTH, carrier_campaign, run_case
from tests.simulation.synthetic_curves import curve_set

CONTAINED = ("axial_offset", "housing_tilt", "carrier_tilt", "stiff_pins", "flexible_pins")


@cache
def explained_carrier():
    """Two runs that the baseline explains to the noise."""
    half = run_case("LC2", replace(TRUTH, d_x=6e-5), torque=180e3, condition="50 %")
    campaign = carrier_campaign([run_case("LC1"), half])
    return replace(campaign, baseline=Baseline("model", CONTAINED))


def explained(kind):
    """Campaign of a kind that its baseline explains to the noise."""
    if kind == "driven":
        return displacement_campaign(lambda q, v: 0.0 * q)
    return explained_carrier() if kind == "carrier" else faultless(kind)


def checked(campaign):
    curves = curve_set() if campaign.kind == "carrier" else None
    problem = problem_of(campaign, curves)
    return checked_baseline(problem, campaign, problem.wiring(campaign))


def rivals(campaign):
    """Share that each rival explains, by its id."""
    return {rival.id: share for rival, share in checked(campaign).rivals}


def exchanged(campaign, first, second):
    def of(run):
        signals = {**run.signals, first: run.signals[second], second: run.signals[first]}
        return replace(run, signals=signals)

    return replace(campaign, runs=tuple(of(run) for run in campaign.runs))


def negative(values):
    return -values


def test_another_simulators_prediction_has_no_clock_of_ours():
    campaign = explained_carrier()
    runs = tuple(
        replace(run, predictions={name: 0.5 * values for name, values in run.signals.items()})
        for run in campaign.runs
    )
    predicted = replace(campaign, runs=runs, baseline=Baseline("columns", ("axial_offset",)))
    names = {warning.check for warning in checked(predicted).warnings}
    assert names <= {"wiring", "bound"}


@pytest.mark.parametrize("kind", ["carrier", "mounting", "element", "driven"])
def test_a_campaign_without_a_fault_has_no_rival(kind):
    campaign = explained(kind)
    assert rivals(campaign) == {}


@pytest.mark.long
def test_no_wiring_explains_a_gap_by_a_value_that_the_baseline_holds():
    # A stiffer carrier is the cause; a rival that frees the held value has explained it as well.
    campaign = explained_carrier()
    fixed = {"flexible_pins.rho_f": KnownValue(0.5 * TRUTH.rho_f, 0.0)}
    assert rivals(replace(campaign, baseline=replace(campaign.baseline, fixed=fixed))) == {}


@pytest.mark.long
@pytest.mark.parametrize(
    ("kind", "column", "rival"),
    [
        ("carrier", "torque", "wiring/torque_sign"),
        ("carrier", "carrier_angle", "wiring/angle_direction"),
        ("mounting", "torque", "wiring/torque_sign"),
        pytest.param("mounting", "ntl_z", "wiring/torque_sign", marks=pytest.mark.long),
        ("element", "force", "wiring/torque_sign"),
        ("driven", "displacement", "wiring/torque_sign"),
    ],
)
def test_a_turned_sign_explains_the_gap(kind, column, rival):
    campaign = explained(kind)
    assert rivals(changed(campaign, column, negative))[rival] > 0.95


EXCHANGED = [
    ("carrier", ("s047", "s137")),
    pytest.param("mounting", ("ssz", "spz"), marks=pytest.mark.long),
]


@pytest.mark.parametrize(("kind", "pair"), EXCHANGED)
def test_exchanged_sensors_explain_the_gap(kind, pair):
    campaign = explained(kind)
    wrong = checked(exchanged(campaign, *pair))
    result = {rival.id: (rival.about, share) for rival, share in wrong.rivals}
    about, share = result["wiring/sensor_order"]
    assert set(about.split(", ")) == set(pair)
    assert share > 0.95


def test_a_load_a_little_too_large_beside_the_others_is_told_once():
    check = checked(changed(explained("mounting"), "torque", lambda values: 1.05 * values))
    (rival,) = [rival for rival, _ in check.rivals if rival.id == Fault.INPUT_GAIN]
    assert rival.about == "torque"
    assert float(rival.text.split()[1]) == pytest.approx(1.0 / 1.05, rel=0.02)


def test_a_delay_of_a_mounting_below_the_gap_is_told():
    """A fifth of a step: bushings a little softer in damping make up for it."""
    campaign = explained("mounting")
    delay = 0.2 * campaign.runs[0].time[1]

    def late(run):
        signals = {
            name: CubicSpline(run.time, values)(run.time - delay)
            for name, values in run.signals.items()
        }
        return replace(run, signals=signals)

    assert checked(campaign).warnings == ()
    result = checked(replace(campaign, runs=tuple(late(run) for run in campaign.runs)))
    assert "delay" in {warning.check for warning in result.warnings} or result.rivals


def test_records_that_would_fill_the_memory_are_said_to_be_unchecked(monkeypatch):
    campaign = explained("carrier")
    problem = problem_of(campaign, curve_set())
    assert problem.wiring(campaign).unchecked == ""
    assert len(problem.wiring(campaign).predictions(None)) == len(campaign.runs)
    monkeypatch.setattr(carrier_wiring, "IN_MEMORY", 500)
    assert problem.wiring(campaign).unchecked.startswith("records and prediction")
    assert problem.wiring(campaign).predictions(None) == ()


@pytest.mark.parametrize("column", ["s047", "s137"])
def test_a_gain_of_a_carriers_sensor_below_the_gap_is_told(column):
    """Offsets and tilts make up for most of it; a larger one leaves a gap and is an effect."""
    campaign = explained("carrier")
    assert checked(campaign).warnings == ()
    (warning,) = checked(changed(campaign, column, lambda values: 1.025 * values)).warnings
    assert (warning.check, warning.about) == ("gain", column)
    assert warning.figure == pytest.approx(0.025, rel=0.1)


def test_of_a_long_run_every_second_sample_tells_the_gain(monkeypatch):
    campaign = changed(explained("carrier"), "s047", lambda values: 1.025 * values)
    problem = problem_of(campaign, curve_set())
    (full, _) = problem.wiring(campaign).linear(None)
    monkeypatch.setattr(carrier_wiring, "IN_MEMORY", full.columns.nbytes - 1)
    (half, _) = problem.wiring(campaign).linear(None)
    assert_allclose(half.time, full.time[::2])
    assert_allclose(half.columns, full.columns[:, ::2])
    (warning,) = checked(campaign).warnings
    assert (warning.check, warning.about) == ("gain", "s047")
    assert warning.figure == pytest.approx(0.025, rel=0.1)


@pytest.mark.long
@pytest.mark.parametrize("kind", ["carrier", "element"])
def test_a_clock_that_drifts_in_one_file_is_told_of_that_file_alone(kind):
    campaign = explained(kind)
    late = campaign.runs[-1]
    delay = {"carrier": 0.05, "element": 0.005}[kind] * late.time / late.time[-1]
    signals = {
        name: np.interp(late.time - delay, late.time, values)
        for name, values in late.signals.items()
    }
    runs = (*campaign.runs[:-1], replace(late, signals=signals))
    wrong = checked(replace(campaign, runs=runs))
    result = [rival.about for rival, _ in wrong.rivals if rival.id == "wiring/clock"]
    assert result == [late.name]


def test_a_parameter_of_the_baseline_on_its_bound_is_told():
    result = checked(changed(explained_carrier(), "torque", negative)).warnings
    assert {"rho_s", "rho_f"} & {warning.about for warning in result if warning.check == "bound"}


def test_declared_noise_above_the_whole_gap_is_told():
    campaign = faultless("element")
    loud = with_channels(campaign, noise_std=10.0 * campaign.channels[0].noise_std)
    assert [warning.check for warning in checked(loud).warnings] == ["declared_noise"]


@pytest.mark.long
def test_the_verdict_says_to_check_the_wiring_first():
    campaign = changed(explained_carrier(), "torque", negative)
    problem = problem_of(campaign, curve_set())
    result = diagnose(problem, campaign="twin", kind="carrier")
    baseline = checked_baseline(problem, campaign, problem.wiring(campaign))
    diagnosis = with_findings(result, (), baseline)
    assert (diagnosis.verdict, diagnosis.attribution.effects) == ("none_of_these", ())
    assert any(warning.check == "wiring" for warning in diagnosis.warnings)
    assert diagnosis.reason_id == "wiring/torque_sign"
    assert diagnosis.reason.startswith(
        "check the measurement first: with torque of the other sign the "
    )
    assert diagnosis.warnings[0].check == "wiring"
    assert verdict_heading(diagnosis).startswith("Check torque first (torque sign): ")


def late(campaign, seconds):
    """Campaign whose signals lag, beside the prediction of a simulator without a delay."""

    def of(run):
        signals = {
            name: np.interp(run.time - seconds, run.time, values)
            for name, values in run.signals.items()
        }
        return replace(run, signals=signals, predictions=dict(run.signals))

    runs = tuple(of(run) for run in campaign.runs)
    return replace(campaign, runs=runs, baseline=Baseline("columns"))


@pytest.mark.long
def test_a_delay_beside_a_clock_that_was_moved_is_an_alias_of_it():
    campaign = late(faultless("element"), 2e-3)
    alone = examined(campaign).diagnosis()
    assert alone.attribution.effects == ("sensor_delay",)
    assert "wiring/clock_shift" not in sum(alone.attribution.aliases, ())
    shifts = {campaign.runs[0].name: KnownValue(0.7, 1e-4)}
    moved = replace(campaign, baseline=replace(campaign.baseline, clock_shift=shifts))
    diagnosis = examined(moved).diagnosis()
    assert diagnosis.verdict == "aliased"
    assert ("sensor_delay", "wiring/clock_shift") in diagnosis.attribution.aliases
    assert "moved the simulator's clock by 700" in diagnosis.reason
    # Nothing that is measured has changed: the same effect with the same value.
    assert diagnosis.attribution.effects == alone.attribution.effects
    fault = "a fault of the measurement (clock shift)"
    assert f"one of sensor delay; {fault}" in headlines(diagnosis)[1]


def test_a_moved_clock_is_no_rival_of_an_effect_that_is_no_delay():
    nothing = Attribution(("carrier_tilt",), (), {}, (), "")
    reduction = GapReduction(**dict.fromkeys(GapReduction.__dataclass_fields__, 0.0))
    named = Diagnosis("c", "carrier", "named", "why", "m", nothing, reduction)
    shift = CampaignWarning("clock_shift", "sensor_delay", "moved", "measure", 0.7, "line")
    diagnosis = with_findings(named, (shift,), BaselineCheck((), ()))
    assert diagnosis.verdict == "named"
    delayed = replace(named, attribution=replace(nothing, effects=("sensor_delay",)))
    assert with_findings(delayed, (shift,), BaselineCheck((), ())).verdict == "aliased"


def with_runs_exchanged(campaign):
    """Campaign whose first two runs of one length have each other's signals."""
    first, second, *others = campaign.runs
    assert first.time.size == second.time.size
    swapped = (replace(first, signals=second.signals), replace(second, signals=first.signals))
    return replace(campaign, runs=(*swapped, *others))


@pytest.mark.parametrize("kind", ["carrier", pytest.param("mounting", marks=pytest.mark.long)])
def test_signals_filed_under_another_run_explain_the_gap(kind):
    campaign = explained(kind)
    check = checked(with_runs_exchanged(campaign))
    shares = {rival.id: share for rival, share in check.rivals}
    assert shares["wiring/run_order"] > 0.95
    rival = next(rival for rival, _ in check.rivals if rival.id == "wiring/run_order")
    assert all(run.name in rival.text for run in campaign.runs[:2])


def test_runs_of_different_length_are_never_exchanged():
    campaign = explained("carrier")
    first, *others = with_runs_exchanged(campaign).runs
    n = first.time.size - 1
    shorter = replace(
        first,
        time=first.time[:n],
        inputs={name: values[:n] for name, values in first.inputs.items()},
        signals={name: values[:n] for name, values in first.signals.items()},
    )
    assert "wiring/run_order" not in rivals(replace(campaign, runs=(shorter, *others)))


@pytest.mark.long
def test_a_load_that_is_too_large_beside_the_others_explains_the_gap():
    campaign = explained("mounting")
    check = checked(changed(campaign, "torque", lambda values: 1.3 * values))
    shares = {rival.about: share for rival, share in check.rivals if rival.id == Fault.INPUT_GAIN}
    assert shares["torque"] > 0.9
    text = next(r.text for r, _ in check.rivals if (r.id, r.about) == (Fault.INPUT_GAIN, "torque"))
    assert float(text.split()[1]) == pytest.approx(1.0 / 1.3, rel=0.1)


@pytest.mark.long
def test_a_delay_that_opens_a_gap_once_it_is_put_back_is_not_told():
    """Under a sine the slopes find a delay of 17 ms nine deviations out; put back it fits nothing.

    Delay, damping and mass turn one phase: far from the fit their slopes say nothing.
    """
    campaign = case_campaign(CasePlan("element", 3, 3, NOTHING, (), 0.0, "sines"))[0]
    assert checked(campaign).warnings == ()
