"""Feasible loads of the dynamometer among which a separating measurement is sought."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from carrierflex.diagnosis.comparison.problem import Effects, FloatArray
from carrierflex.diagnosis.kind.comparison_problem import CandidateExperiment, ComparisonProblem
from carrierflex.diagnosis.mounting.records import MountingRecord
from carrierflex.simulation.mounting.inputs import MountingInputs

_STEP, _LENGTH = 0.05, 120.0
#: Limits of the rig: 400 kN m (NREL/TP-5000-66594), 200 kN (table 2 of the 2012 paper).
_TORQUE, _LOAD = 4.0e5, 2.0e5
#: Plant whose only record has the signals of a model; None where the model leaves its range.
UnderLoads = Callable[[MountingRecord, Effects, FloatArray], ComparisonProblem | None]


def mounting_experiments(
    record: MountingRecord, under: UnderLoads
) -> tuple[CandidateExperiment, ...]:
    """Torque, vertical and sideways load alone, slow and fast, small and large.

    Torque beside a constant load.

    Parameters
    ----------
    record : MountingRecord
        A measured record, for its channels and steps.
    under : callable
        ``(record, effects, theta) -> ComparisonProblem`` whose only record has the signals of
        a model.

    Returns
    -------
    tuple of CandidateExperiment
        Texts name load, size and frequency.
    """
    time = _STEP * np.arange(round(_LENGTH / _STEP), dtype=np.float64)
    rise = np.asarray(np.clip((time - 5.0) / 10.0, 0.0, 1.0), dtype=np.float64)
    candidate_experiments = []
    for load, words, largest, unit in (
        ("torque", "torque", _TORQUE, "kN m"),
        ("ntl_z", "vertical load", _LOAD, "kN"),
        ("ntl_y", "sideways load", _LOAD, "kN"),
    ):
        for share in (0.25, 1.0):
            for frequency in (0.05, 1.0):
                values = share * largest * rise * np.sin(2.0 * np.pi * frequency * time)
                text = (
                    f"{words} alone, a sine of {frequency:g} Hz and {share * largest / 1e3:g} "
                    f"{unit}"
                )
                candidate_experiments.append(
                    CandidateExperiment(text, _builder(record, under, time, {load: values}))
                )
    wave = 0.5 * _TORQUE * rise * (1.0 + 0.5 * np.sin(np.pi * time))
    for load, words in (("ntl_z", "vertical"), ("ntl_y", "sideways")):
        text = (
            f"torque of 200 kN m with a sine of 0.5 Hz and 100 kN m beside a constant {words} "
            "load of 200 kN"
        )
        candidate_experiments.append(
            CandidateExperiment(
                text, _builder(record, under, time, {"torque": wave, load: _LOAD * rise})
            )
        )
    return tuple(candidate_experiments)


def _builder(
    record: MountingRecord, under: UnderLoads, time: FloatArray, loads: dict[str, FloatArray]
) -> Callable[[Effects, FloatArray], ComparisonProblem | None]:
    """ComparisonProblem under the loads, its signals those of a model."""

    def build(effects: Effects, theta: FloatArray) -> ComparisonProblem | None:
        still = {
            name: np.zeros(time.size)
            for name in ("torque", "speed", "carrier_angle", "ntl_y", "ntl_z")
        }
        blank = replace(
            record,
            name="trial",
            condition="trial",
            inputs=MountingInputs.from_columns(time, {**still, **loads}),
            measured=np.zeros((time.size, record.measured.shape[1])),
            block=np.arange(time.size) * 4 // time.size,
        )
        return under(blank, effects, theta)

    return build
