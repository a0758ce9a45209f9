"""Deflection curves of few sines, of the size finite elements give, for tests without a mesh."""

from dataclasses import replace

import numpy as np

from carrierflex.fe.deflection_curves import DeflectionCurve

ANGLE = 2.0 * np.pi * np.arange(360) / 360


def flexible_curve(scale: float = 1.0) -> DeflectionCurve:
    axial = scale * (0.19e-6 * np.sin(3 * ANGLE) + 0.017e-6 * np.sin(6 * ANGLE))
    return DeflectionCurve("delta_f", 0.412, 1000.0, axial, scale * 0.1e-6 * np.sin(3 * ANGLE))


def stiff_curve() -> DeflectionCurve:
    axial = 0.01e-6 * np.sin(3 * ANGLE) + 0.05e-6 * np.sin(6 * ANGLE)
    return DeflectionCurve("delta_s", 0.412, 1000.0, axial, 0.02e-6 * np.sin(6 * ANGLE))


def curve_set():
    """All four curves by name, as a curve file holds them.

    Those of one pin have the size of 1 N.
    """
    stiff, flexible = stiff_curve(), flexible_curve()
    pins = {
        name: replace(
            curve, name=name, unit_load=1.0, axial=1e-3 * curve.axial, radial=1e-3 * curve.radial
        )
        for name, curve in (("g_s", stiff), ("g_f", flexible))
    }
    return {"delta_s": stiff, "delta_f": flexible, **pins}
