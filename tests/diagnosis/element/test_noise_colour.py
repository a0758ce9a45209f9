"""Size and memory of a channel's noise, read above the band of the motion."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import lfilter

from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.element.noise import (
    _noise_density,
    noise_correlation_time,
    noise_variance,
)
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.element.records import element_records
from carrierflex.diagnosis.element.table import element_table
from tests.diagnosis.element.element_campaigns import displacement_campaign, force_campaign, no_law

STD = 2e-6


@pytest.fixture(scope="module")
def clean():
    """Linear element under three forces, its deflections without noise."""
    return force_campaign(no_law, noise=0.0, settle=0)


def with_noise(clean, memory):
    """Its deflections with noise of a memory, which is declared by its size alone."""
    rng = np.random.default_rng(3)
    runs = []
    for run in clean.runs:
        white = np.sqrt(1.0 - memory**2) * rng.standard_normal(run.time.size + 100)
        noise = STD * lfilter([1.0], [1.0, -memory], white)[100:]
        runs.append(replace(run, signals={"q": run.signals["q"] + noise}))
    channel = replace(clean.channels[0], noise_std=STD)
    return replace(clean, runs=tuple(runs), channels=(channel,))


def memory_found(campaign, std):
    records = element_records(campaign)
    time = noise_correlation_time(records, [std**2] * len(records))
    return np.exp(-records[0].step / time) if time else 0.0


def test_density_of_noise_with_a_memory_keeps_its_variance_and_is_white_without_one():
    step = 0.01
    frequency = np.linspace(0.0, 50.0, 20001)
    density = _noise_density(frequency, step, -step / np.log(0.7))
    assert_allclose(np.trapezoid(density, frequency) / 50.0, 1.0, rtol=1e-6)
    assert_allclose(density[[0, -1]], [1.7 / 0.3, 0.3 / 1.7], rtol=1e-9)
    assert_allclose(_noise_density(frequency, step, 0.0), 1.0)


@pytest.mark.parametrize("memory", [0.0, 0.3, 0.7])
def test_memory_is_found_above_the_band(clean, memory):
    assert_allclose(memory_found(with_noise(clean, memory), STD), memory, atol=0.06)


@pytest.mark.parametrize("factor", [0.1, 10.0])
def test_a_wrong_variance_does_not_raise_the_density_of_white_noise(clean, factor):
    records = element_records(with_noise(clean, 0.0))
    time = noise_correlation_time(records, [(factor * STD) ** 2] * len(records))
    # Of a variance too large the fall alone is left, to which the end of the motion adds.
    assert _noise_density(np.zeros(1), records[0].step, time)[0] < 1.5


def test_a_motion_beyond_its_band_makes_no_memory_of_white_noise(clean):
    first, *others = with_noise(clean, 0.0).runs
    white = np.random.default_rng(5).standard_normal(first.time.size)
    moved = first.signals["q"] + 10.0 * STD * lfilter([0.1], [1.0, -0.9], white)
    runs = (replace(first, signals={"q": moved}), *others)
    assert memory_found(replace(clean, runs=runs), STD) < 0.06


@pytest.mark.parametrize("memory", [0.0, 0.7])
def test_the_floor_of_a_linear_element_is_what_its_noise_leaves(clean, memory):
    problem = element_problem(with_noise(clean, memory))
    table = element_table(problem.model, problem.records, ClassConstants())
    floor_ratio = table.scores.of(()).total / table.table.floor.sum()
    assert_allclose(floor_ratio, 1.0, atol=0.2)


@pytest.mark.parametrize("n", [1500, 3000, 6000])
def test_the_size_of_noise_that_is_not_declared_has_no_bias(n):
    # The spectrum's estimate is a mean of 4, 10 and 22 segments.
    clean = displacement_campaign(no_law, noise=0.0, n=n)
    silent = (replace(clean.channels[0], noise_std=None),)
    ratios = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        runs = tuple(
            replace(run, signals={"F": run.signals["F"] + 0.05 * rng.standard_normal(n)})
            for run in clean.runs
        )
        campaign = replace(clean, runs=runs, channels=silent)
        variance, is_measured = noise_variance(campaign, element_records(campaign))
        assert not is_measured
        ratios.extend(np.sqrt(variance) / 0.05)
    # 60 estimates that scatter by 7 % at most: their mean is known to 0.9 %.
    assert_allclose(np.mean(ratios), 1.0, atol=0.03)
