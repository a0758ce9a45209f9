"""Which sets of laws the table proposes for a fit in the simulator."""

from dataclasses import replace

import numpy as np

from carrierflex.diagnosis.classes.answer import law_sets
from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.gram_table import LawColumns
from carrierflex.diagnosis.classes.held_out import ClassScores
from carrierflex.diagnosis.classes.shares import Shares
from tests.diagnosis.classes.toy_table import SIZE, toy_columns, toy_table

LIMITS = ClassConstants()
COLUMNS = toy_columns()
#: Target and baseline come before the columns of the classes.
FIRST = {name: 2 + SIZE * k for k, name in enumerate(("a", "b", "c"))}


def law(name, *shapes):
    """Law of one column for each shape: a letter and the number of its class's column."""
    variants = tuple(np.array([FIRST[shape[0]] + int(shape[1])]) for shape in shapes)
    return LawColumns(name, variants, 1)


#: Two laws of a and of b, one of c.
LAWS = {
    "a": (law("a0", "a0"), law("a1", "a1")),
    "b": (law("b0", "b0"), law("b1", "b1")),
    "c": (law("c0", "c0"),),
}
EVERY = {"a0", "a1", "b0", "b1", "c0"}


def column(shape):
    return COLUMNS[shape[0]][int(shape[1])]


def sets_of(signal, classes=(), *, laws=LAWS, simulated=EVERY):
    table = replace(toy_table(signal, COLUMNS), laws=laws)
    scores = ClassScores(table, LIMITS)
    shares = Shares(scores.of(()).squares, table.floor, LIMITS)
    return law_sets(scores, shares, classes, simulated)


def test_two_laws_that_make_the_gap_together_are_proposed_though_no_class_is():
    sets = sets_of(column("a0") + 0.7 * column("b1"))
    assert ("a0", "b1") in sets
    # Beside the pair that makes the gap no third law gains, and none of three is proposed.
    assert max(map(len, sets)) == 2


def test_sets_grow_while_a_law_takes_half_of_what_remains():
    sets = sets_of(4.0 * column("a0") + 2.0 * column("b0") + 1.5 * column("c0"))
    assert ("a0", "b0", "c0") in sets
    # Of two causes one is outside the library and larger: b0 takes two fifths of what a0 leaves.
    sets = sets_of(4.0 * column("a0") + column("b0") + 1.2 * column("a2"))
    assert set(sets) == {("a0",)}


def test_laws_of_one_class_compete_with_each_other_and_may_stand_together():
    sets = sets_of(column("a0") + column("a1"), (("a",),))
    assert ("a0", "a1") in sets


def test_a_law_that_the_simulator_lacks_is_never_proposed():
    signal = column("a0") + 0.7 * column("b0")
    for classes in ((), (("a",), ("a", "b"))):
        assert any("a0" in laws for laws in sets_of(signal, classes))
        sets = sets_of(signal, classes, simulated=EVERY - {"a0"})
        assert not any("a0" in laws for laws in sets)
        # Beside classes that explain the gap no law is near but the nearest one of the answer.
        assert sets == (("a1",),) if classes else ("b0",) in sets
        assert sets_of(signal, classes, simulated=()) == ()


def test_laws_of_the_answer_come_first_then_those_of_its_ties_then_the_library():
    laws = {
        "a": (law("of_a", "a0"),),
        "b": (law("of_b", "a0"),),
        "c": (law("of_c", "a0"), law("of_c_too", "a0"), law("last", "a0")),
    }
    every = {"of_a", "of_b", "of_c", "of_c_too", "last"}
    sets = sets_of(column("a0"), (("c",), ("b",)), laws=laws, simulated=every)
    assert sets == (("of_c",), ("of_c_too",), ("of_b",), ("of_a",))


def test_two_nearest_laws_stand_for_a_class():
    laws = {"a": (law("far", "a1"), law("near", "a0"), law("alike", "a0"), law("third", "a0"))}
    sets = sets_of(column("a0"), (("a",),), laws=laws, simulated={"far", "near", "alike"})
    assert sets == (("near",), ("alike",))


def test_the_nearest_law_of_a_class_is_nearest_beside_the_other_classes():
    # Beside its class a0 gains nothing, beside b it is the only law of a that does.
    signal = column("a0") + 2.0 * column("b0") + 0.06 * column("b1")
    shared = (law("b0_as_a", "b0"), law("b1_as_a", "b1"), law("a0", "a0"))
    every = {"a0", "b0_as_a", "b1_as_a", "b0"}
    laws = {"a": shared, "b": (law("b0", "b0"),)}
    assert sets_of(signal, (("a", "b"),), laws=laws, simulated=every)[0] == ("a0", "b0")


