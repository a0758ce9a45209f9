"""Identification of the carrier's motion: models M1 and M2 fitted run by run or jointly, in closed form."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification.campaign import Campaign, Channel
from identification.carrier_models import CarrierModel
from identification.least_squares import joint_fit
from identification.normal_equations import normal_equations
from identification.parameter_estimate import ParameterEstimate, parameter_estimate
from identification.records import Run
from identification.revolutions import whole_revolutions
from identification.scatter_of_runs import with_scatter_of_runs
from simulation.run_cases import AXIAL


def axial_channels(campaign: Campaign) -> tuple[Channel, ...]:
    """Axial rim sensors of a carrier campaign.

    Raises
    ------
    ValueError
        Where the campaign is of another kind or has no axial channel.
    """
    if campaign.kind != "carrier":
        raise ValueError(
            f"campaign '{campaign.name}' is of kind {campaign.kind}; models m1 and m2 serve kind carrier only"
        )
    channels = campaign.channels_of(AXIAL)
    if not channels:
        raise ValueError(f"campaign '{campaign.name}' has no channel of quantity {AXIAL}; expected at least one")
    return channels


def identify_jointly(campaign: Campaign, model: CarrierModel) -> ParameterEstimate:
    """Fit one model to all runs at once; shared parameters get one value.

    Parameters
    ----------
    campaign : Campaign
        Campaign of kind ``carrier``.
    model : CarrierModel
        :func:`~identification.carrier_models.rigid_model`, ``flexible_model`` or another list of effects.

    Returns
    -------
    ParameterEstimate
        Shared parameters and those of every run.

    Raises
    ------
    ValueError
        Where the campaign is of another kind, or a run is shorter than one revolution.

    References
    ----------
    .. [1] 2012 paper, section 2.3. Its five parameters need no search: equations (1) and (7) are linear in d_x, the
       two components of each tilt, rho_s and rho_f.
    """
    return _identify(campaign.runs, axial_channels(campaign), model)


def identify_each_run(campaign: Campaign, model: CarrierModel) -> dict[str, ParameterEstimate]:
    """Fit one model to every run by itself, the way of the papers.

    Parameters
    ----------
    campaign : Campaign
        Campaign of kind ``carrier``.
    model : CarrierModel
        Model; every parameter becomes one of the run.

    Returns
    -------
    dict of str to ParameterEstimate
        Estimate by run name.

    Raises
    ------
    ValueError
        As :func:`identify_jointly`.
    """
    own = CarrierModel(model.name, tuple(effect.each_run() for effect in model.effects))
    channels = axial_channels(campaign)
    return {run.name: _identify((run,), channels, own) for run in campaign.runs}


def _identify(runs: Sequence[Run], channels: Sequence[Channel], model: CarrierModel) -> ParameterEstimate:
    equations = [normal_equations(run, channels, model) for run in runs]
    fit = with_scatter_of_runs(joint_fit(equations, model.shared), equations, model.shared)
    return parameter_estimate(model, equations, fit)


def fitted_signal(run: Run, channel: Channel, model: CarrierModel, estimate: ParameterEstimate) -> NDArray[np.float64]:
    """Signal of one channel by the identified model.

    Parameters
    ----------
    run : Run
        Record that drives the model.
    channel : Channel
        Axial channel.
    model : CarrierModel
        Model.
    estimate : ParameterEstimate
        Its parameters.

    Returns
    -------
    ndarray, shape (n,)
        Displacement [m] over the whole record.
    """
    return model.design(run.inputs, channel) @ estimate.run_coefficients[run.name]


def residual_signal(
    run: Run, channel: Channel, model: CarrierModel, estimate: ParameterEstimate
) -> NDArray[np.float64]:
    """Measurement minus identified model [m], shape (n,); NaN where the sample is missing."""
    return run.signals[channel.name] - fitted_signal(run, channel, model, estimate)


def two_revolutions(run: Run) -> NDArray[np.int64]:
    """Sample numbers of the first two whole revolutions, or of the only one."""
    return np.sort(np.concatenate(whole_revolutions(run).samples[:2]))
