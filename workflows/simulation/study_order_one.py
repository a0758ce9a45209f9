"""What decides how much of the misalignment the sensors see: the order-1 signal of the 2012 paper.

The paper measures 0.24 mm once a revolution and lays it to a kink between main shaft and carrier.
Static equilibria over a turn tell what becomes of such a kink: through the bearings and the
mounting of the housing, on which the sensors stand, and whether torque and radial load change it as
they do in the paper. Which cause explains the paper's numbers is another study's question:
``carrierflex papers gap``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypedDict

import numpy as np

from carrierflex.files.json_files import save_json
from carrierflex.files.versions import Versions, versions
from carrierflex.geometry.parameters import DEFAULT_SIZE
from carrierflex.geometry.pins import PAPER_STIFFNESS
from carrierflex.identification.carrier.printed_tables import (
    FULL_TORQUE,
    LOAD_CASES,
    SENSOR_RADIUS,
    derived_facts,
)
from carrierflex.simulation.carrier.run_cases import AXIAL, Sensor
from carrierflex.workflows.outputs import prepared_folder, save_figure, save_table
from carrierflex.workflows.progress import Stages

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from carrierflex.simulation.stage.stage_body import StageBody
    from carrierflex.workflows.simulation.order_one_supports import Axis, Support

#: Sensors of the paper.
SENSORS = tuple(
    Sensor(f"s{angle:03d}", AXIAL, float(np.deg2rad(angle)), SENSOR_RADIUS)
    for angle in (47, 137, 227, 317)
)
#: Supports of the table that are varied further, by a short name.
VARIED = {
    "bushings without moment, tight bearings": 0,
    "published clearances, axially 20.2 MN/m, x = 0.5 m": 12,
    "housing held, tight bearings": 19,
    "clearances, x = 0.2 m, kink 2.5 mrad, sun floating": 27,
    "the same, sun held by 3e8 N/m": 28,
}


@dataclass(frozen=True, eq=False)
class OrderOneRow:
    """What the sensors read with one support.

    Parameters
    ----------
    name : str
        The support.
    order_1, order_2, order_3 : float
        Mean amplitude over the sensors [m].
    share : float
        Order 1 over the motion of a kink that nothing holds, ``R_s phi``; NaN without a kink.
    tilt : tuple of float
        Rotation of the rim against the sensors about y and z that stands still [rad].
    sun_slope, ring_slope : float
        Half the range over the planets of their meshes' mean misalignment [rad]: what the kink does
        to the teeth. Torque and weight tilt all planets alike in the mean.
    """

    name: str
    order_1: float
    order_2: float
    order_3: float
    share: float
    tilt: tuple[float, float]
    sun_slope: float
    ring_slope: float


@dataclass(frozen=True, eq=False)
class OrderOneStudy:
    """The study's results."""

    rows: Annotated[tuple[OrderOneRow, ...], "One a support, at full torque"]
    sweeps: Annotated[
        Mapping[str, Mapping[str, tuple[float, ...]]],
        "Order 1 [m] by axis, then by varied support, over the axis' values",
    ]
    load_cases: Annotated[
        Mapping[str, Mapping[str, float]],
        "Order 1 [m] by varied support, then by load case of the paper",
    ]
    paper: Annotated[
        Mapping[str, float], "Order 1 that table 5 of the paper determines [m], by load case"
    ]
    folder: Annotated[Path, "Folder of table and picture"]


