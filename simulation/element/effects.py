"""Effects of the campaign contract of kind "element": one mount, damper or spring.

Scales and bounds are in the element's own force F, deflection q and time t (see
:class:`carrierflex.simulation.effect_parameters.EffectParameter`), so that the same effect serves a
bushing in newtons and an analogue in volts. Symbols K1, K3, K5, C1, Kp, Fy, k, c as in the 2011
paper. The compiled laws are in :mod:`carrierflex.simulation.element.kernels`.
"""

from carrierflex.simulation.force_effect import ForceEffect, scaled_parameter
from carrierflex.simulation.measurement import Measurement

_STIFFNESS = ("quadratic_stiffness", "cubic_stiffness", "quintic_stiffness", "backlash")
_FRICTION = (
    "coulomb_friction",
    "elasto_plastic_friction",
    "stribeck_friction",
    "friction_asymmetry",
)
_DAMPING = ("quadratic_damping", "cubic_damping", "deflection_dependent_damping")
_SPAN = (
    "repeat the drive at half and twice the amplitude: the powers of the deflection part where its "
    "range does"
)
_SLOW = (
    "a slow triangular drive at two amplitudes: dry friction keeps its loop height, viscous forces "
    "vanish"
)

QUADRATIC_STIFFNESS = ForceEffect(
    id="quadratic_stiffness",
    equation="K2 q²",
    parameters=(scaled_parameter("K2", "N/m^2", (1, -2, 0), lower=-3.0, upper=3.0),),
    signature="even lines and a shift of the mean, growing as amplitude²",
    alike=_STIFFNESS,
    discriminating_experiment=_SPAN,
)

CUBIC_STIFFNESS = ForceEffect(
    id="cubic_stiffness",
    equation="K3 q³",
    parameters=(scaled_parameter("K3", "N/m^3", (1, -3, 0), lower=-0.5),),
    signature="odd lines, resonance moves up with amplitude, gap as amplitude³",
    alike=_STIFFNESS,
    discriminating_experiment=_SPAN,
)

QUINTIC_STIFFNESS = ForceEffect(
    id="quintic_stiffness",
    equation="K5 q⁵",
    parameters=(scaled_parameter("K5", "N/m^5", (1, -5, 0), lower=-0.1),),
    signature="odd lines, resonance moves up with amplitude, gap as amplitude⁵",
    alike=_STIFFNESS,
    discriminating_experiment=_SPAN,
)

COULOMB_FRICTION = ForceEffect(
    id="coulomb_friction",
    equation="Fc sign(v), stick within ±Fc",
    parameters=(scaled_parameter("Fc", "N", (1, 0, 0)),),
    signature=(
        "odd lines, gap that hardly grows with amplitude, flat steps where the motion reverses"
    ),
    simulated={"Fc": ("F_plus", "F_minus")},
    alike=_FRICTION,
    discriminating_experiment=_SLOW,
)

ELASTO_PLASTIC_FRICTION = ForceEffect(
    id="elasto_plastic_friction",
    equation="F += Kp dq, limited to ±Fy",
    parameters=(
        scaled_parameter("Kp", "N/m", (1, -1, 0)),
        scaled_parameter("Fy", "N", (1, 0, 0), lower=0.0001, shape=True),
    ),
    signature=(
        "odd lines, loop area, resonance moves down with amplitude, loss largest at mid amplitude"
    ),
    shape_starts=(0.05, 0.15, 0.5, 1.5),
    alike=_FRICTION,
    discriminating_experiment=(
        "amplitudes below and above the yield deflection Fy/Kp: below it the element is a "
        "plain spring"
    ),
)

STRIBECK_FRICTION = ForceEffect(
    id="stribeck_friction",
    equation="(Fc + Fs exp(-(v/v_s)²)) sign(v)",
    parameters=(
        scaled_parameter("Fc", "N", (1, 0, 0)),
        scaled_parameter("Fs", "N", (1, 0, 0)),
        scaled_parameter("v_s", "m/s", (0, 1, -1), lower=0.02, upper=5.0, shape=True),
    ),
    signature="odd lines, friction that falls with speed",
    simulated={"Fc": ("F_plus", "F_minus"), "Fs": ("F_stribeck",)},
    shape_starts=(0.1, 0.3, 1.0),
    alike=_FRICTION,
    discriminating_experiment="two constant speeds, below and above v_s, in the same direction",
)

