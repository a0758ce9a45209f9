"""Errors of the sensors, the parts of the measurement model."""

from carrierflex.simulation.carrier.effect import Effect, lengths, others
from carrierflex.simulation.carrier.effects.alike import STATIC
from carrierflex.simulation.effect_parameters import EffectParameter
from carrierflex.simulation.measurement import Measurement

SENSOR_GAIN = Effect(
    "sensor_gain",
    equation="(1 + g) times the signal of one channel",
    parameters=(EffectParameter("g", "1", -0.9, 5.0, 0.05),),
    signature="all orders of one channel alike: leaks into m = 2 in one constant ratio",
    measurement=Measurement.GAIN,
    aliases=("sensor_angle", "sensor_zero"),
    discriminating_experiment="the sensor's calibration on a micrometer",
)
SENSOR_ANGLE = Effect(
    "sensor_angle",
    equation="the signal of one channel at v + dv",
    parameters=(EffectParameter("dv", "rad", -0.15, 0.15, 0.02),),
    signature="phase of one channel in proportion to the order",
    measurement=Measurement.ANGLE,
    aliases=("sensor_gain", "sensor_delay"),
    discriminating_experiment="the sensor's place measured on the housing",
)
SENSOR_ZERO = Effect(
    "sensor_zero",
    equation="z added to one channel, in all runs",
    parameters=lengths("z"),
    signature="order 0 of one channel in every run: a quarter in each pattern m",
    measurement=Measurement.ZERO,
    aliases=others("sensor_zero", STATIC),
    discriminating_experiment="a zero reading at rest",
)
SENSOR_DELAY = Effect(
    "sensor_delay",
    equation="the signals of all channels at theta(t - tau)",
    parameters=(EffectParameter("tau", "s", -0.5, 0.5, 0.01),),
    signature="phase of all channels in proportion to the order and to the speed",
    measurement=Measurement.DELAY,
    aliases=("carrier_tilt", "sensor_angle"),
    discriminating_experiment="the same torque at two speeds",
)

SENSORS = (SENSOR_GAIN, SENSOR_ANGLE, SENSOR_ZERO, SENSOR_DELAY)
