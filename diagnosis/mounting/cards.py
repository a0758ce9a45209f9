"""Effect cards of the kind "mounting": the gearbox housing on two bushings (2011 paper).

Scales with powers are in the bushing's own force F = K1 u, deflection u and time t (see
:class:`carrierflex.diagnosis.comparison.effect_cards.EffectParameter`), u the RMS deflection that
the measured loads give the linear bushings.
"""

from math import inf

from carrierflex.diagnosis.comparison.effect_cards import EffectCard, EffectParameter

KIND = "mounting"
_HARDENING = ("cubic_stiffness", "quintic_stiffness")
_LOSS = ("deflection_dependent_damping", "fluid_branch", "elasto_plastic_friction", "sensor_delay")
_SPAN = "torque steps up to twice the range: u³ and u⁵ part where the deflection does"
_SPEED = "the same torque ramp at a tenth of the rate: friction keeps its loop, viscous forces and delays vanish"


def _own(
    name: str, unit: str, powers: tuple[int, int, int], *bounds: float, shape: bool = False
) -> EffectParameter:
    """Parameter in the bushing's own scale, not negative unless bounds say otherwise."""
    lower, upper = bounds or (0.0, 20.0)
    return EffectParameter(name, unit, lower, upper, powers=powers, shape=shape)


def _card(
    id: str,
    equation: str,
    parameters: tuple[EffectParameter, ...],
    signature: str,
    aliases: tuple[str, ...],
    test: str,
    *,
    acts_on_others: bool = False,
) -> EffectCard:
    others = tuple(alias for alias in aliases if alias != id)
    return EffectCard(
        id, KIND, equation, parameters, signature, others, test, acts_on_others=acts_on_others
    )


MOUNTING_CARDS = (
    _card(
        "cubic_stiffness",
        "F = K1 u + K3 u³ in y and z of both bushings",
        (_own("K3", "N/m^3", (1, -3, 0), -0.3, 20.0),),
        "roll and pitch that grow less than the load, odd in the load",
        _HARDENING,
        _SPAN,
    ),
    _card(
        "quintic_stiffness",
        "F = K1 u + K5 u⁵ in y and z of both bushings",
        (_own("K5", "N/m^5", (1, -5, 0), 0.0, 20.0),),
        "roll and pitch that stop growing at the largest loads only",
        _HARDENING,
        _SPAN,
    ),
    _card(
        "deflection_dependent_damping",
        "C1 u² du/dt beside the linear damper",
        (_own("C1", "N s/m^3", (1, -3, 1), 0.0, 100.0),),
        "lag behind fast changes of the load where the deflection is large",
        _LOSS,
        "the same small fast torque change at idle and at full torque: this damping follows the mean deflection",
    ),
    _card(
        "fluid_branch",
        "spring k and damper c in series beside each bushing (Maxwell)",
        (
            _own("k", "N/m", (1, -1, 0)),
            _own("c", "N s/m", (1, -1, 1), 1e-3, 1e4, shape=True),
        ),
        "linear: stiffness and loss change with frequency about k/c, creep after a step",
        _LOSS,
        "hold after a torque step: a branch relaxes with the time c/k, friction does not",
    ),
    _card(
        "elasto_plastic_friction",
        "dF = Kp du, limited to ±Fy",
        (
            _own("Kp", "N/m", (1, -1, 0)),
            _own("Fy", "N", (1, 0, 0), 1e-4, 20.0, shape=True),
        ),
        "loop between loading and unloading, whatever the rate; stiffer after each reversal",
        _LOSS,
        _SPEED,
    ),
    _card(
        "parasitic_torque",
        "P_T ntl_z added to the torque",
        (EffectParameter("P_T", "m", -1.0, 1.0, 0.05),),
        "roll in proportion to the vertical load",
        ("ntl_direction", "unequal_bushings"),
        "vertical load alone, without torque, then sideways load alone",
    ),
    _card(
        "axial_bushing_stiffness",
        "k_x + dk_x of each bushing along the axis",
        (EffectParameter("dk_x", "N/m", -inf, inf, 1.0e6),),
        "yaw under sideways load, at ssx, spx and spy alike",
        ("main_bearing_compliance", "ntl_direction"),
        "sideways load at two torques: yaw stiffness from the axial and from the radial bushings add up differently at spy",
    ),
    _card(
        "main_bearing_compliance",
        "main bearing moves by a (F_y, F_z) of its reaction",
        (EffectParameter("compliance", "m/N", 0.0, 9e-8, 1e-9),),
        "pitch and vertical motion no longer in the ratio of the distance to the main bearing",
        ("axial_bushing_stiffness", "sensor_gain"),
        "displacement of the main bearing against its seat under radial load",
    ),
    _card(
        "ntl_direction",
        "radial load turned about x by an angle",
        (EffectParameter("angle", "rad", -1.0, 1.0, 0.05),),
        "sideways motion under vertical load and the other way round",
        ("parasitic_torque", "axial_bushing_stiffness"),
        "vertical load alone: sideways motion of spy shows the angle",
    ),
    _card(
        "unequal_bushings",
        "starboard forces times 1 + e, port forces times 1 - e",
        (EffectParameter("e", "1", -0.8, 0.8, 0.05),),
        "pitch under torque, roll under vertical load, in one ratio",
        ("parasitic_torque", "sensor_gain"),
        "torque alone: vertical motion of the middle between ssz and spz",
    ),
    _card(
        "sensor_gain",
        "(1 + g) times the signal of one channel",
        (EffectParameter("g", "1", -0.85, 5.0, 0.05),),
        "one sensor off in proportion to its own signal, in every run",
        ("unequal_bushings", "main_bearing_compliance"),
        "the sensor's calibration on a micrometer",
        acts_on_others=True,
    ),
    _card(
        "sensor_zero",
        "z added to one channel after zeroing, in all runs",
        (EffectParameter("z", "m", -0.04, 0.04, 1e-4),),
        "constant at one sensor, in every run, at rest too",
        (),
        "a zero reading at rest",
        acts_on_others=True,
    ),
    _card(
        "sensor_delay",
        "signals of all channels at t - tau",
        (EffectParameter("tau", "s", -2.0, 2.0, 0.05),),
        "gap in proportion to the rate of every signal",
        _LOSS,
        "torque changes at two rates: a delay is the same time at both, at every sensor",
        acts_on_others=True,
    ),
)

