"""Carrier campaigns with one known effect, for twin tests."""

import numpy as np

from carrierflex.diagnosis.carrier.problem import carrier_problem
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.simulation.carrier.effects.library import CARRIER_EFFECTS
from carrierflex.simulation.carrier.patterns import (
    closing_torque,
    load_shift_pattern,
    load_tilt_pattern,
    pin_radius_of,
    saturated_load,
)
from carrierflex.simulation.carrier.rim import CarrierInputs, CarrierRig, RimSensor
from carrierflex.simulation.sensing import delayed_angle
from carrierflex.workflows.fe.default_curves import default_curves

CURVES = default_curves()
NOISE = 5e-6
RIG = {"nominal_torque": 360e3, "sensor_radius": 0.412, "n_planets": 3}
SPEEDS = (2.3, 1.5, 2.3, 2.3, 2.3, 2.3)
LOADS = ((1.0, 0, 0), (0.5, 0, 0), (1.0, 0, -2e5), (1.0, 1e5, 1e5), (0.75, 0, 5e4), (0.25, -5e4, 0))
CHANNELS = tuple(
    Channel(
        f"s{angle:03d}", "axial_displacement", "m", float(np.deg2rad(angle)), 0.412, noise_std=NOISE
    )
    for angle in (47, 137, 227, 317)
) + tuple(
    Channel(
        f"r{angle:03d}",
        "radial_displacement",
        "m",
        float(np.deg2rad(angle)),
        0.412,
        noise_std=NOISE,
    )
    for angle in (40, 310)
)
LAWS = {name: effect.pattern for name, effect in CARRIER_EFFECTS.items()}
CARRIER_RIG = CarrierRig(360e3, 3, pin_radius_of(CURVES["delta_f"], CURVES["g_f"], 3), CURVES)
#: What the simulation knows already: misalignment and flexible pins.
KNOWN = {
    "axial_offset": (1e-4,),
    "housing_tilt": (1e-4, 4e-4),
    "carrier_tilt": (3e-4, 5e-4),
    "flexible_pins": (0.6,),
}
#: One effect at five to ten times the noise of 5 um.
INJECTED = {
    "housing_tilt": (5e-5, 1e-4),
    "torque_tilt": (5e-5, 1e-4),
    "carrier_tilt": (5e-5, 1e-4),
    "flexible_pins": (0.6,),
    "stiff_pins": (2.5,),
    "unequal_load_sharing": (0.25, -0.1),
    "load_sharing_ntl": (2e-6, 1e-6),
    "ntl_tilt": (3e-10, 6e-10, 2e-10, 8e-10),
    "flange_warp": (3e-5, 2e-5, 1e-10, -2e-10),
    "face_runout": (3e-5, 0.0, 0.0, 2e-5, *([0.0] * 10)),
    "ring_pass": (3e-5, 2e-5, 0.0, 0.0, 0.0, 0.0),
    "thermal_drift": (4e-5, 2e-5, 0.0),
}


def twin_campaign(
    effect=None,
    *,
    contained=tuple(KNOWN),
    extra=None,
    loads=LOADS,
    turns=16,
    seed=0,
    channels=CHANNELS,
    limiting_load=3e4,
    rig=CARRIER_RIG,
):
    """Campaign with the known effects and one more; `contained` are those of the baseline.

    `limiting_load` [N] uses most of a bearing clearance up.
    """
    rng = np.random.default_rng(seed)
    runs = []
    for k, (share, y, z) in enumerate(loads):
        time = np.arange(turns * 60 + 1) * (2.0 * np.pi / 60.0 / SPEEDS[k % len(SPEEDS)])
        ripple = 1.0 + 0.01 * np.sin(2.0 * np.pi * time / 17.3 + k)
        angle, torque = SPEEDS[k % len(SPEEDS)] * time, share * 360e3 * ripple
        columns = {
            "carrier_angle": angle,
            "torque": torque,
            "ntl_y": y + 0 * time,
            "ntl_z": z + 0 * time,
        }
        signals = {}
        for channel in channels:
            clean = clean_signal(effect, channel, time, columns, limiting_load, rig)
            if extra is not None:
                clean = clean + extra(channel, angle)
            signals[channel.name] = clean + NOISE * rng.standard_normal(time.size)
        runs.append(Run(f"run{k + 1}", f"run{k + 1}.csv", f"load {k + 1}", time, columns, signals))
    facts = RIG | {"n_planets": rig.n_planets}
    return Campaign("carrier", "twin", Baseline("model", contained), facts, channels, tuple(runs))


def clean_signal(effect, channel, time, columns, limiting_load=3e4, rig=CARRIER_RIG):
    """Signal without noise: the known effects and one more, in the closed form of its card."""
    sensor = RimSensor(channel.angle, channel.radius, channel.quantity == "axial_displacement")
    first = channel.name == "s137"
    if effect == "sensor_angle" and first:
        sensor = RimSensor(channel.angle + 0.04, channel.radius, True)
    if effect == "sensor_delay":
        columns = {**columns, "carrier_angle": delayed_angle(time, columns["carrier_angle"], 0.05)}
    inputs = CarrierInputs(time, *columns.values(), start=time[0], end=time[-1])
    signal = sum(np.array(v) @ LAWS[name](sensor, inputs, rig) for name, v in KNOWN.items())
    if effect in INJECTED:
        signal = signal + np.array(INJECTED[effect]) @ LAWS[effect](sensor, inputs, rig)
    if effect == "pin_clearance":
        closed = CarrierInputs(
            time,
            inputs.carrier_angle,
            closing_torque(inputs.torque, 150e3),
            *inputs_tail(inputs),
            time[0],
            time[-1],
        )
        law = LAWS["stiff_pins"](sensor, closed, rig) - LAWS["flexible_pins"](sensor, closed, rig)
        signal = signal + 1.5 * law[0]
    if effect == "bearing_clearance":
        load = saturated_load(inputs.ntl_y, inputs.ntl_z, limiting_load, 0.0)
        tilt = 1.2e-4 * load_tilt_pattern(sensor.angle, sensor.radius, *load)
        shift = 4e-5 * load_shift_pattern(sensor.angle, *load)
        signal = signal + (tilt if sensor.is_axial else shift)
    if effect == "clearance_rocking":
        for sign in (1.0, -1.0):
            load = saturated_load(inputs.ntl_y, inputs.ntl_z, 3e4, sign * 3e4)
            tilt = 0.6e-4 * sign * load_tilt_pattern(sensor.angle, sensor.radius, *load)
            shift = 2e-5 * sign * load_shift_pattern(sensor.angle, *load)
            signal = signal + (tilt if sensor.is_axial else shift)
    if effect == "sensor_gain" and first:
        signal = 1.2 * signal
    return signal + (6e-5 if effect == "sensor_zero" and first else 0.0)


def inputs_tail(inputs):
    """Radial load of the inputs."""
    return inputs.ntl_y, inputs.ntl_z


def twin_problem(effect=None, **options):
    """ComparisonProblem of such a campaign.

    A known effect that is asked for is missing from the baseline.
    """
    contained = options.pop("contained", tuple(name for name in KNOWN if name != effect))
    campaign = twin_campaign(effect, contained=contained, **options)
    return carrier_problem(campaign, options.get("rig", CARRIER_RIG).curves)
