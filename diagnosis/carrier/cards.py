"""Effect cards of the kind "carrier": rim sensors of a planet carrier.

The law of a card gives the signal per unit of each of its linear parameters, see
:mod:`carrierflex.diagnosis.carrier.laws`; the effects of a sensor and those with a threshold have
none, :mod:`carrierflex.diagnosis.carrier.model` computes them in full.
"""

from math import inf

from carrierflex.diagnosis.carrier import laws
from carrierflex.diagnosis.comparison.effect_cards import EffectCard, EffectParameter

KIND = "carrier"
#: Orders of waves on the measured face that the effect face_runout holds.
_STATIC = (
    "housing_tilt",
    "torque_tilt",
    "ntl_tilt",
    "bearing_clearance",
    "flange_warp",
    "sensor_zero",
)
_THREE = ("flexible_pins", "stiff_pins", "pin_clearance", "ring_pass", "face_runout")
_ONCE = ("carrier_tilt", "unequal_load_sharing", "load_sharing_ntl")
_LOADS = "torque in four steps without radial load, and radial loads of five sizes along y and z at full torque"
_TORQUE = "the same speed at a quarter, half and full torque: waves on the face stay, deflection follows the torque"


def _lengths(*names: str, scale: float = 1e-5, bound: float = 1e-2) -> tuple[EffectParameter, ...]:
    return tuple(EffectParameter(name, "m", -bound, bound, scale) for name in names)


def _tilts(*names: str) -> tuple[EffectParameter, ...]:
    return tuple(EffectParameter(name, "rad", -0.05, 0.05, 1e-3) for name in names)


def _per_newton(unit: str, scale: float, *names: str) -> tuple[EffectParameter, ...]:
    return tuple(
        EffectParameter(name, unit, -200.0 * scale, 200.0 * scale, scale) for name in names
    )


def _polar(size: str, angle: str) -> tuple[str, str]:
    return f"{size} cos {angle}", f"{size} sin {angle}"


def _card(
    id: str,
    equation: str,
    parameters: tuple[EffectParameter, ...],
    signature: str,
    group: tuple[str, ...],
    test: str,
    law: laws.Law | None = None,
    *,
    acts_on_others: bool = False,
) -> EffectCard:
    aliases = tuple(own for own in group if own != id)
    return EffectCard(
        id,
        KIND,
        equation,
        parameters,
        signature,
        aliases,
        test,
        law=law,
        acts_on_others=acts_on_others,
    )


