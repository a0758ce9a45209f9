"""Fitted parameters as they are published: by effect and name, tilts by size and direction."""

import re

import numpy as np

from carrierflex.diagnosis.inference.bounded_fit import EffectFit, parameter_key
from carrierflex.diagnosis.results import NamedValue

#: Linear components of a tilt or another vector: ``phi_PLC cos theta_PLC``, with the run where it
#: has one.
_COMPONENT = re.compile(r"^(?P<size>\S+) (?P<part>cos|sin) (?P<angle>\S+)(?P<run> of .+)?$")
#: A vector of exactly zero has no direction; this share of its error makes the angle's error huge
#: instead of infinite.
_SMALLEST_SHARE = 1e-6
#: Size that stands for nothing, where the records do not see it at all.
_SMALLEST = 1e-100


def named_values(fit: EffectFit) -> dict[str, dict[str, NamedValue]]:
    """Values of a fit by effect and name.

    Parameters
    ----------
    fit : EffectFit
        Parameters with their covariance.

    Returns
    -------
    dict
        A pair of components ``(a, b)`` appears as size ``|(a, b)|`` and angle ``atan2(b, a)``
        [rad], errors by the delta method.
    """
    covariance = fit.covariance
    keys = [parameter_key(parameter) for parameter in fit.parameters]
    values: dict[str, dict[str, NamedValue]] = {}
    for k, (effect, name) in enumerate(keys):
        own = values.setdefault(effect, {})
        match = _COMPONENT.match(name)
        partner = (
            None
            if match is None
            else (effect, f"{match['size']} sin {match['angle']}{match['run'] or ''}")
        )
        if match is None or partner not in keys:
            error = float(np.sqrt(max(covariance[k, k], 0.0)))
            own[name] = NamedValue(float(fit.theta[k]), error, fit.parameters[k].unit)
        elif match["part"] == "cos":
            both = [k, keys.index(partner)]
            size, angle = _polar(
                fit.theta[both], covariance[np.ix_(both, both)], fit.parameters[k].unit
            )
            own[match["size"] + (match["run"] or "")] = size
            own[match["angle"] + (match["run"] or "")] = angle
    return values


def _polar(
    components: np.ndarray, covariance: np.ndarray, unit: str
) -> tuple[NamedValue, NamedValue]:
    """Size and direction of two components."""
    a, b = (float(part) for part in components)
    trace = float(np.nan_to_num(np.trace(covariance)))
    smallest = max(_SMALLEST_SHARE * float(np.sqrt(max(trace, 0.0))), _SMALLEST)
    size = float(np.hypot(a, b))
    if size < smallest:
        size, a, b = smallest, smallest, 0.0
    J = np.array([[a / size, b / size], [-b / size**2, a / size**2]])
    errors = np.sqrt(np.maximum(np.diag(J @ covariance @ J.T), 0.0))
    return NamedValue(float(np.hypot(a, b)), float(errors[0]), unit), NamedValue(
        float(np.arctan2(b, a)), float(errors[1]), "rad"
    )
