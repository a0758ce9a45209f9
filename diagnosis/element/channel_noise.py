"""Noise and gains of the signals of an element.

Noise is declared, of what repeats, or of the spectrum's top; gains are declared.
"""

from collections.abc import Sequence

import numpy as np
from scipy.signal import welch

from carrierflex.diagnosis.comparison.known_physics import DeclaredGains
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.model import ElementModel
from carrierflex.diagnosis.element.records import ElementRecord, noise_of_steps, run_in_use
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.signals import pass_gain
from carrierflex.simulation.element.drives import BY_FORCE, FREE_DECAY

#: Frequencies at which the gain of noise is averaged.
_FREQUENCIES = 4097
#: Smallest dynamic stiffness: the square of its inverse is a number, beyond any noise.
_LEAST_STIFFNESS = 1e-150


def noise_variance(campaign: Campaign, records: Sequence[ElementRecord]) -> tuple[FloatArray, bool]:
    """Variance of the noise of the channel by run, and whether it was measured rather than guessed.

    Declared noise first; then the scatter over periods at the same phase; else the plateau of the
    spectrum above the band of the signal, taken as white. Never less than the steps in which the
    channel was written make: a record that repeats exactly repeats its rounding too.

    Parameters
    ----------
    campaign : Campaign
        Its channel may declare `noise_std`.
    records : sequence of ElementRecord
        Prepared runs.

    Returns
    -------
    tuple of (ndarray, shape (n_runs,), bool)
        Variances; True where declared or from repeats.
    """
    channel = campaign.channels[0]
    least = np.array(
        [noise_of_steps(run_in_use(run).signals[channel.name]) for run in campaign.runs]
    )
    if channel.noise_std is not None:
        return np.maximum(channel.noise_std**2, least), True
    repeated = [_scatter_over_periods(record) for record in records]
    if all(value is not None for value in repeated):
        return np.maximum(np.array(repeated, dtype=np.float64), least), True
    return np.maximum([_plateau(record) for record in records], least), False


def _scatter_over_periods(record: ElementRecord) -> float | None:
    first = int(np.argmax(record.counts))
    n = (record.response.size - first) // record.period if record.period else 0
    if n < 2:
        return None
    values = record.response[first : first + n * record.period].reshape(n, record.period)
    counted = record.counts[first : first + n * record.period].reshape(n, record.period).all(axis=0)
    if not counted.any():
        return None
    return float(values[:, counted].var(axis=0, ddof=1).mean())


def _plateau(record: ElementRecord) -> float:
    """Variance of white noise as high as the spectrum's top.

    Differences take the signal's leakage out.
    """
    segment = min(record.response.size, 2048)
    _, power = welch(
        record.response,
        1.0 / record.step,
        nperseg=segment,
        window="blackmanharris",
        detrend="linear",
    )
    top = power[int(0.85 * power.size) :]
    return float(np.median(top) * 0.5 / record.step)


def dynamic_stiffness(element: tuple[float, float, float], frequency_hz: FloatArray) -> FloatArray:
    """|K1 - w² m + j w C1| of an element m, C1, K1, shape of `frequency_hz`."""
    m, C1, K1 = element
    w = 2.0 * np.pi * frequency_hz
    return np.abs(-(w**2) * m + 1j * w * C1 + K1)


def carried_noise(model: ElementModel, record: ElementRecord) -> float:
    """Variance in the channel of the white noise of the measured force or deflection.

    Through the linear baseline, whose dynamic stiffness is ``D = K1 - w² m + j w C1``: ``sigma²
    mean |1/D|²`` under a force, ``sigma² mean |D|²`` over the usable band under a deflection.

    Parameters
    ----------
    model : ElementModel
        Baseline.
    record : ElementRecord
        Its step, its usable band and the noise of its drive.
    """
    if record.drive_noise == 0.0:
        return 0.0
    frequency = np.linspace(0.0, 0.5 / record.step, _FREQUENCIES)
    scale = model.scale
    stiffness = dynamic_stiffness((scale.m, scale.C1, scale.K1), frequency)
    if model.by_force:
        # Nothing holds an element that was fitted to a drive of the other sign.
        gain = 1.0 / np.maximum(stiffness, _LEAST_STIFFNESS)
    else:
        gain = stiffness * pass_gain(frequency, record.cutoff_hz)
    return float(record.drive_noise * np.mean(gain**2))


def declared_gains(campaign: Campaign) -> DeclaredGains:
    """What a campaign of kind ``element`` declares of the gains of force and deflection.

    Of a moving base, the input is the force that drives the element; where its channel reads the
    deflection in space, that of the base is taken as small beside it.
    """
    drive, channel = campaign.rig["drive"], campaign.channels[0].gain_std
    if drive == FREE_DECAY:
        return DeclaredGains(deflection=channel, force_is_inertia=True)
    driven = campaign.input_of(next(iter(campaign.contract.inputs))).gain_std
    if drive in BY_FORCE:
        return DeclaredGains(force=driven, deflection=channel)
    return DeclaredGains(force=channel, deflection=driven)