def main(*, out: Path, size: float = DEFAULT_SIZE, quiet: bool = False) -> OrderOneStudy:
    """Amplitude of order 1 at the axial sensors over the supports of carrier and housing.

    Static equilibria over a turn of the default stage with a kink between main shaft and carrier.

    Parameters
    ----------
    out
        Folder to write: order_one.json, order_one.csv, order_one_sweeps.csv and order_one.png.
    size
        Element edge length [m] of carrier and pins.
    quiet
        Show no progress.

    Returns
    -------
    OrderOneStudy
        Orders by support, over kink, clearance, moment support, torque and radial load, and by load
        case beside the paper's values.
    """
    from carrierflex.workflows.simulation.order_one_supports import AXES, supports
    from carrierflex.workflows.simulation.stage_bodies import default_stage_body

    folder, stages = prepared_folder(out), Stages(4, quiet)
    with stages.stage(f"reduced carrier and pins, elements of {size} m"):
        body = default_stage_body(PAPER_STIFFNESS, size)
    table = supports()
    with stages.stage(f"{len(table)} supports"):
        rows = tuple(_row(body, support) for support in table)
    varied = {name: table[number] for name, number in VARIED.items()}
    with stages.stage(f"{len(AXES)} sweeps and {len(LOAD_CASES)} load cases"):
        sweeps = {
            axis.name: {name: _sweep(body, support, axis) for name, support in varied.items()}
            for axis in AXES
        }
        load_cases = {name: _load_cases(body, support) for name, support in varied.items()}
    paper = {case: phi.value * SENSOR_RADIUS for case, phi in derived_facts().phi_PLC.items()}
    study = OrderOneStudy(rows, sweeps, load_cases, paper, folder)
    with stages.stage(f"writing {out}"):
        _write(study, size)
    return study


def _row(body: StageBody, support: Support) -> OrderOneRow:
    from carrierflex.simulation.stage.part_loads import mesh_misalignment
    from carrierflex.simulation.stage.quasi_static import (
        quasi_static_turn,
        sensor_orders,
        static_tilt,
    )
    from carrierflex.simulation.stage.stage_model import stage_model

    model = stage_model(body, support.data, effects=support.effects, speed=0.0)
    record = quasi_static_turn(model, support.load)
    orders = sensor_orders(model, record, SENSORS, support.reading)
    slopes = mesh_misalignment(model, record.c).mean(axis=0)
    kink = SENSOR_RADIUS * (support.phi_PLC or support.reading.phi_face)
    first, second, third = (orders.mean_amplitude(order) for order in (1, 2, 3))
    about_y, about_z = static_tilt(orders, SENSORS)
    return OrderOneRow(
        support.name,
        first,
        second,
        third,
        first / kink,
        (float(about_y), float(about_z)),
        float(np.ptp(slopes[: body.n_planets])) / 2.0,
        float(np.ptp(slopes[body.n_planets :])) / 2.0,
    )


def _sweep(body: StageBody, support: Support, axis: Axis) -> tuple[float, ...]:
    return tuple(_row(body, axis.changed(support, value)).order_1 for value in axis.values)


def _load_cases(body: StageBody, support: Support) -> dict[str, float]:
    from carrierflex.simulation.stage.statics import SteadyLoad

    loads = {
        case: SteadyLoad(share * FULL_TORQUE, ntl_z=force)
        for case, (share, force) in LOAD_CASES.items()
    }
    return {case: _row(body, replace(support, load=load)).order_1 for case, load in loads.items()}


def _write(study: OrderOneStudy, size: float) -> None:
    from carrierflex.workflows.simulation.order_one_supports import AXES

    folder = study.folder
    header = ["support", "order 1 [um]", "over the misalignment", "order 2 [um]", "order 3 [um]"]
    header += ["static tilt about y at the sensors [um]", "sun mesh [urad]", "ring mesh [urad]"]
    save_table(folder / "order_one.csv", header, [_cells(row) for row in study.rows])
    sweep_rows: list[Sequence[object]] = [
        [axis.name, axis.unit, name, value * axis.in_unit, order_1 * 1e6]
        for axis in AXES
        for name, values in study.sweeps[axis.name].items()
        for value, order_1 in zip(axis.values, values, strict=True)
    ]
    save_table(
        folder / "order_one_sweeps.csv",
        ["axis", "unit", "support", "value", "order 1 [um]"],
        sweep_rows,
    )
    save_json(
        folder / "order_one.json",
        {
            "inputs": {"size": size},
            "rows": study.rows,
            "sweeps_um": {
                axis.name: {
                    "unit": axis.unit,
                    "values": [value * axis.in_unit for value in axis.values],
                    "order_1": {
                        name: [value * 1e6 for value in values]
                        for name, values in study.sweeps[axis.name].items()
                    },
                }
                for axis in AXES
            },
            "load_cases_m": study.load_cases,
            "paper_m": study.paper,
            "versions": versions(),
        },
    )
    save_figure(folder / "order_one.png", _figure(study.sweeps, study.load_cases, study.paper))


