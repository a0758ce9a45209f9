"""A class whose members bend stands aside for another class beside its plain law."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.diagnosis.classes.answer import class_decision
from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.decision import _plain_first
from carrierflex.diagnosis.classes.gram_table import ColumnGroup, GramTable
from carrierflex.diagnosis.classes.held_out import ClassScores, HeldOutSquares
from carrierflex.diagnosis.classes.shares import Shares
from tests.diagnosis.classes.toy_table import N_BLOCKS, toy_columns, toy_table

LIMITS = ClassConstants()
COLUMNS = toy_columns()
PLAIN = COLUMNS["a"].sum(axis=0)
B = COLUMNS["b"].sum(axis=0)


def held(floors):
    return HeldOutSquares(np.full(N_BLOCKS, floors / N_BLOCKS), (), ())


def asked(answer, bent, straight):
    """Answer of `plain_first`, what sets leave with bent members and without given in floors.

    The gap is of 100 floors; class a bends.
    """
    table = GramTable(
        gram=np.zeros((N_BLOCKS, 1, 1)),
        n_base=0,
        groups={},
        classes={"a": (), "b": (), "c": ()},
        surface="",
        ceiling=(),
        laws={},
        floor=np.full(N_BLOCKS, 1.0 / N_BLOCKS),
        folds=np.arange(N_BLOCKS) % 4,
        scale=np.ones(1),
        plain={"a": ()},
    )
    scores = ClassScores(table, LIMITS, {names: held(floors) for names, floors in bent.items()})
    scores.plain.known.update({names: held(floors) for names, floors in straight.items()})
    shares = Shares(held(101.0).squares, table.floor, LIMITS)
    return _plain_first(scores, shares, answer, ("a", "b", "c"))


BENT = {("a",): 4.0}
STRAIGHT = {("a",): 30.0, ("a", "b"): 2.0, ("a", "c"): 25.0}


@pytest.mark.parametrize(
    ("bent", "straight", "answer"),
    [
        ({}, {}, ("a", "b")),
        # The bent class leaves less, or as much.
        ({("a",): 1.5}, {}, ("a",)),
        ({("a",): 2.05}, {}, ("a",)),
        # The better one of the others counts, whichever it is.
        ({}, {("a", "b"): 25.0, ("a", "c"): 2.0}, ("a", "c")),
        # Beside the plain law the other is no second cause: the plain law alone leaves hardly more.
        ({}, {("a",): 3.0}, ("a",)),
    ],
)
def test_another_class_beside_the_plain_law_goes_before_bending_where_it_leaves_less(
    bent, straight, answer
):
    assert asked(("a",), BENT | bent, STRAIGHT | straight) == answer


@pytest.mark.parametrize(
    ("bent", "straight", "answer"),
    [
        # Bending is needed, and the other class gains 0.03 of the gap: what a bent class leaves.
        ({}, {}, ("a",)),
        # It gains 0.06, or leaves as little beside the plain law: the pair stands.
        ({("a",): 7.0}, {}, ("a", "b")),
        ({}, {("a", "b"): 3.0}, ("a", "b")),
        ({}, {("a", "b"): 4.1}, ("a", "b")),
    ],
)
def test_a_class_beside_one_that_bends_anyway_gains_more_than_that_one_leaves_of_its_own(
    bent, straight, answer
):
    sets = {("a",): 4.0, ("a", "b"): 1.0} | bent
    assert asked(("a", "b"), sets, {("a", "b"): 20.0} | straight) == answer


def test_an_answer_without_a_class_that_bends_stays():
    for answer in (("b",), ("b", "c"), ("a", "b", "c")):
        assert asked(answer, {}, {}) == answer


def bending_table(signal):
    """Toy table whose class a holds columns of its plain law and two that imitate b by 0.97."""
    rng = np.random.default_rng(4)
    imitating = B + 0.18 * B.std() * rng.standard_normal((2, B.size))
    columns = COLUMNS | {"a": np.concatenate([COLUMNS["a"], imitating])}
    table = toy_table(signal(imitating), columns, noise=0.1)
    places = table.groups["a"].columns[:3]
    groups = {**table.groups, "plain_a": ColumnGroup(places, np.eye(3))}
    table = replace(table, groups=groups, surface="")
    return table, replace(table, plain={"a": ("plain_a",)})


def best(table, **options):
    """Best classes, whether they are named or not."""
    return class_decision(ClassScores(table, LIMITS), ("a", "b", "c"), **options)[1].classes


def test_two_plain_causes_are_no_single_bent_one_and_a_bent_one_stays_one():
    unasked, own = bending_table(lambda imitating: PLAIN + B)
    few = {"shows_small_causes": False}
    assert (best(unasked, **few), best(own, **few)) == (("a",), ("a", "b"))
    assert best(own, shows_two_causes=False, **few) == ("a",)
    unasked, own = bending_table(lambda imitating: PLAIN + imitating.sum(axis=0))
    assert best(unasked) == best(own) == ("a",)


def test_scores_of_plain_laws_are_of_fewer_columns_and_share_what_they_do_not_change():
    _, own = bending_table(lambda imitating: PLAIN + B)
    scores = ClassScores(own, LIMITS)
    alone = scores.of(("b",))
    assert scores.of(("a",)).total < scores.plain.of(("a",)).total
    assert scores.plain.of(("b",)) is alone
    assert scores.plain.of(("a",)).groups == ("plain_a",)
