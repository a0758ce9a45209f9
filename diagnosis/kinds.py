"""The plant of a campaign, by its kind; a new kind joins this table."""

from collections.abc import Callable, Mapping

import numpy as np

from carrierflex.diagnosis.carrier.problem import carrier_problem
from carrierflex.diagnosis.comparison.problem import ComparisonProblem
from carrierflex.diagnosis.element.prediction import element_beside_prediction
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.mounting.prediction import mounting_beside_prediction
from carrierflex.diagnosis.mounting.problem import mounting_problem
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.identification.campaign.campaign import Campaign

Curves = Mapping[str, DeflectionCurve]


def problem_of(campaign: Campaign, curves: Curves | None = None) -> tuple[ComparisonProblem, bool]:
    """ComparisonProblem of a campaign, and whether its noise floor is measured.

    Parameters
    ----------
    campaign : Campaign
        Measured runs.
    curves : mapping of str to DeflectionCurve, optional
        Deflection curves, which kind carrier asks for.

    Returns
    -------
    tuple of (ComparisonProblem, bool)
        Ready to be diagnosed.

    Raises
    ------
    ValueError
        Where no plant knows the kind, or the plant refuses the records.
    """
    if campaign.kind not in PROBLEM_BUILDERS:
        known = ", ".join(PROBLEM_BUILDERS)
        raise ValueError(
            f"campaign '{campaign.name}' is of kind {campaign.kind}; diagnose knows the kinds {known}"
        )
    return PROBLEM_BUILDERS[campaign.kind](campaign, curves)


def _element(campaign: Campaign, curves: Curves | None) -> tuple[ComparisonProblem, bool]:
    problem = element_problem(campaign)
    if campaign.baseline.source == "columns":
        _refuse_empty_predictions(campaign)
        problem = element_beside_prediction(problem, campaign)
    return problem, problem.noise_is_measured


def _refuse_empty_predictions(campaign: Campaign) -> None:
    for run in campaign.runs:
        for name, values in run.predictions.items():
            if not np.isfinite(values).any():
                raise ValueError(
                    f"run {run.name}: column '{name}_sim' is empty; expected a prediction"
                )


def _carrier(campaign: Campaign, curves: Curves | None) -> tuple[ComparisonProblem, bool]:
    if curves is None:
        raise ValueError(
            f"campaign '{campaign.name}' is of kind carrier; expected deflection curves with it"
        )
    return carrier_problem(campaign, curves), True


def _mounting(campaign: Campaign, curves: Curves | None) -> tuple[ComparisonProblem, bool]:
    problem = mounting_problem(campaign)
    if campaign.baseline.source == "columns":
        _refuse_empty_predictions(campaign)
        problem = mounting_beside_prediction(problem, campaign)
    return problem, problem.noise_is_measured


#: Builder by kind: gives the plant, and whether its noise floor was declared or comes from repeats.
PROBLEM_BUILDERS: dict[str, Callable[[Campaign, Curves | None], tuple[ComparisonProblem, bool]]] = {
    "carrier": _carrier,
    "element": _element,
    "mounting": _mounting,
}
