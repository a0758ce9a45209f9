"""Loads that the dynamometer could apply: trials of the diagnosis, additions of a plan."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from carrierflex.diagnosis.comparison.problem import Effects, FloatArray
from carrierflex.diagnosis.kind.comparison_problem import CandidateExperiment, ComparisonProblem
from carrierflex.diagnosis.mounting.records import MountingRecord
from carrierflex.simulation.mounting.inputs import MountingInputs

#: Step and length of a record [s].
STEP, LENGTH = 0.05, 120.0
_FREQUENCIES = (0.05, 1.0)
_SHARES = (0.25, 1.0)
#: Limits of the rig: 400 kN m (NREL/TP-5000-66594), 200 kN (table 2 of the 2012 paper).
_TORQUE, _LOAD = 4.0e5, 2.0e5
_BLOCKS = 4
#: Problem whose only record has the signals of a model; None where the model leaves its range.
UnderLoads = Callable[[MountingRecord, Effects, FloatArray], ComparisonProblem | None]


def trial_loads(
    torque: float, radial_load: float, shares: Sequence[float]
) -> tuple[FloatArray, dict[str, Mapping[str, FloatArray]]]:
    """Time [s], and loads by their text, up to a torque [N m] and a radial load [N].

    Torque, vertical and sideways load alone as a slow and a fast sine of some shares of the limit;
    torque with a sine beside a constant load.
    """
    time = STEP * np.arange(round(LENGTH / STEP), dtype=np.float64)
    rise = np.asarray(np.clip((time - 5.0) / 10.0, 0.0, 1.0), dtype=np.float64)
    loads: dict[str, Mapping[str, FloatArray]] = {}
    for name, words, largest, unit in (
        ("torque", "torque", torque, "kN m"),
        ("ntl_z", "vertical load", radial_load, "kN"),
        ("ntl_y", "sideways load", radial_load, "kN"),
    ):
        for share in shares:
            for frequency in _FREQUENCIES:
                size = f"{share * largest / 1e3:g} {unit}"
                text = f"{words} alone, a sine of {frequency:g} Hz and {size}"
                wave = share * largest * rise * np.sin(2.0 * np.pi * frequency * time)
                loads[text] = {name: wave}
    wave = 0.5 * torque * rise * (1.0 + 0.5 * np.sin(np.pi * time))
    for name, words in (("ntl_z", "vertical"), ("ntl_y", "sideways")):
        text = (
            f"torque of {0.5 * torque / 1e3:g} kN m with a sine of 0.5 Hz and "
            f"{0.25 * torque / 1e3:g} kN m beside a constant {words} load of "
            f"{radial_load / 1e3:g} kN"
        )
        loads[text] = {"torque": wave, name: radial_load * rise}
    return time, loads


def blank_record(
    record: MountingRecord, name: str, time: FloatArray, loads: Mapping[str, FloatArray]
) -> MountingRecord:
    """Record under some loads without signals."""
    names = ("torque", "speed", "carrier_angle", "ntl_y", "ntl_z")
    columns = {load: loads.get(load, np.zeros(time.size)) for load in names}
    return replace(
        record,
        name=name,
        condition=name,
        inputs=MountingInputs.from_columns(time, columns),
        measured=np.zeros((time.size, record.measured.shape[1])),
        block=np.arange(time.size) * _BLOCKS // time.size,
    )


def mounting_experiments(
    record: MountingRecord, under: UnderLoads
) -> tuple[CandidateExperiment, ...]:
    """Feasible loads of the dynamometer, with the channels and the noise of a measured record."""
    time, loads = trial_loads(_TORQUE, _LOAD, _SHARES)
    return tuple(
        CandidateExperiment(text, _builder(blank_record(record, "trial", time, columns), under))
        for text, columns in loads.items()
    )


def _builder(
    blank: MountingRecord, under: UnderLoads
) -> Callable[[Effects, FloatArray], ComparisonProblem | None]:
    return lambda effects, theta: under(blank, effects, theta)
