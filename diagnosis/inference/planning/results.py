"""What a plan says: smallest sizes, causes that look alike, additions in their order."""

from collections.abc import Mapping
from dataclasses import dataclass

#: How an addition is made: a sensor more, runs under other loads, longer runs.
SENSOR = "sensor"
LOADS = "load_case"
MINUTES = "minutes"
#: What becomes of a pair: told apart as planned, by what can be added, or by nothing feasible.
PARTED = "parted"
ALIKE = "alike"
NEVER = "never"


@dataclass(frozen=True)
class Costs:
    """What an addition costs, in minutes on the rig that could be had instead.

    Parameters
    ----------
    sensor : float
        One more sensor: bracket, cable, calibration and check, half a working day (assumed).
    load_case : float
        One more load case beside its own length: change of load, settling of the oil's temperature,
        zero before and after (assumed).
    minute : float
        A minute of record.
    """

    sensor: float = 240.0
    load_case: float = 15.0
    minute: float = 1.0


@dataclass(frozen=True)
class RigLimits:
    """What the rig can do.

    Parameters
    ----------
    torque : float
        Largest torque [N m].
    radial_load : float
        Largest radial load [N].
    sensor_angles : tuple of float
        Housing angles at which a sensor can stand [rad]; every 30 degrees where empty.
    """

    torque: float = 4.0e5
    radial_load: float = 2.0e5
    sensor_angles: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False)
class Addition:
    """Something that could be added to a campaign.

    Parameters
    ----------
    kind : str
        SENSOR, LOADS or MINUTES.
    text : str
        What it is, in words.
    minutes : mapping of str to float
        Length of every run of the enlarged campaign, over that in the table.
    channels : tuple of str
        Channels of the enlarged campaign.
    cost : float
        Minutes on the rig.
    """

    kind: str
    text: str
    minutes: Mapping[str, float]
    channels: tuple[str, ...]
    cost: float


@dataclass(frozen=True)
class VisibleSize:
    """From which size a cause is seen.

    Parameters
    ----------
    effect : str
        Effect id.
    parameter, unit : str
        Its first amplitude; the others are of like share of their own scales.
    noticeable : float
        Size of it that is worth noticing, as the library states it [unit].
    seen_from : float
        Size from which the held-out gap shrinks in 97.5 % of draws, by noise alone [unit]; infinite
        where the baseline takes up all of it.
    named_from : float
        Size from which the gap clears the diagnosis's noise floor rule too [unit].
    gap_seen, gap_named : float
        RMS of the gap at these sizes, in floors of noise.
    sigmas : float
        Standard deviations that a signature of as many amplitudes must reach.
    surviving : float
        Share of the signature that the baseline leaves.
    """

    effect: str
    parameter: str
    unit: str
    noticeable: float
    seen_from: float
    named_from: float
    gap_seen: float
    gap_named: float
    sigmas: float
    surviving: float


@dataclass(frozen=True)
class CausePair:
    """How far a cause and another that is fitted in its place are apart.

    Parameters
    ----------
    cause, rival : str
        Effect that acts, and effect that is fitted.
    angle_deg : float
        Smallest angle between their signatures beside the baseline, of the median shape of the
        cause [deg].
    left : float
        RMS that the rival leaves of the cause's gap, in floors of noise.
    parted_from : float
        Gap of the cause, in floors, from which the rival leaves enough to be told; infinite where
        it leaves nothing.
    state : str
        PARTED, ALIKE or NEVER.
    """

    cause: str
    rival: str
    angle_deg: float
    left: float
    parted_from: float
    state: str


@dataclass(frozen=True, eq=False)
class RankedAddition:
    """An addition and what it brings.

    Parameters
    ----------
    addition : Addition
        What is added.
    least_left : float
        RMS that a rival leaves at least, over the pairs that are alike as planned, in floors of the
        noise.
    mean_left : float
        Geometric mean of the same over these pairs: of additions that cost as much the largest one
        comes first, whose weight does not hang on the one pair that is parted least.
    distance : float
        Mahalanobis distance of the least parted pair.
    information : float
        Expected logarithm of the odds for the true cause in that pair, ``d² / 2`` [nat].
    per_cost : float
        The same over the cost [nat/min].
    parted : tuple of (str, str)
        Pairs it parts, cause and rival.
    is_sufficient : bool
        Whether it parts every pair that something feasible parts.
    """

    addition: Addition
    least_left: float
    mean_left: float
    distance: float
    information: float
    per_cost: float
    parted: tuple[tuple[str, str], ...]
    is_sufficient: bool


@dataclass(frozen=True, eq=False)
class CampaignPlan:
    """What a campaign could see and part, and what to add.

    Parameters
    ----------
    campaign, kind : str
        Name and kind.
    unit : str
        Unit of the channels.
    gap : float
        Gap in floors at which causes are to be told apart.
    noise_std : float
        Floor: root of the mean variance of the noise [unit].
    is_measured : bool
        Whether records say which amplitudes each cause would have; otherwise the ones that another
        cause imitates best are taken.
    left_wanted : float
        RMS that a rival must leave, in floors.
    sizes : tuple of VisibleSize
        By effect.
    pairs : tuple of CausePair
        Every cause with every rival.
    additions : tuple of RankedAddition
        Cheapest sufficient first, then those that part most for their cost.
    costs : Costs
        What additions cost.
    """

    campaign: str
    kind: str
    unit: str
    gap: float
    noise_std: float
    is_measured: bool
    left_wanted: float
    sizes: tuple[VisibleSize, ...]
    pairs: tuple[CausePair, ...]
    additions: tuple[RankedAddition, ...]
    costs: Costs

    @property
    def alike(self) -> tuple[CausePair, ...]:
        """Pairs that are alike as planned and that something feasible parts."""
        return tuple(pair for pair in self.pairs if pair.state == ALIKE)

    @property
    def proposal(self) -> RankedAddition | None:
        """First proposal; None where nothing is alike, or nothing feasible parts it."""
        return self.additions[0] if self.alike and self.additions else None
