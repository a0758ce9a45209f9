"""Simulate the six motion sensors on the gearbox's housing under a load history.

Reads a case of kind ``mounting`` (the shipped one holds the load history of the 2011 paper),
simulates every run with its true bushings and writes a campaign folder. A good answer: rest, a step
of millimetres with the radial load, and the roll that opens ssz from spz with the torque. A run
that diverges or is interrupted ends the work; what came of it is written.
"""

import shutil
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.whole_folders import check_writable
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import (
    CASE_COPY,
    prepare_campaign_folder,
    write_campaign,
)
from carrierflex.identification.campaign.simulated_campaign import simulated_mounting_campaign
from carrierflex.simulation.mounting import energy
from carrierflex.simulation.mounting.case_files import (
    MountingCase,
    MountingRun,
    read_mounting_case,
    refuse_long_runs,
)
from carrierflex.simulation.mounting.history_inputs import history_inputs
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.simulate import (
    DivergedError,
    MountingResponse,
    response_of,
    signal_pieces,
    with_noise,
)
from carrierflex.workflows.progress import Stages
from carrierflex.workflows.simulation import linearise_mounting


@dataclass(frozen=True, eq=False)
class SimulatedMounting:
    """What the workflow made."""

    case: Annotated[MountingCase, "The case with its truth"]
    campaign: Annotated[Campaign, "The simulated records"]
    folder: Annotated[Path, "Where they were written"]
    n_samples: Annotated[
        Mapping[str, int], "Length of runs of which the campaign holds the last piece alone"
    ] = field(default_factory=dict)
    balances: Annotated[
        Mapping[str, energy.EnergyBalance], "Energies of each run, where requested"
    ] = field(default_factory=dict)

    @property
    def met(self) -> bool:
        """Whether every energy balance that was made closes to 0.1 % of the work."""
        return all(balance.error < energy.LARGEST_IMBALANCE for balance in self.balances.values())


def main(
    case: Path,
    *,
    out: Path,
    linearised: Path | None = None,
    energy_balance: bool = False,
    quiet: bool = False,
) -> SimulatedMounting:
    """Simulate the housing's motion sensors and write them as a campaign folder.

    Parameters
    ----------
    case : Path
        Case file of kind mounting (TOML); SI units.
    out : Path
        Campaign folder to write: new, empty, or an earlier simulated campaign.
    linearised : Path, optional
        Folder for modes, frequency response and Campbell diagram where each run carries its largest
        torque.
    energy_balance : bool
        Add up the energies of every run.
    quiet : bool
        Show no progress.

    Returns
    -------
    SimulatedMounting
        The case, the campaign and its folder.

    Raises
    ------
    ValueError
        Before the run, where the case is refused, or the folder holds something that is not a
        campaign.
    DivergedError
        Where a run leaves the model; what there is of it is written first.
    KeyboardInterrupt
        Likewise.
    """
    what = read_mounting_case(case)
    refuse_long_runs(what, str(case))
    prepare_campaign_folder(out)
    if linearised is not None:
        check_writable(linearised.parent)
    rng = np.random.default_rng(what.seed)
    stages = Stages(len(what.runs) * (1 + energy_balance) + 1 + (linearised is not None), quiet)
    runs, records = [], []
    stopped: BaseException | None = None
    for run in what.runs:
        with stages.stage(f"{run.name}, {run.history.duration:g} s"):
            inputs = history_inputs(run.history)
            signals, stopped = _signals(what, inputs)
        if len(signals) > 1:
            response = response_of(what.rig, what.truth, inputs, signals)
            records.append(
                (inputs.shortened(len(signals)), with_noise(response, what.noise_std, rng))
            )
            runs.append(run if stopped is None else cut_run(run, response, stopped))
        if stopped is not None:
            break
    campaign = simulated_mounting_campaign(replace(what, runs=tuple(runs)), records, rng=rng)
    if records:
        with stages.stage(f"writing {out}"):
            copies = {CASE_COPY: partial(shutil.copyfile, case)}
            write_campaign(campaign, out, simulated=True, more_files=copies)
    if stopped is not None:
        raise stopped
    if linearised is not None:
        with stages.stage(f"writing {linearised}"):
            linearise_mounting.main(what, out=linearised)
    balances = {}
    for run in what.runs if energy_balance else ():
        with stages.stage(f"energy balance of {run.name}"):
            inputs = history_inputs(run.history)
            balances[run.name] = energy.energy_balance(what.rig, what.truth, inputs, step=what.step)
    return SimulatedMounting(what, campaign, out, balances=balances)


def _signals(
    what: MountingCase, inputs: MountingInputs
) -> tuple[NDArray[np.float64], BaseException | None]:
    """Signals of a run as far as it came, and why it came no further."""
    pieces, stopped = [np.zeros((0, 6))], None
    try:
        for piece in signal_pieces(what.rig, what.truth, inputs, step=what.step):
            pieces.append(piece)  # one by one: a run that stops early keeps its pieces
    except (DivergedError, KeyboardInterrupt) as error:
        stopped = error
    return np.concatenate(pieces), stopped


def cut_run(run: MountingRun, response: MountingResponse, stopped: BaseException) -> MountingRun:
    """Run whose condition tells where it ends: it is no repeat of a whole one."""
    why = f"{stopped.coordinate} diverged" if isinstance(stopped, DivergedError) else "interrupted"
    return replace(run, condition=f"{run.condition}, cut at {response.time[-1]:g} s: {why}")
