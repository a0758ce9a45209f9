"""Order 1 at the sensors over kink, clearance, moment support, torque, load and load case."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from carrierflex.workflows.simulation.order_one_supports import AXES

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def order_one_figure(
    sweeps: Mapping[str, Mapping[str, tuple[float, ...]]],
    load_cases: Mapping[str, Mapping[str, float]],
    paper: Mapping[str, float],
) -> "Figure":
    """Six panels; dashed lines are the values that table 5 of the 2012 paper determines.

    Parameters
    ----------
    sweeps : mapping of str to mapping of str to tuple of float
        Order 1 [m] by axis, then by support.
    load_cases : mapping of str to mapping of str to float
        Order 1 [m] by support, then by load case.
    paper : mapping of str to float
        Order 1 by load case [m].
    """
    from matplotlib.figure import Figure

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
