"""Where the search for bushing parameters begins, and the thinned record that ranks the starts."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.estimation.several_starts import merged_values
from carrierflex.identification.mounting.bushing_models import BushingModel, MountingResiduals
from carrierflex.simulation.fit_parameter import FitParameter

Array = NDArray[np.float64]

#: Starts search on every n-th sample: so many samples of a run are enough to rank them.
_SEARCH_SAMPLES = 4000


def search_starts(
    residuals: MountingResiduals, simpler: tuple[BushingModel, Array] | None
) -> list[Array]:
    """Starts of a model: the simpler one's solution, then one for each way added terms may matter.

    Parameters
    ----------
    residuals : MountingResiduals
        What is fitted.
    simpler : (BushingModel, ndarray), optional
        Model that this one contains, and its values.

    Returns
    -------
    list of ndarray, shape (p,)
        Starts.
    """
    model, K = residuals.model, residuals.rig.bushing_radial_stiffness
    free = model.free(residuals.rig)
    zero = dict.fromkeys(model.names, 0.0)
    if simpler is None:
        rig = residuals.rig
        base = {
            **zero,
            "K1": K,
            "C1": rig.bushing_radial_damping,
            "K_x": rig.bushing_axial_stiffness,
            "C_x": rig.bushing_axial_damping,
        }
        guesses: list[dict[str, float]] = [{}]
    else:
        known = simpler[0].simulator_values(simpler[1])
        base = {**zero, **model.values_of(known)}
        guesses = [{}, *_guesses(model, base, free)]
    return [merged_values(free, {**base, **guess}, zero) for guess in guesses]


def _guesses(
    model: BushingModel, base: Mapping[str, float], free: Sequence[FitParameter]
) -> list[dict[str, float]]:
    scale = {one.name: one.scale for one in free}
    K1 = base["K1"]
    guesses = [{"K1": share * K1, "K3": (1.0 - share) * scale["K3"]} for share in (0.7, 1.3)]
    if "Kp" not in model.names:
        return guesses
    for tau in (0.1, 1.0):
        for yielding in (0.1, 0.4):
            hysteresis = {"k": K1, "c": tau * K1, "Kp": 0.4 * K1, "Fy": yielding * scale["Fy"]}
            guesses.append({"K1": 0.6 * K1, **hysteresis})
    return guesses


def thinned(residuals: MountingResiduals) -> MountingResiduals:
    """Residuals of every n-th sample; the loads stay linear between the samples that are left.

    Parameters
    ----------
    residuals : MountingResiduals
        Residuals of the whole record.

    Returns
    -------
    MountingResiduals
        Cheaper ones, good enough to rank starts.
    """
    inputs, signals = [], []
    for own, measured in zip(residuals.inputs, residuals.signals, strict=True):
        every = slice(None, None, max(1, own.time.size // _SEARCH_SAMPLES))
        inputs.append(type(own)(*(column[every] for column in own.columns().values())))
        signals.append(measured[every])
    return replace(residuals, inputs=tuple(inputs), signals=tuple(signals))
