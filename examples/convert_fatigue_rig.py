"""Turn a measured fatigue test rig in closed loop into a campaign of kind "element".

Data set "faster" of S. Dahdah and J. R. Forbes, "System norm regularization methods for Koopman
operator approximation" (2022): reference r, drive u, force y (scaled) and displacement d of a
specimen, 128 Hz. The loop fixes the displacement, so the specimen is looked at from displacement to
force. No noise is stated, so the campaign declares none.
"""

from pathlib import Path

import numpy as np

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel, InputSignal
from carrierflex.identification.campaign.records import Run

FILE = "faster.csv"
COLUMNS = ("t", "r", "u", "y", "d")
#: The record is one; its quarters are held out in turn.
_PIECES = 4


def main(folder: Path, *, out: Path) -> Path:
    """Convert faster.csv to a campaign.

    Parameters
    ----------
    folder : Path
        Folder with faster.csv.
    out : Path
        Campaign folder to write.

    Returns
    -------
    Path
        The campaign: four runs, displacement as input and force as channel, both scaled.

    Raises
    ------
    ValueError
        Where the file is missing or its columns are others.
    """
    path = folder / FILE
    if not path.is_file():
        raise ValueError(f"{folder}: no file {FILE}; expected the folder of the fatigue rig's data")
    header = path.read_text(encoding="utf-8").partition("\n")[0].strip().split(",")
    if tuple(header) != COLUMNS:
        raise ValueError(
            f"{path}: its columns are {', '.join(header)}; expected {', '.join(COLUMNS)}"
        )
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    # The time column is printed with five digits; the samples are evenly spaced.
    time = np.linspace(table[0, 0], table[-1, 0], len(table))
    runs = tuple(
        Run(
            f"quarter{k + 1}",
            f"quarter{k + 1}.csv",
            f"quarter {k + 1}",
            time[piece] - time[piece[0]],
            {"displacement": table[piece, COLUMNS.index("d")]},
            {"force": table[piece, COLUMNS.index("y")]},
        )
        for k, piece in enumerate(np.array_split(np.arange(len(table)), _PIECES))
    )
    campaign = Campaign(
        kind="element",
        name="Fatigue rig",
        baseline=Baseline("model"),
        rig={"drive": "displacement"},
        channels=(Channel("force", "force", "V"),),
        runs=runs,
        inputs=(InputSignal("displacement", "V"),),
    )
    write_campaign(campaign, out)
    return out


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)
