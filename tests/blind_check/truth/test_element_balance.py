"""Two causes of an element show alike in its records, and one outside every class is outside."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.blind_check.labels import OUTSIDE, PAIR, CasePlan
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.blind_check.truth.element.case import ElementCase
from carrierflex.blind_check.truth.element.drawing import CHANGE
from carrierflex.blind_check.truth.element.drives import MULTISINE, NOISE, SWEEPS
from carrierflex.blind_check.truth.element.reference import force_of, reference_motion
from carrierflex.blind_check.truth.element.truth import (
    _BALANCE,
    _drawn_case,
    own_gaps,
    shown_by_each,
)
from carrierflex.blind_check.truth.noise import case_rng

pytestmark = pytest.mark.long

#: Causes and number of cases: a driven element, and two under a force, whose motion the causes
#: change.
PAIRS = [
    (("power_spring", "rubber"), 2),
    (("late_sensor", "cubic_damper"), 1),
    (("gap_in_spring", "coulomb"), 1),
]
#: Number of a case of spring and dashpot under a force.
FORCED = 1


def drawn(names: tuple[str, ...], number: int, family: str, drive: str) -> ElementCase:
    """Case without noise."""
    plan = CasePlan("element", number, 8461, family, names, 5.0, drive)
    return _drawn_case(plan, case_rng(plan))


@pytest.fixture(scope="module", params=PAIRS, ids=lambda pair: "-".join(pair[0]))
def pair(request):
    """Names of two causes, and a case that holds them."""
    names, number = request.param
    return names, drawn(names, number, PAIR, SWEEPS)


def test_the_causes_of_a_pair_leave_alike(pair):
    names, case = pair
    first, second = own_gaps(case, names)
    assert 0.93 * _BALANCE[0] < second / first < 1.07 * _BALANCE[1]


def test_a_cause_whose_motion_runs_away_alone_leaves_what_the_motion_with_both_shows():
    """A softening spring under a random force, without the damper that drifts beside it."""
    effects = ("drifting_damper", "quadratic_spring")
    plan = CasePlan("element", 752, 8461, PAIR, effects, 2.3737153142663034, MULTISINE)
    _, label = case_campaign(plan)
    first, second = label.own_gaps
    assert np.isfinite(label.own_gaps).all()
    assert 0.93 * _BALANCE[0] < second / first < 1.07 * _BALANCE[1]


def test_what_each_cause_shows_adds_up_to_the_records(pair):
    names, case = pair
    # Without the curvature of the baseline's own spring and damper, which is no cause.
    bare = case.element.laws[: sum(name != "late_sensor" for name in names)]
    case = replace(case, element=replace(case.element, laws=bare))
    plain = np.array(case.signals(case.plain))
    each = np.array(shown_by_each(case, names))
    recorded = np.array(case.signals(case.element)) - plain
    np.testing.assert_allclose((each - plain).sum(axis=0), recorded, atol=2e-3 * recorded.std())


@pytest.mark.parametrize("number", [0, FORCED])
def test_a_spring_that_hardens_before_a_dashpot_is_no_linear_memory(number):
    case = drawn(("spring_and_dashpot",), number, OUTSIDE, NOISE)
    assert case.plain.by_force == (number == FORCED)
    law = case.element.laws[0]
    # On the motion with it: a mass that it holds back bends its spring less than one without it.
    motion = reference_motion(case.element, case.drives[-1], case.n)
    # Other times than those that it was drawn with.
    taus = np.geomspace(0.02, 20.0, 20) / case.plain.omega
    v = motion.columns[:, 1]
    branches = [relaxing(v, motion.step, tau) for tau in taus]
    memory = replace(motion, columns=np.column_stack([motion.columns, *branches]))
    force = force_of(law, motion)
    assert memory.missing(force) > 0.95 * CHANGE[1] * motion.missing(force)
    straight = replace(law, p=np.array([0.0, taus[10], 0.0, 0.0, 0.0, 0.0]))
    force = force_of(straight, motion)
    assert memory.missing(force) < 0.01 * motion.missing(force)


def relaxing(v, step, tau):
    """Deflection of a spring in series with a dashpot, by Euler steps backward in time."""
    result = np.zeros(v.size)
    for k in range(1, v.size):
        result[k] = (result[k - 1] + step * v[k]) / (1.0 + step / tau)
    return result
