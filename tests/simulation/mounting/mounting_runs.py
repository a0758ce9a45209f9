"""Short runs for the tests: loads that shake the mounting, and the bushings of table 3."""

import numpy as np

from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.table_3 import TABLE_3

BUSHINGS = {
    "linear": {**TABLE_3["linear"], "C1": 1e5},
    "linear, damping of the paper": TABLE_3["linear"],
    "nonlinear": {**TABLE_3["nonlinear"], "C1": 3e4},
    "nonlinear, damping of the paper": {**TABLE_3["nonlinear"], "C1": 4.83e6},
    "hydro-dynamic": {**TABLE_3["hydrodynamic"], "m": 0.0},
}


def shaking_inputs(duration=2.0, rate=100.0, torque=250e3, radial=80e3):
    """Rest, then torque and radial load with a beat of 3 and 7 Hz: the deflections reach 8 mm."""
    time = np.arange(round(duration * rate) + 1) / rate
    rise = np.clip((time - 0.2) / 0.5, 0.0, 1.0)
    rise = rise**3 * (10.0 - 15.0 * rise + 6.0 * rise**2)
    wave = 1.0 + 0.2 * np.sin(2.0 * np.pi * 3.0 * time) + 0.1 * np.sin(2.0 * np.pi * 7.0 * time)
    rest = np.zeros_like(time)
    return MountingInputs(
        time, torque * rise * wave, rest, rest, 0.4 * radial * rise, -radial * rise * wave
    )
