"""A proposal of a plan, measured on the same machine."""

import pytest

from studies.tabulate_plans import addition_outcome


@pytest.mark.long
def test_the_first_proposal_separates_a_cause_from_what_is_alike():
    # A gap below the floor, in which a cube and a fifth power predict alike.
    outcome = addition_outcome(71101, 2, (0.6, 1.5), kind="mounting")
    assert not outcome.before.is_alone
    assert outcome.is_sufficient
    assert outcome.is_separated
