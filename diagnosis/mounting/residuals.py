"""What a fitted set of effects leaves of every run of a mounting, sample by sample."""

import numpy as np

from carrierflex.diagnosis.comparison.problem import Effects, FloatArray
from carrierflex.diagnosis.mounting.problem import MountingProblem
from carrierflex.diagnosis.mounting.records import unthinned_record
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run


def mounting_residuals(
    problem: MountingProblem, campaign: Campaign, effects: Effects, theta: FloatArray
) -> tuple[FloatArray, ...]:
    """Measured less predicted signals [m] at every sample: the problem holds means of groups.

    Parameters
    ----------
    problem : MountingProblem
        Problem of the campaign.
    campaign : Campaign
        Its records.
    effects : tuple of str
        Effects beside the baseline.
    theta : ndarray, shape (p,)
        Parameters of the set.

    Returns
    -------
    tuple of ndarray, shape (n, n_channels)
        One a run; NaN where nothing was measured.
    """
    return tuple(_residual(problem, campaign, run, effects, theta) for run in campaign.runs)


def _residual(
    problem: MountingProblem, campaign: Campaign, run: Run, effects: Effects, theta: FloatArray
) -> FloatArray:
    model = problem.model
    record = unthinned_record(run, campaign)
    predicted = model.predicted(record, effects, theta, problem.choice(effects))
    if model.held:
        # Effects change another simulator's prediction by what they change in the held bushings.
        held = model.predicted(record, (), np.array(model.held), {})
        own = np.column_stack([run.predictions[name] for name in model.channels])
        predicted = own + predicted - held
    return np.asarray(record.measured - predicted)
