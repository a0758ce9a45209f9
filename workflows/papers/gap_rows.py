"""Rows of the tables of ``carrierflex papers gap``, and its file papers_gap.json."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, TypedDict

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.versions import Versions


@dataclass(frozen=True)
class EvidenceRow:
    """Evidence of a hypothesis at one width of the priors and one choice of errors."""

    hypothesis: Annotated[str, "Hypothesis"]
    n_free: Annotated[int, "Free parameters"]
    width: Annotated[float, "Widths of the priors over those of the table"]
    amplitude_error: Annotated[float, "Standard error of the amplitudes [m]"]
    window_spread: Annotated[float, "Spread between the records of tables 4 and 5, share"]
    log_evidence: Annotated[float, "Logarithm of the evidence less that of the best"]


@dataclass(frozen=True)
class OrderRow:
    """Order of two hypotheses over all widths and errors of the amplitudes."""

    first: Annotated[str, "Hypothesis"]
    second: Annotated[str, "Hypothesis"]
    least: Annotated[float, "Least difference of the logarithms of their evidence"]
    most: Annotated[float, "Greatest difference"]
    better: Annotated[str | None, "The better one at every choice; null: not decided"]


@dataclass(frozen=True, eq=False)
class PredictionRow:
    """What hypotheses predict of a measurement, and what it would tell."""

    measurement: Annotated[str, "Measurement"]
    unit: Annotated[str, "Unit of the predictions"]
    standard_error: Annotated[float, "Standard error, in the unit"]
    predicted: Annotated[
        Mapping[str, tuple[float, float, float]], "5 %, 50 % and 95 % by hypothesis"
    ]
    bits: Annotated[float, "Expected information on which hypothesis holds [bit]"]


@dataclass(frozen=True, eq=False)
class CausesRow:
    """Numbers of the best hypothesis with some of its causes."""

    causes: Annotated[str, "Causes"]
    numbers: Annotated[NDArray[np.float64], "Numbers, in the order of `names`"]
    table_5_rms: Annotated[float, "RMS of the gap to the amplitudes of table 5 [m]"]
    table_4_rms: Annotated[float, "RMS of the gap to table 4 [m]"]


@dataclass(frozen=True)
class LeftOutRow:
    """A published number predicted from the others."""

    name: Annotated[str, "Number"]
    published: Annotated[float, "Published value, SI"]
    hypothesis: Annotated[str, "Hypothesis"]
    mean: Annotated[float, "Mean of the prediction"]
    std: Annotated[float, "Its standard deviation"]
    few: Annotated[bool, "Few samples: the prediction is uncertain"]


@dataclass(frozen=True, eq=False)
class PapersGap:
    """Which cause explains tables 4 and 5 of the 2012 paper."""

    method: Annotated[str, "How the evidence is computed: laplace or nested"]
    best: Annotated[str, "Hypothesis of the greatest evidence at 6 um and width 1"]
    order: Annotated[tuple[OrderRow, ...], "Order of the hypotheses, two at a time"]
    predictions: Annotated[tuple[PredictionRow, ...], "Measurements, the most informative first"]
    causes: Annotated[tuple[CausesRow, ...], "What shrinks as causes are added"]
    evidence: Annotated[tuple[EvidenceRow, ...], "Evidence by hypothesis, width and errors"]
    names: Annotated[tuple[str, ...], "What the numbers are: SI units"]
    published: Annotated[NDArray[np.float64], "Published numbers, in the order of `names`"]
    values: Annotated[
        Mapping[str, Mapping[str, float]], "Most probable values by hypothesis, SI units"
    ]
    numbers: Annotated[
        Mapping[str, NDArray[np.float64]], "Numbers of the most probable values by hypothesis"
    ]
    left_out: Annotated[tuple[LeftOutRow, ...], "Every number predicted from the others"]
    laplace_evidence: Annotated[
        Mapping[str, float], "Log evidence by Laplace's approximation, 6 um and width 1"
    ]
    nested_evidence: Annotated[
        Mapping[str, float], "The same by nested sampling; empty: not checked"
    ]
    largest_deviation: Annotated[
        float, "Largest relative difference of the condensed statics from the stage's"
    ]


class GapInputs(TypedDict):
    """Options of the command."""

    method: Annotated[str, "laplace or nested"]
    starts: Annotated[int, "Starting points of each search"]
    size: Annotated[float, "Element edge length [m]"]
    seed: Annotated[int, "Seed of the random numbers"]


class PapersGapDocument(TypedDict):
    """papers_gap.json, written by papers gap."""

    gap: Annotated[PapersGap, "Which cause explains tables 4 and 5 of the 2012 paper"]
    inputs: Annotated[GapInputs, "Options"]
    versions: Versions
