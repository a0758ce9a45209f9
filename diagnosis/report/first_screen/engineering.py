"""Parameters as engineers say them: words for symbols, mrad, degrees, µm per 100 kN."""

import math

from carrierflex.diagnosis.comparison.problem import BASELINE

#: Factor and unit that a unit of the contract is shown in.
_SHOWN = {
    "m/N": (1e11, "µm per 100 kN"),
    "m/(N m)": (1e11, "µm per 100 kN m"),
    "rad/N": (1e8, "mrad per 100 kN"),
    "rad/(N m)": (1e8, "mrad per 100 kN m"),
    "1/N": (1e7, "% per 100 kN"),
    "s": (1e3, "ms"),
    "m": (1e6, "µm"),
    "rad": (1e3, "mrad"),
}
#: Directions, which are told in degrees; other angles are small.
_DIRECTIONS = ("theta", "angle", "dv")
_AXES = {"y": "sideways", "z": "vertical"}
_WORDS: dict[str, str] = {
    "m": "mass",
    "K1": "stiffness",
    "K2": "quadratic stiffness",
    "K3": "cubic stiffness",
    "K5": "quintic stiffness",
    "C1": "damping",
    "C2": "quadratic damping",
    "C3": "cubic damping",
    "f0": "constant force",
    "q_0": "deflection at the release",
    "v_0": "speed at the release",
    "Fc": "friction force",
    "Fs": "breakaway force",
    "v_s": "Stribeck speed",
    "Fy": "force at which it slips",
    "Kp": "stiffness before it slips",
    "gap": "clearance",
    "k": "stiffness of the branch",
    "c": "damping of the branch",
    "tau": "time constant",
    "delay": "delay",
    "F_plus": "friction force outwards",
    "F_minus": "friction force inwards",
    "d_x": "axial offset",
    "d_y": "sideways offset",
    "d_z": "vertical offset",
    "phi_H": "tilt of the housing",
    "theta_H": "direction of the housing's tilt",
    "phi_T": "tilt at nominal torque",
    "theta_T": "direction of that tilt",
    "phi_PLC": "tilt of the carrier",
    "theta_PLC": "direction of the carrier's tilt",
    "e_PLC": "eccentricity of the carrier",
    "theta_e": "direction of the eccentricity",
    "rho_s": "share of stiff pins",
    "rho_f": "share of flexible pins",
    "theta_rho": "turn of the deflection",
    "kappa_r": "load sharing, radial",
    "kappa_t": "load sharing, tangential",
    "s_0": "saddle without load",
    "s_T": "saddle by torque",
    "P_T": "torque per radial load",
    "dk_x": "axial stiffness beyond nominal",
    "compliance": "compliance of the main bearing",
    "angle": "turn of the radial load",
    "dv": "error of the angle",
    "g": "error of the gain",
    "e": "difference port to starboard",
    "z": "zero",
    "F_s": "load of half the travel",
    "phi_B": "largest tilt in the bearing",
    "r_B": "largest radial shift in the bearing",
    "phi_R": "largest tilt between the bearings",
    "r_R": "largest radial shift between the bearings",
    "W_1": "weight on the bearing pressed towards +z",
    "W_2": "weight on the bearing pressed towards -z",
}
_DELAYS = ("sensor_delay",)


#: Parameters of pins that close.
_OF_CLOSED_PINS = {
    "c": "share that closes",
    "w_s": "weight on stiff pins",
    "w_f": "weight on flexible pins",
    "k_s": "radial load on stiff pins",
    "k_f": "radial load on flexible pins",
    "T_c": "torque at which it closes",
}


def parameter_words(effect: str, name: str) -> str:
    """What a parameter is, in words: ``tilt of the carrier``.

    Parameters
    ----------
    effect : str
        Its owner; some symbols mean something else in another effect.
    name : str
        Its published symbol.
    """
    if effect in _DELAYS:
        return "delay"
    if effect == "pin_clearance":
        return _OF_CLOSED_PINS.get(name, name)
    stem, _, last = name.partition("_")
    if effect in ("ntl_tilt", "flange_warp", "bearing_clearance") and last in _AXES:
        what = {"a": "tilt of direction 0 deg", "b": "tilt of direction 90 deg", "s": "saddle"}.get(
            stem, stem
        )
        return f"{what} by {_AXES[last]} load"
    if effect == "ring_pass" and last in ("c", "s"):
        motion = {"p": "axial motion", "q": "tilt of direction 0 deg"}.get(
            stem, "tilt of direction 90 deg"
        )
        return f"{motion} as planets pass, {'cosine' if last == 'c' else 'sine'}"
    if effect == "unequal_load_sharing" and last.isdigit():
        return f"excess load of pin {last}"
    if effect == "face_runout" and last.isdigit():
        return f"order {last}, {'cosine' if stem == 'a' else 'sine'}"
    if effect == "thermal_drift" and last.isdigit():
        return f"drift, term {last}"
    words = _WORDS.get(name, "")
    if words and effect == BASELINE and name in ("K1", "C1"):
        return f"{words} of the baseline"
    return words


def shown_unit(name: str, unit: str) -> tuple[float, str]:
    """Factor to the unit that an engineer uses for a parameter, and that unit.

    Examples
    --------
    >>> shown_unit("phi_PLC", "rad"), shown_unit("s_y", "m/N")
    ((1000.0, 'mrad'), (100000000000.0, 'µm per 100 kN'))
    """
    if unit == "rad" and name.startswith(_DIRECTIONS):
        return 180.0 / math.pi, "deg"
    return _SHOWN.get(unit, (1.0, unit))
