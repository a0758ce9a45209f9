"""Fitted parameters as they are published: by effect and name, tilts by size and direction."""

import numpy as np

from carrierflex.diagnosis.comparison.problem import Parameter
from carrierflex.diagnosis.inference.effect_fit import EffectFit, parameter_key
from carrierflex.diagnosis.inference.intervals import NORMAL_95, small_sample_factor
from carrierflex.diagnosis.inference.results import NamedValue
from carrierflex.identification.estimation.polar_pair import polar_values


def named_values(fit: EffectFit, *, few_blocks: bool = False) -> dict[str, dict[str, NamedValue]]:
    """Values of a fit by effect and name, each with its 95 % interval.

    Parameters
    ----------
    fit : EffectFit
        Parameters with their covariance.
    few_blocks : bool
        Whether the blocks are few beside the parameters: Student's t in place of the normal
        quantile (see :func:`~carrierflex.diagnosis.inference.intervals.small_sample_factor`).

    Returns
    -------
    dict
        Two components ``(a, b)`` of a vector appear as its size ``|(a, b)|`` and its angle
        ``atan2(b, a)`` [rad], errors by the delta method. Amplitudes that move no sample of these
        records (a radial shift where every sensor reads along the axis) are left out: their
        intervals would be rounding.
    """
    factor = small_sample_factor(fit) if few_blocks else 1.0
    covariance = factor**2 * fit.covariance
    numbers = {parameter_key(parameter): k for k, parameter in enumerate(fit.parameters)}
    values: dict[str, dict[str, NamedValue]] = {}
    for k, parameter in enumerate(fit.parameters):
        named = values.setdefault(parameter.effect, {})
        pair = parameter.pair
        gain = _gain_std(parameter)
        if pair is None:
            if not (fit.moves_records[k] or parameter.shape):
                continue
            value = _named(float(fit.theta[k]), covariance[k, k], parameter.unit, gain)
            named[_of_run(parameter.name, parameter)] = value
        elif parameter.name == pair.components[0]:
            both = [k, numbers[parameter.effect, _of_run(pair.components[1], parameter)]]
            ends, slopes = polar_values(fit.theta[both], covariance[np.ix_(both, both)])
            variances = np.diag(slopes @ covariance[np.ix_(both, both)] @ slopes.T)
            size, angle = float(ends[0]), float(ends[1])
            named[_of_run(pair.size, parameter)] = _named(size, variances[0], parameter.unit, gain)
            # One gain for both components: it leaves the angle as it is.
            named[_of_run(pair.angle, parameter)] = _named(angle, variances[1], "rad", 0.0)
    return values


def _gain_std(parameter: Parameter) -> float:
    """Relative error by the gains; none where the value is held."""
    return parameter.gain_std if parameter.lower < parameter.upper else 0.0


def _named(value: float, variance: float, unit: str, gain_std: float) -> NamedValue:
    """Value with the interval of its covariance and of the gains together."""
    std = float(np.hypot(np.sqrt(np.maximum(variance, 0.0)), gain_std * value))
    half = NORMAL_95 * std
    return NamedValue(value, std, unit, (value - half, value + half))


def _of_run(name: str, parameter: Parameter) -> str:
    """Name with the run that the parameter belongs to, where it has one."""
    return name if parameter.run is None else f"{name} of {parameter.run}"
