"""Which sets of laws the table proposes for a fit in the simulator."""

from dataclasses import replace

import numpy as np

from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.gram_table import LawColumns
from carrierflex.diagnosis.classes.held_out import ClassScores
from carrierflex.diagnosis.classes.law_sets import law_sets
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


def test_three_laws_of_one_size_none_of_which_explains_half_are_proposed():
    sets = sets_of(column("a0") + column("b0") + column("c0"))
    assert ("a0", "b0", "c0") in sets


def test_laws_of_one_class_compete_with_each_other_and_may_stand_together():
    sets = sets_of(column("a0") + column("a1"), (("a",),))
    assert ("a0", "a1") in sets


def test_a_law_that_the_simulator_lacks_is_never_proposed():
    signal = column("a0") + 0.7 * column("b0")
    classes = (("a",), ("a", "b"))
    assert any("a0" in laws for laws in sets_of(signal, classes))
    sets = sets_of(signal, classes, simulated=EVERY - {"a0"})
    assert sets
    assert not any("a0" in laws for laws in sets)
    assert ("a1",) in sets
    assert sets_of(signal, classes, simulated=()) == ()


def test_the_nearest_laws_of_the_answer_and_of_its_ties_come_before_the_library():
    # The gap is of c alone; a tie with a and b is asked for all the same.
    sets = sets_of(column("c0"), (("b",), ("a", "b")))
    assert sets[0] in {("b0",), ("b1",)}
    assert set(sets[:2]) == {("b0",), ("b1",)}
    assert set(sets[2:6]) == {("a0", "b0"), ("a0", "b1"), ("a1", "b0"), ("a1", "b1")}
    assert ("c0",) in sets[6:]


def test_two_nearest_laws_stand_for_a_class():
    signal = column("a0") + 0.6 * column("a2") + 0.3 * column("a1")
    laws = {"a": (law("a1", "a1"), law("a2", "a2"), law("a0", "a0"))}
    sets = sets_of(signal, (("a",),), laws=laws, simulated={"a0", "a1", "a2"})
    assert sets[:2] == (("a0",), ("a2",))


def test_the_nearest_law_of_a_class_is_nearest_beside_the_other_classes():
    # Most of what a0 explains alone the class b explains too.
    both = column("a0") + 2.0 * column("b0")
    laws = {"a": (law("a0", "a0"), law("b0_as_a", "b0"), law("a1", "a1")), "b": LAWS["b"]}
    sets = sets_of(both, (("a", "b"),), laws=laws, simulated={"a0", "a1", "b0_as_a", "b0", "b1"})
    assert sets[0] == ("a0", "b0")


def test_a_class_without_a_law_has_no_set():
    assert ("a0",) not in sets_of(column("c0"), (("a", "c"),), laws={**LAWS, "a": ()})
    # Its tie has one.
    sets = sets_of(column("c0"), (("a", "c"), ("c",)), laws={**LAWS, "a": ()})
    assert sets[0] == ("c0",)


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


def test_the_library_holds_three_sets_of_a_size():
    sets = sets_of(column("a0") + 0.7 * column("b1"))
    assert [len(laws) for laws in sets] == [1, 1, 1, 2, 2, 2]
    assert (sets[0], sets[3]) == (("a0",), ("a0", "b1"))
