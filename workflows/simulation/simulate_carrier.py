"""Simulate what the sensors at the carrier's rim would read in a set of load cases.

Reads a case (the shipped one holds LC1 to LC4 of the 2012 paper), simulates every run from the
carrier's true motion and writes a campaign folder. A good answer: the order-1 swing of the tilt
rules the axial signals, with three small peaks a revolution of the deflection on top of it.
"""

import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np

from carrierflex.fe.curve_files import read_curves, write_curves
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import (
    CASE_COPY,
    LAW_COPY,
    prepare_campaign_folder,
    write_campaign,
)
from carrierflex.identification.campaign.simulated_campaign import CURVES_FILE, simulated_campaign
from carrierflex.simulation.carrier.case_files import SimulationCase, read_case
from carrierflex.simulation.carrier.measured_laws.carrier_laws import refuse_other_rig
from carrierflex.simulation.carrier.motion import simulate_run
from carrierflex.simulation.law_files import read_law
from carrierflex.simulation.laws import CARRIER, Law
from carrierflex.simulation.record_size import MOST_IN_MEMORY, refuse_size
from carrierflex.workflows.progress import Stages


@dataclass(frozen=True, eq=False)
class SimulatedLoadCases:
    """What the workflow made."""

    case: Annotated[SimulationCase, "The case with its truth"]
    campaign: Annotated[Campaign, "The simulated records"]
    folder: Annotated[Path, "Where they were written"]


def main(
    case: Path,
    *,
    out: Path,
    curves: Path | None = None,
    law: list[Path] | None = None,
    quiet: bool = False,
) -> SimulatedLoadCases:
    """Simulate the rim sensors in a set of load cases and write them as a campaign folder.

    Parameters
    ----------
    case : Path
        Case file (TOML): rig, sensors and runs with the carrier's true motion; SI units.
    out : Path
        Campaign folder to write: new, empty, or an earlier simulated campaign.
    curves : Path, optional
        Deflection curves (CSV: theta_deg, delta_s, delta_f [m per kN m]); without it those of the
        default carrier serve.
    law : list of Path, optional
        Law files (TOML) of diagnose --save-law whose signals are added to the case's truth; out
        takes copies.
    quiet : bool
        Show no progress.

    Returns
    -------
    SimulatedLoadCases
        The case, the campaign and its folder.

    Raises
    ------
    ValueError
        Where the case, the curves or a law are refused, or the folder holds something that is not
        a campaign.
    """
    if curves is None:
        from carrierflex.workflows.fe.default_curves import default_curves

        curve_set = default_curves()
    else:
        curve_set = read_curves(curves)
    what = read_case(case, curve_set["delta_f"])
    laws = _laws(law or (), what)
    _refuse_size(case, what)
    prepare_campaign_folder(out)
    rng = np.random.default_rng(what.seed)
    stages = Stages(len(what.runs) + 1, quiet)
    records = []
    for run in what.runs:
        with stages.stage(f"{run.name}, {run.duration:g} s"):
            delta_s, delta_f = curve_set["delta_s"], curve_set["delta_f"]
            records.append(
                simulate_run(
                    run,
                    what.sensors,
                    delta_s,
                    delta_f,
                    noise_std=what.noise_std,
                    rng=rng,
                    laws=laws,
                )
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
        CASE_COPY: partial(shutil.copyfile, case),
        **{
            LAW_COPY.format(number): partial(shutil.copyfile, path)
            for number, path in enumerate(law or (), start=1)
        },
    }
    with stages.stage(f"writing {out}"):
        write_campaign(campaign, out, simulated=True, more_files=more_files)
    return SimulatedLoadCases(what, campaign, out)


def _laws(paths: Sequence[Path], what: SimulationCase) -> tuple[Law, ...]:
    """Laws of files, all of the case's rig."""
    laws = []
    for path in paths:
        law = read_law(path)
        if law.kind != CARRIER:
            raise ValueError(
                f"{path}: law '{law.name}' is not of a carrier, which the case is; expected a law "
                f"file of kind {CARRIER}"
            )
        refuse_other_rig(law, int(what.rig["n_planets"]), float(what.rig["sensor_radius"]))
        laws.append(law)
    return tuple(laws)


def _refuse_size(case: Path, what: SimulationCase) -> None:
    first = what.runs[0]
    columns = len(what.sensors) + 5  # time and four inputs
    refuse_size(
        str(case),
        {"duration [s]": first.duration, "sample_rate_hz [1/s]": first.sample_rate},
        first.duration * first.sample_rate * columns * len(what.runs),
        MOST_IN_MEMORY,
    )
