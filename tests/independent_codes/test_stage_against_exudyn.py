"""The stage's kink and clearances against rigid bodies and springs in another code."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.workflows.simulation.simulate_table_5 import reference_model, table_5_case
from carrierflex.workflows.simulation.stage_bodies import made_rigid, stage_body_of

pytest.importorskip("exudyn")

from benchmarks.stage_against_exudyn import compared_motion, mounting_numbers
from benchmarks.stage_by_exudyn import exudyn_stage

#: Gears, which the other model leaves out but for the sun's weight, change the motion by a
#: twentieth; a bearing without its clearance by a third, a kink by all of order 1.
_SHARE = 0.08


@pytest.fixture(scope="module")
def model(flexible_reduction, pin_reduction):
    body = stage_body_of(made_rigid(flexible_reduction.model), pin_reduction.model, 1e7)
    return reference_model(body, table_5_case("LC1"))


@pytest.mark.long
def test_kink_and_clearances_move_the_rim_as_in_exudyn(model):
    compared = compared_motion(model, table_5_case("LC1"))
    assert compared.size > 1e-4
    assert compared.difference < _SHARE * compared.size


def test_exudyn_without_kink_or_clearance_moves_otherwise(model):
    # Half a turn: what is told apart is larger than what dies away.
    case = table_5_case("LC1")
    numbers = mounting_numbers(model, case)
    tight = tuple(replace(bearing, clearance=0.0) for bearing in numbers.bearings)
    changed = (numbers, replace(numbers, kink=np.zeros(2)), replace(numbers, bearings=tight))
    ranges = []
    for data in changed:
        motion = exudyn_stage(data, duration=np.pi / case.speed, step=4e-3)
        settled = motion.carrier_angle > 0.5 * np.pi
        ranges.append(np.ptp(motion.slope_y[settled]))
    with_kink, without, no_clearance = ranges
    assert without < 0.2 * with_kink
    assert no_clearance < 0.7 * with_kink
