"""Deflection of the rim while a dimension is being changed: the default curve and its derivatives.

``delta_f(p) = delta_f(p_0) + sum_i (d delta_f / d p_i) (p_i - p_0i)``, of small changes;
``carrierflex curves`` solves for any.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.curve_files import causes_of
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.geometry.parameter_files import StageParameters
from carrierflex.geometry.parameter_sources import limits
from carrierflex.workflows.fe.default_curves import default_curves, with_derivatives


@cache
def _curves() -> dict[str, DeflectionCurve]:
    return with_derivatives(default_curves())


@cache
def dimensions() -> dict[str, tuple[float, float, float]]:
    """Default and range [m] of the carrier's dimensions whose derivatives are known, by name.

    The range is that in which one alone may be changed, twice the default at most; of the centre
    distance, which the gear follows, a hundredth to both sides.
    """
    stage = StageParameters()
    ends = limits(stage, "carrier")
    result = {}
    for name in [name for name in causes_of(_curves()) if name in ends]:
        value, (low, high) = getattr(stage.carrier, name), ends[name]
        tied = low == high
        result[name] = (
            value,
            0.99 * value if tied else low,
            1.01 * value if tied else min(high, 2.0 * value),
        )
    return result


def changed_stage(changes: Mapping[str, float]) -> StageParameters:
    """Default stage with other dimensions of the carrier [m]; refused where they contradict."""
    stage = StageParameters()
    gear = stage.gear
    if "centre_distance" in changes:
        gear = replace(gear, centre_distance=changes["centre_distance"])
    return replace(stage, carrier=replace(stage.carrier, **dict[str, Any](changes)), gear=gear)


def deflection(changes: Mapping[str, float]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Axial curve ``delta_f`` of the changed carrier to first order.

    Parameters
    ----------
    changes : mapping of str to float
        Dimensions by name [m].

    Returns
    -------
    angle, axial : ndarray, shape (n,)
        Carrier-frame angle [rad] and displacement [m per kN m].
    """
    curves = _curves()
    angle, axial = curves["delta_f"].angle, curves["delta_f"].axial.copy()
    for name, value in changes.items():
        axial += curves[f"delta_f/{name}"].axial_at(angle) * (value - dimensions()[name][0])
    return angle, axial


def parameter_text(changes: Mapping[str, float]) -> str:
    """TOML file of the changed dimensions, for ``--parameters``."""
    lines = ["[carrier]", *(f"{name} = {value!r}" for name, value in changes.items())]
    if "centre_distance" in changes:
        lines += ["", "[gear]", f"centre_distance = {changes['centre_distance']!r}"]
    return "\n".join([*lines, ""])
