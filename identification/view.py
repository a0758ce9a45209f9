"""Figures of the identification, after figures 9 to 11 of the 2012 and 7 and 10 of the 2011 paper.

Matplotlib is imported late.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.shown_values import literal
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.carrier.carrier_identification import fitted_signal, two_revolutions
from carrierflex.identification.carrier.models import CarrierModel
from carrierflex.identification.carrier.parameter_estimate import ParameterEstimate
from carrierflex.identification.carrier.printed_tables import (
    FULL_TORQUE,
    LOAD_CASES,
    TABLE_4,
    DerivedFacts,
    Printed,
)
from carrierflex.identification.mounting.bushing_identification import BushingEstimate
from carrierflex.identification.mounting.equivalent_mass import BendingResiduals
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.rig import HOUSING_MOTION, MountingRig

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Time [s] with measured and simulated columns, shapes (n, m), in metres and radians.
MotionRecord = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
#: Samples of a channel of bending moments that are drawn.
_MOST_SAMPLES = 2000
#: Factor and unit a quantity is plotted in.
_SCALES = {"m": (1e3, "mm"), "rad": (1e3, "mrad"), "1": (1.0, "-")}
_COLOURS = {"m1": "#d55e00", "m2": "#0072b2"}
_SYMBOLS = {
    "d_x": r"$d_x$",
    "phi_H": r"$\phi_H$",
    "theta_H": r"$\theta_H$",
    "phi_PLC": r"$\phi_{PLC}$",
    "theta_PLC": r"$\theta_{PLC}$",
    "rho_s": r"$\rho_s$",
    "rho_f": r"$\rho_f$",
}


def signals_figure(
    run: Run, channels: Sequence[Channel], fits: Sequence[tuple[CarrierModel, ParameterEstimate]]
) -> "Figure":
    """Measured and identified axial signals over two revolutions, one panel a sensor (figure 9).

    Parameters
    ----------
    run : Run
        Record.
    channels : sequence of Channel
        Axial sensors.
    fits : sequence of (CarrierModel, ParameterEstimate)
        Identified models to draw.

    Returns
    -------
    matplotlib.figure.Figure
        Figure with one panel a channel, displacement [mm] over carrier angle [revolutions].
    """
    from matplotlib.figure import Figure

    shown = two_revolutions(run)
    turns = (run.inputs["carrier_angle"][shown] - run.inputs["carrier_angle"][shown[0]]) / (
        2.0 * np.pi
    )
    figure = Figure(figsize=(9.0, 7.5), layout="constrained")
    panels = figure.subplots((len(channels) + 1) // 2, 2, sharex=True, squeeze=False).ravel()
    for panel, channel in zip(panels, channels, strict=False):
        panel.plot(
            turns,
            1e3 * run.signals[channel.name][shown],
            ".",
            color="0.6",
            markersize=2.5,
            label="measured",
        )
        residuals = []
        for model, estimate in fits:
            signal = 1e3 * fitted_signal(run, channel, model, estimate)[shown]
            residual = 1e3 * run.signals[channel.name][shown] - signal
            rms, mean = np.sqrt(np.nanmean(residual**2)), np.nanmean(residual)
            residuals.append(f"{model.name.upper()} {rms:.3f} mm RMS, mean {mean:+.3f}")
            panel.plot(
                turns,
                signal,
                color=_COLOURS.get(model.name),
                linewidth=1.4,
                label=model.name.upper(),
            )
        panel.set_title(
            f"{literal(channel.name)} at {np.rad2deg(channel.angle or 0.0):.0f}°, "
            f"measured less identified:\n" + "\n".join(residuals),
            fontsize=10,
        )
        panel.set_ylabel("axial displacement [mm]")
        panel.grid(alpha=0.3)
    for unused in panels[len(channels) :]:
        unused.remove()
    for panel in panels[max(len(channels) - 2, 0) : len(channels)]:
        panel.set_xlabel("carrier angle [revolutions]")
        panel.tick_params(labelbottom=True)
    figure.suptitle(literal(f"{run.name} ({run.condition}): measured and identified"))
    figure.legend(
        *panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=1 + len(fits)
    )
    return figure


def rms_figure(estimates: Mapping[str, Mapping[str, ParameterEstimate]]) -> "Figure":
    """RMS of the residual by run and model (table 4).

    Parameters
    ----------
    estimates : mapping of str to mapping of str to ParameterEstimate
        Estimate by model name and run; a joint estimate may stand under every run.

    Returns
    -------
    matplotlib.figure.Figure
        Bar chart, RMS [mm].
    """
    from matplotlib.figure import Figure

    runs = list(next(iter(estimates.values())))
    width = 0.8 / len(estimates)
    figure = Figure(figsize=(7.0, 4.2), layout="constrained")
    panel = figure.subplots()
    for k, (name, by_run) in enumerate(estimates.items()):
        position = np.arange(len(runs)) + (k - (len(estimates) - 1) / 2.0) * width
        heights = [1e3 * by_run[run].rms_by_run[run] for run in runs]
        bars = panel.bar(position, heights, width, label=name.upper(), color=_COLOURS.get(name))
        panel.bar_label(bars, fmt="%.3f", fontsize=8, padding=2)
    panel.set_xticks(np.arange(len(runs)), [literal(run) for run in runs])
    panel.set_ylabel("RMS of measured minus identified [mm]")
    panel.margins(y=0.1)
    panel.grid(axis="y", alpha=0.3)
    figure.legend(loc="outside upper center", ncols=len(estimates))
    return figure


def parameters_figure(
    estimates: Mapping[str, Mapping[str, ParameterEstimate]], shown: Sequence[str] | None = None
) -> "Figure":
    """Parameters by run with 95 % intervals, one panel a parameter (figures 10 and 11).

    Parameters
    ----------
    estimates : mapping of str to mapping of str to ParameterEstimate
        Estimate by model name and run, as
        :func:`~carrierflex.identification.carrier.carrier_identification.identify_each_run` gives
        them; a joint estimate may stand under every run.
    shown : sequence of str, optional
        Parameters to show, in this order; all by default.

    Returns
    -------
    matplotlib.figure.Figure
        Offsets [mm], tilts [mrad], directions [deg], scales [-].
    """
    from matplotlib.figure import Figure

    names = list(
        shown
        or dict.fromkeys(
            name
            for runs in estimates.values()
            for estimate in runs.values()
            for name in estimate.names
        )
    )
    columns = min(3, len(names))
    rows = -(-len(names) // columns)
    figure = Figure(figsize=(1.0 + 3.0 * columns, 0.4 + 2.4 * rows), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for panel, name in zip(panels, names, strict=False):
        for k, (model, by_run) in enumerate(estimates.items()):
            _draw_parameter(
                panel, name, model, by_run, shift=0.2 * (k - (len(estimates) - 1) / 2.0)
            )
    for unused in panels[len(names) :]:
        unused.remove()
    handles = {
        label: handle
        for p in panels[: len(names)]
        for handle, label in zip(*p.get_legend_handles_labels(), strict=True)
    }
    figure.legend(
        list(handles.values()),
        list(handles),
        loc="outside upper center",
        ncols=len(handles),
        title="bars: 95 % intervals",
    )
    return figure


def _draw_parameter(
    panel: "Axes", name: str, model: str, by_run: Mapping[str, ParameterEstimate], *, shift: float
) -> None:
    """Draw one parameter of one model over the runs."""
    estimates = [
        (k, run, estimate)
        for k, (run, estimate) in enumerate(by_run.items())
        if name in estimate.names
    ]
    if not estimates:
        return
    indices = [estimate.index(name, run) for _, run, estimate in estimates]
    factor, unit = _SCALES[estimates[0][2].units[indices[0]]]
    if name.startswith("theta"):
        factor, unit = 180.0 / np.pi, "deg"
    value = [
        factor * estimate.values[i] for i, (_, _, estimate) in zip(indices, estimates, strict=True)
    ]
    half = [
        factor * estimate.confidence_factor[i] * estimate.std[i]
        for i, (_, _, estimate) in zip(indices, estimates, strict=True)
    ]
    panel.errorbar(
        [k + shift for k, *_ in estimates],
        value,
        yerr=np.where(np.isfinite(half), half, 0.0),
        fmt="o",
        markersize=4,
        capsize=4,
        color=_COLOURS.get(model),
        label=model.upper(),
    )
    panel.set_xticks(range(len(by_run)), [literal(run) for run in by_run])
    panel.set_xlim(-0.6, len(by_run) - 0.4)
    panel.set_ylabel(f"{_SYMBOLS.get(name, name)} [{unit}]")
    panel.grid(alpha=0.3)


def printed_tables_figure(facts: DerivedFacts) -> "Figure":
    """Rim deflection, misalignment and static saddle that the printed tables determine.

    With their intervals.

    Parameters
    ----------
    facts : DerivedFacts
        Values of the 2012 paper's tables 4 and 5.

    Returns
    -------
    Figure
        Three panels.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 3.6), layout="constrained")
    deflection, tilt, saddle = figure.subplots(1, 3)
    _draw_intervals(deflection, facts.deflection_per_torque, 1e9)
    deflection.set(title="rim deflection over torque, RMS", ylabel="um per kN m")
    if facts.common_deflection_per_torque is not None:
        common = facts.common_deflection_per_torque
        deflection.axhspan(
            common.low * 1e9, common.high * 1e9, color="tab:green", alpha=0.25, label="in common"
        )
        deflection.legend()
    _draw_intervals(tilt, facts.phi_PLC, 1e3)
    tilt.set(title=r"$\phi_{PLC}$", ylabel="mrad")
    loads = np.array([-200e3, 260e3])
    at_rest, slope = (coefficient.value for coefficient in facts.saddle_line)
    saddle.plot(
        loads / 1e3, (at_rest + slope * loads) * 1e3, color="#0072b2", label="line at full torque"
    )
    for case, (share, load) in LOAD_CASES.items():
        saddle.plot(
            load / 1e3,
            TABLE_4[case][1] * 1e3,
            "o",
            color="#0072b2",
            mfc="#0072b2" if share == 1.0 else "none",
        )
        saddle.annotate(
            case, (load / 1e3, TABLE_4[case][1] * 1e3), xytext=(6, 4), textcoords="offset points"
        )
    saddle.axhline(0.0, color="0.7", linewidth=0.8)
    saddle.set(title="what M2 leaves", xlabel="radial load, kN", ylabel="RMS, mm")
    saddle.legend()
    figure.suptitle(
        f"2012 paper, tables 4 and 5, at {FULL_TORQUE / 1e3:.0f} kN m full torque; bars: what the "
        "digits allow"
    )
    return figure


