"""Whether the intervals of an answer hold the truth where its laws are the truth's own.

Kinds carrier and mounting: the withheld effects and the baseline hold laws whose equations are the
library's (:data:`LIBRARY_LAWS`). An answer that names
these laws has distorted nothing, so that the baseline's parameters are true ones too. The true rho
is the label's: held-out RMS of the baseline, refitted, with the true signal of the withheld effects
taken out of the records exactly, over that with it; noise and errors of the sensors are in both.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from carrierflex.blind_check.labels import Label
from carrierflex.blind_check.scoring.class_score import Hit
from carrierflex.diagnosis.inference.results import NamedValue

#: Effects whose equation in the truth is the library's, in the campaign's constants: their
#: parameters have true values that an answer is compared with. The others have another form (a tanh
#: for a root, a stack of leaves for a cubic spring, two Maxwell branches for one), or are in units
#: of the deflection curves of another carrier.
LIBRARY_LAWS: dict[str, tuple[str, ...]] = {
    "carrier": (
        "axial_offset", "housing_tilt", "torque_tilt", "carrier_tilt", "ntl_tilt", "flange_warp",
        "face_runout", "ring_pass", "sensor_gain", "sensor_angle", "sensor_zero", "sensor_delay",
    ),
    "mounting": (
        "parasitic_torque", "axial_bushing_stiffness", "main_bearing_compliance", "ntl_direction",
        "unequal_bushings", "sensor_gain", "sensor_zero", "sensor_delay",
    ),
}  # fmt: skip
#: Name of the hit of rho.
RHO = "rho"
#: Owner of the parameters of a mounting's bushings.
_BASELINE = "baseline"
#: What the names of directions begin with: an angle has no size that its error could be a share of.
_DIRECTION = "theta_"

Parameters = Mapping[str, Mapping[str, NamedValue]]


def has_true_parameters(kind: str, effects: tuple[str, ...]) -> bool:
    """Whether the withheld effects of a case all have the library's own equations."""
    return set(effects) <= set(LIBRARY_LAWS[kind])


def covered_values(
    label: Label, parameters: Parameters, rho_ci95: tuple[float, float]
) -> list[Hit]:
    """Parameters and rho of an answer that names the withheld effects.

    Parameters
    ----------
    label : Label
        The truth.
    parameters : mapping of str to mapping of str to NamedValue
        Parameters of the answer by effect and name.
    rho_ci95 : tuple of float
        Its 95 % interval of rho.

    Returns
    -------
    list of Hit
        Empty where the answer names a law at another sensor than the true one: what it leaves
        distorts the others.
    """
    laws = {*LIBRARY_LAWS[label.kind], _BASELINE}
    hits: list[Hit] = []
    for effect, values in label.parameters.items():
        claimed = parameters.get(effect, {})
        if effect in label.effects and not set(values) <= set(claimed):
            return []
        if effect in laws:
            hits += _hits(effect, values, claimed, is_baseline=effect not in label.effects)
    if label.effects:
        low, high = rho_ci95
        width = 0.5 * (high - low) / label.rho
        hits.append(Hit(RHO, False, low <= label.rho <= high, width))
    return hits


def _hits(
    effect: str,
    values: Mapping[str, float],
    claimed: Mapping[str, NamedValue],
    *,
    is_baseline: bool,
) -> Iterator[Hit]:
    """Parameters of one effect that are not zero; half-widths over the true value, or in rad."""
    for name, true in values.items():
        claim = claimed.get(name)
        if claim is None or true == 0.0 or not np.isfinite(claim.std):
            continue
        half = 0.5 * (claim.ci95[1] - claim.ci95[0])
        is_direction = name.startswith(_DIRECTION)
        miss = claim.value - true
        if is_direction:
            miss = float(np.angle(np.exp(1j * miss)))
        width = half if is_direction else half / abs(true)
        yield Hit(
            f"{effect}.{name}", is_baseline, abs(miss) <= half, width, is_direction=is_direction
        )
