"""Effects of the campaign contract of kind "mounting": the housing on two bushings (2011 paper).

Scales with powers are in the bushing's own force F = K1 u, deflection u and time t (see
:class:`carrierflex.simulation.effect_parameters.EffectParameter`), u the RMS deflection that the
measured loads give the linear bushings. The laws are in
:mod:`carrierflex.simulation.mounting.equations` and :mod:`carrierflex.simulation.mounting.kernel`.
"""

from dataclasses import dataclass, field
from math import inf, nan, pi

from carrierflex.simulation.effect_parameters import EffectParameter
from carrierflex.simulation.fit_parameter import FitParameter
from carrierflex.simulation.force_effect import ForceEffect, scaled_parameter
from carrierflex.simulation.measurement import Measurement
from carrierflex.simulation.mounting.rig import SENSORS


@dataclass(frozen=True)
class MountingParameter(FitParameter):
    """One entry of a parameter set; its typical size is the rig's, not the entry's.

    Parameters
    ----------
    neutral : float
        Value at which the baseline is left as it is; K1, C1 and the axial constants take theirs
        from the rig.
    words : str
        What it is, for the case file.
    effect : str
        Effect id of the campaign contract; empty for what the baseline holds itself.
    """

    neutral: float = field(default=0.0, kw_only=True)
    words: str = field(kw_only=True)
    effect: str = field(default="", kw_only=True)


@dataclass(frozen=True, eq=False, kw_only=True)
class MountingEffect(ForceEffect):
    """One effect and its entries in a parameter set of the simulator.

    Parameters
    ----------
    entries : tuple of MountingParameter
        Entries with what the simulator accepts.
    """

    entries: tuple[MountingParameter, ...]


_HARDENING = ("cubic_stiffness", "quintic_stiffness")
_LOSS = ("deflection_dependent_damping", "fluid_branch", "elasto_plastic_friction", "sensor_delay")
_SPAN = "torque steps up to twice the range: u³ and u⁵ part where the deflection does"
_SPEED = (
    "the same torque ramp at a tenth of the rate: friction keeps its loop, viscous forces and "
    "delays vanish"
)

CUBIC_STIFFNESS = MountingEffect(
    id="cubic_stiffness",
    equation="F = K1 u + K3 u³ in y and z of both bushings",
    parameters=(scaled_parameter("K3", "N/m^3", (1, -3, 0), lower=-0.3),),
    signature="roll and pitch that grow less than the load, odd in the load",
    entries=(
        MountingParameter(
            "K3",
            "N/m^3",
            -1e12,
            1e14,
            words="Cubic stiffness of each bushing",
        ),
    ),
    alike=_HARDENING,
    discriminating_experiment=_SPAN,
)

QUINTIC_STIFFNESS = MountingEffect(
    id="quintic_stiffness",
    equation="F = K1 u + K5 u⁵ in y and z of both bushings",
    parameters=(scaled_parameter("K5", "N/m^5", (1, -5, 0)),),
    signature="roll and pitch that stop growing at the largest loads only",
    entries=(
        MountingParameter("K5", "N/m^5", -1e17, 1e19, words="Quintic stiffness of each bushing"),
    ),
    alike=_HARDENING,
    discriminating_experiment=_SPAN,
)

DEFLECTION_DEPENDENT_DAMPING = MountingEffect(
    id="deflection_dependent_damping",
    equation="C1 u² du/dt in addition to the linear damper",
    parameters=(scaled_parameter("C1", "N s/m^3", (1, -3, 1), upper=100.0),),
    signature="lag behind fast changes of the load where the deflection is large",
    entries=(
        MountingParameter(
            "C3",
            "N s/m^3",
            0.0,
            1e13,
            words="Damping of each bushing that grows with the square of its deflection",
        ),
    ),
    simulated={"C1": ("C3",)},
    alike=_LOSS,
    discriminating_experiment=(
        "the same small fast torque change at idle and at full torque: this damping follows "
        "the mean deflection"
    ),
)