def _draw_intervals(axes: "Axes", by_case: Mapping[str, Printed], factor: float) -> None:
    for k, quantity in enumerate(by_case.values()):
        below, above = quantity.value - quantity.low, quantity.high - quantity.value
        axes.errorbar(
            k,
            quantity.value * factor,
            [[below * factor], [above * factor]],
            fmt="o",
            color="#0072b2",
            capsize=4,
        )
    axes.set_xticks(range(len(by_case)), list(by_case))


def bushing_signals_figure(
    campaign: Campaign, estimates: Mapping[str, BushingEstimate]
) -> "Figure":
    """Measured and simulated motion sensors of the housing, one column a run.

    After figure 10 of the 2011 paper.

    Parameters
    ----------
    campaign : Campaign
        Campaign of kind mounting.
    estimates : mapping of str to BushingEstimate
        Estimate by run.

    Returns
    -------
    Figure
        One panel a channel and run.
    """
    rig = MountingRig.from_table(campaign.rig)
    records, titles = [], []
    for run in campaign.runs:
        estimate = estimates[run.name]
        inputs = MountingInputs.from_columns(run.time, run.inputs)
        simulated = estimate.simulated(rig, inputs).by_sensor()
        measured = np.column_stack([run.signals[c.name] for c in campaign.channels])
        by_model = np.column_stack([simulated[str(c.sensor)] for c in campaign.channels])
        records.append((run.time, measured, by_model))
        rms = f"RMS of the gap {estimate.rms * 1e6:.3g} um over all sensors"
        titles.append(f"{literal(run.name)}, {rms}")
    labels = [f"{literal(channel.name)}, mm" for channel in campaign.channels]
    return _records_figure(records, titles, labels, next(iter(estimates.values())).model.name)


