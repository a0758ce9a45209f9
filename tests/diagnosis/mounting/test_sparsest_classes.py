"""Which class of a mounting is the answer of those that leave as much; which load parts them."""

from types import SimpleNamespace

import numpy as np
import pytest

from carrierflex.diagnosis.classes.decision import ClassesByShape, Decision, is_no_clear_gain
from carrierflex.diagnosis.classes.results import NAMED_CLASS, NOTHING
from carrierflex.diagnosis.mounting.answer import (
    _separating_load,
    _with_fewest_columns,
    _with_sparse_maps,
    _with_unequal_stiffness,
)
from carrierflex.diagnosis.mounting.motion import N_FREE
from tests.diagnosis.classes.toy_table import known_scores

AXIAL, STIFFNESS = "housing/stiffness/axial", "housing/stiffness/full"
DIRECTION, LOADS = "loads/map/direction", "loads/map/full"
UNEVEN = "housing/stiffness/unequal"
GAIN, GAINS = "sensors/gain/s1", "sensors/gain/each"
DELAY, DELAYS = "clock/delay/all", "clock/delay/each"
SPRING, SPRINGS = "bushings/restoring_force/same", "bushings/restoring_force/each"
DAMPER = "bushings/dissipation/same"
SIZES = {
    AXIAL: 1,
    STIFFNESS: 9,
    UNEVEN: 1,
    DIRECTION: 1,
    LOADS: 12,
    GAIN: 1,
    GAINS: 12,
    DELAY: 1,
    DELAYS: 12,
    SPRING: 8,
    SPRINGS: 16,
    DAMPER: 6,
}
#: Of a cause of a hundred floors: all is shown, and as much within the error of the floor.
ALL, AS_MUCH = {"cause": 0.0}, {"cause": 1e-4}


def rule_of(causes, classes, sizes=SIZES):
    """Rule on classes of which the remainders are known."""
    scores, shares = known_scores(causes, classes)
    of_classes = {name: sizes[name] for name in classes}
    return ClassesByShape(scores, shares, of_classes, is_no_clear_gain)


def decided(answer, classes, causes=None, sizes=SIZES):
    """Decision for an answer beside other classes."""
    rule = rule_of(causes or {"cause": 100.0}, classes, sizes)
    decision = Decision(NAMED_CLASS, answer, (), rule.scores.of(answer), answer)
    return _with_fewest_columns(rule, decision)


def test_a_map_of_one_column_that_leaves_as_much_takes_the_place_of_a_full_one():
    result = decided((STIFFNESS,), {STIFFNESS: ALL, DIRECTION: AS_MUCH})
    assert (result.classes, result.ties) == ((DIRECTION,), ())
    assert result.squares.total == pytest.approx(1.01)
    # Errors of the sensors make up for 12 floors beside 8; not for 20.
    twelve, eight, twenty = {"cause": 0.11}, {"cause": 0.07}, {"cause": 0.19}
    assert decided((STIFFNESS,), {STIFFNESS: eight, DIRECTION: twelve}).classes == (DIRECTION,)
    assert decided((STIFFNESS,), {STIFFNESS: eight, DIRECTION: twenty}).classes == (STIFFNESS,)
    # Two columns, or what is no map, must leave as much.
    two = {**SIZES, DIRECTION: 2}
    result = decided((STIFFNESS,), {STIFFNESS: eight, DIRECTION: twelve}, sizes=two)
    assert result.classes == (STIFFNESS,)
    assert decided((STIFFNESS,), {STIFFNESS: eight, DELAY: twelve}).classes == (STIFFNESS,)
    assert decided((STIFFNESS,), {STIFFNESS: ALL, DELAY: AS_MUCH}).classes == (DELAY,)
    assert decided((SPRING,), {SPRING: eight, AXIAL: twelve}).classes == (SPRING,)


def test_where_nothing_is_missing_nothing_is_replaced():
    rule = rule_of({}, {AXIAL: {}, STIFFNESS: {}})
    nothing = Decision(NOTHING, (), (), rule.scores.of(()), (AXIAL, STIFFNESS))
    assert _with_fewest_columns(rule, nothing) is nothing


