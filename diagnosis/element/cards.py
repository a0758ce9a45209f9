"""Effect cards of the kind "element": one mount, damper or spring.

Scales and bounds are in the element's own force F, deflection q and time t (see
:class:`carrierflex.diagnosis.comparison.effect_cards.EffectParameter`), so that the same card
serves a bushing in newtons and an analogue in volts. Symbols K1, K3, K5, C1, Kp, Fy, k, c as in the
2011 paper.
"""

from math import inf

from carrierflex.diagnosis.comparison.effect_cards import EffectCard, EffectParameter

KIND = "element"
_STIFFNESS = ("quadratic_stiffness", "cubic_stiffness", "quintic_stiffness", "backlash")
_FRICTION = (
    "coulomb_friction",
    "elasto_plastic_friction",
    "stribeck_friction",
    "friction_asymmetry",
)
_DAMPING = ("quadratic_damping", "cubic_damping", "deflection_dependent_damping")
_SPAN = "repeat the drive at half and twice the amplitude: the powers of the deflection part where its range does"
_SLOW = "a slow triangular drive at two amplitudes: dry friction keeps its loop height, viscous forces vanish"


def _parameter(
    name: str, unit: str, powers: tuple[int, int, int], *bounds: float, shape: bool = False
) -> EffectParameter:
    lower, upper = bounds or (0.0, 20.0)
    return EffectParameter(name, unit, lower, upper, powers=powers, shape=shape)