FLUID_BRANCH = MountingEffect(
    id="fluid_branch",
    equation="spring k and damper c in series, parallel to each bushing (Maxwell)",
    parameters=(
        scaled_parameter("k", "N/m", (1, -1, 0)),
        scaled_parameter("c", "N s/m", (1, -1, 1), lower=0.001, upper=10000, shape=True),
    ),
    signature="linear: stiffness and loss change with frequency about k/c, creep after a step",
    entries=(
        MountingParameter("k", "N/m", 0.0, 1e9, words="Stiffness of the fluid's branch"),
        MountingParameter("c", "N s/m", 0.0, 1e9, words="Damping of the fluid's branch"),
        MountingParameter("m", "kg", 0.0, 1000.0, words="Mass of the fluid's branch"),
    ),
    shape_starts=(0.01, 0.1, 1.0, 10.0, 100.0),
    alike=_LOSS,
    discriminating_experiment=(
        "hold after a torque step: a branch relaxes with the time c/k, friction does not"
    ),
)

ELASTO_PLASTIC_FRICTION = MountingEffect(
    id="elasto_plastic_friction",
    equation="dF = Kp du, limited to ±Fy",
    parameters=(
        scaled_parameter("Kp", "N/m", (1, -1, 0)),
        scaled_parameter("Fy", "N", (1, 0, 0), lower=0.0001, shape=True),
    ),
    signature="loop between loading and unloading, whatever the rate; stiffer after each reversal",
    entries=(
        MountingParameter(
            "Kp", "N/m", 0.0, 1e9, words="Stiffness of the elasto-plastic friction element"
        ),
        MountingParameter(
            "Fy",
            "N",
            0.0,
            1e6,
            words="Force at which the elasto-plastic friction element slips",
        ),
    ),
    shape_starts=(0.02, 0.1, 0.4, 1.0),
    alike=_LOSS,
    discriminating_experiment=_SPEED,
)

PARASITIC_TORQUE = MountingEffect(
    id="parasitic_torque",
    equation="P_T ntl_z added to the torque",
    parameters=(EffectParameter("P_T", "m", -1.0, 1.0, 0.05),),
    signature="roll in proportion to the vertical load",
    entries=(
        MountingParameter("P_T", "m", -2.0, 2.0, words="Torque about x per vertical radial load"),
    ),
    alike=("ntl_direction", "unequal_bushings"),
    discriminating_experiment="vertical load alone, without torque, then sideways load alone",
)

AXIAL_BUSHING_STIFFNESS = MountingEffect(
    id="axial_bushing_stiffness",
    equation="k_x + dk_x of each bushing along the axis",
    parameters=(EffectParameter("dk_x", "N/m", -inf, inf, 1e6),),
    signature="yaw under sideways load, equal at ssx, spx and spy",
    entries=(
        MountingParameter(
            "k_x", "N/m", 0.0, 1e9, neutral=nan, words="Axial stiffness of each bushing"
        ),
    ),
    simulated={"dk_x": ("k_x",)},
    alike=("main_bearing_compliance", "ntl_direction"),
    discriminating_experiment=(
        "sideways load at two torques: yaw stiffness from the axial and from the radial "
        "bushings add up differently at spy"
    ),
)

MAIN_BEARING_COMPLIANCE = MountingEffect(
    id="main_bearing_compliance",
    equation="main bearing moves by a (F_y, F_z) of its reaction",
    parameters=(EffectParameter("compliance", "m/N", 0.0, 9e-08, 1e-09),),
    signature=(
        "pitch and vertical motion no longer in the ratio of the distance to the main bearing"
    ),
    entries=(
        MountingParameter(
            "main_bearing_compliance",
            "m/N",
            0.0,
            1e-07,
            words="Radial compliance of the main bearing",
        ),
    ),
    simulated={"compliance": ("main_bearing_compliance",)},
    alike=("axial_bushing_stiffness", "sensor_gain"),
    discriminating_experiment="displacement of the main bearing against its seat under radial load",
)

