"""A simulated experiment in the form of a measurement campaign."""

from collections.abc import Mapping, Sequence
from typing import Any

from identification.campaign import Baseline, Campaign, Channel
from identification.records import Run
from simulation.carrier_motion import Response
from simulation.run_cases import RunCase, Sensor

#: File of a campaign folder that holds the deflection curves.
CURVES_FILE = "deflection_curves.csv"


def simulated_campaign(
    name: str,
    sensors: Sequence[Sensor],
    runs: Sequence[tuple[RunCase, Response]],
    *,
    rig: Mapping[str, Any],
    noise_std: float,
) -> Campaign:
    """Put simulated records into the form of a measurement campaign of kind ``carrier``.

    Parameters
    ----------
    name : str
        Title.
    sensors : sequence of Sensor
        Sensors; they become channels.
    runs : sequence of (RunCase, Response)
        What was done and what the sensors read.
    rig : mapping
        ``nominal_torque`` [N m], ``sensor_radius`` [m], ``n_planets``.
    noise_std : float
        Standard deviation of the noise of every sensor [m]; not declared where it is zero.

    Returns
    -------
    Campaign
        Its baseline holds the axial offset alone: no misalignment, no flexibility.
    """
    channels = tuple(
        Channel(
            sensor.name, sensor.quantity, "m", angle=sensor.angle, radius=sensor.radius, noise_std=noise_std or None
        )
        for sensor in sensors
    )
    records = tuple(
        Run(
            name=case.name,
            file=f"{case.name}.csv",
            condition=case.condition,
            time=response.time,
            inputs={
                "carrier_angle": response.carrier_angle,
                "torque": response.torque,
                "ntl_y": response.ntl_y,
                "ntl_z": response.ntl_z,
            },
            signals=response.signals,
        )
        for case, response in runs
    )
    return Campaign(
        kind="carrier",
        name=name,
        baseline=Baseline("model", ("axial_offset",)),
        rig={**rig, "deflection_curves": CURVES_FILE},
        channels=channels,
        runs=records,
    )
