import re
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.carrier.gap_components import _frame_of, components_of
from carrierflex.diagnosis.carrier.gap_findings import _gap_cells
from carrierflex.diagnosis.report.gap_words import further_words, place_words
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.order_analysis import highest_order
from carrierflex.identification.carrier.sensor_patterns import RADIAL, pattern_split
from tests.diagnosis.carrier.carrier_twin import CHANNELS, twin_problem

MAX_ORDER = highest_order(3)
QUIET = ((1.0, 0, 0), (0.5, 0, 0))


def said(problem):
    """Where the gap of the baseline lies, in words."""
    findings = problem.gap((), problem.starts((), {})[-1]).findings()
    return "; ".join(filter(None, (place_words(findings), further_words(findings, "m"))))


def cells_of(problem):
    return {
        (c.run, c.channel_pattern, int(c.order)): c
        for c in problem.gap((), problem.starts((), {})[-1]).cells
    }


@pytest.mark.parametrize(("order", "pattern"), [(2, "m=2"), (3, "m=-1"), (4, "m=0"), (5, "m=+1")])
def test_waviness_lands_only_in_m_equal_to_n_modulo_four(order, pattern):
    def waves(channel, angle):
        return 1e-4 * np.cos(order * (channel.angle - angle)) * (channel in CHANNELS[:4])

    cells = cells_of(twin_problem(None, extra=waves, turns=6, loads=QUIET))
    by_pattern = {m: cells["run1", m, order].coherent for m in ("m=0", "m=+1", "m=-1", "m=2")}
    # Four of six channels, half the squared amplitude; the rest is noise.
    assert_allclose(by_pattern.pop(pattern), 1e-8 / 2.0 * 4.0 / 6.0, rtol=0.01)
    assert max(by_pattern.values()) < 1e-4 * 1e-8


def test_a_gain_error_leaks_into_the_saddle_pattern_in_one_constant_ratio():
    orders = np.zeros((1, 4, MAX_ORDER + 1), dtype=complex)
    channels = CHANNELS[:4]
    for n, size in ((1, 1.0), (5, 0.3)):
        orders[0, :, n] = size * np.exp(-1j * n * np.array([channel.angle for channel in channels]))
    orders[0, 1] *= 1.05
    split = pattern_split(channels, orders)
    for n in (1, 5):
        forward, saddle = (
            split.amplitudes[0, split.names.index(m), MAX_ORDER + n] for m in ("m=+1", "m=2")
        )
        assert_allclose(abs(saddle / forward), 0.0125 / 1.0125, rtol=1e-12)


def test_radial_pair_tells_forward_from_backward_whirl():
    channels = CHANNELS[4:]
    orders = np.zeros((1, 2, MAX_ORDER + 1), dtype=complex)
    # u = exp(+j theta): a sensor at v reads cos(theta - v).
    orders[0, :, 1] = np.exp(-1j * np.array([channel.angle for channel in channels]))
    split = pattern_split(channels, orders)
    assert split.names == (RADIAL,)
    assert_allclose(split.amplitudes[0, 0, MAX_ORDER + 1], 1.0, rtol=1e-12)
    assert abs(split.amplitudes[0, 0, MAX_ORDER - 1]) < 1e-12


def test_channels_without_a_pattern_stand_alone():
    channels = (
        Channel("a", "axial_displacement", "m", 0.0, 0.4),
        Channel("b", "axial_displacement", "m", 2.0, 0.4),
    )
    assert pattern_split(channels, np.zeros((1, 2, MAX_ORDER + 1), dtype=complex)).names == (
        "a",
        "b",
    )


@pytest.mark.long
def test_the_sentence_names_frame_order_and_growth():
    problem = twin_problem(
        "flexible_pins", contained=("axial_offset", "housing_tilt", "carrier_tilt")
    )
    text = said(problem)
    assert "order 3, m=-1 (waves fixed to the carrier), in every run, growing as torque^1.0" in text
    bare = twin_problem("carrier_tilt", contained=("axial_offset", "housing_tilt", "flexible_pins"))
    text = said(bare)
    assert "order 1, m=+1 (tilt fixed to the carrier), in every run, whatever the torque" in text


@pytest.mark.long
def test_without_a_gap_the_sentence_says_so():
    problem = twin_problem(None)
    assert "no order or pattern of the gap is significant" in said(problem)


def parts_of(problem):
    components = components_of(problem.gap((), problem.starts((), {})[-1]).cells)
    return {
        (component.pattern, component.order): _frame_of(component, components, 3)
        for component in components
        if component.runs
    }


@pytest.mark.long
def test_what_pulsates_in_the_housing_is_told_from_what_turns_with_the_carrier():
    def turning(channel, angle):
        return 5e-5 * np.cos(3.0 * (channel.angle - angle)) * (channel in CHANNELS[:4])

    def pulsating(channel, angle):
        return 5e-5 * np.cos(3.0 * angle) * np.cos(channel.angle - 0.4) * (channel in CHANNELS[:4])

    assert parts_of(twin_problem(None, extra=turning, turns=6, loads=QUIET))["m=-1", 3] == "carrier"
    frames = parts_of(twin_problem(None, extra=pulsating, turns=6, loads=QUIET))
    assert frames["m=+1", 3] == "housing"
    assert frames["m=-1", 3] == "undecided"


