"""From which gain a channel is told without a gap, and what is said of it."""

from dataclasses import replace

import numpy as np

from carrierflex.diagnosis.baseline_check import checked_baseline
from carrierflex.diagnosis.wiring.linear_records import LinearRecord
from carrierflex.diagnosis.wiring.refits import WiringChecks
from tests.diagnosis.wiring.test_wiring_rules import (
    PROBLEM,
    TIMES,
    campaign,
    checked,
    fit_leaving,
    warning_texts,
)


def gained_record(gain, noise=0.05):
    """Three channels whose size the baseline fits; the first reads too much."""
    time = TIMES["A"]
    predicted = np.array([np.sin(100.0 * time + phase) for phase in (0.0, 2.0, 4.0)]).T
    scatter = noise * np.random.default_rng(5).standard_normal(predicted.shape)
    residual = scatter + np.array([gain, 0.0, 0.0]) * predicted
    return LinearRecord("A", time, residual, predicted, predicted[None])


def test_a_gain_without_a_gap_is_told_beyond_what_calibrations_give():
    def findings(gain, before=1.0, **options):
        linear = [gained_record(gain, **options)]
        return warning_texts(checked(before, linear=linear, noise_std=(1.0, 1.0, 1.0))[0])

    (key, text), *others = findings(0.05).items()
    assert key == ("gain", "q0")
    assert text.startswith("q0 reads 4.8% too much relative to the other channels, ")
    assert others == []
    text = findings(-0.05)["gain", "q0"]
    assert text.startswith("q0 reads 5.2% too little relative to the other channels, ")
    assert findings(0.025) != {}
    assert findings(0.015) == {}
    # Not beyond doubt.
    assert findings(0.025, noise=1.0) == {}
    # With a gap it is an effect of the library.
    assert ("gain", "q0") not in findings(0.05, before=2.0)


def test_a_gain_within_three_deviations_of_a_declared_calibration_is_not_told():
    three = campaign(noise_std=(1.0, 1.0, 1.0))
    checks = WiringChecks(
        lambda: (), lambda theta: (), lambda again: np.inf, lambda theta: [gained_record(0.05)]
    )
    for declared, is_told in ((0.014, True), (0.018, False)):
        channels = (replace(three.channels[0], gain_std=declared), *three.channels[1:])
        with_declared = replace(three, channels=channels)
        check = checked_baseline(PROBLEM, with_declared, checks, fit_leaving(1.0))
        assert bool(check.warnings) == is_told


def test_of_two_channels_both_are_told():
    """Their common size is the baseline's: one too much or the other too little."""
    record = gained_record(0.1)
    two = LinearRecord(
        "A", record.time, record.residual[:, :2], record.predicted[:, :2], record.columns[..., :2]
    )
    (warning,) = checked(1.0, linear=[two], noise_std=(1.0, 1.0))[0].warnings
    assert warning.check == "gain"
    # As sure as one another: which comes first is rounding's.
    assert set(warning.about.split(", ")) == {"q0", "q1"}
    readings, sureness = warning.text.split(" relative to the other channels, ")
    assert set(readings.split(", or ")) == {"q0 reads 9.8% too much", "q1 reads 9.8% too little"}
    assert sureness == "19 standard deviations"
    assert warning.remedy == (
        "calibrate this sensor again, and check its amplifier and position: the baseline's "
        "parameters compensate the error"
    )


def test_the_gain_of_a_channel_alone_is_not_looked_for():
    """An element would be simulated for it all over again."""

    def passes(noise_std):
        begun = []

        def records(theta):
            begun.append(theta)
            return []

        checks = WiringChecks(lambda: (), lambda theta: (), lambda again: np.inf, records)
        checked_baseline(PROBLEM, campaign(noise_std=noise_std), checks, fit_leaving(1.0))
        return len(begun)

    # One for delays, one for gains.
    assert passes((1.0, 1.0)) == 2
    assert passes((1.0,)) == 1
