"""Identify the equivalent mass of the dynamometer's coupling and its arm from shaft bending.

The 2011 paper's identification of 4100 kg at 1.75 m (section 3). A good answer: moments that follow
the shaft's angle as the figure shows, a residual at the gauges' noise, and nothing undetermined.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.identification.carrier.parameter_estimate import ParameterEstimate
from carrierflex.identification.estimate_files import (
    identification_document,
    write_identification,
)
from carrierflex.identification.mounting.equivalent_mass import (
    bending_residuals,
    identify_equivalent_mass,
)
from carrierflex.workflows.outputs import prepared_folder, save_figure
from carrierflex.workflows.progress import Stages

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Samples of a channel that are drawn.
_MOST_DRAWN = 2000


@dataclass(frozen=True, eq=False)
class IdentifiedMass:
    """Campaign, estimate, time of the fit [s] and files."""

    measured: Campaign
    estimate: ParameterEstimate
    seconds: float
    files: tuple[Path, ...]


def identify(campaign: Path, out: Path, *, mass: float | None, quiet: bool) -> IdentifiedMass:
    """Fit mass and arm; write identification.json and bending.png.

    Raises
    ------
    ValueError
        Where the campaign is refused or has no bending moments.
    OSError
        Where `out` cannot be written.
    """
    stages = Stages(3, quiet)
    with stages.stage(f"reading {campaign}"):
        measured = read_campaign(campaign, bending=True)
    for note in measured.notes:
        stages.tell(note)
    with stages.stage("least squares"):
        start = perf_counter()
        estimate = identify_equivalent_mass(measured, mass=mass)
        seconds = perf_counter() - start
    prepared_folder(out)
    with stages.stage(f"writing {out}"):
        document = identification_document(
            measured.name, estimate, seconds=seconds, model_runs=1, warnings=()
        )
        files = (out / "identification.json", out / "bending.png")
        write_identification(files[0], document)
        save_figure(files[1], bending_figure(measured, estimate, mass))
    return IdentifiedMass(measured, estimate, seconds, files)


def bending_figure(campaign: Campaign, estimate: ParameterEstimate, mass: float | None) -> Figure:
    """Measured and identified moments over the shaft's angle, one panel a channel."""
    from matplotlib.figure import Figure

    residuals = bending_residuals(campaign, mass)
    channels = residuals.campaign.channels
    figure = Figure(figsize=(11.0, 2.2 + 2.2 * len(channels)), layout="constrained")
    panels = np.atleast_1d(figure.subplots(len(channels), 1, sharex=True))
    for number, run in enumerate(residuals.campaign.runs):
        predicted = residuals.moments(estimate.values, run.name)
        every = max(1, run.time.size // _MOST_DRAWN)
        turn = np.rad2deg(run.inputs["carrier_angle"][::every]) % 360.0
        order = np.argsort(turn)
        for panel, channel in zip(panels, channels, strict=True):
            measured, fitted = run.signals[channel.name], predicted[channel.name]
            zero = np.nanmean(measured - fitted)
            panel.plot(
                turn,
                measured[::every] / 1e3,
                ".",
                color=f"C{number}",
                ms=2,
                alpha=0.5,
                label=f"{run.name}, measured",
            )
            panel.plot(
                turn[order],
                (fitted + zero)[::every][order] / 1e3,
                ".",
                color="black",
                ms=1,
                label="identified" if number == 0 else None,
            )
            panel.set_ylabel(f"{channel.name} [kN m]")
    for panel in panels:
        panel.grid(alpha=0.3)
    panels[0].legend(fontsize="small", markerscale=4)
    panels[-1].set(xlabel="angle of the shaft [deg]", xlim=(0.0, 360.0))
    figure.suptitle(campaign.name)
    return figure
