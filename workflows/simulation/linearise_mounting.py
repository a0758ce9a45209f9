"""Linearise the mounting where its runs carry their largest torque.

Writes, for every run of a case of kind ``mounting``, the modes at its operating point and at shares
of its loads, the frequency response of the six sensors to torque and radial load, and the Campbell
diagram. A good answer: frequencies that rise with the torque for hardening bushings and lie away
from the once- and three-times-per-revolution lines; no root that grows.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, TypedDict

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.json_files import save_json
from carrierflex.files.versions import Versions, versions
from carrierflex.simulation.mounting.case_files import MountingCase, MountingRun
from carrierflex.simulation.mounting.history_inputs import history_inputs
from carrierflex.simulation.mounting.linearised import (
    campbell_diagram,
    frequency_response,
    mounting_modes,
)
from carrierflex.simulation.mounting.rig import SENSORS
from carrierflex.simulation.mounting.view import linearised_figure
from carrierflex.simulation.stage.linearised import CampbellDiagram
from carrierflex.workflows.outputs import prepared_folder, save_figure, save_table

Array = NDArray[np.float64]

_FREQUENCIES_HZ = np.geomspace(0.1, 200.0, 400)
#: Shares of the operating point's loads at which the modes are listed: bushings that harden show
#: themselves here.
_LOAD_SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)
#: Speeds of the Campbell diagram over the run's largest.
_SPEED_SHARES = np.linspace(0.0, 1.2, 25)
_LOADS = (("torque", "N m"), ("ntl_y", "N"), ("ntl_z", "N"))
_PER_LOAD = {"torque": "m/(N m)", "ntl_y": "m/N", "ntl_z": "m/N"}


def main(case: MountingCase, *, out: Path) -> None:
    """Write modes, frequency response and Campbell diagram of every run's operating point.

    Parameters
    ----------
    case : MountingCase
        The case; its truth is linearised.
    out : Path
        Folder for ``RUN_modes.csv``, ``RUN_frequency_response.csv``, ``RUN_campbell.csv``,
        ``RUN_linearised.png`` and ``linearised.json``.

    Raises
    ------
    ArithmeticError
        Where the bushings find no equilibrium under the loads of a run.
    """
    prepared_folder(out)
    points = {run.name: operating_point(run) for run in case.runs}
    for run in case.runs:
        loads, speed = points[run.name]
        response = frequency_response(case.rig, case.truth, loads, _FREQUENCIES_HZ)
        campbell = campbell_diagram(case.rig, case.truth, loads, list(speed * _SPEED_SHARES))
        save_table(out / f"{run.name}_modes.csv", _mode_header(), _mode_rows(case, loads))
        table = response_table(SENSORS, _FREQUENCIES_HZ, response)
        save_table(out / f"{run.name}_frequency_response.csv", *table)
        save_table(out / f"{run.name}_campbell.csv", *campbell_table(campbell))
        title = (
            f"{run.name}: torque {loads[0] / 1e3:.4g} kN m, ntl_y {loads[1] / 1e3:.4g} kN, ntl_z "
            f"{loads[2] / 1e3:.4g} kN"
        )
        save_figure(
            out / f"{run.name}_linearised.png",
            linearised_figure(title, _FREQUENCIES_HZ, response, campbell),
        )
    named = {
        name: {**dict(zip(dict(_LOADS), loads, strict=True)), "speed": w}
        for name, (loads, w) in points.items()
    }
    save_json(
        out / "linearised.json",
        {"case": case.name, "operating_points": named, "versions": versions()},
    )


def operating_point(run: MountingRun) -> tuple[Array, float]:
    """Loads (torque, ntl_y, ntl_z) at the run's largest torque, and its largest speed [rad/s]."""
    inputs = history_inputs(run.history)
    index = int(np.abs(inputs.torque).argmax())
    return np.array([inputs.torque[index], inputs.ntl_y[index], inputs.ntl_z[index]]), float(
        np.abs(inputs.speed).max()
    )


def _mode_header() -> list[str]:
    loads = [f"{name} [{unit}]" for name, unit in _LOADS]
    return [
        *loads,
        "leading_coordinate",
        "frequency_hz",
        "damping_ratio",
        "root_real [1/s]",
        "root_imag [1/s]",
    ]


def _mode_rows(case: MountingCase, loads: Array) -> Iterable[list[object]]:
    for share in _LOAD_SHARES:
        modes = mounting_modes(case.rig, case.truth, share * loads)
        columns = zip(
            modes.leading_coordinates(),
            modes.frequency_hz,
            modes.damping_ratio,
            modes.roots,
            strict=True,
        )
        for name, frequency_hz, damping_ratio, root in columns:
            yield [*(share * loads + 0.0), name, frequency_hz, damping_ratio, root.real, root.imag]


def response_table(
    sensors: Sequence[str], frequency_hz: Array, response: NDArray[np.complex128]
) -> tuple[list[str], list[list[object]]]:
    """Header and rows of a frequency response, shape (n_frequencies, n_sensors, 3)."""
    header = [
        f"{s}_per_{load}_{component} [{unit}]"
        for load, unit in _PER_LOAD.items()
        for s in sensors
        for component in ("re", "im")
    ]
    rows = [
        [frequency, *row.T.copy().view(np.float64).ravel()]
        for frequency, row in zip(frequency_hz, response, strict=True)
    ]
    return ["frequency_hz", *header], rows


def campbell_table(campbell: CampbellDiagram) -> tuple[list[str], Iterable[list[object]]]:
    """Header and rows of a Campbell diagram.

    Speed, frequency of every mode, lines of excitation.
    """
    modes = [f"mode_{number}_hz" for number in range(1, campbell.frequency_hz.shape[1] + 1)]
    orders = np.column_stack(list(campbell.order_hz.values()))
    rows = np.column_stack([campbell.speed, campbell.frequency_hz, orders])
    return ["speed [rad/s]", *modes, *(f"{name}_hz" for name in campbell.order_hz)], rows.tolist()


class MountingLinearisedDocument(TypedDict):
    """linearised.json of a mounting, written by simulate --linearised."""

    case: Annotated[str, "Name of the case"]
    operating_points: Annotated[
        Mapping[str, Mapping[str, float]], "Loads [N m, N, N] and speed [rad/s] by run"
    ]
    versions: Versions
