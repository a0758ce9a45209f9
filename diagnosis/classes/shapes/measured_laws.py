"""Measured laws of every kind: from an answer to a law, the size of a law, its visited range."""

import re
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from carrierflex.diagnosis.classes.results import (
    LEADING_CLASS,
    NAMED_CLASS,
    ClassAnswer,
    ClassFinding,
)
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning
from carrierflex.simulation.effect_parameters import EffectParameter
from carrierflex.simulation.laws import COUPLED_DAMPING, FORCE_SURFACE, HYSTERESIS, MEMORY, Law

#: The parameter of a measured law: one where the shape is as measured.
SIZE = EffectParameter("size", "1", 0.0, np.inf, scale=1.0)
_MOST_LETTERS = 40
#: How a law goes on that does not with the slope of its end.
_CONTINUED = {
    COUPLED_DAMPING: "its end value",
    HYSTERESIS: "stops that slip as at its end",
    MEMORY: "branches that stay linear",
    FORCE_SURFACE: "the slopes of its edge",
}


def law_of_class(
    answer: ClassAnswer,
    campaign: str,
    names: Mapping[str, str],
    wanted: str | None,
    refusal: Callable[[str, ClassFinding], str],
) -> Law:
    """Measured shape of a class of an answer, named after class and campaign.

    Parameters
    ----------
    answer : ClassAnswer
        Answer by class.
    campaign : str
        Name of the campaign.
    names : mapping of str to str
        Classes that a law file holds, and what the file calls them.
    wanted : str, optional
        Class as the file calls it; default: that of the largest share.
    refusal : callable
        Why the class has no law although its shape was measured; empty where it has one.

    Raises
    ------
    ValueError
        Where no class is named or leading, the answer has not the wanted one, or it has no law.
    """
    if answer.state not in (NAMED_CLASS, LEADING_CLASS) or not answer.classes:
        raise ValueError(f"no law to save: the answer by class is '{answer.state}'")
    known = {names.get(finding.id, finding.id): finding for finding in answer.classes}
    name = wanted or max(known, key=lambda one: known[one].share)
    if name not in known:
        listed = ", ".join(known)
        raise ValueError(f"no law to save: '{name}' is not in the answer; expected {listed}")
    if name not in names.values():
        raise ValueError(
            f"no law to save: the class '{name}' is not kept as a law; expected one of "
            f"{', '.join(dict.fromkeys(names.values()))}"
        )
    finding = known[name]
    reason = refusal(name, finding)
    if not reason and finding.measured_law is None:
        reason = (
            f"'{name}' was named by its law {finding.law}, not by its shape; add that law to the "
            "model, its parameters are in diagnosis.json"
        )
    if reason or finding.measured_law is None:
        raise ValueError(f"no law to save: {reason}")
    return replace(finding.measured_law, name=_law_name(name, campaign), measured_on=campaign)


def _law_name(effect_class: str, campaign: str) -> str:
    """Id of a law: small letters, digits and underscores."""
    slug = re.sub(r"[^a-z0-9]+", "_", campaign.lower()).strip("_")[:_MOST_LETTERS]
    return f"{effect_class.replace('/', '_')}_of_{slug or 'campaign'}"


def visited_range_warning(
    law: Law,
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
    law : Law
        Law.
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
    continued = _CONTINUED.get(law.effect_class, "the slope of its end")
    remedy = f"beyond its table the law goes on with {continued}; measure it at this size"
    return CampaignWarning("visited_range", law.name, text, remedy, share, f"run {run}")
