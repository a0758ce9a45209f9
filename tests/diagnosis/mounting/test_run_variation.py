"""Bushings that are softer in some runs, as by temperature."""

from dataclasses import replace

from carrierflex.workflows.diagnosis.examination import examined
from tests.diagnosis.mounting.mounting_campaigns import TRUE_LINEAR, mounting_campaign


def findings(softer):
    """Ids of the findings where the second and the fourth run have other bushings."""
    cold = mounting_campaign({}, seconds=60.0)
    warm = mounting_campaign({"K1": softer * TRUE_LINEAR["K1"]}, seconds=60.0)
    runs = (cold.runs[0], warm.runs[1], cold.runs[2], warm.runs[3])
    return [one.id for one in examined(replace(cold, runs=runs)).baseline().warnings]


def test_bushings_softer_in_two_of_four_runs_are_runs_that_differ():
    assert "run_variation" in findings(0.92)
    assert "run_variation" not in findings(1.0)
