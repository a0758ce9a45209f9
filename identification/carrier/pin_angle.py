"""Free pin angle theta_rho.

The one parameter of M2 that is not linear, found by variable projection.

For every theta_rho the other parameters are a closed-form fit; what is left is a search in one
variable. At its end the derivative of the deflection by theta_rho joins the design, so that errors
and correlations know of it.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.carrier.carrier_identification import (
    FitOptions,
    fitted_equations,
    identify_from_sums,
)
from carrierflex.identification.carrier.models import (
    CarrierModel,
    flexible_model,
    with_radial_motion,
)
from carrierflex.identification.carrier.parameter_estimate import ParameterEstimate
from carrierflex.identification.estimation.least_squares import joint_fit
from carrierflex.simulation.carrier.effect import Effect
from carrierflex.simulation.carrier.effects.deflection import FLEXIBLE_PINS, STIFF_PINS
from carrierflex.simulation.carrier.rim import CarrierInputs, CarrierRig, FloatArray, RimSensor
from carrierflex.simulation.effect_parameters import EffectParameter

#: Grid of first guesses, and step of the derivative [rad].
_GUESSES = 12
_STEP = 1e-5
_TOLERANCE = 1e-7
#: A scale that is zero in truth may come out this much below zero, as a share of the other.
_SIGN_MARGIN = 0.1
#: M2 at the pin angle found, the derivative by it as a further term, and its parameters.
PinAngleFit = tuple[CarrierModel, ParameterEstimate]


def identify_with_pin_angle(
    campaign: Campaign,
    delta_s: DeflectionCurve,
    delta_f: DeflectionCurve,
    options: FitOptions,
    *,
    per_run: bool = False,
) -> dict[str, PinAngleFit]:
    """Fit M2 with the pin angle free.

    Parameters
    ----------
    campaign : Campaign
        Campaign of kind ``carrier``.
    delta_s, delta_f : DeflectionCurve
        Stiff and flexible curve.
    options : FitOptions
        Sensors, loss and source of the covariance.
    per_run : bool
        Fit every run by itself.

    Returns
    -------
    dict of str to tuple of CarrierModel and ParameterEstimate
        Fit by run, one for all where they are fitted jointly; ``theta_rho`` [rad] within half
        the angle from pin to pin, +-60 deg of three.

    Raises
    ------
    ValueError
        As :func:`~carrierflex.identification.carrier.carrier_identification.identify_jointly`.
    """

    def fitted(runs: Sequence[Run]) -> PinAngleFit:
        return _identified(
            replace(campaign, runs=tuple(runs)), delta_s, delta_f, options, per_run=per_run
        )

    if per_run:
        return {run.name: fitted([run]) for run in campaign.runs}
    return dict.fromkeys([run.name for run in campaign.runs], fitted(campaign.runs))


def _identified(
    campaign: Campaign,
    delta_s: DeflectionCurve,
    delta_f: DeflectionCurve,
    options: FitOptions,
    *,
    per_run: bool,
) -> PinAngleFit:
    def model(pin_angle: float) -> CarrierModel:
        at_angle = flexible_model(delta_s, delta_f, pin_angle)
        at_angle = with_radial_motion(at_angle) if options.radial else at_angle
        return at_angle.each_run() if per_run else at_angle

    def projected(pin_angle: float) -> tuple[float, dict[str, float]]:
        """Cost and parameters by name, the other coefficients at their least squares."""
        trial = model(float(pin_angle))
        equations = fitted_equations(campaign, trial, options)
        fit = joint_fit(equations, trial.shared)
        cost = sum(
            float(run.squared_error(fit.run_coefficients(k)).sum())
            for k, run in enumerate(equations)
        )
        return cost, dict(zip(trial.coefficients, fit.run_coefficients(0), strict=True))

    n_planets = int(campaign.rig["n_planets"])
    angle = _searched(projected, 2.0 * np.pi / n_planets)
    best, (_, scales) = model(angle), projected(angle)
    turning = _pin_angle_effect(angle, scales["rho_s"], scales["rho_f"], n_planets)
    turning = turning.each_run() if per_run else turning
    extended = replace(best, effects=(*best.effects, turning))
    estimate = identify_from_sums(fitted_equations(campaign, extended, options), extended, options)
    return extended, _with_angle(estimate, angle)


def _searched(projected: Callable[[float], tuple[float, dict[str, float]]], period: float) -> float:
    """Angle of least cost among minima with positive scales; the curves repeat after `period`."""
    # Odd curves that are told by two orders are met as well half of it on, with a scale of the
    # wrong sign; rho_s and rho_f are not negative by the contract of the curves.
    guesses = period * (np.arange(_GUESSES) / _GUESSES - 0.5)
    costs = np.array([projected(angle)[0] for angle in guesses])
    width = period / _GUESSES
    ranked = []
    for guess in guesses[(costs <= np.roll(costs, 1)) & (costs <= np.roll(costs, -1))]:
        minimum = minimize_scalar(
            lambda angle: projected(angle)[0],
            bounds=(guess - width, guess + width),
            method="bounded",
            options={"xatol": _TOLERANCE},
        )
        scales = np.array([projected(minimum.x)[1][name] for name in ("rho_s", "rho_f")])
        wrong_sign = bool(scales.min() < -_SIGN_MARGIN * np.abs(scales).max())
        ranked.append((wrong_sign, float(minimum.fun), float(minimum.x)))
    return (min(ranked)[2] + 0.5 * period) % period - 0.5 * period


def _pin_angle_effect(angle: float, rho_s: float, rho_f: float, n_planets: int) -> Effect:
    """Signal per radian of theta_rho at the fitted scales, by central differences."""

    def turned(
        pin_angle: float, sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig
    ) -> FloatArray:
        at_angle = replace(rig, pin_angle=pin_angle)
        stiff = STIFF_PINS.signals(sensor, inputs, at_angle)
        return rho_s * stiff + rho_f * FLEXIBLE_PINS.signals(sensor, inputs, at_angle)

    def turning(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
        ahead = turned(angle + _STEP, sensor, inputs, rig)
        behind = turned(angle - _STEP, sensor, inputs, rig)
        return (ahead - behind) / (2.0 * _STEP)

    return Effect(
        "pin_angle",
        equation="(rho_s delta_s + rho_f delta_f)(v - theta - theta_rho) T/T_unit",
        parameters=(EffectParameter("theta_rho", "rad"),),
        signature=f"phase of the orders {n_planets} and {2 * n_planets}",
        pattern=turning,
    )


def _with_angle(estimate: ParameterEstimate, angle: float) -> ParameterEstimate:
    """The linear coefficient is the rest of a Newton step from `angle`."""
    # The published value is both together.
    values = estimate.values + np.where(np.array(estimate.names) == "theta_rho", angle, 0.0)
    return replace(estimate, values=values)