def housing_motion_figure(motions: Mapping[str, MotionRecord]) -> "Figure":
    """Six motions of the housing over time, one column a run (figures 7 and 10 of the 2011 paper).

    Parameters
    ----------
    motions : mapping of str to MotionRecord
        Time, measured and simulated motion by run.

    Returns
    -------
    Figure
        Six panels a run, displacements in mm and rotations in mrad.
    """
    labels = [f"{name}, {'mm' if name.startswith('d') else 'mrad'}" for name in HOUSING_MOTION]
    return _records_figure([*motions.values()], [literal(r) for r in motions], labels, "simulated")


def _records_figure(
    records: Sequence[MotionRecord], titles: Sequence[str], labels: Sequence[str], model: str
) -> "Figure":
    """Measured and simulated columns over time, a thousandth of their unit; a column a record."""
    from matplotlib.figure import Figure

    figure = Figure(
        figsize=(5.5 * len(records) + 1.0, 1.7 * len(labels) + 0.8), layout="constrained"
    )
    panels = figure.subplots(len(labels), len(records), sharex="col", squeeze=False)
    for column, (time, measured, simulated), title in zip(panels.T, records, titles, strict=True):
        for axes, label, actual, by_model in zip(
            column, labels, measured.T, simulated.T, strict=True
        ):
            axes.plot(time, actual * 1e3, color="0.6", linewidth=1.2, label="measured")
            axes.plot(time, by_model * 1e3, color="#0072b2", linewidth=0.8, label=model)
            axes.set_ylabel(label)
        column[0].set_title(title)
        column[-1].set_xlabel("time, s")
    panels[0, 0].legend(loc="lower right")
    return figure


