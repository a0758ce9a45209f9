"""Delays below the gap's limit are measured with an honest error, and told only where they are."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.diagnosis.wiring import linear_records as module
from carrierflex.diagnosis.wiring.linear_records import LinearRecord, late_signals

STEP = 0.05
NOISE = 0.02


def record(seed, *, name="a", speed=2.0, delay=0.0, drift=0.0, memory=0.0, columns=()):
    """Run of a wave of three orders that the baseline fits, read late, with noise."""
    rng = np.random.default_rng(seed)
    time = STEP * np.arange(1500)
    along = (time - time.mean()) / np.ptp(time)
    late = time - delay - drift * along
    signal = sum(np.sin(n * speed * late) / n for n in (1, 2, 3))
    noise = NOISE * rng.standard_normal(time.size)
    for k in range(1, time.size):
        noise[k] = memory * noise[k - 1] + np.sqrt(1.0 - memory**2) * noise[k]
    predicted = sum(np.sin(n * speed * time) / n for n in (1, 2, 3))
    # The baseline fits the size of the first order and an offset.
    J = np.array([np.sin(speed * time), np.ones_like(time), *columns])
    residual = signal + noise - predicted
    return LinearRecord(name, time, residual[:, None], predicted[:, None], J[:, :, None])


def in_deviations(records, monkeypatch):
    """Every delay and drift in standard deviations, told or not."""
    monkeypatch.setattr(module, "_DRIFT", 0.0)
    return {late.run: (late.seconds, late.seconds / late.std) for late in late_signals(records)}


def test_nothing_is_told_of_signals_in_time():
    assert late_signals([record(seed, name=str(seed)) for seed in range(6)]) == ()
    assert late_signals([]) == ()


def test_a_delay_of_all_runs_is_measured():
    (late,) = late_signals(
        [record(seed, name=str(seed), delay=0.005, speed=1.0 + seed) for seed in range(3)]
    )
    assert late.run == ""
    assert late.seconds == pytest.approx(0.005, abs=4.0 * late.std)
    assert late.std < 0.0005


def test_a_drift_of_one_run_is_told_of_that_run_alone():
    records = [record(seed, name=str(seed)) for seed in range(4)]
    (late,) = late_signals([*records, record(9, name="slow", drift=0.02)])
    assert late.run == "slow"
    assert late.seconds == pytest.approx(0.02, abs=4.0 * late.std)


def test_parameters_of_one_run_fitted_out_first_give_what_all_together_give():
    """Offsets of three runs as columns of their own, or as three columns that all runs share."""
    offsets = [0.005, -0.002, 0.001]
    by_run, shared = [], []
    for k, offset in enumerate(offsets):
        run = record(k, name=str(k), delay=0.01)
        moved = replace(run, residual=run.residual + offset)
        one = np.ones((1, *run.residual.shape))
        zeros = np.zeros((len(offsets), *run.residual.shape))
        zeros[k] = 1.0
        size = run.columns[:1]
        by_run.append(replace(moved, columns=np.concatenate([one, size]), n_of_run=1))
        shared.append(replace(moved, columns=np.concatenate([zeros, size])))
    (result,), (expected,) = late_signals(by_run), late_signals(shared)
    assert result.seconds == pytest.approx(expected.seconds, rel=1e-9)
    # The shared fit's scatter holds the offsets themselves.
    assert result.std == pytest.approx(expected.std, rel=0.05)


def test_what_a_drift_explains_is_no_scatter_about_it():
    """A slow wave's own slope, long and correlated, would hide a drift of any size."""
    slow = record(2, speed=0.5, drift=0.5)
    short = LinearRecord(
        slow.run, slow.time[:600], slow.residual[:600], slow.predicted[:600], slow.columns[:, :600]
    )
    (late,) = late_signals([short])
    assert late.seconds == pytest.approx(0.2, abs=3.0 * late.std)


@pytest.mark.parametrize("memory", [0.0, 0.7])
def test_errors_are_as_large_as_they_are_said_to_be(memory, monkeypatch):
    """Of 200 runs in time the drift over its deviation scatters by one, with noise of a memory."""
    ratios = [
        in_deviations([record(seed, memory=memory)], monkeypatch)["a"][1] for seed in range(200)
    ]
    assert np.std(ratios) == pytest.approx(1.0, abs=0.2)


def test_a_delay_that_the_baseline_absorbs_is_not_told(monkeypatch):
    """Order 1 alone of both phases: a delay turns the phase, as the baseline does."""
    late = record(1, delay=0.05)
    time = late.time
    turned = np.array([np.cos(n * 2.0 * time) for n in (1, 2, 3)] + [np.sin(4.0 * time)])
    free = record(1, delay=0.05, columns=(*turned, np.sin(6.0 * time)))
    assert [result.run for result in late_signals([late])] == [""]
    assert late_signals([free]) == ()
