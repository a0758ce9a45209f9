"""A proposal of a plan, measured on the same machine."""

import pytest

from studies.tabulate_plans import addition_outcome


@pytest.mark.long
def test_the_first_proposal_separates_a_cause_from_what_is_alike():
    outcome = addition_outcome(71101, 1, (12.0, 20.0))
    assert not outcome.before.is_alone
    assert outcome.is_sufficient
    assert outcome.is_separated
