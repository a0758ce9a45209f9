"""Clocks of loggers: dates, missing rows, other rates without aliasing, another simulator's."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.identification.logs.clock_shift import clock_shift
from carrierflex.identification.logs.clocks import (
    date_format,
    grid_with_gaps,
    on_clock,
    rows_in_order,
    seconds_of_dates,
)


def test_what_a_slower_clock_cannot_show_does_not_fold_back():
    time = np.arange(0.0, 20.0, 1.0 / 200.0)
    slow = np.sin(2.0 * np.pi * 5.0 * time)
    # Sampled twenty times a second, 43 Hz would appear at 3 Hz.
    fast = np.sin(2.0 * np.pi * 43.0 * time)
    clock = np.arange(0.0, 19.9, 1.0 / 20.0)
    inner = slice(40, -40)
    there = on_clock(slow + fast, time, clock)[inner]
    assert_allclose(there, np.sin(2.0 * np.pi * 5.0 * clock)[inner], atol=2e-3)


def test_a_slower_record_on_a_faster_clock_is_what_it_was_between_its_samples():
    time = np.arange(0.0, 10.0, 0.05)
    clock = np.arange(0.0, 9.9, 0.013)
    there = on_clock(np.sin(2.0 * np.pi * 3.0 * time), time, clock)
    inner = (clock > 1.0) & (clock < 9.0)
    assert_allclose(there[inner], np.sin(2.0 * np.pi * 3.0 * clock)[inner], atol=2e-3)


def test_a_gap_stays_a_gap_on_another_clock():
    time = np.arange(0.0, 10.0, 0.01)
    values = np.sin(time)
    values[300:400] = np.nan
    clock = np.arange(0.0, 9.9, 0.05)
    there = on_clock(values, time, clock)
    missing = np.isnan(there)
    assert missing[(clock > 3.01) & (clock < 3.98)].all()
    assert not missing[(clock < 2.98) | (clock > 4.01)].any()


def test_missing_rows_come_back_as_rows_and_a_rounded_clock_is_even():
    time = np.round(np.arange(1000) / 600.0, 3)  # stamps of milliseconds
    full, rows = grid_with_gaps(np.delete(time, slice(100, 104)))
    assert full.size == 1000
    assert rows.tolist() == [*range(100), *range(104, 1000)]
    # The clock behind the stamps, not the stamps.
    assert_allclose(np.diff(full), 1.0 / 600.0, rtol=1e-3)


def test_rows_that_go_back_in_time_are_left_out_and_a_column_that_is_no_time_is_refused():
    time = np.arange(1000.0)
    time[500] = 3.0
    assert np.flatnonzero(~rows_in_order(time, "a.csv")).tolist() == [500]
    with pytest.raises(ValueError, match=r"a\.csv: time does not increase or is missing in"):
        rows_in_order(np.sin(np.arange(1000.0)), "a.csv")


@pytest.mark.parametrize(
    ("texts", "format_"),
    [
        (["2024-02-29 23:59:59.900", "2024-03-01 00:00:00.150"], "%Y-%m-%d %H:%M:%S"),
        (["29.02.2024 23:59:59,900", "01.03.2024 00:00:00,150"], "%d.%m.%Y %H:%M:%S"),
        (["02/29/2024 11:59:59.900 PM", "03/01/2024 12:00:00.150 AM"], "%m/%d/%Y %I:%M:%S %p"),
        (["23:59:59.900", "00:00:00.150"], "%H:%M:%S"),
    ],
)
def test_dates_are_seconds_over_the_end_of_a_day(texts, format_):
    assert date_format(texts, "a.csv") == format_
    assert_allclose(np.diff(seconds_of_dates(texts, "", "a.csv")), 0.25, atol=1e-6)


@pytest.mark.parametrize(
    ("first_day", "second_day", "format_"),
    [
        ("01/02/2024", "01/03/2024", "%m/%d/%Y %H:%M:%S"),
        ("02/01/2024", "03/01/2024", "%d/%m/%Y %H:%M:%S"),
    ],
)
def test_a_night_is_no_month_whatever_comes_first_in_its_dates(first_day, second_day, format_):
    texts = [
        *(f"{first_day} 23:59:{second:02d}" for second in range(30, 60)),
        *(f"{second_day} 00:00:{second:02d}" for second in range(30)),
    ]
    assert date_format(texts, "a.csv") == format_
    assert_allclose(np.diff(seconds_of_dates(texts, "", "a.csv")), 1.0)


def test_a_month_of_seconds_is_no_night():
    days = [f"{day:02d}/02/2024 {hour:02d}:00:00" for day in range(1, 30) for hour in range(24)]
    assert date_format([*days, "01/03/2024 00:00:00"], "a.csv") == "%d/%m/%Y %H:%M:%S"


def test_the_clock_of_another_simulator_is_found_between_the_samples():
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 40.0, 0.05)

    def motion(t):
        return np.sin(1.7 * t) + 0.4 * np.sin(4.1 * t + 1.0) + 0.02 * t

    measured = 1e-3 * motion(time) + 2e-6 * rng.standard_normal(time.size)
    # The simulator began 3.2137 s later by its own clock, samples faster and has another gain.
    own_time = np.arange(0.0, 36.0, 0.02)
    predicted = 0.9e-3 * motion(own_time + 3.2137)
    shift = clock_shift(time, [measured], own_time, [predicted])
    assert_allclose(shift.seconds, 3.2137, atol=max(4.0 * shift.std, 1e-4))
    assert shift.std < 1e-3
    assert shift.correlation > 0.99


def test_of_a_motion_that_repeats_other_shifts_are_as_good():
    time = np.arange(0.0, 40.0, 0.05)
    signal = np.sin(2.0 * np.pi * time / 2.5)
    shift = clock_shift(time, [signal], time, [signal])
    assert_allclose(shift.seconds, 0.0, atol=1e-6)
    assert any(abs(other - 2.5) < 0.06 for other in shift.others)


def test_records_that_do_not_move_together_have_no_shift():
    time = np.arange(0.0, 10.0, 0.05)
    with pytest.raises(ValueError, match="do not move together"):
        clock_shift(time, [np.zeros(time.size)], time, [np.sin(time)])
