"""What identification.json holds, by key."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Literal, NotRequired, TypedDict

from carrierflex.files.versions import Software
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning
from carrierflex.identification.carrier.robust_loss import Outliers


class IdentifiedValue(TypedDict):
    """A parameter's value with its 95 % interval."""

    value: Annotated[float, "Value"]
    std: Annotated[float, "Half the width of its interval over 1.96"]
    unit: Annotated[str, "Unit of both"]
    ci95: Annotated[tuple[float, float], "The interval; null where nothing bounds it"]


class IdentifiedRun(TypedDict):
    """Identification of one run."""

    parameters: Annotated[Mapping[str, IdentifiedValue], "Its own parameters"]
    rms: Annotated[float, "RMS of the residual [unit of the channels]"]
    rms_by_channel: Annotated[Mapping[str, float], "The same by channel"]


class Correlation(TypedDict):
    """Correlation of parameters."""

    parameters: Annotated[Sequence[str], "Names, those of one run as LC1.d_x"]
    matrix: Annotated[Sequence[Sequence[float]], "Rows of the matrix"]


class BushingRow(TypedDict):
    """One bushing model: tables 2 and 3 of the 2011 paper."""

    model: Annotated[str, "Name"]
    n_parameters: Annotated[int, "Number of parameters"]
    simulation_seconds: Annotated[float, "Time of one simulation [s]"]
    accuracy: Annotated[float, "Objective over that of the linear model"]
    rms: Annotated[float, "RMS of the residual [m]"]
    parameters: Annotated[Mapping[str, IdentifiedValue], "By published name"]
    model_runs: Annotated[int, "Simulations that the fit took"]
    seconds: Annotated[float, "Time of the fit [s]"]
    complex_model_runs: Annotated[int | None, "Simulations of the complex method"]
    complex_seconds: Annotated[float, "Time of the complex method [s]"]
    complex_accuracy: Annotated[float, "Objective of the complex method over the linear model's"]


class IdentificationDocument(TypedDict):
    """identification.json, written by identify and run."""

    format: Annotated[Literal["carrierflex-identification"], "Kind of the file"]
    version: Annotated[Literal[1], "Version of the format"]
    campaign: Annotated[str, "Name of the campaign"]
    model: Annotated[str, "Model that was fitted"]
    software: Software
    shared: Annotated[Mapping[str, IdentifiedValue], "Parameters of all runs"]
    runs: Annotated[Mapping[str, IdentifiedRun], "By run"]
    undetermined: Annotated[
        Sequence[str], "Parameters and combinations that the records do not determine"
    ]
    outliers: NotRequired[Annotated[Sequence[Outliers], "Flagged samples, which took part"]]
    warnings: Annotated[Sequence[CampaignWarning], "What does not look right in the campaign"]
    covariance_source: NotRequired[Annotated[str, "Where the errors come from"]]
    correlation: Annotated[Mapping[str, Correlation], "By run; under an empty name where joint"]
    model_runs: Annotated[int, "Evaluations of the model"]
    seconds: Annotated[float, "Time of the identification [s]"]
    models: NotRequired[Annotated[Mapping[str, Sequence[BushingRow]], "Every bushing model"]]
    axial_unknowns: NotRequired[
        Annotated[Mapping[str, Sequence[str]], "Axial constants of the bushings that were fitted"]
    ]
