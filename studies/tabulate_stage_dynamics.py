"""How far sensors in a stage that moves are from those of static equilibria, by band of orders.

    python -m studies.tabulate_stage_dynamics --out stage_dynamics

A campaign with ``[baseline] source = "stage"`` is predicted by static equilibria. Here the stage
runs in time under steady loads at the records' speed and at half of it, with the bearings'
clearances and without, and its signals are set against the prediction at the same carrier angles:
orders up to 24, which equilibria have; sidebands of the tooth meshes; the rest, which is
the housing swinging on its bushings. A file a stage, made where it is missing, then
stage_dynamics.md. A good answer: bands well below a floor of 5 um.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.blind_check.truth.carrier.stage import LOADS
from carrierflex.files.json_files import save_json
from carrierflex.geometry.pins import PAPER_STIFFNESS
from carrierflex.identification.estimation.single_thread import single_threaded
from carrierflex.simulation.carrier.rim import RimSensor, inputs_of_columns
from carrierflex.simulation.carrier.run_cases import AXIAL
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.predicted_readings import (
    HIGHEST_ORDER,
    LoadPoints,
    PredictedStage,
    StageReadings,
    stage_readings,
)
from carrierflex.simulation.stage.readings import ReadingEffects
from carrierflex.simulation.stage.response import joined_records
from carrierflex.simulation.stage.stage_body import StageBody
from carrierflex.simulation.stage.stage_data import BearingData, MeshData, StageData
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.stage_run import simulate_stage
from carrierflex.simulation.stage.statics import SteadyLoad
from carrierflex.workflows.executors import work_executor
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages
from carrierflex.workflows.simulation.stage_bodies import default_stage_body
from carrierflex.workflows.simulation.study_order_one import SENSORS
from studies.case_files import make_missing, read_case, write_table

#: Carrier speeds [rad/s]: half of the records', and theirs, the rated 22.1 rev/min.
SPEEDS = (1.15, 2.3)
#: Published clearances of the carrier bearings, half of the diametral ones [m], and none.
BEARINGS = {
    "clearances": BearingData(upwind_clearance=0.1375e-3, downwind_clearance=0.1225e-3),
    "no clearance": BearingData(),
}
BANDS = ("orders 0 to 24", "tooth meshes", "rest")
#: Turns that are compared, after one to settle; samples a turn; longest step [s].
_TURNS, _SAMPLES, _STEP = 2, 720, 1e-3
#: Orders beside a multiple of the mesh's that belong to it.
_SIDEBANDS = 12


@dataclass(frozen=True)
class BandDifference:
    """RMS of the difference at the sensors of one load [m], the largest of them, by band."""

    load: tuple[float, float, float]
    rms: Mapping[str, float]


def bands(difference: NDArray[np.float64], turns: int, mesh_teeth: int) -> dict[str, float]:
    """RMS of each band of a difference over whole turns, the largest of the sensors.

    `difference` has shape (n_sensors, n) over equal carrier angles of `turns` turns.
    """
    spectrum = np.fft.rfft(difference, axis=1) / difference.shape[1]
    order = np.arange(spectrum.shape[1]) / turns
    square = np.abs(spectrum) ** 2 * np.where(order == 0.0, 1.0, 2.0)
    to_mesh = np.abs(order - mesh_teeth * np.round(order / mesh_teeth))
    is_mesh = (to_mesh <= _SIDEBANDS) & (order > HIGHEST_ORDER)
    is_low = (order <= HIGHEST_ORDER) & (order % 1.0 == 0.0)
    members = (is_low, is_mesh, ~is_low & ~is_mesh)
    return {
        name: float(np.sqrt(square[:, some].sum(axis=1).max()))
        for name, some in zip(BANDS, members, strict=True)
    }


def compared(stage: PredictedStage) -> list[BandDifference]:
    """Differences of a stage under every load."""
    points = LoadPoints(np.array(LOADS), np.array([LOADS[0][0], 2e5, 2e5]))
    readings, _ = stage_readings(stage, SENSORS, points)
    return [BandDifference(load, _of_load(stage, readings, load)) for load in LOADS]


def _of_load(
    stage: PredictedStage, readings: StageReadings, load: tuple[float, float, float]
) -> dict[str, float]:
    model = stage_model(stage.body, stage.data, effects=stage.effects, speed=stage.speed)
    turn = 2.0 * np.pi / stage.speed
    pieces = list(
        simulate_stage(
            model,
            SteadyLoad(*load),
            SENSORS,
            duration=(_TURNS + 1.1) * turn,
            sample_rate=_SAMPLES / turn,
            step=_STEP,
            rest_angle=stage.rest_angle,
        )
    )
    angle = joined_records([piece.record for piece in pieces]).c[:, 0]
    last = angle[-1] - 2.0 * np.pi * _TURNS
    even = last + 2.0 * np.pi * np.arange(_TURNS * _SAMPLES) / _SAMPLES
    columns = {
        name: np.full(even.size, value)
        for name, value in zip(("torque", "ntl_y", "ntl_z"), load, strict=True)
    }
    inputs = inputs_of_columns({"carrier_angle": even, **columns})
    difference = []
    for sensor in SENSORS:
        moving = np.concatenate([piece.signals[sensor.name] for piece in pieces])
        rim = RimSensor(sensor.angle, sensor.radius, sensor.quantity == AXIAL)
        difference.append(np.interp(even, angle, moving) - readings.signal(rim, inputs))
    return bands(np.array(difference), _TURNS, stage.data.gear.ring_teeth)


def _stage(body: StageBody, name: str, speed: float) -> PredictedStage:
    data = StageData(mesh=MeshData(n_slices=2), bearings=BEARINGS[name])
    return PredictedStage(body, data, StageEffects(), ReadingEffects(), speed, rest_angle=0.0)


def _write(body: StageBody, number: tuple[str, float], path: Path) -> None:
    with single_threaded():
        rows = compared(_stage(body, *number))
    save_json(path, {"rows": [{"load": row.load, "rms": row.rms} for row in rows]})


def _rows(content: dict[str, Any]) -> list[BandDifference]:
    return [BandDifference(tuple(row["load"]), row["rms"]) for row in content["rows"]]


def table(stages: Sequence[tuple[str, float]], rows: Sequence[list[BandDifference]]) -> list[str]:
    """Median and largest difference of the loads by stage and band [um]."""
    lines = [
        f"| carrier bearings | rad/s | {' | '.join(BANDS)} |",
        "|---|---|" + "---|" * len(BANDS),
    ]
    for (name, speed), of_loads in zip(stages, rows, strict=True):
        cells = []
        for band in BANDS:
            sizes = [1e6 * row.rms[band] for row in of_loads]
            cells.append(f"{np.median(sizes):.2f}, at most {max(sizes):.2f}")
        lines.append(f"| {name} | {speed:g} | {' | '.join(cells)} |")
    return lines


def main(*, out: Path, size: float = 0.06, workers: int = 1, quiet: bool = False) -> None:
    """Run the stages and compare; write stage_dynamics.md.

    Parameters
    ----------
    out
        Folder; stages that stand there are not run again.
    size
        Element edge length of carrier and pins [m].
    workers
        Processes.
    quiet
        Show no progress.
    """
    folder, stages = prepared_folder(out), Stages(2, quiet)
    with stages.stage(f"carrier and pins of {size} m"):
        body = default_stage_body(PAPER_STIFFNESS, size)
    drawn = [(name, speed) for name in BEARINGS for speed in SPEEDS]
    files = [folder / f"{name.replace(' ', '_')}-{speed:g}.json" for name, speed in drawn]
    with stages.stage(f"{len(drawn)} stages"), work_executor(workers) as executor:
        make_missing(drawn, files, partial(_write, body), executor, stages)
    rows = [read_case(file, "a stage of this study", _rows) for file in files]
    lines = table(drawn, rows)
    write_table(folder / "stage_dynamics.md", lines)
    print("\n".join(lines))


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)
