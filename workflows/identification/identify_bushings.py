"""Identify the gearbox mounting's bushings from a measured load history (2011 paper, section 5).

Fits the linear, the nonlinear and the hydro-dynamic bushing by simulating the whole record, each
model warm-started from the simpler one, and writes identification.json with the paper's tables 2
and 3. A good answer: the richer model fits better by more than rounding, no parameter sits on a
bound, and the intervals are narrow beside the values.
"""

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from pathlib import Path
from time import perf_counter
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.inference.thresholds import Thresholds
from carrierflex.files.json_files import save_json
from carrierflex.files.versions import software_name
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning, key_of
from carrierflex.identification.campaign_check.records_check import records_findings
from carrierflex.identification.estimate_files import FORMAT, VERSION
from carrierflex.identification.estimation.complex_method import ComplexSearch
from carrierflex.identification.mounting.bushing_identification import (
    BushingEstimate,
    bootstrapped,
    identify_bushings,
    identify_with_shown_axial,
    profiled,
    search_bushings,
)
from carrierflex.identification.mounting.bushing_models import (
    AXIAL,
    BUSHING_MODELS,
    BushingModel,
    mounting_residuals,
)
from carrierflex.identification.view import (
    MotionRecord,
    bushing_signals_figure,
    housing_motion_figure,
    profile_figure,
)
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.rig import HOUSING_MOTION, SENSORS, MountingRig
from carrierflex.workflows.executors import check_workers, work_executor
from carrierflex.workflows.outputs import prepared_folder, save_figure, save_table
from carrierflex.workflows.progress import Stages

#: A singular value below this share of the largest one: the sensors do not see the direction.
_UNSEEN = 1e-9
_MOTION_UNITS = ("m", "m", "m", "rad", "rad", "rad")


@dataclass(frozen=True, eq=False)
class BushingIdentification:
    """What the workflow found: estimates by group of runs and model, searches by model, files.

    ``motion_rms`` holds the RMS of the housing's measured motion and of the gap by run, shape (2,
    6), where it was asked for.
    """

    campaign: str
    estimates: Mapping[str, tuple[BushingEstimate, ...]]
    searches: Mapping[str, ComplexSearch]
    search_seconds: Mapping[str, float]
    files: tuple[Path, ...]
    motion_rms: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    warnings: tuple[CampaignWarning, ...] = ()


@dataclass(frozen=True)
class BushingOptions:
    """Options of ``carrierflex identify`` that bushing models take."""

    per_run: bool = False
    weights: Mapping[str, float] | None = None
    axial: Literal["shown", "all", "none"] = "shown"
    compare_complex: bool = False
    profile: tuple[str, ...] = ()
    housing_motion: bool = False
    bootstrap: int = 0
    seed: int = 0
    workers: int = 1
    scheduler: str | None = None
    quiet: bool = False


def identify(
    campaign: Path, model: str, out: Path, options: BushingOptions
) -> BushingIdentification:
    """Fit the bushing models up to `model`.

    Raises
    ------
    ValueError
        Where the campaign is refused or is of another kind, or an option is.
    OSError
        Where `out` cannot be written or no scheduler answers.
    """
    check_workers(options.workers, options.scheduler)
    last = next(entry for entry in BUSHING_MODELS if entry.name == model)
    stages = Stages(3 + options.compare_complex, options.quiet)
    with stages.stage(f"reading {campaign}"):
        all_records = read_campaign(campaign)
        warnings = records_findings(all_records)
        measured = all_records.within_use()
    for note in measured.notes:
        stages.tell(note)
    motion = measured_motion(measured) if options.housing_motion else None
    groups = (
        {run.name: replace(measured, runs=(run,)) for run in measured.runs}
        if options.per_run
        else {"": measured}
    )
    possible = last if options.axial == "none" else last.with_axial(AXIAL)
    for name in options.profile:
        if name not in possible.names:
            raise ValueError(
                f"--profile {name}: {model} has no such unknown; expected one of "
                f"{', '.join(possible.names)}"
            )
    # Another kind, unknown weights or missing sensors are refused before the folder is made.
    mounting_residuals(measured, last, options.weights)
    prepared_folder(out)
    estimates: dict[str, tuple[BushingEstimate, ...]] = {}
    profiles: dict[str, Any] = {}
    with work_executor(options.workers, options.scheduler) as executor:
        with stages.stage(f"{model}: simulating and fitting"):
            for name, group in groups.items():
                estimates[name] = fitted = _fitted(group, last, executor, options)
                profiles |= {
                    f"{name} {parameter}".strip(): profiled(
                        group, fitted[-1], parameter, options.weights
                    )
                    for parameter in options.profile
                    if parameter in fitted[-1].fit.names
                }
    searches, seconds = {}, {}
    if options.compare_complex:
        with stages.stage("complex method on the same record"):
            for entry in (estimate.model for estimate in next(iter(estimates.values()))):
                begin = perf_counter()
                searches[entry.name] = search_bushings(
                    measured, entry, weights=options.weights, seed=options.seed
                )
                seconds[entry.name] = perf_counter() - begin
    warnings = (*warnings, *_misfits(measured, estimates))
    result = BushingIdentification(
        measured.name, estimates, searches, seconds, (), warnings=warnings
    )
    with stages.stage(f"writing {out}"):
        files = _written(out, measured, result, profiles)
        if motion is None:
            return replace(result, files=files)
        more, rms = _write_housing_motion(out, measured, motion, _last_by_run(measured, result))
        return replace(result, files=(*files, *more), motion_rms=rms)


