"""What the inference says.

Verdicts, effects with their values and rivals, and how far the gap shrinks.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated

from carrierflex.diagnosis.comparison.problem import Effects, GapCell

NAMED = "named"
NAMED_WITH_REMAINDER = "named_with_remainder"
CLASS_NAMED = "class_named"
ALIASED = "aliased"
NONE_OF_THESE = "none_of_these"
AT_NOISE_FLOOR = "at_noise_floor"
NOT_DIAGNOSABLE = "not_diagnosable"
#: Reason of a diagnosis that is not possible: no gap can be told from a noise of unknown size.
FLOOR_UNKNOWN = "floor_unknown"
#: What parts a wiring to check first from the reason of the verdict.
OTHERWISE = "; otherwise "
#: Verdicts that name laws of the library.
NAMING = (NAMED, NAMED_WITH_REMAINDER, ALIASED)
VERDICTS = (
    NAMED, NAMED_WITH_REMAINDER, CLASS_NAMED, ALIASED, NONE_OF_THESE, AT_NOISE_FLOOR,
    NOT_DIAGNOSABLE,
)  # fmt: skip

Interval = tuple[float, float]
NO_INTERVAL: Interval = (float("nan"), float("nan"))


@dataclass(frozen=True, eq=False)
class NamedValue:
    """A parameter's value with its 95 % interval."""

    value: Annotated[float, "Value"]
    std: Annotated[float, "Half the width of its 95 % interval over 1.96"]
    unit: Annotated[str, "Unit of both"]
    ci95: Annotated[Interval, "The interval; not numbers where nothing bounds it"]
    sources: Annotated[
        Mapping[str, float],
        "Contribution to `std` of each source of error, ``noise``, ``load cell`` ...: "
        "their squares add up to its square",
    ] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class RankedSet:
    """One set of laws that was fitted."""

    effects: Annotated[Effects, "Laws"]
    held_out_rms: Annotated[
        float, "RMS that it leaves on held-out records, in the unit of the channels"
    ]
    refused: Annotated[str, "Why the records do not support it; empty where they do"] = ""


@dataclass(frozen=True, eq=False)
class Attribution:
    """Which effects explain the gap."""

    effects: Annotated[
        Effects,
        'Named effects, the one that explains most first; for the verdict "aliased" the '
        "best member of each class",
    ]
    aliases: Annotated[
        tuple[Effects, ...],
        "Classes of effects that these records cannot tell apart, the named one first",
    ] = ()
    parameters: Annotated[
        Mapping[str, Mapping[str, NamedValue]], "Values by effect (``baseline`` too) and name"
    ] = field(default_factory=dict)
    ranking: Annotated[tuple[RankedSet, ...], "Sets tried, best first"] = ()
    discriminating_experiment: Annotated[
        str, "The measurement that would tell aliased effects apart or show a silent one"
    ] = ""
    gains: Annotated[
        str,
        "What the intervals of the parameters hold of the signals' gains, and what they "
        "take as it is read",
    ] = ""
    undetermined: Annotated[
        tuple[str, ...],
        "Parameters that the records do not determine, in words, and the combination that they do",
    ] = ()
    alternatives: Annotated[
        Mapping[str, Mapping[str, NamedValue]],
        "Values of effects that cannot be told from the named ones, each in the place of its rival",
    ] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class SelectionStep:
    """Held-out result after effects were added in turn."""

    added: Annotated[str, "Effect that was added; ``baseline`` first"]
    rms: Annotated[float, "RMS of the gap in the unit of the channels"]
    rho: Annotated[float, "RMS over the baseline's"]
    rho_ci95: Annotated[Interval, "95 % interval of rho"]
    share: Annotated[
        float,
        "Share of the gap above the floor that the effect takes beside those before it; "
        "shares of all steps add up to phi",
    ] = math.nan
    share_ci95: Annotated[Interval, "95 % interval of the share"] = NO_INTERVAL
    by_run: Annotated[
        Mapping[str, float], "RMS that the effect takes, by run; negative where it harms"
    ] = field(default_factory=dict)
    halves: Annotated[Interval, "The same in the first and in the second half of the runs"] = (
        NO_INTERVAL
    )


@dataclass(frozen=True, eq=False)
class RunValidation:
    """Comparison error of a run, measured less simulated, and its uncertainty (ASME V&V 20)."""

    run: Annotated[str, "Run"]
    error_before: Annotated[float, "RMS of the error with the baseline"]
    error_after: Annotated[float, "RMS of the error with the effects"]
    u_val: Annotated[float, "Root of the squares of the numerical and the noise part"]


@dataclass(frozen=True, eq=False)
class BlockScore:
    """Held-out gap of the baseline in one block of a run."""

    run: Annotated[str, "Its run"]
    condition: Annotated[str, "Condition of the run"]
    block: Annotated[int, "Number of the block in the run, from 0"]
    samples: Annotated[int, "Samples that count, over all channels"]
    mean_square: Annotated[float, "Mean square of a sample"]


@dataclass(frozen=True, eq=False)
class GapReduction:
    """How far the gap shrinks on held-out records."""

    rms_before: Annotated[float, "RMS of the gap of the baseline, in the unit of the channels"]
    rms_after: Annotated[float, "RMS of the gap of the accepted model, in the same unit"]
    noise_floor: Annotated[float, "RMS of the noise, in the same unit"]
    rho: Annotated[float, "RMS after over before"]
    rho_ci95: Annotated[Interval, "95 % interval of rho"]
    phi: Annotated[float, "Share of the mean square above the floor that is explained"]
    phi_ci95: Annotated[Interval, "95 % interval of phi"]
    floor_multiple: Annotated[float, "RMS after over the floor"]
    extrapolation_rho: Annotated[
        float,
        "rho in the condition with the largest gap, predicted from the others (NaN with "
        "one condition)",
    ]
    steps: Annotated[tuple[SelectionStep, ...], "Accepted effects in turn"]
    cells_before: Annotated[Sequence[GapCell], "Gap map of the baseline"]
    cells_after: Annotated[Sequence[GapCell], "Gap map of the accepted model"]
    validation: Annotated[tuple[RunValidation, ...], "By run"]
    blocks: Annotated[tuple[BlockScore, ...], "The baseline's held-out gap by block"] = ()