#: A response to loads of the measured spectrum with random phases: nothing physical, so that it
#: must not help.
NEGATIVE_CONTROLS = tuple(
    EffectCard(
        name,
        KIND,
        f"size x response to the {load} with random phases",
        (EffectParameter("size", "1", -inf, inf, 1.0),),
        "none",
    )
    for name, load in (("placebo_1", "torque"), ("placebo_2", "vertical load"))
)

#: Effects of one sensor; which, is chosen by the fit.
ONE_CHANNEL = ("sensor_gain", "sensor_zero")

#: Simulator's parameter by effect and name, where it is not of one sensor and no delay. The values
#: add to the neutral ones.
SIMULATED: dict[tuple[str, str], str] = {
    ("baseline", "K1"): "K1",
    ("baseline", "C1"): "C1",
    ("cubic_stiffness", "K3"): "K3",
    ("quintic_stiffness", "K5"): "K5",
    ("deflection_dependent_damping", "C1"): "C3",
    ("fluid_branch", "k"): "k",
    ("fluid_branch", "c"): "c",
    ("elasto_plastic_friction", "Kp"): "Kp",
    ("elasto_plastic_friction", "Fy"): "Fy",
    ("parasitic_torque", "P_T"): "P_T",
    ("axial_bushing_stiffness", "dk_x"): "k_x",
    ("main_bearing_compliance", "compliance"): "main_bearing_compliance",
    ("ntl_direction", "angle"): "ntl_angle",
    ("unequal_bushings", "e"): "starboard_excess",
}

#: Shapes that start the search, in the bushing's own scale: damper of the branch with k = 1, yield
#: deflection Fy/Kp.
SHAPE_STARTS: dict[str, tuple[float, ...]] = {
    "fluid_branch": (0.01, 0.1, 1.0, 10.0, 100.0),
    "elasto_plastic_friction": (0.02, 0.1, 0.4, 1.0),
}
