"""Content of identification.json."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from carrierflex.files.json_files import plain
from carrierflex.files.versions import software_name
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning
from carrierflex.identification.carrier.parameter_estimate import SHARED, ParameterEstimate
from carrierflex.identification.carrier.robust_loss import Outliers

FORMAT = "carrierflex-identification"
VERSION = 1

#: Parameters up to which the correlations of all of them are written.
_MOST_CORRELATED = 200


def identification_document(
    campaign: str,
    estimates: Mapping[str, ParameterEstimate] | ParameterEstimate,
    *,
    seconds: float,
    model_runs: int,
    outliers: Sequence[Outliers] = (),
    warnings: Sequence[CampaignWarning] = (),
) -> dict[str, Any]:
    """Content of identification.json.

    Parameters
    ----------
    campaign : str
        Name of the campaign.
    estimates : ParameterEstimate or mapping of str to ParameterEstimate
        One joint estimate, or one for each run; the latter leaves ``shared`` empty.
    seconds : float
        Time the identification took [s].
    model_runs : int
        Evaluations of the model; 1 for a closed-form fit.
    outliers : sequence of Outliers
        Flagged samples; they took part in the fit.
    warnings : sequence of CampaignWarning
        What does not look right in the campaign.

    Returns
    -------
    dict
        Ready for a JSON writer; what is not finite is null.
    """
    if isinstance(estimates, ParameterEstimate):
        by_run = dict.fromkeys(estimates.rms_by_run, estimates)
        every: Mapping[str, ParameterEstimate] = {"": estimates}
    else:
        by_run = every = dict(estimates)
    first = next(iter(every.values()))
    content = {
        "format": FORMAT,
        "version": VERSION,
        "campaign": campaign,
        "model": first.model,
        "software": software_name(),
        "shared": _parameters(first, SHARED) if "" in every else {},
        "runs": {run: _run(estimate, run) for run, estimate in by_run.items()},
        "undetermined": [
            f"{run}: {text}".removeprefix(": ")
            for run, estimate in every.items()
            for text in estimate.undetermined
        ],
        "outliers": outliers,
        "warnings": warnings,
        "covariance_source": first.covariance_source,
        "correlation": {run: _correlation(estimate) for run, estimate in every.items()},
        "model_runs": model_runs,
        "seconds": seconds,
    }
    document: dict[str, Any] = plain(content)
    return document


def _correlation(estimate: ParameterEstimate) -> dict[str, Any]:
    """Parameters, those of one run as ``LC1.d_x``, and the rows of their correlation matrix."""
    # Of many runs only the parameters that they share: the offsets of 500 runs with each other
    # would be forty megabytes that nobody reads.
    names = list(zip(estimate.names, estimate.scopes, strict=True))
    chosen = list(range(len(names)))
    if len(names) > _MOST_CORRELATED:
        chosen = [k for k, (_, scope) in enumerate(names) if scope == SHARED]
    return {
        "parameters": [f"{scope}.{name}".lstrip(".") for name, scope in (names[k] for k in chosen)],
        "matrix": estimate.correlation[np.ix_(chosen, chosen)],
    }


def _run(estimate: ParameterEstimate, run: str) -> dict[str, Any]:
    """One run's entry; where it is fitted by itself every parameter stands here."""
    return {
        "parameters": _parameters(estimate, run),
        "rms": estimate.rms_by_run[run],
        "rms_by_channel": estimate.rms_by_channel[run],
    }


def _parameters(estimate: ParameterEstimate, scope: str) -> dict[str, Any]:
    """Value, error and unit of the parameters of one scope."""
    return {
        name: {
            "value": estimate.values[k],
            "std": estimate.std[k],
            "ci95": estimate.ci95[k],
            "unit": estimate.units[k],
        }
        for k, name in enumerate(estimate.names)
        if estimate.scopes[k] == scope
    }
