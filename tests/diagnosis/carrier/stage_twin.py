"""Records of a planetary stage: equilibria under a few loads, read with noise."""

import numpy as np

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.carrier.models import rim_sensor
from carrierflex.simulation.carrier.rim import inputs_of_columns
from carrierflex.simulation.carrier.run_cases import AXIAL, Sensor
from carrierflex.simulation.stage.predicted_readings import LoadPoints, stage_readings

FLOOR, RADIUS = 5e-6, 0.412
LOADS = np.array(
    [
        [360e3, 0.0, 0.0],
        [180e3, 0.0, 0.0],
        [360e3, 0.0, -2e5],
        [360e3, 1e5, 1e5],
        [270e3, 0.0, 5e4],
    ]
)


def measured(truth):
    """Records of a stage, before anything predicts them."""
    channels = tuple(
        Channel(
            f"s{angle:03d}",
            "axial_displacement",
            "m",
            noise_std=FLOOR,
            angle=np.deg2rad(angle),
            radius=RADIUS,
        )
        for angle in (47, 137, 227, 317)
    )
    sensors = [Sensor(one.name, AXIAL, one.angle, RADIUS) for one in channels]
    points = LoadPoints(LOADS, np.array([360e3, 2e5, 2e5]))
    readings, _ = stage_readings(truth, sensors, points)
    rng, runs = np.random.default_rng(3), []
    for k, load in enumerate(LOADS):
        time = np.arange(12 * 60 + 1) / 22.0
        columns = zip(("torque", "ntl_y", "ntl_z"), load, strict=True)
        inputs = {name: np.full(time.size, value) for name, value in columns}
        inputs["carrier_angle"] = 2.3 * time
        at = inputs_of_columns({**inputs, "time": time})
        signals = {
            one.name: readings.signal(rim_sensor(one), at) + FLOOR * rng.standard_normal(time.size)
            for one in channels
        }
        runs.append(Run(f"R{k}", f"R{k}.csv", str(k), time, inputs, signals))
    rig = {"nominal_torque": 360e3, "sensor_radius": RADIUS, "n_planets": 3}
    baseline = Baseline("stage", ("axial_offset",), case="stage.toml")
    return Campaign("carrier", "twin", baseline, rig, channels, tuple(runs))