def _others(effect: str, group: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(other for other in group if other != effect)


def _card(
    id: str,
    equation: str,
    parameters: tuple[EffectParameter, ...],
    signature: str,
    group: tuple[str, ...],
    test: str,
) -> EffectCard:
    return EffectCard(id, KIND, equation, parameters, signature, _others(id, group), test)


ELEMENT_CARDS = (
    _card(
        "quadratic_stiffness",
        "K2 q²",
        (_parameter("K2", "N/m^2", (1, -2, 0), -3.0, 3.0),),
        "even lines and a shift of the mean, growing as amplitude²",
        _STIFFNESS,
        _SPAN,
    ),
    _card(
        "cubic_stiffness",
        "K3 q³",
        (_parameter("K3", "N/m^3", (1, -3, 0), -0.5, 20.0),),
        "odd lines, resonance moves up with amplitude, gap as amplitude³",
        _STIFFNESS,
        _SPAN,
    ),
    _card(
        "quintic_stiffness",
        "K5 q⁵",
        (_parameter("K5", "N/m^5", (1, -5, 0), -0.1, 20.0),),
        "odd lines, resonance moves up with amplitude, gap as amplitude⁵",
        _STIFFNESS,
        _SPAN,
    ),
    _card(
        "coulomb_friction",
        "Fc sign(v), stick within ±Fc",
        (_parameter("Fc", "N", (1, 0, 0)),),
        "odd lines, gap that hardly grows with amplitude, flat steps where the motion reverses",
        _FRICTION,
        _SLOW,
    ),
    _card(
        "elasto_plastic_friction",
        "F += Kp dq, limited to ±Fy",
        (
            _parameter("Kp", "N/m", (1, -1, 0)),
            _parameter("Fy", "N", (1, 0, 0), 1e-4, 20.0, shape=True),
        ),
        "odd lines, loop area, resonance moves down with amplitude, loss largest at mid amplitude",
        _FRICTION,
        "amplitudes below and above the yield deflection Fy/Kp: below it the element is a plain spring",
    ),
    _card(
        "stribeck_friction",
        "(Fc + Fs exp(-(v/v_s)²)) sign(v)",
        (
            _parameter("Fc", "N", (1, 0, 0)),
            _parameter("Fs", "N", (1, 0, 0)),
            _parameter("v_s", "m/s", (0, 1, -1), 0.02, 5.0, shape=True),
        ),
        "odd lines, friction that falls with speed",
        _FRICTION,
        "two constant speeds, below and above v_s, in the same direction",
    ),
    _card(
        "friction_asymmetry",
        "F_plus for v > 0, -F_minus for v < 0, stick between",
        (_parameter("F_plus", "N", (1, 0, 0)), _parameter("F_minus", "N", (1, 0, 0))),
        "as dry friction, with even lines where the motion rests",
        _FRICTION,
        "rest on both flanks: the force at which it breaks away differs by direction, an offset does not",
    ),
    _card(
        "quadratic_damping",
        "C2 v |v|",
        (_parameter("C2", "N s^2/m^2", (1, -2, 2)),),
        "odd lines, damping grows with speed, gap as speed²",
        _DAMPING,
        "two frequencies at one deflection amplitude, and two amplitudes at one speed",
    ),
    _card(
        "cubic_damping",
        "C3 v³",
        (_parameter("C3", "N s^3/m^3", (1, -3, 3)),),
        "odd lines, damping grows with speed², gap as speed³",
        _DAMPING,
        "two frequencies at one deflection amplitude, and two amplitudes at one speed",
    ),
    _card(
        "deflection_dependent_damping",
        "C1 q² v",
        (_parameter("C1", "N s/m^3", (1, -3, 1)),),
        "odd lines, damping grows with deflection², gap as amplitude³",
        _DAMPING,
        "a drive about a preload: this damping follows the static deflection, speed-dependent damping does not",
    ),
    _card(
        "backlash",
        "-K1 q within ±gap, -K1 gap sign(q) beyond",
        (_parameter("gap", "m", (0, 1, 0), 0.0, 3.0),),
        "odd lines, soft at small amplitude, gap that stops growing with amplitude",
        (*_STIFFNESS, "coulomb_friction"),
        "amplitudes below and above the gap, and a preload that closes it",
    ),
    _card(
        "maxwell_branch",
        "spring k and damper c = k tau in series",
        (
            _parameter("k", "N/m", (1, -1, 0)),
            _parameter("tau", "s", (0, 0, 1), 0.1, 50.0, shape=True),
        ),
        "linear: no harmonics; stiffness and loss change over a band of frequency",
        ("elasto_plastic_friction", "sensor_delay"),
        "the same drive at half the amplitude: a linear branch scales, friction does not",
    ),
    EffectCard(
        "sensor_delay",
        KIND,
        "measured(t) = true(t - delay)",
        (EffectParameter("delay", "s", -1.0, 1.0, powers=(0, 0, 1)),),
        "phase error proportional to frequency, no harmonics",
        ("maxwell_branch",),
        "a frequency well above the resonance, where a delay turns the phase and damping does not",
    ),
)

#: Names of the flat array's places by effect and parameter (see
#: :data:`carrierflex.simulation.element.kernels.SLOTS`).
SLOT_NAMES: dict[tuple[str, str], tuple[str, ...]] = {
    ("quadratic_stiffness", "K2"): ("K2",),
    ("cubic_stiffness", "K3"): ("K3",),
    ("quintic_stiffness", "K5"): ("K5",),
    ("coulomb_friction", "Fc"): ("F_plus", "F_minus"),
    ("elasto_plastic_friction", "Kp"): ("Kp",),
    ("elasto_plastic_friction", "Fy"): ("Fy",),
    ("stribeck_friction", "Fc"): ("F_plus", "F_minus"),
    ("stribeck_friction", "Fs"): ("F_stribeck",),
    ("stribeck_friction", "v_s"): ("v_s",),
    ("friction_asymmetry", "F_plus"): ("F_plus",),
    ("friction_asymmetry", "F_minus"): ("F_minus",),
    ("quadratic_damping", "C2"): ("C_v|v|",),
    ("cubic_damping", "C3"): ("C_v3",),
    ("deflection_dependent_damping", "C1"): ("C_q2v",),
    ("backlash", "gap"): ("gap",),
    ("maxwell_branch", "k"): ("k",),
    ("maxwell_branch", "tau"): ("tau",),
    ("sensor_delay", "delay"): ("delay",),
    ("placebo_1", "size"): ("placebo_1",),
    ("placebo_2", "size"): ("placebo_2",),
}

#: A force of the drive's spectrum with random phases: nothing physical, so that it must not help.
NEGATIVE_CONTROLS = tuple(
    EffectCard(
        name,
        KIND,
        "size x surrogate of the drive with random phases",
        (_parameter("size", "N", (1, 0, 0), -inf, inf),),
        "none",
    )
    for name in ("placebo_1", "placebo_2")
)

#: Shapes that start the search, in the element's own scale: yield force, Stribeck speed, time
#: constant.
SHAPE_STARTS: dict[str, tuple[float, ...]] = {
    "elasto_plastic_friction": (0.05, 0.15, 0.5, 1.5),
    "stribeck_friction": (0.1, 0.3, 1.0),
    "maxwell_branch": (0.1, 0.5, 2.0, 10.0),
    "backlash": (0.1, 0.3, 0.7, 1.5),
}
