"""What the inference says.

Verdicts, effects with their values and rivals, and how far the gap shrinks.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

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
VERDICTS = (
    NAMED,
    NAMED_WITH_REMAINDER,
    CLASS_NAMED,
    ALIASED,
    NONE_OF_THESE,
    AT_NOISE_FLOOR,
    NOT_DIAGNOSABLE,
)

#: Verdicts that name laws of the library.
NAMING = (NAMED, NAMED_WITH_REMAINDER, ALIASED)

Interval = tuple[float, float]
NO_INTERVAL: Interval = (float("nan"), float("nan"))


@dataclass(frozen=True, eq=False)
class NamedValue:
    """A parameter's value with its 95 % interval."""

    #: value, std: value; half the width of its 95 % interval over 1.96
    value: float
    std: float
    unit: str  # Unit of both
    ci95: Interval  # The interval; not numbers where nothing bounds it
    #: Contribution to `std` of each source of error, ``noise``, ``load cell`` ...: their squares
    #: add up to its square
    sources: Mapping[str, float] = field(default_factory=dict)


#: Rules of :class:`Rejection`: the search did not converge; a parameter is at its physical bound;
#: laws that together fit any curve; an effect explains too little of the gap left without it, or of
#: the whole gap; the held-out gap grows in too many bootstrap samples; parameters change from
#: fold to fold.
REJECTION_RULES = ("search", "bound", "explained", "material", "draws")


@dataclass(frozen=True)
class Rejection:
    """Why a set of effects is not supported by the held-out records."""

    rule: str  # One of :data:`REJECTION_RULES`
    effect: str  # Effect that fails the rule; empty where it is the set as a whole
    text: str  # The reason with its numbers


@dataclass(frozen=True, eq=False)
class RankedSet:
    """One set of laws that was fitted."""

    effects: Effects  # Laws
    held_out_rms: float  # RMS that it leaves on held-out records, in the unit of the channels
    refused: str = ""  # Why the records do not support it; empty where they do


@dataclass(frozen=True, eq=False)
class Attribution:
    """Which effects explain the gap."""

    #: Named effects, the one that explains most first; for the verdict "aliased" the best member of
    #: each class
    effects: Effects
    #: Classes of effects that these records cannot tell apart, the named one first
    aliases: tuple[Effects, ...]
    #: Values by effect (``baseline`` too) and name
    parameters: Mapping[str, Mapping[str, NamedValue]]
    ranking: tuple[RankedSet, ...]  # Sets tried, best first
    #: The measurement that would tell aliased effects apart or show a silent one
    discriminating_experiment: str
    #: What the intervals of the parameters hold of the signals' gains, and what they take as it is
    #: read
    gains: str = ""
    #: Parameters that the records do not determine, in words, and the combination that they do
    undetermined: tuple[str, ...] = ()
    #: Values of effects that cannot be told from the named ones, each in the place of its rival
    alternatives: Mapping[str, Mapping[str, NamedValue]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class SelectionStep:
    """Held-out result after effects were added in turn."""

    added: str  # Effect that was added; ``baseline`` first
    rms: float  # RMS of the gap in the unit of the channels
    #: rho, rho_ci95: RMS over the baseline's, and its interval
    rho: float
    rho_ci95: Interval
    #: share, share_ci95: share of the gap above the floor that the effect takes beside those before
    #: it; shares of all steps add up to phi
    share: float = math.nan
    share_ci95: Interval = NO_INTERVAL
    #: RMS that the effect takes, by run; negative where it harms
    by_run: Mapping[str, float] = field(default_factory=dict)
    halves: Interval = NO_INTERVAL  # The same in the first and in the second half of the runs


@dataclass(frozen=True, eq=False)
class RunValidation:
    """Comparison error of a run, measured less simulated, and its uncertainty (ASME V&V 20)."""

    run: str  # Run
    #: error_before, error_after: RMS of E with the baseline and with the effects
    error_before: float
    error_after: float
    u_val: float  # Root of the squares of the numerical and the noise part


@dataclass(frozen=True, eq=False)
class BlockScore:
    """Held-out gap of the baseline in one block of a run."""

    #: run, condition: its run and that run's condition
    run: str
    condition: str
    block: int  # Number of the block in the run, from 0
    samples: int  # Samples that count, over all channels
    mean_square: float  # Mean square of a sample


@dataclass(frozen=True, eq=False)
class GapReduction:
    """How far the gap shrinks on held-out records."""

    #: rms_before, rms_after, noise_floor: RMS in the unit of the channels
    rms_before: float
    rms_after: float
    noise_floor: float
    #: rho, rho_ci95: RMS after over before
    rho: float
    rho_ci95: Interval
    #: phi, phi_ci95: share of the mean square above the floor that is explained
    phi: float
    phi_ci95: Interval
    floor_multiple: float  # RMS after over the floor
    #: rho in the condition with the largest gap, predicted from the others (NaN with one condition)
    extrapolation_rho: float
    steps: tuple[SelectionStep, ...]  # Accepted effects in turn
    #: cells_before, cells_after: gap map of the baseline and of the accepted model
    cells_before: Sequence[GapCell]
    cells_after: Sequence[GapCell]
    validation: tuple[RunValidation, ...]  # By run
    blocks: tuple[BlockScore, ...] = ()  # The baseline's held-out gap by block
