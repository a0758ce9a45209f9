"""Two causes of an element show alike in the records, and what is outside is no linear memory."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.blind_check.labels import PAIR, CasePlan
from carrierflex.blind_check.truth.element.balance import shown_by_each
from carrierflex.blind_check.truth.element.drives import SWEEPS
from carrierflex.blind_check.truth.element.truth import _drawn_case
from carrierflex.blind_check.truth.noise import case_rng

#: Driven by a force: a spring beside a memory, a late sensor, a fault of the drive; driven.
PAIRS = {
    ("power_spring", "rubber"): 838,
    ("late_sensor", "cubic_damper"): 12,
    ("quintic_spring", "unequal_gain"): 222,
    ("gap_in_spring", "coulomb"): 31,
}


def drawn(names, number, family=PAIR, drive=SWEEPS):
    """Case without noise, and its channel."""
    plan = CasePlan("element", number, 8461, family, names, 5.0, drive)
    return _drawn_case(plan, case_rng(plan))


@pytest.mark.parametrize("names", PAIRS)
def test_what_each_cause_shows_adds_up_to_the_records(names):
    case, _ = drawn(names, PAIRS[names])
    # Without the curvature of its baseline, which is no cause.
    bare = replace(case.element, laws=case.element.laws[: sum(n != "late_sensor" for n in names)])
    if "unequal_gain" in names:
        bare = replace(bare, laws=bare.laws[:1])
    case = replace(case, element=bare)
    plain = case.signals(case.plain)
    of_each = shown_by_each(case, names)
    added = [sum(run) - 2.0 * own for own, *run in zip(plain, *of_each, strict=True)]
    wanted = [channel - own for channel, own in zip(case.signals(bare), plain, strict=True)]
    np.testing.assert_allclose(added, wanted, atol=2e-3 * np.abs(wanted).max())
