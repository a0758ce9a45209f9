"""Mounting models and loads that ours and the peers are compared on."""

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.mounting.equations import mounting_blocks
from carrierflex.simulation.mounting.history_inputs import history_inputs
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.load_history import LoadHistory
from carrierflex.simulation.mounting.parameter_arrays import ParameterArray, parameter_array
from carrierflex.simulation.mounting.parameters import INDEX
from carrierflex.simulation.mounting.rig import MountingRig
from carrierflex.simulation.mounting.table_3 import TABLE_3

Array = NDArray[np.float64]

RIG = MountingRig(zeroing_samples=1)

MODERATE_LINEAR = {**TABLE_3["linear"], "C1": 1e5}
MODERATE_NONLINEAR = {**TABLE_3["nonlinear"], "C1": 3e4}
#: What a peer integrates too: without parasitic torque, whose load its user would have to build.
PEER_MODELS = {
    "linear": parameter_array(RIG, {**MODERATE_LINEAR, "P_T": 0.0}),
    "nonlinear": parameter_array(RIG, {**MODERATE_NONLINEAR, "P_T": 0.0}),
}

#: The loads of the comparison as formulas, so that no code has to look them up in a table.
TORQUE = 80e3
RADIAL = -100e3
RIPPLE_HZ = 2.0
RADIAL_RIPPLE_HZ = 0.37


def torque_at(t: Array) -> Array:
    """Torque [N m] that rises about 10 s, with a ripple."""
    ripple = 1.0 + 0.05 * np.sin(2.0 * np.pi * RIPPLE_HZ * t)
    return TORQUE * 0.5 * (1.0 + np.tanh(t - 10.0)) * ripple


def radial_at(t: Array) -> Array:
    """Radial load [N] that rises about 5 s, with a ripple."""
    ripple = 1.0 + 0.02 * np.sin(2.0 * np.pi * RADIAL_RIPPLE_HZ * t)
    return RADIAL * 0.5 * (1.0 + np.tanh((t - 5.0) / 0.5)) * ripple


def formula_inputs(interval: float, duration: float) -> MountingInputs:
    """The formulas sampled every `interval` for `duration` [s]."""
    times = interval * np.arange(round(duration / interval) + 1, dtype=np.float64)
    rest = np.zeros_like(times)
    return MountingInputs(times, torque_at(times), rest, rest, rest, radial_at(times))


def noisy_inputs(first: float, last: float) -> MountingInputs:
    """The history of figure 6 between two times [s], torque and radial load with 5 % of noise.

    The noise lies below 10 Hz: nothing is smooth enough for a method to profit from.
    """
    smooth = history_inputs(LoadHistory(), first, last)
    rng = np.random.default_rng(1)
    spectrum = np.fft.rfft(rng.standard_normal((2, smooth.time.size)), axis=1)
    spectrum[:, np.fft.rfftfreq(smooth.time.size, smooth.step) > 10.0] = 0.0
    noise = np.fft.irfft(spectrum, smooth.time.size, axis=1)
    noise *= 0.05 / noise.std(axis=1, keepdims=True)
    torque = smooth.torque * (1.0 + noise[0])
    ntl_z = smooth.ntl_z * (1.0 + noise[1])
    return MountingInputs(
        smooth.time, torque, smooth.speed, smooth.carrier_angle, smooth.ntl_y, ntl_z
    )


def noisy_record(duration: float) -> MountingInputs:
    """The last `duration` [s] of the noisy history, with torque, from rest: loads of a record."""
    count = round(duration * 100.0) + 1
    last = noisy_inputs(40.0, 560.0).columns().values()
    excerpt = MountingInputs(*(values[-count:] for values in last))
    time = excerpt.time - excerpt.time[0]
    rise = np.minimum(1.0, time / 2.0)
    torque = excerpt.torque * rise
    return MountingInputs(
        time, torque, excerpt.speed, excerpt.carrier_angle, excerpt.ntl_y, excerpt.ntl_z * rise
    )


def error_of(signals: Array, reference: Array) -> float:
    """Largest deviation over the largest signal, at the times of the coarser of both."""
    finer = (len(signals) - 1) / (len(reference) - 1)
    if finer > 1:
        signals = signals[:: round(finer)]
    else:
        reference = reference[:: round(1 / finer)]
    return float(np.abs(signals - reference).max() / np.abs(reference).max())


def element_coordinates(
    rig: MountingRig, parameters: ParameterArray
) -> tuple[Array, Array, Array, Array, Array, Array]:
    """M, C, K, G, the spring law and the signals' rows over both bushings' deflections in z.

    The nonlinear springs then lie on single coordinates. The horizontal block has no load here and
    stays at rest; leaving it out is to the peers' advantage.
    """
    vertical, _ = mounting_blocks(rig, parameters)
    inverse = np.linalg.inv(vertical.rows)
    M, C, K = (inverse.T @ matrix @ inverse for matrix in (vertical.M, vertical.C, vertical.K))
    return M, C, K, inverse.T @ vertical.G[:, [0, 2]], vertical.law, vertical.output @ inverse


def has_nonlinear_stiffness(parameters: ParameterArray) -> bool:
    """True where the bushings' springs are not straight lines."""
    return bool(parameters[INDEX["K3"]] or parameters[INDEX["K5"]])