def test_as_many_columns_take_no_place():
    result = decided((AXIAL,), {AXIAL: ALL, DIRECTION: AS_MUCH})
    assert (result.classes, result.ties) == ((AXIAL,), ((DIRECTION,),))


def test_no_force_of_the_bushings_takes_the_place_of_another_class():
    result = decided((STIFFNESS,), {STIFFNESS: ALL, DAMPER: AS_MUCH})
    assert (result.classes, result.ties) == ((STIFFNESS,), ((DAMPER,),))


def test_a_force_whose_place_a_map_takes_stays_its_tie():
    result = decided((SPRING,), {SPRING: ALL, AXIAL: AS_MUCH, DIRECTION: {}})
    assert (result.classes, result.ties) == ((AXIAL,), ((SPRING,),))


def test_one_member_of_several_is_replaced_by_a_shape_that_none_has():
    causes = {"cause": 100.0, "other": 60.0}
    classes = {DIRECTION: {"other": 0.0}, STIFFNESS: ALL, GAIN: AS_MUCH}
    pair = (STIFFNESS, DIRECTION)
    assert decided(pair, classes, causes).classes == (DIRECTION, GAIN)
    taken = {"loads/map/gain": AS_MUCH, DIRECTION: {"other": 0.0}, STIFFNESS: ALL}
    result = decided(pair, taken, causes, sizes={**SIZES, "loads/map/gain": 1})
    assert result.classes == pair


def test_full_maps_that_leave_as_much_are_tied_whatever_columns_they_take():
    classes = {STIFFNESS: ALL, LOADS: AS_MUCH, GAINS: AS_MUCH, SPRINGS: AS_MUCH, DELAYS: AS_MUCH}
    result = decided((STIFFNESS,), classes)
    assert result.classes == (STIFFNESS,)
    # Neither forces nor delays of more columns, nor a map that leaves more.
    assert set(result.ties) == {(LOADS,), (GAINS,)}
    result = decided((STIFFNESS,), {**classes, LOADS: {"cause": 0.02}})
    assert result.ties == ((GAINS,),)
    # Nor a way between a sparse map and the full one.
    some = {**SIZES, "loads/map/some": 11}
    result = decided((STIFFNESS,), {STIFFNESS: ALL, "loads/map/some": AS_MUCH}, sizes=some)
    assert result.ties == ()


def test_a_full_map_is_no_tie_of_a_sparse_one_or_of_a_force():
    assert decided((AXIAL,), {AXIAL: ALL, LOADS: AS_MUCH}).ties == ()
    assert decided((SPRING,), {SPRING: ALL, LOADS: AS_MUCH}).ties == ()


def test_beside_another_class_full_maps_are_tied_with_it():
    causes = {"cause": 100.0, "other": 60.0}
    classes = {SPRING: {"other": 0.0}, STIFFNESS: ALL, LOADS: AS_MUCH}
    result = decided((SPRING, STIFFNESS), classes, causes)
    assert result.ties == ((SPRING, LOADS),)


def evened(answer, causes, of_springs, further=None):
    """Classes of an answer where one bushing may be stiffer."""
    classes = {SPRING: {"force": 0.0}, UNEVEN: {"excess": 0.0}, SPRINGS: of_springs}
    classes |= further or {}
    rule = rule_of(causes, classes)
    decision = Decision(NAMED_CLASS, answer, ((DELAY,),), rule.scores.of(answer), answer)
    result = _with_unequal_stiffness(rule, decision)
    assert result.squares is rule.scores.of(result.classes)
    assert result is decision or result.ties == ()
    return result.classes