def profile_figure(
    profiles: Mapping[str, tuple[NDArray[np.float64], NDArray[np.float64]]],
) -> "Figure":
    """Cost over one parameter at a time, the others fitted again.

    Parameters
    ----------
    profiles : mapping of str to (ndarray, ndarray)
        Values and cost over the least one, by parameter.

    Returns
    -------
    Figure
        One panel a parameter.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.0 * len(profiles) + 0.5, 3.4), layout="constrained")
    for axes, (name, (values, cost)) in zip(
        figure.subplots(1, len(profiles), squeeze=False)[0], profiles.items(), strict=True
    ):
        axes.plot(values, (cost - 1.0) * 100.0, "o-")
        axes.set(title=name, xlabel="value, SI units", ylabel="cost above the least, %")
        axes.grid(alpha=0.3)
    return figure


def bending_figure(residuals: BendingResiduals, estimate: ParameterEstimate) -> "Figure":
    """Measured and identified moments over the shaft's angle, one panel a channel."""
    from matplotlib.figure import Figure

    channels = residuals.campaign.channels
    figure = Figure(figsize=(11.0, 2.2 + 2.2 * len(channels)), layout="constrained")
    panels = np.atleast_1d(figure.subplots(len(channels), 1, sharex=True))
    for number, run in enumerate(residuals.campaign.runs):
        predicted = residuals.moments(estimate.values, run.name)
        every = max(1, run.time.size // _MOST_SAMPLES)
        turn = np.rad2deg(run.inputs["carrier_angle"][::every]) % 360.0
        order = np.argsort(turn)
        for panel, channel in zip(panels, channels, strict=True):
            measured, fitted = run.signals[channel.name], predicted[channel.name]
            zero = np.nanmean(measured - fitted)
            panel.plot(
                turn,
                measured[::every] / 1e3,
                ".",
                color=f"C{number}",
                ms=2,
                alpha=0.5,
                label=f"{run.name}, measured",
            )
            panel.plot(
                turn[order],
                (fitted + zero)[::every][order] / 1e3,
                ".",
                color="black",
                ms=1,
                label="identified" if number == 0 else None,
            )
            panel.set_ylabel(f"{channel.name} [kN m]")
    for panel in panels:
        panel.grid(alpha=0.3)
    panels[0].legend(fontsize="small", markerscale=4)
    panels[-1].set(xlabel="angle of the shaft [deg]", xlim=(0.0, 360.0))
    figure.suptitle(residuals.campaign.name)
    return figure
