"""Turn the measured Silverbox benchmark (electronic Duffing oscillator) into an element campaign.

T. Wigren, J. Schoukens, "Three free data sets for development and benchmarking in nonlinear system
identification" (2013): input V1 and output V2 [V], ten realisations of a multisine and a noise of
growing amplitude ("arrow").
"""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel, InputSignal
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.signals import band_limited

SAMPLE_RATE = 1e7 / 2**14
#: Official split (0-based, half open), and the condition each part belongs to.
RECORDS = {
    "multisine": (40650, 105712, "multisine"),
    "multisine_test": (105712, 127400, "multisine"),
    "arrow": (100, 40575, "arrow"),
}
#: The drive ends at 200 Hz; what the output holds above is noise.
_DRIVE_END_HZ = 210.0
_SETTLE_SAMPLES = 100


def main(folder: Path, *, out: Path) -> Path:
    """Convert SNLS80mV.mat to a campaign.

    Parameters
    ----------
    folder : Path
        Folder with SNLS80mV.mat.
    out : Path
        Campaign folder to write.

    Returns
    -------
    Path
        The campaign: three runs, force and displacement in volts; the noise is what the output
        holds above the drive's band.

    Raises
    ------
    ValueError
        Where the file is missing.
    """
    path = folder / "SNLS80mV.mat"
    if not path.is_file():
        raise ValueError(
            f"{folder}: no file SNLS80mV.mat; expected the folder of the Silverbox benchmark"
        )
    table = loadmat(path)
    drive, response = (np.asarray(table[name], dtype=np.float64).ravel() for name in ("V1", "V2"))
    drive, response = drive - drive.mean(), response - response.mean()
    runs = []
    for name, (first, last, condition) in RECORDS.items():
        time = np.arange(last - first) / SAMPLE_RATE
        inputs, signals = {"force": drive[first:last]}, {"displacement": response[first:last]}
        runs.append(Run(name, f"{name}.csv", condition, time, inputs, signals))
    noise = response - band_limited(response, 1.0 / SAMPLE_RATE, _DRIVE_END_HZ / 0.8)
    # White noise: what lies above the band, scaled up to the whole of it.
    above = 1.0 - _DRIVE_END_HZ / 0.9 / (0.5 * SAMPLE_RATE)
    channel = Channel(
        "displacement", "displacement", "V", noise_std=float(noise.std() / np.sqrt(above))
    )
    campaign = Campaign(
        kind="element",
        name="Silverbox",
        baseline=Baseline("model"),
        rig={"drive": "force", "settle_samples": _SETTLE_SAMPLES},
        channels=(channel,),
        runs=tuple(runs),
        inputs=(InputSignal("force", "V"),),
    )
    write_campaign(campaign, out)
    return out


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)
