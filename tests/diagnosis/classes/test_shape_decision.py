"""Which shapes are named, in which way and with which ties, on sets whose remainders are known."""

import numpy as np
import pytest

from carrierflex.diagnosis.classes.decision import ClassesByShape, is_no_clear_gain
from carrierflex.diagnosis.classes.results import LEADING_CLASS, NAMED_CLASS, NO_CLASS, NOTHING
from carrierflex.diagnosis.classes.shares import Shares
from tests.diagnosis.classes.toy_table import known_scores

#: Causes of which each is half as large as the one before: with each, half of the rest goes.
HALVES = {"tilt": 64.0, "wear": 32.0, "play": 16.0, "heat": 8.0, "oil": 4.0}


def rule_of(causes, classes, *, sizes=None, fitted=np.inf, **options):
    scores, shares = known_scores(causes, classes, fitted=fitted)
    sizes = {name: (sizes or {}).get(name, 1) for name in classes}
    return ClassesByShape(scores, shares, sizes, **options)


def decided(*args, **options):
    return rule_of(*args, **options).decision()


def shown(causes, shapes=None):
    """A class for each cause, which leaves nothing of it, and others that show none."""
    return {f"{name}/one": {name: 0.0} if name in causes else {} for name in shapes or causes}


def test_a_gap_of_noise_is_nothing():
    result = decided({}, shown({}, ("tilt", "wear")))
    assert (result.state, result.classes, result.ties) == (NOTHING, (), ())
    assert result.squares.total == pytest.approx(1.0)
    # One floor of gap, all of which a class learns, is a cause.
    assert decided({"tilt": 1.0}, shown({"tilt": 1.0}, ("tilt", "wear"))).state == NAMED_CLASS


def test_what_only_two_shapes_together_learn_of_coloured_noise_is_no_noise():
    # Each learns a twentieth of it, less than what counts as nothing learnt; both a tenth and more.
    small = {"tilt": 0.12, "wear": 0.12, "rest": 1.5}
    one, both = {"tilt": 0.0}, {"wear": 0.0}
    assert decided(small, {"tilt/one": one, "wear/one": {}}).state == NOTHING
    assert decided(small, {"tilt/one": one, "wear/one": both}).state != NOTHING


def test_one_cause_is_its_shape_and_the_best_pair_is_told_beside_it():
    result = decided({"tilt": 50.0}, shown({"tilt": 50.0}, ("play", "tilt", "wear")))
    assert (result.state, result.classes, result.ties) == (NAMED_CLASS, ("tilt/one",), ())
    assert result.squares.total == pytest.approx(1.0)
    assert "tilt/one" in result.best_pair


def test_words_follow_the_share():
    shapes = shown({"tilt": 0.0}, ("tilt", "wear"))
    assert decided({"tilt": 81.0, "rest": 19.0}, shapes).state == NAMED_CLASS
    assert decided({"tilt": 79.0, "rest": 21.0}, shapes).state == LEADING_CLASS
    assert decided({"tilt": 49.0, "rest": 51.0}, shapes).state == NO_CLASS


def test_shapes_are_added_as_long_as_each_takes_half_of_what_is_left():
    for n in (2, 3, 4):
        causes = dict(list(HALVES.items())[:n])
        result = decided(causes, shown(causes, HALVES))
        assert result.classes == tuple(sorted(f"{name}/one" for name in causes))
    # A cause that takes less than half of the rest is none: the rest is larger than it.
    causes = {"tilt": 64.0, "wear": 4.0, "rest": 6.0}
    assert decided(causes, shown({"tilt", "wear"})).classes == ("tilt/one",)


def test_every_shape_may_be_in_the_answer():
    causes = {"tilt": 64.0, "wear": 32.0}
    assert decided(causes, shown(causes)).classes == ("tilt/one", "wear/one")


def test_causes_of_like_size_are_named_together_where_none_alone_takes_half_of_the_rest():
    causes = {"tilt": 30.0, "wear": 25.0, "play": 24.0, "heat": 23.0, "oil": 22.0}
    result = decided(causes, shown(causes))
    assert result.classes == ("heat/one", "oil/one", "play/one", "tilt/one", "wear/one")
    assert result.squares.total == pytest.approx(1.0)
    # Where what nothing shows is larger than all further ones together, there are none.
    assert decided(causes | {"rest": 120.0}, shown(causes)).classes == ("tilt/one",)
    # Two of three that are too small by themselves to be second causes (below 2.5 %) add none.
    small = {"tilt": 100.0, "wear": 2.0, "play": 2.0, "heat": 2.0}
    assert decided(small, shown(small)).classes == ("tilt/one",)


