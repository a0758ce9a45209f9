"""How far the waves of a deflection curve are off, and rigs with one of them off.

A size of an effect of the pins is in units of its curve: that all waves of a curve are too small
changes no signal. That one wave is too small beside the largest does. Where another cause makes the
largest wave too, at four sensors a quarter turn apart a tilt at the order of the planets, the
smaller ones alone tell how much of it is the pins', and what is wrong with them is wrong with both.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from carrierflex.diagnosis.carrier.records.columns import ColumnSource, delay_nodes
from carrierflex.diagnosis.carrier.records.run_columns import inputs_at, inputs_of
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.carrier.models import rim_sensor
from carrierflex.simulation.carrier.rim import CarrierRig

#: Relative standard deviation of a wave beside the largest of its curve, of a carrier with pins
#: that give way and with stiff ones: order 6 over order 3, and order 3 over order 6, of the default
#: mesh against the finest one (0.0889 and 0.0865; 0.894 and 0.939; docs/mesh_study.md).
_STD = {"f": 0.027, "s": 0.048}
#: Curves of a carrier under a torque, and under the force of one pin.
_UNDER_TORQUE, _OF_ONE_PIN = "delta_", "g_"
#: Waves below this share of the largest one of their curve move nothing.
_NOTABLE = 0.01
#: Samples of a run on which a change of the curves shows.
_SAMPLES = 48


def rigs_of_curve_errors(rig: CarrierRig) -> Iterator[CarrierRig]:
    """Rigs with one wave of the curves one standard deviation larger.

    Parameters
    ----------
    rig : CarrierRig
        Rig with the curves as they are.

    Yields
    ------
    CarrierRig
        One for every notable wave of a carrier, in its curve under torque and in that of one pin
        alike, but for the largest of either.
    """
    for pins, std in _STD.items():
        names = [name + pins for name in (_UNDER_TORQUE, _OF_ONE_PIN) if name + pins in rig.curves]
        waves = {name: _waves(rig.curves[name]) for name in names}
        largest = {own[0] for own in waves.values() if own}
        for order in sorted({order for own in waves.values() for order in own} - largest):
            changed = {
                name: _larger(rig.curves[name], order, std)
                for name, own in waves.items()
                if order in own
            }
            yield replace(rig, curves={**rig.curves, **changed})


def shows_curves_of(campaign: Campaign, source: ColumnSource, other: ColumnSource) -> bool:
    """Whether any column is another one with other curves.

    Parameters
    ----------
    campaign : Campaign
        Records.
    source, other : ColumnSource
        The same effects with the curves of two rigs.
    """
    run = campaign.runs[0]
    some = inputs_at(inputs_of(run), np.linspace(0, run.time.size - 1, _SAMPLES).astype(int))
    late = [some] * delay_nodes(source.rig.n_planets).size
    for channel in campaign.channels:
        sensor = rim_sensor(channel)
        rows = source.rows(sensor, some, late)
        others = other.rows(sensor, some, late)
        if any(not np.array_equal(row, others[key]) for key, row in rows.items()):
            return True
    return False


def _waves(curve: DeflectionCurve) -> list[int]:
    """Orders of the notable waves of a curve, the largest first."""
    sizes = curve.axial_order_content()
    sizes[0] = 0.0
    order = np.argsort(-sizes, kind="stable")
    return [int(n) for n in order if sizes[n] > _NOTABLE * sizes.max()]


def _larger(curve: DeflectionCurve, order: int, std: float) -> DeflectionCurve:
    """Curve with one wave larger by a share."""

    def larger(samples: FloatArray) -> FloatArray:
        """Samples of one turn with that wave larger."""
        spectrum = np.fft.rfft(samples)
        spectrum[order] *= 1.0 + std
        return np.asarray(np.fft.irfft(spectrum, samples.size))

    return replace(curve, axial=larger(curve.axial), radial=larger(curve.radial))
