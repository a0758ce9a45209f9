"""Part of a campaign: as if nothing else had been measured or looked for."""

import pytest

from carrierflex.files.problems import problems_of
from carrierflex.identification.campaign.campaign_part import campaign_part
from tests.identification.synthetic_campaigns import carrier_campaign


@pytest.fixture(scope="module")
def campaign():
    return carrier_campaign()


def test_nothing_chosen_is_the_campaign(campaign):
    same = campaign_part(campaign)
    assert [run.name for run in same.runs] == [run.name for run in campaign.runs]
    assert same.channels == campaign.channels
    assert vars(same.baseline) == vars(campaign.baseline)


def test_runs_and_channels_that_are_not_chosen_are_gone(campaign):
    selected = campaign_part(campaign, runs=["LC2"], channels=["s317", "s047"])
    assert [run.name for run in selected.runs] == ["LC2"]
    assert [channel.name for channel in selected.channels] == ["s047", "s317"]
    assert set(selected.runs[0].signals) == {"s047", "s317"}


def test_only_the_effects_that_are_named_are_looked_for(campaign):
    selected = campaign_part(campaign, baseline=["carrier_tilt"], effects=["housing_tilt"])
    assert selected.baseline.effects == ("carrier_tilt",)
    known = set(selected.contract.effects)
    assert set(selected.baseline.impossible) == known - {"carrier_tilt", "housing_tilt"}


def test_unknown_names_are_refused_together(campaign):
    with pytest.raises(ValueError, match="--runs names 'LC9'") as refused:
        campaign_part(campaign, runs=["LC9"], channels=["x"], effects=["magic"], baseline=["luck"])
    assert len(problems_of(refused.value)) == 4
