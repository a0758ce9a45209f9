"""What the main job found, told once and in the order of the chain, and which files to open."""

from typing import TYPE_CHECKING

from rich.console import Group, RenderableType
from rich.text import Text

from carrierflex.diagnosis.comparison.effect_names import plain_name
from carrierflex.diagnosis.report.gap_words import place_words
from carrierflex.diagnosis.report.verdict_words import verdict_heading, worth
from carrierflex.diagnosis.report.words import capitalised, listed
from carrierflex.workflows.screen.tables import curve_table, rms_table
from carrierflex.workflows.screen.titled_table import titled_table as _table

if TYPE_CHECKING:
    from carrierflex.workflows.main_job.job import Job

#: What to open first, and what it shows.
_FILES_TO_OPEN = {
    "gap/report.html": "where the gap lies, what is missing",
    "pictures/deflection_curves.png": "the rim with and without pins",
    "summary.json": "every figure and check",
}


def job_story(job: "Job") -> RenderableType:
    """Carrier, motion in time, load cases, gap, checks, and the three files to open."""
    shown = (
        _chapter("1. The carrier: how its rim deflects under torque"),
        curve_table(job.curves),
        _mesh_study(job),
        _chapter("2. The reduced bodies in time"),
        _in_time(job),
        _chapter("3. Load cases LC1 to LC4: what the 2012 paper's models M1 and M2 leave of them"),
        rms_table(job.identified),
        _chapter("4. The gap: a rigid, aligned carrier against the load cases"),
        *_gap(job),
        _chapter("5. Checks"),
        _checks(job),
        _chapter("Open these three"),
        *_files(job),
    )
    return Group(*shown)


def _chapter(title: str) -> Text:
    return Text(f"\n{title}", style="bold")


def _mesh_study(job: "Job") -> RenderableType:
    study = job.mesh_study
    orders = job.summary["mesh_study"]["orders"]
    columns = [f"{variant} {order}" for variant in ("flexible", "stiff") for order in orders]
    table = _table("mesh study, um per kN m", "size, m", "unknowns", *columns)
    for row, (size, n_dofs) in enumerate(zip(study.sizes, study.n_dofs, strict=True)):
        values = (*study.flexible[row], *study.stiff[row])
        table.add_row(f"{size:g}", str(n_dofs), *(f"{value * 1e6:.4f}" for value in values))
    limits = job.summary["mesh_study"]["limit_um_per_knm"]
    if limits:
        values = (*limits["flexible"], *limits["stiff"])
        table.add_row("0, by a line", "", *(f"{value:.4f}" for value in values))
    return table


def _in_time(job: "Job") -> str:
    moment = job.summary["tilting_moment_nm"]
    figures = job.summary["in_time"]
    order = job.summary["mesh_study"]["orders"][0]
    amplitude = figures[f"order_{order}_um_per_knm"]
    return (
        f"{figures['revolutions']:.0f} revolutions at {figures['torque_nm'] / 1e3:.0f} kN m: "
        f"order {order} at the axial sensors {amplitude:.3f} um per kN m, load "
        f"shares {100.0 * figures['smallest_load_share']:.1f} to "
        f"{100.0 * figures['largest_load_share']:.1f} %, roll of the housing "
        f"{figures['housing_roll_mrad']:.1f} mrad (stage/in_time.png); roll in the mounting's "
        f"record up to {figures['mounting_largest_roll_mrad']:.1f} mrad "
        "(mounting/housing_motion.png). Tilting moment of 1 kN m: "
        f"{moment['computed']:.2f} N m (the paper prints {moment['paper']})."
    )


def _gap(job: "Job") -> list[RenderableType]:
    """The named effects in turn, then how far those of the paper's models go alone."""
    diagnosis, of_paper = job.gap.diagnosis, job.gap.in_turn
    steps = diagnosis.reduction.steps if diagnosis.reduction else ()
    table = _table("as effects are added", "effect", "RMS, um", "of the gap", "in M1 or M2")
    for step in steps:
        inside = "yes" if step.added in of_paper.effects else ""
        size = f"{step.rms * 1e6:.1f}"
        table.add_row(plain_name(step.added), size, f"{100.0 * step.rho:.0f} %", inside)
    table.add_row("noise floor", f"{of_paper.noise_floor * 1e6:.1f}", "", "")
    added = [step.added for step in steps[1:]]
    beyond = [plain_name(effect) for effect in added if effect not in of_paper.effects]
    names = listed([plain_name(effect) for effect in of_paper.effects])
    alone = (
        f"All that M1 and M2 hold ({names}) goes "
        f"from {of_paper.rms[0] * 1e6:.1f} to {of_paper.rms[-1] * 1e6:.1f} um"
    )
    why = f": {listed(beyond)} are in neither." if beyond else "."
    where = capitalised(place_words(diagnosis.gap.findings)) if diagnosis.gap else ""
    return [
        f"Where: {where}.",
        table,
        alone + why,
        f"{verdict_heading(diagnosis)}. Reason: {diagnosis.reason}.",
        worth(diagnosis),
    ]


def _checks(job: "Job") -> RenderableType:
    checks = _table("", "figure", "required", "actual", "pass")
    for row in job.summary["checks"]:
        met = "yes" if row["met"] else Text("no", style="red")
        checks.add_row(row["check"], row["wanted"], f"{row['reached']:.3g}", met)
    return checks


def _files(job: "Job") -> list[RenderableType]:
    seconds = sum(job.summary["seconds"].values())
    memory = job.summary["peak_memory_gb"]
    paths = {str(job.folder / name): words for name, words in _FILES_TO_OPEN.items()}
    width = max(len(path) for path in paths)
    lines = [f"{path:<{width}}  {words}" for path, words in paths.items()]
    all_of_it = (
        f"\nEverything is in {job.folder} ({seconds:.0f} s, at most {memory:.1f} GB of memory)"
    )
    # A path that is broken into two lines can't be copied from the screen.
    return [Text(line, no_wrap=True, overflow="ignore") for line in (*lines, all_of_it)]
