"""From which gap wiring is looked at, what is told of it, and when a cause is its alias."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from carrierflex.diagnosis.baseline_check import BaselineCheck, checked_baseline, with_findings
from carrierflex.diagnosis.comparison.problem import BASELINE, Parameter
from carrierflex.diagnosis.inference.results import (
    ALIASED,
    AT_NOISE_FLOOR,
    CLASS_NAMED,
    FLOOR_UNKNOWN,
    NAMED,
    NAMED_WITH_REMAINDER,
    NONE_OF_THESE,
    NOT_DIAGNOSABLE,
    Attribution,
    GapReduction,
)
from carrierflex.diagnosis.report.verdict_words import headlines, verdict_heading
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.diagnosis.wiring.linear_records import LinearRecord
from carrierflex.diagnosis.wiring.refits import (
    ClockDrift,
    PredictedRecord,
    WiringChecks,
    WiringRival,
)
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning
from tests.diagnosis.inference.toy_problem import linear_problem

STEP = 0.01
#: Runs of different length: none could be exchanged for the other.
TIMES = {"A": STEP * np.arange(1000), "B": STEP * np.arange(900)}
NOISE = 1e-3
#: A floor of one.
PROBLEM = SimpleNamespace(
    noise_floor_square=1.0,
    cell_counts=np.full((4, 1), 25.0),
    baseline_findings=lambda values: (),
)
THETA = np.array([1.0, 2.0])


def signal(time):
    return np.sin(2.0 * np.pi * time)


def slope(time):
    return 2.0 * np.pi * np.cos(2.0 * np.pi * time)


def campaign(names="AB", noise_std=(1.0,)):
    channels = tuple(
        Channel(f"q{k}", "displacement", "m", noise_std=std) for k, std in enumerate(noise_std)
    )
    runs = tuple(
        Run(
            name,
            f"{name}.csv",
            "slow",
            TIMES[name],
            {"force": signal(TIMES[name])},
            {channel.name: signal(TIMES[name]) for channel in channels},
        )
        for name in names
    )
    rig = {"drive": "force"}
    return Campaign("element", "toy", Baseline("model"), rig, channels, runs)


def predicted(name):
    noise = NOISE * np.random.default_rng(len(name)).standard_normal((TIMES[name].size, 1))
    return PredictedRecord(
        name, TIMES[name], signal(TIMES[name])[:, None] + noise, signal(TIMES[name])[:, None]
    )


def late_record(name, *, delay=0.0, drift=0.0, noise=NOISE):
    """Run beside a baseline that knows its gain, whose signals are late or ever later."""
    time = TIMES[name]
    along = (time - time.mean()) / np.ptp(time)
    scatter = noise * np.random.default_rng(3).standard_normal(time.size)
    residual = scatter - (delay + drift * along) * slope(time)
    columns = signal(time)[None, :, None]
    return LinearRecord(name, time, residual[:, None], signal(time)[:, None], columns)


def fit_leaving(mean_square, parameters=(), values=()):
    square = np.full(4, 25.0 * mean_square)
    theta = np.array(values) if parameters else THETA
    sums = SimpleNamespace(square=square)
    return SimpleNamespace(parameters=parameters, theta=theta, sums=sums, known={})


def rival(mean_square, about="torque"):
    text = f"the {about} of the other sign"
    return WiringRival("wiring/torque_sign", about, text, mean_square, "a line")


def checked(
    before, *, rivals=(), records="", refits=np.inf, linear=(), late=(), names="AB", **options
):
    """Check of a baseline that leaves `before` floors, and how often it was fitted again."""
    refitted = []

    def fitted_again(again):
        refitted.append(again)
        return refits

    def of_fit(theta, result):
        assert theta is THETA
        return result

    checks = WiringChecks(
        rivals=lambda: tuple(rivals),
        predictions=lambda theta: of_fit(theta, tuple(map(predicted, records))),
        refitted=fitted_again,
        linear=lambda theta: of_fit(theta, linear),
        late=lambda: late,
    )
    fit = options.pop("fit", None) or fit_leaving(before)
    check = checked_baseline(PROBLEM, campaign(names, **options), checks, fit)
    return check, len(refitted)


def warning_texts(check):
    return {(warning.check, warning.about): warning.text for warning in check.warnings}


def test_wiring_is_looked_at_beyond_a_gap():
    assert checked(1.2, rivals=[rival(0.0)])[0].rivals == ()
    assert len(checked(1.21, rivals=[rival(0.0)])[0].rivals) == 1


def test_the_baseline_is_fitted_where_no_fit_is_given():
    problem = linear_problem({})
    nothing = WiringChecks(lambda: (), lambda theta: (), lambda campaign: np.inf)
    check = checked_baseline(problem, campaign(), nothing)
    assert (check.warnings, check.rivals) == ((), ())


def test_a_wiring_that_explains_half_of_the_gap_is_told():
    # Nine floors are left, eight of gap.
    (result,) = checked(9.0, rivals=[rival(5.0), rival(5.01, "angle")])[0].rivals
    assert (result[0].about, result[1]) == ("torque", 0.5)
    check, _ = checked(9.0, rivals=[rival(3.0)])
    (warning,) = check.warnings
    assert warning.text == (
        "with the torque of the other sign the baseline alone explains 75% of the gap above the "
        "floor"
    )
    assert warning.remedy == "check first: torque sign"
    assert (warning.check, warning.about, warning.figure) == ("wiring", "torque", 0.75)


def test_a_baseline_that_runs_away_is_explained_by_a_wiring_with_which_it_does_not():
    check, refits = checked(np.inf, rivals=[rival(3.0)], records="A", names="A")
    assert [share for _, share in check.rivals] == [1.0]
    assert refits == 0


def test_another_simulators_prediction_has_no_clock_to_be_put_back():
    late = [ClockDrift("A", 0.0, 0.1), ClockDrift("", 0.1, 0.0)]
    check, refits = checked(9.0, refits=1.0, late=late)
    assert (check.warnings, check.rivals, refits) == ((), (), 0)


def test_signals_that_are_late_below_the_gap_are_told():
    check, _ = checked(1.0, linear=[late_record("A", delay=0.002)], refits=1.2)
    (warning,) = check.warnings
    assert (warning.check, warning.about, warning.line) == ("delay", "all channels", "run files")
    assert warning.remedy.startswith("look for filters and clocks between inputs and signals")
    text = warning.text
    assert text.startswith("the signals are 2 ms behind the inputs, ")
    assert text.endswith(" standard deviations")
    early = warning_texts(checked(1.0, linear=[late_record("A", delay=-0.002)], refits=1.2)[0])
    assert early["delay", "all channels"].startswith("the signals are 2 ms before the inputs")
    # Put back, a gap is open that was none: the slopes said nothing.
    assert warning_texts(checked(1.0, linear=[late_record("A", delay=0.002)], refits=1.21)[0]) == {}


def test_a_small_part_of_a_step_is_no_delay():
    # Of 10 ms a twentieth.
    for delay, is_told in ((0.00055, True), (0.00045, False)):
        records = [late_record("A", delay=delay, noise=1e-4)]
        assert bool(warning_texts(checked(1.0, linear=records, refits=1.0)[0])) is is_told


def test_clocks_that_drift_below_the_gap_are_told_by_run_without_another_fit():
    check, refits = checked(
        1.0, linear=[late_record("A"), late_record("B", drift=0.02)], refits=9.0
    )
    ((key, text),) = warning_texts(check).items()
    assert key == ("clock", "B")
    assert text.startswith("the clocks of signals and inputs drift apart by 20 ms over run B, ")
    assert refits == 0


def test_a_clock_that_drifts_beside_a_gap_is_a_rival_by_what_it_explains():
    # RMS of a delay that grows by 20 ms, times that of the slope; noise of half of it.
    rms = 0.02 / np.sqrt(12.0) * np.sqrt(2.0) * np.pi
    records = [late_record("A", drift=0.02, noise=rms / 2.0)]
    check, _ = checked(9.0, linear=records, records="A", names="A")
    ((result, share),) = check.rivals
    assert (result.id, result.about) == ("wiring/clock", "A")
    assert result.text.startswith("a clock that drifts by 20")
    assert result.text.endswith(" ms over run A")
    # 4/5 of nine floors, of a gap of eight.
    assert share == pytest.approx(0.9, abs=0.03)
    assert share == pytest.approx((9.0 - result.mean_square) / 8.0)
    small = [late_record("A", drift=0.00045, noise=1e-4)]
    assert checked(9.0, linear=small, records="A", names="A")[0].rivals == ()
    large = [late_record("A", drift=0.00055, noise=1e-4)]
    assert len(checked(9.0, linear=large, records="A", names="A")[0].rivals) == 1
    # Where the baseline cannot be made linear there is no such look.
    assert checked(9.0, records="A", names="A")[0].rivals == ()


def test_of_two_looks_at_one_run_the_better_counts():
    exact = [late_record("A", drift=0.02, noise=1e-5)]
    late = [ClockDrift("A", 0.0, 0.03)]
    for refit_square, drift in ((4.0, "20 ms"), (0.0, "30 ms")):
        check, _ = checked(
            9.0, linear=exact, records="A", names="A", late=late, refits=refit_square
        )
        # Every refit leaves the same here, that without a drift of the zeros too.
        (result,) = [rival for rival, _ in check.rivals if rival.id == "wiring/clock"]
        assert result.about == "A"
        assert drift in result.text
        assert result.mean_square < 0.01


def test_a_guess_stands_where_it_leaves_three_hundredths_of_the_gap():
    late = [ClockDrift("A", 0.0, 0.03)]
    # Of a gap of eight floors 0.24.
    assert checked(9.0, records="A", names="A", late=late, refits=1.23)[1] == 1
    assert checked(9.0, records="A", names="A", late=late, refits=1.25)[1] > 1


def test_a_delay_that_no_fit_finds_its_way_back_from_is_told_where_it_explains_the_gap():
    def checked_delay(delay, mean_square, run=""):
        late = [ClockDrift(run, delay, 0.0)]
        return checked(9.0, records="A", names="A", late=late, refits=mean_square)[0]

    assert warning_texts(checked_delay(0.0301, 5.0)) == {
        ("delay", "all channels"): (
            "the signals are 30 ms behind the inputs, put back, the baseline alone explains 50% of "
            "the gap"
        )
    }
    assert (
        "before the inputs" in warning_texts(checked_delay(-0.0301, 3.0))["delay", "all channels"]
    )
    assert warning_texts(checked_delay(0.0301, 5.01)) == {}
    # Less than three steps is an effect of the library.
    assert warning_texts(checked_delay(0.0299, 3.0)) == {}
    # The clock of one run is a rival, no delay of all signals.
    check = checked_delay(0.0301, 3.0, "A")
    assert {key[0] for key in warning_texts(check)} == {"wiring"}
    assert [rival.id for rival, _ in check.rivals] == ["wiring/clock"]
    assert check.rivals[0][0].text == "a clock that is 30.1 ms off in run A"
    assert checked_delay(0.0301, 3.0).rivals == ()
    assert checked_delay(0.0301, np.inf, "A").rivals == ()


def test_what_was_not_looked_for_is_told_where_there_is_a_gap():
    checks = WiringChecks(
        lambda: (), lambda theta: (), lambda again: np.inf, unchecked="records take 2000 MB"
    )
    (warning,) = checked_baseline(PROBLEM, campaign(), checks, fit_leaving(2.0)).warnings
    assert (warning.check, warning.about) == ("unchecked", "all runs")
    assert warning.text.endswith("were not looked for: records take 2000 MB")
    assert warning.remedy == "run carrierflex check on a copy of the folder with fewer [[runs]]"
    assert checked_baseline(PROBLEM, campaign(), checks, fit_leaving(1.0)).warnings == ()


def test_a_clock_that_drifts_is_found_in_records_too_large_to_lie_beside_their_prediction():
    linear = [late_record("A"), late_record("B", drift=0.02)]
    check, _ = checked(9.0, linear=linear, records="")
    assert [(rival.id, rival.about) for rival, _ in check.rivals] == [("wiring/clock", "B")]


def parameter(name, lower=0.0, upper=np.inf, effect=BASELINE, **options):
    return Parameter(name, "kg", lower, upper, 2.0, effect=effect, **options)


def bounds_told(*pairs):
    parameters = tuple(unknown for unknown, _ in pairs)
    fit = fit_leaving(1.0, parameters, [value for _, value in pairs])
    checks = WiringChecks(lambda: (), lambda theta: (), lambda campaign: np.inf)
    check = checked_baseline(PROBLEM, campaign(), checks, fit)
    bounds = [warning for warning in check.warnings if warning.check == "bound"]
    assert all(warning.remedy.startswith("no physical value fits: check") for warning in bounds)
    return {warning.about: warning.text for warning in bounds}


def test_a_mass_of_zero_is_physical_and_nothing_but_zeros_is_not():
    m, k = parameter("m"), parameter("K1")
    shift = parameter("shift", -1.0, 1.0)
    assert bounds_told((m, 0.0), (k, 5.0)) == {}
    result = bounds_told((m, 0.0), (k, 1e-6), (shift, 1.0))
    assert result["m"] == "m of the baseline is at its bound, 0 kg"
    assert set(result) == {"m", "K1"}
    assert bounds_told((shift, 1.0)) == {}
    # Not a zero: a millionth of its scale of two is one.
    assert bounds_told((m, 0.0), (k, 3e-6)) == {}


def test_an_effect_of_the_baseline_at_either_bound_is_told():
    gap = parameter("gap", -1.0, 1.0, effect="backlash")
    for value in (-1.0, 1.0, 1.0 - 1e-6):
        text = bounds_told((gap, value))["gap"]
        assert text.startswith("gap of the backlash is at its bound, ")
    assert bounds_told((gap, 0.9)) == {}
    assert bounds_told((gap, -0.9)) == {}
    # Neither what is fixed nor what only shapes an effect.
    assert bounds_told((parameter("gap", 1.0, 1.0, effect="backlash"), 1.0)) == {}
    assert bounds_told((replace(gap, shape=True), 1.0)) == {}
    # Its zero is none of the rig's.
    mass = parameter("m"), 5.0
    zero = parameter("gap", 0.0, 1.0, effect="backlash"), 0.0
    assert set(bounds_told(mass, zero)) == {"gap"}
    assert set(bounds_told((parameter("m"), 0.0), (zero[0], 0.5))) == {"m"}


def test_noise_that_is_declared_far_above_the_gap_is_told():
    check, _ = checked(0.24, noise_std=(1.0, 1.0))
    (warning,) = check.warnings
    assert (warning.check, warning.about) == ("declared_noise", "q0, q1")
    assert warning.text == "the whole gap of the baseline is 0.49 of the declared noise"
    assert warning.remedy.startswith("leave noise_std out, or take it from repeats")
    assert warning_texts(checked(0.25)[0]) == {}
    assert warning_texts(checked(0.24, noise_std=(1.0, None))[0]) == {}


REDUCTION = GapReduction(**dict.fromkeys(GapReduction.__dataclass_fields__, 0.0))


def named(verdict=NAMED, phi=0.875, effects=("tilt",), reduction=REDUCTION, classes=()):
    which = Attribution(effects, (("tilt", "offset"),), {}, (), "")
    result = SimpleNamespace(ids=classes, ties=(), classes=())
    return Diagnosis(
        "c",
        "carrier",
        verdict,
        "why",
        "m",
        which,
        reduction and replace(reduction, phi=phi),
        classes=result if classes else None,
    )


def finding(check):
    return CampaignWarning(check, "about", f"text of {check}", "remedy", 1.0, "line")


def test_findings_of_records_and_baseline_are_told_with_every_verdict():
    baseline = BaselineCheck((finding("bound"),), ((rival(1.0), 1.0),))
    for verdict in (NONE_OF_THESE, AT_NOISE_FLOOR):
        told_with = with_findings(named(verdict), (finding("unit"),), baseline)
        # What a corrected record explains is no noise, and the most likely cause.
        assert told_with.verdict == NONE_OF_THESE
        assert told_with.reason.split("; otherwise ")[-1] == "why"
        assert [warning.check for warning in told_with.warnings] == ["wiring", "unit", "bound"]
        assert told_with.reason_id == "wiring/torque_sign"
    # Nor is it the noise whose size is not known.
    floor_unknown = replace(named(NOT_DIAGNOSABLE), reason_id=FLOOR_UNKNOWN)
    told_with = with_findings(floor_unknown, (), baseline)
    assert (told_with.verdict, told_with.reason_id) == (NONE_OF_THESE, "wiring/torque_sign")
    at_floor = with_findings(named(AT_NOISE_FLOOR), (), BaselineCheck((finding("bound"),), ()))
    assert at_floor.verdict == AT_NOISE_FLOOR
    most_first = BaselineCheck((finding("bound"), finding("wiring")), ())
    told_with = with_findings(named(NONE_OF_THESE), (finding("tone"),), most_first)
    assert [warning.check for warning in told_with.warnings] == ["wiring", "tone", "bound"]
    assert (told_with.reason, told_with.reason_id) == ("why", "")


def test_a_wiring_that_explains_as_much_is_an_alias_of_what_is_named():
    def with_rival(share, phi=0.875, verdict=NAMED):
        return with_findings(named(verdict, phi), (), BaselineCheck((), ((rival(1.0), share),)))

    for verdict in (NAMED, NAMED_WITH_REMAINDER, ALIASED, CLASS_NAMED):
        assert with_rival(0.8451, verdict=verdict).verdict == ALIASED
    result = with_rival(0.8451)
    assert result.reason == (
        "check the measurement first: with the torque of the other sign the baseline alone "
        "explains 85% of the gap; otherwise why"
    )
    assert result.attribution.aliases == (("tilt", "offset"), ("tilt", "wiring/torque_sign"))
    assert with_rival(0.8449).verdict == NAMED
    # No share of what is named is above one.
    assert with_rival(0.971, phi=3.0).verdict == ALIASED
    assert with_rival(0.969, phi=3.0).verdict == NAMED


def test_where_no_law_is_named_the_wiring_is_an_alias_of_the_class():
    alone = named(CLASS_NAMED, effects=(), classes=("housing/tilt/torque",))
    alone = replace(alone, attribution=replace(alone.attribution, aliases=()))
    result = with_findings(alone, (), BaselineCheck((), ((rival(1.0), 0.99),)))
    assert result.attribution.aliases == (("housing/tilt/torque", "wiring/torque_sign"),)
    assert headlines(result)[1] == (
        "Cannot be distinguished in these records: one of tilt of the housing, following torque; "
        "a fault of the measurement (torque sign)"
    )


def test_a_wrong_unit_is_an_alias_of_whatever_is_named():
    result = with_findings(named(), (finding("unit"),), BaselineCheck((), ()))
    assert result.verdict == ALIASED
    assert result.reason == "check the measurement first: text of unit; otherwise why"
    assert result.attribution.aliases[-1] == ("tilt", "wiring/unit")
    assert with_findings(named(), (finding("tone"),), BaselineCheck((), ())).verdict == NAMED


def test_a_clock_that_was_moved_is_an_alias_of_a_delay_alone():
    def with_checks(*checks, **options):
        return with_findings(named(**options), tuple(map(finding, checks)), BaselineCheck((), ()))

    result = with_checks("clock_shift", effects=("tilt", "sensor_delay"))
    assert result.verdict == ALIASED
    assert result.attribution.aliases[-1] == ("sensor_delay", "wiring/clock_shift")
    delays = ("delay", "sensors/delay")
    result = with_checks(
        "clock_shift", effects=(), classes=(*delays, "spring"), verdict=CLASS_NAMED
    )
    assert result.attribution.aliases[-1] == (*delays, "wiring/clock_shift")
    assert result.reason == "check the measurement first: text of clock_shift; otherwise why"
    result = with_checks("unit", "clock_shift", effects=("sensor_delay",))
    assert "first: text of unit; text of clock_shift; otherwise" in result.reason
    assert with_checks("clock_shift", classes=("spring", "delayed")).verdict == NAMED
    assert with_checks("clock_shift").verdict == NAMED
    assert with_checks("tone", effects=("sensor_delay",)).verdict == NAMED


def test_a_fault_that_any_cause_may_look_like_must_explain_more_than_what_is_named():
    def with_fault(fault, share, phi=0.9, *, about="run2", **options):
        one = replace(rival(1.0), id=fault, about=about)
        check = BaselineCheck((), ((one, share),), largest_run="run2")
        return with_findings(named(NAMED, phi, **options), (), check)

    # A cause that grows with the load gives every run values of its own, and the largest one.
    for fault in ("run_variation", "wiring/run"):
        assert with_fault(fault, 0.92).verdict == NAMED
        assert with_fault(fault, 0.94).verdict == ALIASED
    # None of that is in another run alone: without it half of what is left goes, or it is none.
    assert with_fault("wiring/run", 0.94, about="run1").verdict == NAMED
    assert with_fault("wiring/run", 0.96, about="run1").verdict == ALIASED
    assert with_fault("wiring/run", 0.999, 0.99, about="run1").verdict == ALIASED
    assert with_fault("wiring/run", 0.999, 0.99).verdict == NAMED
    # The gain of a sensor that is named is that of its channel.
    assert with_fault("wiring/channel_gain", 0.92, effects=("sensor_gain",)).verdict == NAMED
    assert with_fault("wiring/polarity", 0.92, effects=("sensor_gain",)).verdict == ALIASED
    # One channel is less to believe than a matrix of all.
    maps = named(CLASS_NAMED, 1.0, effects=(), classes=("stiffness_map",))
    for share, verdict in ((0.91, ALIASED), (0.89, CLASS_NAMED)):
        one = replace(rival(1.0), id="wiring/channel")
        assert with_findings(maps, (), BaselineCheck((), ((one, share),))).verdict == verdict


def test_values_by_run_are_no_finding_beside_a_cause_that_explains_as_much():
    check = BaselineCheck((), ((replace(rival(1.0), id="run_variation"), 0.9),))
    assert with_findings(named(NAMED, 0.95), (), check).warnings == ()
    (warning,) = with_findings(named(NAMED, 0.85), (), check).warnings
    assert (warning.check, warning.id, warning.figure) == ("wiring", "run_variation", 0.9)


def test_the_headline_names_the_fault_first_and_every_alternative():
    one = replace(rival(1.0, "s1"), id="wiring/polarity")
    diagnosis = with_findings(named(NAMED, 0.9), (), BaselineCheck((), ((one, 0.98),)))
    assert verdict_heading(diagnosis) == (
        "Check s1 first (polarity): it explains 98 % of the gap; otherwise the gap is explained by "
        "one of several causes. Cannot be distinguished in these records: one of tilt; offset; a "
        "fault of the measurement (polarity)"
    )
    tied = named(ALIASED, 0.9)
    assert headlines(tied) == (
        "The gap is explained by one of several causes",
        "Cannot be distinguished in these records: one of tilt; offset",
    )
    two = (("tilt", "offset"), ("saddle", "waves"))
    which = replace(tied.attribution, effects=("tilt", "saddle"), aliases=two)
    assert headlines(replace(tied, attribution=which)) == (
        "The gap is explained by several causes, each with alternatives",
        "Cannot be distinguished in these records: one of tilt; offset, and beside it one of "
        "saddle; waves",
    )


def test_a_fault_beside_the_named_law_is_a_finding_and_beside_one_of_several_an_alternative():
    beside_tilt = replace(rival(1.0), id="wiring/polarity", laws=("tilt",))
    check = BaselineCheck((), ((beside_tilt, 1.0),))
    assert with_findings(named(NAMED, 0.99), (), check).verdict == NAMED
    several = with_findings(named(NAMED, 0.99, effects=("tilt", "warp")), (), check)
    assert several.verdict == ALIASED
    assert several.attribution.aliases[-1] == ("warp", "wiring/polarity")


def test_causes_that_a_fault_stands_for_together_are_no_alternatives_of_each_other():
    both = named(effects=("sensor_delay", "maxwell_branch"))
    check = BaselineCheck((), ((rival(0.0, "q"), 1.0),))
    heading = verdict_heading(with_findings(both, (), check))
    assert "the gap is explained by sensor delay, Maxwell branch and" in heading
    assert "sensor delay; Maxwell branch" not in heading
