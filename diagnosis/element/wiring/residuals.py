"""What a fitted set of effects leaves of every run of an element, sample by sample."""

import numpy as np

from carrierflex.diagnosis.comparison.problem import Effects, FloatArray
from carrierflex.diagnosis.element.problem import ElementProblem
from carrierflex.diagnosis.element.records import run_in_use
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.signals import even_time


def element_residuals(
    problem: ElementProblem, campaign: Campaign, effects: Effects, theta: FloatArray
) -> tuple[FloatArray, ...]:
    """Measured less predicted signal, brought from the even grid back to the run's own samples.

    Parameters
    ----------
    problem : ElementProblem
        Problem of the campaign.
    campaign : Campaign
        Its records.
    effects : tuple of str
        Effects beside the baseline.
    theta : ndarray, shape (p,)
        Parameters of the set.

    Returns
    -------
    tuple of ndarray, shape (n, 1)
        One a run; NaN outside the samples in use and where nothing was measured.
    """
    name = campaign.channels[0].name
    left = []
    for run, record in zip(campaign.runs, problem.records, strict=True):
        time = even_time(run_in_use(run).time)
        residual = record.response - problem.model.predicted(record, effects, theta)
        inside = np.interp(run.time, time, residual, left=np.nan, right=np.nan)
        left.append(np.where(np.isfinite(run.signals[name]), inside, np.nan)[:, None])
    return tuple(left)