CARRIER_CARDS = (
    _card(
        "axial_offset",
        "d_x, one value per run",
        _lengths("d_x", scale=1e-3, bound=inf),
        "order 0, m = 0, in every run its own",
        ("sensor_zero", "thermal_drift"),
        "a zero reading at rest before every run",
        laws.axial_offset,
    ),
    _card(
        "housing_tilt",
        "R phi_H sin(theta_H - v)",
        _tilts(*_polar("phi_H", "theta_H")),
        "order 0, m = +1 and -1 in equal parts, whatever the load",
        _STATIC,
        _LOADS,
        laws.housing_tilt,
    ),
    _card(
        "torque_tilt",
        "R phi_T T/T_nom sin(theta_T - v)",
        _tilts(*_polar("phi_T", "theta_T")),
        "order 0, m = +1 and -1 in equal parts, growing as the torque",
        _STATIC,
        _LOADS,
        laws.torque_tilt,
    ),
    _card(
        "carrier_tilt",
        "R phi_PLC sin(theta_PLC + theta - v)",
        _tilts(*_polar("phi_PLC", "theta_PLC")),
        "order 1, m = +1, whatever the load",
        _ONCE,
        _TORQUE,
        laws.carrier_tilt,
    ),
    _card(
        "flexible_pins",
        "rho_f delta_f(v - theta) T/T_unit",
        (EffectParameter("rho_f", "1", 0.0, 20.0, 0.5),),
        "order 3, m = -1, little of order 6, growing as the torque",
        _THREE,
        _TORQUE,
        laws.flexible_pins,
    ),
    _card(
        "stiff_pins",
        "rho_s delta_s(v - theta) T/T_unit",
        (EffectParameter("rho_s", "1", 0.0, 20.0, 0.5),),
        "order 6, m = 2, and order 3, m = -1, growing as the torque",
        _THREE,
        _TORQUE,
        laws.stiff_pins,
    ),
    _card(
        "pin_clearance",
        "c (delta_s - delta_f)(v - theta) sign(T) max(|T| - T_c, 0)/T_unit",
        (
            EffectParameter("c", "1", 0.0, 20.0, 0.5),
            EffectParameter("T_c", "N m", 1.0, 1e8, 1e5, shape=True),
        ),
        "order 3 falls behind the torque and order 6 grows above a threshold torque",
        _THREE,
        "torque in steps of a tenth up to the nominal: order 3 has a kink where the clearance closes",
    ),
    _card(
        "unequal_load_sharing",
        "sum_i T/(3a) e_i g_f(v - theta - alpha_i), sum e_i = 0",
        tuple(EffectParameter(name, "1", -1.0, 1.0, 0.1) for name in ("e_1", "e_2")),
        "orders 1, 2, 4 and 5 fixed to the carrier, growing as the torque",
        _ONCE,
        _TORQUE,
        laws.unequal_load_sharing,
    ),
    _card(
        "load_sharing_ntl",
        "sum_i T/(3a) e_i(t) g_f(v - theta - alpha_i), e_i = kappa_r F.e(beta_i) + kappa_t F.t(beta_i)",
        _per_newton("1/N", 5e-7, "kappa_r", "kappa_t"),
        "order 0 tilt and orders 3 and 6, growing as torque times radial load",
        ("ntl_tilt", "bearing_clearance", "unequal_load_sharing"),
        "the same radial load at a quarter and at full torque",
        laws.load_sharing_ntl,
    ),
    _card(
        "ntl_tilt",
        "R sin(0 - v) (a_y F_y + a_z F_z) + R sin(pi/2 - v) (b_y F_y + b_z F_z)",
        _per_newton("rad/N", 1e-9, "a_y", "b_y", "a_z", "b_z"),
        "order 0, m = +1 and -1 in equal parts, growing as the radial load",
        _STATIC,
        _LOADS,
        laws.ntl_tilt,
    ),
    _card(
        "bearing_clearance",
        "(phi_B R e(v).F axial, r_B e(v).F radial) / sqrt(F^2 + F_s^2)",
        (
            *_tilts("phi_B"),
            *_lengths("r_B", scale=1e-4),
            EffectParameter("F_s", "N", 1.0, 1e8, 5e4, shape=True),
        ),
        "order 0, m = +1 and -1, and a radial shift along the load, both with a limit",
        _STATIC,
        "radial loads of five sizes and both signs: a clearance saturates, a compliance does not",
    ),
    _card(
        "flange_warp",
        "(s_0 + s_T T/T_nom + s_y F_y + s_z F_z) cos 2(v - 47 deg)",
        (*_lengths("s_0", "s_T"), *_per_newton("m/N", 1e-10, "s_y", "s_z")),
        "order 0, m = 2, affine in torque and radial load",
        ("sensor_zero",),
        _LOADS,
        laws.flange_warp,
    ),
    _card(
        "face_runout",
        "sum_n a_n cos n(v - theta) + b_n sin n(v - theta), n = 2 to 8",
        _lengths(*(f"{name}_{n}" for n in laws.WAVE_ORDERS for name in ("a", "b")), scale=1e-5),
        "orders n >= 2, each in the single pattern m = n mod 4, whatever the load",
        _THREE,
        _TORQUE,
        laws.face_runout,
    ),
    _card(
        "ring_pass",
        "T/T_nom (p + R q sin(0 - v) + R r sin(pi/2 - v)) at cos 3 theta and sin 3 theta",
        (
            *_lengths("p_c", "p_s"),
            *(EffectParameter(n, "rad", -0.05, 0.05, 1e-4) for n in ("q_c", "q_s", "r_c", "r_s")),
        ),
        "order 3 of one phase at all sensors, m = 0 or m = +1 beside m = -1, growing as the torque",
        _THREE,
        "two more axial sensors, or accelerometers on the housing: the housing itself moves",
        laws.ring_pass,
    ),
    _card(
        "thermal_drift",
        "t_1 P_1(t) + t_2 P_2(t) + t_3 P_3(t) in every run",
        _lengths("t_1", "t_2", "t_3"),
        "a slow change of order 0, m = 0, within a run",
        ("axial_offset",),
        "a record after two hours at constant load, beside the temperature of the housing",
        laws.thermal_drift,
    ),
    _card(
        "sensor_gain",
        "(1 + g) times the signal of one channel",
        (EffectParameter("g", "1", -0.9, 5.0, 0.05),),
        "all orders of one channel alike: leaks into m = 2 in one constant ratio",
        ("sensor_angle", "sensor_zero"),
        "the sensor's calibration on a micrometer",
        acts_on_others=True,
    ),
    _card(
        "sensor_angle",
        "the signal of one channel at v + dv",
        (EffectParameter("dv", "rad", -0.15, 0.15, 0.02),),
        "phase of one channel in proportion to the order",
        ("sensor_gain", "sensor_delay"),
        "the sensor's place measured on the housing",
        acts_on_others=True,
    ),
    _card(
        "sensor_zero",
        "z added to one channel, in all runs",
        _lengths("z"),
        "order 0 of one channel in every run: a quarter in each pattern m",
        _STATIC,
        "a zero reading at rest",
    ),
    _card(
        "sensor_delay",
        "the signals of all channels at theta(t - tau)",
        (EffectParameter("tau", "s", -0.5, 0.5, 0.01),),
        "phase of all channels in proportion to the order and to the speed",
        ("carrier_tilt", "sensor_angle"),
        "the same torque at two speeds",
        acts_on_others=True,
    ),
)

#: Effects without meaning, to measure what chance alone explains.
NEGATIVE_CONTROLS = tuple(
    EffectCard(
        name,
        KIND,
        f"p cos and sin of {order} theta on the axial sensors",
        _lengths("p_c", "p_s"),
        "none",
        law=law,
    )
    for name, order, law in (
        ("placebo_1", laws.PLACEBO_ORDERS[0], laws.first_placebo),
        ("placebo_2", laws.PLACEBO_ORDERS[1], laws.second_placebo),
    )
)

#: Effects of one sensor; the channel is found with them.
ONE_CHANNEL = ("sensor_gain", "sensor_angle", "sensor_zero")
#: Effects with one value for each run.
PER_RUN = ("axial_offset", "thermal_drift")