def test_a_class_without_a_law_has_no_set():
    assert ("a0",) not in sets_of(column("c0"), (("a", "c"),), laws={**LAWS, "a": ()})
    # Its tie has one.
    sets = sets_of(column("c0"), (("a", "c"), ("c",)), laws={**LAWS, "a": ()})
    assert sets[0] == ("c0",)


def test_a_law_that_acts_on_nothing_is_never_proposed_and_one_of_two_loads_of_which_one_acts_is():
    # The gain of a sensor where the baseline has no signal, and no column either.
    table = toy_table(column("a0"), COLUMNS)
    gram = table.gram.copy()
    gram[:, FIRST["c"], :] = gram[:, :, FIRST["c"]] = 0.0
    both = LawColumns("both", (np.array([FIRST["a"], FIRST["c"]]),), 2)
    table = replace(table, laws={**LAWS, "a": (both,)}, gram=gram, n_base=0)
    scores = ClassScores(table, LIMITS)
    shares = Shares(scores.of(()).squares, table.floor, LIMITS)
    sets = law_sets(scores, shares, (("a",),), {"both", "b0", "b1", "c0"})
    assert sets == (("both",),)


def test_a_law_of_two_classes_is_proposed_once():
    shared = {"a": LAWS["a"][:1], "b": LAWS["a"][:1]}
    sets = sets_of(column("a0"), (("a",), ("b",), ("a", "b")), laws=shared)
    assert sets == (("a0",),)


def test_a_law_is_scored_at_the_shape_that_leaves_least():
    # At its first shape the law explains nothing, at its second the whole gap.
    bent = law("bent", "c2", "a2")
    sets = sets_of(
        column("a2") + 0.7 * column("b0"),
        laws={"a": (bent, *LAWS["a"]), "b": LAWS["b"]},
        simulated={"bent", *EVERY},
    )
    assert ("b0", "bent") in sets


def test_the_best_laws_of_noise_are_single_ones():
    assert all(len(laws) == 1 for laws in sets_of(np.zeros_like(column("a0"))))


def test_three_sets_of_a_size_are_proposed_at_most():
    laws = {"a": tuple(law(f"law{k}", "a0") for k in range(5))}
    sets = sets_of(column("a0"), laws=laws, simulated={f"law{k}" for k in range(5)})
    assert sets == (("law0",), ("law1",), ("law2",))


def test_a_set_that_leaves_far_more_than_the_best_of_its_size_is_not_proposed():
    # Of the two causes the smaller one alone leaves two, or four times what the larger one does.
    assert {("a0",), ("b1",)} < set(sets_of(column("a0") + 0.7 * column("b1")))
    assert sets_of(column("a0") + 0.5 * column("b1")) == (("a0",), ("a0", "b1"))


def test_a_set_that_leaves_far_more_than_classes_that_explain_the_gap_is_not_proposed():
    signal = column("a0") + 0.7 * column("b1")
    assert sets_of(signal, (("a", "b"),)) == (("a0", "b1"),)
    # A class that explains two thirds says nothing against a law that does.
    assert ("a0",) in sets_of(signal, (("a",),))


def test_a_class_that_holds_two_laws_has_both_in_its_first_set():
    # One law of each class explains five eighths, and sets that grow from nothing end before.
    signal = 2.0 * column("a0") + 2.0 * column("a1") + 2.0 * column("b0") + 2.0 * column("b1")
    assert sets_of(signal, (("a", "b"),))[0] == ("a0", "a1", "b0", "b1")
    # A law that gains nothing beside the others is in no such set.
    assert sets_of(2.0 * column("a0") + column("b0"), (("a", "b"),))[0] == ("a0", "b0")


def test_a_set_without_laws_of_many_shapes_stands_beside_one_with_them():
    # The bent law is nearest at one of its shapes, and may end at a bound of it in the simulator.
    bent = law("bent", "c2", "a0")
    laws = {"a": (bent, law("near", "a0"), *LAWS["a"][1:]), "b": LAWS["b"]}
    sets = sets_of(
        column("a0") + column("a1") + column("b0"),
        (("a", "b"),),
        laws=laws,
        simulated={"bent", "near", *EVERY},
    )
    assert sets[:2] == (("a1", "b0", "bent"), ("a1", "b0", "near"))
