"""Class of the missing effect of a mounting: decision, ties of linear maps, ids of the contract.

What of a class it is goes into the note of the answer.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial
from itertools import combinations

import numpy as np

from carrierflex.diagnosis.classes.answer import answer_of
from carrierflex.diagnosis.classes.columns import TIME_VARIATION
from carrierflex.diagnosis.classes.decision import (
    ClassesByShape,
    Decision,
    is_no_clear_gain,
    shape_of,
    way_of,
    without,
)
from carrierflex.diagnosis.classes.held_out import Classes
from carrierflex.diagnosis.classes.results import NO_CLASS, NOTHING, ClassAnswer, ClassFinding
from carrierflex.diagnosis.classes.shares import Shares
from carrierflex.diagnosis.mounting.columns import ACTING
from carrierflex.diagnosis.mounting.motion import N_FREE
from carrierflex.diagnosis.mounting.shapes import measured_shape
from carrierflex.diagnosis.mounting.table import (
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
    MountingTable,
)

_LOADS = ("a torque", "a sideways load", "a vertical load")
#: Share of the lowest frequency at which inertia takes a quarter of a load.
_QUICK = 0.5
#: Share of a map that a law of its kind explains, at least: of a map beside which none does, the
#: columns hold what the sensors read by themselves, and explain that.
_LEAST_OF_MAP = 0.1
_STIFFNESS_MAP = "stiffness_map"
_INPUT_MAP = "input_map"
_SENSOR_MAP = "sensor_map"
_IDS: Mapping[str, str] = {
    STIFFNESS: _STIFFNESS_MAP,
    LOADS: _INPUT_MAP,
    GAIN: _SENSOR_MAP,
    ZERO: _SENSOR_MAP,
    DELAY: _SENSOR_MAP,
    CHANGE: TIME_VARIATION,
}
_WORDS = {
    f"{STIFFNESS}/axial": "stiffness along the axis",
    f"{STIFFNESS}/main_bearing": "compliance of the main bearing",
    f"{STIFFNESS}/unequal": "one bushing stiffer than the other",
    f"{STIFFNESS}/{FULL}": "no sparse form of the stiffness map",
    f"{LOADS}/torque_from_load": "torque from the radial load",
    f"{LOADS}/direction": "direction of the radial load",
    f"{LOADS}/gain": "size of the radial load relative to the torque",
    f"{LOADS}/{FULL}": "no sparse form of the input map",
    f"{GAIN}/{EACH}": "gains of several sensors",
    f"{ZERO}/{EACH}": "zeros of several sensors",
    f"{DELAY}/all": "delay of all sensors, which is one of all loads the other way",
    f"{DELAY}/torque": "delay of the torque",
    f"{DELAY}/radial_load": "delay of the radial load",
}


def answer_of_table(table: MountingTable) -> ClassAnswer:
    """Answer by class of a table."""
    scores = table.scores
    shares = Shares(scores.of(()).squares, table.table.floor, scores.constants)
    rule = ClassesByShape(scores, shares, table.table.sizes, is_no_clear_gain)
    decision = _with_unequal_stiffness(rule, rule.decision())
    decision = _with_fewest_columns(rule, _with_sparse_maps(rule, decision))
    decision = replace(decision, note=_separating_load(table, decision))
    answer = answer_of(
        scores,
        shares,
        decision,
        rule.rivals(decision),
        shape_of=partial(measured_shape, table, shares, decision.classes),
        simulated=table.model.cards,
    )
    if all(shape_of(name) in LINEAR_MAPS for name in decision.classes):
        # A map of stiffness or loads that explains what no such law explains anything of.
        if any(
            shape_of(finding.id) in (STIFFNESS, LOADS)
            and finding.law_share < _LEAST_OF_MAP * finding.share
            for finding in answer.classes
        ):
            answer = replace(answer, state=NO_CLASS)
    return _in_contract_ids(replace(answer, same_scores=True))


def _separating_load(table: MountingTable, decision: Decision) -> str:
    """Load that parts tied linear maps; empty where none are tied."""
    tied = {shape_of(name) for names in decision.ties for name in names} & set(LINEAR_MAPS)
    if not tied or not {shape_of(name) for name in decision.classes} & set(LINEAR_MAPS):
        return ""
    body = table.motions[0].body
    stiffness = np.diag(body.K)[:N_FREE]
    static = body.free_output @ (body.G[:N_FREE] / stiffness[:, None])
    moved = np.zeros(len(_LOADS))
    for motion in table.motions:
        loads = motion.loads - motion.loads[0]
        moved += np.square(loads).mean(axis=0) * np.square(static).sum(axis=0)
    by_load = zip(_LOADS, moved, strict=True)
    absent = [words for words, square in by_load if square < ACTING**2 * moved.max()]
    lowest = float(np.sqrt(np.min(stiffness / np.diag(body.M)[:N_FREE])) / (2.0 * np.pi))
    load = (
        f"{absent[0]} together with the others"
        if absent
        else f"a sine of torque and radial load at {_QUICK * lowest:.1f} Hz, where the housing's "
        "inertia takes a quarter of the load,"
    )
    return (
        "slow loads leave the same signals of a stiffness, a map of the loads and gains of the "
        f"sensors; {load} parts them"
    )


def _with_unequal_stiffness(rule: ClassesByShape, decision: Decision) -> Decision:
    """Decision in which a stiffer bushing is no force of either bushing alone."""
    if STIFFNESS in {shape_of(name) for name in decision.classes}:
        return decision
    for member in decision.classes:
        if shape_of(member) not in FORCE_GROUPS or way_of(member) != EACH:
            continue
        others = without(decision.classes, member)
        pair = (f"{shape_of(member)}/{SAME}", f"{STIFFNESS}/{UNEQUAL}")
        scored = rule.scores.of((*others, *pair))
        takes_half = rule.shares.is_clear_gain(decision.squares, scored, 0.0)
        if not takes_half and _both_pay(rule, others, pair):
            return decision.replaced(rule.scores, (*others, *pair))
    return decision


def _with_sparse_maps(rule: ClassesByShape, decision: Decision) -> Decision:
    """Decision in which two maps of few columns are no full map."""
    scores, sizes = rule.scores, rule.sizes
    sparse = [
        name for name in sizes if shape_of(name) in LINEAR_MAPS and way_of(name) not in (FULL, EACH)
    ]
    for member in decision.classes:
        if shape_of(member) not in LINEAR_MAPS or sizes[member] == 1:
            continue
        others = without(decision.classes, member)
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
        scored = scores.of((*others, *best))
        is_less = scored.total < decision.squares.total
        is_as_good = is_less or rule.shares.are_equal(scored, decision.squares)
        is_two = shape_of(best[0]) != shape_of(best[1])
        if is_two and is_as_good and _both_pay(rule, others, best):
            return decision.replaced(rule.scores, (*others, *best))
    return decision


def _both_pay(rule: ClassesByShape, others: Classes, pair: tuple[str, str]) -> bool:
    """Whether two classes beside others gain what a second cause has to, either over the other."""
    scores = rule.scores
    alone = [scores.of((*others, name)) for name in pair]
    both = scores.of((*others, *pair))
    return not any(is_no_clear_gain(rule.shares, one, both) for one in alone)


def _with_fewest_columns(rule: ClassesByShape, decision: Decision) -> Decision:
    """Decision whose members are the classes of fewest columns among those that leave as much."""
    scores, shares, sizes = rule.scores, rule.shares, rule.sizes
    if decision.state == NOTHING:
        return decision
    answer, scored = decision.classes, decision.squares
    for member in decision.classes:
        others = without(answer, member)
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
            is_map = {shape_of(name), shape_of(member)} <= set(LINEAR_MAPS)
            if is_map and sizes[name] == 1:
                is_as_good = is_no_clear_gain(shares, scores.of(rival), scored)
            else:
                is_as_good = shares.are_equal(scores.of(rival), scored)
            if is_as_good:
                answer = rule.simplest(rival)
                break
    ties = [*rule.ties(answer), *_tied_maps(rule, answer)]
    lost = {shape_of(name) for name in decision.classes} - {shape_of(name) for name in answer}
    if lost - set(LINEAR_MAPS):
        # A force of the bushings that leaves as much is another cause, not the same map in more
        # columns.
        ties.append(decision.classes)
    ties = list(dict.fromkeys(ties))
    return replace(decision, classes=answer, squares=scores.of(answer), ties=tuple(ties))


def _tied_maps(rule: ClassesByShape, answer: Classes) -> list[Classes]:
    """Other full maps that leave as much as one in the answer."""
    scores, sizes = rule.scores, rule.sizes
    scored = scores.of(answer)
    taken = {shape_of(name) for name in answer}
    ties = []
    for member in answer:
        if shape_of(member) not in LINEAR_MAPS or sizes[member] == 1:
            continue
        others = without(answer, member)
        for name in sizes:
            is_map = shape_of(name) in LINEAR_MAPS and way_of(name) in (FULL, EACH)
            if is_map and shape_of(name) not in taken:
                rival = tuple(sorted((*others, name)))
                if rule.shares.are_equal(scores.of(rival), scored):
                    ties.append(rival)
    return ties


def contract_id(name: str) -> str:
    """Id of the contract of a class of the comparison."""
    if shape_of(name) == DELAY and way_of(name) != "all":
        return _INPUT_MAP
    return _IDS.get(shape_of(name), shape_of(name))


def _in_contract_ids(answer: ClassAnswer) -> ClassAnswer:
    """Answer whose classes have the ids of the contract."""
    findings: dict[str, ClassFinding] = {}
    for finding in answer.classes:
        name = contract_id(finding.id)
        findings[name] = _joined(findings.get(name), replace(finding, id=name))
    ids = tuple(findings)
    ties = dict.fromkeys(_ids(names) for names in answer.ties)
    rivals: dict[str, float] = {}
    for rival, share in answer.rivals.items():
        name = contract_id(rival)
        if name not in ids:
            rivals[name] = max(share, rivals.get(name, -1.0))
    words = []
    for finding in answer.classes:
        shape, way = shape_of(finding.id), way_of(finding.id)
        words.append(_WORDS.get(finding.id, ""))
        if not words[-1] and shape in (GAIN, ZERO):
            words[-1] = f"{'gain' if shape == GAIN else 'zero'} of {way}"
        elif not words[-1] and way != SAME:
            words[-1] = "a law of its own in either bushing"
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
