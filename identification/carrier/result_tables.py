"""Identification results as plain rows.

RMS by run and model (table 4 of the 2012 paper), parameters by run.
"""

from collections.abc import Mapping
from typing import Any

from carrierflex.identification.carrier.parameter_estimate import SHARED, ParameterEstimate


def rms_rows(estimates: Mapping[str, Mapping[str, ParameterEstimate]]) -> list[dict[str, Any]]:
    """RMS of the residual [m], one row a run: ``{"run": "LC1", "m1": 1.1e-4, "m2": 1.0e-4}``.

    Parameters
    ----------
    estimates : mapping of str to mapping of str to ParameterEstimate
        Estimate by model name and run; a joint estimate may stand under every run.

    Returns
    -------
    list of dict
        Rows in the order of the runs.
    """
    runs = list(next(iter(estimates.values())))
    return [
        {"run": run, **{model: own[run].rms_by_run[run] for model, own in estimates.items()}}
        for run in runs
    ]


def parameter_rows(by_run: Mapping[str, ParameterEstimate]) -> list[dict[str, Any]]:
    """Parameters with their errors, one row each; a shared one stands once, with the run "all".

    Parameters
    ----------
    by_run : mapping of str to ParameterEstimate
        Estimate of one model by run.

    Returns
    -------
    list of dict
        Keys ``model, run, parameter, value, std, low, high, unit``; SI units, radians.
    """
    rows = []
    for estimate in dict.fromkeys(by_run.values()):
        for k, name in enumerate(estimate.names):
            low, high = estimate.ci95[k]
            rows.append(
                {
                    "model": estimate.model,
                    "run": "all" if estimate.scopes[k] == SHARED else estimate.scopes[k],
                    "parameter": name,
                    "value": float(estimate.values[k]),
                    "std": float(estimate.std[k]),
                    "low": float(low),
                    "high": float(high),
                    "unit": estimate.units[k],
                }
            )
    return rows
