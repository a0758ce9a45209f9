"""A turbine that runs: samples of its sensors under the effects of its baseline, and of causes."""

import numpy as np

from carrierflex.diagnosis.carrier.library import carrier_library
from carrierflex.diagnosis.carrier.watch.rim_revolutions import RimBaseline, Term
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.simulation.carrier.rim import CarrierRig, inputs_of_columns
from carrierflex.workflows.fe.default_curves import default_curves

ANGLES = {"s047": 47.0, "s137": 137.0, "s227": 227.0, "s317": 317.0}
NOISE = 3e-6
RATE = 60.0  # [1/s]
SPEED = 2.3  # [rad/s]
TILT, DEFLECTION = (1.0e-4, -0.7e-4), 0.8


def turbine():
    """Baseline of a carrier with a tilt and flexible pins."""
    channels = tuple(
        Channel(name, "axial_displacement", "m", angle=float(np.deg2rad(angle)), radius=0.412)
        for name, angle in ANGLES.items()
    )
    rig = CarrierRig(360e3, 3, 0.3, default_curves())
    effects = carrier_library(rig)
    terms = (
        Term(effects["carrier_tilt"], TILT),
        Term(effects["flexible_pins"], (DEFLECTION,)),
    )
    return RimBaseline(channels, rig, effects, terms)


def inputs(n_revolutions, *, first_angle=0.3):
    """Time and inputs: torque with a ripple, constant radial load."""
    n = int(n_revolutions * 2.0 * np.pi / SPEED * RATE)
    time = np.arange(n) / RATE
    return {
        "time": time,
        "carrier_angle": first_angle + SPEED * time + 0.02 * np.sin(0.11 * time),
        "torque": 350e3 + 10e3 * np.sin(0.3 * time),
        "ntl_y": np.full(n, 5e4),
        "ntl_z": np.full(n, -8e4),
    }


def effect_signal(baseline, columns, effect, coefficients):
    """Signals of a cause at all sensors, shape (C, n); coefficients not given are zero."""
    law = baseline.effects[effect]
    others = [0.0] * (len(law.parameters) - len(coefficients))
    term = Term(law, (*coefficients, *others))
    drive = inputs_of_columns(columns)
    sensors = [baseline.sensor(channel) for channel in baseline.channels]
    return np.array([term.signal(sensor, drive, baseline.rig) for sensor in sensors])


def record(baseline, n_revolutions, rng, cause=None, *, since=0):
    """Columns of a record; `cause` makes signals of signals from a revolution on."""
    columns = inputs(n_revolutions)
    signals = baseline.prediction(columns)
    noise = rng.standard_normal(signals.shape)
    for k in range(1, noise.shape[1]):
        noise[:, k] = 0.5 * noise[:, k - 1] + np.sqrt(0.75) * noise[:, k]
    if cause is not None:
        late = columns["carrier_angle"] >= 2.0 * np.pi * since
        signals = np.where(late, cause(columns, signals), signals)
    signals = signals + NOISE * noise
    return columns | dict(zip(ANGLES, signals, strict=True))
