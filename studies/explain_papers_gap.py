"""Which unmodelled effect explains tables 4 and 5 of the 2012 paper, by a posterior.

Hypotheses on what turns once a revolution, on what the sensors stand on, on the unpublished
supports and on the static saddle are put into the statics of the stage and held against everything
published of this gearbox family; nested sampling (dynesty) gives the evidence of each:

    python -m studies.explain_papers_gap --out papers_gap

writes a file of samples a hypothesis and width of the priors under ``runs`` (made where it is
missing), papers_gap.json, papers_gap.md and papers_gap.png. A good answer: an order of hypotheses
that outlasts the choice of errors and priors, or the words "not decided" and the measurement that
would decide.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from carrierflex.files.json_files import save_json
from carrierflex.files.versions import versions
from carrierflex.simulation.stage.stage_body import StageBody
from carrierflex.workflows.executors import work_executor
from carrierflex.workflows.outputs import prepared_folder, save_figure
from carrierflex.workflows.progress import Stages
from carrierflex.workflows.simulation.stage_bodies import default_stage_body
from studies import papers_gap_tables as tables
from studies.case_files import make_missing, read_case, write_table
from studies.papers_gap_posterior import (
    FACE,
    GROUND,
    HYPOTHESES,
    KINK,
    NAMES,
    RUNS,
    SAMPLED_ERROR,
    Comparison,
    Run,
    Samples,
    comparison,
    most_probable,
    sample,
)

#: Bending stiffness of a pin interface that meets the rim deflection of table 4 [N m/rad].
PIN_FIT = 1.7e7
#: Samples of a posterior at which the condensed statics are checked against the stage's.
_N_CHECKED = 4


def write_run(compare: Comparison, seed: int, run: Run, path: Path) -> None:
    """Sample a run and write its file."""
    rng = np.random.default_rng([seed, *run.file.encode()])
    samples = sample(run.hypothesis, compare, run.width, rng)
    save_json(
        path,
        {
            "hypothesis": run.hypothesis.name,
            "width": run.width,
            "seed": seed,
            "parameters": list(run.hypothesis.priors),
            "points": samples.points,
            "numbers": samples.numbers,
            "log_volume": samples.log_volume,
            "versions": versions(),
        },
    )


def read_run(run: Run, seed: int, path: Path) -> Samples:
    """Read the file of a run.

    Raises
    ------
    ValueError
        Where the file is of another seed or has other parameters.
    """
    expected = {"seed": seed, "parameters": list(run.hypothesis.priors)}

    def samples_of(content: dict[str, Any]) -> Samples:
        for name, value in expected.items():
            if content[name] != value:
                raise ValueError(
                    f"{path} has {name} {content[name]}; expected {value}: remove the file to "
                    "make it again, or choose another --out"
                )
        arrays = (np.array(content[name]) for name in ("points", "numbers", "log_volume"))
        return Samples(run.hypothesis, *arrays)

    return read_case(path, "samples of a hypothesis", samples_of)


def main(
    *, out: Path, size: float = 0.045, seed: int = 2012, workers: int = 1, quiet: bool = False
) -> None:
    """Sample every hypothesis and write the tables and pictures of docs/papers.md.

    Parameters
    ----------
    out
        Folder; runs that are there are read.
    size
        Element edge length of carrier and pins [m].
    seed
        Of the sampler.
    workers
        Processes.
    quiet
        Show no progress.
    """
    folder, stages = prepared_folder(out), Stages(3, quiet)
    (folder / "runs").mkdir(exist_ok=True)
    with stages.stage(f"reduced carrier and pins, elements of {size} m"):
        body = default_stage_body(PIN_FIT, size)
        compare = comparison(body)
    files = [folder / "runs" / run.file for run in RUNS]
    with stages.stage(f"{len(RUNS)} runs"), work_executor(workers) as executor:
        make_missing(RUNS, files, partial(write_run, compare, seed), executor, stages)
    runs = {run: read_run(run, seed, file) for run, file in zip(RUNS, files, strict=True)}
    with stages.stage(f"writing {out}"):
        _write(folder, body, compare, runs, np.random.default_rng(seed))


def _write(
    folder: Path,
    body: StageBody,
    compare: Comparison,
    runs: Mapping[Run, Samples],
    rng: np.random.Generator,
) -> None:
    """Write tables, picture and papers_gap.json."""
    by_name = {run.hypothesis.name: samples for run, samples in runs.items() if run.width == 1.0}
    values = {
        samples.hypothesis: most_probable(samples, compare, SAMPLED_ERROR)
        for samples in by_name.values()
    }
    best = {hypothesis: compare.numbers(hypothesis, of) for hypothesis, of in values.items()}
    compared = [by_name[name] for name in (FACE, GROUND, KINK)]
    draws = {samples.hypothesis: tables.drawn(samples, rng) for samples in compared}
    predicted = {
        hypothesis.name: tables.predictions(compare, hypothesis, points)
        for hypothesis, points in draws.items()
    }
    deviation = max(
        tables.largest_deviation(compare, body, hypothesis, points[:_N_CHECKED])
        for hypothesis, points in draws.items()
    )
    face = by_name[FACE].hypothesis
    names = [hypothesis.name for hypothesis in HYPOTHESES]
    sections = {
        "Evidence": tables.evidence_table(runs),
        "Order": [
            f"- {tables.verdict(runs, first, second)}"
            for first, second in (*((FACE, name) for name in names[1:]), (GROUND, KINK))
        ],
        "Most probable values": tables.numbers_table(best),
        "Left out": tables.left_out_table(compared),
        "Predictions": tables.prediction_table(predicted),
        "Causes": tables.causes_table(compare, face, values[face]),
        "Check": [f"condensed statics less the stage's, at most {deviation:.1e} of a number"],
    }
    lines = [line for name, table in sections.items() for line in (f"## {name}", "", *table, "")]
    write_table(folder / "papers_gap.md", lines)
    save_figure(folder / "papers_gap.png", tables.gap_figure(runs, best, predicted))
    save_json(
        folder / "papers_gap.json",
        {
            "most_probable": {hypothesis.name: of for hypothesis, of in values.items()},
            "numbers": {hypothesis.name: list(of) for hypothesis, of in best.items()},
            "names": [*NAMES, "order 1, LC3"],
            "largest_deviation": deviation,
            "versions": versions(),
        },
    )


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)