@pytest.mark.long
def test_radial_motion_is_split_between_carrier_and_housing():
    def whirl(channel, angle):
        return 5e-5 * np.cos(angle - channel.angle) * (channel in CHANNELS[4:])

    def shake(channel, angle):
        return 5e-5 * np.cos(angle) * np.cos(channel.angle) * (channel in CHANNELS[4:])

    assert parts_of(twin_problem(None, extra=whirl, turns=6, loads=QUIET))[RADIAL, 1] == "carrier"
    frames = parts_of(twin_problem(None, extra=shake, turns=6, loads=QUIET))
    assert (frames[RADIAL, 1], frames[RADIAL, -1]) == ("housing", "housing")


def test_a_small_order_beyond_chance_is_said_with_its_p_value():
    def small(channel, angle):
        large = 1e-3 * np.cos(3.0 * (channel.angle - angle))
        return (large + 2e-5 * np.cos(6.0 * (channel.angle - angle))) * (channel in CHANNELS[:4])

    problem = twin_problem(None, extra=small, turns=8, loads=QUIET)
    text = said(problem)
    cell = r"small yet beyond chance: order 6, m=2 \((\S+) %, p <=? (\S+) in every run\)"
    match = re.search(cell, text)
    # The square of 2 in 100, printed with two digits; the noise of 5 um shifts 20 um by 1 %.
    assert_allclose(float(match[1]), 0.04, rtol=0.03)
    assert float(match[2]) < 0.01


def test_one_revolution_is_tested_against_the_declared_noise():
    """Without a second revolution the noise stands for the scatter.

    As many false alarms as chance makes.
    """
    rng = np.random.default_rng(2)
    n = 60
    table = rng.standard_normal((300, 6, n))
    phase = np.outer(np.arange(n) * 2.0 * np.pi / n, np.arange(MAX_ORDER + 1))
    orders = table @ np.exp(-1j * phase) * np.where(np.arange(MAX_ORDER + 1) == 0, 1.0, 2.0) / n
    p_values = []
    for revolution in orders:
        noise = np.array([1.0 / n])
        p_values.append(
            [
                c.p_value
                for c in _gap_cells(
                    CHANNELS, revolution[None], ["R"], np.zeros(1, dtype=int), noise
                )
            ]
        )
    # Adjusted p-values of 77 cells: hardly ever below 5 % where the noise is the only gap.
    assert np.mean(np.min(p_values, axis=1) < 0.05) < 0.05
    # And not for want of power: the raw noise is met. One cell scatters by 6 % over 300 draws.
    split = pattern_split(CHANNELS, orders)
    met = (split.weights * np.mean(np.abs(split.amplitudes) ** 2, axis=0))[split.weights > 0.0]
    expected = split.noise[split.weights > 0.0] / n
    assert_allclose(met, expected, rtol=0.2)
    assert np.mean(met / expected) == pytest.approx(1.0, abs=0.02)


def random_orders(rng, shape):
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)


def test_patterns_of_some_revolutions_are_those_of_all_to_the_last_digit():
    orders = random_orders(np.random.default_rng(2), (30, len(CHANNELS), MAX_ORDER + 1))
    amplitudes = pattern_split(CHANNELS, orders).amplitudes
    for rows in (np.arange(3), np.array([7]), np.array([4, 9, 21])):
        assert np.array_equal(pattern_split(CHANNELS, orders[rows]).amplitudes, amplitudes[rows])


def test_the_map_of_many_runs_takes_memory_for_its_cells_and_not_for_their_revolutions():
    channels = tuple(replace(CHANNELS[0], name=f"s{k}", angle=0.1 * k) for k in range(32))
    rng = np.random.default_rng(4)

    def beside_map(turns):
        orders = random_orders(rng, (20 * turns, len(channels), MAX_ORDER + 1))
        names = [f"R{k}" for k in range(20)]
        tracemalloc.start()
        _gap_cells(channels, orders, names, np.repeat(np.arange(20), turns), np.ones(20))
        size = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return size

    beside_map(2)
    # With the patterns of all revolutions it took 4.6 MB more, and takes 0.03.
    assert beside_map(20) - beside_map(2) < 1e6


@pytest.mark.parametrize(
    ("effect", "order", "growth"),
    [
        ("torque_tilt", 0, r" \(growth with torque not determinable: the baseline .* mean\)"),
        ("unequal_load_sharing", 2, r", growing as torque\^(0\.9|1\.0), whatever the radial load"),
    ],
)
def test_what_is_beside_a_mean_grows_by_no_power(effect, order, growth):
    """A tilt that follows the torque is as large above the mean torque as below it."""
    loads = ((1.0, 0, 0), (0.5, 0, 0), (1.0, 0, -2e5), (0.75, 0, 5e4), (0.25, 0, -1e5))
    problem = twin_problem(effect, loads=loads, channels=CHANNELS[:4], turns=6)
    (clause,) = [text for text in said(problem).split("; ") if f"order {order}, " in text]
    assert re.search(f"in every run{growth}$", clause)
