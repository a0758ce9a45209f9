"""Writing of identification.json."""

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from carrierflex.files.whole_files import whole_file
from carrierflex.identification.carrier.parameter_estimate import SHARED, ParameterEstimate
from carrierflex.identification.carrier.robust_loss import Outliers

FORMAT = "carrierflex-identification"
VERSION = 1


def software_name() -> str:
    """Name and version of this software: ``carrierflex 0.1.0``."""
    try:
        return f"carrierflex {version('carrierflex')}"
    except PackageNotFoundError:
        return "carrierflex (not installed)"


def identification_document(
    campaign: str,
    estimates: Mapping[str, ParameterEstimate] | ParameterEstimate,
    *,
    seconds: float,
    model_runs: int,
    outliers: Sequence[Outliers] = (),
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

    Returns
    -------
    dict
        Ready for a JSON writer; what is not finite is null.
    """
    joint = isinstance(estimates, ParameterEstimate)
    by_run = (
        dict.fromkeys(estimates.rms_by_run, estimates)
        if isinstance(estimates, ParameterEstimate)
        else estimates
    )
    first = next(iter(by_run.values()))
    texts = (
        first.undetermined
        if joint
        else [f"{run}: {text}" for run, one in by_run.items() for text in one.undetermined]
    )
    return {
        "format": FORMAT,
        "version": VERSION,
        "campaign": campaign,
        "model": first.model,
        "software": software_name(),
        "shared": _parameters(first, SHARED) if joint else {},
        "runs": {run: _run(estimate, run) for run, estimate in by_run.items()},
        "undetermined": list(texts),
        "outliers": [dataclasses.asdict(flag) for flag in outliers],
        "covariance_source": first.covariance_source,
        "correlation": {
            key: _correlation(one) for key, one in ({"": first} if joint else by_run).items()
        },
        "model_runs": model_runs,
        "seconds": seconds,
    }


def write_identification(path: Path, document: Mapping[str, Any]) -> None:
    """Write identification.json; the file appears complete or not at all.

    Parameters
    ----------
    path : Path
        File to write; its folder exists.
    document : mapping
        Result of :func:`identification_document`.
    """
    with whole_file(path) as temporary:
        temporary.write_text(
            json.dumps(document, indent=2, allow_nan=False) + "\n", encoding="utf-8"
        )


def _correlation(estimate: ParameterEstimate) -> dict[str, Any]:
    """Parameters, those of one run as ``LC1.d_x``, and the rows of their correlation matrix."""
    labels = [
        f"{scope}.{name}".lstrip(".")
        for name, scope in zip(estimate.names, estimate.scopes, strict=True)
    ]
    return {
        "parameters": labels,
        "matrix": [[_finite(value) for value in row] for row in estimate.correlation],
    }


def _run(estimate: ParameterEstimate, run: str) -> dict[str, Any]:
    """One run's entry; where it is fitted by itself every parameter stands here."""
    return {
        "parameters": _parameters(estimate, run),
        "rms": _finite(estimate.rms_by_run[run]),
        "rms_by_channel": {
            name: _finite(value) for name, value in estimate.rms_by_channel[run].items()
        },
    }


def _parameters(estimate: ParameterEstimate, scope: str) -> dict[str, Any]:
    """Value, error and unit of the parameters of one scope."""
    return {
        name: {
            "value": _finite(estimate.values[k]),
            "std": _finite(estimate.std[k]),
            "ci95": [_finite(end) for end in estimate.ci95[k]],
            "unit": estimate.units[k],
        }
        for k, name in enumerate(estimate.names)
        if estimate.scopes[k] == scope
    }


def _finite(value: float) -> float | None:
    """JSON knows neither NaN nor infinity."""
    return float(value) if math.isfinite(value) else None
