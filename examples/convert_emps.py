"""Turn the measured EMPS benchmark (servo axis with dry friction) into an element campaign.

A. Janot, M. Gautier, M. Brunot, "Data set and reference models of EMPS" (2019): motor command [V]
and position [m] of a prismatic joint in closed loop. The loop fixes the motion, so the axis is
looked at from the motion to the force (inverse dynamics), filtered without phase shift at 20 Hz as
the benchmark's authors do.
"""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.signals import band_limited

FILES = {"train": "DATA_EMPS.mat", "pulses": "DATA_EMPS_PULSES.mat"}
SAMPLE_RATE = 1000.0
BAND_HZ = 20.0
#: Every fifth sample is used: ten a period of the band's end.
_EVERY = 5
#: Frequency above which the command holds noise only; its density there is taken as that of the
#: noise in the band.
_NOISE_FROM_HZ = 250.0


def main(folder: Path, *, out: Path) -> Path:
    """Convert DATA_EMPS.mat and DATA_EMPS_PULSES.mat to a campaign.

    Parameters
    ----------
    folder : Path
        Folder with both files.
    out : Path
        Campaign folder to write.

    Returns
    -------
    Path
        The campaign: two runs, position as input and motor force as channel.

    Raises
    ------
    ValueError
        Where a file is missing.
    """
    runs, noise = [], []
    for name, file in FILES.items():
        path = folder / file
        if not path.is_file():
            raise ValueError(f"{folder}: no file {file}; expected the folder of the EMPS benchmark")
        table = loadmat(path)
        position = np.asarray(table["qm"], dtype=np.float64).ravel()
        force = float(table["gtau"][0, 0]) * np.asarray(table["vir"], dtype=np.float64).ravel()
        step = 1.0 / SAMPLE_RATE
        above = (force - band_limited(force, step, _NOISE_FROM_HZ)).std()
        noise.append(above * np.sqrt(BAND_HZ / (0.5 * SAMPLE_RATE - _NOISE_FROM_HZ)))
        time = np.asarray(np.arange(0, position.size, _EVERY) * step, dtype=np.float64)
        inputs = {"displacement": band_limited(position, step, BAND_HZ / 0.8)[::_EVERY]}
        signals = {"force": band_limited(force, step, BAND_HZ / 0.8)[::_EVERY]}
        runs.append(Run(name, f"{name}.csv", name, time, inputs, signals))
    campaign = Campaign(
        kind="element",
        name="EMPS",
        baseline=Baseline("model"),
        rig={"drive": "displacement"},
        channels=(Channel("force", "force", "N", noise_std=float(np.mean(noise))),),
        runs=tuple(runs),
    )
    write_campaign(campaign, out)
    return out


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)
