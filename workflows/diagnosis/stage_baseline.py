"""The planetary stage as the simulation behind a campaign: ``[baseline] source = "stage"``.

The stage of the case is solved under the measured loads of every run; its causes come along.
"""

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from carrierflex.geometry.parameters import DEFAULT_SIZE
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.carrier.models import rim_sensor
from carrierflex.simulation.carrier.effects.inside_stage import (
    PIN_PLACES,
    STAGE_EFFECTS,
    effect_of_stage,
)
from carrierflex.simulation.carrier.rim import CarrierInputs, inputs_of_columns
from carrierflex.simulation.carrier.run_cases import AXIAL, Sensor
from carrierflex.simulation.stage.causes import GapSeries, StagePrediction, stage_prediction
from carrierflex.simulation.stage.predicted_readings import (
    LoadPoints,
    PredictedStage,
    StageReadings,
    load_points,
)
from carrierflex.simulation.stage.stage_cases import read_stage_case
from carrierflex.workflows.simulation.simulate_stage import stage_body_of_case

#: Samples of a run among which load points are sought.
_SAMPLES = 2000


def with_stage(
    campaign: Campaign,
    folder: Path,
    *,
    planned: Callable[[], Campaign] | None = None,
    executor: Executor | None = None,
    note: Callable[[str, float], None] = lambda text, share: None,
) -> Campaign:
    """Campaign with the predictions of its stage as columns, and the causes inside the stage.

    Another baseline's is returned as it is. `planned` gives the campaign with what could be added
    to it, whose loads and sensors the causes then cover; `executor` solves stages; `note` hears
    which cause is solved, and the share that is done. ValueError where the case is refused or does
    not fit the campaign.
    """
    if campaign.baseline.source != "stage":
        return campaign
    path = folder / campaign.baseline.case
    case = read_stage_case(path)
    if case.rig["n_planets"] != campaign.rig["n_planets"]:
        raise ValueError(
            f"{path}: key 'n_planets' of [rig] is {case.rig['n_planets']}; expected "
            f"{campaign.rig['n_planets']} as in campaign.toml"
        )
    stage = PredictedStage(
        stage_body_of_case(case, DEFAULT_SIZE),
        case.data,
        case.effects,
        replace(case.reading, sensors=None),
        _mean_speed(campaign),
        case.rest_angle,
        case.runs[0].load.gravity,
    )
    covered = planned() if planned is not None else None
    return predicted_by(campaign, stage, planned=covered, executor=executor, note=note)


def predicted_by(
    campaign: Campaign,
    stage: PredictedStage,
    *,
    planned: Campaign | None = None,
    executor: Executor | None = None,
    note: Callable[[str, float], None] = lambda text, share: None,
) -> Campaign:
    """Campaign whose predictions and causes are those of a stage; see :func:`with_stage`."""
    _refuse_unknown_pins(campaign, stage.body.n_planets)
    covered = planned or campaign
    loads = np.concatenate([_loads(run) for run in covered.runs])
    largest = float(np.hypot(loads[:, 1], loads[:, 2]).max()) or 1.0
    scale = np.array([float(campaign.rig["nominal_torque"]), largest, largest])
    sensors = [
        Sensor(channel.name, channel.quantity, channel.angle or 0.0, channel.radius or 0.0)
        for channel in covered.channels
    ]
    points = load_points(loads, scale)
    gap_of = partial(_gap, campaign, points)
    impossible = campaign.baseline.impossible
    known = {name: (of.value, of.std) for name, of in campaign.baseline.fixed.items()}
    prediction = stage_prediction(stage, sensors, points, gap_of, executor, note, impossible, known)
    notes = tuple(
        f"cause {name} is left out: the stage has no equilibrium at one of its sizes"
        for name in prediction.not_solved
    )
    return replace(
        campaign,
        baseline=replace(
            campaign.baseline,
            source="columns",
            impossible=tuple(name for name in impossible if name not in STAGE_EFFECTS),
        ),
        runs=tuple(_predicted(campaign, run, prediction) for run in campaign.runs),
        notes=(*campaign.notes, *notes),
        causes=prediction.causes,
    )


def _refuse_unknown_pins(campaign: Campaign, n_planets: int) -> None:
    pins = effect_of_stage(PIN_PLACES)
    known = [f"{pins}.pin_{k}" for k in range(2, n_planets + 1)]
    for name in campaign.baseline.fixed:
        if name.startswith(f"{pins}.") and name not in known:
            raise ValueError(
                f"campaign.toml: key 'fixed' holds '{name}', the stage has {n_planets} planets; "
                f"expected one of {', '.join(known)}"
            )


def _gap(campaign: Campaign, points: LoadPoints, readings: StageReadings) -> GapSeries:
    """Gap of every run by order, at its mean load; nothing of a channel without samples."""
    waves, shares = [], []
    orders = np.arange(readings.series.shape[2])
    for run in campaign.within_use().runs:
        inputs = _inputs(run)
        every = slice(None, None, max(1, run.time.size // _SAMPLES))
        turned = np.exp(1j * np.outer(run.inputs["carrier_angle"][every], orders))
        columns = np.hstack([turned.real, -turned.imag[:, 1:]])
        of_run = []
        for channel in campaign.channels:
            gap = run.signals[channel.name] - readings.signal(rim_sensor(channel), inputs)
            is_read = np.isfinite(gap[every])
            fit, *_ = np.linalg.lstsq(columns[is_read], gap[every][is_read], rcond=None)
            of_run.append(fit[: orders.size] + 1j * np.append(0.0, fit[orders.size :]))
        waves.append(of_run)
        shares.append(points.weights(inputs).mean(axis=0))
    is_axial = np.array([channel.quantity == AXIAL for channel in campaign.channels])
    return GapSeries(np.array(waves), np.array(shares), is_axial)


def _inputs(run: Run) -> CarrierInputs:
    zero = np.zeros(run.time.size)
    return inputs_of_columns({"ntl_y": zero, "ntl_z": zero, **run.inputs, "time": run.time})


def _mean_speed(campaign: Campaign) -> float:
    """Carrier speed over all runs [rad/s]."""
    turned = [float(np.ptp(run.inputs["carrier_angle"])) for run in campaign.runs]
    lasted = [float(np.ptp(run.time)) for run in campaign.runs]
    return sum(turned) / sum(lasted) if any(lasted) else 0.0


def _loads(run: Run) -> np.ndarray:
    """Torque and radial load of some samples, shape (n, 3)."""
    every = max(1, run.time.size // _SAMPLES)
    zero = np.zeros(run.time.size)
    names = ("torque", "ntl_y", "ntl_z")
    return np.column_stack([run.inputs.get(name, zero)[::every] for name in names])


def _predicted(campaign: Campaign, run: Run, prediction: StagePrediction) -> Run:
    inputs = _inputs(run)
    predictions = {
        channel.name: prediction.readings.signal(rim_sensor(channel), inputs)
        for channel in campaign.channels
    }
    return replace(run, predictions=predictions)
