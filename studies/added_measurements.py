"""Whether the measurement that a plan proposes parts causes that a campaign leaves alike.

Cases of the family "aliased" in a new draw; only those count whose own diagnosis does not name the
true cause alone. The proposal is measured on the same machine by the truth's own simulator.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from carrierflex.blind_check.labels import ALIASED, CasePlan, Label
from carrierflex.blind_check.truth.alias_table import CONSTANT_LOAD
from carrierflex.blind_check.truth.carrier.rig import AddedRun
from carrierflex.blind_check.truth.carrier.truth import carrier_case
from carrierflex.blind_check.truth.mounting.loads import MountingRecord, asked_record
from carrierflex.blind_check.truth.mounting.truth import mounting_case
from carrierflex.diagnosis.carrier.planned import CarrierPool
from carrierflex.diagnosis.inference.planning.results import Addition
from carrierflex.diagnosis.inference.results import NAMED, NAMED_WITH_REMAINDER
from carrierflex.diagnosis.mounting.planned import MountingPool
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.identification.campaign.campaign import Campaign

#: Causes by kind that one load, or a single record, leaves alike.
_CAUSES: Mapping[str, tuple[str, ...]] = {
    "carrier": CONSTANT_LOAD["carrier"],
    "mounting": ("cubic_stiffness", "quintic_stiffness"),
}
#: Causes of which another is a limit, whatever is measured: a clearance that is closed from the
#: start is no clearance, and the simpler cause is named.
LIMITING_CAUSES: Mapping[str, tuple[str, ...]] = {"stiff_pins": ("pin_clearance",)}


@dataclass(frozen=True)
class Answer:
    """What a diagnosis says of a case's cause.

    Parameters
    ----------
    verdict : str
        Verdict.
    effects : tuple of str
        Named effects.
    aliases : tuple of str
        Effects listed as alike with the true cause.
    is_right : bool
        Whether the true cause is named, and nothing that is not there.
    is_alone : bool
        Whether besides nothing is alike with it, but what holds it as a limit.
    """

    verdict: str
    effects: tuple[str, ...]
    aliases: tuple[str, ...]
    is_right: bool
    is_alone: bool


@dataclass(frozen=True)
class AdditionOutcome:
    """A case before and after the proposed measurement.

    Parameters
    ----------
    case, effect : str
        Name of the case, withheld cause.
    gap : float
        Its gap over the floor in the campaign as given.
    before : Answer
        Diagnosis of the campaign as given.
    proposal : str
        First proposal in words; empty where there is none.
    cost : float
        Its cost [min].
    is_sufficient : bool
        Whether the plan expects it to distinguish every pair.
    after : Answer or None
        Diagnosis with the proposed runs; None where there is no proposal of runs.
    """

    case: str
    effect: str
    gap: float
    before: Answer
    proposal: str = ""
    cost: float = 0.0
    is_sufficient: bool = False
    after: Answer | None = None

    @property
    def is_separated(self) -> bool:
        """Whether the true cause is named alone after the addition."""
        return self.after is not None and self.after.is_alone


def alias_case(
    seed: int, number: int, gaps: tuple[float, float], *, kind: str = "carrier"
) -> CasePlan:
    """One case of the draw: a carrier at one load, a mounting with a single record.

    Parameters
    ----------
    seed, number : int
        Seed of the draw and number in it, from 1.
    gaps : tuple of float
        Smallest and largest gap over the floor; uniform in its logarithm.
    kind : str
        Carrier or mounting.
    """
    rng = np.random.default_rng([seed, number])
    names = _CAUSES[kind]
    gap = float(gaps[0] * (gaps[1] / gaps[0]) ** rng.uniform())
    return CasePlan(kind, number, seed, ALIASED, (names[number % len(names)],), gap)


def answer_of(diagnosis: Diagnosis, label: Label) -> Answer:
    """Answer of a diagnosis, judged against the label of a single cause."""
    (cause,) = label.effects
    effects = diagnosis.attribution.effects
    named = diagnosis.verdict in (NAMED, NAMED_WITH_REMAINDER)
    is_right = named and cause in effects and set(effects) - {cause} <= set(label.present)
    members = {
        name for group in diagnosis.attribution.aliases if cause in group for name in group
    } - {cause}
    is_alone = is_right and members <= set(LIMITING_CAUSES.get(cause, ()))
    return Answer(diagnosis.verdict, effects, tuple(sorted(members)), is_right, is_alone)


def enlarged_case(
    case: CasePlan, addition: Addition, pool: CarrierPool | MountingPool, planned: int
) -> Campaign | None:
    """Campaign of a case with what a proposal adds, measured on the same machine.

    Parameters
    ----------
    case : CasePlan
        Case.
    addition : Addition
        What is proposed.
    pool : CarrierPool or MountingPool
        Planned runs and those that could be added.
    planned : int
        How many runs were planned.

    Returns
    -------
    Campaign or None
        None where it is a sensor more, or longer runs: the truth's simulator adds runs alone.
    """
    if isinstance(pool, CarrierPool):
        runs = added_runs(pool.campaign, addition.minutes, planned)
        return carrier_case(case, added=runs)[0] if runs else None
    records = added_records(pool, addition.minutes)
    return mounting_case(case, added=records)[0] if records else None


def added_records(pool: MountingPool, minutes: Mapping[str, float]) -> tuple[MountingRecord, ...]:
    """Records of a mounting that a proposal adds, as the truth makes them.

    Parameters
    ----------
    pool : MountingPool
        Planned records and those that could be added.
    minutes : mapping of str to float
        Length of every record over that in the pool.
    """
    return tuple(
        asked_record(
            record.name,
            record.inputs.time,
            np.array([record.inputs.torque, record.inputs.ntl_y, record.inputs.ntl_z]).T,
        )
        for record in pool.records[pool.n_planned :]
        if record.name in minutes
    )


def added_runs(pool: Campaign, minutes: Mapping[str, float], planned: int) -> tuple[AddedRun, ...]:
    """Runs that a proposal adds, as the truth makes them.

    Parameters
    ----------
    pool : Campaign
        Planned runs and those that could be added.
    minutes : mapping of str to float
        Length of every run over that in the pool.
    planned : int
        How many runs were planned.
    """
    nominal = float(pool.rig["nominal_torque"])
    added = []
    for run in pool.runs[planned:]:
        if run.name not in minutes:
            continue
        seconds = float(run.time[-1] - run.time[0])
        angle = run.inputs["carrier_angle"]
        added.append(
            AddedRun(
                float(run.inputs["torque"][0]) / nominal,
                float(run.inputs["ntl_y"][0]),
                float(run.inputs["ntl_z"][0]),
                float(angle[-1] - angle[0]) / seconds,
                minutes[run.name] * seconds,
            )
        )
    return tuple(added)
