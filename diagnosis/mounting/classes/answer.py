"""Class of the missing effect of a mounting: decision, ties of linear maps, ids of the contract.

What of a class it is goes into the note of the answer.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import combinations

import numpy as np

from carrierflex.diagnosis.classes.answer import answer_of
from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.decision import Decision
from carrierflex.diagnosis.classes.held_out import Classes, ClassScores, HeldOutSquares
from carrierflex.diagnosis.classes.law_sets import law_sets
from carrierflex.diagnosis.classes.results import NOTHING, ClassAnswer, ClassFinding
from carrierflex.diagnosis.classes.shape_decision import (
    FURTHER_CAUSE,
    decide_by_shape,
    is_no_clear_gain,
    rivals_of,
    shape_of,
    simplest,
    ties_of,
    way_of,
)
from carrierflex.diagnosis.classes.shares import Shares
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.mounting.classes.catalogue import (
    CHANGE,
    DELAY,
    EACH,
    FORCE_GROUPS,
    FULL,
    GAIN,
    LINEAR_MAPS,
    LOADS,
    SAME,
    STIFFNESS,
    UNEQUAL,
    ZERO,
)
from carrierflex.diagnosis.mounting.classes.motion import N_FREE
from carrierflex.diagnosis.mounting.classes.shapes import measured_shape
from carrierflex.diagnosis.mounting.classes.table import MountingTable, mounting_table
from carrierflex.diagnosis.mounting.model import MountingModel
from carrierflex.diagnosis.mounting.records import MountingRecord

#: Share of the floor that is added to what a class leaves: errors of the sensors' gains, which
#: every rig has, leave up to a third of the floor's amplitude, and a map of many columns learns
#: them.
_FLOOR_ERROR = 0.15
#: Loads in words, and the share of the largest load's motion below which one is absent.
_LOADS = ("a torque", "a sideways load", "a vertical load")
_ABSENT = 0.1
#: Share of the lowest frequency at which inertia takes a quarter of a load.
_QUICK = 0.5
_STIFFNESS_MAP = "stiffness_map"
_INPUT_MAP = "input_map"
_SENSOR_MAP = "sensor_map"
_TIME_VARIATION = "time_variation"
_IDS: Mapping[str, str] = {
    STIFFNESS: _STIFFNESS_MAP,
    LOADS: _INPUT_MAP,
    GAIN: _SENSOR_MAP,
    ZERO: _SENSOR_MAP,
    DELAY: _SENSOR_MAP,
    CHANGE: _TIME_VARIATION,
}
_WORDS = {
    f"{STIFFNESS}/axial": "stiffness along the axis",
    f"{STIFFNESS}/main_bearing": "compliance of the main bearing",
    f"{STIFFNESS}/unequal": "one bushing stiffer than the other",
    f"{STIFFNESS}/{FULL}": "no sparse form of the stiffness map",
    f"{LOADS}/torque_from_load": "torque from the radial load",
    f"{LOADS}/direction": "direction of the radial load",
    f"{LOADS}/gain": "size of the radial load beside the torque",
    f"{LOADS}/{FULL}": "no sparse form of the input map",
    f"{GAIN}/{EACH}": "gains of several sensors",
    f"{ZERO}/{EACH}": "zeros of several sensors",
    f"{DELAY}/all": "delay of all sensors, which is one of all loads the other way",
    f"{DELAY}/torque": "delay of the torque",
    f"{DELAY}/radial_load": "delay of the radial load",
}


def mounting_class_table(
    model: MountingModel, records: Sequence[MountingRecord], linear: FloatArray
) -> MountingTable | None:
    """Table of classes and laws.

    Parameters
    ----------
    model : MountingModel
        Baseline and library.
    records : sequence of MountingRecord
        Runs.
    linear : ndarray, shape (2,)
        K1 and C1 of the linear bushings that fit the records best.

    Returns
    -------
    MountingTable or None
        None where the records are too short or do not show the motion.
    """
    constants = ClassConstants(floor_error=_FLOOR_ERROR, second_cause=FURTHER_CAUSE)
    return mounting_table(model, records, linear, constants)


def answer_of_table(own: MountingTable) -> ClassAnswer:
    """Answer by class of a table."""
    scores = own.scores
    shares = Shares(scores.of(()).squares, own.table.floor, scores.constants)
    decision = decide_by_shape(scores, shares, own.sizes, as_good=is_no_clear_gain)
    decision = _with_unequal_stiffness(scores, shares, decision)
    decision = _with_sparse_maps(scores, shares, decision, own.sizes)
    decision = _with_fewest_columns(scores, shares, decision, own.sizes)
    answer = answer_of(
        scores,
        shares,
        decision,
        rivals_of(scores, decision, own.sizes),
        shape_of=partial(measured_shape, own, shares, decision.classes),
        note=_separating_load(own, decision),
    )
    laws = law_sets(scores, shares, (decision.classes, *decision.ties), own.model.cards)
    return _in_contract_ids(replace(answer, same_scores=True, law_sets=laws))


def _separating_load(own: MountingTable, decision: Decision) -> str:
    """Load that parts tied linear maps; empty where none are tied."""
    tied = {shape_of(name) for names in decision.ties for name in names} & set(LINEAR_MAPS)
    if not tied or not {shape_of(name) for name in decision.classes} & set(LINEAR_MAPS):
        return ""
    body = own.body
    stiffness = np.diag(body.K)[:N_FREE]
    static = body.free_output @ (body.G[:N_FREE] / stiffness[:, None])
    moved = np.zeros(len(_LOADS))
    for motion in own.motions:
        loads = motion.loads - motion.loads[0]
        moved += np.square(loads).mean(axis=0) * np.square(static).sum(axis=0)
    parts = zip(_LOADS, moved, strict=True)
    absent = [words for words, part in parts if part < _ABSENT**2 * moved.max()]
    lowest = float(np.sqrt(np.min(stiffness / np.diag(body.M)[:N_FREE])) / (2.0 * np.pi))
    load = (
        f"{absent[0]} beside the others"
        if absent
        else f"a sine of torque and radial load at {_QUICK * lowest:.1f} Hz, where the housing's "
        "inertia takes a quarter of the load,"
    )
    return (
        "slow loads leave the same signals of a stiffness, a map of the loads and gains of the "
        f"sensors; {load} parts them"
    )


def _with_unequal_stiffness(scores: ClassScores, shares: Shares, decision: Decision) -> Decision:
    """Decision in which a stiffer bushing is no force of either bushing alone."""
    if STIFFNESS in {shape_of(name) for name in decision.classes}:
        return decision
    for member in decision.classes:
        if shape_of(member) not in FORCE_GROUPS or way_of(member) != EACH:
            continue
        others = tuple(name for name in decision.classes if name != member)
        parts = (f"{shape_of(member)}/{SAME}", f"{STIFFNESS}/{UNEQUAL}")
        held = scores.of((*others, *parts))
        takes_half = shares.is_clear_gain(decision.held, held, 0.0)
        if not takes_half and _both_pay(scores, shares, others, parts):
            return _replaced(scores, decision, (*others, *parts))
    return decision


def _with_sparse_maps(
    scores: ClassScores, shares: Shares, decision: Decision, sizes: Mapping[str, int]
) -> Decision:
    """Decision in which two maps of few columns are no full map."""
    sparse = [
        name for name in sizes if shape_of(name) in LINEAR_MAPS and way_of(name) not in (FULL, EACH)
    ]
    for member in decision.classes:
        if shape_of(member) not in LINEAR_MAPS or sizes[member] == 1:
            continue
        others = tuple(name for name in decision.classes if name != member)
        taken = {shape_of(name) for name in others}
        pairs = [
            pair
            for pair in combinations(sparse, 2)
            if taken.isdisjoint(map(shape_of, pair))
            and sizes[pair[0]] + sizes[pair[1]] < sizes[member]
        ]
        if not pairs:
            continue
        best = min(pairs, key=lambda pair: scores.of((*others, *pair)).total)
        held = scores.of((*others, *best))
        is_as_good = held.total < decision.held.total or shares.are_equal(held, decision.held)
        is_two = shape_of(best[0]) != shape_of(best[1])
        if is_two and is_as_good and _both_pay(scores, shares, others, best):
            return _replaced(scores, decision, (*others, *best))
    return decision


def _both_pay(scores: ClassScores, shares: Shares, others: Classes, parts: tuple[str, str]) -> bool:
    """Whether two classes beside others gain what a second cause has to, either over the other."""
    held = scores.of((*others, *parts))
    return not any(is_no_clear_gain(shares, scores.of((*others, own)), held) for own in parts)


def _replaced(scores: ClassScores, decision: Decision, classes: Classes) -> Decision:
    """Decision for other classes; its ties are sought anew."""
    answer = tuple(sorted(classes))
    return replace(decision, classes=answer, held=scores.of(answer), ties=())


def _with_fewest_columns(
    scores: ClassScores, shares: Shares, decision: Decision, sizes: Mapping[str, int]
) -> Decision:
    """Decision whose members are the classes of fewest columns among those that leave as much."""
    if decision.state == NOTHING:
        return decision
    answer, held = decision.classes, decision.held
    for member in decision.classes:
        others = tuple(name for name in answer if name != member)
        taken = {shape_of(name) for name in others}
        rivals = [
            name
            for name in sorted(sizes, key=lambda name: sizes[name])
            if sizes[name] < sizes[member]
            and shape_of(name) not in taken
            and shape_of(name) not in FORCE_GROUPS
        ]
        for name in rivals:
            rival = tuple(sorted((*others, name)))
            if _stands(shares, scores.of(rival), held, name, member, sizes[name]):
                answer = simplest(scores, shares, rival, sizes, is_no_clear_gain)
                break
    ties = [*ties_of(scores, shares, answer, sizes), *_tied_maps(scores, shares, answer, sizes)]
    lost = {shape_of(name) for name in decision.classes} - {shape_of(name) for name in answer}
    if lost - set(LINEAR_MAPS):
        # A force of the bushings that leaves as much is another cause, not the same map in more
        # columns.
        ties.append(decision.classes)
    kept = tuple(dict.fromkeys(ties))
    return replace(decision, classes=answer, held=scores.of(answer), ties=kept)


def _stands(
    shares: Shares, rival: HeldOutSquares, held: HeldOutSquares, name: str, member: str, size: int
) -> bool:
    """Whether a class of fewer columns takes the place of a member."""
    is_map = {shape_of(name), shape_of(member)} <= set(LINEAR_MAPS)
    if is_map and size == 1:
        return is_no_clear_gain(shares, rival, held)
    return shares.are_equal(rival, held)


def _tied_maps(
    scores: ClassScores, shares: Shares, answer: Classes, sizes: Mapping[str, int]
) -> list[Classes]:
    """Other full maps that leave as much as one in the answer."""
    held = scores.of(answer)
    taken = {shape_of(name) for name in answer}
    found = []
    for member in answer:
        if shape_of(member) not in LINEAR_MAPS or sizes[member] == 1:
            continue
        others = tuple(name for name in answer if name != member)
        for name in sizes:
            is_map = shape_of(name) in LINEAR_MAPS and way_of(name) in (FULL, EACH)
            if is_map and shape_of(name) not in taken:
                rival = tuple(sorted((*others, name)))
                if shares.are_equal(scores.of(rival), held):
                    found.append(rival)
    return found


def contract_id(name: str) -> str:
    """Id of the contract of a class of the comparison."""
    if shape_of(name) == DELAY and way_of(name) != "all":
        return _INPUT_MAP
    return _IDS.get(shape_of(name), shape_of(name))


def _in_contract_ids(answer: ClassAnswer) -> ClassAnswer:
    """Answer whose classes have the ids of the contract."""
    findings: dict[str, ClassFinding] = {}
    for own in answer.classes:
        name = contract_id(own.id)
        findings[name] = _joined(findings.get(name), replace(own, id=name))
    ids = tuple(findings)
    ties = dict.fromkeys(_ids(names) for names in answer.ties)
    rivals: dict[str, float] = {}
    for rival, share in answer.rivals.items():
        name = contract_id(rival)
        if name not in ids:
            rivals[name] = max(share, rivals.get(name, -1.0))
    words = [_detail(own.id) for own in answer.classes]
    note = "; ".join(text for text in (*words, answer.note) if text)
    return replace(
        answer,
        classes=tuple(findings.values()),
        ties=tuple(names for names in ties if set(names) != set(ids)),
        rivals=rivals,
        best=_ids(answer.best),
        learnt_by=tuple(name for name in _ids(answer.learnt_by) if name not in ids),
        classes_of_law={law: _ids(names) for law, names in answer.classes_of_law.items()},
        note=note,
    )


def _ids(names: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(contract_id(name) for name in names))


def _joined(first: ClassFinding | None, second: ClassFinding) -> ClassFinding:
    """Two classes of one id as one finding; the law is that of the larger share."""
    if first is None:
        return second
    larger = first if first.share >= second.share else second
    low, high = (first.share_ci95[k] + second.share_ci95[k] for k in range(2))
    return replace(
        larger,
        share=min(first.share + second.share, 1.0),
        share_ci95=(low, min(high, 1.0)),
        law_named=first.law_named and second.law_named and first.law == second.law,
    )


def _detail(name: str) -> str:
    """What of an id a class is, in words; empty where the id says it."""
    if name in _WORDS:
        return _WORDS[name]
    if shape_of(name) in (GAIN, ZERO):
        kind = "gain" if shape_of(name) == GAIN else "zero"
        return f"{kind} of {way_of(name)}"
    return "" if way_of(name) == SAME else "a law of its own in either bushing"
