"""Figures of the mounting. Matplotlib is imported late."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.shown_values import literal
from carrierflex.simulation.mounting.rig import SENSORS
from carrierflex.simulation.stage.linearised import CampbellDiagram

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Sensors below this share of the largest do not answer to a load; rounding would draw them.
_SILENT = 1e-9

#: Loads of the columns of a frequency response, what to multiply by, and the unit then.
_LOADS = (("torque", 1e6, "mm per kN m"), ("ntl_y", 1e6, "mm per kN"), ("ntl_z", 1e6, "mm per kN"))


def linearised_figure(
    title: str,
    frequency_hz: NDArray[np.float64],
    response: NDArray[np.complex128],
    campbell: CampbellDiagram,
    *,
    sensors: Sequence[str] = SENSORS,
) -> "Figure":
    """Amplitude of the sensors over frequency, one panel a load, and the Campbell diagram.

    Parameters
    ----------
    title : str
        Operating point in words.
    frequency_hz : ndarray, shape (k,)
        Frequencies of the response.
    response : ndarray of complex, shape (k, n_sensors, 3)
        Sensors over torque, ntl_y, ntl_z.
    campbell : CampbellDiagram
        Frequencies over speed.
    sensors : sequence of str
        Names of the sensors.

    Returns
    -------
    Figure
        Four panels.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 8.0), layout="constrained")
    figure.suptitle(literal(title))
    axes = figure.subplots(2, 2)
    for column, (axis, (load, factor, unit)) in enumerate(zip(axes.flat[:3], _LOADS, strict=True)):
        amplitude = np.abs(response[:, :, column])
        for number, (sensor, values) in enumerate(zip(sensors, amplitude.T, strict=True)):
            if values.max() > _SILENT * amplitude.max():
                # Twin sensors read alike: dashes let the one beneath be seen.
                axis.loglog(
                    frequency_hz, values * factor, "--" if number % 2 else "-", label=sensor
                )
        axis.set(title=f"sensors over {load}", xlabel="frequency, Hz", ylabel=unit)
        axis.legend()
        axis.grid(True, which="both", alpha=0.3)
    _draw_campbell(axes.flat[3], campbell)
    return figure


def _draw_campbell(axis: "Axes", campbell: CampbellDiagram) -> None:
    rpm = campbell.speed * 30.0 / np.pi
    for number, mode in enumerate(campbell.frequency_hz.T):
        axis.plot(rpm, mode, color="black", label="" if number else "modes")
    for order, values in campbell.order_hz.items():
        axis.plot(rpm, values, "--", label=order)
    top = max(1.0, 1.3 * float(campbell.frequency_hz.max(initial=0.0)))
    axis.set(
        title="Campbell diagram", xlabel="main shaft, rpm", ylabel="frequency, Hz", ylim=(0.0, top)
    )
    axis.legend()
    axis.grid(True, alpha=0.3)
