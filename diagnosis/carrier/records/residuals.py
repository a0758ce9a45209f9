"""What a fitted set of effects leaves of every run of a carrier, sample by sample."""

from carrierflex.diagnosis.carrier.problem import CarrierProblem
from carrierflex.diagnosis.carrier.records.combinations import residual_weights, signals_of
from carrierflex.diagnosis.comparison.problem import Effects, FloatArray


def carrier_residuals(
    problem: CarrierProblem, effects: Effects, theta: FloatArray
) -> tuple[FloatArray, ...]:
    """Measured less predicted signals [m], without what was found beside the orders.

    Parameters
    ----------
    problem : CarrierProblem
        Campaign.
    effects : tuple of str
        Effects beside the baseline.
    theta : ndarray, shape (p,)
        Parameters of the set.

    Returns
    -------
    tuple of ndarray, shape (n, n_channels)
        One a run; NaN outside whole revolutions and where nothing was measured.
    """
    columns, values = problem.values(effects, theta)
    weights = residual_weights(values)
    return signals_of(problem.records, problem.campaign, problem.model.source, columns, weights)
