"""A plan on signatures whose angles have a closed form."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.diagnosis.inference.planning.plan import (
    PlannedTable,
    Signature,
    _visible_multiple,
    campaign_plan,
)
from carrierflex.diagnosis.inference.planning.results import (
    ALIKE,
    LOADS,
    MINUTES,
    NEVER,
    PARTED,
    SENSOR,
    Addition,
    Costs,
    first_sentences,
)
from carrierflex.simulation.fit_parameter import FitParameter

N_SAMPLES = 400.0
SCALES = {"offset": 2e-5, "tilt": 1e-4}


def table_of(columns, *, runs, channels, n_base=0, scales=SCALES):
    """Table of constant columns: one row a part, the target zero, noise of one."""
    columns = np.asarray(columns, dtype=np.float64)
    rows = np.concatenate([np.zeros((len(columns), 1)), columns], axis=1)
    grams = N_SAMPLES * rows[:, :, None] * rows[:, None, :]
    names = tuple(scales)
    return PlannedTable(
        gram=grams,
        n_base=n_base,
        known=np.zeros(n_base),
        signatures=tuple(Signature(name, (), (1 + n_base + k,)) for k, name in enumerate(names)),
        parameters={
            name: FitParameter("a", "m", -1.0, 1.0, scale) for name, scale in scales.items()
        },
        runs=np.array([run[0] for run in runs]),
        channels=np.array([run[1] for run in runs]),
        n_samples=np.full(len(runs), N_SAMPLES),
        run_names=tuple(f"run{k}" for k in range(1 + max(run[0] for run in runs))),
        channel_names=channels,
        noise_std=1.0,
    )


def plan_of_table(table, additions, planned, gap=6.0):
    return campaign_plan(
        table,
        additions,
        planned=planned,
        gap=gap,
        names=("twin", "carrier", "m"),
        costs=Costs(),
        is_measured=False,
    )


def addition(kind, minutes, channels, cost=10.0):
    return Addition(kind, kind, minutes, channels, cost)


def sensors_at(degrees):
    """Offset and tilt about one axis at sensors, each a channel of one run."""
    angles = np.deg2rad(degrees)
    columns = np.column_stack([np.ones(angles.size), np.cos(angles)])
    names = tuple(f"s{degree}" for degree in degrees)
    return table_of(columns, runs=[(0, c) for c in range(angles.size)], channels=names)


@pytest.mark.parametrize("second", [30, 90, 180])
def test_the_angle_between_offset_and_tilt_is_that_of_two_vectors_over_the_sensors(second):
    table = sensors_at([0, second])
    planned = addition(MINUTES, {"run0": 1.0}, table.channel_names, 0.0)
    plan = plan_of_table(table, [], planned)
    offset, tilt = np.ones(2), np.cos(np.deg2rad([0, second]))
    cosine = offset @ tilt / np.linalg.norm(offset) / np.linalg.norm(tilt)
    for pair in plan.pairs:
        assert pair.angle_deg == pytest.approx(np.rad2deg(np.arccos(cosine)), abs=1e-4)


def test_a_sensor_diametrically_opposite_parts_an_offset_from_a_tilt():
    table = sensors_at([0, 15, 180])
    planned = addition(MINUTES, {"run0": 1.0}, ("s0",), 0.0)
    near, opposite = (addition(SENSOR, {"run0": 1.0}, ("s0", name)) for name in ("s15", "s180"))
    plan = plan_of_table(table, [near, opposite], planned)
    assert {pair.state for pair in plan.pairs} == {ALIKE}
    assert plan.proposal.addition is opposite
    assert plan.proposal.is_sufficient
    # Opposite, the rival leaves the whole gap of six floors, at right angles to it.
    assert plan.proposal.least_left == pytest.approx(6.0, rel=1e-6)
    assert plan.proposal.distance == pytest.approx(6.0 * np.sqrt(2.0 * N_SAMPLES), rel=1e-6)
    assert plan.proposal.information == pytest.approx(36.0 * N_SAMPLES, rel=1e-6)


def test_a_second_torque_parts_what_grows_with_torque_from_what_does_not():
    share = 0.25
    table = table_of([[1.0, 1.0], [1.0, share]], runs=[(0, 0), (1, 0)], channels=("s",))
    planned = addition(MINUTES, {"run0": 1.0}, ("s",), 0.0)
    longer = addition(MINUTES, {"run0": 4.0}, ("s",), 1.0)
    torque = addition(LOADS, {"run0": 1.0, "run1": 1.0}, ("s",), 16.0)
    plan = plan_of_table(table, [longer, torque], planned, gap=12.0)
    assert {pair.state for pair in plan.pairs} == {ALIKE}
    assert plan.proposal.addition is torque
    # Constant against growing: |1 - t| / |(1, t)| of a gap of 12, over the root of two runs.
    least = 12.0 * (1.0 - share) / np.hypot(1.0, 1.0) / np.sqrt(2.0)
    assert plan.proposal.least_left == pytest.approx(least, rel=1e-6)
    # Minutes alone part nothing: both stay in proportion.
    assert plan.additions[1].least_left == pytest.approx(0.0, abs=1e-4)


def test_twice_the_minutes_lower_the_smallest_visible_size_by_the_root_of_two():
    table = sensors_at([0, 90])
    sizes = [
        plan_of_table(table, [], addition(MINUTES, {"run0": minutes}, ("s0", "s90"), 0.0)).sizes[0]
        for minutes in (1.0, 2.0)
    ]
    assert sizes[0].seen_from / sizes[1].seen_from == pytest.approx(np.sqrt(2.0), rel=1e-9)
    # The floor rule of the diagnosis asks for a share of the noise, however long the record.
    assert sizes[0].named_from == pytest.approx(sizes[1].named_from, rel=1e-9)
    # Two sensors of 400 samples: the root of the energy reaches the asked-for standard deviations.
    expected = _visible_multiple(1) / np.sqrt(2.0 * N_SAMPLES) * SCALES["offset"]
    assert sizes[0].seen_from == pytest.approx(expected, rel=1e-9)


def test_what_the_baseline_takes_up_is_never_seen():
    columns = np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 1.0]])
    table = table_of(columns, runs=[(0, 0), (0, 1)], channels=("a", "b"), n_base=1)
    plan = plan_of_table(table, [], addition(MINUTES, {"run0": 1.0}, ("a", "b"), 0.0))
    offset, tilt = plan.sizes
    assert offset.seen_from == np.inf
    # Of (0, 1) the baseline (1, 1) leaves (-1, 1) / 2.
    assert tilt.surviving == pytest.approx(np.sqrt(0.5), rel=1e-6)
    assert plan.pairs == ()
    assert plan.proposal is None


def test_an_unrecorded_load_hides_what_it_looks_like_and_gauges_bring_it_back():
    # One sensor: offset and tilt, and at the end an unrecorded load that looks like the offset.
    table = table_of([[1.0, 0.0, 1.0]], runs=[(0, 0)], channels=("s",))
    planned = addition(MINUTES, {"run0": 1.0}, ("s",), 0.0)
    assert plan_of_table(table, [], planned).hidden == ()
    gauged = replace(table, n_unrecorded=1, bending_precision=99.0)
    plan = plan_of_table(gauged, [], planned)
    # The load is known to +-1 without gauges: of N samples N / (1 + N) of one are left.
    (offset,) = plan.hidden
    assert offset.effect == "offset"
    assert offset.none == pytest.approx(plan.sizes[0].seen_from, rel=1e-9)
    assert offset.unrecorded / offset.none == pytest.approx(np.sqrt(1.0 + N_SAMPLES), rel=1e-6)
    expected = np.sqrt(1.0 + N_SAMPLES / 100.0)
    assert offset.bending / offset.none == pytest.approx(expected, rel=1e-6)
    # Sizes and pairs of the plan itself are those without it.
    assert plan.sizes == plan_of_table(table, [], planned).sizes
    assert "one that acts unrecorded would hide offset below" in first_sentences(plan)


def test_causes_that_nothing_feasible_parts_ask_for_no_addition():
    table = table_of([[1.0, 1.0], [0.5, 0.5]], runs=[(0, 0), (1, 0)], channels=("s",))
    planned = addition(MINUTES, {"run0": 1.0}, ("s",), 0.0)
    plan = plan_of_table(table, [addition(LOADS, {"run0": 1.0, "run1": 1.0}, ("s",))], planned)
    assert {pair.state for pair in plan.pairs} == {NEVER}
    assert plan.proposal is None


def test_the_cheapest_of_sufficient_additions_is_proposed():
    table = sensors_at([0, 120, 180])
    planned = addition(MINUTES, {"run0": 1.0}, ("s0",), 0.0)
    dear = addition(SENSOR, {"run0": 1.0}, ("s0", "s180"), 240.0)
    cheap = addition(SENSOR, {"run0": 1.0}, ("s0", "s120"), 100.0)
    plan = plan_of_table(table, [dear, cheap], planned)
    assert [entry.addition.cost for entry in plan.additions] == [100.0, 240.0]
    assert all(entry.is_sufficient for entry in plan.additions)
    assert plan.additions[0].information < plan.additions[1].information


def test_of_additions_that_cost_as_much_the_one_comes_first_that_parts_all_pairs_further():
    """One pair it parts a little less: by that pair alone the other addition would come first."""
    # Sizes of three causes as planned, under one further load and under another.
    columns = [[1.0, 1.0, 1.0], [0.0, 1.0, -4.0], [0.0, 1.1, -1.2]]
    scales = {**SCALES, "saddle": 1e-5}
    runs = [(0, 0), (1, 0), (2, 0)]
    table = table_of(columns, runs=runs, channels=("s",), scales=scales)
    planned = addition(MINUTES, {"run0": 1.0}, ("s",), 0.0)
    further, other = (addition(LOADS, {"run0": 1.0, run: 1.0}, ("s",)) for run in ("run1", "run2"))
    plan = plan_of_table(table, [other, further], planned)
    first, second = plan.additions
    assert first.addition is further
    assert first.is_sufficient
    assert second.is_sufficient
    assert first.least_left < second.least_left
    assert first.mean_left > 1.2 * second.mean_left


def test_where_no_addition_is_sufficient_the_one_comes_first_that_comes_nearest():
    """Not the cheapest, which parts nothing: the diagnosis asks for less than the plan's margin."""
    table = sensors_at([0, 20, 25])
    planned = addition(MINUTES, {"run0": 1.0}, ("s0",), 0.0)
    cheap, near = (
        addition(SENSOR, {"run0": 1.0}, ("s0", sensor), cost)
        for sensor, cost in (("s20", 10.0), ("s25", 240.0))
    )
    plan = plan_of_table(table, [cheap, near], planned, gap=2.0)
    assert not any(entry.is_sufficient or entry.parted for entry in plan.additions)
    assert plan.proposal.addition is near


