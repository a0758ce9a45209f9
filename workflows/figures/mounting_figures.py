"""Loads and motion of the mounting, measured and identified: 2011 paper, figures 6, 7, 9 and 10."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from carrierflex.identification.mounting.bushing_models import NONLINEAR
from carrierflex.simulation.mounting.rig import HOUSING_MOTION, SENSORS
from carrierflex.workflows.figures.shared_runs import LABELS, MountingRecords, SharedRuns

#: Axis of time of the measured record [s].
_TIME = (0.0, 700.0)
#: Axis of rotations in figures 7 and 10 [1e-3 rad].
_ROTATION = (-5.0, 10.0)
#: Directions of the cylinders of the radial load, assumed: 45 degrees to either side of upright.
_CYLINDER_ANGLE = np.deg2rad(45.0)
_SYMBOLS = ("$d_x$", "$d_y$", "$d_z$", r"$\theta_x$", r"$\theta_y$", r"$\theta_z$")
COLOURS = {"NLin": "#0072b2", "Lin": "#d55e00", "HD-b": "tab:green"}


def load_case(shared: SharedRuns) -> Figure:
    """Torque, radial loads and motion sensors of the load case (figure 6)."""
    records = shared.mounting
    time = records.inputs.time
    figure = Figure(figsize=(9.5, 8.5), layout="constrained")
    torque, force, sensors = figure.subplots(3, 1, sharex=True, height_ratios=(1.0, 1.0, 1.6))
    torque.plot(time, records.inputs.torque / 1e3, color="black", lw=1.0, label="$T$")
    torque.set(ylabel="Torque [kNm]", ylim=(-20.0, 90.0))
    for name, values in cylinder_forces(records).items():
        force.plot(time, values / 1e3, lw=1.0, label=name)
    force.set(ylabel="Force [kN]", ylim=(-100.0, 100.0))
    (run,) = records.campaign.runs
    for name in SENSORS:
        sensors.plot(run.time, run.signals[name] * 1e3, lw=0.9, label=name)
    sensors.set(ylabel="Displacement [mm]", xlabel="Time [s]", xlim=_TIME, ylim=(-8.0, 2.0))
    for axes in (torque, force, sensors):
        _finish(axes, 3 if axes is sensors else 1)
    return figure


def cylinder_forces(records: MountingRecords) -> dict[str, NDArray[np.float64]]:
    """Pushes of port and starboard cylinder [N] that give the radial load, shape (n,).

    The cylinders stand 45 degrees to either side of upright, an assumption: their angles are not
    printed. Port pushes along (y, z) = (sin, cos), starboard along (-sin, cos).
    """
    y, z = records.inputs.ntl_y, records.inputs.ntl_z
    along_z, along_y = z / np.cos(_CYLINDER_ANGLE) / 2.0, y / np.sin(_CYLINDER_ANGLE) / 2.0
    return {"$F_{NTL,p}$": along_z + along_y, "$F_{NTL,s}$": along_z - along_y}


def housing_motion(shared: SharedRuns) -> Figure:
    """Rigid-body motion of the housing from the sensors, d(t) of equation 10 (figure 7)."""
    records = shared.mounting
    figure, panels = _motion_panels("Displacement [mm]", "Rotation [$10^{-3}$ rad]")
    for k, symbol in enumerate(_SYMBOLS):
        panels[k // 3].plot(records.inputs.time, records.measured[:, k] * 1e3, lw=0.9, label=symbol)
    panels[0].set_ylim(-3.0, 1.0)
    panels[1].set(xlim=_TIME, ylim=_ROTATION)
    for axes in panels:
        _finish(axes, 3)
    return figure


def roll_of_three_models(shared: SharedRuns) -> Figure:
    """Roll theta_x: test and the three identified bushing models (figure 9)."""
    records = shared.mounting
    time = records.inputs.time
    figure = Figure(figsize=(9.5, 5.6), layout="constrained")
    axes = figure.subplots()
    column = HOUSING_MOTION.index("theta_x")
    axes.plot(time, records.measured[:, column] * 1e3, color="0.65", lw=2.4, label="Test")
    for model, label in LABELS.items():
        rms = _rms(records, model)[column] * 1e3
        axes.plot(
            time, records.adapted[model][:, column] * 1e3, color=COLOURS[label], lw=1.0,
            label=f"{label}, RMS of the gap {rms:.3f}",
        )  # fmt: skip
    axes.set(
        xlabel="Time [s]",
        ylabel=r"Rotation $\theta_x$ [$10^{-3}$ rad]",
        xlim=(100.0, 655.0),
        ylim=(-4.0, 6.0),
    )
    axes.grid(alpha=0.3)
    axes.legend(loc="lower right", fontsize=9, framealpha=1.0)
    inset = axes.inset_axes((0.12, 0.08, 0.42, 0.34))
    _draw_inset(inset, records, column)
    axes.indicate_inset_zoom(inset, edgecolor="0.4")
    return figure


def _draw_inset(inset: Axes, records: MountingRecords, column: int) -> None:
    """The end of the record, where the torque has come, enlarged."""
    time = records.inputs.time
    last = time >= 600.0
    inset.plot(time[last], records.measured[last, column] * 1e3, color="0.65", lw=2.4)
    for model, label in LABELS.items():
        inset.plot(
            time[last], records.adapted[model][last, column] * 1e3, color=COLOURS[label], lw=1.0
        )
    inset.set_xlim(600.0, 620.0)
    inset.tick_params(labelsize=8)
    inset.grid(alpha=0.3)


def six_motions(shared: SharedRuns) -> Figure:
    """Six motions measured (m) and of the nonlinear bushings (a) (figure 10)."""
    records = shared.mounting
    adapted = records.adapted[NONLINEAR.name]
    figure, panels = _motion_panels("Displacement [$10^{-3}$ m]", "Rotation [$10^{-3}$ rad]")
    for k, symbol in enumerate(_SYMBOLS):
        colour = f"C{k % 3}"
        name = symbol.strip("$")
        base, _, index = name.partition("_")
        measured, simulated = (f"${base}^{kind}_{index}$" for kind in ("m", "a"))
        axes = panels[k // 3]
        axes.plot(
            records.inputs.time, records.measured[:, k] * 1e3, color=colour, lw=2.2, alpha=0.45,
            label=measured,
        )  # fmt: skip
        axes.plot(records.inputs.time, adapted[:, k] * 1e3, color=colour, lw=0.9, label=simulated)
    panels[0].set_ylim(-4.0, 2.0)
    panels[1].set(xlim=(0.0, 655.0), ylim=_ROTATION)
    for axes in panels:
        _finish(axes, 3)
    return figure


def _rms(records: MountingRecords, model: str) -> NDArray[np.float64]:
    """RMS of measured less adapted motion, shape (6,) [m, rad]."""
    gap = records.measured - records.adapted[model]
    return np.asarray(np.sqrt(np.mean(np.square(gap), axis=0)))


def accuracy(records: MountingRecords) -> Mapping[str, float]:
    """Objective of every model over that of the hydro-dynamic one, table 2's last row."""
    cost = {label: records.estimates[model].fit.cost for model, label in LABELS.items()}
    return {label: value / cost["HD-b"] for label, value in cost.items()}


def _motion_panels(displacement: str, rotation: str) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(9.5, 7.5), layout="constrained")
    panels = list(figure.subplots(2, 1, sharex=True))
    panels[0].set_ylabel(displacement)
    panels[1].set(ylabel=rotation, xlabel="Time [s]")
    return figure, panels


def _finish(axes: Axes, columns: int) -> None:
    axes.grid(alpha=0.3)
    axes.legend(ncols=columns, loc="best", fontsize=9, framealpha=1.0)
