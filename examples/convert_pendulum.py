"""Turn a measured pendulum that swings freely into a campaign of kind "element".

K. Kaheman and others, "The experimental multi-arm pendulum on a cart" (2022): angle and rate of a
single pendulum, 1 kHz, 55 s. The angle is counted from the upright position; here it is that from
the hanging one, so that the spring's force has its zero there. The record was smoothed before it
was published, so the campaign declares no noise.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.signals import band_limited

FILE = "SinglePendulumDataForParameterEstimation.mat"
SAMPLE_RATE = 1000.0
#: The swing is near 1.2 Hz; twenty harmonics of it are kept, at 100 samples a second.
BAND_HZ = 25.0
_EVERY = 10
_PIECES = 6


def main(folder: Path, *, out: Path, contains_quintic: bool = False) -> Path:
    """Convert SinglePendulumDataForParameterEstimation.mat to a campaign.

    Parameters
    ----------
    folder : Path
        Folder with the file.
    out : Path
        Campaign folder to write.
    contains_quintic : bool
        Put cubic and quintic stiffness into the baseline, whose refit then gives their values.

    Returns
    -------
    Path
        The campaign: six pieces of one decay, angle as channel [rad], forces per moment of inertia.

    Raises
    ------
    ValueError
        Where the file is missing or holds other variables.
    """
    angle = _angle(folder / FILE)
    thinned = band_limited(angle, 1.0 / SAMPLE_RATE, BAND_HZ / 0.8)[::_EVERY]
    runs = []
    for k, piece in enumerate(np.array_split(thinned, _PIECES)):
        time = np.arange(piece.size, dtype=np.float64) * (_EVERY / SAMPLE_RATE)
        name = f"swing{k + 1}"
        runs.append(Run(name, f"{name}.csv", f"piece {k + 1}", time, {}, {"angle": piece}))
    effects = ("cubic_stiffness", "quintic_stiffness") if contains_quintic else ()
    campaign = Campaign(
        kind="element",
        name="Pendulum",
        baseline=Baseline("model", effects),
        rig={"drive": "free_decay"},
        channels=(Channel("angle", "displacement", "rad"),),
        runs=tuple(runs),
    )
    write_campaign(campaign, out)
    return out


def _angle(path: Path) -> NDArray[np.float64]:
    """Angle from the hanging position [rad], all pieces of the file one after the other."""
    if not path.is_file():
        raise ValueError(f"{path.parent}: no file {path.name}; expected the pendulum's data")
    table = loadmat(path)
    missing = [name for name in ("Y_id", "Y_vad") if name not in table]
    if missing:
        raise ValueError(f"{path}: no variable {missing[0]}; expected Y_id and Y_vad")
    pieces = [piece[0] for name in ("Y_id", "Y_vad") for piece in table[name].ravel()]
    return np.concatenate(pieces).astype(np.float64) - np.pi


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)
