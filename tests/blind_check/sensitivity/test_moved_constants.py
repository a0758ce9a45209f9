"""Every constant of the decision is found with its reason, moved where it is read, and put back."""

import pytest

from carrierflex.blind_check.sensitivity import moved_constants
from carrierflex.blind_check.sensitivity.listed_constants import listed_constants
from carrierflex.blind_check.sensitivity.moved_constants import moved
from carrierflex.diagnosis.element.classes import answer, motion, table
from tests.diagnosis.element.element_campaigns import displacement_campaign

CONSTANTS = {f"{own.module.rpartition('.')[2]}.{own.name}": own for own in listed_constants()}


def test_every_constant_has_a_reason():
    assert [name for name, own in CONSTANTS.items() if not own.reason] == []


def test_a_private_constant_is_moved_in_its_own_module_alone():
    assert motion._WIDEST == 0.95
    with moved(CONSTANTS["motion._WIDEST"], 1.2):
        assert pytest.approx(1.0 - 1.2 * 0.05) == motion._WIDEST
    assert motion._WIDEST == 0.95


def test_a_public_constant_is_moved_where_it_is_read_too():
    before = table.IN_TIME
    with moved(CONSTANTS["motion.IN_TIME"], 0.8):
        assert table.IN_TIME == motion.IN_TIME == before - 1
    assert table.IN_TIME == motion.IN_TIME == before


def test_a_limit_of_the_comparison_is_moved():
    with moved(CONSTANTS["constants.named_share"], 0.8):
        assert answer.ClassConstants().named_share == pytest.approx(0.64)
    assert answer.ClassConstants().named_share == 0.8


@pytest.mark.long
def test_an_answer_changes_with_the_share_that_names_a_class():
    campaign = displacement_campaign(lambda q, v: 5e9 * q**3)
    usual = moved_constants._answer(campaign)
    assert usual.startswith("named: restoring_force")
    with moved(CONSTANTS["constants.named_share"], 2.0):
        assert moved_constants._answer(campaign) != usual
