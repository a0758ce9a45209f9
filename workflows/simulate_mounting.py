"""Simulate the six motion sensors on the gearbox's housing under a load history.

Reads a case of kind ``mounting`` (the shipped one holds the load history of the 2011 paper), simulates every run with
its true bushings and writes a campaign folder. A good answer: rest, a step of millimetres with the radial load, and the
roll that opens ssz from spz with the torque.
"""

import shutil
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from identification.campaign import Campaign
from identification.campaign_files import CASE_COPY, write_campaign
from identification.simulated_campaign import simulated_mounting_campaign
from simulation.mounting.case_files import MountingCase, read_mounting_case
from simulation.mounting.simulate import simulate, with_noise
from workflows.progress import Stages


@dataclass(frozen=True, eq=False)
class SimulatedMounting:
    """What the workflow made.

    Parameters
    ----------
    case : MountingCase
        The case with its truth.
    campaign : Campaign
        The simulated records.
    folder : Path
        Where they were written.
    """

    case: MountingCase
    campaign: Campaign
    folder: Path


def main(case: Path, *, out: Path, quiet: bool = False) -> SimulatedMounting:
    """Simulate the housing's motion sensors and write them as a campaign folder.

    Parameters
    ----------
    case : Path
        Case file of kind mounting (TOML); SI units.
    out : Path
        Campaign folder to write: new, empty, or an earlier campaign.
    quiet : bool
        Show no progress.

    Returns
    -------
    SimulatedMounting
        The case, the campaign and its folder.

    Raises
    ------
    ValueError
        Where the case is refused, or the folder holds something that is not a campaign.
    DivergedError
        Where a run leaves the model; nothing is written then.
    """
    what = read_mounting_case(case)
    rng = np.random.default_rng(what.seed)
    stages = Stages(len(what.runs) + 1, quiet)
    records = []
    for run in what.runs:
        with stages.stage(f"{run.name}, {run.history.duration:g} s"):
            inputs = run.history.inputs()
            response = simulate(what.rig, what.truth, inputs)
            records.append((inputs, with_noise(response, what.noise_std, rng)))
    campaign = simulated_mounting_campaign(what, records)
    with stages.stage(f"writing {out}"):
        write_campaign(campaign, out, more_files={CASE_COPY: partial(shutil.copyfile, case)})
    return SimulatedMounting(what, campaign, out)
