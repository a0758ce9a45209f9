"""Feasible drives of an element among which a separating one is sought."""

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from carrierflex.diagnosis.comparison.problem import CandidateExperiment, Effects, FloatArray
from carrierflex.diagnosis.element.model import substeps_for
from carrierflex.diagnosis.element.records import prepared_record

if TYPE_CHECKING:
    from carrierflex.diagnosis.element.problem import ElementProblem

_AMPLITUDES = (0.25, 0.5, 2.0)
_FREQUENCIES = (0.1, 0.5, 1.0, 2.0)
#: Samples and cycles of a trial record.
_SAMPLES = 4096
_CYCLES = 12


def element_experiments(problem: "ElementPlant") -> tuple[CandidateExperiment, ...]:
    """Drives at other amplitudes and frequencies.

    The measured drive scaled, sines about the natural frequency.

    Parameters
    ----------
    problem : ElementProblem
        What was measured.

    Returns
    -------
    tuple of CandidateExperiment
        Texts name amplitude and frequency.
    """
    largest = max(problem.records, key=lambda record: float(record.drive.std()))
    mean, size = float(largest.drive.mean()), float(largest.drive.std())
    n = min(_SAMPLES, largest.drive.size)
    first = largest.drive.size - n
    candidate_experiments = [
        CandidateExperiment(
            f"the drive of run {largest.name} at {factor:g} times its amplitude",
            _builder(problem, mean + factor * (largest.drive[first:] - mean), largest.step),
        )
        for factor in _AMPLITUDES
    ]
    for frequency in _frequencies_hz(problem):
        step = min(largest.step, 1.0 / (40.0 * frequency))
        time = step * np.arange(min(_SAMPLES, int(_CYCLES / (frequency * step))))
        for factor in (0.5, 1.0, 2.0):
            drive = mean + np.sqrt(2.0) * factor * size * np.sin(2.0 * np.pi * frequency * time)
            amplitude = np.sqrt(2.0) * factor * size
            text = f"a steady sine of {frequency:.3g} Hz and amplitude {amplitude:.3g} {problem.model.units[_drive(problem)]}"
            candidate_experiments.append(CandidateExperiment(text, _builder(problem, drive, step)))
    return tuple(candidate_experiments)


def _drive(problem: "ElementPlant") -> int:
    return 0 if problem.model.by_force else 1


def _frequencies_hz(problem: "ElementPlant") -> list[float]:
    """Frequencies about the natural one, or about the mean frequency of the motion."""
    scale = problem.model.scale
    own = (
        np.sqrt(scale.K1 / scale.m)
        if scale.m > 0.0 and scale.K1 > 0.0
        else scale.speed / scale.deflection
    )
    return [float(factor * own / (2.0 * np.pi)) for factor in _FREQUENCIES]


def _builder(
    problem: "ElementPlant", drive: FloatArray, step: float
) -> Callable[[Effects, FloatArray], "ElementPlant | None"]:
    """ComparisonProblem under the drive, its response that of a model; the first quarter is left to settle."""

    def build(effects: Effects, theta: FloatArray) -> "ElementPlant | None":
        by_force = problem.model.by_force
        counts = np.arange(drive.size) >= drive.size // 4
        blank = np.linspace(0.0, problem.model.scale.deflection, drive.size)
        model = replace(problem.model, substeps=substeps_for(problem.model.scale, step))
        record = prepared_record(
            ("trial", "trial"), step, drive, blank, by_force=by_force, counts=counts
        )
        predicted = model.predicted(record, effects, theta)
        if not np.isfinite(predicted).all():
            return None
        record = prepared_record(
            ("trial", "trial"), step, drive, predicted, by_force=by_force, counts=counts
        )
        return replace(problem, model=model, records=(record,), noise=problem.noise[:1])

    return build
