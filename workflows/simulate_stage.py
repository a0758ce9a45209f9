"""Simulate the whole planetary stage in a set of load cases: what a ``carrierflex-stage-case`` asks for.

Bodies come from the parameters by finite elements and Craig-Bampton reduction, the stage runs in time, and the sensors'
signals become a campaign of kind ``carrier``. A good answer: order 3 of the rim's deflection in proportion to the torque,
energy that balances to rounding, and planets that share the load but for weight and pin errors.
"""

import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fe.curve_files import read_curves, write_curves
from fe.deflection_curves import DeflectionCurve
from geometry.carrier_mesh import DEFAULT_SIZE
from geometry.parameter_files import read_parameters
from identification.campaign import Baseline, Campaign, Channel
from identification.campaign_files import CASE_COPY, write_campaign
from identification.records import Run
from identification.simulated_campaign import CURVES_FILE
from reduction.craig_bampton import craig_bampton
from reduction.pin_joints import carrier_with_pins
from simulation.stage.response import StageDivergedError, joined_records, steps_per_sample
from simulation.stage.stage_body import ShaftData, StageBody, beam_shaft, joined_to_shaft
from simulation.stage.stage_cases import StageCase, StageRun, read_stage_case
from simulation.stage.stage_model import StageModel, stage_model
from simulation.stage.stage_run import StageResponse, simulate_stage
from workflows.named_bodies import body_structure
from workflows.progress import Stages

#: Fixed-interface modes of carrier and pin: up to about 2 kHz, far beyond the mesh frequency's harmonics.
_CARRIER_MODES, _PIN_MODES = 20, 4


@dataclass(frozen=True, eq=False)
class SimulatedStage:
    """The case, the campaign, its folder, and the energy that each run's balance left over, over the work done."""

    case: StageCase
    campaign: Campaign
    folder: Path
    imbalance: dict[str, float]


def main(
    case: Path, *, out: Path, curves: Path | None = None, size: float = DEFAULT_SIZE, quiet: bool = False
) -> SimulatedStage:
    """Simulate the planetary stage in a set of load cases and write the sensors' records as a campaign folder.

    Parameters
    ----------
    case : Path
        Stage case (TOML).
    out : Path
        Campaign folder to write: new, empty, or an earlier campaign.
    curves : Path, optional
        Deflection curves kept with the campaign; without it those of the default carrier.
    size : float
        Element edge length [m] of carrier and pins.
    quiet : bool
        Show no progress.

    Raises
    ------
    ValueError
        Where the case is refused, or the folder holds something that is not a campaign.
    StageDivergedError
        Where a run leaves the range of small motions; what there is of it is written first.
    """
    what = read_stage_case(case)
    steps_per_sample(what.speed, what.data.gear.ring_teeth, sample_rate=what.sample_rate, step=what.step)
    curve_set = _curves(curves)
    stages = Stages(len(what.runs) + 2, quiet)
    with stages.stage(f"reduced carrier and pins, elements of {size} m"):
        body = default_stage_body(what.pin_fit_stiffness, size)
    model = stage_model(body, what.data, effects=what.effects, speed=what.speed)
    rng, records = np.random.default_rng(what.seed), []
    imbalance: dict[str, float] = {}
    diverged: StageDivergedError | None = None
    for run in what.runs:
        with stages.stage(f"{run.name}, {what.duration:g} s"):
            pieces, diverged = _pieces(model, what, run, rng)
        if pieces:
            records.append(stage_run_record(run, pieces))
            imbalance[run.name] = max(float(np.abs(piece.record.imbalance).max()) for piece in pieces) / _work(pieces)
        if diverged:
            break
    if records:
        campaign = stage_campaign(what, records)
        with stages.stage(f"writing {out}"):
            write_campaign(campaign, out, more_files=_files(case, curve_set))
    if diverged:
        raise diverged
    return SimulatedStage(what, campaign, out, imbalance)


def _curves(curves: Path | None) -> Mapping[str, DeflectionCurve]:
    from workflows.default_curves import default_curves

    return default_curves() if curves is None else read_curves(curves)


def default_stage_body(pin_fit_stiffness: float, size: float, *, carrier_factor: float = 1.0) -> StageBody:
    """Default carrier and pins by finite elements of `size` [m], reduced and joined, on the beam of the main shaft.

    `carrier_factor` multiplies the carrier's stiffness: a large one makes it rigid.
    """
    stage = read_parameters(None)
    reduced = {}
    for name, n_modes in (("flexible_carrier", _CARRIER_MODES), ("pin", _PIN_MODES)):
        _, structure = body_structure(name, stage, size)
        reduced[name] = craig_bampton(structure, n_modes).model
    own = reduced["flexible_carrier"]
    carrier = carrier_with_pins(replace(own, K=carrier_factor * own.K), reduced["pin"], pin_fit_stiffness)
    return joined_to_shaft(carrier, beam_shaft(ShaftData(), carrier.pilots["shaft_face"]))


def _pieces(
    model: StageModel, what: StageCase, run: StageRun, rng: np.random.Generator
) -> tuple[list[StageResponse], StageDivergedError | None]:
    """Pieces of a run, all of it or as far as it came, and why it came no further."""
    pieces: list[StageResponse] = []
    try:
        for piece in simulate_stage(
            model,
            run.load,
            what.sensors,
            duration=what.duration,
            sample_rate=what.sample_rate,
            step=what.step,
            effects=what.reading,
            rng=rng,
        ):
            pieces.append(piece)  # one by one: a run that stops early keeps its pieces
    except StageDivergedError as error:
        return pieces, error
    return pieces, None


def _work(pieces: list[StageResponse]) -> float:
    """Work of the torque over a run [J]; 1 where none is done."""
    return max(1.0, *(float(np.abs(piece.record.energy[:, 0]).max()) for piece in pieces))


def stage_run_record(run: StageRun, pieces: list[StageResponse]) -> Run:
    """Pieces of a run as one run of a campaign."""
    record = joined_records([piece.record for piece in pieces])
    columns = ("torque", "generator_speed", "ntl_y", "ntl_z")
    inputs = {name: record.drive[:, i] for i, name in enumerate(columns) if name != "generator_speed"}
    return Run(
        name=run.name,
        file=f"{run.name}.csv",
        condition=run.condition,
        time=record.time,
        inputs={"carrier_angle": record.c[:, 0], **inputs},
        signals={name: np.concatenate([piece.signals[name] for piece in pieces]) for name in pieces[0].signals},
    )


def stage_campaign(what: StageCase, records: list[Run]) -> Campaign:
    """Records of a case as a campaign of kind ``carrier``."""
    noise = what.reading.noise_std or None
    channels = tuple(
        Channel(sensor.name, sensor.quantity, "m", angle=sensor.angle, radius=sensor.radius, noise_std=noise)
        for sensor in what.sensors
    )
    return Campaign(
        kind="carrier",
        name=what.name,
        baseline=Baseline("model", ("axial_offset",)),
        rig={**what.rig, "deflection_curves": CURVES_FILE},
        channels=channels,
        runs=tuple(records),
    )


def _files(case: Path, curve_set: Mapping[str, DeflectionCurve]) -> dict[str, Callable[[Path], None]]:
    def copy(path: Path) -> None:
        shutil.copyfile(case, path)

    return {CURVES_FILE: lambda path: write_curves(path, curve_set), CASE_COPY: copy}
