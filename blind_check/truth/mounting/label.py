"""What a label says of a mounting: true values by the names of the contract."""

from collections.abc import Mapping

from carrierflex.blind_check.truth.mounting.rig import RIG
from carrierflex.blind_check.truth.mounting.state import MountingState

#: Names of diagnosis.json where the truth has its own.
_PUBLISHED: Mapping[str, Mapping[str, str]] = {
    "deflection_dependent_damping": {"C3": "C1"},
    "main_bearing_compliance": {"main_bearing_compliance": "compliance"},
    "ntl_direction": {"ntl_angle": "angle"},
    "unequal_bushings": {"starboard_excess": "e"},
    "sensor_delay": {"delay": "tau"},
}


def named_parameters(state: MountingState) -> dict[str, dict[str, float]]:
    """True values by effect and by the names of diagnosis.json, those of the baseline too.

    Parameters
    ----------
    state : MountingState
        What acts and what reads.
    """
    named = {"baseline": {"K1": state.bushings.K1, "C1": state.bushings.C1}}
    for effect, values in state.parameters.items():
        names = _PUBLISHED.get(effect, {})
        named[effect] = {names.get(name, name): value for name, value in values.items()}
    if "axial_bushing_stiffness" in named:
        own = state.parameters["axial_bushing_stiffness"]["k_x"]
        named["axial_bushing_stiffness"] = {"dk_x": own - RIG["bushing_axial_stiffness"]}
    if "fluid_branch" in named:
        k, tau = (state.parameters["fluid_branch"][name] for name in ("k", "tau"))
        named["fluid_branch"] = {"k": k, "c": k * tau}
    return named
