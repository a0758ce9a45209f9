"""A simulated experiment in the form of a measurement campaign."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_kinds import BENDING
from carrierflex.identification.campaign.declarations import Baseline, Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.simulation.carrier.motion import Response
from carrierflex.simulation.carrier.run_cases import RunCase, Sensor
from carrierflex.simulation.mounting.case_files import MountingCase
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.rig import SENSORS
from carrierflex.simulation.mounting.shaft_bending import EquivalentMass, shaft_bending
from carrierflex.simulation.mounting.simulate import MountingResponse

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
    return rim_campaign(name, sensors, records, rig=rig, noise_std=noise_std)


def rim_campaign(
    name: str,
    sensors: Sequence[Sensor],
    runs: Sequence[Run],
    *,
    rig: Mapping[str, Any],
    noise_std: float,
) -> Campaign:
    """Campaign of kind ``carrier`` of simulated records; arguments as of `simulated_campaign`."""
    channels = tuple(
        Channel(
            sensor.name,
            sensor.quantity,
            "m",
            angle=sensor.angle,
            radius=sensor.radius,
            noise_std=noise_std or None,
        )
        for sensor in sensors
    )
    return Campaign(
        kind="carrier",
        name=name,
        baseline=Baseline("model", ("axial_offset",)),
        rig={**rig, "deflection_curves": CURVES_FILE},
        channels=channels,
        runs=tuple(runs),
    )


def simulated_mounting_campaign(
    case: MountingCase,
    records: Sequence[tuple[MountingInputs, MountingResponse]],
    *,
    suffix: str = ".csv",
    rng: np.random.Generator | None = None,
) -> Campaign:
    """Put simulated records of the mounting rig into a campaign of kind ``mounting``.

    Parameters
    ----------
    case : MountingCase
        What was done, with the nominal rig.
    records : sequence of (MountingInputs, MountingResponse)
        Loads and signals of each run of the case.
    suffix : str
        Of the runs' files: ``.csv`` or ``.parquet``.
    rng : numpy.random.Generator, optional
        Source of the noise of bending moments; they have none without.

    Returns
    -------
    Campaign
        Channels named as their sensors, then bending moments M_y, M_z (of several sections M_y_1
        ...); the baseline holds linear bushings alone.
    """
    channels = tuple(
        Channel(
            sensor, "housing_displacement", "m", sensor=sensor, noise_std=case.noise_std or None
        )
        for sensor in SENSORS
    )
    moments = tuple(
        (gauges, axis, f"M_{axis}" + (f"_{number}" if len(case.bending) > 1 else ""))
        for number, gauges in enumerate(case.bending, start=1)
        for axis in "yz"
    )
    channels += tuple(
        Channel(
            name,
            BENDING,
            "N m",
            axis=axis,
            section=gauges.section,
            noise_std=gauges.noise_std or None,
        )
        for gauges, axis, name in moments
    )
    of_coupling = EquivalentMass(case.rig.coupling_mass, case.rig.coupling_arm)

    def bending(inputs: MountingInputs, n: int) -> dict[str, NDArray[np.float64]]:
        """Bending moments of the first n samples of a run by channel [N m]."""
        of_run = (inputs.carrier_angle[:n], inputs.ntl_y[:n], inputs.ntl_z[:n])
        columns = {}
        for gauges, axis, name in moments:
            moment = shaft_bending(of_coupling, gauges.section, *of_run)[:, "yz".index(axis)]
            if rng is not None:
                moment = moment + gauges.noise_std * rng.standard_normal(n)
            columns[name] = moment
        return columns

    runs = tuple(
        Run(
            name=run.name,
            file=f"{run.name}{suffix}",
            condition=run.condition,
            time=response.time,
            inputs={name: values for name, values in inputs.columns().items() if name != "time"},
            signals={**response.by_sensor(), **bending(inputs, response.time.size)},
        )
        for run, (inputs, response) in zip(case.runs, records, strict=True)
    )
    return Campaign(
        kind="mounting",
        name=case.name,
        baseline=Baseline("model"),
        rig=case.rig.table(),
        channels=channels,
        runs=runs,
    )
