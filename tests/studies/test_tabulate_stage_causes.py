"""Campaigns that a stage predicts: how an answer counts, and what the drawn pairs differ in."""

from dataclasses import asdict

import numpy as np
import pytest

from studies.tabulate_stage_causes import (
    CLASSES,
    FALSE,
    NONE,
    NOTHING,
    RIGHT,
    TIED,
    WITH_OTHERS,
    StageAnswer,
    answers_table,
    drawn_pair,
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
