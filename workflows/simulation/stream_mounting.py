"""Simulate the housing's motion sensors over records of any length, in constant memory.

The campaign of :mod:`carrierflex.workflows.simulation.simulate_mounting` with Parquet in place of
CSV: a load history of certification length (1e5 s) takes seconds and a gigabyte of disk, and
``identify`` reads it in pieces too.
"""

import shutil
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from carrierflex.identification.campaign.campaign_files import CASE_COPY, write_campaign
from carrierflex.identification.campaign.growing_runs import growing_runs
from carrierflex.identification.campaign.simulated_campaign import simulated_mounting_campaign
from carrierflex.simulation.mounting.case_files import (
    MountingCase,
    MountingRun,
    read_mounting_case,
    refuse_long_runs,
)
from carrierflex.simulation.mounting.history_inputs import history_pieces
from carrierflex.simulation.mounting.record_files import (
    Piece,
    extreme_loads,
    marched_pieces,
    write_record,
)
from carrierflex.simulation.mounting.simulate import DivergedError, MountingResponse, with_noise
from carrierflex.workflows.progress import Stages
from carrierflex.workflows.simulation.simulate_mounting import SimulatedMounting, cut_run

#: Samples of a piece: 10 MB with everything that is made of them.
_PIECE = 100_000


def main(case: Path, *, out: Path, quiet: bool = False) -> SimulatedMounting:
    """Simulate the housing's motion sensors and write them as a campaign folder with Parquet files.

    Parameters
    ----------
    case : Path
        Case file of kind mounting (TOML) without a sensor delay; SI units.
    out : Path
        Campaign folder to write: new, empty, or an earlier simulated campaign.
    quiet : bool
        Show no progress.

    Raises
    ------
    ValueError
        Where the case is refused, or the folder holds something that is not a campaign.
    DivergedError, KeyboardInterrupt
        Where a run stops; what there is of it is written first.
    """
    what = read_mounting_case(case)
    refuse_long_runs(what, str(case), piecewise=True)
    if what.bending:
        raise ValueError(
            f"{case}: [[bending]] is given, and records this long are written piece by piece "
            "without bending moments; expected shorter runs or no such table"
        )
    rng = np.random.default_rng(what.seed)
    weights = (*(run.history.duration for run in what.runs), 0.0)
    stages = Stages(len(weights), quiet, weights)
    runs = []
    ends = []
    files = {}
    stopped: BaseException | None = None
    with growing_runs(out) as growing:
        for run in what.runs:
            path, end = growing.folder / f"{run.name}.parquet", deque[Piece](maxlen=1)
            with stages.stage(f"{run.name}, {run.history.duration:g} s"):
                try:
                    write_record(_measured(what, run, rng, end, stages.note), path)
                except (DivergedError, KeyboardInterrupt) as error:
                    stopped = error
            if end:
                inputs, response = end[0][0], MountingResponse(end[0][0].time, end[0][1])
                runs.append(run if stopped is None else cut_run(run, response, stopped))
                ends.append((inputs, response))
                files[path.name] = path
            if stopped is not None:
                break
        campaign = simulated_mounting_campaign(
            replace(what, runs=tuple(runs)), ends, suffix=".parquet"
        )
        if runs:
            with stages.stage(f"writing {out}"):
                write_campaign(
                    campaign,
                    out,
                    simulated=True,
                    more_files={CASE_COPY: partial(shutil.copyfile, case)},
                    written_files=files,
                )
    if stopped is not None:
        raise stopped
    lengths = {run.name: round(run.history.duration * run.history.sample_rate) for run in runs}
    return SimulatedMounting(what, campaign, out, n_samples=lengths)


def _measured(
    what: MountingCase,
    run: MountingRun,
    rng: np.random.Generator,
    end: deque[Piece],
    note: Callable[[str, float], None],
) -> Iterator[Piece]:
    """Pieces of a run with noise, the last one kept in `end`."""
    history = run.history
    loads = extreme_loads(history_pieces(history, _PIECE))
    pieces = history_pieces(history, _PIECE)
    for inputs, signals in marched_pieces(
        what.rig, what.truth, pieces, largest_loads=loads, step=what.step
    ):
        noisy = with_noise(MountingResponse(inputs.time, signals), what.noise_std, rng).signals
        end.append((inputs, noisy))
        yield inputs, noisy
        reached = float(inputs.time[-1])
        note(f"{reached:.0f} s", reached / history.duration)
