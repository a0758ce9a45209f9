"""Figures of an identified carrier: RMS and parameters of the runs, signals of the least explained.

After figures 9 to 11 of the 2012 paper.
"""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.carrier.carrier_identification import axial_channels
from carrierflex.identification.carrier.models import CarrierModel
from carrierflex.identification.carrier.parameter_estimate import ParameterEstimate
from carrierflex.identification.view import parameters_figure, rms_figure, signals_figure
from carrierflex.workflows.outputs import save_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Runs whose signals are drawn, and sensors of each, those that the model explains least: nobody
#: looks at hundreds.
_MOST_DRAWN = 12
#: Model and estimate by model name and run.
Fits = Mapping[str, Mapping[str, tuple[CarrierModel, ParameterEstimate]]]


def write_figures(
    out: Path,
    measured: Campaign,
    fits: Fits,
    model: str,
    *,
    note: Callable[[str, float], None] = lambda text, share: None,
) -> tuple[str, ...]:
    """Write the plots, each before the next is made.

    Parameters
    ----------
    out : Path
        Folder.
    measured : Campaign
        Records.
    fits : mapping of str to mapping of str to tuple
        Model and estimate by model name and run.
    model : str
        Model by which runs and sensors are chosen.
    note : callable
        Told each plot with the share that is written.

    Returns
    -------
    tuple of str
        Names of the files.
    """
    n_figures = 2 + min(len(measured.runs), _MOST_DRAWN)
    names = []
    for name, figure in _figures(measured, fits, model):
        save_figure(out / name, figure)
        names.append(name)
        note(name, len(names) / n_figures)
    return tuple(names)


def _figures(measured: Campaign, fits: Fits, model: str) -> Iterator[tuple[str, "Figure"]]:
    """Plots and their file names."""
    estimates = {
        name: {run: estimate for run, (_, estimate) in by_run.items()}
        for name, by_run in fits.items()
    }
    yield "rms.png", rms_figure(estimates)
    yield "parameters.png", parameters_figure(estimates)

    def rms(run: Run) -> float:
        return estimates[model][run.name].rms_by_run[run.name]

    least = {run.name for run in sorted(measured.runs, key=rms)[-_MOST_DRAWN:]}
    for run in measured.runs:
        if run.name in least:
            shown = [by_run[run.name] for by_run in fits.values()]
            channels = _least_explained(
                axial_channels(measured), estimates[model][run.name].rms_by_channel[run.name]
            )
            yield f"signals_{Path(run.file).stem}.png", signals_figure(run, channels, shown)


def _least_explained(channels: tuple[Channel, ...], rms: Mapping[str, float]) -> list[Channel]:
    """Sensors that are drawn, in their order."""

    def size(channel: Channel) -> tuple[bool, float]:
        """RMS; none where the channel is missing in the run, which comes first."""
        return rms[channel.name] >= 0.0, rms[channel.name]

    drawn = sorted(channels, key=size)[-_MOST_DRAWN:]
    return [channel for channel in channels if channel in drawn]
