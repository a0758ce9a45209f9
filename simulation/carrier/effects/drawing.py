"""What differs between a carrier and its drawing: pin fit, dimensions, material, curves.

The drawing gives ``delta_f``, the curve ``d`` that a rigid pin fit adds, and the derivatives of
both by every cause p (:mod:`carrierflex.fe.curve_files`). The carrier's curve is

    delta = delta_f + w d + b (delta_s - delta_f - d)
          + sum_p change_p (d delta_f/dp + w d d/dp) + sum_n e_n R sin(n u),

with the share w of a rigid fit, the share b of bonded pins beyond it, and the errors e_n that the
computed curve has, in its RMS R; the radial curve has errors of its own, r_n.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.curve_files import MATERIAL_CAUSES, PIN_FIT
from carrierflex.fe.deflection_curves import DeflectionCurve, resampled
from carrierflex.simulation.carrier import kinematics
from carrierflex.simulation.carrier.effect import Effect, others
from carrierflex.simulation.carrier.effects.alike import AT_PLANET_ORDERS, STEPS_OF_TORQUE
from carrierflex.simulation.carrier.rim import CarrierInputs, CarrierRig, RimSensor
from carrierflex.simulation.effect_parameters import EffectParameter

CURVE_ERROR = "curve_error"
BOND = "pin_bond"
#: What a drawing leaves open: its bounds are the drawing's own.
ALLOWED_BY_DRAWING = (PIN_FIT, BOND, CURVE_ERROR)
#: Multiples of the number of planets whose order of a computed curve may be off.
MULTIPLES = (1, 2, 3, 4, 5)
#: Standard deviations within which a change lies, and an error of the curve: beyond, it is a cause.
_FARTHEST, _MOST_ERROR = 3.0, 2.0
#: Cosines of a curve over its sines that the mesh of a carrier with mirror planes leaves at most.
_ROUNDING = 0.03
FloatArray = NDArray[np.float64]


def effect_of_cause(cause: str) -> str:
    """Effect id of a cause: ``geometry/outer_radius``, ``material/E``."""
    return f"{'material' if cause in MATERIAL_CAUSES else 'geometry'}/{cause}"


def body_of_effect(effect: str) -> str:
    """Body that such an effect is of, ``carrier`` or ``pins``; empty of another effect."""
    table, _, cause = effect.partition("/")
    if table not in ("geometry", "material") or not cause:
        return ""
    return MATERIAL_CAUSES[cause][0] if cause in MATERIAL_CAUSES else "carrier"


def pin_fit_effect(curves: Mapping[str, DeflectionCurve]) -> Effect:
    """Pins fitted more stiffly than not at all: ``w`` from 0 to 1."""
    return Effect(
        PIN_FIT,
        equation="w d(v - theta) T/T_unit",
        parameters=(EffectParameter("w", "1", 0.0, 1.0, 0.5),),
        signature="order 3 smaller, order 6 of the other sign, growing as the torque",
        pattern=_rows(curves[PIN_FIT]),
        aliases=others(PIN_FIT, AT_PLANET_ORDERS),
        discriminating_experiment=STEPS_OF_TORQUE,
    )


def bond_effect(curves: Mapping[str, DeflectionCurve]) -> Effect:
    """Pins bonded all around, beyond a rigid fit of their mean motion: ``b`` from 0 to 1."""
    flexible, stiff = curves["delta_f"], curves["delta_s"]
    d = resampled(curves[PIN_FIT], flexible.axial.size)
    beyond = replace(
        stiff,
        axial=stiff.axial - flexible.axial - d.axial,
        radial=stiff.radial - flexible.radial - d.radial,
    )
    return Effect(
        BOND,
        equation="b (delta_s - delta_f - d)(v - theta) T/T_unit",
        parameters=(EffectParameter("b", "1", 0.0, 1.0, 0.5),),
        signature="orders 6 and 9 smaller, growing as the torque",
        pattern=_rows(beyond),
    )


def curve_error_effect(
    flexible: DeflectionCurve, n_planets: int, std: float, *, radial: bool = False
) -> Effect:
    """Errors of the computed curve, order by order; `std` is theirs over the curve's RMS.

    The radial curve has errors of its own, which are parameters where `radial` sensors read it.
    """
    orders = [n_planets * k for k in MULTIPLES]
    waves = [np.sin(n * flexible.angle) for n in orders]
    still = np.zeros_like(flexible.angle)
    size = float(np.sqrt(np.mean(flexible.radial**2)))
    curves = [replace(flexible, axial=flexible.rms * wave, radial=still) for wave in waves]
    names = [f"e_{n}" for n in orders]
    if radial:
        curves += [replace(flexible, axial=still, radial=size * wave) for wave in waves]
        names += [f"r_{n}" for n in orders]
    return Effect(
        CURVE_ERROR,
        equation="sum_n e_n R sin(n (v - theta)) T/T_unit",
        parameters=tuple(
            EffectParameter(name, "1", -_MOST_ERROR * std, _MOST_ERROR * std, std) for name in names
        ),
        signature="orders of the planets, growing as the torque",
        pattern=_rows(*curves),
    )


def drawing_effects(
    curves: Mapping[str, DeflectionCurve], tolerances: Mapping[str, float], n_planets: int
) -> tuple[Effect, ...]:
    """Every cause with a tolerance as an effect; its change is the only parameter.

    It acts at the orders whose errors are parameters: a derivative is least certain at the highest,
    where a quiet sensor would still see it and no error of the curve would stand beside it. Of a
    carrier with mirror planes the cosines of a derivative are rounding of its mesh, and left out:
    several causes together would make any wave of them.

    Parameters
    ----------
    curves : mapping of str to DeflectionCurve
        The drawing's curve ``delta_f``, and derivatives (:mod:`carrierflex.fe.curve_files`).
    tolerances : mapping of str to float
        Standard deviation of each cause from its drawing, in its unit.
    n_planets : int
        Planets.

    Returns
    -------
    tuple of Effect
        The second row of signals is that of a rigid fit, to be weighed by ``w``.
    """
    has_mirrors = _has_mirrors(curves["delta_f"].axial)
    retained = partial(_kept_waves, highest=n_planets * max(MULTIPLES), sines_alone=has_mirrors)
    derivatives = {
        name: replace(curve, axial=retained(curve.axial), radial=retained(curve.radial))
        for name, curve in curves.items()
        if "/" in name
    }
    return tuple(_of_cause(name, derivatives, std) for name, std in tolerances.items())


def _has_mirrors(samples: FloatArray) -> bool:
    """Whether a turn of a curve under torque is odd about a pin."""
    waves = np.fft.rfft(samples)[1:]
    return bool(np.linalg.norm(waves.real) < _ROUNDING * np.linalg.norm(waves.imag))


def _kept_waves(samples: FloatArray, *, highest: int, sines_alone: bool) -> FloatArray:
    """Equally spaced samples of a turn without the orders above one, or without their cosines."""
    amplitudes = np.fft.rfft(samples)
    amplitudes[highest + 1 :] = 0.0
    if sines_alone:
        amplitudes.real = 0.0
    return np.asarray(np.fft.irfft(amplitudes, samples.size))


def _of_cause(name: str, derivatives: Mapping[str, DeflectionCurve], std: float) -> Effect:
    farthest = _FARTHEST * std
    unit = MATERIAL_CAUSES[name][2] if name in MATERIAL_CAUSES else "m"
    return Effect(
        effect_of_cause(name),
        equation="change (d delta_f/dp + w d d/dp)(v - theta) T/T_unit",
        parameters=(EffectParameter("change", unit, -farthest, farthest, std),),
        signature="orders 3, 6 and 9 fixed to the carrier, in phase with its pins, as the torque",
        pattern=_rows(derivatives[f"delta_f/{name}"], derivatives[f"{PIN_FIT}/{name}"]),
        weighed_by=PIN_FIT,
        discriminating_experiment="measure the dimension, or add a radial sensor at the rim",
    )


def _rows(*curves: DeflectionCurve) -> Callable[..., FloatArray]:
    """Pattern of one row for each curve under torque, as a sensor reads it."""

    def pattern(sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
        """Signals [m per unit], shape (n_curves, n)."""
        read = (
            kinematics.axial_deflection_pattern
            if sensor.is_axial
            else kinematics.radial_deflection_pattern
        )
        where = (inputs.carrier_angle, sensor.angle, inputs.torque)
        return np.array([read(*where, curve, pin_angle=rig.pin_angle) for curve in curves])

    return pattern
