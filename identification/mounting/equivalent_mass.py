"""Mass of the dynamometer's coupling and its lever, from bending moments of the main shaft.

The 2011 paper's identification (section 3): weight turns through the shaft's axes once a
revolution. One section knows ``m g (arm - section)`` alone; a radial load that changes, or a second
section, parts mass and arm.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_kinds import BENDING
from carrierflex.identification.campaign.declarations import Channel, InputSignal
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.carrier.parameter_estimate import SHARED, ParameterEstimate
from carrierflex.identification.estimation.fit_uncertainty import FitUncertainty, fit_uncertainty
from carrierflex.identification.estimation.nonlinear_fit import NonlinearFit, bounded_fit
from carrierflex.simulation.fit_parameter import FitParameter
from carrierflex.simulation.mounting.shaft_bending import EquivalentMass, shaft_bending
from carrierflex.simulation.stage.stage_data import GRAVITY

Array = NDArray[np.float64]

#: Name of the model on the command line.
EQUIVALENT_MASS = "equivalent_mass"
#: Largest angle between the gauges' axes and the shaft's [rad].
_LARGEST_TURN = 0.5
#: Standard deviation that stands for an undeclared noise [N m]: only its being equal counts.
_ALIKE = 1e3


@dataclass(frozen=True, eq=False)
class BendingResiduals:
    """Residuals of all moment channels, run after run, for mass, arm and one angle a section.

    Constant errors of a channel are free in every run: both sides are taken without their mean.

    Parameters
    ----------
    campaign : Campaign
        Campaign with moment channels alone.
    sections : tuple of float
        Different sections [m], the order of the angles among the unknowns.
    mass : float, optional
        Mass that is known [kg].
    """

    campaign: Campaign
    sections: tuple[float, ...]
    mass: float | None = None

    @property
    def free(self) -> tuple[FitParameter, ...]:
        """Unknowns: mass [kg] unless it is known, arm [m], angle of each section's gauges [rad]."""
        known = self.mass is not None
        names = [f"gauge_angle_{k}" for k in range(1, len(self.sections) + 1)]
        return (
            *(() if known else (FitParameter("mass", "kg", 1.0, 1e6, 1e3),)),
            FitParameter("arm", "m", max(self.sections) + 1e-3, 50.0, 1.0),
            *(FitParameter(name, "rad", -_LARGEST_TURN, _LARGEST_TURN, 0.01) for name in names),
        )

    def moments(self, values: Array, run: str) -> dict[str, Array]:
        """Moments of a run by channel [N m], of unknowns in the order of `free`."""
        mass, (arm, *turns) = (
            (self.mass, values) if self.mass is not None else (values[0], values[1:])
        )
        inputs = next(entry.inputs for entry in self.campaign.runs if entry.name == run)
        of, predicted = EquivalentMass(float(mass), float(arm)), {}
        for section, turn in zip(self.sections, turns, strict=True):
            angle = inputs["carrier_angle"] + turn
            pair = shaft_bending(of, section, angle, inputs["ntl_y"], inputs["ntl_z"])
            for channel in self.campaign.channels:
                if channel.section == section:
                    predicted[channel.name] = pair[:, "yz".index(str(channel.axis))]
        return predicted

    def gaps(self, values: Array) -> dict[str, dict[str, Array]]:
        """Measured less predicted moments without their mean [N m], by run and channel."""
        gaps: dict[str, dict[str, Array]] = {}
        for run in self.campaign.runs:
            predicted = self.moments(values, run.name)
            gaps[run.name] = {}
            for name, moment in predicted.items():
                gap = run.signals[name] - moment
                gaps[run.name][name] = gap - np.nanmean(gap)
        return gaps

    def __call__(self, values: Array) -> Array:
        """Residuals in standard deviations of the noise; missing samples are zero."""
        noise = {channel.name: channel.noise_std or _ALIKE for channel in self.campaign.channels}
        return np.concatenate(
            [
                np.nan_to_num(gap / noise[name])
                for of_run in self.gaps(values).values()
                for name, gap in of_run.items()
            ]
        )

    def blocks(self) -> NDArray[np.int64]:
        """Revolution of every residual; those of different runs differ."""
        numbers, first = [], 0
        for run in self.campaign.runs:
            angle = run.inputs["carrier_angle"]
            turn = np.abs((angle - angle[0]) // (2.0 * np.pi)).astype(np.int64)
            numbers.append(np.tile(first + turn, len(self.campaign.channels)))
            first += int(turn.max()) + 1
        return np.concatenate(numbers)


def _bending_channels(campaign: Campaign) -> tuple[Channel, ...]:
    """Moment channels of a campaign."""
    if campaign.kind != "mounting":
        raise ValueError(
            f"campaign '{campaign.name}' is of kind {campaign.kind}; model {EQUIVALENT_MASS} "
            "serves kind mounting only"
        )
    channels = campaign.channels_of(BENDING)
    if not channels:
        raise ValueError(
            f"campaign '{campaign.name}' has no channel of quantity {BENDING}; expected M_y and "
            "M_z of the main shaft, with the keys 'axis' and 'section_m'"
        )
    return channels


def bending_residuals(campaign: Campaign, mass: float | None = None) -> BendingResiduals:
    """Residuals of a campaign with bending moments; arguments and errors as of the fit."""
    channels = _bending_channels(campaign)
    names = [channel.name for channel in channels]
    runs = tuple(run.of_channels(names) for run in campaign.within_use().runs)
    sections = tuple(sorted({float(channel.section or 0.0) for channel in channels}))
    return BendingResiduals(replace(campaign, channels=channels, runs=runs), sections, mass)


def identify_equivalent_mass(campaign: Campaign, *, mass: float | None = None) -> ParameterEstimate:
    """Mass of the coupling and its distance upwind of the main bearing.

    Least squares over all sections; errors by the delete-one-revolution jackknife, and by the
    declared errors of gains of channels and radial loads.

    Parameters
    ----------
    campaign : Campaign
        Campaign of kind ``mounting`` with channels of bending moments.
    mass : float, optional
        Mass where it is known [kg]; the arm alone is then found.

    Returns
    -------
    ParameterEstimate
        ``mass`` [kg], ``arm`` [m], and by section the angle of its gauges [rad].

    Raises
    ------
    ValueError
        Where the campaign has no such channels, fewer than three revolutions, or `mass` is not
        positive.
    """
    if mass is not None and not (np.isfinite(mass) and mass > 0.0):
        raise ValueError(f"known mass is {mass} kg; expected a positive number")
    residuals = bending_residuals(campaign, mass)
    fit = _fitted(residuals)
    blocks = residuals.blocks()
    if len(np.unique(blocks)) < 3:
        raise ValueError(
            f"campaign '{campaign.name}' has {len(np.unique(blocks))} revolutions of the shaft; "
            "expected 3 or more for an error estimate"
        )
    uncertainty = fit_uncertainty(fit, blocks)
    covariance = uncertainty.covariance
    if not uncertainty.undetermined:
        for moved in _moved_by_gains(residuals, fit):
            covariance = covariance + np.outer(moved, moved)
    return _estimate(residuals, fit, uncertainty, covariance)


def _fitted(residuals: BendingResiduals) -> NonlinearFit:
    free = residuals.free
    start = [
        {"mass": 1e3, "arm": max(residuals.sections) + 1.0}.get(entry.name, 0.0) for entry in free
    ]
    return bounded_fit(residuals, free, np.array(start))


def _moved_by_gains(residuals: BendingResiduals, fit: NonlinearFit) -> list[Array]:
    """What one standard deviation of each declared gain makes of the unknowns."""
    campaign, moved = residuals.campaign, []
    inputs = [campaign.input_of(name) for name in ("ntl_y", "ntl_z")]
    declared: list[Channel | InputSignal] = [*campaign.channels, *inputs]
    for signal in declared:
        if signal.gain_std:
            runs = tuple(_divided(run, signal.name, 1.0 + signal.gain_std) for run in campaign.runs)
            other = replace(residuals, campaign=replace(campaign, runs=runs))
            moved.append(_fitted(other).values - fit.values)
    return moved


def _divided(run: Run, name: str, factor: float) -> Run:
    """Copy of a run with one of its columns divided by a factor."""
    if name in run.inputs:
        return replace(run, inputs={**run.inputs, name: run.inputs[name] / factor})
    return run.with_signals({**run.signals, name: run.signals[name] / factor})


def _estimate(
    residuals: BendingResiduals,
    fit: NonlinearFit,
    uncertainty: FitUncertainty,
    covariance: Array,
) -> ParameterEstimate:
    gaps = residuals.gaps(fit.values)

    def rms(of_run: Mapping[str, Array]) -> float:
        return float(np.sqrt(np.nanmean(np.concatenate(list(of_run.values())) ** 2)))

    by_channel = {
        run: {name: rms({name: gap}) for name, gap in of_run.items()}
        for run, of_run in gaps.items()
    }
    every = {f"{run} {name}": gap for run, of_run in gaps.items() for name, gap in of_run.items()}
    undetermined = uncertainty.undetermined
    if undetermined:
        known = fit.by_name()
        section = residuals.sections[0]
        moment = known["mass"] * GRAVITY * (known["arm"] - section)
        undetermined = (
            f"mass and arm are not determined one by one: one section under a constant radial load "
            f"knows m g (arm - {section:g} m) = {moment / 1e3:.4g} kN m; give --mass, a second "
            "section, or a run with another radial load",
        )
    return ParameterEstimate(
        model=EQUIVALENT_MASS,
        names=fit.names,
        scopes=(SHARED,) * len(fit.free),
        units=tuple(entry.unit for entry in fit.free),
        values=fit.values,
        covariance=covariance,
        covariance_source="jackknife over revolutions, declared gains",
        confidence_factor=np.full(len(fit.free), uncertainty.confidence_factor),
        rms=rms(every),
        rms_by_run={run: rms(of_run) for run, of_run in gaps.items()},
        rms_by_channel=by_channel,
        condition_number=float(np.linalg.cond(fit.jacobian)),
        undetermined=undetermined,
        n_samples=sum(int(np.isfinite(gap).sum()) for gap in every.values()),
        n_revolutions={
            run.name: int(np.ptp(run.inputs["carrier_angle"]) // (2.0 * np.pi))
            for run in residuals.campaign.runs
        },
        run_coefficients={},
    )
