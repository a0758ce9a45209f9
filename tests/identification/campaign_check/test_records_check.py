"""Every check finds its fault, on a campaign that gives no finding without it."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from carrierflex.identification.campaign.declarations import Baseline
from carrierflex.identification.campaign_check.copies import copied_runs, without_copies
from carrierflex.identification.campaign_check.records_check import records_findings
from tests.identification.campaign_check.faulty_campaigns import (
    changed,
    checks,
    faultless,
    with_channels,
    with_rig,
)
from tests.simulation.synthetic_curves import curve_set

KINDS = ("carrier", "mounting", "element", "driven")
CHANNEL = {"carrier": "s137", "mounting": "ssz", "element": "q", "driven": "F"}


def scaled(factor):
    return lambda values: factor * values


@pytest.mark.parametrize("kind", KINDS)
def test_a_campaign_without_a_fault_gives_no_finding(kind):
    assert checks(faultless(kind)) == set()


@pytest.mark.parametrize(
    ("kind", "column", "factor"),
    [
        ("carrier", "s137", 1e3),
        ("carrier", "s137", 1e6),
        ("carrier", "torque", 1e-3),
        ("carrier", "carrier_angle", 180.0 / np.pi),
        ("mounting", "ssz", 1e3),
        ("mounting", "torque", 1e-3),
        ("mounting", "ntl_z", 1e-3),
        ("element", "q", 1e6),
    ],
)
def test_a_column_in_another_unit_is_found(kind, column, factor):
    about = "displacement" if column == "q" else column
    assert ("unit", about) in checks(changed(faultless(kind), column, scaled(factor)))


@pytest.mark.parametrize(
    ("kind", "share"),
    [*product(("carrier", "mounting", "element"), (0.4, 0.7, 0.9)), ("driven", 0.4)],
)
def test_a_reading_of_too_few_bits_is_found(kind, share):
    """The driven force jumps by friction, which hides jumps of its own size."""
    campaign = faultless(kind)
    name = CHANNEL[kind]
    end = share * max(float(np.abs(run.signals[name]).max()) for run in campaign.runs)

    def wrapped(values):
        return (values + end) % (2.0 * end) - end

    assert ("wrapped", name) in checks(changed(campaign, name, wrapped))


@pytest.mark.parametrize("noise", [0.0, 1e-7])
def test_two_channels_on_one_cable_are_found(noise):
    """The same sensor on two inputs of the logger, each with a little noise of its own."""
    campaign = faultless("carrier")
    rng = np.random.default_rng(3)

    def copied(run):
        other = run.signals["s047"]
        signals = {**run.signals, "s137": other + noise * rng.standard_normal(other.size)}
        return replace(run, signals=signals)

    twice = replace(campaign, runs=tuple(map(copied, campaign.runs)))
    assert ("copied_channel", "s047, s137") in checks(twice)
    once = replace(twice, runs=(campaign.runs[0], *twice.runs[1:]))
    assert "copied_channel" not in [check for check, _ in checks(once)]


@pytest.mark.parametrize("slower", [0.0, 0.1, 0.3])
def test_a_square_wave_is_no_reading_of_too_few_bits(slower):
    """Alone, or beside a motion of a tenth and three tenths of its size."""
    campaign = faultless("element")
    rng = np.random.default_rng(2)

    def square(values):
        phase = 0.1 * np.arange(values.size)
        wave = np.sign(np.sin(phase)) + slower * np.cos(phase)
        return 1e-3 * wave + 1e-6 * rng.standard_normal(values.size)

    assert ("wrapped", "q") not in checks(changed(campaign, "q", square))


@pytest.mark.parametrize("factor", [1e-3, 0.1, 10.0, 1e3])
def test_a_prediction_in_another_unit_than_its_signal_is_found(factor):
    """A simulator that misses a signal tenfold is a poor one, not one in millimetres."""
    campaign = faultless("element")
    name = campaign.channels[0].name
    runs = tuple(
        replace(run, predictions={name: factor * run.signals[name]}) for run in campaign.runs
    )
    predicted = replace(campaign, baseline=Baseline("columns"), runs=runs)
    is_found = ("unit", name) in checks(predicted)
    assert is_found == (factor in (1e-3, 1e3))


def test_time_in_milliseconds_is_found():
    about = {"carrier": "carrier_angle", "mounting": "speed", "element": "time", "driven": "time"}
    for kind, name in about.items():
        assert ("unit", name) in checks(changed(faultless(kind), "time", scaled(1e3))), kind


def test_a_speed_that_is_not_the_slope_of_the_angle_is_found():
    result = checks(changed(faultless("mounting"), "speed", scaled(30.0 / np.pi)))
    assert ("unit", "speed") in result


def test_torque_against_the_rotation_is_found():
    for column in ("torque", "carrier_angle"):
        assert ("torque_sign", "torque") in checks(
            changed(faultless("carrier"), column, scaled(-1.0))
        )


def test_what_the_rig_declares_is_held_against_curves_and_channels():
    campaign = faultless("carrier")
    assert ("n_planets", "n_planets") in checks(with_rig(campaign, n_planets=4))
    assert ("sensor_radius", "s047") in checks(with_channels(campaign, radius=1.1 * 0.412))
    assert ("unit", "sensor_radius") in checks(with_rig(campaign, sensor_radius=412.0))


def test_declared_noise_far_below_that_between_neighbours_is_found():
    for kind in KINDS:
        campaign = faultless(kind)
        channel = campaign.channels[0]
        quiet = with_channels(campaign, noise_std=0.1 * channel.noise_std)
        assert checks(quiet) == {("declared_noise", channel.name)}, kind
        (finding,) = records_findings(quiet)
        # Without a declared noise a load that was not recorded would pass for noise.
        assert "leave noise_std out" not in finding.remedy


def test_a_wrong_period_is_found():
    result = checks(with_rig(faultless("element"), period_samples=500))
    assert {check for check, _ in result} == {"period_samples"}


def test_zeroing_beyond_the_rest_is_found():
    result = checks(with_rig(faultless("mounting"), zeroing_samples=1000))
    assert {check for check, _ in result} == {"zeroing"}


def test_means_taken_out_of_every_signal_of_a_mounting_are_found():
    def without_mean(campaign, names):
        for name in names:
            campaign = changed(campaign, name, lambda values: values - values.mean())
        return campaign

    campaign = faultless("mounting")
    names = [channel.name for channel in campaign.channels]
    assert {check for check, _ in checks(without_mean(campaign, names))} == {"detrended"}
    # One channel is not the whole record.
    assert "detrended" not in {check for check, _ in checks(without_mean(campaign, names[:1]))}


def test_noise_of_a_torque_is_no_load_within_the_zero():
    rng = np.random.default_rng(3)

    def noisy(values):
        return values + 0.01 * np.abs(values).max() * rng.standard_normal(values.size)

    assert checks(changed(faultless("mounting"), "torque", noisy)) == set()


@pytest.mark.parametrize("kind", KINDS)
def test_clipping_at_70_per_cent_of_the_range_is_found(kind):
    name = CHANNEL[kind]

    def clipped(values):
        middle, half = 0.5 * (values.max() + values.min()), 0.5 * np.ptp(values)
        return np.clip(values, middle - 0.7 * half, middle + 0.7 * half)

    assert ("clipping", name) in checks(changed(faultless(kind), name, clipped))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_signal_without_its_sign_is_found(sign):
    campaign = changed(faultless("element"), "q", lambda values: sign * np.abs(values))
    assert ("rectified", "q") in checks(campaign)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("least", [0.0, 0.05])
def test_a_signal_that_turns_before_zero_has_its_sign(kind, least):
    """Its smallest value is at, or near, zero: a gap that never closes."""
    name = CHANNEL[kind]
    campaign = changed(
        faultless(kind), name, lambda values: values - values.min() + least * np.std(values)
    )
    assert ("rectified", name) not in checks(campaign)


#: Once a turn of 55 samples a rim comes within 5 um of zero, steeper behind than before.
_DIP = [34.8, 31.8, 25.6, 17.3, 8.4, 5.1, 10.7, 18.6, 29.5, 39.6, 50.8]


@pytest.mark.parametrize(
    ("moved", "scatter", "is_found"), [(5.1, 0.6, True), (0.0, 0.6, False), (1.5, 1.2, False)]
)
def test_a_signal_that_bends_beside_zero_has_its_sign(moved, scatter, is_found):
    """Noise alone may bring one of its samples to zero."""
    name = CHANNEL["carrier"]
    away = 43.0 + 80.0 * np.sin(np.linspace(0.0, np.pi, 44))

    def bent(values):
        turn = np.concatenate([_DIP, away])
        noise = scatter * np.random.default_rng(3).standard_normal(values.size)
        return -1e-6 * np.abs(np.resize(turn, values.size) - moved + noise)

    campaign = changed(faultless("carrier"), name, bent)
    assert (("rectified", name) in checks(campaign)) == is_found


@pytest.mark.parametrize("kind", KINDS)
def test_a_stuck_stretch_and_repeated_samples_are_found(kind):
    name = CHANNEL[kind]

    def stuck(values):
        values[values.size // 2 : values.size // 2 + values.size // 20] = values[values.size // 2]
        return values

    def repeated(values):
        lost = np.arange(values.size // 3, values.size, values.size // 12)
        values[lost] = values[lost - 1]
        return values

    assert ("stuck", name) in checks(changed(faultless(kind), name, stuck))
    assert ("repeated", name) in checks(changed(faultless(kind), name, repeated))


@pytest.mark.parametrize("kind", KINDS)
def test_zeros_and_outliers_are_found(kind):
    name = CHANNEL[kind]

    def zeroed(values):
        values[values.size // 3 :: values.size // 9] = 0.0
        return values

    def with_spike(values):
        values[values.size // 2] += 2.0 * np.ptp(values)
        return values

    assert ("zeros", name) in checks(changed(faultless(kind), name, zeroed))
    assert ("outliers", name) in checks(changed(faultless(kind), name, with_spike))


@pytest.mark.parametrize("kind", KINDS)
def test_a_grid_coarser_than_the_noise_is_found_and_a_finer_one_is_not(kind):
    campaign = faultless(kind)
    channel = campaign.channels[0]

    def on_grid(floors):
        step = floors * channel.noise_std
        return changed(campaign, channel.name, lambda values: step * np.round(values / step))

    assert ("quantised", channel.name) in checks(on_grid(2.0))
    assert ("quantised", channel.name) in checks(on_grid(20.0))
    assert checks(on_grid(0.5)) == set()


# Friction of a driven element makes a broad spectrum far above its noise.
@pytest.mark.parametrize("kind", KINDS[:3])
def test_a_tone_that_nothing_makes_is_found(kind):
    campaign = faultless(kind)
    channel = campaign.channels[0]

    def with_tone(run):
        # Below half the sampling rate, above the drive or between two orders of the shaft.
        angle = run.inputs.get("carrier_angle")
        phase = 2.0 * np.pi * 87.4 * run.time
        if angle is not None:
            phase = 24.5 * np.ptp(angle) / np.ptp(run.time) * run.time
        tone = np.sin(phase)
        signal = run.signals[channel.name] + 2.0 * np.sqrt(2.0) * channel.noise_std * tone
        return replace(run, signals={**run.signals, channel.name: signal})

    humming = replace(campaign, runs=tuple(with_tone(run) for run in campaign.runs))
    assert ("tone", channel.name) in checks(humming)


def test_gaps_and_too_few_samples_are_found():
    campaign = faultless("carrier")

    def with_gap(time):
        time[200:] += 37.0
        return time

    assert ("sampling_gap", "LC1") in checks(changed(campaign, "time", with_gap, runs=["LC1"]))
    sparse = replace(
        campaign,
        runs=tuple(
            replace(
                run,
                time=run.time[::6],
                inputs={name: values[::6] for name, values in run.inputs.items()},
                signals={name: values[::6] for name, values in run.signals.items()},
            )
            for run in campaign.runs
        ),
    )
    assert ("sampling_rate", "LC1") in checks(sparse)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("floors", [0.0, 1.0])
def test_a_copy_under_another_name_is_found_and_left_out(kind, floors):
    campaign = faultless(kind)
    rng = np.random.default_rng(4)
    first = campaign.runs[0]
    signals = {
        channel.name: first.signals[channel.name]
        + floors * channel.noise_std * rng.standard_normal(first.time.size)
        for channel in campaign.channels
    }
    copy = replace(first, name="copy", file="copy.csv", condition="another day", signals=signals)
    twice = replace(campaign, runs=(*campaign.runs, copy))
    assert copied_runs(twice) == {"copy": first.name}
    assert ("copy", "copy") in checks(twice)
    assert [run.name for run in without_copies(twice, copied_runs(twice)).runs] == [
        run.name for run in campaign.runs
    ]
    assert without_copies(campaign, copied_runs(campaign)) is campaign


@pytest.mark.parametrize("noise", [1e-6, 1e-4])
def test_releases_of_one_mode_and_friction_under_one_drive_are_no_copies(noise):
    # Both repeat all of their motion; they share no noise, whose differences turn every sample.
    rng = np.random.default_rng(4)
    time = 2e-3 * np.arange(4000)
    decay = np.exp(-0.8 * time) * np.cos(2.0 * np.pi * 21.0 * time)
    friction = np.sign(np.cos(2.0 * np.pi * 0.7 * time))
    campaign = faultless("element")
    for motion in (decay, friction):
        runs = tuple(
            replace(
                campaign.runs[0],
                name=f"run{k}",
                file=f"run{k}.csv",
                time=time,
                inputs={"force": np.cos(2.0 * np.pi * 0.7 * time)},
                signals={"q": (1.0 + 0.1 * k) * motion + noise * rng.standard_normal(time.size)},
            )
            for k in range(3)
        )
        assert copied_runs(replace(campaign, runs=runs)) == {}
        # With a little noise of its own a copy shares the noise of the first, where that is seen
        # beside the motion.
        also = runs[0].signals["q"] + 0.3 * noise * rng.standard_normal(time.size)
        copy = replace(runs[0], name="copy", file="copy.csv", signals={"q": also})
        shared = copied_runs(replace(campaign, runs=(*runs, copy)))
        assert shared == ({"copy": "run0"} if noise > 1e-5 or motion is friction else {})


def test_repeats_with_their_own_noise_are_no_copies():
    campaign = faultless("element")
    again = replace(
        changed(
            campaign, "q", lambda q: q + 2e-6 * np.random.default_rng(9).standard_normal(q.size)
        ),
        runs=campaign.runs,
    )
    first = campaign.runs[0]
    # The same drive: what repeats is the motion, not the noise.
    smooth = np.convolve(first.signals["q"], np.ones(5) / 5.0, mode="same")
    noise = 2e-6 * np.random.default_rng(9).standard_normal(smooth.size)
    repeat = replace(first, name="again", file="again.csv", signals={"q": smooth + noise})
    assert copied_runs(replace(again, runs=(*campaign.runs, repeat))) == {}


def test_a_finding_names_figure_file_line_and_remedy():
    def with_spike(values):
        values[100] += 1e-3
        return values

    campaign = changed(faultless("carrier"), "s137", with_spike, runs=["LC2"])
    (result,) = records_findings(campaign, curve_set())  # nothing else is wrong with it
    assert result.line == "LC2.csv, line 102"
    assert result.check == "outliers"
    assert result.figure == pytest.approx(1e-3, rel=0.1)
    assert set(vars(result)) >= {"about", "text", "remedy"}
    assert "leave these cells empty" in result.remedy


def test_a_periodic_load_at_the_same_phases_is_not_read_coarsely():
    campaign = faultless("driven")
    name = next(iter(campaign.contract.inputs))
    phases = changed(
        campaign, name, lambda x: np.max(np.abs(x)) * np.sin(2.0 * np.pi * np.arange(x.size) / 46.0)
    )
    assert ("quantised", name) not in checks(phases)


def test_an_input_that_is_read_coarsely_is_told_and_set_points_are_not():
    campaign = faultless("driven")
    name = next(iter(campaign.contract.inputs))
    largest = max(float(np.abs(run.inputs[name]).max()) for run in campaign.runs)

    def on_grid(share):
        return checks(
            changed(campaign, name, lambda x: share * largest * np.round(x / share / largest))
        )

    assert ("quantised", name) in on_grid(0.05)
    assert ("quantised", name) not in checks(campaign)
    # Two levels are a switch.
    assert ("quantised", name) not in on_grid(1.0)
