"""Identify the motion of the carrier that explains the signals of the rim sensors.

Fits M1 (offset and two tilts) or M2 (M1 and the two deflection curves) of the 2012 paper, and writes
identification.json with the plots of the paper's figures 9 to 11. A good answer: M2 follows the signals up to a
constant of each sensor, its RMS is never above that of M1, and rho_s and rho_f are not negative.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Literal

from fe.curve_files import read_curves
from identification.campaign import Campaign
from identification.campaign_files import read_campaign
from identification.carrier_identification import axial_channels, identify_each_run, identify_jointly
from identification.carrier_models import CarrierModel, flexible_model, rigid_model
from identification.estimate_files import identification_document, write_identification
from identification.parameter_estimate import ParameterEstimate
from identification.view import parameters_figure, rms_figure, signals_figure
from workflows.outputs import prepared_folder, save_figure
from workflows.progress import Stages


@dataclass(frozen=True, eq=False)
class Identification:
    """What the workflow found: names, estimates by model and run (a joint one under every run), fit time [s], files."""

    campaign: str
    model: str
    estimates: Mapping[str, Mapping[str, ParameterEstimate]]
    seconds: float
    files: tuple[Path, ...]


def main(
    campaign: Path, *, model: Literal["m1", "m2"], out: Path, per_run: bool = False, quiet: bool = False
) -> Identification:
    """Identify the motion of the planet carrier from a measurement campaign.

    Parameters
    ----------
    campaign : Path
        Campaign folder of kind "carrier".
    model : {"m1", "m2"}
        Rigid motion, or rigid motion and deflection under torque.
    out : Path
        Folder for identification.json and the plots.
    per_run : bool
        Fit every run by itself, the papers' way, instead of sharing phi_PLC, theta_PLC, rho_s and rho_f.

    quiet : bool
        Show no progress.

    Returns
    -------
    Identification
        Estimates with their uncertainty, RMS in m, angles in rad.

    Raises
    ------
    ValueError
        Where the campaign is refused or is of another kind.
    OSError
        Where `out` cannot be written.
    """
    stages = Stages(3, quiet)
    with stages.stage(f"reading {campaign}"):
        measured = read_campaign(campaign)
        models = _models(measured, campaign, model)
    prepared_folder(out)
    identify = identify_each_run if per_run else _identify_jointly
    estimates: dict[str, Mapping[str, ParameterEstimate]] = {}
    with stages.stage("least squares"):
        for one in models:
            start = perf_counter()
            estimates[one.name] = identify(measured, one)
            seconds = perf_counter() - start
    found = estimates[model]
    reported = found if per_run else next(iter(found.values()))
    with stages.stage(f"writing {out}"):
        document = identification_document(measured.name, reported, seconds=seconds, model_runs=1)
        write_identification(out / "identification.json", document)
        names = _drawn(out, measured, models, estimates)
    files = tuple(out / name for name in ("identification.json", *names))
    return Identification(measured.name, model, estimates, seconds, files)


def _drawn(
    out: Path,
    measured: Campaign,
    models: Sequence[CarrierModel],
    estimates: Mapping[str, Mapping[str, ParameterEstimate]],
) -> tuple[str, ...]:
    """Write the plots into `out`; their names."""
    channels = axial_channels(measured)
    figures = {"rms.png": rms_figure(estimates), "parameters.png": parameters_figure(estimates)}
    for run in measured.runs:
        fits = [(one, estimates[one.name][run.name]) for one in models]
        figures[f"signals_{Path(run.file).stem}.png"] = signals_figure(run, channels, fits)
    for name, figure in figures.items():
        save_figure(out / name, figure)
    return tuple(figures)


def _identify_jointly(measured: Campaign, model: CarrierModel) -> dict[str, ParameterEstimate]:
    return dict.fromkeys([run.name for run in measured.runs], identify_jointly(measured, model))


def _models(measured: Campaign, folder: Path, last: str) -> list[CarrierModel]:
    """Models up to the one asked for: M2 is shown beside M1."""
    axial_channels(measured)  # refuses a campaign of another kind before anything is written
    if last == "m1":
        return [rigid_model()]
    if "deflection_curves" in measured.rig:
        curves = read_curves(folder / measured.rig["deflection_curves"])
    else:
        from workflows.default_curves import default_curves

        curves = default_curves()
    return [rigid_model(), flexible_model(curves["delta_s"], curves["delta_f"])]
