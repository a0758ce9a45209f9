"""Simulate what the sensors would read in a set of load cases.

At the carrier's rim, or on the gearbox's housing.

Reads a case (the shipped ones hold LC1 to LC4 of the 2012 paper and the load history of the 2011
paper), simulates every run and writes a campaign folder that ``identify`` and ``diagnose`` read
like a measurement. A good answer at the rim: the order-1 swing of the tilt rules the axial signals,
with three small peaks a revolution of the deflection on top of it. On the housing: rest, a step of
millimetres with the radial load, and the roll that opens ssz from spz with the torque.
"""

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from carrierflex.fe.curve_files import read_curves, write_curves
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import CASE_COPY, write_campaign
from carrierflex.identification.campaign.simulated_campaign import CURVES_FILE, simulated_campaign
from carrierflex.simulation.carrier.case_files import SimulationCase, read_case, read_case_document
from carrierflex.simulation.carrier.motion import simulate_run
from carrierflex.simulation.stage.stage_cases import STAGE_FORMAT
from carrierflex.workflows.simulation import simulate_mounting, simulate_stage
from carrierflex.workflows.support.progress import Stages


@dataclass(frozen=True, eq=False)
class SimulatedLoadCases:
    """What the workflow made.

    Parameters
    ----------
    case : SimulationCase
        The case with its truth.
    campaign : Campaign
        The simulated records.
    folder : Path
        Where they were written.
    """

    case: SimulationCase
    campaign: Campaign
    folder: Path


def main(
    case: Path,
    *,
    out: Path,
    curves: Path | None = None,
    linearised: Path | None = None,
    quiet: bool = False,
) -> SimulatedLoadCases | simulate_mounting.SimulatedMounting | simulate_stage.SimulatedStage:
    """Simulate the sensors in a set of load cases and write them as a campaign folder.

    Parameters
    ----------
    case : Path
        Case file (TOML): rig, sensors and runs with the carrier's true motion, or of kind mounting,
        or a stage case, in which the whole planetary stage runs; SI units.
    out : Path
        Campaign folder to write: new, empty, or an earlier campaign.
    curves : Path, optional
        Deflection curves of the carrier (CSV: theta_deg, delta_s, delta_f [m per kN m]); without it
        those of the default carrier serve. A case of kind mounting has none.
    linearised : Path, optional
        Folder for the modes, the frequency response of the sensors and the Campbell diagram of a
        case of kind mounting.
    quiet : bool
        Show no progress.

    Returns
    -------
    SimulatedLoadCases, SimulatedMounting or SimulatedStage
        The case, the campaign and its folder.

    Raises
    ------
    ValueError
        Where the case or the curves are refused, or the folder holds something that is not a
        campaign.
    """
    document = read_case_document(case)
    if linearised is not None and document.get("kind") != "mounting":
        raise ValueError(
            f"--linearised is {linearised}; only a case of kind mounting is linearised here"
        )
    if document.get("format") == STAGE_FORMAT:
        return simulate_stage.main(case, out=out, curves=curves, quiet=quiet)
    if document.get("kind") != "mounting":
        return simulate_carrier(case, out=out, curves=curves, quiet=quiet)
    if curves is not None:
        raise ValueError(f"--curves is {curves}; a case of kind mounting has no deflection curves")
    return simulate_mounting.main(case, out=out, linearised=linearised, quiet=quiet)


def simulate_carrier(
    case: Path, *, out: Path, curves: Path | None = None, quiet: bool = False
) -> SimulatedLoadCases:
    """Simulate the rim sensors in a set of load cases and write them as a campaign folder.

    Parameters
    ----------
    case : Path
        Case file (TOML): rig, sensors and runs with the carrier's true motion; SI units.
    out : Path
        Campaign folder to write: new, empty, or an earlier campaign.
    curves : Path, optional
        Deflection curves (CSV: theta_deg, delta_s, delta_f [m per kN m]); without it those of the
        default carrier serve.
    quiet : bool
        Show no progress.

    Returns
    -------
    SimulatedLoadCases
        The case, the campaign and its folder.

    Raises
    ------
    ValueError
        Where the case or the curves are refused, or the folder holds something that is not a
        campaign.
    """
    if curves is None:
        from carrierflex.workflows.support.default_curves import default_curves

        curve_set = default_curves()
    else:
        curve_set = read_curves(curves)
    what = read_case(case, curve_set["delta_f"])
    rng = np.random.default_rng(what.seed)
    stages = Stages(len(what.runs) + 1, quiet)
    records = []
    for run in what.runs:
        with stages.stage(f"{run.name}, {run.duration:g} s"):
            delta_s, delta_f = curve_set["delta_s"], curve_set["delta_f"]
            records.append(
                simulate_run(run, what.sensors, delta_s, delta_f, noise_std=what.noise_std, rng=rng)
            )
    campaign = simulated_campaign(
        what.name,
        what.sensors,
        list(zip(what.runs, records, strict=True)),
        rig=what.rig,
        noise_std=what.noise_std,
    )
    more_files: dict[str, Callable[[Path], None]] = {
        CURVES_FILE: lambda path: write_curves(path, curve_set),
        CASE_COPY: partial(_copy, case),
    }
    with stages.stage(f"writing {out}"):
        write_campaign(campaign, out, more_files=more_files)
    return SimulatedLoadCases(what, campaign, out)


def _copy(source: Path, path: Path) -> None:
    shutil.copyfile(source, path)
