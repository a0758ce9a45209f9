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
    """A parameter's value with its 95 % interval.

    Parameters
    ----------
    value, std : float
        Value; half the width of its 95 % interval over 1.96.
    unit : str
        Unit of both.
    ci95 : tuple of float
        The interval; not numbers where nothing bounds it.
    sources : mapping of str to float
        Contribution to `std` of each source of error, ``noise``, ``load cell`` ...: their squares
        add up to its square.
    """

    value: float
    std: float
    unit: str
    ci95: Interval
    sources: Mapping[str, float] = field(default_factory=dict)


#: Rules of :class:`Rejection`: the search did not converge; a parameter is at its physical bound;
#: an effect explains too little of the gap left without it, or of the whole gap; the held-out gap
#: grows in too many bootstrap samples; declared errors and priors explain an effect's values.
REJECTION_RULES = ("search", "bound", "explained", "material", "draws", "absent")


@dataclass(frozen=True)
class Rejection:
    """Why a set of effects is not supported by the held-out records."""

    rule: str  # One of :data:`REJECTION_RULES`
    effect: str  # Effect that fails the rule; empty where it is the set as a whole
    text: str  # The reason with its numbers


@dataclass(frozen=True, eq=False)
class RankedSet:
    """One set of laws that was fitted.

    Parameters
    ----------
    effects : tuple of str
        Laws.
    held_out_rms : float
        RMS that it leaves on held-out records, in the unit of the channels.
    refused : str
        Why the records do not support it; empty where they do.
    """

    effects: Effects
    held_out_rms: float
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
    discriminating_experiment : str
        The measurement that would tell aliased effects apart or show a silent one.
    gains : str
        What the intervals of the parameters hold of the signals' gains, and what they take as it
        is read.
    undetermined : tuple of str
        Parameters that the records do not determine, in words, and the combination that they do.
    alternatives : mapping of str to mapping of str to NamedValue
        Values of effects that cannot be told from the named ones, each in the place of its rival.
    """

    effects: Effects
    aliases: tuple[Effects, ...]
    parameters: Mapping[str, Mapping[str, NamedValue]]
    ranking: tuple[RankedSet, ...]
    discriminating_experiment: str
    gains: str = ""
    undetermined: tuple[str, ...] = ()
    alternatives: Mapping[str, Mapping[str, NamedValue]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class SelectionStep:
    """Held-out result after effects were added in turn.

    Parameters
    ----------
    added : str
        Effect that was added; ``baseline`` first.
    rms : float
        RMS of the gap in the unit of the channels.
    rho, rho_ci95 : float, tuple of float
        RMS over the baseline's, and its interval.
    share, share_ci95 : float, tuple of float
        Share of the gap above the floor that the effect takes beside those before it; shares of all
        steps add up to phi.
    by_run : mapping of str to float
        RMS that the effect takes, by run; negative where it harms.
    halves : tuple of float
        The same in the first and in the second half of the runs.
    """

    added: str
    rms: float
    rho: float
    rho_ci95: Interval
    share: float = math.nan
    share_ci95: Interval = NO_INTERVAL
    by_run: Mapping[str, float] = field(default_factory=dict)
    halves: Interval = NO_INTERVAL


@dataclass(frozen=True, eq=False)
class RunValidation:
    """Comparison error of a run, measured less simulated, and its uncertainty (ASME V&V 20).

    Parameters
    ----------
    run : str
        Run.
    error_before, error_after : float
        RMS of E with the baseline and with the effects.
    u_val : float
        Root of the squares of the numerical and the noise part.
    """

    run: str
    error_before: float
    error_after: float
    u_val: float


@dataclass(frozen=True, eq=False)
class BlockScore:
    """Held-out gap of the baseline in one block of a run.

    Parameters
    ----------
    run, condition : str
        Its run and that run's condition.
    block : int
        Number of the block in the run, from 0.
    samples : int
        Samples that count, over all channels.
    mean_square : float
        Mean square of a sample.
    """

    run: str
    condition: str
    block: int
    samples: int
    mean_square: float


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
    extrapolation_rho : float
        rho in the condition with the largest gap, predicted from the others (NaN with one
        condition).
    steps : tuple of SelectionStep
        Accepted effects in turn.
    cells_before, cells_after : tuple of GapCell
        Gap map of the baseline and of the accepted model.
    validation : tuple of RunValidation
        By run.
    blocks : tuple of BlockScore
        The baseline's held-out gap by block.
    """

    rms_before: float
    rms_after: float
    noise_floor: float
    rho: float
    rho_ci95: Interval
    phi: float
    phi_ci95: Interval
    floor_multiple: float
    extrapolation_rho: float
    steps: tuple[SelectionStep, ...]
    cells_before: Sequence[GapCell]
    cells_after: Sequence[GapCell]
    validation: tuple[RunValidation, ...]
    blocks: tuple[BlockScore, ...] = ()