def _fitted(
    group: Campaign, last: BushingModel, executor: Executor, options: BushingOptions
) -> tuple[BushingEstimate, ...]:
    """Estimates of the models up to `last`, its errors by the bootstrap where that is asked for."""
    if options.axial == "shown":
        result = identify_with_shown_axial(group, last, executor, weights=options.weights)
    else:
        axial = tuple(AXIAL) if options.axial == "all" else ()
        result = identify_bushings(group, last, executor, weights=options.weights, axial=axial)
    if not options.bootstrap:
        return result
    refitted = bootstrapped(
        group, result[-1], executor, options.bootstrap, options.seed, options.weights
    )
    return (*result[:-1], refitted)


def _misfits(
    measured: Campaign, estimates: Mapping[str, tuple[BushingEstimate, ...]]
) -> tuple[CampaignWarning, ...]:
    """Fits that leave more than the declared noise: their intervals do not hold that error."""
    declared = [channel.noise_std for channel in measured.channels if channel.noise_std is not None]
    if len(declared) < len(measured.channels):
        return ()
    noise = float(np.sqrt(np.mean(np.square(declared))))
    last = {group: fitted[-1] for group, fitted in estimates.items()}
    return tuple(
        CampaignWarning(
            "fit",
            f"{estimate.model.name} {group}".strip(),
            f"the fit leaves {estimate.rms * 1e6:.3g} um RMS, {estimate.rms / noise:.3g} times the "
            "declared noise: the model does not describe these records, and the intervals do not "
            "include that error",
            "fit a model with more parameters (--model), or let carrierflex diagnose name the "
            "missing effect",
            estimate.rms / noise,
            key_of("[[channels]]", "noise_std"),
        )
        for group, estimate in last.items()
        if estimate.rms > Thresholds().remainder * noise
    )


def _last_by_run(measured: Campaign, result: BushingIdentification) -> dict[str, BushingEstimate]:
    """Estimate of the richest model, by run."""
    return {
        run.name: result.estimates.get(run.name, result.estimates.get("", ()))[-1]
        for run in measured.runs
    }


def _written(
    out: Path, measured: Campaign, result: BushingIdentification, profiles: Mapping[str, Any]
) -> tuple[Path, ...]:
    files = [out / "identification.json", out / "signals.png"]
    save_json(files[0], _document(measured, result))
    save_figure(files[1], bushing_signals_figure(measured, _last_by_run(measured, result)))
    if profiles:
        save_figure(out / "profiles.png", profile_figure(profiles))
        files.append(out / "profiles.png")
    return tuple(files)


def _document(measured: Campaign, result: BushingIdentification) -> dict[str, Any]:
    """Content of identification.json: the contract's keys, then tables 2 and 3."""
    last = {group: estimates[-1] for group, estimates in result.estimates.items()}
    joint = last.get("")
    every = [estimate for estimates in result.estimates.values() for estimate in estimates]
    return {
        "format": FORMAT,
        "version": VERSION,
        "campaign": measured.name,
        "model": next(iter(last.values())).model.name,
        "software": software_name(),
        "shared": {} if joint is None else fitted_parameters(joint),
        "runs": {
            run.name: {
                "parameters": {} if joint else fitted_parameters(last[run.name]),
                "rms": _run_rms(joint or last[run.name], run.name),
                "rms_by_channel": (joint or last[run.name]).rms_by_run[run.name],
            }
            for run in measured.runs
        },
        "axial_unknowns": {group: entry.model.axial for group, entry in last.items()},
        "undetermined": [
            f"{group}: {text}".removeprefix(": ")
            for group, last_estimate in last.items()
            for text in last_estimate.undetermined
        ],
        "correlation": {
            group: {
                "parameters": last_estimate.fit.names,
                "matrix": last_estimate.uncertainty.correlation,
            }
            for group, last_estimate in last.items()
        },
        "model_runs": sum(estimate.fit.model_runs for estimate in every),
        "seconds": sum(estimate.seconds for estimate in every),
        "warnings": result.warnings,
        "models": {
            group: benchmark_rows(estimates, result)
            for group, estimates in result.estimates.items()
        },
    }


