"""What can be tried of an element's wiring, and its records beside their baseline."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.element.problem import ElementProblem, element_problem
from carrierflex.diagnosis.element.records import ElementRecord
from carrierflex.diagnosis.inference.effect_fit import baseline_left
from carrierflex.diagnosis.wiring.linear_records import LinearRecord
from carrierflex.diagnosis.wiring.rivals import TORQUE_SIGN, PredictedRecord, WiringRival
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign_check.campaign_warning import sample_of

FloatArray = NDArray[np.float64]


def element_rivals(campaign: Campaign) -> tuple[WiringRival, ...]:
    """Baseline refitted with the drive of the other sign.

    Parameters
    ----------
    campaign : Campaign
        Records whose baseline is the model.
    """
    if not campaign.contract.inputs:
        return ()
    name = next(iter(campaign.contract.inputs))
    runs = tuple(
        replace(run, inputs={**run.inputs, name: -run.inputs[name]}) for run in campaign.runs
    )
    left = element_left(replace(campaign, runs=runs))
    place = sample_of(campaign.runs[0].file, 0)
    rival = WiringRival(TORQUE_SIGN, name, f"'{name}' of the other sign", left, place)
    return (rival,) if np.isfinite(left) else ()


def element_left(campaign: Campaign) -> float:
    """Mean square that the baseline leaves once it is fitted to a campaign."""
    return baseline_left(element_problem(campaign))


def element_predictions(problem: ElementProblem, theta: FloatArray) -> tuple[PredictedRecord, ...]:
    """Every run beside its fitted baseline; NaN where samples do not count."""
    return tuple(
        PredictedRecord(
            record.name,
            _time(record),
            np.where(record.block >= 0, record.response, np.nan)[:, None],
            problem.model.predicted(record, (), theta)[:, None],
        )
        for record in problem.records
    )


def element_linear(problem: ElementProblem, theta: FloatArray) -> Iterator[LinearRecord]:
    """Every run beside its baseline, and the slopes of that by its parameters.

    Parameters
    ----------
    problem : ElementProblem
        Campaign.
    theta : ndarray, shape (p,)
        Fitted parameters of the baseline.

    Yields
    ------
    LinearRecord
        One a run.
    """
    slopes = problem.differenced(()).slopes(theta)
    for record, (residual, columns) in zip(problem.records, slopes, strict=True):
        time = _time(record)
        predicted = problem.model.predicted(record, (), theta)
        missed = np.where(record.block >= 0, residual, np.nan)
        yield LinearRecord(
            record.name, time, missed[:, None], predicted[:, None], columns[:, :, None]
        )


def _time(record: ElementRecord) -> FloatArray:
    return np.asarray(record.step * np.arange(record.response.size), dtype=np.float64)
