"""Delays of the loads: what one leaves of the gap, and beside what it is sought."""

from itertools import chain
from types import SimpleNamespace

import numpy as np
import pytest

from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.mounting import table as module
from carrierflex.diagnosis.mounting.columns import DELAYS
from carrierflex.diagnosis.mounting.table import (
    DELAY_WAYS,
    FORCE_GROUPS,
    _nearest_delays,
    _remaining_squares,
)


def test_what_a_delay_leaves_is_what_a_fit_beside_the_other_columns_leaves():
    rows = np.random.default_rng(3).standard_normal((7, 50))
    # A column that the others hold, as splines that add up to the linear spring do.
    rows[3] = rows[1] - 2.0 * rows[2]
    gram = rows @ rows.T
    base = np.array([1, 2, 3])
    for delay in (4, 5, 6):
        columns = rows[[1, 2, delay]].T
        solution = np.linalg.lstsq(columns, rows[0], rcond=None)[0]
        expected = np.sum((rows[0] - columns @ solution) ** 2)
        assert _remaining_squares(gram, base, np.array([delay]))[0] == pytest.approx(expected)
    columns = rows[[1, 2]].T
    solution = np.linalg.lstsq(columns, rows[0], rcond=None)[0]
    # One that the others hold takes nothing.
    assert _remaining_squares(gram, base[:2], np.array([3]))[0] == pytest.approx(
        np.sum((rows[0] - columns @ solution) ** 2)
    )


def found_delay(monkeypatch, force, size):
    """Delay where a force of some size is missing with the fifth one; the noise is one."""
    rng = np.random.default_rng(5)
    sizes = {"base": 2, **dict.fromkeys(chain(*FORCE_GROUPS.values()), 3)}
    sizes |= dict.fromkeys(DELAY_WAYS, DELAYS.size)
    ends = 1 + np.cumsum(list(sizes.values()))
    numbers = {
        name: np.arange(end - size, end)
        for (name, size), end in zip(sizes.items(), ends.tolist(), strict=True)
    }
    rows = rng.standard_normal((ends[-1], 400))
    column = rows[numbers[force][1]]
    rows[0] = 10.0 * rows[numbers["all"][4]] + size * column + rng.standard_normal(400)
    # What the force makes looks like another delay to stiffness and damping alone.
    rows[numbers["all"][9]] = column + 0.3 * rng.standard_normal(400)
    monkeypatch.setattr(
        module, "_delay_rows", lambda run, groups, channels: (run.gap[:, 0], numbers)
    )
    # Two runs count as one of both.
    runs = [
        SimpleNamespace(gap=rows[:, None, samples]) for samples in (slice(150), slice(150, None))
    ]
    result = _nearest_delays(runs, (), np.eye(1), ClassConstants())
    assert result.keys() == set(DELAY_WAYS)
    return result["all"]


@pytest.mark.parametrize("shape", FORCE_GROUPS)
def test_a_delay_is_sought_beside_the_force_that_is_missing_with_it(shape, monkeypatch):
    assert found_delay(monkeypatch, FORCE_GROUPS[shape][0], 100.0) == DELAYS[4]


def test_a_force_that_takes_little_of_what_a_delay_leaves_chooses_none(monkeypatch):
    def remaining_squares(gram, base, delays):
        """Four hundred of noise and a little; beside any force another delay leaves the noise."""
        squares = np.full(delays.size, 1e5)
        squares[4] = 415.0
        if base.size > 2:
            squares[9] = 400.0
        return squares

    monkeypatch.setattr(module, "_remaining_squares", remaining_squares)
    assert found_delay(monkeypatch, "f", 0.0) == DELAYS[4]
