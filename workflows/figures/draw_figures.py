"""Every figure of both papers by its number, from this project's own runs.

A good answer: an engineer who knows the papers recognises each figure, and the index tells of each
what it proves and what it was told.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypedDict

from carrierflex.files.json_files import save_json, save_text
from carrierflex.files.versions import Versions, versions
from carrierflex.workflows.outputs import prepared_folder, save_figure
from carrierflex.workflows.progress import Stages

if TYPE_CHECKING:
    from carrierflex.workflows.figures.paper_figure import PaperFigure
    from carrierflex.workflows.figures.shared_runs import SharedRuns

#: Shared runs in words, in the order they are made.
_RUNS = {
    "flexible": "carrier without pins: mesh, matrices, load cases",
    "stiff": "carrier with bonded pins: mesh, matrices, load cases",
    "bodies": "reduction of carrier, pin and main shaft",
    "stage": "LC1 to LC4 in time, identified and simulated",
    "torque_sweep": "torque sweep of the stage",
    "mounting": "load history of 2011, three bushing models identified and searched",
}


@dataclass(frozen=True, eq=False)
class DrawnFigures:
    """Figures that were drawn, and the folder they stand in."""

    figures: tuple[PaperFigure, ...]
    folder: Path


def main(
    *,
    out: Path,
    paper: Literal["2011", "2012"] | None = None,
    only: tuple[str, ...] = (),
    size: float = 0.04,
    duration: float = 5.5,
    evaluations: int = 1000,
    quiet: bool = False,
) -> DrawnFigures:
    """Draw the figures of the papers of 2011 and 2012 by their numbers, with an index.

    Parameters
    ----------
    out
        Folder to write: index.html, figures.json and a picture a figure (2012_figure_05.png ...).
    paper
        Draw the figures of one paper only.
    only
        Draw these figures only, --only 2012-5 --only 2011-9.
    size
        Element edge length [m] of carrier, pins and main shaft.
    duration
        Length of the stage's runs [s]; two revolutions take 5.43 s.
    evaluations
        Simulations that each search by the complex method may take.
    quiet
        Show no progress.

    Returns
    -------
    DrawnFigures
        What was drawn.

    Raises
    ------
    ValueError
        Where there is no figure of a number, or a run would be shorter than two revolutions.
    """
    chosen = _chosen_figures(paper, only)
    _refuse_runs(duration, evaluations)
    folder = prepared_folder(out)

    from carrierflex.workflows.figures.index_page import index_page
    from carrierflex.workflows.figures.shared_runs import SharedRuns

    shared = SharedRuns(size, duration, evaluations)
    needed = [name for name in _RUNS if any(name in figure.needs for figure in chosen)]
    stages = Stages(len(needed) + len(chosen) + 1, quiet)
    for name in needed:
        with stages.stage(_RUNS[name]):
            getattr(shared, name)
    for figure in chosen:
        with stages.stage(f"figure {figure.name}: {figure.title}"):
            save_figure(folder / figure.file, figure.draw(shared))
    with stages.stage(f"writing {out}"):
        save_text(folder / "index.html", index_page(chosen, size))
        inputs = {"element_size": size, "duration": duration, "evaluations": evaluations}
        save_json(
            folder / "figures.json",
            {
                "figures": {figure.name: figure.file for figure in chosen},
                "numbers": _numbers(shared, needed),
                "seconds": stages.seconds,
                "inputs": inputs,
                "versions": versions(),
            },
        )
    return DrawnFigures(chosen, folder)


def _numbers(shared: SharedRuns, needed: Sequence[str]) -> dict[str, object]:
    """What the papers print in tables beside the figures that were drawn, from the same runs."""
    from carrierflex.workflows.figures.mounting_figures import accuracy
    from carrierflex.workflows.figures.shared_runs import LABELS
    from carrierflex.workflows.identification.identify_bushings import fitted_parameters

    numbers: dict[str, object] = {}
    if "stage" in needed:
        numbers["table 4 of 2012, RMS in m"] = {
            load_case: {name: runs[load_case].rms for name, runs in shared.stage.estimates.items()}
            for load_case in shared.stage.estimates["m1"]
        }
    if "mounting" in needed:
        numbers["table 2 of 2011, accuracy"] = accuracy(shared.mounting)
        numbers["objective of the complex method over least squares"] = {
            label: shared.mounting.searches[model].cost / shared.mounting.estimates[model].fit.cost
            for model, label in LABELS.items()
        }
        numbers["table 3 of 2011, SI"] = {
            label: fitted_parameters(estimate)
            for model, label in LABELS.items()
            for estimate in [shared.mounting.estimates[model]]
        }
    return numbers


def _chosen_figures(paper: str | None, only: Sequence[str]) -> tuple[PaperFigure, ...]:
    """Figures of a paper, or of both, reduced to the named ones where there are any."""
    from carrierflex.workflows.figures.index_page import FIGURES

    offered = {figure.name: figure for figure in FIGURES if paper in (None, figure.paper)}
    for name in only:
        if name not in offered:
            raise ValueError(
                f"--only {name}: no such figure{f' in the paper of {paper}' if paper else ''}; "
                f"expected one of {', '.join(offered)}"
            )
    return tuple(figure for name, figure in offered.items() if not only or name in only)


def _refuse_runs(duration: float, evaluations: int) -> None:
    # Two revolutions at 22.1 rpm.
    if not duration >= 2.0 * 60.0 / 22.1:
        raise ValueError(
            f"--duration is {duration} s; expected at least 5.43 s, two revolutions of the carrier"
        )
    if evaluations < 100:
        raise ValueError(f"--evaluations is {evaluations}; expected at least 100")


class FiguresDocument(TypedDict):
    """figures.json, written by figures."""

    figures: Annotated[Mapping[str, str], "File by figure"]
    numbers: Annotated[Mapping[str, Any], "Tables that go with the figures"]
    seconds: Annotated[Mapping[str, float], "Time by stage [s]"]
    inputs: Annotated[Mapping[str, Any], "Options"]
    versions: Versions
