"""Identified and simulated motion of the carrier: 2012 paper, figures 9, 10, 11 and 14."""

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from carrierflex.identification.campaign.records import Run
from carrierflex.identification.carrier.carrier_identification import two_revolutions
from carrierflex.identification.view import parameters_figure, signals_figure
from carrierflex.simulation.carrier.run_cases import AXIAL
from carrierflex.workflows.figures.shared_runs import SharedRuns
from carrierflex.workflows.figures.stage_records import SHOWN

#: Parameters of model M1, figure 10, and what M2 adds, figure 11.
RIGID_PARAMETERS = ("d_x", "theta_H", "phi_H", "theta_PLC", "phi_PLC")
DEFLECTION_PARAMETERS = ("rho_s", "rho_f")


def identified_signals(shared: SharedRuns) -> Figure:
    """LC2 measured and identified at the four axial sensors (figure 9)."""
    stage = shared.stage
    fits = [(model, stage.estimates[model.name][SHOWN]) for model in stage.models]
    return signals_figure(stage.measured(), stage.campaign.channels_of(AXIAL), fits)


def rigid_parameters(shared: SharedRuns) -> Figure:
    """Parameters of M1 by load case, by both models (figure 10)."""
    return parameters_figure(shared.stage.estimates, RIGID_PARAMETERS)


def deflection_parameters(shared: SharedRuns) -> Figure:
    """Scales of the deflection curves by load case (figure 11)."""
    return parameters_figure({"m2": shared.stage.estimates["m2"]}, DEFLECTION_PARAMETERS)


def measured_and_simulated(shared: SharedRuns) -> Figure:
    """LC2 measured and simulated at the four axial sensors (figure 14)."""
    stage = shared.stage
    channels = stage.campaign.channels_of(AXIAL)
    figure = Figure(figsize=(9.0, 7.5), layout="constrained")
    panels = figure.subplots(2, 2, sharex=True, sharey=True).ravel()
    gaps = []
    for panel, channel in zip(panels, channels, strict=True):
        turns, measured = _less_its_mean(stage.measured(), channel.name)
        simulated_turns, simulated = _less_its_mean(stage.simulated, channel.name)
        panel.plot(turns, measured * 1e3, color="0.6", label="measured")
        panel.plot(simulated_turns, simulated * 1e3, color="tab:blue", lw=1.2, label="simulated")
        gaps.append(measured - np.interp(turns, simulated_turns, simulated))
        panel.set_title(f"{channel.name}, sensor at {np.rad2deg(channel.angle or 0.0):.0f}°")
        panel.grid(alpha=0.3)
    for panel in panels[::2]:
        panel.set_ylabel("axial displacement\nless its mean [mm]")
    for panel in panels[2:]:
        panel.set_xlabel("carrier angle [revolutions]")
    rms = float(np.sqrt(np.mean(np.square(gaps)))) * 1e3
    figure.suptitle(f"{SHOWN}: measured and simulated, RMS of the gap {rms:.3f} mm")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def _less_its_mean(run: Run, name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """First two revolutions of a signal: carrier angle [revolutions], displacement [m]."""
    shown = two_revolutions(run)
    turns = run.inputs["carrier_angle"][shown] / (2.0 * np.pi)
    signal = run.signals[name][shown]
    return turns - turns[0], signal - signal.mean()