NTL_DIRECTION = MountingEffect(
    id="ntl_direction",
    equation="radial load turned about x by an angle",
    parameters=(EffectParameter("angle", "rad", -1.0, 1.0, 0.05),),
    signature="sideways motion under vertical load and the other way round",
    entries=(
        MountingParameter(
            "ntl_angle", "rad", -pi, pi, words="Angle by which the radial load is turned"
        ),
    ),
    simulated={"angle": ("ntl_angle",)},
    alike=("parasitic_torque", "axial_bushing_stiffness"),
    discriminating_experiment="vertical load alone: sideways motion of spy shows the angle",
)

UNEQUAL_BUSHINGS = MountingEffect(
    id="unequal_bushings",
    equation="starboard forces times 1 + e, port forces times 1 - e",
    parameters=(EffectParameter("e", "1", -0.8, 0.8, 0.05),),
    signature="pitch under torque, roll under vertical load, in one ratio",
    entries=(
        MountingParameter(
            "starboard_excess",
            "-",
            -0.9,
            0.9,
            words="Share by which the starboard bushing is stiffer than the mean of both",
        ),
    ),
    simulated={"e": ("starboard_excess",)},
    alike=("parasitic_torque", "sensor_gain"),
    discriminating_experiment="torque alone: vertical motion of the middle between ssz and spz",
)

SENSOR_GAIN = MountingEffect(
    id="sensor_gain",
    equation="(1 + g) times the signal of one channel",
    parameters=(EffectParameter("g", "1", -0.85, 5.0, 0.05),),
    signature="one sensor off in proportion to its own signal, in every run",
    entries=tuple(
        MountingParameter(
            f"gain_{sensor}", "-", 0.1, 10.0, neutral=1.0, words=f"Gain of the sensor {sensor}"
        )
        for sensor in SENSORS
    ),
    measurement=Measurement.GAIN,
    alike=("unequal_bushings", "main_bearing_compliance"),
    discriminating_experiment="the sensor's calibration on a micrometer",
)

SENSOR_ZERO = MountingEffect(
    id="sensor_zero",
    equation="z added to one channel after zeroing, in all runs",
    parameters=(EffectParameter("z", "m", -0.04, 0.04, 0.0001),),
    signature="constant at one sensor, in every run, at rest too",
    entries=tuple(
        MountingParameter(f"zero_{sensor}", "m", -0.05, 0.05, words=f"Zero of the sensor {sensor}")
        for sensor in SENSORS
    ),
    measurement=Measurement.ZERO,
    discriminating_experiment="a zero reading at rest",
)

SENSOR_DELAY = MountingEffect(
    id="sensor_delay",
    equation="signals of all channels at t - tau",
    parameters=(EffectParameter("tau", "s", -2.0, 2.0, 0.05),),
    signature="gap in proportion to the rate of every signal",
    entries=(
        MountingParameter(
            "delay", "s", -5.0, 5.0, words="Time of the displacements behind the carrier angle"
        ),
    ),
    measurement=Measurement.DELAY,
    alike=_LOSS,
    discriminating_experiment=(
        "torque changes at two rates: a delay is the same time at both, at every sensor"
    ),
)

#: In the order of the contract.
MOUNTING_EFFECTS: dict[str, MountingEffect] = {
    effect.id: effect
    for effect in (
        CUBIC_STIFFNESS,
        QUINTIC_STIFFNESS,
        DEFLECTION_DEPENDENT_DAMPING,
        FLUID_BRANCH,
        ELASTO_PLASTIC_FRICTION,
        PARASITIC_TORQUE,
        AXIAL_BUSHING_STIFFNESS,
        MAIN_BEARING_COMPLIANCE,
        NTL_DIRECTION,
        UNEQUAL_BUSHINGS,
        SENSOR_GAIN,
        SENSOR_ZERO,
        SENSOR_DELAY,
    )
}
