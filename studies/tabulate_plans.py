"""How often the measurement that a plan proposes parts causes that a campaign leaves alike.

Draws carrier campaigns at one load, or mountings with a single record, whose cause passes for
another, plans, measures the first proposal on the same machine and diagnoses the enlarged campaign.
Writes KIND-SEED-NUMBER.json for every case, which a later call takes up, and plans.md. A good
answer: at least nine of ten parted, Wilson's interval beside it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import Any, Literal

import numpy as np

from carrierflex.blind_check.labels import ALIASED, CasePlan, Label
from carrierflex.blind_check.scoring.scoring import wilson
from carrierflex.blind_check.truth.alias_table import CONSTANT_LOAD
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.blind_check.truth.carrier.rig import AddedRun
from carrierflex.blind_check.truth.carrier.truth import carrier_case
from carrierflex.blind_check.truth.mounting.loads import MountingRecord, asked_record
from carrierflex.blind_check.truth.mounting.truth import mounting_case
from carrierflex.diagnosis.carrier.planned import CarrierPool
from carrierflex.diagnosis.inference.planning.results import Addition
from carrierflex.diagnosis.inference.results import NAMED, NAMED_WITH_REMAINDER
from carrierflex.diagnosis.mounting.planned import MountingPool
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.files.json_files import save_json
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.estimation.single_thread import single_threaded
from carrierflex.workflows.diagnosis.examination import examined
from carrierflex.workflows.diagnosis.plan_campaign import PlanSettings, plan_of
from carrierflex.workflows.executors import work_executor
from carrierflex.workflows.fe.default_curves import default_curves
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages
from studies.case_files import read_case, write_table

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
    """One case of the draw: a carrier at one load, a mounting with a single record."""
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
    """Campaign of a case with what a proposal adds, measured on the same machine."""
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


#: Cases drawn at most for every one that counts.
_MOST_DRAWN = 20


def main(
    *,
    out: Path,
    kind: Literal["carrier", "mounting"] = "carrier",
    seed: int = 1,
    cases: int = 24,
    least_gap: float = 0.6,
    largest_gap: float = 3.0,
    workers: int = 1,
    quiet: bool = False,
) -> tuple[AdditionOutcome, ...]:
    """Try the first proposal of a plan on cases whose cause passes for another.

    Parameters
    ----------
    out : Path
        Folder for the outcomes and the table; cases that stand there are not done again.
    kind : str
        Carrier or mounting.
    seed : int
        Seed of the draw.
    cases : int
        Cases that count.
    least_gap, largest_gap : float
        Range of the gap over the floor in the campaign as given.
    workers : int
        Processes.
    quiet : bool
        Show no progress.

    Returns
    -------
    tuple of AdditionOutcome
        The cases that count, in the order of the draw.
    """
    folder = prepared_folder(out)
    counted: list[AdditionOutcome] = []
    drawn = 0
    stages = Stages(1, quiet)
    with stages.stage("planning, measuring and diagnosing"), work_executor(workers) as executor:
        numbers = count(1)
        # Of large gaps the records tell nearly all causes apart by themselves.
        while len(counted) < cases and drawn < _MOST_DRAWN * cases:
            batch = [next(numbers) for _ in range(max(1, workers))]
            tasks = [
                executor.submit(_outcome_in, folder, kind, seed, number, (least_gap, largest_gap))
                for number in batch
            ]
            for task in tasks:
                outcome = task.result()
                drawn += len(counted) < cases
                if not outcome.before.is_alone and len(counted) < cases:
                    counted.append(outcome)
            stages.note(f"{len(counted)} of {cases} cases, {drawn} drawn")
    write_table(folder / "plans.md", _table(counted, drawn))
    return tuple(counted)


def _outcome_in(
    folder: Path, kind: str, seed: int, number: int, gaps: tuple[float, float]
) -> AdditionOutcome:
    """Outcome of one case, from its file where there is one."""
    path = folder / f"{kind}-{seed}-{number:03d}.json"
    if not path.is_file():
        with single_threaded():
            save_json(path, addition_outcome(seed, number, gaps, kind=kind))
    return read_case(path, "the outcome of a case", _outcome_of)


def _outcome_of(row: dict[str, Any]) -> AdditionOutcome:
    """Outcome of the content of its file."""
    before, after = _answer(row.pop("before")), row.pop("after")
    outcome = AdditionOutcome(**row, before=before)
    return replace(outcome, after=_answer(after) if after is not None else None)


def _answer(row: dict[str, Any]) -> Answer:
    return Answer(**{**row, "effects": tuple(row["effects"]), "aliases": tuple(row["aliases"])})


def addition_outcome(
    seed: int, number: int, gaps: tuple[float, float], *, kind: str = "carrier"
) -> AdditionOutcome:
    """One case before and after the first proposal.

    Parameters
    ----------
    seed, number : int
        Seed of the draw and number in it.
    gaps : tuple of float
        Smallest and largest gap over the floor.
    kind : str
        Carrier or mounting.
    """
    case = alias_case(seed, number, gaps, kind=kind)
    curves = default_curves() if kind == "carrier" else None
    given, label = case_campaign(case)
    before = answer_of(examined(given, curves).diagnosis(), label)
    outcome = AdditionOutcome(case.name, case.effects[0], label.gap_over_floor, before)
    if before.is_alone:
        return outcome
    planned = plan_of(given, curves, PlanSettings(), is_measured=True)
    proposal = planned.plan.proposal
    if proposal is None:
        return outcome
    addition = proposal.addition
    proposed = replace(
        outcome,
        proposal=addition.text,
        cost=addition.cost,
        is_sufficient=proposal.is_sufficient,
    )
    enlarged = enlarged_case(case, addition, planned.pool, len(given.runs))
    if enlarged is None:
        return proposed
    return replace(proposed, after=answer_of(examined(enlarged, curves).diagnosis(), label))


def _table(outcomes: Sequence[AdditionOutcome], drawn: int) -> Iterator[str]:
    yield "| case | cause | gap | before | alike | proposal | min | after | alike | parted |"
    yield "|---|---|---|---|---|---|---|---|---|---|"
    for outcome in outcomes:
        after = outcome.after
        cells = (
            outcome.case,
            outcome.effect,
            f"{outcome.gap:.1f}",
            _named(outcome.before),
            ", ".join(outcome.before.aliases) or "-",
            outcome.proposal or "none",
            f"{outcome.cost:.0f}",
            _named(after) if after is not None else "-",
            ", ".join(after.aliases) or "-" if after is not None else "-",
            "yes" if outcome.is_separated else "no",
        )
        yield f"| {' | '.join(cells)} |"
    yield ""
    for words, hits in (
        ("true cause alone before", sum(outcome.before.is_alone for outcome in outcomes)),
        ("true cause named before, alike with others or not",
         sum(outcome.before.is_right for outcome in outcomes)),
        ("true cause alone after the first proposal",
         sum(outcome.is_separated for outcome in outcomes)),
        ("true cause named after it, alike with others or not",
         sum(outcome.after is not None and outcome.after.is_right for outcome in outcomes)),
    ):  # fmt: skip
        low, high = wilson(hits, len(outcomes))
        yield f"- {words}: {hits} of {len(outcomes)} (95 %: {low:.0%} to {high:.0%})"
    yield f"- cases drawn until so many passed for another: {drawn}"


def _named(answer: Answer) -> str:
    return f"{answer.verdict}: {', '.join(answer.effects) or 'nothing'}"


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)
