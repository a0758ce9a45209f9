"""Whether the 95 % intervals of carriers and mountings hold the truth, and how wide they are.

Cases of the blind check whose withheld effects, one, two or none, have the library's own equations.
The withheld effects are fitted beside the baseline, and what a diagnosis that names them publishes
is held against the truth: parameters of these laws, parameters of the baseline, and rho. How often
they are named is the blind check's question, not this one's; a set that the rules of a diagnosis
reject is not counted. Writes CASE.json for every case, which a later call takes up, and
intervals.md. A good answer: 90 to 99 % hold the truth.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Literal

import numpy as np

from carrierflex.blind_check.case_plans import case_plans
from carrierflex.blind_check.labels import NOTHING, PAIR, SINGLE, CasePlan
from carrierflex.blind_check.scoring.class_score import Hit
from carrierflex.blind_check.scoring.scoring import wilson
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.diagnosis.inference.gap_reduction import gap_reduction
from carrierflex.diagnosis.inference.law_fits import law_fits
from carrierflex.diagnosis.inference.named_values import published_values
from carrierflex.diagnosis.inference.thresholds import Thresholds
from carrierflex.diagnosis.kinds import problem_of
from carrierflex.files.json_files import save_json
from carrierflex.identification.estimation.single_thread import single_threaded
from carrierflex.workflows.executors import work_executor
from carrierflex.workflows.fe.default_curves import default_curves
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages
from studies.case_files import make_missing, read_case, write_table
from validation.law_coverage import RHO, covered_values, has_true_parameters


@dataclass(frozen=True)
class LawIntervals:
    """Intervals of one case; none where its set is rejected or a law is at another sensor."""

    hits: tuple[Hit, ...]


def main(
    *,
    out: Path,
    kind: Literal["carrier", "mounting"] = "carrier",
    seed: int = 1,
    cases: int = 100,
    without_effect: int = 10,
    workers: int = 1,
    quiet: bool = False,
) -> tuple[LawIntervals, ...]:
    """Fit the true laws of cases and count the intervals that hold the truth.

    Parameters
    ----------
    out : Path
        Folder for the cases and the table; cases that stand there are not done again.
    kind : str
        Kind of campaign.
    seed, cases : int
        Seed and size of the check that cases are taken from, of one effect, two or none; about half
        of a carrier's and a third of a mounting's have laws of the library's own equations.
    without_effect : int
        Cases with nothing missing at most.
    workers : int
        Processes.
    quiet : bool
        Show no progress.

    Returns
    -------
    tuple of LawIntervals
        Cases that were counted.
    """
    folder = prepared_folder(out)
    plans = _plans(kind, cases, seed, without_effect)
    files = [folder / f"{seed}-{plan.name}.json" for plan in plans]
    stages = Stages(1, quiet)
    with stages.stage("fitting cases"), work_executor(workers) as executor:
        make_missing(plans, files, _write_case, executor, stages)
    results = tuple(result for result in map(_read_case, files) if result.hits)
    write_table(folder / "intervals.md", _table(results))
    return results


def _plans(kind: str, cases: int, seed: int, without_effect: int) -> list[CasePlan]:
    """Cases that have true parameters, in the order of the check."""
    plans = case_plans(kind, cases, seed, (SINGLE, PAIR, NOTHING))
    omitted = [plan for plan in plans if plan.family == NOTHING][without_effect:]
    with_truth = [plan for plan in plans if has_true_parameters(kind, plan.effects)]
    return [plan for plan in with_truth if plan not in omitted]


def _write_case(plan: CasePlan, path: Path) -> None:
    campaign, label = case_campaign(plan)
    limits = Thresholds()
    with single_threaded():
        curves = default_curves() if plan.kind == "carrier" else None
        problem = problem_of(campaign, curves)
        search = law_fits(problem, limits)
        effects = tuple(sorted(label.effects))
        hits = []
        if not search.rejection(effects):
            far = gap_reduction(search, effects)
            fit = search.fit(effects)
            values = published_values(problem, fit, floor_ratio=limits.floor_ratio)
            hits = covered_values(label, values.parameters, far.rho_ci95)
    save_json(path, LawIntervals(tuple(hits)))


def _read_case(path: Path) -> LawIntervals:
    return read_case(
        path,
        "intervals of a case",
        lambda row: LawIntervals(tuple(Hit(**hit) for hit in row["hits"])),
    )


_ROWS: dict[str, Callable[[Hit], bool]] = {
    "baseline": lambda hit: hit.is_baseline and not hit.is_direction,
    "baseline, directions": lambda hit: hit.is_baseline and hit.is_direction,
    "withheld laws": lambda hit: not hit.is_baseline and not hit.is_direction and hit.name != RHO,
    "withheld laws, directions": lambda hit: not hit.is_baseline and hit.is_direction,
    "rho": lambda hit: hit.name == RHO,
}


def _table(results: Sequence[LawIntervals]) -> Iterator[str]:
    """Share of intervals that hold the truth; those of one case are not independent."""
    yield "| parameters | hold the truth | 95 % | intervals | cases | median half-width |"
    yield "|---|---|---|---|---|---|"
    for name, belongs in _ROWS.items():
        by_case = [[hit for hit in result.hits if belongs(hit)] for result in results]
        hits = [hit for case_hits in by_case for hit in case_hits]
        if not hits:
            continue
        inside = sum(hit.is_covered for hit in hits)
        low, high = wilson(inside, len(hits))
        width = median(hit.half_width for hit in hits)
        wide = f"{np.rad2deg(width):.2g}°" if hits[0].is_direction else f"{width:.1%}"
        n_cases = sum(map(bool, by_case))
        yield (
            f"| {name} | {inside / len(hits):.1%} | {low:.0%} to {high:.0%} | {len(hits)} "
            f"| {n_cases} | {wide} |"
        )


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)
