"""Torsional stiffness of the mounting from a simulated torque sweep (2011 paper, section 5.2)."""

import numpy as np

from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.parameter_arrays import ParameterArray
from carrierflex.simulation.mounting.parameters import INDEX
from carrierflex.simulation.mounting.rig import MountingRig
from carrierflex.simulation.mounting.simulate import simulate
from carrierflex.simulation.mounting.torsional_train import TorqueSweep


def mounting_sweep(
    rig: MountingRig, parameters: ParameterArray, torque: float, *, duration: float = 60.0
) -> TorqueSweep:
    """Roll of the housing on its two bushings under a torque that grows slowly.

    Two linear bushings of table 3 give ``2 K1 R_x² = 22.7 MN m/rad``. The paper's 11.4 is that of
    one bushing, which is what ``K1`` halved simulates: either a factor two is lost in the paper or
    its K1 stands for the pair.

    Parameters
    ----------
    rig, parameters
        As for :func:`carrierflex.simulation.mounting.simulate.simulate`.
    torque : float
        Torque on the main shaft reached [N m].
    duration : float
        Time of the sweep [s].

    Returns
    -------
    TorqueSweep
        Torque that the housing carries, and its roll.

    Raises
    ------
    ValueError
        Where torque or duration is not a positive number.
    """
    if not (np.isfinite(torque) and torque > 0.0 and np.isfinite(duration) and duration > 0.0):
        raise ValueError(
            f"torque sweep: torque is {torque} N m, duration {duration} s; "
            "expected positive numbers"
        )
    time = np.arange(round(duration * 100.0) + 1) / 100.0
    rest, applied = np.zeros_like(time), torque * time / time[-1]
    response = simulate(
        rig,
        _without_sensor_errors(parameters),
        MountingInputs(time, applied, rest, rest, rest, rest),
    )
    roll = rig.housing_motion(response.signals)[:, 3]
    return TorqueSweep((1.0 - 1.0 / rig.gear_ratio) * applied, roll)


def _without_sensor_errors(parameters: ParameterArray) -> ParameterArray:
    values = parameters.copy()
    for name, column in INDEX.items():
        if name.startswith(("gain_", "zero_")) or name == "delay":
            values[column] = 1.0 if name.startswith("gain_") else 0.0
    return values
