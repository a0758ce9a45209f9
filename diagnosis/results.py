"""What a diagnosis says.

Where (gap cells), which (attribution), how far (shrinkage), and the verdict.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.comparison.pictures import Picture
from carrierflex.diagnosis.comparison.problem import Effects, GapCell
from carrierflex.diagnosis.gap.findings import GapDetail
from carrierflex.diagnosis.inference.screening import Screen

NAMED, NAMED_WITH_REMAINDER, ALIASED = "named", "named_with_remainder", "aliased"
NONE_OF_THESE, AT_NOISE_FLOOR, NOT_DIAGNOSABLE = (
    "none_of_these",
    "at_noise_floor",
    "not_diagnosable",
)
VERDICTS = (NAMED, NAMED_WITH_REMAINDER, ALIASED, NONE_OF_THESE, AT_NOISE_FLOOR, NOT_DIAGNOSABLE)

Interval = tuple[float, float]
NO_INTERVAL: Interval = (float("nan"), float("nan"))


@dataclass(frozen=True, eq=False)
class NamedValue:
    """A parameter's value, standard deviation and unit."""

    value: float
    std: float
    unit: str


@dataclass(frozen=True, eq=False)
class RankedSet:
    """One set of effects that was tried.

    Stacking weight, held-out RMS and log density, and why it was left out.

    `refused` is empty for a set that passed every rule.
    """

    effects: Effects
    weight: float
    held_out_rms: float
    elpd: float
    refused: str = ""


@dataclass(frozen=True, eq=False)
class Attribution:
    """Which effects explain the gap.

    Parameters
    ----------
    effects : tuple of str
        Named effects, the one that explains most first; for the verdict "aliased" the best member
        of each class.
    aliases : tuple of tuple of str
        Classes of effects that these records cannot tell apart, the named one first.
    parameters : mapping of str to mapping of str to NamedValue
        Values by effect (``baseline`` too) and name.
    ranking : tuple of RankedSet
        Sets tried, best first.
    screen : Screen, optional
        Force-space screen.
    explainable : float
        Share of the gap that a flexible model explains on held-out pieces, in the space of the
        screen.
    discriminating_experiment : str
        The measurement that would tell aliased effects apart or show a silent one.
    """

    effects: Effects
    aliases: tuple[Effects, ...]
    parameters: Mapping[str, Mapping[str, NamedValue]]
    ranking: tuple[RankedSet, ...]
    screen: Screen | None
    explainable: float
    discriminating_experiment: str


@dataclass(frozen=True, eq=False)
class SelectionStep:
    """Held-out result after effects were added in turn.

    RMS, rho against the baseline with its interval.
    """

    added: str
    rms: float
    rho: float
    rho_ci95: Interval


@dataclass(frozen=True, eq=False)
class RunValidation:
    """Comparison error of a run, measured less simulated, and its uncertainty (ASME V&V 20).

    `error_before` and `error_after` are the RMS of E; `u_val` is the root of the squares of the
    numerical and the noise part.
    """

    run: str
    error_before: float
    error_after: float
    u_val: float


@dataclass(frozen=True, eq=False)
class GapReduction:
    """How far the gap shrinks on held-out records.

    Parameters
    ----------
    rms_before, rms_after, noise_floor : float
        RMS in the unit of the channels.
    rho, rho_ci95 : float, tuple of float
        RMS after over before.
    phi, phi_ci95 : float, tuple of float
        Share of the mean square above the floor that is explained.
    floor_multiple : float
        RMS after over the floor.
    negative_control_rho, black_box_rho, extrapolation_rho : float
        rho of the best placebo, of a flexible model, and in the condition with the largest gap
        predicted from the others (NaN with one condition).
    search : tuple of SelectionStep
        Accepted effects in turn.
    cells_before, cells_after : tuple of GapCell
        Gap map of the baseline and of the accepted model.
    validation : tuple of RunValidation
        By run.
    """

    rms_before: float
    rms_after: float
    noise_floor: float
    rho: float
    rho_ci95: Interval
    phi: float
    phi_ci95: Interval
    floor_multiple: float
    negative_control_rho: float
    black_box_rho: float
    extrapolation_rho: float
    search: tuple[SelectionStep, ...]
    cells_before: tuple[GapCell, ...]
    cells_after: tuple[GapCell, ...]
    validation: tuple[RunValidation, ...]


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Where the gap lies, which effect is missing, how far it shrinks.

    Parameters
    ----------
    campaign, kind : str
        Name and kind of the campaign.
    verdict : str
        One of VERDICTS.
    reason : str
        Why this verdict, in one sentence with its numbers.
    unit : str
        Unit of every RMS.
    where_text : str
        Where the gap lies.
    attribution : Attribution
        Which.
    reduction : GapReduction
        How far.
    pictures : tuple of Picture
        Gap along the motion, where the plant draws it.
    gap : GapDetail, optional
        The baseline's gap beyond its map, where the plant looks at it.
    """

    campaign: str
    kind: str
    verdict: str
    reason: str
    unit: str
    where_text: str
    attribution: Attribution
    reduction: GapReduction
    pictures: tuple[Picture, ...] = ()
    gap: GapDetail | None = None


def finite_or_none(value: float) -> float | None:
    """Number for a JSON file, which knows neither NaN nor infinity."""
    return float(value) if np.isfinite(value) else None
