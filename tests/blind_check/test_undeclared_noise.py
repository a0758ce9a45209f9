"""Campaigns of a check that do not declare the noise of their channels."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.blind_check.case_plans import (
    DECLARED,
    HALF,
    UNDECLARED,
    case_plans,
    with_noise_declared,
)
from carrierflex.blind_check.labels import FORM, CasePlan, Label
from carrierflex.blind_check.scoring.scoring import UNDECLARED_NOISE
from carrierflex.blind_check.truth.campaigns import case_campaign
from tests.blind_check import test_class_scoring, test_scoring


@pytest.mark.parametrize(("noise", "declaring"), [(DECLARED, 6), (HALF, 3), (UNDECLARED, 0)])
def test_noise_is_declared_by_all_half_or_none(noise, declaring):
    plans = case_plans("carrier", 6, 3)
    asked = with_noise_declared(plans, noise)
    assert sum(plan.declares_noise for plan in asked) == declaring
    assert [replace(plan, declares_noise=True) for plan in asked] == list(plans)


def test_elements_declare_their_noise():
    with pytest.raises(ValueError, match="--noise is 'half' with kind element; expected kind"):
        with_noise_declared(case_plans("element", 2, 3), HALF)


def test_a_campaign_that_does_not_declare_its_noise_is_the_same_otherwise():
    plan = CasePlan("carrier", 1, 5, FORM, ("bounded_lobes",), 10.0)
    said, label = case_campaign(plan)
    silent, other = case_campaign(replace(plan, declares_noise=False))
    assert {channel.noise_std for channel in said.channels} == {label.floor}
    assert {channel.noise_std for channel in silent.channels} == {None}
    for run, same in zip(said.runs, silent.runs, strict=True):
        for name, signal in run.signals.items():
            np.testing.assert_array_equal(signal, same.signals[name])
    assert other == replace(label, declares_noise=False)
    assert Label.from_text(other.text()).declares_noise is False


@pytest.mark.parametrize("by_hand", [test_scoring, test_class_scoring])
def test_figures_of_undeclared_noise_stand_apart(by_hand):
    table = by_hand.table()
    every = by_hand.scored(table).figures
    silent = [(replace(label, declares_noise=False), verdict) for label, verdict in table]
    apart = by_hand.scored(silent).figures
    assert [figure.name for figure in apart] == [
        f"{UNDECLARED_NOISE}{figure.name}" for figure in every
    ]
    assert [figure.cases for figure in apart] == [figure.cases for figure in every]
    mixed = by_hand.scored([*table[:1], *silent[1:]]).figures
    total = {figure.name: figure.cases for figure in mixed}
    for figure in every:
        n_cases = total.get(figure.name, 0) + total.get(f"{UNDECLARED_NOISE}{figure.name}", 0)
        assert n_cases == figure.cases
