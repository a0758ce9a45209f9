"""Identification of the carrier's motion.

Models M1 and M2 fitted run by run or jointly, in closed form.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.revolutions import whole_revolutions
from carrierflex.identification.carrier.models import CarrierModel
from carrierflex.identification.carrier.parameter_estimate import (
    ParameterEstimate,
    parameter_estimate,
    with_residuals_of,
)
from carrierflex.identification.carrier.robust_loss import huber_equations
from carrierflex.identification.estimation.block_bootstrap import FEWEST_SAMPLES, with_bootstrap
from carrierflex.identification.estimation.least_squares import joint_fit
from carrierflex.identification.estimation.normal_equations import NormalEquations, normal_equations
from carrierflex.identification.estimation.scatter_of_runs import with_scatter_of_runs
from carrierflex.simulation.carrier.run_cases import AXIAL, RADIAL


def axial_channels(campaign: Campaign) -> tuple[Channel, ...]:
    """Axial rim sensors of a carrier campaign.

    Raises
    ------
    ValueError
        Where the campaign is of another kind or has no axial channel.
    """
    if campaign.kind != "carrier":
        raise ValueError(
            f"campaign '{campaign.name}' is of kind {campaign.kind}; models m1 and m2 serve kind "
            "carrier only"
        )
    channels = campaign.channels_of(AXIAL)
    if not channels:
        raise ValueError(
            f"campaign '{campaign.name}' has no channel of quantity {AXIAL}; expected at least one"
        )
    return channels


def rim_channels(campaign: Campaign) -> tuple[Channel, ...]:
    """Axial and radial rim sensors of a carrier campaign.

    Refuses what :func:`axial_channels` refuses.
    """
    return (*axial_channels(campaign), *campaign.channels_of(RADIAL))


@dataclass(frozen=True)
class FitOptions:
    """How a model is fitted.

    Parameters
    ----------
    radial : bool
        Fit the radial sensors too; the model then needs their motion
        (:func:`~carrierflex.identification.carrier.models.with_radial_motion`).
    huber : bool
        Huber's loss instead of squares: outliers count linearly.
    bootstrap : int
        Samples of the block bootstrap over revolutions that gives the covariance; 0: the jackknife.
    seed : int
        Of the bootstrap.

    Raises
    ------
    ValueError
        Where the number of samples is negative, or too small for a covariance.
    """

    radial: bool = False
    huber: bool = False
    bootstrap: int = 0
    seed: int = 0

    def __post_init__(self) -> None:
        if self.bootstrap < 0 or 0 < self.bootstrap < FEWEST_SAMPLES:
            raise ValueError(
                f"bootstrap is {self.bootstrap} samples; expected 0 (none) or at least "
                f"{FEWEST_SAMPLES}"
            )


#: Axial sensors, squared residuals, jackknife: the papers' way.
LEAST_SQUARES = FitOptions()


def identify_jointly(
    campaign: Campaign, model: CarrierModel, options: FitOptions = LEAST_SQUARES
) -> ParameterEstimate:
    """Fit one model to all runs at once; shared parameters get one value.

    Parameters
    ----------
    campaign : Campaign
        Campaign of kind ``carrier``.
    model : CarrierModel
        :func:`~carrierflex.identification.carrier.models.rigid_model`, ``flexible_model`` or
        another list of effects.
    options : FitOptions
        Sensors, loss and source of the covariance.

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
    .. [1] 2012 paper, section 2.3. Its five parameters need no search: equations (1) and (7) are
       linear in d_x, the two components of each tilt, rho_s and rho_f.
    """
    runs = campaign.within_use().runs
    return _identify(runs, _fitted_channels(campaign, options), model, options)


def identify_each_run(
    campaign: Campaign,
    model: CarrierModel,
    options: FitOptions = LEAST_SQUARES,
) -> dict[str, ParameterEstimate]:
    """Fit one model to every run by itself, the way of the papers.

    Parameters
    ----------
    campaign : Campaign
        Campaign of kind ``carrier``.
    model : CarrierModel
        Model; every parameter becomes one of the run.
    options : FitOptions
        Sensors, loss and source of the covariance.

    Returns
    -------
    dict of str to ParameterEstimate
        Estimate by run name.

    Raises
    ------
    ValueError
        As :func:`identify_jointly`.
    """
    each_run = model.each_run()
    channels = _fitted_channels(campaign, options)
    runs = campaign.within_use().runs
    return {run.name: _identify((run,), channels, each_run, options) for run in runs}


def identify_from_sums(
    equations: Sequence[NormalEquations],
    model: CarrierModel,
    options: FitOptions = LEAST_SQUARES,
) -> ParameterEstimate:
    """Solve a model from the sums of its runs, as a long record that is read in pieces leaves them.

    Parameters
    ----------
    equations : sequence of NormalEquations
        One for each run, of `model`.
    model : CarrierModel
        Model.
    options : FitOptions
        Source of the covariance; sensors and loss were decided with the sums.

    Returns
    -------
    ParameterEstimate
        Shared parameters and those of every run.
    """
    if options.bootstrap:
        rng = np.random.default_rng(options.seed)
        fit = with_bootstrap(joint_fit(equations, model.shared), equations, options.bootstrap, rng)
    else:
        fit = with_scatter_of_runs(joint_fit(equations, model.shared), equations, model.shared)
    return parameter_estimate(model, equations, fit)


def _fitted_channels(campaign: Campaign, options: FitOptions) -> tuple[Channel, ...]:
    return rim_channels(campaign) if options.radial else axial_channels(campaign)


def fitted_equations(
    campaign: Campaign, model: CarrierModel, options: FitOptions
) -> list[NormalEquations]:
    """Sums of every run for the sensors and the loss that the options ask for."""
    channels = _fitted_channels(campaign, options)
    runs = campaign.within_use().runs
    if options.huber:
        return huber_equations(runs, channels, model)
    return [normal_equations(run, channels, model) for run in runs]


def _identify(
    runs: Sequence[Run], channels: Sequence[Channel], model: CarrierModel, options: FitOptions
) -> ParameterEstimate:
    if options.huber:
        weighted = huber_equations(runs, channels, model)
        estimate = identify_from_sums(weighted, model, options)
        # The RMS is that of all samples, outliers included, whatever weight they had in the fit.
        return with_residuals_of(estimate, [normal_equations(run, channels, model) for run in runs])
    return identify_from_sums(
        [normal_equations(run, channels, model) for run in runs], model, options
    )


def fitted_signal(
    run: Run, channel: Channel, model: CarrierModel, estimate: ParameterEstimate
) -> NDArray[np.float64]:
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
