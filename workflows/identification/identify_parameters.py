"""Identify the carrier's motion, or the mounting's bushings, that explain the measured signals.

Bushing models stand in :mod:`carrierflex.workflows.identification.identify_bushings`. For a carrier
this fits M1 (offset and two tilts) or M2 (M1 and the two deflection curves) of the 2012 paper, and
writes identification.json with the plots of the paper's figures 9 to 11. A good answer: M2 follows
the signals up to a constant of each sensor, its RMS is never above that of M1, and rho_s and rho_f
are not negative.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Literal

from carrierflex.fe.curve_files import read_curves
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.files.json_files import save_json
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.identification.campaign.campaign_header import CampaignHeader
from carrierflex.identification.campaign.document_files import read_campaign_header
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning
from carrierflex.identification.carrier.models import (
    CarrierModel,
    flexible_model,
    rigid_model,
    with_radial_motion,
)
from carrierflex.workflows.outputs import prepared_folder, save_figure
from carrierflex.workflows.progress import Stages

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from carrierflex.identification.campaign.declarations import Channel
    from carrierflex.identification.campaign.records import Run
    from carrierflex.identification.carrier.carrier_identification import FitOptions
    from carrierflex.identification.carrier.parameter_estimate import ParameterEstimate
    from carrierflex.identification.carrier.robust_loss import Outliers
    from carrierflex.workflows.identification.identify_bushings import BushingIdentification

    #: Model and estimate by model name and run.
    Fits = Mapping[str, Mapping[str, tuple[CarrierModel, ParameterEstimate]]]


#: Runs whose signals are drawn, and sensors of each, those that the model explains least: nobody
#: looks at hundreds.
_MOST_DRAWN = 12


@dataclass(frozen=True, eq=False)
class Identification:
    """What the workflow found.

    Names, estimates by model and run (a joint one under every run), fit time [s], files,
    samples far outside, what does not look right in the records in memory, and factor and unit of
    the RMS on the screen.
    """

    campaign: str
    model: str
    estimates: Mapping[str, Mapping[str, ParameterEstimate]]
    seconds: float
    files: tuple[Path, ...]
    outliers: tuple[Outliers, ...] = field(default=())
    warnings: tuple[CampaignWarning, ...] = field(default=())
    rms_unit: tuple[float, str] = (1e3, "mm")


def main(
    campaign: Path,
    *,
    model: Literal[
        "m1",
        "m2",
        "linear_bushing",
        "nonlinear_bushing",
        "hydrodynamic_bushing",
        "equivalent_mass",
    ],
    out: Path,
    per_run: bool = False,
    sensors: Literal["axial", "all"] = "axial",
    loss: Literal["squares", "huber"] = "squares",
    free_pin_angle: bool = False,
    samples_per_revolution: int = 0,
    bootstrap: int = 0,
    seed: int = 0,
    weights: dict[str, float] | None = None,
    axial: Literal["shown", "all", "none"] = "shown",
    profile: tuple[str, ...] = (),
    compare_complex: bool = False,
    housing_motion: bool = False,
    mass: float | None = None,
    workers: int = 1,
    scheduler: str | None = None,
    quiet: bool = False,
) -> Identification | BushingIdentification:
    """Identify the motion of the planet carrier, or the bushings of the mounting.

    Or the mass on the main shaft's end. The input is a measurement campaign.

    Parameters
    ----------
    campaign : Path
        Campaign folder of kind carrier or mounting.

        Carrier: m1, m2; mounting: the other models.
    model : str
        Model of the motion, of the bushings, or of the coupling's mass.

        m1: rigid motion; m2: rigid motion and deflection under torque; bushings: the models up to
        this one; equivalent_mass: mass of the dynamometer's coupling and its arm from the bending
        moments of the main shaft.
    out : Path
        Folder to write: identification.json and the plots.
    per_run : bool
        Fit every run by itself, as the papers do.

        Otherwise the runs share phi_PLC, theta_PLC, rho_s and rho_f, or the bushings.
    sensors : {"axial", "all"}
        Axial sensors, or the radial ones too.

        With the radial ones, rigid radial motion joins the model; the papers use the axial ones.
    loss : {"squares", "huber"}
        Squared residuals, or Huber's loss (outliers).

        Huber's loss keeps outliers from moving the parameters.
    free_pin_angle : bool
        Model m2: fit the angle of pin 1 too.

        Its name is theta_rho, in the carrier's frame.
    samples_per_revolution : int
        Models m1, m2: samples a revolution; 0: as recorded.

        Resamples every record to this many equal steps of the carrier angle (16 or more), over its
        whole revolutions: slow stretches of a record then count no more than fast ones.
    bootstrap : int
        Bootstrap samples for the errors; 0: jackknife.

        A block bootstrap over revolutions (50 or more samples) or time blocks.
    seed : int
        Seed of the bootstrap and of the complex method.
    weights : dict
        Bushings: weights of the housing's motion, --weights.theta_x 1.

        In the objective: d_x, d_y, d_z in 1/m^2, theta_x, theta_y, theta_z in 1/rad^2. Default: the
        sensors are compared, each over its declared noise.
    axial : {"shown", "all", "none"}
        Bushings: axial K_x [N/m] and C_x [N s/m] as unknowns.

        Spring and damper of each bushing along the axis. shown: those that the campaign determines,
        by the housing's yaw under a load to the side; all: both; none: the rig's values.
    profile : tuple of str
        Bushings: parameters whose likelihood is drawn.

        Names such as K1, P_T.
    compare_complex : bool
        Bushings: search by the complex method of Box too.

        The paper's method; its cost is shown.
    housing_motion : bool
        Bushings: write and draw the housing's motion.

        d_x, d_y, d_z in m, theta_x, theta_y, theta_z in rad, measured and simulated; needs all six
        sensors.
    mass : float, optional
        Model equivalent_mass: mass [kg] where it is known; the arm alone is fitted.
    workers : int
        Processes for starts and bootstrap refits.

        Of bushing models; 1: in this process.
    scheduler : str
        Address of a Dask scheduler (tcp://host:8786) instead.
    quiet : bool
        Show no progress.

    Returns
    -------
    Identification or BushingIdentification
        Estimates with their uncertainty, RMS in m, angles in rad.

    Raises
    ------
    ValueError
        Where the campaign is refused or is of another kind, or choices exclude one another.
    OSError
        Where `out` cannot be written.
    """
    of_bushings = bool(weights or profile or compare_complex)
    if mass is not None and model != "equivalent_mass":
        raise ValueError(f"--mass is for --model equivalent_mass; {model} has no such mass")
    _refuse_foreign_options(
        model, of_bushings, housing_motion, samples_per_revolution, free_pin_angle
    )

    from carrierflex.identification.carrier.carrier_identification import FitOptions
    from carrierflex.workflows.identification.identify_bushings import BushingOptions, identify

    if model == "equivalent_mass":
        return _identified_mass(campaign, out, mass, quiet)
    if model.endswith("_bushing"):
        shared = BushingOptions(
            per_run, weights, axial, compare_complex, profile, housing_motion,
            bootstrap, seed, workers, scheduler, quiet,
        )  # fmt: skip
        return identify(campaign, model, out, shared)
    options = FitOptions(sensors == "all", loss == "huber", bootstrap, seed)
    return identify_carrier(
        campaign,
        model,
        out,
        options,
        free_pin_angle=free_pin_angle,
        samples_per_revolution=samples_per_revolution,
        per_run=per_run,
        quiet=quiet,
    )


def _identified_mass(campaign: Path, out: Path, mass: float | None, quiet: bool) -> Identification:
    """Fit mass and arm of the dynamometer's coupling (2011 paper, section 3)."""
    from carrierflex.identification.estimate_files import identification_document
    from carrierflex.identification.mounting.equivalent_mass import (
        bending_residuals,
        identify_equivalent_mass,
    )
    from carrierflex.identification.view import bending_figure

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
    files = (out / "identification.json", out / "bending.png")
    with stages.stage(f"writing {out}"):
        document = identification_document(
            measured.name, estimate, seconds=seconds, model_runs=1, warnings=()
        )
        save_json(files[0], document)
        save_figure(files[1], bending_figure(bending_residuals(measured, mass), estimate))
    by_run = dict.fromkeys([run.name for run in measured.runs], estimate)
    estimates = {estimate.model: by_run}
    unit = (1e-3, "kN m")
    return Identification(measured.name, estimate.model, estimates, seconds, files, rms_unit=unit)


def _refuse_foreign_options(
    model: str,
    of_bushings: bool,
    housing_motion: bool,
    samples_per_revolution: int,
    free_pin_angle: bool,
) -> None:
    """Raise ValueError where an option does not belong to the model."""
    if model.endswith("_bushing"):
        if samples_per_revolution:
            raise ValueError(
                "--samples-per-revolution is for the motion of the carrier; expected --model m1 or "
                "m2"
            )
        return
    if of_bushings:
        raise ValueError(
            f"--weights, --profile and --compare-complex belong to the bushing models; {model} has "
            "no bushings; leave them out"
        )
    if housing_motion:
        raise ValueError(
            f"--housing-motion is for campaigns of the mounting; {model} fits the carrier"
        )
    if free_pin_angle and model != "m2":
        raise ValueError("--free-pin-angle belongs to the deflection curves; expected --model m2")


def identify_carrier(
    campaign: Path,
    model: str,
    out: Path,
    options: FitOptions | None = None,
    *,
    free_pin_angle: bool = False,
    samples_per_revolution: int = 0,
    per_run: bool = False,
    quiet: bool = False,
) -> Identification:
    """Identify M1, and M2 where it is asked for; the arguments are those of :func:`main`.

    Raises
    ------
    ValueError
        Where the campaign is refused or is of another kind.
    """
    from carrierflex.identification.campaign.angle_resampling import resampled_to_angle
    from carrierflex.identification.carrier.carrier_identification import LEAST_SQUARES
    from carrierflex.identification.carrier.long_records import identify_in_pieces
    from carrierflex.identification.carrier.pin_angle import identify_with_pin_angle

    options = options or LEAST_SQUARES
    stages = Stages(3, quiet)
    with stages.stage(f"reading {campaign}"):
        header = read_campaign_header(campaign)
        one_pass = not (free_pin_angle or options.huber or samples_per_revolution)
        measured = _in_memory(campaign, header, one_pass=one_pass)
        if measured is not None and samples_per_revolution:
            even = tuple(resampled_to_angle(run, samples_per_revolution) for run in measured.runs)
            measured = replace(measured, runs=even)
    for note in measured.notes if measured else ():
        stages.tell(note)
    models = _models(header, campaign, model, options)
    prepared_folder(out)
    with stages.stage("least squares" if measured else "least squares, record in pieces"):
        start = perf_counter()
        if measured is None:
            measured, estimates = identify_in_pieces(
                campaign, header, models, options, per_run=per_run
            )
        else:
            estimates = {
                entry.name: _identified(measured, entry, options, per_run) for entry in models
            }
        fits = {
            entry.name: {run: (entry, fit) for run, fit in estimates[entry.name].items()}
            for entry in models
        }
        if free_pin_angle:
            fits["m2"] = identify_with_pin_angle(
                measured, *_curves(header, campaign), options, per_run=per_run
            )
        seconds = perf_counter() - start
    return _written(out, measured, fits, stages, model=model, per_run=per_run, seconds=seconds)


def _in_memory(folder: Path, header: CampaignHeader, *, one_pass: bool) -> Campaign | None:
    """Campaign with its records; None where they are too long and one pass over them is enough."""
    from carrierflex.identification.carrier.carrier_identification import axial_channels
    from carrierflex.identification.carrier.long_records import is_long

    if not is_long(folder, header):
        campaign = read_campaign(folder).within_use()
        axial_channels(campaign)  # refuses a campaign of another kind before anything is written
        return campaign
    if not one_pass:
        raise ValueError(
            "records this long are read once, in pieces; --loss huber, --free-pin-angle and "
            "--samples-per-revolution need shorter ones"
        )
    return None


def _written(
    out: Path,
    measured: Campaign,
    fits: Fits,
    stages: Stages,
    *,
    model: str,
    per_run: bool,
    seconds: float,
) -> Identification:
    """Write identification.json and the plots."""
    from carrierflex.identification.campaign_check.records_check import records_findings
    from carrierflex.identification.estimate_files import identification_document

    outliers = _outliers(measured, fits[model])
    warnings = records_findings(measured)
    estimates = _estimates(fits)
    reported = estimates[model] if per_run else next(iter(estimates[model].values()))
    with stages.stage(f"writing {out}"):
        document = identification_document(
            measured.name,
            reported,
            seconds=seconds,
            model_runs=1,
            outliers=outliers,
            warnings=warnings,
        )
        save_json(out / "identification.json", document)
        files = [out / "identification.json"]
        n_figures = 2 + min(len(measured.runs), _MOST_DRAWN)
        # Each plot is written before the next is made.
        for name, figure in _figures(measured, fits, model):
            files.append(out / name)
            save_figure(files[-1], figure)
            stages.note(name, (len(files) - 1) / n_figures)
    return Identification(
        measured.name, model, estimates, seconds, tuple(files), outliers, warnings
    )


def _estimates(fits: Fits) -> dict[str, dict[str, ParameterEstimate]]:
    """Estimate by model name and run."""
    return {
        name: {run: estimate for run, (_, estimate) in by_run.items()}
        for name, by_run in fits.items()
    }


def _figures(measured: Campaign, fits: Fits, model: str) -> Iterator[tuple[str, Figure]]:
    """Plots and their file names: of all runs, then signals of those that are explained least."""
    from carrierflex.identification.carrier.carrier_identification import axial_channels
    from carrierflex.identification.view import parameters_figure, rms_figure, signals_figure

    estimates = _estimates(fits)
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


def _identified(
    measured: Campaign, model: CarrierModel, options: FitOptions, per_run: bool
) -> Mapping[str, ParameterEstimate]:
    from carrierflex.identification.carrier.carrier_identification import (
        identify_each_run,
        identify_jointly,
    )

    if per_run:
        return identify_each_run(measured, model, options)
    return dict.fromkeys(
        [run.name for run in measured.runs], identify_jointly(measured, model, options)
    )


def _outliers(
    measured: Campaign, fits: Mapping[str, tuple[CarrierModel, ParameterEstimate]]
) -> tuple[Outliers, ...]:
    """Samples far outside the identified motion; of a record in pieces those of the first piece."""
    from carrierflex.identification.carrier.carrier_identification import (
        residual_signal,
        rim_channels,
    )
    from carrierflex.identification.carrier.robust_loss import flagged_outliers

    outliers: list[Outliers] = []
    for run in measured.runs:
        model, estimate = fits[run.name]
        channels = [
            c for c in rim_channels(measured) if c.name in estimate.rms_by_channel[run.name]
        ]
        outliers += flagged_outliers(
            run, {c.name: residual_signal(run, c, model, estimate) for c in channels}
        )
    return tuple(outliers)


def _models(
    header: CampaignHeader, folder: Path, last: str, options: FitOptions
) -> list[CarrierModel]:
    """Models up to the one asked for: M2 is shown beside M1."""
    models = [rigid_model()]
    if last == "m2" and header.contract.name == "carrier":
        models.append(flexible_model(*_curves(header, folder)))
    return [with_radial_motion(model) for model in models] if options.radial else models


def _curves(header: CampaignHeader, folder: Path) -> tuple[DeflectionCurve, DeflectionCurve]:
    """Stiff and flexible curve: the campaign's own, or the default carrier's."""
    if "deflection_curves" in header.rig:
        curves = read_curves(folder / header.rig["deflection_curves"])
    else:
        from carrierflex.workflows.fe.default_curves import default_curves

        curves = default_curves()
    return curves["delta_s"], curves["delta_f"]
