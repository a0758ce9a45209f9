"""Campaigns that a stage predicts: what differs inside it is named, and nothing where all agrees.

Records are equilibria of the same stage with one thing changed, and noise.
"""

from dataclasses import replace

import pytest

from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.kinds import problem_of
from carrierflex.diagnosis.report.verdict_words import verdict_heading
from carrierflex.reduction.pin_joints import carrier_with_pins
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.predicted_readings import PredictedStage
from carrierflex.simulation.stage.readings import ReadingEffects
from carrierflex.simulation.stage.stage_body import ShaftData, beam_shaft, joined_to_shaft
from carrierflex.simulation.stage.stage_data import BearingData, MeshData, StageData
from carrierflex.workflows.diagnosis.stage_baseline import predicted_by
from carrierflex.workflows.fe.default_curves import default_curves
from tests.diagnosis.carrier.stage_twin import measured

LOOSE = BearingData(upwind_clearance=0.1375e-3, downwind_clearance=0.1225e-3)


@pytest.fixture(scope="module")
def stage(flexible_reduction, pin_reduction):
    carrier = carrier_with_pins(flexible_reduction.model, pin_reduction.model, 1.7e7)
    body = joined_to_shaft(carrier, beam_shaft(ShaftData(), carrier.pilots["shaft_face"]))
    data = StageData(mesh=MeshData(n_slices=2), bearings=LOOSE)
    return PredictedStage(body, data, StageEffects(), ReadingEffects(), 2.3, rest_angle=0.0)


def answer_to(truth, stage):
    problem = problem_of(predicted_by(measured(truth), stage), default_curves())
    return diagnose(problem, campaign="twin", kind="carrier")


@pytest.mark.long
def test_a_stage_that_nobody_solved_is_refused(stage):
    with pytest.raises(ValueError, match="'source' is 'stage'; expected predictions"):
        problem_of(measured(stage), default_curves())


@pytest.mark.long
def test_a_stage_as_its_case_has_it_is_at_the_floor(stage):
    assert answer_to(stage, stage).verdict == "at_noise_floor"


@pytest.mark.long
def test_a_held_sun_is_named_with_its_stiffness(stage):
    supported = replace(stage.data, bearings=replace(LOOSE, sun_radial=4e8))
    answer = answer_to(replace(stage, data=supported), stage)
    assert answer.attribution.effects == ("stage/sun_radial",)
    values = answer.attribution.parameters["stage/sun_radial"]
    assert values["sun_radial"].value == pytest.approx(4e8, rel=0.3)
    assert values["response"].value == pytest.approx(1.0, abs=0.1)
    assert "restraint of the sun" in verdict_heading(answer)


@pytest.mark.long
def test_a_clearance_is_named_on_its_own_side(stage):
    tight = replace(stage.data, bearings=replace(LOOSE, downwind_clearance=0.07e-3))
    answer = answer_to(replace(stage, data=tight), stage)
    assert answer.attribution.effects == ("stage/downwind_clearance",)
    values = answer.attribution.parameters["stage/downwind_clearance"]
    assert values["downwind_clearance"].value == pytest.approx(0.07e-3, rel=0.1)
