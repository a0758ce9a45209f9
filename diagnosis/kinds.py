"""The comparison problem of a campaign, by its kind; a new kind joins this table."""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

import numpy as np

from carrierflex.diagnosis.carrier.classes.measured_laws import carrier_law_of_answer
from carrierflex.diagnosis.carrier.problem import carrier_problem
from carrierflex.diagnosis.classes.results import ClassAnswer
from carrierflex.diagnosis.element.problem import element_problem, element_with_prediction
from carrierflex.diagnosis.element.shapes import law_of_answer
from carrierflex.diagnosis.kind.comparison_problem import ComparisonProblem
from carrierflex.diagnosis.mounting.problem import mounting_problem, mounting_with_prediction
from carrierflex.diagnosis.mounting.shapes import bushing_law_of_answer
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.simulation.laws import CARRIER, ELEMENT, MOUNTING, Law

Curves = Mapping[str, DeflectionCurve]
#: What a law of a kind is of, in words.
_LAW_OF = {ELEMENT: "one element", MOUNTING: "bushings", CARRIER: "a carrier"}


def problem_of(
    campaign: Campaign,
    curves: Curves | None = None,
    laws: Sequence[Law] = (),
) -> ComparisonProblem:
    """Comparison problem of a campaign.

    Parameters
    ----------
    campaign : Campaign
        Measured runs.
    curves : mapping of str to DeflectionCurve, optional
        Deflection curves, which kind carrier asks for.
    laws : sequence of Law
        Laws of files of the campaign's kind, further candidates.

    Raises
    ------
    ValueError
        Where no builder knows the kind, or it refuses the records.
    """
    if campaign.kind not in PROBLEM_BUILDERS:
        known = ", ".join(PROBLEM_BUILDERS)
        raise ValueError(
            f"campaign '{campaign.name}' is of kind {campaign.kind}; diagnose knows the kinds "
            f"{known}"
        )
    for law in laws:
        if law.kind != campaign.kind:
            raise ValueError(
                f"campaign '{campaign.name}' is of kind {campaign.kind}; law '{law.name}' is of "
                f"{_LAW_OF[law.kind]}; expected a law file (--law) of this kind"
            )
    return PROBLEM_BUILDERS[campaign.kind](campaign, curves, laws)


def _element(campaign: Campaign, curves: Curves | None, laws: Sequence[Law]) -> ComparisonProblem:
    problem = element_problem(campaign, laws)
    return element_with_prediction(problem, campaign) if _has_predictions(campaign) else problem


def _mounting(campaign: Campaign, curves: Curves | None, laws: Sequence[Law]) -> ComparisonProblem:
    problem = mounting_problem(campaign, laws)
    return mounting_with_prediction(problem, campaign) if _has_predictions(campaign) else problem


def _has_predictions(campaign: Campaign) -> bool:
    """Whether the baseline is the prediction in the run files, none of which may be empty."""
    if campaign.baseline.source != "columns":
        return False
    for run in campaign.runs:
        for name, values in run.predictions.items():
            if not np.isfinite(values).any():
                raise ValueError(
                    f"run {run.name}: column '{name}_sim' is empty; expected a prediction"
                )
    return True


def _carrier(campaign: Campaign, curves: Curves | None, laws: Sequence[Law]) -> ComparisonProblem:
    if campaign.baseline.source == "stage":
        raise ValueError(
            f"campaign '{campaign.name}': [baseline]: key 'source' is 'stage'; expected "
            "predictions of the stage with it, which diagnose and check compute"
        )
    if curves is None:
        raise ValueError(
            f"campaign '{campaign.name}' is of kind carrier; expected deflection curves with it"
        )
    return carrier_problem(campaign, curves, laws)


PROBLEM_BUILDERS: Mapping[
    str, Callable[[Campaign, Curves | None, Sequence[Law]], ComparisonProblem]
] = {"carrier": _carrier, "element": _element, "mounting": _mounting}


_FittedValues = Mapping[str, Mapping[str, float]]
#: Law of an answer by class, by kind. Kinds carrier and mounting keep no law of a named effect.
_LAWS: dict[str, Callable[[ClassAnswer, str, str | None, _FittedValues], Law]] = {
    CARRIER: lambda answer, name, wanted, values: carrier_law_of_answer(answer, name, wanted),
    ELEMENT: law_of_answer,
    MOUNTING: lambda answer, name, wanted, values: bushing_law_of_answer(answer, name, wanted),
}


def saved_law(
    campaign: Campaign,
    answer: ClassAnswer,
    wanted: str | None,
    values: _FittedValues = MappingProxyType({}),
) -> Law:
    """Measured shape of a class as a law of the campaign's kind.

    `wanted` is a class as its table calls it, of a carrier frame and pattern; default: that of the
    largest share. `values` are fitted parameters of the named laws.
    """
    return _LAWS[campaign.kind](answer, campaign.name, wanted, values)
