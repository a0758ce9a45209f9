"""Runs that are measured after those of a case: the same machine, the same earlier records."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.blind_check.labels import STAGE, CasePlan
from carrierflex.blind_check.truth.carrier.rig import AddedRun
from carrierflex.blind_check.truth.carrier.truth import carrier_case
from studies.tabulate_plans import added_runs, alias_case

ADDED = (AddedRun(0.25, 0.0, 5e4, 2.3, 20.0), AddedRun(0.5, 0.0, 0.0, 1.5, 48.0))


@pytest.fixture(scope="module")
def campaigns():
    case = alias_case(3, 5, (5.0, 30.0))
    return carrier_case(case), carrier_case(case, added=ADDED)


def test_earlier_records_and_the_label_stay_what_they_were(campaigns):
    (given, label), (enlarged, same) = campaigns
    # Only the offsets of the added runs are new among its true parameters.
    earlier = {
        effect: {name: same.parameters[effect][name] for name in values}
        for effect, values in label.parameters.items()
    }
    assert replace(same, parameters=earlier) == label
    assert set(same.parameters) == set(label.parameters)
    for before, after in zip(given.runs, enlarged.runs[: len(given.runs)], strict=True):
        for name, values in before.columns().items():
            np.testing.assert_array_equal(after.columns()[name], values)
    assert enlarged.channels == given.channels or len(enlarged.channels) == len(given.channels)


def test_added_runs_are_those_that_were_asked_for(campaigns):
    (given, _), (enlarged, _) = campaigns
    nominal = given.rig["nominal_torque"]
    for addition, run in zip(ADDED, enlarged.runs[len(given.runs) :], strict=True):
        assert run.inputs["torque"].mean() / nominal == pytest.approx(addition.torque, rel=0.03)
        np.testing.assert_allclose(run.inputs["ntl_z"], addition.ntl_z)
        assert run.time[-1] == pytest.approx(addition.seconds, abs=0.06)
        turned = run.inputs["carrier_angle"][-1] - run.inputs["carrier_angle"][0]
        assert turned / run.time[-1] == pytest.approx(addition.speed, rel=0.02)


def test_what_an_enlarged_campaign_adds_is_read_back_as_runs(campaigns):
    (given, _), (enlarged, _) = campaigns
    minutes = {run.name: 2.0 for run in enlarged.runs[len(given.runs) :]}
    read = added_runs(enlarged, minutes, len(given.runs))
    assert [addition.seconds for addition in read] == pytest.approx([40.0, 96.0], abs=0.2)
    assert [addition.ntl_z for addition in read] == [5e4, 0.0]


def test_a_case_of_the_stage_takes_no_further_runs():
    plan = CasePlan("carrier", 1, 1, STAGE, ("ring_pass",), 3.0)
    with pytest.raises(ValueError, match="family stage takes no further runs"):
        carrier_case(plan, added=ADDED)