def test_a_stiffer_bushing_beside_one_force_is_no_force_of_either_bushing():
    causes = {"force": 100.0, "excess": 60.0}
    both = {"force": 0.0, "excess": 0.0}
    assert evened((SPRINGS,), causes, both) == (SPRING, UNEVEN)
    assert evened((SPRING,), causes, both) == (SPRING,)
    damped = {**causes, "damping": 50.0}
    further = {DAMPER: {"damping": 0.0}}
    assert evened((DAMPER, SPRINGS), damped, both, further) == (DAMPER, SPRING, UNEVEN)


def test_forces_whose_difference_is_no_stiffness_stay_one_each():
    both = {"force": 0.0, "excess": 0.0, "other": 0.0}
    # What they gain is half of what is left from the floor's error on, whatever share of the gap.
    causes = {"force": 100.0, "excess": 60.0}
    assert evened((SPRINGS,), {**causes, "other": 0.03}, both) == (SPRING, UNEVEN)
    assert evened((SPRINGS,), {**causes, "other": 0.2}, both) == (SPRINGS,)


def test_forces_are_not_evened_where_either_part_pays_nothing_or_a_stiffness_is_named():
    both = {"force": 0.0, "excess": 0.0}
    assert evened((SPRINGS,), {"excess": 60.0}, both) == (SPRINGS,)
    assert evened((SPRINGS,), {"force": 60.0}, both) == (SPRINGS,)
    named = (AXIAL, SPRINGS)
    causes = {"force": 100.0, "excess": 60.0, "axial": 50.0}
    assert evened(named, causes, both, {AXIAL: {"axial": 0.0}}) == named
    rule = rule_of({}, {SPRING: {}, UNEVEN: {}, SPRINGS: {}})
    nothing = Decision(NOTHING, (), (), rule.scores.of(()), (SPRING, UNEVEN))
    assert _with_unequal_stiffness(rule, nothing) is nothing


def parted(answer, causes, classes, sizes=SIZES):
    """Classes of an answer where pairs of sparse maps may stand for a full one."""
    rule = rule_of(causes, classes, sizes)
    decision = Decision(NAMED_CLASS, answer, ((DELAY,),), rule.scores.of(answer), answer)
    result = _with_sparse_maps(rule, decision)
    assert result is decision or result.ties == ()
    return result.classes


def test_two_sparse_maps_that_leave_as_much_are_no_full_map():
    causes = {"axial": 100.0, "turned": 60.0}
    classes = {
        AXIAL: {"axial": 0.0},
        DIRECTION: {"turned": 0.0},
        LOADS: {"axial": 0.0, "turned": 0.0},
    }
    assert parted((LOADS,), causes, classes) == (AXIAL, DIRECTION)
    # Beside a force too, and not where they leave more.
    damped = {**causes, "damping": 50.0}
    with_damper = {**classes, DAMPER: {"damping": 0.0}}
    assert parted((DAMPER, LOADS), damped, with_damper) == (DAMPER, AXIAL, DIRECTION)
    more = {**causes, "other": 3.0}
    full = {**classes, LOADS: dict.fromkeys(more, 0.0)}
    assert parted((LOADS,), more, full) == (LOADS,)


def test_a_full_map_stays_where_two_of_its_own_ways_explain_it_best_or_one_map_does():
    causes = {"gain of one": 100.0, "gain of two": 60.0}
    all_of_it = dict.fromkeys(causes, 0.0)
    classes = {
        GAIN: {"gain of one": 0.0},
        "sensors/gain/s2": {"gain of two": 0.0},
        AXIAL: {"gain of two": 1e-4},
        GAINS: all_of_it,
    }
    sizes = {**SIZES, "sensors/gain/s2": 1}
    rule = rule_of(causes, classes, sizes)
    decision = Decision(NAMED_CLASS, (GAINS,), (), rule.scores.of((GAINS,)), (GAINS,))
    assert _with_sparse_maps(rule, decision) is decision
    alone = {AXIAL: {"axial": 0.0}, DIRECTION: {}, LOADS: {"axial": 0.0}}
    assert parted((LOADS,), {"axial": 100.0}, alone) == (LOADS,)


