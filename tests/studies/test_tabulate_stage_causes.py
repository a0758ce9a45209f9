"""Campaigns that a stage predicts: how an answer counts, and what the drawn pairs differ in."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from carrierflex.geometry.pins import PAPER_STIFFNESS
from carrierflex.simulation.stage import causes
from carrierflex.simulation.stage.causes import SIZED_CAUSES
from carrierflex.simulation.stage.predicted_readings import PredictedStage
from carrierflex.simulation.stage.readings import ReadingEffects
from carrierflex.workflows.simulation.stage_bodies import default_stage_body
from studies.tabulate_held_sun import FLOOR
from studies.tabulate_stage_causes import (
    CLASSES,
    FALSE,
    NONE,
    NOTHING,
    RIGHT,
    TIED,
    WITH_OTHERS,
    StageAnswer,
    answered,
    answers_table,
    drawn_pair,
    readings_at_rest,
    recorded_campaign,
    size_of,
)

SUN = "stage/sun_restraint/torque+radial_load"


@pytest.mark.parametrize(
    ("truth", "named", "ties", "outcome"),
    [
        ("sun_restraint", ("stage/sun_radial",), (), RIGHT),
        ("sun_restraint", (SUN,), (), RIGHT),
        ("sun_restraint", (SUN,), ("housing/tilt/radial_load",), TIED),
        ("sun_restraint", ("ntl_tilt",), (SUN,), TIED),
        ("sun_restraint", (SUN, "housing/tilt/torque"), (), WITH_OTHERS),
        ("sun_restraint", ("ntl_tilt",), (), FALSE),
        ("sun_restraint", (), (), NONE),
        ("carrier_clearance", ("stage/upwind_clearance", "stage/downwind_clearance"), (), RIGHT),
        ("joint_tilt", ("carrier_tilt",), ("stage/joint_tilt",), TIED),
        (NOTHING, (), (), RIGHT),
        (NOTHING, ("stage/sun_radial",), (), FALSE),
    ],
)
def test_an_answer_counts_by_its_class(truth, named, ties, outcome):
    assert StageAnswer(truth, 5.0, "named", named, ties, 0.1).outcome == outcome


def test_the_table_counts_every_class_and_all():
    rows = [
        StageAnswer("sun_restraint", 4.0, "named", ("stage/sun_radial",), (), 0.2),
        StageAnswer("sun_restraint", 9.0, "none_of_these", (), (), np.nan),
        StageAnswer(NOTHING, 0.0, "at_noise_floor", (), (), np.nan),
    ]
    lines = answers_table(rows)
    assert "| sun_restraint | 2 | 4.0 to 9.0 | 1 | 0 | 0 | 0 | 1 |" in lines
    assert "| all | 3 | 0.0 to 9.0 | 2 | 0 | 0 | 0 | 1 |" in lines


@pytest.mark.parametrize("truth", CLASSES)
def test_a_truth_differs_from_its_case_in_its_own_class_alone(truth):
    differing = {
        "sun_restraint": {"sun_radial"},
        "carrier_clearance": {"upwind_clearance", "downwind_clearance"},
        "mounting": {"axial_stiffness", "tilt_stiffness"},
        "joint_tilt": {"phi_PLC", "theta_PLC"},
        "pin_places": {"pin_offset"},
        NOTHING: set(),
    }[truth]
    for seed in range(5):
        case, other = (
            {**asdict(data.bearings), **asdict(data.mounting), **asdict(effects)}
            for data, effects in drawn_pair(truth, np.random.default_rng(seed))
        )
        changed = {name for name in case if case[name] != other[name]}
        assert changed <= differing
        assert changed or truth == NOTHING
        if truth == "mounting":
            (name,) = changed
            assert other[name] > 0.0
            assert abs(np.log(other[name] / case[name])) > np.log(2.0)


@pytest.mark.long
def test_a_bushing_that_has_come_loose_is_named(monkeypatch):
    """Zero is a state of a stiffness, not the end of what is sought."""
    cause = SIZED_CAUSES["tilt_stiffness"]
    monkeypatch.setattr(causes, "SIZED_CAUSES", {"tilt_stiffness": cause})
    monkeypatch.setattr(causes, "GROUPS", {"tilt_stiffness": causes.GROUPS["tilt_stiffness"]})
    rng = np.random.default_rng(5)
    (data, effects), _ = drawn_pair(NOTHING, rng)
    data = replace(
        data, mounting=replace(data.mounting, x=0.45, axial_stiffness=14e6, tilt_stiffness=7e5)
    )
    loose = replace(data, mounting=replace(data.mounting, tilt_stiffness=0.0))
    body = default_stage_body(PAPER_STIFFNESS, 0.06)
    case, other = (
        PredictedStage(body, one, effects, ReadingEffects(), 2.3, rest_angle=0.0)
        for one in (data, loose)
    )
    predicted, true = readings_at_rest(case), readings_at_rest(other)
    assert size_of(true - predicted) > 2.0 * FLOOR
    answer = answered(recorded_campaign("loose", predicted, true, rng), case, "mounting", 2.0)
    assert answer.named == ("stage/tilt_stiffness",)
    assert not answer.ties
