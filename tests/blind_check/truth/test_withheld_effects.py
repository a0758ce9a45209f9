"""What the independent truth withholds, beside the contract's own lists."""

from carrierflex.blind_check.truth.alias_table import SINGLES
from carrierflex.identification.campaign.campaign_kinds import CARRIER, ELEMENT_BY_DRIVE, MOUNTING

KINDS = {"carrier": CARRIER, "mounting": MOUNTING, "element": ELEMENT_BY_DRIVE["force"]}


def test_the_mountings_truth_withholds_every_effect_of_the_contract_and_no_other():
    assert set(SINGLES["mounting"]) == set(MOUNTING.effects)


def test_what_is_withheld_is_withheld_once_and_in_the_contract():
    for kind, effects in SINGLES.items():
        assert len(set(effects)) == len(effects)
        assert set(effects) <= set(KINDS[kind].effects)
