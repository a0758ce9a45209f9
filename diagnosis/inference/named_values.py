"""Fitted parameters as they are published: by effect and name, tilts by size and direction."""

import numpy as np

from carrierflex.diagnosis.comparison.problem import FloatArray, Parameter
from carrierflex.diagnosis.inference.effect_fit import EffectFit, parameter_key
from carrierflex.diagnosis.inference.results import NamedValue
from carrierflex.identification.estimation.polar_pair import polar_values


def named_values(fit: EffectFit) -> dict[str, dict[str, NamedValue]]:
    """Values of a fit by effect and name.

    Parameters
    ----------
    fit : EffectFit
        Parameters with their covariance.

    Returns
    -------
    dict
        Two components ``(a, b)`` of a vector appear as its size ``|(a, b)|`` and its angle
        ``atan2(b, a)`` [rad], errors by the delta method.
    """
    covariance = fit.covariance
    numbers = {parameter_key(parameter): k for k, parameter in enumerate(fit.parameters)}
    values: dict[str, dict[str, NamedValue]] = {}
    for k, parameter in enumerate(fit.parameters):
        named = values.setdefault(parameter.effect, {})
        pair = parameter.pair
        if pair is None:
            error = float(np.sqrt(max(covariance[k, k], 0.0)))
            value = NamedValue(float(fit.theta[k]), error, parameter.unit)
            named[_of_run(parameter.name, parameter)] = value
        elif parameter.name == pair.components[0]:
            both = [k, numbers[parameter.effect, _of_run(pair.components[1], parameter)]]
            size, angle = _size_and_angle(
                fit.theta[both], covariance[np.ix_(both, both)], parameter.unit
            )
            named[_of_run(pair.size, parameter)] = size
            named[_of_run(pair.angle, parameter)] = angle
    return values


def _size_and_angle(
    components: FloatArray, covariance: FloatArray, unit: str
) -> tuple[NamedValue, NamedValue]:
    values, derivatives = polar_values(components, covariance)
    errors = np.sqrt(np.maximum(np.diag(derivatives @ covariance @ derivatives.T), 0.0))
    size = NamedValue(float(values[0]), float(errors[0]), unit)
    return size, NamedValue(float(values[1]), float(errors[1]), "rad")


def _of_run(name: str, parameter: Parameter) -> str:
    """Name with the run that the parameter belongs to, where it has one."""
    return name if parameter.run is None else f"{name} of {parameter.run}"