def test_each_of_several_stays_that_gains_where_the_simple_ways_leave_a_part_of_every_cause():
    causes = {"tilt": 30.0, "wear": 25.0, "play": 24.0, "heat": 23.0, "oil": 22.0}
    classes = {
        f"{name}/{way}": {name: remaining}
        for name in causes
        for way, remaining in (("all", 0.0), ("one", 0.25))
    }
    sizes = {name: 6 for name in classes if name.endswith("/all")}
    result = decided(causes | {"rest": 20.0}, classes, sizes=sizes, as_good=is_no_clear_gain)
    # Together they leave 51 floors of 144, and no one takes half of what the others leave.
    assert result.classes == tuple(sorted(f"{name}/one" for name in causes))


def test_the_last_of_several_must_take_its_part_too():
    # All three take half of what the first leaves, the last one less than half of what two leave.
    causes = {"tilt": 60.0, "wear": 30.0, "play": 5.0, "rest": 12.0}
    assert decided(causes, shown(("tilt", "wear", "play"))).classes == ("tilt/one", "wear/one")


def test_an_answer_has_six_classes_at_most():
    names = ("tilt", "wear", "play", "heat", "oil", "rust", "wind")
    causes = {name: 30.0 - k for k, name in enumerate(names)}
    result = decided(causes, shown(causes))
    assert set(result.classes) == {f"{name}/one" for name in names[:6]}
    assert result.squares.total == pytest.approx(1.0 + causes["wind"])


def test_a_shape_that_leaves_nothing_of_the_records_it_is_fitted_to_lacks_no_cause():
    # Held out it leaves 32 floors: how far its curve must reach beyond the other conditions.
    causes = {"tilt": 64.0, "wear": 32.0}
    classes = shown(causes, ("play", "tilt", "wear"))
    assert decided(causes, classes, fitted=1.16).classes == ("tilt/one", "wear/one")
    assert decided(causes, classes, fitted=1.14).classes == ("tilt/one",)


def test_the_simplest_way_that_leaves_as_much_is_named():
    ways = {"tilt/all": {"tilt": 0.0}, "tilt/two": {"tilt": 1e-4}, "tilt/one": {"tilt": 0.02}}
    sizes = {"tilt/all": 6, "tilt/two": 2, "tilt/one": 1}
    result = decided({"tilt": 50.0}, {**ways, "wear/one": {}}, sizes=sizes)
    # 0.005 floors are within the error of one, a whole one is not.
    assert result.classes == ("tilt/two",)
    # Another way of its shape is no tie.
    assert result.ties == ()


def test_a_kind_may_take_a_simpler_way_wherever_the_richer_one_is_no_clear_gain():
    # Twelve floors and eight: unlike, but less than half of what is left is gained.
    ways = {"tilt/all": {"tilt": 0.07}, "tilt/one": {"tilt": 0.11}, "wear/one": {}}
    sizes = {"tilt/all": 6}
    causes = {"tilt": 100.0}
    assert decided(causes, ways, sizes=sizes).classes == ("tilt/all",)
    assert decided(causes, ways, sizes=sizes, as_good=Shares.are_equal).classes == ("tilt/all",)
    result = decided(causes, ways, sizes=sizes, as_good=is_no_clear_gain)
    assert result.classes == ("tilt/one",)
    ways["tilt/one"] = {"tilt": 0.16}
    result = decided(causes, ways, sizes=sizes, as_good=is_no_clear_gain)
    assert result.classes == ("tilt/all",)


def test_every_member_is_replaced_beside_the_others():
    # Alone the load's way is best; beside wear, which shows what depends on it, tilt is constant.
    causes = {"tilt": 40.0, "load": 20.0, "wear": 30.0}
    classes = {
        "tilt/load": {"tilt": 0.0, "load": 0.0},
        "tilt/one": {"tilt": 0.0},
        "wear/load": {"wear": 0.0, "load": 0.0},
        "wear/one": {"wear": 0.0},
    }
    sizes = {"tilt/load": 2, "wear/load": 3}
    rule = rule_of(causes, classes, sizes=sizes)
    named = rule.simplest(("tilt/load", "wear/load"))
    # Tilt goes first: without its load that of wear must stay.
    assert named == ("tilt/one", "wear/load")
    assert rule.decision().classes == named


def test_a_mixture_goes_where_the_causes_themselves_are_in():
    # What looks most like all three is not one of them.
    causes = {"tilt": 60.0, "wear": 40.0, "play": 40.0}
    classes = {"mixture/one": {"tilt": 0.5, "wear": 0.25, "play": 0.15}, **shown(causes)}
    assert rule_of(causes, classes).best_of_shapes()[0] == "mixture/one"
    assert decided(causes, classes).classes == ("play/one", "tilt/one", "wear/one")


def test_a_second_shape_goes_where_the_first_does_as_well_in_another_way():
    # Beside wear the simpler way of tilt will do, and leaves 12 floors; the richer one alone 20.
    causes = {"tilt": 100.0, "bend": 20.0, "wear": 12.0}
    classes = {
        "tilt/all": {"tilt": 0.07, "bend": 0.0},
        "tilt/one": {"tilt": 0.07},
        "wear/one": {"wear": 0.0, "bend": 0.2},
    }
    sizes = {"tilt/all": 6}
    assert decided(causes, classes, sizes=sizes).classes == ("tilt/all", "wear/one")
    result = decided(causes, classes, sizes=sizes, as_good=is_no_clear_gain)
    assert result.classes == ("tilt/all",)


