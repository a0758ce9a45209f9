"""What a plan says: smallest sizes, causes that look alike, additions in their order."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

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
    """What an addition costs, in minutes on the rig that could be had instead."""

    sensor: Annotated[float, "One more sensor: bracket, cable, calibration (assumed)"] = 240.0
    load_case: Annotated[
        float, "One more load case beside its length: settling, zeros (assumed)"
    ] = 15.0
    minute: Annotated[float, "A minute of record"] = 1.0


@dataclass(frozen=True)
class RigLimits:
    """What the rig can do."""

    torque: Annotated[float, "Largest torque [N m]"] = 4.0e5
    radial_load: Annotated[float, "Largest radial load [N]"] = 2.0e5
    sensor_angles: Annotated[
        tuple[float, ...], "Housing angles for sensors [rad]; every 30 degrees where empty"
    ] = ()


@dataclass(frozen=True, eq=False)
class Addition:
    """Something that could be added to a campaign."""

    kind: Annotated[str, "SENSOR, LOADS or MINUTES"]
    text: Annotated[str, "What it is, in words"]
    minutes: Annotated[
        Mapping[str, float], "Length of every run of the enlarged campaign, over that in the table"
    ]
    channels: Annotated[tuple[str, ...], "Channels of the enlarged campaign"]
    cost: Annotated[float, "Minutes on the rig"]


@dataclass(frozen=True)
class VisibleSize:
    """From which size a cause is seen."""

    effect: Annotated[str, "Effect id"]
    parameter: Annotated[str, "Its first amplitude; the others grow alike, each by its scale"]
    unit: Annotated[str, "Unit of that"]
    noticeable: Annotated[float, "Size of it worth noticing, as the library states it [unit]"]
    seen_from: Annotated[
        float,
        "Size from which the held-out gap shrinks in 97.5 % of draws, by noise alone [unit]; "
        "infinite where the baseline takes up all of it",
    ]
    named_from: Annotated[
        float, "Size from which the gap clears the rule of the noise floor too [unit]"
    ]
    gap_seen: Annotated[float, "RMS of the gap at `seen_from`, in floors of noise"]
    gap_named: Annotated[float, "RMS of the gap at `named_from`, in floors of noise"]
    sigmas: Annotated[float, "Standard deviations that a signature of as many amplitudes needs"]
    surviving: Annotated[float, "Share of the signature that the baseline leaves"]


@dataclass(frozen=True)
class CausePair:
    """How far a cause and another that is fitted in its place are apart."""

    cause: Annotated[str, "Effect that acts"]
    rival: Annotated[str, "Effect that is fitted"]
    angle_deg: Annotated[
        float,
        "Smallest angle between the signatures beside the baseline, of the median shape [deg]",
    ]
    left: Annotated[float, "RMS that the rival leaves of the cause's gap, in floors of noise"]
    parted_from: Annotated[
        float, "Gap of the cause, in floors, from which it is told from the rival; infinite: never"
    ]
    state: Annotated[str, "PARTED, ALIKE or NEVER"]


@dataclass(frozen=True, eq=False)
class RankedAddition:
    """An addition and what it brings."""

    addition: Annotated[Addition, "What is added"]
    least_left: Annotated[
        float, "RMS that a rival leaves at least of the pairs alike as planned, in floors"
    ]
    mean_left: Annotated[
        float, "Geometric mean of the same: of equal costs the largest comes first"
    ]
    distance: Annotated[float, "Mahalanobis distance of the least parted pair"]
    information: Annotated[
        float, "Expected log odds for the true cause in that pair, ``d² / 2`` [nat]"
    ]
    per_cost: Annotated[float, "The same over the cost [nat/min]"]
    parted: Annotated[tuple[tuple[str, str], ...], "Pairs it parts, cause and rival"]
    is_sufficient: Annotated[bool, "Whether it parts every pair that something feasible parts"]


@dataclass(frozen=True, eq=False)
class CampaignPlan:
    """What a campaign could see and part, and what to add."""

    campaign: Annotated[str, "Name of the case or campaign"]
    kind: Annotated[str, "Kind of the campaign"]
    unit: Annotated[str, "Unit of the channels"]
    gap: Annotated[float, "Gap in floors at which causes are to be told apart"]
    noise_std: Annotated[float, "Floor: root of the mean variance of the noise [unit]"]
    is_measured: Annotated[
        bool,
        "Whether records say which amplitudes a cause has; else those that another imitates best",
    ]
    left_wanted: Annotated[float, "RMS that a rival must leave, in floors"]
    sizes: Annotated[tuple[VisibleSize, ...], "Size from which each cause is seen; infinite: never"]
    pairs: Annotated[tuple[CausePair, ...], "Every cause with every rival"]
    additions: Annotated[
        tuple[RankedAddition, ...], "Cheapest sufficient first, then most parted for their cost"
    ]
    costs: Annotated[Costs, "What additions cost [min]"]

    @property
    def alike(self) -> tuple[CausePair, ...]:
        """Pairs that are alike as planned and that something feasible parts."""
        return tuple(pair for pair in self.pairs if pair.state == ALIKE)

    @property
    def proposal(self) -> RankedAddition | None:
        """First proposal; None where nothing is alike, or nothing feasible parts it."""
        return self.additions[0] if self.alike and self.additions else None
