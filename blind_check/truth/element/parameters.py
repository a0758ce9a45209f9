"""True values of the parameters that a diagnosis may be asked for, in the contract's symbols."""

from collections.abc import Callable, Sequence

from carrierflex.blind_check.truth.element.element import Element, Law
from carrierflex.blind_check.truth.element.families import CAUSES

#: Parameters of a law of textbook form from its own scale of force, deflection, speed and its p.
_VALUES: dict[str, Callable[[float, float, float, Law], dict[str, float]]] = {
    "quadratic_spring": lambda f, q, v, law: {"K2": f / q**2},
    "cubic_spring": lambda f, q, v, law: {"K3": f / q**3},
    "quintic_spring": lambda f, q, v, law: {"K5": f / q**5},
    "gap_in_spring": lambda f, q, v, law: {"gap": law.p[0] * q},
    "coulomb": lambda f, q, v, law: {"Fc": f},
    "unequal_friction": lambda f, q, v, law: {"F_plus": f, "F_minus": f * law.p[2]},
    "stribeck": lambda f, q, v, law: {"Fc": f, "Fs": f * law.p[0], "v_s": law.p[1] * v},
    "quadratic_damper": lambda f, q, v, law: {"C2": f / v**2},
    "cubic_damper": lambda f, q, v, law: {"C3": f / v**3},
    "slider": lambda f, q, v, law: {"Kp": f / (law.p[0] * q), "Fy": f},
    "maxwell": lambda f, q, v, law: {"k": f / q, "tau": law.p[1]},
    "square_coupling": lambda f, q, v, law: {"C1": f / (q**2 * v)},
}


def true_parameters(
    names: Sequence[str], changes: Sequence[float], element: Element, *, is_decay: bool
) -> dict[str, dict[str, float]]:
    """Parameters of baseline and causes where every cause has its textbook form.

    Parameters
    ----------
    names : sequence of str
        Withheld causes.
    changes : sequence of float
        Change of form of each.
    element : Element
        Element with the causes.
    is_decay : bool
        Forces of a decay are per mass.

    Returns
    -------
    dict
        By effect of the library, ``baseline`` among them, and symbol; empty where a cause has
        another form than the library's: its law then has no true parameter, and spring and damper
        share its linear part.
    """
    if any(changes) or any(not CAUSES[name].library for name in names):
        return {}
    mass, stiffness = element.base[:2]
    per = mass if is_decay else 1.0
    values = {"baseline": {"K1": float(stiffness / per)}}
    if not is_decay:
        values["baseline"]["m"] = float(mass)
    laws = iter(element.laws)
    for name in names:
        library = CAUSES[name].library
        if name == "late_sensor":
            values[library] = {"delay": float(element.delay)}
            continue
        law = next(laws)
        force, deflection, speed = (float(value) for value in law.scale)
        own = _VALUES[name](force, deflection, speed, law)
        of_mass = {symbol for symbol in own if symbol not in ("gap", "tau", "v_s")}
        values[library] = {
            symbol: float(value / (per if symbol in of_mass else 1.0))
            for symbol, value in own.items()
        }
    return values
