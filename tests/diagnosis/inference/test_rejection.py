"""Each rule that keeps a set of effects from being supported.

On scores that are written by hand.
"""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from carrierflex.diagnosis.comparison.problem import Parameter, Segment
from carrierflex.diagnosis.inference.forward_selection import ForwardSelection
from carrierflex.diagnosis.inference.held_out import HeldOut
from carrierflex.diagnosis.inference.results import REJECTION_RULES
from carrierflex.diagnosis.inference.thresholds import Thresholds

N_SEGMENTS, FLOOR = 40, 1.0


@dataclass
class Problem:
    """As much of a problem as the rules ask for: two springs and a damper on one channel."""

    n_channels: int = 1
    segments: tuple = tuple(Segment("R", f"C{k % 4}", k // 4, 100) for k in range(N_SEGMENTS))

    def __post_init__(self):
        self.noise_square = np.full((N_SEGMENTS, 1), FLOOR / N_SEGMENTS)
        self.cell_counts = np.full((N_SEGMENTS, 1), 100.0)
        names = ("spring", "stop", "slider")
        self.cards = {
            name: SimpleNamespace(aliases=tuple(other for other in names if other != name))
            for name in names
        }


def scored(effects, total, *, at_bound=False, square=None):
    """Held-out score of a set that leaves `total`, spread evenly over the segments."""
    parameters = tuple(Parameter("a", "N", -1.0, 1.0, 1.0, effect=effect) for effect in effects)
    fit = SimpleNamespace(parameters=parameters, at_bound=np.full(len(effects), at_bound))
    square = np.full(N_SEGMENTS, total / N_SEGMENTS) if square is None else square
    return HeldOut(fit, square, np.zeros(N_SEGMENTS), np.zeros((1, 1)))


def search(*scores, problem=None):
    selection = ForwardSelection(problem or Problem(), (), Thresholds(), lambda text: None)
    selection.scores |= {
        tuple(parameter.effect for parameter in score.fit.parameters): score for score in scores
    }
    return selection


BASELINE = scored((), 101.0)


def test_a_set_that_explains_and_repeats_is_supported():
    selection = search(BASELINE, scored(("spring",), 2.0))
    assert selection.rejection(("spring",)) is None
    assert selection.supported_sets() == [("spring",)]


def rule_of(selection, effects):
    rejection = selection.rejection(effects)
    assert rejection.rule in REJECTION_RULES
    assert effects not in selection.supported_sets()
    return rejection.rule, rejection.effect


def test_a_parameter_at_its_bound_rejects_its_set():
    selection = search(BASELINE, scored(("spring",), 2.0, at_bound=True))
    assert rule_of(selection, ("spring",)) == ("bound", "spring")


@pytest.mark.parametrize(("total", "supported"), [(50.9, True), (51.1, False)])
def test_an_effect_explains_half_of_what_is_left_without_it(total, supported):
    # Floor 1, baseline 101: half of the gap is left at 51.
    selection = search(BASELINE, scored(("spring",), total))
    assert (selection.rejection(("spring",)) is None) is supported
    if not supported:
        assert rule_of(selection, ("spring",)) == ("explained", "spring")
        assert selection.rejection(("spring",)).text.startswith("spring explains 50%")


def test_beside_others_an_effect_explains_a_material_part_of_the_whole_gap():
    # Of the 0.9 above the floor that the spring leaves, the stop explains nearly all: less than a
    # hundredth of the whole gap of 100, and the floor is near.
    selection = search(
        BASELINE,
        scored(("spring",), 1.9),
        scored(("stop",), 101.0),
        scored(("spring", "stop"), 1.05),
    )
    assert rule_of(selection, ("spring", "stop")) == ("material", "stop")
    small_gap = replace(BASELINE, square=np.full(N_SEGMENTS, 11.0 / N_SEGMENTS))
    selection.scores[()] = small_gap
    selection.scores["stop",] = scored(("stop",), 11.0)
    assert selection.rejection(("spring", "stop")) is None


def test_the_gap_must_not_grow_in_too_many_bootstrap_samples():
    # Two of four conditions improve by far, one is three times as large.
    condition = np.arange(N_SEGMENTS) % 4
    factor = np.array([0.01, 0.01, 1.0, 3.0])[condition]
    before = scored((), 0.0, square=np.array([10.0, 10.0, 0.1, 1.0])[condition])
    after = scored(("spring",), 0.0, square=before.square * factor)
    selection = search(before, after)
    assert rule_of(selection, ("spring",)) == ("draws", "spring")
    unchanged = replace(after, square=before.square * np.array([0.01, 0.01, 1.0, 1.0])[condition])
    assert search(before, unchanged).rejection(("spring",)) is None


def test_three_aliases_on_one_channel_fit_any_curve():
    effects = ("slider", "spring", "stop")
    problem = Problem()
    selection = search(BASELINE, scored(effects, 2.0), problem=problem)
    assert rule_of(selection, effects) == ("any_curve", "")
    # Two channels make a pattern.
    pairs = [scored(pair, 60.0) for pair in (effects[:2], effects[1:], (effects[0], effects[2]))]
    selection = search(BASELINE, *pairs, scored(effects, 2.0), problem=Problem(n_channels=2))
    assert selection.rejection(effects) is None


def test_a_search_that_did_not_converge_supports_nothing():
    pair = ("spring", "stop")
    selection = search(
        BASELINE, scored(("spring",), 50.0), scored(("stop",), 50.0), scored(pair, 2.0)
    )
    assert selection.rejection(pair) is None
    selection.failed_searches["stop",] = "the search did not converge"
    assert rule_of(selection, ("stop",)) == ("search", "")
    assert rule_of(selection, pair) == ("search", "spring")
    assert "nothing is known without spring" in selection.rejection(pair).text