def test_a_pair_is_parted_from_the_gap_at_which_the_rival_leaves_two_floors():
    table = sensors_at([0, 60])
    planned = addition(MINUTES, {"run0": 1.0}, table.channel_names, 0.0)
    at = plan_of_table(table, [], planned, gap=6.0).pairs[0].parted_from
    assert plan_of_table(table, [], planned, gap=0.99 * at).pairs[0].state != PARTED
    pair = plan_of_table(table, [], planned, gap=1.01 * at).pairs[0]
    assert pair.state == PARTED
    assert pair.left == pytest.approx(2.02, rel=1e-6)


def test_a_rival_beyond_its_bound_parts_a_pair():
    """Two causes of one shape: the second is a fifth of the first for the same amplitude."""
    columns = np.array([[1.0, 0.2], [1.0, 0.2], [0.0, 0.05]])
    free = table_of(columns, runs=[(0, c) for c in range(3)], channels=("a", "b", "c"))
    planned = addition(MINUTES, {"run0": 1.0}, ("a", "b", "c"))

    def state(table):
        pairs = plan_of_table(table, (), planned).pairs
        return next(pair for pair in pairs if pair.cause == "offset").state

    assert state(free) != PARTED
    # A gap of 6 floors over three channels is an offset of some 7, and a tilt of 35.
    assert state(replace(free, bound=np.array([np.inf, np.inf, 100.0]))) != PARTED
    assert state(replace(free, bound=np.array([np.inf, np.inf, 10.0]))) == PARTED


def test_a_known_value_of_the_baseline_takes_up_nothing():
    columns = np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 0.3]])
    runs = [(0, 0), (0, 1)]
    free = table_of(columns, runs=runs, channels=("a", "b"), n_base=1)
    planned = addition(MINUTES, {"run0": 1.0}, ("a", "b"))
    surviving = [
        plan_of_table(table, (), planned).sizes[0].surviving
        for table in (free, replace(free, known=np.array([np.inf])))
    ]
    assert surviving == pytest.approx([0.0, 1.0], abs=1e-6)