def test_the_best_class_of_every_shape_the_best_shape_first():
    causes = {"tilt": 50.0, "wear": 20.0}
    classes = {
        "wear/one": {"wear": 0.5},
        "wear/two": {"wear": 0.0},
        "map/of/tilt/one": {"tilt": 0.0},
        "map/of/tilt/two": {"tilt": 0.5},
        "map/of/play/one": {},
    }
    rule = rule_of(causes, classes)
    ordered = ["map/of/tilt/one", "wear/two", "map/of/play/one"]
    assert rule.best_of_shapes() == ordered
    decision = rule.decision()
    assert decision.classes == ("map/of/tilt/one", "wear/two")
    assert rule.rivals(decision) == ["map/of/play/one"]


def test_another_shape_that_leaves_as_much_with_no_more_columns_is_a_tie():
    causes = {"tilt": 50.0}
    same = {"tilt": 1e-4}
    classes = {
        "tilt/two": {"tilt": 0.0},
        "wear/two": same,
        "wear/one": same,
        "play/all": same,
        "heat/two": {"tilt": 0.02},
    }
    sizes = {"tilt/two": 2, "wear/two": 2, "wear/one": 1, "play/all": 3, "heat/two": 2}
    result = decided(causes, classes, sizes=sizes)
    assert result.classes == ("tilt/two",)
    # Of wear the simplest way; play takes more columns; heat leaves a floor more.
    assert result.ties == (("wear/one",),)


def test_what_leaves_as_much_as_a_simple_way_but_more_than_its_shape_is_no_tie():
    causes = {"tilt": 1000.0}
    classes = {
        "tilt/all": {"tilt": 0.0},
        "tilt/one": {"tilt": 0.02},
        "wear/one": {"tilt": 0.02},
    }
    sizes = {"tilt/all": 6}
    result = decided(causes, classes, sizes=sizes, as_good=is_no_clear_gain)
    assert (result.classes, result.ties) == (("tilt/one",), ())
    classes["wear/all"] = {"tilt": 0.0}
    result = decided(causes, classes, sizes=sizes | {"wear/all": 6}, as_good=is_no_clear_gain)
    assert (result.classes, result.ties) == (("tilt/one",), (("wear/one",),))


def test_of_several_classes_one_is_exchanged_in_a_tie():
    causes = {"tilt": 64.0, "wear": 32.0}
    classes = {**shown(causes), "play/one": {"wear": 0.0}, "heat/one": {"tilt": 0.0}}
    ties = rule_of(causes, classes).ties(("tilt/one", "wear/one"))
    assert set(ties) == {("heat/one", "wear/one"), ("play/one", "tilt/one")}


@pytest.mark.parametrize(
    ("remaining", "error", "ties"),
    [
        (0.008, 0.1, (("wear/one",),)),
        (0.012, 0.1, ()),
        (0.008, 0.0, ()),
        (0.03, 0.2, (("wear/one",),)),
    ],
)
def test_columns_that_are_derivatives_may_leave_the_square_of_their_error(remaining, error, ties):
    causes = {"tilt": 900.0}
    classes = {"tilt/one": {"tilt": 0.0}, "wear/one": {"tilt": remaining}}
    result = decided(causes, classes, errors={"wear/one": error})
    assert (result.classes, result.ties) == (("tilt/one",), ties)


def test_a_way_that_imitates_a_cause_gives_way_once_that_cause_has_a_class():
    """Alone ``tilt/both`` leaves least: it takes most of what ``wear`` makes too."""
    causes = {"tilt": 64.0, "wear": 32.0}
    classes = {
        "tilt/own": {"tilt": 0.0},
        "tilt/both": {"tilt": 0.2, "wear": 0.2},
        "wear/one": {"wear": 0.0},
    }
    assert rule_of(causes, classes).best_of_shapes()[0] == "tilt/both"
    assert decided(causes, classes, chooses_anew=True).classes == ("tilt/own", "wear/one")
    assert decided(causes, classes).classes != ("tilt/own", "wear/one")


def test_a_further_shape_comes_in_the_way_that_is_best_beside_the_others():
    """Alone ``wear/both`` leaves least of its shape; beside ``tilt`` it takes little more."""
    causes = {"tilt": 64.0, "wear": 32.0}
    classes = {
        "tilt/one": {"tilt": 0.0},
        "wear/own": {"wear": 0.0},
        "wear/both": {"tilt": 0.1, "wear": 0.8},
    }
    assert "wear/both" in rule_of(causes, classes).best_of_shapes()
    assert decided(causes, classes, chooses_anew=True).classes == ("tilt/one", "wear/own")
