"""Pictures of stage and mounting in time. Matplotlib is imported late."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.carrier.run_cases import AXIAL, Sensor
from carrierflex.simulation.mounting.rig import HOUSING_MOTION
from carrierflex.simulation.stage.load_channels import HOUSING_COLUMNS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Columns = Mapping[str, NDArray[np.float64]]


def stage_in_time_figure(run: str, columns: Columns, sensors: Sequence[Sensor]) -> "Figure":
    """Sensors, tooth forces, load shares and motion of the housing over the revolutions.

    Parameters
    ----------
    run : str
        Name of the run.
    columns : mapping of str to ndarray, shape (N,)
        Sensors [m] and the columns of :func:`load_columns` by name.
    sensors : sequence of Sensor
        Sensors to draw.

    Returns
    -------
    Figure
        Six panels.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13.0, 7.0), layout="constrained")
    figure.suptitle(f"{run}: the reduced bodies in the planetary stage")
    axial, radial, teeth, shares, moved, turned = figure.subplots(2, 3, sharex=True).flat
    turns = columns["carrier_angle"] / (2.0 * np.pi)
    n_planets = sum(name.startswith("share_") for name in columns)
    for sensor in sensors:
        panel = axial if sensor.quantity == AXIAL else radial
        panel.plot(turns, columns[sensor.name] * 1e3, label=sensor.name, linewidth=0.9)
    for mate, style in (("sun", "-"), ("ring", "--")):
        for planet in range(1, n_planets + 1):
            force = columns[f"{mate}_mesh_{planet}"] / 1e3
            teeth.plot(
                turns, force, f"C{planet - 1}{style}", label=f"{mate} {planet}", linewidth=0.7
            )
    for planet in range(1, n_planets + 1):
        share = columns[f"share_{planet}"] * 100.0
        shares.plot(turns, share, label=f"planet {planet}", linewidth=0.9)
    _draw_change(moved, turns, columns, HOUSING_COLUMNS[:3])
    _draw_change(turned, turns, columns, HOUSING_COLUMNS[3:])
    axial.set(title="axial sensors", ylabel="mm")
    radial.set(title="radial sensors", ylabel="mm")
    teeth.set(title="forces along the tooth normals", ylabel="kN")
    shares.set(title="load shares of the planets", ylabel="%")
    moved.set(title="housing: displacement less its mean", ylabel="um")
    turned.set(title="housing: rotation less its mean", ylabel="urad")
    for panel in (axial, radial, teeth, shares, moved, turned):
        panel.margins(y=0.45)
        n_columns = 1 if panel in (moved, turned) else 3
        panel.legend(fontsize="x-small", ncols=n_columns, loc="upper center")
        panel.grid(alpha=0.3)
    for panel in (shares, moved, turned):
        panel.set_xlabel("revolutions")
    return figure


def _draw_change(
    panel: "Axes", turns: NDArray[np.float64], columns: Columns, names: Sequence[str]
) -> None:
    """Columns less their means [um or urad], the means in the legend."""
    for name in names:
        mean = columns[name].mean()
        unit = "mrad" if "theta" in name else "mm"
        label = f"{name.removeprefix('housing_')}, mean {mean * 1e3:.3f} {unit}"
        panel.plot(turns, (columns[name] - mean) * 1e6, label=label, linewidth=0.9)


def mounting_in_time_figure(columns: Columns) -> "Figure":
    """Loads of the main shaft and motion of the housing over time.

    Parameters
    ----------
    columns : mapping of str to ndarray, shape (n,)
        ``time`` [s], ``torque`` [N m], ``ntl_y``, ``ntl_z`` [N], and the housing's motion [m, rad].

    Returns
    -------
    Figure
        Three panels.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 8.0), layout="constrained")
    figure.suptitle("housing on its bushings under the load case of the 2011 paper")
    loads, moved, turned = figure.subplots(3, 1, sharex=True)
    time = columns["time"]
    for name, unit in (("torque", "kN m"), ("ntl_y", "kN"), ("ntl_z", "kN")):
        loads.plot(time, columns[name] / 1e3, label=f"{name}, {unit}", linewidth=0.9)
    for panel, names, unit in (
        (moved, HOUSING_MOTION[:3], "mm"),
        (turned, HOUSING_MOTION[3:], "mrad"),
    ):
        for name in names:
            panel.plot(time, columns[name] * 1e3, label=name, linewidth=0.9)
        panel.set_ylabel(unit)
    loads.set(title="loads of the main shaft", ylabel="kN m, kN")
    moved.set_title("displacement midway between the bushings")
    turned.set(title="rotation", xlabel="time, s")
    for panel in (loads, moved, turned):
        panel.legend(fontsize="small", loc="upper left")
        panel.grid(alpha=0.3)
    return figure
