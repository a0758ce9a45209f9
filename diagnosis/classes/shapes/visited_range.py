"""Records that leave the range in which a law was measured."""

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning
from carrierflex.simulation.element.memory_laws import HYSTERESIS, MEMORY
from carrierflex.simulation.element.surface_laws import FORCE_SURFACE
from carrierflex.simulation.element.tabulated_laws import COUPLED_DAMPING

#: How a law goes on that does not with the slope of its end.
_CONTINUED = {
    COUPLED_DAMPING: "its end value",
    HYSTERESIS: "stops that slip as at its end",
    MEMORY: "branches that stay linear",
    FORCE_SURFACE: "the slopes of its edge",
}


def visited_range_warning(
    law: str,
    effect_class: str,
    *,
    share: float,
    reached: FloatArray,
    table: FloatArray,
    unit: str,
    run: str,
) -> CampaignWarning:
    """Warning of what a law does beyond its table.

    Parameters
    ----------
    law, effect_class : str
        Law and its class.
    share : float
        Share of the samples outside.
    reached : ndarray
        Deflections or speeds of the records.
    table : ndarray, shape (n,)
        Those of the table, increasing.
    unit : str
        Of both.
    run : str
        Run that is farthest outside.
    """
    text = (
        f"{share:.2%} of the samples lie outside the range in which the law was measured: records "
        f"reach from {reached.min():.4g} to {reached.max():.4g} {unit}, its table from "
        f"{table[0]:.4g} to {table[-1]:.4g} {unit}"
    )
    continued = _CONTINUED.get(effect_class, "the slope of its end")
    remedy = f"beyond its table the law goes on with {continued}; measure it at this size"
    return CampaignWarning("visited_range", law, text, remedy, share, f"run {run}")
