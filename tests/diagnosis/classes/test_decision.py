"""Every branch of the rule that names a class, on linear toy problems."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import nnls

from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.decision import Drive, decide, is_short
from carrierflex.diagnosis.classes.gram_table import ColumnGroup
from carrierflex.diagnosis.classes.held_out import (
    ClassModel,
    ClassScores,
    _free_coefficients,
    coefficients,
    products_of,
    squares_left,
)
from carrierflex.diagnosis.classes.results import LEADING_CLASS, NAMED_CLASS, NO_CLASS, NOTHING
from tests.diagnosis.classes.toy_table import (
    N_BLOCKS,
    N_SAMPLES,
    answer_of_scores,
    toy_columns,
    toy_table,
)

LIMITS = ClassConstants()
COLUMNS = toy_columns()
A = COLUMNS["a"].sum(axis=0)
B = COLUMNS["b"].sum(axis=0)
MORE = COLUMNS["more"].sum(axis=0)


def answered(signal, columns=COLUMNS, *, options=None, **changed):
    table = toy_table(signal, columns, **changed)
    return answer_of(table, tuple(table.classes), **(options or {}))


def answer_of(table, candidates, **options):
    return answer_of_scores(ClassScores(table, LIMITS), candidates, **options)


def decided(signal, options):
    table = toy_table(signal, COLUMNS, noise=0.01)
    return decide(ClassScores(table, LIMITS), Drive(tuple(table.classes), **options))[1]


def test_noise_alone_is_nothing():
    result = answered(np.zeros(A.size))
    assert result.state == NOTHING
    assert result.ids == ()


def test_coloured_noise_up_to_three_floors_is_nothing_and_a_cause_of_that_size_is_not():
    unknown = 0.12 * np.random.default_rng(5).standard_normal(A.size)
    assert answered(unknown).state == NOTHING
    assert answered(0.07 * A).ids == ("a",)


def test_a_single_cause_is_named_with_its_share():
    result = answered(A)
    assert (result.state, result.ids, result.ties) == (NAMED_CLASS, ("a",), ())
    assert 0.99 < result.share <= 1.0
    assert result.share_ci95[0] < result.share <= result.share_ci95[1] <= 1.0
    assert result.rivals["b"] < 0.1
    assert result.beyond_share < 0.01


def test_a_cause_that_two_classes_hold_is_a_tie():
    tied = COLUMNS | {
        "b": np.vstack([COLUMNS["a"][:2], COLUMNS["a"][2:] + 1e-4 * COLUMNS["b"][2:]])
    }
    result = answered(A, tied)
    assert result.ids in (("a",), ("b",))
    assert result.ties == ((("b",),) if result.ids == ("a",) else (("a",),))


def test_two_causes_are_a_pair_whose_parts_follow_their_energies():
    result = answered(A + 0.5 * B)
    assert result.ids == ("a", "b")
    # Energies 1 and 0.25.
    assert_allclose([entry.share for entry in result.classes], [0.8, 0.2], atol=0.05)


def test_parts_of_a_pair_add_up_though_one_hides_the_other():
    # Alone each is worse than half: together they explain what either hides from the other.
    opposed = COLUMNS | {"b": COLUMNS["b"] - 0.9 * COLUMNS["a"]}
    result = answered(A + (opposed["b"]).sum(axis=0), opposed)
    assert result.ids == ("a", "b")
    shares = [entry.share for entry in result.classes]
    assert sum(shares) == pytest.approx(result.share, abs=1e-12)
    assert min(shares) > 0.0


def test_a_declared_floor_above_the_noise_makes_no_share_above_one():
    table = toy_table(A + 0.5 * B, COLUMNS, noise=0.1)
    table = replace(table, floor=4.0 * table.floor)
    result = answer_of(table, tuple(table.classes))
    assert result.share == 1.0
    assert sum(entry.share for entry in result.classes) == pytest.approx(1.0, abs=1e-12)
    assert max(*result.rivals.values(), result.learnable, *result.share_ci95) <= 1.0


def test_a_small_second_cause_is_seen_where_it_takes_nearly_all_that_is_left():
    # 0.4 % of the gap, of which the first class leaves thirty times the noise.
    signal = A + 0.06 * B
    assert answered(signal, noise=0.01).ids == ("a", "b")
    # One frequency cannot tell it from what the first class has in second order.
    few = {"is_one_frequency": True}
    result = answered(signal, noise=0.01, options=few)
    assert (result.state, result.ids) == (NO_CLASS, ())
    # The one that would have been named is listed among the others.
    assert result.rivals["a"] > 0.99
    assert result.note.startswith("one frequency drives all runs: in these records a second cause")
    assert decided(signal, few).is_inseparable
    assert not decided(signal, {}).is_inseparable
    both = answered(signal, noise=0.01, options=few | {"note": "short"}).note
    assert both == f"short; {result.note}"
    # What is left of one class alone is noise: nothing hides in it.
    result = answered(A, noise=0.01, options=few)
    assert (result.ids, result.note) == (("a",), "")
    # Beside something that no class holds it takes half of what is left.
    rest = 0.06 * np.random.default_rng(4).standard_normal(A.size) * B.std()
    assert answered(signal + rest, noise=0.01).ids == ("a",)


def test_a_small_second_cause_holds_in_block_after_block():
    # All of it in three blocks of 24: their square is that of a cause in all of them.
    rows = np.arange(A.size) // N_SAMPLES
    once = np.where(rows < 3, np.sqrt(8.0), 0.0)
    assert answered(A + 0.06 * B * once, noise=0.01).ids == ("a",)


#: Parts of one damping, of which one is of the speed alone, and a product of it.
COUPLED_DAMPING = {
    "coupled_parts": frozenset({"a", "b"}),
    "uncoupled_part": "a",
    "products": {"p": ("a", "more")},
}


@pytest.mark.parametrize(
    ("other_size", "product", "total"),
    [(0.0, ("surface",), ("a", "b")), (1.0, ("d", "surface"), ("a", "d"))],
)
def test_a_damping_of_the_speed_gives_way_to_one_of_both_that_takes_half_of_what_it_leaves(
    other_size, product, total
):
    other = np.random.default_rng(5).standard_normal((2, A.size))
    columns = COLUMNS | {"d": other}

    def ids_of(signal, coupling=COUPLED_DAMPING, **options):
        table = toy_table(signal + other_size * other.sum(axis=0), columns, noise=0.01)
        classes = table.classes | {"surface": tuple(COLUMNS)}
        return answer_of(replace(table, classes=classes, **coupling), tuple("abcd"), **options).ids

    alone = ("a",) if other_size == 0.0 else ("a", "d")
    assert ids_of(A + 0.1 * MORE, {}) == alone
    assert ids_of(A + 0.1 * MORE) == product
    assert ids_of(A + 0.1 * MORE, is_one_frequency=True) == ()
    # The other part, which both arguments make, stays what it is.
    assert ids_of(A + 0.1 * MORE, COUPLED_DAMPING | {"uncoupled_part": "b"}) == alone
    # A sum of both parts, which beside another class would be a third cause.
    assert ids_of(A + 0.06 * B) == total


@pytest.mark.parametrize(("size", "answer"), [(0.05, ("a",)), (0.1, ("surface",))])
def test_a_damping_of_the_speed_gives_way_to_a_product_that_its_law_gives_way_to(size, answer):
    # Of what the damping leaves the product takes less than half: the rest is of no class.
    unknown = 0.15 * A.std() * np.random.default_rng(9).standard_normal(A.size)
    table = toy_table(A + size * MORE + unknown, COLUMNS, noise=0.01)
    classes = table.classes | {"surface": tuple(COLUMNS)}
    table = replace(table, classes=classes, **COUPLED_DAMPING)
    assert answer_of(table, tuple("abc")).ids == answer
    # A sum of two dampings that leaves less is no product.
    summed = replace(table, products={"p": ("a", "c")})
    assert answer_of(summed, tuple("abc")).ids == ("a",)


def test_what_is_learnt_below_the_floor_is_no_second_cause():
    # The first class leaves half of the floor; the second would take half of that.
    table = toy_table(0.3 * A + 0.06 * B, COLUMNS, noise=0.1)
    quiet = answer_of(table, tuple(table.classes))
    noisy = answer_of(replace(table, floor=4.0 * table.floor), tuple(table.classes))
    assert (quiet.ids, noisy.ids) == (("a", "b"), ("a",))


def test_a_coupled_cause_is_the_surface():
    result = answered(A + MORE)
    assert result.ids == ("surface",)


def test_under_one_frequency_a_surface_holds_every_steady_cause():
    result = decided(A + MORE, {"is_one_frequency": True})
    assert (result.classes, result.state, result.is_inseparable) == (("surface",), NO_CLASS, True)
    assert "every cause that repeats" in result.note
    assert decided(A, {"is_one_frequency": True}).note == ""


def test_an_answer_falls_short_where_all_classes_explain_more_by_what_a_cause_would():
    def falls_short(third, **changed):
        table = toy_table(A + 0.5 * B + third * columns["c"].sum(axis=0), columns, noise=0.01)
        scores = ClassScores(replace(table, surface="", **changed), LIMITS)
        shares, decision = decide(scores, Drive(("a", "b", "c")))
        assert decision.classes == ("a", "b")
        return is_short(scores, shares, decision)

    # A third cause beside two: 1.25 of the gap's square are theirs.
    columns = {name: COLUMNS[name] for name in "abc"}
    assert falls_short(0.2)
    assert not falls_short(0.15)
    # Only what the classes learn is a cause: the same gap without the third.
    assert not falls_short(0.2, ceiling=("a", "b"))


def test_words_follow_the_share():
    other = np.random.default_rng(9).standard_normal(A.size)
    other *= A.std() / other.std()
    assert answered(A + 0.7 * other).state == LEADING_CLASS
    result = answered(A + 2.0 * other)
    assert result.state == NO_CLASS
    assert result.classes == ()
    # No class explains it: other records would not show one.
    assert not decided(A + 2.0 * other, {"is_one_line": True}).is_inseparable


def test_a_law_is_named_where_the_blocks_cannot_tell_it_from_its_class():
    named = answered(A, laws={"a": A}).classes[0]
    assert (named.law, named.law_named) == ("law_a", True)
    near = A + 0.3 * A.std() * COLUMNS["a"][0]
    nearest = answered(near, laws={"a": A}).classes[0]
    assert (nearest.law, nearest.law_named) == ("law_a", False)
    assert 0.8 < nearest.law_share < nearest.share


def test_weights_of_one_sign_do_not_fit_the_other_sign():
    table = toy_table(-A, COLUMNS, noise=1e-3)
    columns_of_a = table.groups["a"].columns
    signed = replace(
        table,
        groups=table.groups | {"a": ColumnGroup(columns_of_a, np.eye(columns_of_a.size), True)},
    )
    limits = replace(LIMITS, jitter=0.0)
    model = ClassScores(signed, limits).model_of(("a",), (0.0,))
    c = coefficients(products_of(signed.total, model), model)
    assert_allclose(c[1:], 0.0, atol=1e-12)
    free = ClassScores(table, limits).model_of(("a",), (0.0,))
    c = coefficients(products_of(table.total, free), free)
    assert (c[1:] < 0.0).all()
    # The products give the same squares as the samples.
    by_block = squares_left(products_of(table.gram, free), c)
    remaining = by_block.sum() / table.scale[0] ** 2
    assert remaining == pytest.approx(1e-6 * N_BLOCKS * N_SAMPLES, rel=0.1)


def test_an_answer_stands_where_a_class_that_the_drive_does_not_separate_explains_no_more():
    table = replace(toy_table(B, COLUMNS), surface="")
    assert answer_of(table, ("b", "c"), inseparable=("a",)).ids == ("b",)


def test_without_a_known_floor_the_best_class_is_not_right_by_definition():
    other = np.random.default_rng(9).standard_normal(A.size)
    table = toy_table(A + 2.0 * other * A.std(), COLUMNS)
    best = ClassScores(table, LIMITS).of(("a",))
    raised = replace(table, floor=best.squares)
    assert answer_of(raised, tuple(table.classes)).share == pytest.approx(1.0)
    result = answer_of(raised, tuple(table.classes), floor_is_known=False)
    assert result.state == NO_CLASS
    assert result.share == pytest.approx(0.2, abs=0.05)


def test_a_cause_beside_a_coupled_one_is_named_with_it():
    table = toy_table(A + MORE, {name: COLUMNS[name] for name in ("a", "b", "more")})
    uncoupled = COLUMNS["c"]
    with_uncoupled = toy_table(A + MORE + uncoupled.sum(axis=0), COLUMNS)
    classes = with_uncoupled.classes | {"surface": ("a", "b", "more")}
    assert answer_of(table, ("a", "b", "surface")).ids == ("surface",)
    result = answer_of(replace(with_uncoupled, classes=classes), ("a", "b", "c", "surface"))
    assert result.ids == ("c", "surface")


def test_a_law_is_not_named_where_its_class_leaves_more_than_noise():
    other = np.random.default_rng(9).standard_normal(A.size)
    other *= A.std() / other.std()
    assert answered(A + 0.1 * other, laws={"a": A}, noise=0.01).classes[0].law_named
    entry = answered(A + 0.35 * other, laws={"a": A}, noise=0.01).classes[0]
    assert (entry.law, entry.law_named) == ("law_a", False)


def test_a_class_that_bends_to_its_partners_cause_is_smoothed_beside_it():
    rng = np.random.default_rng(3)
    # Differences of nearly equal columns hold A: alone the class asks for no smoothing at all.
    first = rng.standard_normal((40, A.size))
    nearly = first + 1e-3 * (A + rng.standard_normal((40, A.size)))
    bent = COLUMNS | {"b": np.concatenate([first, nearly])}
    scores = ClassScores(toy_table(A, bent), LIMITS)
    alone = scores.of(("a",))
    assert scores.of(("b",)).ridges == (LIMITS.ridges[0],)
    assert scores.of(("a", "b")).ridges[1] == LIMITS.ridges[-1]
    rough = ClassScores(toy_table(A, bent), replace(LIMITS, ridges=LIMITS.ridges[:1]))
    beyond = [each.of(("a", "b")).total - alone.total for each in (scores, rough)]
    assert 0.0 < beyond[0] < 0.7 * beyond[1]


def test_columns_that_are_all_at_least_zero_need_no_free_one_beside_them():
    rng = np.random.default_rng(8)
    columns = rng.standard_normal((3, 50))
    rows = np.vstack([2.0 * columns[0] - columns[1] + 0.5 * columns[2], columns])
    model = ClassModel(np.arange(1, 4), np.zeros((3, 3)), np.ones(3, dtype=bool))
    expected, _ = nnls(columns.T, rows[0])
    assert_allclose(coefficients(rows @ rows.T, model), expected, atol=1e-12)
    assert expected[1] == 0.0


def test_where_the_drive_does_not_tell_two_causes_apart_only_single_classes_are_named():
    shows_one = {"is_one_line": True}
    assert answered(A, options=shows_one).ids == ("a",)
    for two in (A + 0.5 * B, A + MORE):
        assert answered(two).state == NAMED_CLASS
        assert answered(two, options=shows_one).state == NO_CLASS


@pytest.mark.parametrize("seed", range(1, 7))
def test_of_equal_pairs_one_is_the_answer_and_the_others_are_its_ties(seed):
    # Any two of the three span both causes, and c alone is nearest to their sum.
    mixed = COLUMNS | {"c": COLUMNS["a"] + 0.6 * COLUMNS["b"]}
    result = answered(A + B, mixed, noise=0.01, seed=seed)
    pairs = {("a", "b"), ("a", "c"), ("b", "c")}
    assert {result.ids, *result.ties} == pairs
    assert len(result.ties) == 2


@pytest.mark.parametrize(("share", "answer"), [(1.0, ("surface",)), (0.9, ("a", "b"))])
def test_a_coupled_class_takes_the_place_of_its_parts_where_a_product_leaves_less(share, answer):
    # As much of a third part as no class would be asked for.
    signal = A + B + 0.05 * MORE
    product = np.array([A + share * B + 0.05 * MORE])
    table = toy_table(signal, COLUMNS | {"product": product}, noise=0.01)
    assert answer_of(table, ("a", "b", "c")).ids == ("a", "b")
    coupling = COUPLED_DAMPING | {"products": {"p": ("product",)}}
    assert answer_of(replace(table, **coupling), ("a", "b", "c")).ids == answer


def test_what_is_held_out_is_left_by_a_fit_of_baseline_and_laws_to_the_other_folds():
    table = toy_table(A + 0.5 * B, COLUMNS, laws={"a": A, "b": B}, noise=0.01)
    (first,), (second,) = (law.variants for law in (table.laws["a"][0], table.laws["b"][0]))
    options = [first, second, np.concatenate([first, second])]
    results = ClassScores(table, LIMITS).with_laws((), options)
    for columns, result in zip(options, results, strict=True):
        fitted = np.concatenate([table.base, columns])
        expected = np.empty(len(table.gram))
        for fold, products in enumerate(table.training):
            c = np.linalg.lstsq(products[np.ix_(fitted, fitted)], products[fitted, 0])[0]
            weights = np.concatenate([[1.0], -c])
            every = np.append(0, fitted)
            for block in np.flatnonzero(table.folds == fold):
                expected[block] = weights @ table.gram[block][np.ix_(every, every)] @ weights
        assert_allclose(result.squares, expected, rtol=1e-6)


def test_a_law_without_a_column_in_the_records_takes_no_coefficient():
    products = np.array([[[1.0, 0.0], [0.0, 0.0]], [[1.0, 0.5], [0.5, 1.0]]])
    np.testing.assert_array_equal(_free_coefficients(products, np.zeros((2, 1, 1))), [[0.0], [0.5]])
