"""Whether the 95 % intervals of an element's parameters hold the truth, and how wide they are.

Cases of the blind check whose parameters have true values: nothing missing, or causes of the
library in textbook form. Each is diagnosed with the search for laws; right answers count. Writes
CASE.json for every case, which a later call takes up, and intervals.md. A good answer: 90 to 99 %
hold the truth; parameters that the records do not determine are said to be so, and are few.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from carrierflex.blind_check.case_plans import case_plans
from carrierflex.blind_check.labels import NOTHING, OUTSIDE, CasePlan
from carrierflex.blind_check.scoring.class_judging import judge_by_class
from carrierflex.blind_check.scoring.class_score import Hit, covered_parameters
from carrierflex.blind_check.scoring.scoring import wilson
from carrierflex.blind_check.sealing.verdicts import Verdict
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.blind_check.truth.element.families import CAUSES
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.kinds import problem_of
from carrierflex.diagnosis.report.diagnosis_files import diagnosis_document
from carrierflex.files.json_files import save_json
from carrierflex.identification.estimation.single_thread import single_threaded
from carrierflex.workflows.executors import work_executor
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages
from studies.case_files import make_missing, read_case, write_table

_KIND = "element"


@dataclass(frozen=True)
class CaseIntervals:
    """Intervals of one case; `unknown` are its parameters that are said not to be determined."""

    hits: tuple[Hit, ...]
    unknown: tuple[str, ...]


def main(
    *,
    out: Path,
    seed: int = 1,
    cases: int = 200,
    without_effect: int = 30,
    workers: int = 1,
    quiet: bool = False,
) -> tuple[CaseIntervals, ...]:
    """Diagnose cases whose parameters are known and count the intervals that hold them.

    Parameters
    ----------
    out : Path
        Folder for the cases and the table; cases that stand there are not done again.
    seed, cases : int
        Seed and size of the check that cases are taken from; about one in ten has true parameters.
    without_effect : int
        Cases with nothing missing at most.
    workers : int
        Processes.
    quiet : bool
        Show no progress.

    Returns
    -------
    tuple of CaseIntervals
        Cases that have true parameters.
    """
    folder = prepared_folder(out)
    plans = _plans(cases, seed, without_effect)
    files = [folder / f"{seed}-{plan.name}.json" for plan in plans]
    stages = Stages(1, quiet)
    with stages.stage("diagnosing cases"), work_executor(workers) as executor:
        make_missing(plans, files, _write_case, executor, stages)
    results = tuple(_read_case(file) for file in files)
    write_table(folder / "intervals.md", _table(results))
    return tuple(result for result in results if result.hits or result.unknown)


def _plans(cases: int, seed: int, without_effect: int) -> list[CasePlan]:
    """Cases that may have true parameters."""
    plans = case_plans(_KIND, cases, seed)
    nothing = [plan for plan in plans if plan.family == NOTHING][:without_effect]
    of_library = [
        plan
        for plan in plans
        if plan.family not in (NOTHING, OUTSIDE)
        and all(CAUSES[name].library for name in plan.effects)
    ]
    return [*nothing, *of_library]


def _write_case(plan: CasePlan, path: Path) -> None:
    campaign, label = case_campaign(plan)
    result = CaseIntervals((), ())
    if label.parameters:  # in textbook form
        with single_threaded():
            problem = problem_of(campaign)
            diagnosis = diagnose(
                problem,
                campaign=campaign.name,
                kind=_KIND,
                floor_is_measured=problem.noise_is_measured,
            )
        document = diagnosis_document(diagnosis)
        hits = covered_parameters(judge_by_class(label, Verdict(document, 0.0)))
        unknown = tuple(
            f"{effect}.{name}"
            for effect, values in label.parameters.items()
            for name in values
            if (document["parameters"].get(effect, {}).get(name) or {"std": 0.0})["std"] is None
        )
        result = CaseIntervals(tuple(hits), unknown)
    save_json(path, result)


def _read_case(path: Path) -> CaseIntervals:
    return read_case(
        path,
        "intervals of a case",
        lambda row: CaseIntervals(tuple(Hit(**hit) for hit in row["hits"]), tuple(row["unknown"])),
    )


def _table(results: Sequence[CaseIntervals]) -> Iterator[str]:
    yield "| parameters | intervals | hold the truth | 95 % | median half-width | not determined |"
    yield "|---|---|---|---|---|---|"
    for name, of_baseline in (("m and K1", True), ("textbook laws", False)):
        hits = [hit for result in results for hit in result.hits if hit.is_baseline is of_baseline]
        unknown = [
            name
            for result in results
            for name in result.unknown
            if name.startswith("baseline.") is of_baseline
        ]
        if hits:
            inside = sum(hit.is_covered for hit in hits)
            low, high = wilson(inside, len(hits))
            width = median(hit.half_width for hit in hits)
            yield (
                f"| {name} | {len(hits)} | {inside / len(hits):.1%} | {low:.0%} to {high:.0%} "
                f"| {width:.1%} | {len(unknown)} |"
            )


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)
