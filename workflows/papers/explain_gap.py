"""Which unmodelled effect explains tables 4 and 5 of the 2012 paper, by a posterior.

Hypotheses on what turns once a revolution, on what the sensors are mounted on, on the unpublished
supports and on the static saddle are put into the statics of the stage and compared with everything
published of this gearbox family. A good answer: an order of hypotheses that does not change with
the assumed errors and priors, or the words "not decided" and the measurement that would decide.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from carrierflex.files.json_files import save_json, save_text
from carrierflex.files.versions import versions
from carrierflex.workflows.executors import check_workers, work_executor
from carrierflex.workflows.outputs import prepared_folder, save_figure
from carrierflex.workflows.papers.gap_rows import PapersGap
from carrierflex.workflows.progress import Stages

if TYPE_CHECKING:
    from carrierflex.simulation.stage.stage_body import StageBody
    from carrierflex.workflows.papers.gap_posterior import Comparison, Run, Samples

#: Bending stiffness of a pin interface that meets the rim deflection of table 4 [N m/rad].
PIN_FIT = 1.7e7
#: Samples of a posterior at which the condensed statics are checked against the stage's.
_N_CHECKED = 4
PAGE_FILE, RESULT_FILE, PICTURE_FILE = "papers_gap.html", "papers_gap.json", "papers_gap.png"


@dataclass(frozen=True)
class Task:
    """A run of a sampler: what is computed, and the file of the result."""

    run: Run
    method: str
    seed: int
    size: float
    starts: int

    @property
    def file(self) -> str:
        """Name of its file."""
        return f"{self.method}-{self.run.file}"

    @property
    def inputs(self) -> dict[str, Any]:
        """What the file must have been made with."""
        return {
            "method": self.method,
            "size": self.size,
            "seed": self.seed,
            "starts": self.starts,
            "parameters": list(self.run.hypothesis.priors),
        }


def main(
    *,
    out: Path,
    method: Literal["laplace", "nested"] = "laplace",
    starts: int = 10,
    check: bool = True,
    size: float = 0.045,
    seed: int = 2012,
    workers: int = 1,
    quiet: bool = False,
) -> PapersGap:
    """Find which unmodelled effect explains tables 4 and 5 of the 2012 paper.

    Fourteen hypotheses, amplitudes with errors of 3, 6 and 15 um, widths of the priors 0.5, 1, 2:
    evidence, predictions, next measurement. About ten minutes on one core.

    Parameters
    ----------
    out
        Folder to write: papers_gap.html, papers_gap.json, papers_gap.png, and under runs/ a file
        a hypothesis and width; a stopped command continues from these files.
    method
        How the evidence is computed: laplace (Laplace's approximation) or nested
        (nested sampling, about an hour; pip install 'carrierflex[papers]').
    starts
        Starting points of each search for the most probable values; with few of them a hypothesis
        may look worse than it is.
    check
        Check Laplace's approximation by nested sampling, where dynesty is installed.
    size
        Element edge length [m] of carrier and pins.
    seed
        Seed of the random numbers.
    workers
        Processes for the posteriors; 1: in this process.
    quiet
        Show no progress.

    Raises
    ------
    ImportError
        With the method nested, where dynesty is not installed.
    ValueError
        Where there are no starts, or a file under ``runs`` was made with other options.
    """
    check_workers(workers)
    has_dynesty = find_spec("dynesty") is not None
    if starts < 1:
        raise ValueError(f"--starts is {starts}; expected 1 or more")
    if method == "nested" and not has_dynesty:
        raise ImportError("--method nested needs dynesty (pip install 'carrierflex[papers]')")
    folder, stages = prepared_folder(out), Stages(3, quiet)

    from carrierflex.workflows.papers.gap_posterior import RUNS, comparison
    from carrierflex.workflows.simulation.stage_bodies import default_stage_body

    (folder / "runs").mkdir(exist_ok=True)
    with stages.stage(f"reduced carrier and pins, elements of {size} m"):
        body = default_stage_body(PIN_FIT, size)
        compare = comparison(body)
    tasks = [Task(run, method, seed, size, starts) for run in RUNS]
    if method == "laplace" and check and has_dynesty:
        tasks += [Task(run, "nested", seed, size, starts) for run in RUNS if _is_compared(run)]
    with stages.stage(f"{len(tasks)} posteriors"):
        samples = _samples(tasks, folder / "runs", compare, workers, stages)
    with stages.stage(f"writing {out}"):
        gap = _gap(method, body, compare, samples, seed)
        _write(folder, gap, {"method": method, "starts": starts, "size": size, "seed": seed})
    return gap


def _is_compared(run: Run) -> bool:
    """Whether a run is of a hypothesis whose predictions are shown, with the table's priors."""
    from carrierflex.workflows.papers.gap_posterior import COMPARED

    return run.width == 1.0 and run.hypothesis.name in COMPARED


def _samples(
    tasks: list[Task], folder: Path, compare: Comparison, workers: int, stages: Stages
) -> dict[Task, Samples]:
    """Results of all tasks; those whose file is missing are computed."""
    missing = [task for task in tasks if not (folder / task.file).is_file()]
    with work_executor(workers) as executor:
        running = [
            executor.submit(write_samples, task, compare, folder / task.file) for task in missing
        ]
        for number, (task, made) in enumerate(zip(missing, running, strict=True)):
            stages.note(
                f"{task.run.hypothesis.name}, width {task.run.width:g}", number / len(missing)
            )
            made.result()
    return {task: _read_samples(task, folder / task.file) for task in tasks}


def write_samples(task: Task, compare: Comparison, path: Path) -> None:
    """Compute the posterior of a task and write its file."""
    import numpy as np

    from carrierflex.workflows.papers.gap_laplace import laplace
    from carrierflex.workflows.papers.gap_posterior import sample

    run = task.run
    rng = np.random.default_rng([task.seed, *run.file.encode()])
    if task.method == "nested":
        samples = sample(run.hypothesis, compare, run.width, rng)
    else:
        samples = laplace(
            run.hypothesis, compare, run.width, rng, draws=_is_compared(run), starts=task.starts
        )
    save_json(
        path,
        {
            "hypothesis": run.hypothesis.name,
            "width": run.width,
            **task.inputs,
            "points": samples.points,
            "numbers": samples.numbers,
            "log_volume": samples.log_volume,
            "laplace_evidence": [
                [*choice, value] for choice, value in samples.laplace_evidence.items()
            ],
            "versions": versions(),
        },
    )


def _read_samples(task: Task, path: Path) -> Samples:
    """Read the file of a task."""
    import numpy as np

    from carrierflex.files.json_files import read_json
    from carrierflex.workflows.papers.gap_posterior import Samples

    content = read_json(path, "samples of a hypothesis")
    try:
        for name, expected in task.inputs.items():
            if content[name] != expected:
                raise ValueError(
                    f"{path} has {name} {content[name]}; expected {expected}: remove the file to "
                    "compute it again, or choose another --out"
                )
        points, numbers, log_volume = (
            np.array(content[name], dtype=float) for name in ("points", "numbers", "log_volume")
        )
        evidence = {(error, window): value for error, window, value in content["laplace_evidence"]}
    except (KeyError, TypeError) as error:
        raise ValueError(
            f"{path} does not hold samples of a hypothesis; remove it to compute it again"
        ) from error
    return Samples(task.run.hypothesis, points, numbers, log_volume, evidence)


def _gap(
    method: str,
    body: StageBody,
    compare: Comparison,
    samples: Mapping[Task, Samples],
    seed: int,
) -> PapersGap:
    """What the posteriors say."""
    import numpy as np

    from carrierflex.workflows.papers import gap_results as results
    from carrierflex.workflows.papers.gap_laplace import most_probable
    from carrierflex.workflows.papers.gap_posterior import (
        COMPARED,
        GROUND,
        HYPOTHESES,
        KINK,
        NAMES,
        PUBLISHED,
        SAMPLED_ERROR,
    )

    rng = np.random.default_rng(seed)
    runs = {task.run: of for task, of in samples.items() if task.method == method}
    by_name = {run.hypothesis.name: of for run, of in runs.items() if run.width == 1.0}
    checked = {
        task.run.hypothesis.name: of.log_evidence(SAMPLED_ERROR)
        for task, of in samples.items()
        if task.method != method
    }
    values = {name: most_probable(of, compare, SAMPLED_ERROR) for name, of in by_name.items()}
    numbers = {
        hypothesis.name: compare.numbers(hypothesis, values[hypothesis.name])
        for hypothesis in HYPOTHESES
    }
    compared = [by_name[name] for name in COMPARED]
    draws = {of.hypothesis: results.drawn(of, rng) for of in compared}
    predicted = {
        hypothesis.name: results.predictions(compare, hypothesis, points)
        for hypothesis, points in draws.items()
    }
    deviation = max(
        results.largest_deviation(compare, body, hypothesis, points[:_N_CHECKED])
        for hypothesis, points in draws.items()
    )
    face = HYPOTHESES[0]
    pairs = [*((face.name, other.name) for other in HYPOTHESES[1:]), (GROUND, KINK)]
    return PapersGap(
        method=method,
        best=face.name,
        order=tuple(results.order(runs, first, second) for first, second in pairs),
        predictions=results.prediction_rows(predicted),
        causes=results.causes_rows(compare, face, values[face.name]),
        evidence=results.evidence(runs),
        names=(*NAMES, "order 1, LC3"),
        published=PUBLISHED,
        values=values,
        numbers=numbers,
        left_out=results.left_out_rows(compared),
        laplace_evidence={
            of.hypothesis.name: of.log_evidence(SAMPLED_ERROR)
            for of in compared
            if of.laplace_evidence
        },
        nested_evidence=checked,
        largest_deviation=deviation,
    )


def _write(folder: Path, gap: PapersGap, inputs: Mapping[str, Any]) -> None:
    from carrierflex.workflows.papers.gap_page import gap_figure, gap_page

    save_json(folder / RESULT_FILE, {"gap": gap, "inputs": inputs, "versions": versions()})
    save_text(folder / PAGE_FILE, gap_page(gap, inputs))
    save_figure(folder / PICTURE_FILE, gap_figure(gap))
