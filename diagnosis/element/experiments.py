"""Feasible drives of an element among which a separating one is sought."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from carrierflex.diagnosis.comparison.problem import Effects, FloatArray
from carrierflex.diagnosis.element.model import ElementModel
from carrierflex.diagnosis.element.records import ElementRecord, prepared_record
from carrierflex.diagnosis.kind.comparison_problem import CandidateExperiment, ComparisonProblem

_AMPLITUDES = (0.25, 0.5, 2.0)
_FREQUENCIES = (0.1, 0.5, 1.0, 2.0)
#: Samples and cycles of a trial record.
_SAMPLES = 4096
_CYCLES = 12
#: Plant with the response of a record measured, by a model of the record's step.
Measured = Callable[[ElementModel, ElementRecord], ComparisonProblem]


def element_experiments(
    model: ElementModel, records: Sequence[ElementRecord], measured: Measured
) -> tuple[CandidateExperiment, ...]:
    """Drives at other amplitudes and frequencies.

    The measured drive scaled, sines about the natural frequency.

    Parameters
    ----------
    model : ElementModel
        Parameters and scales of the element.
    records : sequence of ElementRecord
        What was measured.
    measured : callable
        ``(model, record) -> ComparisonProblem`` that holds that record alone.

    Returns
    -------
    tuple of CandidateExperiment
        Texts name amplitude and frequency.
    """
    if model.states:
        # A release is repeated from another deflection by hand: no drive is to be chosen.
        return ()
    largest = max(records, key=lambda record: float(record.drive.std()))
    mean, size = float(largest.drive.mean()), float(largest.drive.std())
    n = min(_SAMPLES, largest.drive.size)
    first = largest.drive.size - n
    candidate_experiments = [
        CandidateExperiment(
            f"the drive of run {largest.name} at {factor:g} times its amplitude",
            _builder(model, mean + factor * (largest.drive[first:] - mean), largest.step, measured),
        )
        for factor in _AMPLITUDES
    ]
    for frequency in _frequencies_hz(model):
        step = min(largest.step, 1.0 / (40.0 * frequency))
        time = step * np.arange(min(_SAMPLES, int(_CYCLES / (frequency * step))))
        for factor in (0.5, 1.0, 2.0):
            drive = mean + np.sqrt(2.0) * factor * size * np.sin(2.0 * np.pi * frequency * time)
            amplitude = np.sqrt(2.0) * factor * size
            unit = model.units[0 if model.by_force else 1]
            text = f"a steady sine of {frequency:.3g} Hz and amplitude {amplitude:.3g} {unit}"
            candidate_experiments.append(
                CandidateExperiment(text, _builder(model, drive, step, measured))
            )
    return tuple(candidate_experiments)


def _frequencies_hz(model: ElementModel) -> list[float]:
    """Frequencies about the natural one, or about the mean frequency of the motion."""
    scale = model.scale
    own = (
        np.sqrt(scale.K1 / scale.m)
        if scale.m > 0.0 and scale.K1 > 0.0
        else scale.speed / scale.deflection
    )
    return [float(factor * own / (2.0 * np.pi)) for factor in _FREQUENCIES]


def _builder(
    model: ElementModel, drive: FloatArray, step: float, measured: Measured
) -> Callable[[Effects, FloatArray], ComparisonProblem | None]:
    """ComparisonProblem under the drive, its response that of a model.

    The first quarter is for settling.
    """

    def build(effects: Effects, theta: FloatArray) -> ComparisonProblem | None:
        by_force = model.by_force
        counts = np.arange(drive.size) >= drive.size // 4
        blank = np.linspace(0.0, model.scale.deflection, drive.size)
        stepped = replace(model, substeps=model.scale.substeps(step))
        record = prepared_record(
            ("trial", "trial"), step, drive, blank, by_force=by_force, counts=counts
        )
        predicted = stepped.predicted(record, effects, theta)
        if not np.isfinite(predicted).all():
            return None
        record = prepared_record(
            ("trial", "trial"), step, drive, predicted, by_force=by_force, counts=counts
        )
        return measured(stepped, record)

    return build
