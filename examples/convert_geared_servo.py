"""Turn the measured decays of a geared servo into a campaign of kind "element".

M. Duclusaud and others, "Extended friction models for the physics simulation of servo actuators"
(2024, repository Rhoban/bam): a servo lifts an arm, its torque is switched off, and
the arm swings down through its gears. Every file (``*.json``) is one lift and drop; what counts is
the swing after the torque has gone. The noise declared is that of the position's steps.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel
from carrierflex.identification.campaign.records import Run

#: Keys of one sample that are used.
_KEYS = ("timestamp", "position", "torque_enable")
#: Steps of the position in one turn.
_STEPS_A_TURN = 4096


def main(folder: Path, *, out: Path) -> Path:
    """Convert every JSON file of a folder to one run of a campaign.

    Parameters
    ----------
    folder : Path
        Folder with the JSON files.
    out : Path
        Campaign folder to write.

    Returns
    -------
    Path
        The campaign: one decay a run, angle as channel [rad], forces per moment of inertia.

    Raises
    ------
    ValueError
        Where there is no such file, a key is missing, or the torque is never switched off.
    """
    files = sorted(folder.glob("*.json"))
    if not files:
        raise ValueError(f"{folder}: no file *.json; expected the records of the geared servo")
    step = 2.0 * np.pi / _STEPS_A_TURN
    channel = Channel("angle", "displacement", "rad", noise_std=float(step / np.sqrt(12.0)))
    campaign = Campaign(
        kind="element",
        name="Geared servo",
        baseline=Baseline("model"),
        rig={"drive": "free_decay"},
        channels=(channel,),
        runs=tuple(_decay(path, k + 1) for k, path in enumerate(files)),
    )
    write_campaign(campaign, out)
    return out


def _decay(path: Path, number: int) -> Run:
    """Samples after the torque is switched off, time from there."""
    entries = _entries(path)
    driven = np.array([bool(entry["torque_enable"]) for entry in entries])
    if driven.all() or not driven.any():
        raise ValueError(f"{path}: torque_enable never changes; expected a drop after the lift")
    free = entries[int(np.flatnonzero(driven)[-1]) + 1 :]
    time = np.array([entry["timestamp"] for entry in free], dtype=np.float64)
    angle = np.array([entry["position"] for entry in free], dtype=np.float64)
    name = f"drop{number}"
    return Run(name, f"{name}.csv", f"drop {number}", time - time[0], {}, {"angle": angle})


def _entries(path: Path) -> list[dict[str, Any]]:
    try:
        entries = list(json.loads(path.read_text(encoding="utf-8"))["entries"])
    except (json.JSONDecodeError, UnicodeDecodeError, KeyError, TypeError) as error:
        raise ValueError(f"{path}: no record of the geared servo: {error}") from error
    for entry in entries:
        for key in _KEYS:
            if key not in entry:
                raise ValueError(f"{path}: a sample has no key '{key}'; expected {_KEYS}")
    return entries


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)
