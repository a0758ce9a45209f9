"""Torque over rotation of shaft, gearbox and mounting, figure 11 of the 2011 paper.

Matplotlib is imported late.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from carrierflex.simulation.mounting.torsional_train import TorqueSweep

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def torque_sweep_figure(sweeps: Mapping[str, TorqueSweep]) -> "Figure":
    """Torque over rotation, one line a member with the stiffness of its regression line.

    Parameters
    ----------
    sweeps : mapping of str to TorqueSweep
        Sweeps by member.

    Returns
    -------
    Figure
        One panel.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 4.5), layout="constrained")
    axes = figure.subplots()
    for name, sweep in sweeps.items():
        label = f"{name}: {sweep.stiffness / 1e6:.3g} MN m/rad"
        axes.plot(sweep.rotation * 1e3, sweep.torque / 1e3, label=label)
    axes.set(
        xlabel="rotation, mrad", ylabel="torque, kN m", title="torque sweep (2011 paper, figure 11)"
    )
    axes.legend()
    axes.grid(alpha=0.3)
    return figure
