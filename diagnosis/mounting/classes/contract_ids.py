"""Answer in the class ids of the campaign contract; what of a class it is goes into the note."""

from collections.abc import Iterable, Mapping
from dataclasses import replace

from carrierflex.diagnosis.classes.results import ClassAnswer, ClassFinding
from carrierflex.diagnosis.classes.shape_decision import shape_of, way_of
from carrierflex.diagnosis.mounting.classes.catalogue import (
    CHANGE,
    DELAY,
    EACH,
    FULL,
    GAIN,
    LOADS,
    SAME,
    STIFFNESS,
    ZERO,
)

STIFFNESS_MAP = "stiffness_map"
INPUT_MAP = "input_map"
SENSOR_MAP = "sensor_map"
TIME_VARIATION = "time_variation"
_IDS: Mapping[str, str] = {
    STIFFNESS: STIFFNESS_MAP,
    LOADS: INPUT_MAP,
    GAIN: SENSOR_MAP,
    ZERO: SENSOR_MAP,
    DELAY: SENSOR_MAP,
    CHANGE: TIME_VARIATION,
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


def contract_id(name: str) -> str:
    """Id of the contract of a class of the comparison."""
    if shape_of(name) == DELAY and way_of(name) != "all":
        return INPUT_MAP
    return _IDS.get(shape_of(name), shape_of(name))


def in_contract_ids(answer: ClassAnswer) -> ClassAnswer:
    """Answer whose classes have the ids of the contract.

    Classes of one id are one finding, whose share is the sum of theirs; the note says which of an
    id they are.
    """
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
