"""Records that are measured after those of a mounting: the same rig, the same earlier records."""

import numpy as np
import pytest

from carrierflex.blind_check.truth.mounting.loads import CONDITIONS, LOADED, RATE, asked_record
from carrierflex.blind_check.truth.mounting.truth import mounting_case
from studies.tabulate_plans import alias_case

TIME = np.linspace(0.0, 40.0, 801)
#: Torque that rises after the rest, in a straight line.
TORQUE = 1e5 * np.clip((TIME - 5.0) / 10.0, 0.0, 1.0)
ADDED = asked_record("torque alone", TIME, np.array([TORQUE, 0.0 * TIME, 0.0 * TIME]).T)


@pytest.fixture(scope="module")
def campaigns():
    case = alias_case(3, 10, (5.0, 30.0), kind="mounting")
    return case, mounting_case(case), mounting_case(case, added=(ADDED,))


def test_a_case_is_one_record_of_one_cause(campaigns):
    case, (given, label), _ = campaigns
    assert [run.condition for run in given.runs] == [CONDITIONS[LOADED[1]][0]]
    assert label.effects == case.effects


def test_earlier_records_and_the_label_stay_what_they_were(campaigns):
    _, (given, label), (enlarged, same) = campaigns
    assert same == label
    assert len(enlarged.runs) == len(given.runs) + 1
    for name, values in given.runs[0].columns().items():
        np.testing.assert_array_equal(enlarged.runs[0].columns()[name], values)


def test_added_loads_are_those_that_were_asked_for(campaigns):
    _, _, (enlarged, _) = campaigns
    run = enlarged.runs[-1]
    assert 1.0 / np.diff(run.time) == pytest.approx(RATE)
    wanted = np.interp(run.time, TIME, TORQUE)
    # Recorded torque is up to 1 % wrong, as in every record of the case.
    np.testing.assert_allclose(run.inputs["torque"], wanted, rtol=0.011)
    assert not run.inputs["ntl_y"].any()


def test_the_rig_answers_the_added_load_as_the_earlier_one(campaigns):
    _, _, (enlarged, _) = campaigns
    end = enlarged.runs[-1].time > 30.0
    vertical = [name for name in enlarged.runs[-1].signals if name.endswith("z")]
    roll = [enlarged.runs[-1].signals[name][end].mean() for name in vertical]
    # Torque alone rolls the housing: one side goes up as the other goes down.
    assert min(roll) < 0.0 < max(roll)
