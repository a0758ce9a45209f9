"""Identification of the carrier's motion from records that are read in pieces, once."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_header import CampaignHeader
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.carrier.carrier_identification import (
    FitOptions,
    axial_channels,
    identify_from_sums,
    rim_channels,
)
from carrierflex.identification.carrier.long_records import run_pieces, streamed_equations
from carrierflex.identification.carrier.models import CarrierModel
from carrierflex.identification.carrier.parameter_estimate import ParameterEstimate
from carrierflex.identification.estimation.normal_equations import NormalEquations


def identify_in_pieces(
    folder: Path,
    header: CampaignHeader,
    models: Sequence[CarrierModel],
    options: FitOptions,
    *,
    per_run: bool,
) -> tuple[Campaign, dict[str, Mapping[str, ParameterEstimate]]]:
    """Fit nested models to a campaign whose records do not fit into memory.

    Parameters
    ----------
    folder : Path
        Campaign folder.
    header : CampaignHeader
        Its content without the records.
    models : sequence of CarrierModel
        Models of which each begins with the coefficients of the one before; the last one's sums
        serve all.
    options : FitOptions
        Sensors and source of the covariance.
    per_run : bool
        Fit every run by itself.

    Returns
    -------
    campaign : Campaign
        The first piece of every run, for plots.
    estimates : dict
        Estimate by model and run.

    Raises
    ------
    ValueError
        Where a record is refused, or the models are not nested.
    """
    largest = models[-1]
    heads: list[Run] = []
    equations: list[NormalEquations] = []
    for entry in header.runs:
        pieces = run_pieces(folder, entry, header)
        head = next(pieces)
        heads.append(head)
        campaign = _campaign(header, (head,))
        channels = rim_channels(campaign) if options.radial else axial_channels(campaign)
        equations.append(streamed_equations(_chained(head, pieces), channels, largest))
    estimates: dict[str, Mapping[str, ParameterEstimate]] = {}
    for model in models:
        columns = _columns(model, largest)
        of_model = [run.with_columns(columns) for run in equations]
        estimates[model.name] = _solved(of_model, model, options, per_run=per_run)
    return _campaign(header, tuple(heads)), estimates


def _solved(
    equations: Sequence[NormalEquations], model: CarrierModel, options: FitOptions, *, per_run: bool
) -> Mapping[str, ParameterEstimate]:
    if per_run:
        alone = model.each_run()
        return {run.run: identify_from_sums([run], alone, options) for run in equations}
    return dict.fromkeys(
        [run.run for run in equations], identify_from_sums(equations, model, options)
    )


def _columns(model: CarrierModel, largest: CarrierModel) -> list[int]:
    """Where the coefficients of a smaller model stand in the largest one."""
    missing = [name for name in model.coefficients if name not in largest.coefficients]
    if missing:
        raise ValueError(
            f"model {largest.name} has no coefficient {missing[0]} of model {model.name}; "
            "expected nested models"
        )
    return [largest.coefficients.index(name) for name in model.coefficients]


def _campaign(header: CampaignHeader, runs: tuple[Run, ...]) -> Campaign:
    return Campaign(
        header.contract.name,
        header.name,
        header.baseline,
        header.rig,
        header.channels,
        runs,
        header.inputs,
    )


def _chained(head: Run, rest: Iterator[Run]) -> Iterator[Run]:
    yield head
    yield from rest
