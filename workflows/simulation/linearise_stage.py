"""Linearise the planetary stage at the speed of its case.

Modes, frequency response at the rim, Campbell diagram.

Meshes are frozen in contact with their mean stiffness, the frame is the carrier's: what stands
still or whirls in the fixed frame appears one carrier frequency away. A good answer: no root grows,
the first mode is the torsion of the drive train, and the mesh frequency's line crosses no lightly
damped mode near the speed of the case.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, TypedDict

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.json_files import save_json
from carrierflex.files.versions import Versions, versions
from carrierflex.simulation.carrier.run_cases import AXIAL
from carrierflex.simulation.mounting.view import linearised_figure
from carrierflex.simulation.stage.linearised import (
    LinearisedModes,
    campbell_diagram,
    frequency_response,
    linearised_modes,
)
from carrierflex.simulation.stage.modal_form import ModalStage, modal_stage
from carrierflex.simulation.stage.readings import rim_reader
from carrierflex.simulation.stage.stage_cases import StageCase
from carrierflex.simulation.stage.stage_model import StageModel
from carrierflex.workflows.outputs import prepared_folder, save_figure, save_table
from carrierflex.workflows.simulation.linearise_mounting import campbell_table, response_table

_FREQUENCIES_HZ = np.geomspace(0.1, 1000.0, 400)
_SPEED_SHARES = np.linspace(0.0, 1.2, 7)
_N_MODES = 30
#: Lowest modes of the Campbell diagram: up to three times the mesh frequency.
_CAMPBELL_MODES = 12


def main(case: StageCase, model: StageModel, *, out: Path) -> None:
    """Write modes, frequency response and Campbell diagram of a stage.

    Parameters
    ----------
    case : StageCase
        Speed and sensors.
    model : StageModel
        The stage at that speed.
    out : Path
        Folder for ``modes.csv``, ``frequency_response.csv``, ``campbell.csv``, ``linearised.png``
        and ``linearised.json``.
    """
    prepared_folder(out)
    modal = modal_stage(model)
    response = rim_response(case, modal)
    speeds = list(case.speed * _SPEED_SHARES)
    campbell = campbell_diagram(
        model.layout.body, speeds, data=model.data, effects=model.effects, n_modes=_CAMPBELL_MODES
    )
    names = [sensor.name for sensor in case.sensors]
    header = ["mode", "leading_coordinate", "frequency_hz", "damping_ratio"]
    save_table(out / "modes.csv", header, _mode_rows(model, linearised_modes(modal)))
    table = response_table(names, _FREQUENCIES_HZ, response)
    save_table(out / "frequency_response.csv", *table)
    save_table(out / "campbell.csv", *campbell_table(campbell))
    title = f"{case.name}: {case.speed * 30.0 / np.pi:.4g} rpm"
    save_figure(
        out / "linearised.png",
        linearised_figure(title, _FREQUENCIES_HZ, response, campbell, sensors=names),
    )
    crossings = {order: campbell.crossings(order) for order in campbell.order_hz}
    content = {
        "case": case.name,
        "speed": case.speed,
        "crossings_rad_per_s": crossings,
        "versions": versions(),
    }
    save_json(out / "linearised.json", content)


def rim_readings(case: StageCase, model: StageModel) -> NDArray[np.float64]:
    """Rows of the sensors in the coordinates c at carrier angle 0, shape (n_sensors, n)."""
    reader = rim_reader(model)
    series = [
        reader.axial if sensor.quantity == AXIAL else reader.radial for sensor in case.sensors
    ]
    return np.array(
        [
            np.real(np.exp(1j * reader.orders * sensor.angle) @ coefficients)
            for sensor, coefficients in zip(case.sensors, series, strict=True)
        ]
    )


def rim_response(case: StageCase, modal: ModalStage) -> NDArray[np.complex128]:
    """Rim per load under each sensor at carrier angle 0, shape (n_frequencies, n_sensors, 3)."""
    loads = modal.model.loads
    response = np.zeros((len(_FREQUENCIES_HZ), len(case.sensors), 3), dtype=np.complex128)
    for row, reading in enumerate(rim_readings(case, modal.model)):
        for column, force in enumerate((loads.torque, loads.radial_y, loads.radial_z)):
            response[:, row, column] = frequency_response(modal, _FREQUENCIES_HZ, force, reading)
    return response


def _mode_rows(model: StageModel, modes: LinearisedModes) -> Iterable[list[object]]:
    for number in range(min(_N_MODES, len(modes.frequency_hz))):
        leading = model.labels[int(np.abs(modes.shape[:, number]).argmax())]
        yield [number + 1, leading, modes.frequency_hz[number], modes.damping_ratio[number]]


class StageLinearisedDocument(TypedDict):
    """linearised.json of a stage, written by simulate --linearised."""

    case: Annotated[str, "Name of the case"]
    speed: Annotated[float, "Speed [rad/s]"]
    crossings_rad_per_s: Annotated[Mapping[str, Any], "Speeds at which orders meet modes, by order"]
    versions: Versions
