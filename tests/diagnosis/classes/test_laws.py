"""Which law is nearest to a class, and when it is the class."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.diagnosis.classes.answer import _explains, nearest_law
from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.gram_table import LawColumns
from carrierflex.diagnosis.classes.held_out import ClassScores, HeldOutSquares
from carrierflex.diagnosis.classes.shares import Shares
from tests.diagnosis.classes.toy_table import (
    N_BLOCKS,
    answer_of_scores,
    toy_columns,
    toy_table,
)

LIMITS = ClassConstants()
COLUMNS = toy_columns()
A = COLUMNS["a"].sum(axis=0)
B = COLUMNS["b"].sum(axis=0)
MORE = COLUMNS["more"].sum(axis=0)


def scored(table):
    scores = ClassScores(table, LIMITS)
    return scores, Shares(scores.of(()).squares, table.floor, LIMITS)


def test_of_laws_that_explain_as_much_the_one_of_fewer_parameters_is_nearest():
    table = toy_table(A, COLUMNS, laws={"a": A})
    (law,) = table.laws["a"]
    many, few = (LawColumns(name, law.variants, n) for name, n in (("many", 3), ("few", 1)))
    for laws in ((many, few), (few, many)):
        scores, shares = scored(replace(table, laws={**table.laws, "a": laws}))
        result = nearest_law(scores, shares, "a", ())
        assert (result.id, result.is_equal) == ("few", True)


def test_a_law_that_is_nearest_and_leaves_what_its_class_holds_is_not_the_class():
    # A sixtieth of the gap's square: enough for a law, and its class leaves noise alone.
    table = toy_table(A + 0.3 * COLUMNS["a"][0], COLUMNS, laws={"a": A}, noise=0.01)
    scores, shares = scored(table)
    result = nearest_law(scores, shares, "a", ())
    assert result.squares is not None
    assert _explains(shares, result.squares)
    assert (result.id, result.is_equal) == ("law_a", False)


def test_a_law_is_named_where_its_class_is_certain_or_every_tied_one_holds_it_too():
    # The columns of a once more, as if of another class.
    columns = COLUMNS | {"b": COLUMNS["a"] + 1e-6 * COLUMNS["b"]}
    table = toy_table(A, columns, laws={"a": A, "b": A})
    other, law_of_a = table.laws["b"][0], table.laws["a"][0]
    both = {"a": (law_of_a,), "b": (replace(other, id=law_of_a.id),)}
    for laws, is_named in ((table.laws, False), (table.laws | both, True)):
        result = answer_of_scores(scored(replace(table, laws=laws))[0], ("a", "b", "c"))
        assert result.ties in ((("a",),), (("b",),))
        assert [law.law_named for law in result.classes] == [is_named]
    alone = answer_of_scores(scored(table)[0], ("a", "c"))
    assert (alone.ties, alone.classes[0].law_named) == ((), True)


def test_a_law_explains_down_to_the_floor_or_nearly_all_of_the_gap():
    def explains(before, remaining):
        shares = Shares(np.full(N_BLOCKS, before), np.ones(N_BLOCKS), LIMITS)
        return _explains(shares, HeldOutSquares(np.full(N_BLOCKS, remaining), (), ()))

    # A gap of one floor above it: a tenth of that is left, within what the floor is known to.
    assert explains(2.0, 1.1)
    assert not explains(2.0, 1.3)
    # A gap of a hundred floors: two are left.
    assert explains(101.0, 3.0)
    assert not explains(101.0, 6.0)


def test_no_law_is_named_beside_a_surface():
    table = toy_table(A + B, COLUMNS, laws={"a": A})
    scores, shares = scored(table)
    assert nearest_law(scores, shares, "a", ("b",)).is_equal
    with_surface = replace(table, surface="b")
    assert not nearest_law(*scored(with_surface), "a", ("b",)).is_equal


@pytest.mark.parametrize(
    ("coupled", "noise", "is_named"),
    [
        # A fiftieth of the gap is coupled, which is most of what the class leaves.
        (0.1 * MORE, 0.01, False),
        # A part as small as any law leaves.
        (0.03 * MORE, 0.01, True),
        # A fiftieth again, of which noise hides most.
        (0.1 * MORE, 1.0, True),
    ],
)
def test_a_law_of_a_class_that_stands_for_a_part_of_a_coupled_cause_is_not_named(
    coupled, noise, is_named
):
    table = toy_table(A + coupled, COLUMNS, laws={"a": A}, noise=noise)
    assert nearest_law(*scored(table), "a", ()).is_equal is is_named
    # Without a coupled class the records cannot say so.
    alone = replace(table, surface="")
    assert nearest_law(*scored(alone), "a", ()).is_equal


def test_a_coupled_cause_beside_another_class_takes_the_name_of_its_parts_alone():
    columns = {**COLUMNS, "d": np.random.default_rng(5).standard_normal((2, A.size))}
    other = columns["d"].sum(axis=0)
    signal = A + 0.12 * MORE + other
    table = toy_table(signal, columns, laws={"a": A, "d": other}, noise=0.01)
    table = replace(table, classes=table.classes | {"surface": ("a", "b", "c", "more")})
    assert not nearest_law(*scored(table), "a", ("d",)).is_equal
    assert nearest_law(*scored(table), "d", ("a",)).is_equal


def test_parts_of_a_coupled_cause_have_no_laws_where_both_are_named():
    table = toy_table(A + B, COLUMNS, laws={"a": A, "c": COLUMNS["c"][0]})
    both = replace(table, coupled_parts=frozenset({"a", "b"}))
    assert nearest_law(*scored(table), "a", ("b",)).is_equal
    assert not nearest_law(*scored(both), "a", ("b",)).is_equal
    # Beside a class that is no part of it a law keeps its name.
    beside_another = replace(table, coupled_parts=frozenset({"a", "c"}))
    assert nearest_law(*scored(beside_another), "a", ("b",)).is_equal


def test_a_law_of_one_part_is_none_of_the_surface_and_one_of_two_parts_is():
    signal = A + MORE
    table = toy_table(signal, COLUMNS, laws={"a": signal})
    law = table.laws["a"]
    for holders, is_equal in ((("a",), False), (("a", "b"), True), ((), True)):
        laws = {name: law if name in (*holders, "surface") else () for name in table.laws}
        scores, shares = scored(replace(table, laws=laws))
        assert nearest_law(scores, shares, "surface", ()).is_equal == is_equal
    # Without a surface no class is one of its parts.
    plain = replace(table, surface="")
    scores, shares = scored(plain)
    assert nearest_law(scores, shares, "a", ()).id == "law_a"
