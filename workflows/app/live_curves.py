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

#: Dimensions of other tables that are the carrier's too, and follow it.
_FOLLOWING = {
    "centre_distance": ("gear", "centre_distance"),
    "pin_hole_diameter": ("pin", "diameter"),
}


@cache
def _curves() -> dict[str, DeflectionCurve]:
    return with_derivatives(default_curves())


@cache
def dimensions() -> dict[str, tuple[float, float, float]]:
    """Default and range [m] of the carrier's dimensions whose derivatives are known, by name.

    The range is that in which one alone may be changed, twice the default at most; of one that
    another follows, half a per cent to both sides.
    """
    stage = StageParameters()
    ends = limits(stage, "carrier")
    result = {}
    for name in [name for name in causes_of(_curves()) if name in ends]:
        value, (low, high) = getattr(stage.carrier, name), ends[name]
        tied = low == high
        result[name] = (
            value,
            0.995 * value if tied else low,
            1.005 * value if tied else min(high, 2.0 * value),
        )
    return result


def changed_stage(changes: Mapping[str, float]) -> StageParameters:
    """Default stage with other dimensions of the carrier [m]; refused where they contradict."""
    stage = StageParameters()
    tables = {
        table: replace(getattr(stage, table), **values)
        for table, values in _with_following(changes).items()
    }
    return replace(stage, **tables)


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
    lines = []
    for table, values in _with_following(changes).items():
        lines += [f"[{table}]", *(f"{name} = {value!r}" for name, value in values.items()), ""]
    return "\n".join(lines)


def _with_following(changes: Mapping[str, float]) -> dict[str, dict[str, Any]]:
    """Changes by table, with those of the tables that follow."""
    tables: dict[str, dict[str, Any]] = {"carrier": dict(changes)}
    for name in changes:
        if name in _FOLLOWING:
            table, key = _FOLLOWING[name]
            tables.setdefault(table, {})[key] = changes[name]
    return tables
