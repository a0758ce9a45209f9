"""Where sliders begin, and bristles as stops."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.classes.columns import dahl_friction, stops
from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.element.columns import memory_of_stops
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.element.shapes import _stops_of_bristles
from carrierflex.diagnosis.element.table import _best_starts, element_table
from carrierflex.simulation.element.memory_kernels import forces_along
from carrierflex.simulation.element.memory_laws import flat_parts
from tests.diagnosis.element.element_campaigns import (
    DAMPING,
    STEP,
    STIFFNESS,
    displacement_campaign,
)

N = 2400
#: Yield deflection of the slider: the lowest of the three levels does not reach it.
YIELD = 9e-4


def switched_on(begins):
    """Slow sines that grow in the record beside a slider; `begins` is where it begins."""
    plain = displacement_campaign(lambda q, v: 0.0 * q, n=N)
    time = STEP * np.arange(N)
    runs = []
    for number, (run, level) in enumerate(zip(plain.runs, (0.5e-3, 1.2e-3, 2e-3), strict=True)):
        omega = 2.0 * np.pi * 1.3
        growth = np.clip(time / 1.5, 0.0, 1.0) ** 3
        q = level * growth * np.sin(omega * time)
        v = np.gradient(q, STEP)
        rng = np.random.default_rng(number)
        force = STIFFNESS * q + DAMPING * v + 0.02 * rng.standard_normal(N)
        force += 4.0 * begins(q)
        runs.append(replace(run, inputs={"displacement": q}, signals={"F": force}))
    channel = replace(plain.channels[0], noise_std=0.02)
    rig = {"drive": "displacement", "settle_samples": 400}
    return replace(plain, runs=tuple(runs), channels=(channel,), rig=rig)


def relaxed(q):
    return stops(q, np.array([YIELD]), from_rest=True)[0]


def left_by_a_like_motion(q):
    return stops(q, np.array([YIELD]))[0]


def starts(campaign):
    problem = element_problem(campaign)
    table = element_table(problem.model, problem.records, ClassConstants())
    return [record.from_rest for record in table.records]


@pytest.mark.parametrize(("begins", "expected"), [(relaxed, True), (left_by_a_like_motion, False)])
def test_the_runs_tell_together_where_their_sliders_began(begins, expected):
    campaign = switched_on(begins)
    # The lowest run never slips: by itself it has a spring and a constant, whichever way it began.
    # The others slip before they count, and nothing hangs on it.
    assert starts(campaign)[0] == expected
    result = element_problem(campaign).class_answer()
    assert result.rivals.get("hysteresis", result.share) > 0.97


def test_a_run_cut_from_a_longer_one_begins_where_a_like_motion_leaves_it():
    campaign = displacement_campaign(lambda q, v: 0.0 * q, n=N)
    assert starts(campaign) == [False] * 3


def test_a_column_that_moves_in_one_run_alone_leaves_no_rounding_where_it_begins_relaxed():
    rng = np.random.default_rng(1)
    runs = [rng.standard_normal((5, 200)) for _ in range(2)]
    # The last column stands still but for 1e-12 in the first run, and in the second if relaxed.
    runs[0][-1] *= 1e-12
    second_relaxed = runs[1].copy()
    second_relaxed[-1] = 0.0
    second_relaxed[0] = runs[1][0] = runs[1][1] + 0.1 * runs[1][-1]
    starts = [[runs[0] @ runs[0].T], [runs[1] @ runs[1].T, second_relaxed @ second_relaxed.T]]
    assert _best_starts(starts, 2) == [False, False]


def test_stops_turn_as_a_bristle_does():
    length, force = 2e-5, 3.0
    q = 4e-4 * np.abs((np.arange(4000) / 500.0 + 1.0) % 4.0 - 2.0) - 4e-4
    bristle = force * dahl_friction(q, np.array([length]), from_rest=True)[0]
    yields, weights = _stops_of_bristles(np.array([length]), np.array([force]))
    memory = memory_of_stops({"slip": (yields, weights)}, 0.0, 1e-3)
    assert weights.sum() == pytest.approx(force)
    result = forces_along(q, 1e-3, flat_parts(memory))
    after_first_turn = slice(1200, None)
    assert_allclose(result[after_first_turn], bristle[after_first_turn], atol=0.025 * force)
    # One stop of the same length is a tenth of it off.
    single = force * stops(q, np.array([length]), from_rest=True)[0]
    assert np.abs(single - bristle)[after_first_turn].max() > 0.1 * force