def test_a_force_is_not_parted_into_maps():
    """A sum of maps that leaves as much as a force of eight columns is another cause."""
    causes = {"axial": 100.0, "turned": 60.0}
    classes = {AXIAL: {"axial": 0.0}, DIRECTION: {"turned": 0.0}}
    assert parted((SPRING,), causes, {**classes, SPRING: dict.fromkeys(causes, 0.0)}) == (SPRING,)


@pytest.mark.parametrize("other", [DELAY, SPRING, STIFFNESS])
def test_a_full_map_is_parted_into_sparse_maps_alone(other):
    """Neither into what is no map, nor into another full map, however few their columns are."""
    causes = {"gain": 100.0, "other": 60.0}
    classes = {
        GAIN: {"gain": 0.0},
        other: {"other": 0.0},
        LOADS: dict.fromkeys(causes, 0.0),
    }
    assert SIZES[GAIN] + SIZES[other] < SIZES[LOADS]
    assert parted((LOADS,), causes, classes) == (LOADS,)


def test_a_full_map_is_not_parted_into_a_shape_that_another_member_has():
    causes = {"axial": 80.0, "uneven": 100.0, "gain": 60.0}
    classes = {
        AXIAL: {"axial": 0.0},
        UNEVEN: {"uneven": 0.0},
        GAIN: {"gain": 0.0},
        LOADS: {"uneven": 0.0, "gain": 0.0},
    }
    assert parted((AXIAL, LOADS), causes, classes) == (AXIAL, LOADS)
    # Where none has it the same pair takes its place.
    del causes["axial"]
    assert parted((LOADS,), causes, classes) == (UNEVEN, GAIN)


def test_a_full_map_is_parted_only_into_fewer_columns_than_it_has():
    causes = {"axial": 100.0, "turned": 60.0}
    some = "loads/map/some"
    classes = {
        AXIAL: {"axial": 0.0},
        some: {"turned": 0.0},
        GAINS: dict.fromkeys(causes, 0.0),
    }
    # Beside one column, of twelve.
    for columns, expected in ((10, (AXIAL, some)), (11, (GAINS,)), (12, (GAINS,))):
        assert parted((GAINS,), causes, classes, {**SIZES, some: columns}) == expected


def separating(loads, answer=(STIFFNESS,), ties=((LOADS,),)):
    """Load that parts ties where torque, sideways and vertical load move the housing alike."""
    stiffness = 4.0 * np.pi**2 * np.linspace(4.0, 9.0, N_FREE)
    body = SimpleNamespace(
        K=np.diag(stiffness),
        M=np.eye(N_FREE),
        G=stiffness[:, None] * np.eye(N_FREE, 3),
        free_output=np.eye(N_FREE),
    )
    motions = [SimpleNamespace(body=body, loads=np.array([[0.0, 0.0, 5.0], loads]))]
    decision = SimpleNamespace(classes=answer, ties=ties)
    return _separating_load(SimpleNamespace(motions=motions), decision)


def test_a_load_that_did_not_act_parts_tied_maps():
    text = separating([10.0, 10.0, 5.0])
    assert text == (
        "slow loads leave the same signals of a stiffness, a map of the loads and gains of the "
        "sensors; a vertical load together with the others parts them"
    )
    assert "; a torque together with the others" in separating([0.9, 10.0, 15.0])
    assert "; a sideways load together with the others" in separating([10.0, 0.9, 15.0])


def test_where_all_loads_acted_a_quick_one_parts_tied_maps():
    text = separating([1.1, 10.0, 15.0])
    # The lowest frequency is 2 Hz.
    assert "; a sine of torque and radial load at 1.0 Hz, where the housing's inertia" in text


def test_no_load_is_told_where_no_maps_are_tied():
    loads = [10.0, 10.0, 5.0]
    assert separating(loads, ties=()) == ""
    assert separating(loads, ties=((DELAY,),)) == ""
    assert separating(loads, answer=(SPRING,)) == ""
    assert separating(loads, answer=(STIFFNESS, SPRING), ties=((SPRING, GAINS),)) != ""
