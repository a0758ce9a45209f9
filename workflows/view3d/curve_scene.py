"""Deflection curves in space: the rim's circle as each unit load deforms it."""

from collections.abc import Mapping

import numpy as np

from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.geometry.view import rounded_magnification
from carrierflex.workflows.view3d.circles import band, circle, directions, pin_labels, pins
from carrierflex.workflows.view3d.scene import Control, Entry, Scene, SceneObject

#: Largest displacement drawn, and width of the band, over the radius.
_DRAWN, _WIDTH = 0.15, 0.06
_WORDS = {
    "delta_s": "Carrier with bonded pins (stiff), torque of 1 kN m.",
    "delta_f": "Carrier without pins (flexible), torque of 1 kN m.",
    "g_s": "Carrier with bonded pins (stiff), force of 1 N on pin 1.",
    "g_f": "Carrier without pins (flexible), force of 1 N on pin 1.",
}


def curve_scene(curves: Mapping[str, DeflectionCurve], name: str) -> Scene:
    """Scene of the four curves of a carrier.

    Parameters
    ----------
    curves : mapping of str to DeflectionCurve
        By name, all over the same angles.
    name : str
        Where they come from.

    Raises
    ------
    ValueError
        Where no curve deflects.
    """
    shown = {name: curve for name, curve in curves.items() if _largest(curve) > 0.0}
    if not shown:
        raise ValueError(f"{name}: every curve is zero; expected one that deflects")
    first = next(iter(shown.values()))
    n, radius = first.angle.size, first.radius
    e = directions(first.angle)
    rest = np.concatenate([(1.0 - _WIDTH) * radius * e, (1.0 + _WIDTH) * radius * e])
    entries = []
    moved = []
    values = []
    for curve_name, curve in shown.items():
        factor = rounded_magnification(_DRAWN * radius / _largest(curve))
        u = curve.axial[:, None] * np.array([1.0, 0.0, 0.0]) + curve.radial[:, None] * e
        limit = float(np.abs(curve.axial).max())
        entries.append(
            Entry(
                curve_name,
                f"{_WORDS[curve_name]} Drawn {factor:,.0f} times larger.",
                "axial displacement, µm",
                limit * 1e6,
            )
        )
        moved.append(factor * np.tile(u, (2, 1)))
        values.append(np.tile(curve.axial / (limit or 1.0), 2))
    n_planets = shown["delta_f"].first_order if "delta_f" in shown else first.first_order
    return Scene(
        title=f"deflection curves, {name}",
        words=f"Circle of radius {radius:g} m on the carrier's rim, seen from upwind. Grey: at "
        "rest. x points downwind along the axis, z up.",
        control=Control("share of the load", "", 1.0, (-1.0, 1.0)),
        entries=tuple(entries),
        objects=(
            SceneObject("rim", band(n), rest, np.array(moved), np.array(values)),
            circle(radius, len(entries)),
            *pins(radius, n_planets, len(entries)),
        ),
        labels=tuple(pin_labels(radius, n_planets)),
    )


def _largest(curve: DeflectionCurve) -> float:
    return float(np.hypot(curve.axial, curve.radial).max())