QUADRATIC_DAMPING = ForceEffect(
    id="quadratic_damping",
    equation="C2 v |v|",
    parameters=(scaled_parameter("C2", "N s^2/m^2", (1, -2, 2)),),
    signature="odd lines, damping grows with speed, gap as speed²",
    simulated={"C2": ("C_vv",)},
    alike=_DAMPING,
    discriminating_experiment=(
        "two frequencies at one deflection amplitude, and two amplitudes at one speed"
    ),
)

CUBIC_DAMPING = ForceEffect(
    id="cubic_damping",
    equation="C3 v³",
    parameters=(scaled_parameter("C3", "N s^3/m^3", (1, -3, 3)),),
    signature="odd lines, damping grows with speed², gap as speed³",
    simulated={"C3": ("C_v3",)},
    alike=_DAMPING,
    discriminating_experiment=(
        "two frequencies at one deflection amplitude, and two amplitudes at one speed"
    ),
)

DEFLECTION_DEPENDENT_DAMPING = ForceEffect(
    id="deflection_dependent_damping",
    equation="C1 q² v",
    parameters=(scaled_parameter("C1", "N s/m^3", (1, -3, 1)),),
    signature="odd lines, damping grows with deflection², gap as amplitude³",
    simulated={"C1": ("C_q2v",)},
    alike=_DAMPING,
    discriminating_experiment=(
        "a drive about a preload: this damping follows the static deflection, speed-dependent "
        "damping does not"
    ),
)

BACKLASH = ForceEffect(
    id="backlash",
    equation="-K1 q within ±gap, -K1 gap sign(q) beyond",
    parameters=(scaled_parameter("gap", "m", (0, 1, 0), upper=3.0),),
    signature="odd lines, soft at small amplitude, gap that stops growing with amplitude",
    shape_starts=(0.1, 0.3, 0.7, 1.5),
    alike=(*_STIFFNESS, "coulomb_friction"),
    discriminating_experiment="amplitudes below and above the gap, and a preload that closes it",
)

MAXWELL_BRANCH = ForceEffect(
    id="maxwell_branch",
    equation="spring k and damper c = k tau in series",
    parameters=(
        scaled_parameter("k", "N/m", (1, -1, 0)),
        scaled_parameter("tau", "s", (0, 0, 1), lower=0.1, upper=50.0, shape=True),
    ),
    signature="linear: no harmonics; stiffness and loss change over a band of frequency",
    shape_starts=(0.1, 0.5, 2.0, 10.0),
    alike=("elasto_plastic_friction", "sensor_delay"),
    discriminating_experiment=(
        "the same drive at half the amplitude: a linear branch scales, friction does not"
    ),
)

FRICTION_ASYMMETRY = ForceEffect(
    id="friction_asymmetry",
    equation="F_plus for v > 0, -F_minus for v < 0, stick between",
    parameters=(
        scaled_parameter("F_plus", "N", (1, 0, 0)),
        scaled_parameter("F_minus", "N", (1, 0, 0)),
    ),
    signature="as dry friction, with even lines while the element sticks",
    alike=_FRICTION,
    discriminating_experiment=(
        "rest on both flanks: the force at which it breaks away differs by direction, an "
        "offset does not"
    ),
)

SENSOR_DELAY = ForceEffect(
    id="sensor_delay",
    equation="measured(t) = true(t - delay)",
    parameters=(scaled_parameter("delay", "s", (0, 0, 1), lower=-1.0, upper=1.0),),
    signature="phase error proportional to frequency, no harmonics",
    measurement=Measurement.DELAY,
    alike=("maxwell_branch",),
    discriminating_experiment=(
        "a frequency well above the resonance, where a delay turns the phase and damping does not"
    ),
)

#: In the order of the contract.
ELEMENT_EFFECTS: dict[str, ForceEffect] = {
    effect.id: effect
    for effect in (
        QUADRATIC_STIFFNESS,
        CUBIC_STIFFNESS,
        QUINTIC_STIFFNESS,
        COULOMB_FRICTION,
        ELASTO_PLASTIC_FRICTION,
        STRIBECK_FRICTION,
        QUADRATIC_DAMPING,
        CUBIC_DAMPING,
        DEFLECTION_DEPENDENT_DAMPING,
        BACKLASH,
        MAXWELL_BRANCH,
        FRICTION_ASYMMETRY,
        SENSOR_DELAY,
    )
}
