"""Motion of the housing measured and simulated, figures 7 and 10 of the 2011 paper.

Matplotlib is imported late.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.shown_values import literal
from carrierflex.simulation.mounting.rig import HOUSING_MOTION

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Time [s] with measured and simulated motion, shapes (n, 6), in metres and radians.
MotionRecord = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]


def housing_motion_figure(motions: Mapping[str, MotionRecord]) -> "Figure":
    """Six motions of the housing over time, one column a run.

    Parameters
    ----------
    motions : mapping of str to MotionRecord
        Time, measured and simulated motion by run.

    Returns
    -------
    Figure
        Six panels a run, displacements in mm and rotations in mrad.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.5 * len(motions) + 1.0, 11.0), layout="constrained")
    panels = figure.subplots(len(HOUSING_MOTION), len(motions), sharex="col", squeeze=False)
    for column, (run, (time, measured, simulated)) in enumerate(motions.items()):
        for row, name in enumerate(HOUSING_MOTION):
            axes = panels[row, column]
            axes.plot(time, measured[:, row] * 1e3, color="0.6", linewidth=1.2, label="measured")
            axes.plot(
                time, simulated[:, row] * 1e3, color="#0072b2", linewidth=0.8, label="simulated"
            )
            axes.set_ylabel(f"{name}, {'mm' if name.startswith('d') else 'mrad'}")
        panels[0, column].set_title(literal(run))
        panels[-1, column].set_xlabel("time, s")
    panels[0, 0].legend(loc="lower right")
    return figure
