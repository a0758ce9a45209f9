"""Records too long for memory: read in pieces, once, reduced to sums, and identified from these."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pa_parquet
from numpy.typing import NDArray

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import columns_of, run_of_columns
from carrierflex.identification.campaign.campaign_header import CampaignHeader, RunEntry
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.run_files import column_pieces
from carrierflex.identification.carrier.carrier_identification import (
    FitOptions,
    fitted_channels,
    identify_from_sums,
)
from carrierflex.identification.carrier.models import CarrierModel
from carrierflex.identification.carrier.parameter_estimate import ParameterEstimate
from carrierflex.identification.estimation.normal_equations import NormalEquations

#: Groups of revolutions kept apart for the jackknife; beyond, neighbours are put together in pairs.
LARGEST_GROUPS = 2048


def run_pieces(folder: Path, entry: RunEntry, header: CampaignHeader) -> Iterator[Run]:
    """Read one run file in pieces, each checked as a whole run is.

    Parameters
    ----------
    folder : Path
        Campaign folder.
    entry : RunEntry
        Which run.
    header : CampaignHeader
        The campaign without its records.

    Yields
    ------
    Run
        Consecutive pieces of the record.

    Raises
    ------
    ValueError
        Where the file is not as the contract says; time must increase from piece to piece as well.
    """
    expected = columns_of(header)
    path = folder / entry.file
    if not path.is_file():
        raise ValueError(
            f"{folder}: no file '{entry.file}' of run {entry.name}; expected it in the folder of "
            "campaign.toml"
        )
    last = -np.inf
    first_sample = 0
    for columns in column_pieces(path, expected):
        if columns["time"].size == 0:
            continue
        if not columns["time"][0] > last:
            raise ValueError(
                f"{path.name}: column 'time' is {columns['time'][0]} at sample {first_sample} "
                f"after {last}; "
                "expected strictly increasing time"
            )
        yield run_of_columns(columns, entry, header)
        last = float(columns["time"][-1])
        first_sample += columns["time"].size
    if first_sample == 0:
        raise ValueError(f"{path.name}: no samples below the header; expected at least one")


def streamed_equations(
    pieces: Iterable[Run], channels: Sequence[Channel], model: CarrierModel
) -> NormalEquations:
    """Accumulate the normal equations of one run from its pieces.

    Memory does not grow with the record.

    Parameters
    ----------
    pieces : iterable of Run
        Consecutive pieces, as :func:`run_pieces` yields them.
    channels : sequence of Channel
        Channels to fit.
    model : CarrierModel
        Model.

    Returns
    -------
    NormalEquations
        Sums over whole revolutions. Where there are more than `LARGEST_GROUPS` of them,
        neighbouring revolutions share one sum; the jackknife then leaves out a group at a time,
        which suits residuals alike from turn to turn, and revolutions that do not fill the last
        group are left out.

    Raises
    ------
    ValueError
        Where the carrier turns by less than one revolution, or every sample is missing.
    """
    groups = _Groups(channels, len(model.coefficients))
    name = ""
    for measured in pieces:
        piece = measured.within_use()
        name = piece.name
        rows = groups.rows_by_group(piece.inputs["carrier_angle"])
        for c, channel in enumerate(channels):
            groups.sums.add(
                c, rows, model.design(piece.inputs, channel), piece.signals[channel.name]
            )
    sums = groups.whole_revolutions(name)
    sums.refuse_empty()
    return sums


class _Groups:
    """Sums by groups of `length` consecutive revolutions, as many groups as fit."""

    def __init__(self, channels: Sequence[Channel], n_coefficients: int) -> None:
        self.sums = NormalEquations.empty("", channels, LARGEST_GROUPS, n_coefficients)
        self._length = 1
        self._start: float | None = None
        self._direction = 0.0
        self._travel = 0.0
        self._step = 0.0

    def rows_by_group(self, angle: NDArray[np.float64]) -> list[NDArray[np.int64]]:
        """Rows of a piece that belong to each group, up to the last one that it meets.

        Groups are put together first where they no longer suffice.
        """
        if self._start is None:
            self._start, self._direction = (
                float(angle[0]),
                float(np.sign(angle[-1] - angle[0])) or 1.0,
            )
            self._last = self._start
        if (angle[0] - self._last) * self._direction < -np.pi:
            raise ValueError(
                f"column 'carrier_angle' goes from {self._last} to {angle[0]} rad between two "
                "pieces of the record; "
                "expected no jump back; unwrap it"
            )
        self._last = float(angle[-1])
        turns = (angle - self._start) * self._direction / (2.0 * np.pi)
        self._travel = float(turns[-1])
        self._step = (
            max(self._step, float(np.median(np.abs(np.diff(turns)))))
            if turns.size > 1
            else self._step
        )
        while turns.max() / self._length >= LARGEST_GROUPS:
            self._pair()
        number = np.floor(turns / self._length).astype(np.int64)
        order = np.argsort(number, kind="stable")
        n_met = int(number.max()) + 1
        bounds = np.searchsorted(number[order], np.arange(n_met + 1))
        return [order[bounds[k] : bounds[k + 1]] for k in range(n_met)]

    def whole_revolutions(self, run: str) -> NormalEquations:
        """Sums of a run by groups of whole revolutions."""
        n_groups = int(np.floor((self._travel + 1.001 * self._step) / self._length))
        if n_groups < 1:
            raise ValueError(
                f"run {run}: the carrier turns by {self._travel:.3f} revolutions; expected at "
                "least one whole revolution"
            )
        s = self.sums
        # Copies: a view would keep all places of every run, a hundred megabytes with 64 channels.
        return replace(
            s,
            run=run,
            matrix=s.matrix[:n_groups].copy(),
            right_side=s.right_side[:n_groups].copy(),
            square_sum=s.square_sum[:n_groups].copy(),
            n_samples=s.n_samples[:n_groups].copy(),
        )

    def _pair(self) -> None:
        """Put neighbouring groups together; the upper half of the places becomes free."""
        for sums in (
            self.sums.matrix,
            self.sums.right_side,
            self.sums.square_sum,
            self.sums.n_samples,
        ):
            sums[: LARGEST_GROUPS // 2] = sums[0::2] + sums[1::2]
            sums[LARGEST_GROUPS // 2 :] = 0
        self._length *= 2


def is_long(folder: Path, header: CampaignHeader, largest_size: int = 200_000_000) -> bool:
    """Whether the run files, or the numbers in them, exceed `largest_size` bytes together."""
    total = 0
    for entry in header.runs:
        path = folder / entry.file
        if not path.is_file():
            continue
        if path.suffix.lower() == ".parquet":
            try:
                metadata = pa_parquet.read_metadata(path)
            except (pa.ArrowInvalid, OSError):
                continue  # refused with its reason when it is read
            total += 8 * metadata.num_rows * metadata.num_columns
        else:
            total += path.stat().st_size
    return total > largest_size


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
        campaign = header.with_records([head])
        channels = fitted_channels(campaign, options)
        equations.append(streamed_equations(chain([head], pieces), channels, largest))
    estimates: dict[str, Mapping[str, ParameterEstimate]] = {}
    for model in models:
        columns = _columns(model, largest)
        of_model = [run.with_columns(columns) for run in equations]
        estimates[model.name] = _solved(of_model, model, options, per_run=per_run)
    return header.with_records(heads), estimates


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
