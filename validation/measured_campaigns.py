"""Campaigns of the measured records at hand: those with a converter, and three plain ones.

    python -m validation.measured_campaigns DATA --out FOLDER/campaigns/measured

`DATA` holds one folder a record (docs/validation.md), and of the plain ones

double_beam
    ``data.mat``: twelve hammer decays of a bolted double beam, laser velocity (two modes in 1:2
    internal resonance). Integrated to displacement above 60 Hz, every second sample.
sloshing
    ``xData.mat``: three decays of the centre of mass of a liquid in a tank, in widths of the tank.
shear_wall
    ``TS1_Experiment_Shear.csv`` and ``SPC1.csv``: cyclic tests of a steel shear wall and of a
    specimen, displacement to force, without time. A row counts as a second, so that damping has no
    meaning there; TS1 ends before its softening curve, SPC1 keeps every fourth row.
"""

import argparse
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.io import loadmat
from scipy.signal import butter, sosfiltfilt

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel
from carrierflex.identification.campaign.records import Run
from examples.convert_emps import main as convert_emps
from examples.convert_fatigue_rig import main as convert_fatigue_rig
from examples.convert_geared_servo import main as convert_geared_servo
from examples.convert_pendulum import main as convert_pendulum
from examples.convert_silverbox import main as convert_silverbox

FloatArray = NDArray[np.float64]

_BEAM_FROM_HZ, _BEAM_STEP = 60.0, 2
#: Rows of TS1 before its last, softening curve.
_WALL_ROWS = 8412
_SPECIMEN_STEP = 4
_PIECES = 4


def convert_double_beam(folder: Path, *, out: Path) -> Path:
    """Campaign of the double beam: free decays of its displacement [m]."""
    runs = []
    for k, row in enumerate(loadmat(folder / "data.mat")["xData"]):
        time = np.asarray(row[0], dtype=np.float64).ravel()
        velocity = np.asarray(row[1], dtype=np.float64).ravel()
        step = float(time[1] - time[0])
        filtered = butter(4, _BEAM_FROM_HZ, "highpass", fs=1.0 / step, output="sos")
        moved = cumulative_trapezoid(velocity, dx=step, initial=0.0)
        motion = sosfiltfilt(filtered, moved)[::_BEAM_STEP]
        runs.append(_decay(f"decay{k + 1}", motion, _BEAM_STEP * step))
    return _written(
        out, "Double beam", {"drive": "free_decay"}, Channel("motion", "displacement", "m"), runs
    )


def convert_sloshing(folder: Path, *, out: Path) -> Path:
    """Campaign of the sloshing liquid: free decays of its centre of mass."""
    runs = []
    for k, row in enumerate(loadmat(folder / "xData.mat")["xData"]):
        time, motion = (np.asarray(column, dtype=np.float64).ravel() for column in row)
        step = float(np.median(np.diff(time)))
        runs.append(_decay(f"decay{k + 1}", 1e-2 * motion, step))
    return _written(
        out, "Sloshing", {"drive": "free_decay"}, Channel("motion", "displacement", "m"), runs
    )


def convert_shear_wall(folder: Path, *, out: Path) -> Path:
    """Campaign of TS1, displacement [m] to force [N]."""
    table = np.genfromtxt(folder / "TS1_Experiment_Shear.csv", delimiter=",")[:_WALL_ROWS]
    return _cyclic(out, "Shear wall TS1", table[:, 0], table[:, 1])


def convert_specimen(folder: Path, *, out: Path) -> Path:
    """Campaign of SPC1, displacement [m] to force [N]."""
    table = np.genfromtxt(folder / "SPC1.csv", delimiter=",", skip_header=2)[::_SPECIMEN_STEP]
    return _cyclic(out, "Specimen SPC1", 1e-3 * table[:, 1], 1e3 * table[:, 0])


def _cyclic(out: Path, name: str, displacement: FloatArray, force: FloatArray) -> Path:
    runs = []
    pieces = zip(np.array_split(displacement, _PIECES), np.array_split(force, _PIECES), strict=True)
    for k, (moved, pushed) in enumerate(pieces):
        time = np.arange(float(moved.size))
        piece = f"piece{k + 1}"
        runs.append(
            Run(piece, f"{piece}.csv", piece, time, {"displacement": moved}, {"force": pushed})
        )
    return _written(out, name, {"drive": "displacement"}, Channel("force", "force", "N"), runs)


def _decay(name: str, motion: FloatArray, step: float) -> Run:
    time = step * np.arange(float(motion.size))
    return Run(name, f"{name}.csv", name, time, {}, {"motion": motion})


def _written(
    out: Path, name: str, rig: dict[str, object], channel: Channel, runs: list[Run]
) -> Path:
    campaign = Campaign(
        kind="element",
        name=name,
        baseline=Baseline("model"),
        rig=rig,
        channels=(channel,),
        runs=tuple(runs),
    )
    write_campaign(campaign, out)
    return out


#: Converter of each record, and its folder below the data.
RECORDS: dict[str, tuple[str, Callable[..., Path]]] = {
    "silverbox": ("silverbox", convert_silverbox),
    "emps": ("emps", convert_emps),
    "pendulum": ("pendulum", convert_pendulum),
    "geared_servo": ("bam", convert_geared_servo),
    "fatigue_rig": ("fatigue_rig", convert_fatigue_rig),
    "double_beam": ("double_beam", convert_double_beam),
    "sloshing": ("sloshing", convert_sloshing),
    "shear_wall": ("shear_wall", convert_shear_wall),
    "specimen": ("shear_wall", convert_specimen),
}


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path, help="folder of the records")
    parser.add_argument("--out", type=Path, required=True, help="folder of the campaigns")
    arguments = parser.parse_args()
    rows = []
    for name, (folder, convert) in RECORDS.items():
        target = arguments.out / name
        if not target.exists():
            convert(arguments.data / folder, out=target)
        rows.append({"case": name, "kind": "measured", "family": "measured", "folder": name})
    text = "".join(json.dumps(row) + "\n" for row in rows)
    (arguments.out / "cases.jsonl").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
