"""The housing's rigid-body motion, measured beside simulated (2011 paper, eqs 8 to 10).

Displacements of the point midway between the bushings and rotations about it:
``housing_motion_RUN.csv`` for every run and the picture of figures 7 and 10. A good answer: theta_x
rules the rotations, as the torque makes it, and little is left of any motion.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.mounting.bushing_identification import BushingEstimate
from carrierflex.identification.mounting.housing_motion import housing_motion
from carrierflex.identification.mounting.view import MotionRecord, housing_motion_figure
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.parameter_arrays import parameter_array
from carrierflex.simulation.mounting.rig import HOUSING_MOTION, MountingRig
from carrierflex.simulation.mounting.simulate import simulate
from carrierflex.workflows.outputs import save_figure, save_table

_UNITS = ("m", "m", "m", "rad", "rad", "rad")


def measured_motion(campaign: Campaign) -> dict[str, NDArray[np.float64]]:
    """Motion of the housing by run, shape (n, 6), NaN where too few sensors read.

    Raises
    ------
    ValueError
        Where the campaign's sensors cannot tell the six coordinates apart.
    """
    rig = MountingRig.from_table(campaign.rig)
    sensors = {str(channel.sensor): channel.name for channel in campaign.channels}
    return {
        run.name: housing_motion(
            rig, {sensor: run.signals[name] for sensor, name in sensors.items()}
        ).motion
        for run in campaign.runs
    }


def write_housing_motion(
    out: Path,
    campaign: Campaign,
    measured: Mapping[str, NDArray[np.float64]],
    estimates: Mapping[str, BushingEstimate],
) -> tuple[tuple[Path, ...], dict[str, NDArray[np.float64]]]:
    """Write tables and picture of the motion, measured and simulated with the identified bushings.

    Returns
    -------
    files : tuple of Path
        What was written.
    rms : dict of str to ndarray, shape (2, 6)
        RMS of the measured motion and of the gap by run [m, rad].
    """
    rig = MountingRig.from_table(campaign.rig)
    motions: dict[str, MotionRecord] = {}
    files, rms = [], {}
    for run in campaign.runs:
        estimate = estimates[run.name]
        parameters = parameter_array(rig, estimate.model.simulator_values(estimate.fit.values))
        inputs = MountingInputs.from_columns(run.time, run.inputs)
        simulated = rig.housing_motion(simulate(rig, parameters, inputs).signals)
        motions[run.name] = (run.time, measured[run.name], simulated)
        squares = [measured[run.name] ** 2, (measured[run.name] - simulated) ** 2]
        rms[run.name] = np.sqrt([np.nanmean(square, axis=0) for square in squares])
        header = [
            f"{name}_{kind} [{unit}]"
            for kind in ("measured", "simulated")
            for name, unit in zip(HOUSING_MOTION, _UNITS, strict=True)
        ]
        files.append(out / f"housing_motion_{Path(run.file).stem}.csv")
        rows = np.column_stack([run.time, measured[run.name], simulated])
        save_table(files[-1], ["time [s]", *header], rows.tolist())
    files.append(out / "housing_motion.png")
    save_figure(files[-1], housing_motion_figure(motions))
    return tuple(files), rms