def benchmark_rows(
    estimates: tuple[BushingEstimate, ...], result: BushingIdentification
) -> list[dict[str, Any]]:
    """Table 2 of the 2011 paper with table 3 in it, one row a model.

    Parameters, time, accuracy, and what it cost to find.

    ``accuracy`` is the objective over that of the linear model: lower is better.
    """
    rows = []
    for estimate in estimates:
        name = estimate.model.name
        search = result.searches.get(name)
        rows.append(
            {
                "model": name,
                "n_parameters": len(estimate.fit.names),
                "simulation_seconds": estimate.simulation_seconds,
                "accuracy": estimate.fit.cost / estimates[0].fit.cost,
                "rms": estimate.rms,
                "parameters": fitted_parameters(estimate),
                "model_runs": estimate.fit.model_runs,
                "seconds": estimate.seconds,
                "complex_model_runs": search.evaluations if search else None,
                "complex_seconds": result.search_seconds.get(name),
                "complex_accuracy": search.cost / estimates[0].fit.cost if search else None,
            }
        )
    return rows


def fitted_parameters(estimate: BushingEstimate) -> dict[str, Any]:
    """Value, standard deviation, 95 % interval and unit by published name, SI units."""
    return {
        name: {
            "value": estimate.fit.values[k],
            "std": estimate.uncertainty.std[k],
            "ci95": estimate.ci95[k],
            "unit": estimate.model.unit(name),
        }
        for k, name in enumerate(estimate.fit.names)
    }


def _run_rms(estimate: BushingEstimate, run: str) -> float:
    """RMS of a run over its channels, which are sampled alike."""
    return float(np.sqrt(np.nanmean(np.square(list(estimate.rms_by_run[run].values())))))


def measured_motion(campaign: Campaign) -> dict[str, NDArray[np.float64]]:
    """Motion of the housing by run, shape (n, 6), NaN where a sensor is missing.

    Raises
    ------
    ValueError
        Where the campaign's sensors cannot tell the six coordinates apart.
    """
    rig = MountingRig.from_table(campaign.rig)
    names = {str(channel.sensor): channel.name for channel in campaign.channels}
    sensors = [sensor for sensor in SENSORS if sensor in names]
    _refuse_unseen(rig.sensor_matrix[[SENSORS.index(sensor) for sensor in sensors]], sensors)
    return {
        run.name: rig.housing_motion(
            np.column_stack([run.signals[names[sensor]] for sensor in sensors])
        )
        for run in campaign.runs
    }


def _refuse_unseen(T: NDArray[np.float64], sensors: Sequence[str]) -> None:
    """Refuse sensors that leave a direction of motion unseen, and name it."""
    _, sizes, directions = np.linalg.svd(T)
    rank = int((sizes > _UNSEEN * sizes[0]).sum()) if sizes.size else 0
    if rank == len(HOUSING_MOTION):
        return
    unseen = directions[-1] / np.abs(directions[-1]).max()
    terms = " ".join(
        f"{share:+.2g} {name}"
        for share, name in zip(unseen, HOUSING_MOTION, strict=True)
        if abs(share) > 1e-6
    )
    raise ValueError(
        f"housing motion: {len(sensors)} sensors ({', '.join(sensors)}) see {rank} of "
        f"{len(HOUSING_MOTION)} coordinates; the motion {terms} stays unseen; expected "
        "sensors that see it ('sensor' of [[channels]])"
    )


def _write_housing_motion(
    out: Path,
    campaign: Campaign,
    measured: Mapping[str, NDArray[np.float64]],
    estimates: Mapping[str, BushingEstimate],
) -> tuple[tuple[Path, ...], dict[str, NDArray[np.float64]]]:
    """Files of the motion, measured and by identified bushings; RMS by run, shape (2, 6)."""
    rig = MountingRig.from_table(campaign.rig)
    motions: dict[str, MotionRecord] = {}
    files, rms = [], {}
    for run in campaign.runs:
        estimate = estimates[run.name]
        inputs = MountingInputs.from_columns(run.time, run.inputs)
        simulated = rig.housing_motion(estimate.simulated(rig, inputs).signals)
        motions[run.name] = (run.time, measured[run.name], simulated)
        squares = [measured[run.name] ** 2, (measured[run.name] - simulated) ** 2]
        rms[run.name] = np.sqrt([np.nanmean(square, axis=0) for square in squares])
        header = [
            f"{name}_{kind} [{unit}]"
            for kind in ("measured", "simulated")
            for name, unit in zip(HOUSING_MOTION, _MOTION_UNITS, strict=True)
        ]
        files.append(out / f"housing_motion_{Path(run.file).stem}.csv")
        rows = np.column_stack([run.time, measured[run.name], simulated])
        save_table(files[-1], ["time [s]", *header], rows.tolist())
    files.append(out / "housing_motion.png")
    save_figure(files[-1], housing_motion_figure(motions))
    return tuple(files), rms