def _cells(row: OrderOneRow) -> list[object]:
    tilt = row.tilt[0] * SENSOR_RADIUS
    micrometres = [value * 1e6 for value in (row.order_2, row.order_3, tilt)]
    slopes = [row.sun_slope * 1e6, row.ring_slope * 1e6]
    return [row.name, row.order_1 * 1e6, row.share, *micrometres, *slopes]


def _figure(
    sweeps: Mapping[str, Mapping[str, tuple[float, ...]]],
    load_cases: Mapping[str, Mapping[str, float]],
    paper: Mapping[str, float],
) -> Figure:
    """Six panels; dashed lines are the values that table 5 of the 2012 paper determines."""
    from matplotlib.figure import Figure

    from carrierflex.workflows.simulation.order_one_supports import AXES

    figure = Figure(figsize=(13, 7.5), layout="constrained")
    panels = list(figure.subplots(2, 3).flat)
    full = paper["LC1"] * 1e6
    for panel, axis in zip(panels, AXES, strict=False):
        for number, (name, values) in enumerate(sweeps[axis.name].items()):
            shown = [value * axis.in_unit for value in axis.values]
            panel.plot(shown, np.array(values) * 1e6, f"C{number}o-", markersize=3.5, label=name)
        panel.axhline(full, color="0.3", linestyle="--", linewidth=1.0, label="paper, LC1")
        unit = "" if axis.unit == "1" else f", {axis.unit}"
        panel.set(xlabel=f"{axis.name}{unit}", ylabel="order 1 at the sensors, µm")
        if axis.logarithmic:
            panel.set_xscale("log")
    last = panels[len(AXES)]
    cases = list(next(iter(load_cases.values())))
    for number, amplitudes in enumerate(load_cases.values()):
        shown = [amplitudes[case] * 1e6 for case in cases]
        last.plot(cases, shown, f"C{number}o-", markersize=3.5)
    last.plot(
        list(paper), [value * 1e6 for value in paper.values()], "k_", markersize=22, label="paper"
    )
    last.set(xlabel="load case", ylabel="order 1 at the sensors, µm")
    last.legend(frameon=False)
    for panel in panels:
        panel.set_ylim(bottom=0.0)
        panel.grid(alpha=0.3)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3, frameon=False)
    return figure


class Sweep(TypedDict):
    """Order 1 over one axis of the supports."""

    unit: Annotated[str, "Unit of the axis"]
    values: Annotated[Sequence[float], "Values"]
    order_1: Annotated[Mapping[str, Sequence[float]], "Amplitude by support [um]"]


class SizeInput(TypedDict):
    """Size of the elements."""

    size: Annotated[float, "Element edge length [m]"]


class OrderOneDocument(TypedDict):
    """order_one.json, written by order-one."""

    inputs: Annotated[SizeInput, "Inputs"]
    rows: Annotated[Sequence[OrderOneRow], "One a support, at full torque"]
    sweeps_um: Annotated[Mapping[str, Sweep], "By axis"]
    load_cases_m: Annotated[Mapping[str, Any], "Order 1 by load case [m]"]
    paper_m: Annotated[Any, "What the paper's figures hold [m]"]
    versions: Versions
