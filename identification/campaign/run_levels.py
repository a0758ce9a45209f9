"""Load, speed and amplitude of a run, each as one number in the unit an engineer reads."""

import math

import numpy as np

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run

#: Factor and unit in which a level is shown.
_SHOWN = {
    "N m": (1e-3, "kN m"),
    "N": (1e-3, "kN"),
    "rad/s": (30.0 / math.pi, "1/min"),
}


def run_levels(campaign: Campaign, run: Run) -> dict[str, float]:
    """Loads and speed of a run: means of a carrier's, the largest of a mounting's.

    Of an element the standard deviations of its signals and of the deflection's rate.

    Parameters
    ----------
    campaign : Campaign
        What the run is of.
    run : Run
        Its samples within the windows that count are taken.

    Returns
    -------
    dict of str to float
        Levels by name and unit, ``torque [kN m]``.
    """
    columns = {name: values[run.in_use] for name, values in run.inputs.items()}
    units = dict(campaign.input_units)
    time = run.time[run.in_use]
    if campaign.kind == "element":
        columns |= {one.name: run.signals[one.name][run.in_use] for one in campaign.channels[:1]}
        units |= {one.name: one.unit for one in campaign.channels}
        moving = next(name for name in reversed(columns) if units[name] != "N" or len(columns) == 1)
        columns["rate"], units["rate"] = np.gradient(columns[moving], time), f"{units[moving]}/s"
        return {
            f"{name}, RMS [{units[name]}]": float(np.nanstd(values))
            for name, values in columns.items()
        }
    angle = columns.pop("carrier_angle", None)
    if angle is not None and "speed" not in columns and angle.size > 1:
        columns["speed"] = np.array([(angle[-1] - angle[0]) / (time[-1] - time[0])])
        units["speed"] = "rad/s"
    levels = {}
    for name, values in columns.items():
        factor, unit = _SHOWN.get(units[name], (1.0, units[name]))
        largest = (
            values[np.argmax(np.abs(values))] if campaign.kind == "mounting" else values.mean()
        )
        levels[f"{name} [{unit}]"] = factor * float(largest)
    return levels
